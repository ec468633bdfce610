"""The private tag of what profiles are made from (`iccbrdf.icc.source_tag`): written, and compiled again."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from iccbrdf.calc import Compiled, compile_chain
from iccbrdf.icc.layout import Record
from iccbrdf.icc.source_tag import SIGNATURE, CalculatorSource, Source


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


def recompiled(source: CalculatorSource, without: Collection[str] = ()) -> Compiled:
    """A calculator compiled anew from what it was made of, with the switches `without` off.

    Raises
    ------
    InputError
        The source has a mistake, or lacks the switch.
    LimitError
        It makes too much work, or too large a program.
    """
    return compile_chain(
        source.templates,
        constants=source.constants,
        effects={**source.effects, **dict.fromkeys(without, False)},
        variables=source.variables,
    )


def source_tags(recipe: Mapping[str, Any], *calculators: CalculatorSource) -> dict[str, Record]:
    """The tag of a profile that was made by `recipe`, under its signature."""
    return {SIGNATURE: Source(calculators, recipe).tag()}
