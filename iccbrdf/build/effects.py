"""The table of effects: what a proof may simulate or leave out, by the names that people use.

Public names have dashes (`chromatic-specular`); underscores, as the templates write them, are accepted.  Not
every model has every effect: Ward has no Fresnel term, and BRDF1 has one roughness.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Literal

from iccbrdf.build.models import MODELS
from iccbrdf.calc import compile_template
from iccbrdf.errors import UsageError, nearest
from iccbrdf.resources import folder

Holder = Literal["MVIS", "colour MID"]
"""Which program an effect is part of."""

MVIS: Holder = "MVIS"
COLOUR_MID: Holder = "colour MID"


@dataclass(frozen=True)
class Effect:
    """A switch of the build."""

    name: str
    text: str
    """What is simulated, and what stands in for it where it is left out."""
    program: Holder
    spares: bool = True
    """Whether a program without it is the shorter one."""

    @property
    def switch(self) -> str:
        """The name of the template's switch."""
        return self.name.replace("-", "_")


EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        Effect("specular", "gloss; without: diffuse reflection alone", MVIS),
        Effect("fresnel", "more gloss at grazing angles; without: the term is 1", MVIS),
        Effect("shadowing", "facets in each other's shadow; without: none is", MVIS),
        Effect("chromatic-specular", "ks for each of X, Y, Z; without: that of Y", MVIS),
        Effect("chromatic-roughness", "m for each of X, Y, Z (BRDF2); without: that of Y", MVIS),
        Effect("relief", "a normal for each pixel; without: all point along z", MVIS),
        Effect("below-horizon", "black where light or viewer are below the surface; without: none is", MVIS),
        Effect("highlight-range", "values above the white; without: held at it", MVIS, spares=False),
        Effect("slope", "colours change on slopes; without: as printed flat", COLOUR_MID),
        Effect("interpolation", "gloss by colour; without: that of one reference colour", COLOUR_MID),
    )
}
"""The effects by name, in the order in which they are told."""


def effect_names(names: Iterable[str]) -> list[str]:
    """Names as `EFFECTS` has them; UsageError where one is unknown, with the nearest that is there."""
    return [_known(name, EFFECTS, "there is no effect") for name in names]


def model_effects(model: str) -> tuple[str, ...]:
    """The effects that a model's prints may have, in the order of `EFFECTS`.

    `model` is a key of `MODELS`; the colour MID's effects are among them.
    """
    declared, fixed = _switches(MODELS[model].template), MODELS[model].effects
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if effect.program == COLOUR_MID or (effect.switch in declared and effect.switch not in fixed)
    )


def chosen_effects(
    model: str, effects: Collection[str] | None = None, without: Collection[str] = ()
) -> dict[str, bool]:
    """Which effects of a model are simulated.

    Parameters
    ----------
    model
        Key of `MODELS`.
    effects
        Names of those to simulate; default: all.
    without
        Names of those to leave out.

    Raises
    ------
    UsageError
        A name is unknown, or an effect of other models.
    """
    valid = model_effects(model)
    complaint = f"{MODELS[model].title} has no effect"
    only = None if effects is None else [_known(name, valid, complaint) for name in effects]
    left_out = [_known(name, valid, complaint) for name in without]
    return {name: name not in left_out and (only is None or name in only) for name in valid}


def _known(name: str, valid: Collection[str], complaint: str) -> str:
    found = name.replace("_", "-")
    if found not in valid:
        raise UsageError(f"{complaint} {name!r}: {nearest(found, valid)}")
    return found


@cache
def _switches(template: str) -> Collection[str]:
    text = (folder("calc_templates") / template).read_text(encoding="utf-8")
    return compile_template(text, filename=template).effects
