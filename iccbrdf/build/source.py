"""The private tag of what profiles are made from (`iccbrdf.icc.source_tag`): written, and compiled again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from iccbrdf.build.effects import EFFECTS
from iccbrdf.calc import compile_chain
from iccbrdf.errors import ProfileError
from iccbrdf.icc import Calculator, Profile
from iccbrdf.icc.layout import Record
from iccbrdf.icc.source_tag import SIGNATURE, CalculatorSource, Source, read_source

if TYPE_CHECKING:
    from iccbrdf.calc import Compiled


LEFT_OUT = "without"
"""In the recipe of a profile, the effects of its program that it was made without."""


def calculator_source(compiled: Compiled, tag: str, element: int = 0) -> CalculatorSource:
    """What calculator `element` of a tag is compiled from."""
    return CalculatorSource(
        tag,
        element,
        compiled.inputs,
        compiled.outputs,
        compiled.temporaries,
        compiled.templates,
        compiled.constants,
        compiled.effects,
        compiled.variables,
    )


def source_tags(recipe: Mapping[str, Any], *calculators: CalculatorSource) -> dict[str, Record]:
    """The tag of a profile that was made by `recipe`, under its signature."""
    return {SIGNATURE: Source(calculators, recipe).tag()}


def recompiled(source: CalculatorSource, switches: Mapping[str, bool] | None = None) -> Compiled:
    """A calculator compiled anew from what it was made of, some of its switches set otherwise.

    Raises
    ------
    InputError
        The source has a mistake, or lacks a switch.
    LimitError
        It makes too much work, or too large a program.
    """
    return compile_chain(
        source.templates,
        constants=source.constants,
        effects={**source.effects, **(switches or {})},
        variables=source.variables,
    )


def with_effects(
    profiles: Sequence[Profile], effects: Mapping[str, bool]
) -> tuple[list[Profile], frozenset[str]]:
    """
    Profiles whose programs are compiled anew with effects on or off.

    Parameters
    ----------
    profiles
        Those that hold no source stay as they are.
    effects
        By name (key of `EFFECTS`).  What a program takes and gives must not depend on them.

    Returns
    -------
    The profiles, and those of the effects that their programs know.

    Raises
    ------
    ProfileError, LimitError, InputError
        The source cannot be read or compiled, or it is not that of the program.
    """
    switches = {EFFECTS[name].switch: name for name in effects}
    changed: list[Profile] = []
    known: set[str] = set()
    for profile in profiles:
        source = read_source(profile)
        for calculator, one in source.found_in(profile):
            asked = {switch: effects[name] for switch, name in switches.items() if switch in one.effects}
            known.update(switches[switch] for switch in asked)
            if any(one.effects[switch] != on for switch, on in asked.items()):
                if recompiled(one).program != calculator.program:
                    raise ProfileError(
                        f"{profile.source}: tag {SIGNATURE}: the source does not compile to the program of "
                        f"tag {one.tag}, so that its effects cannot be switched"
                    )
                own = {switches[switch]: on for switch, on in asked.items()}
                profile = _replaced(profile, calculator, one, recompiled(one, asked), own)
        changed.append(profile)
    return changed, frozenset(known)


def left_out(recipe: Mapping[str, Any]) -> tuple[str, ...]:
    """The effects that a recipe says are left out, in the order of `EFFECTS`; unknown ones do not count."""
    names = recipe.get(LEFT_OUT)
    return tuple(name for name in EFFECTS if name in names) if isinstance(names, list) else ()


def _replaced(
    profile: Profile,
    calculator: Calculator,
    old: CalculatorSource,
    compiled: Compiled,
    effects: Mapping[str, bool],
) -> Profile:
    """The profile with another program in place of one, and the source of that, now that `effects` hold."""
    source, transform = read_source(profile), profile[old.tag]
    new = calculator_source(compiled, old.tag, old.element)
    program = replace(calculator, program=compiled.program)
    elements = tuple(program if element is calculator else element for element in transform.elements)
    calculators = tuple(new if one == old else one for one in source.calculators)
    before = left_out(source.recipe)
    gone = [name for name in EFFECTS if not effects.get(name, name not in before)]
    recipe = {**source.recipe, LEFT_OUT: gone}
    tags = {old.tag: replace(transform, elements=elements), **source_tags(recipe, *calculators)}
    return profile.replace(tags=tags)
