"""The plan of an image: what the effects that it calls for are, the profiles of those alone, and the check.

The image is read once for the plan, once more for the check.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import Array
from iccbrdf.build.colour_mid import DEVICE, ColourMid
from iccbrdf.build.pair import Pair
from iccbrdf.build.plan import FULL, Decision, Decoder, Finding, Planner, Samples, Way
from iccbrdf.build.profiles import XYZ_RANGE
from iccbrdf.build.recipe import Recipe
from iccbrdf.build.spans import Directions
from iccbrdf.cmm import link
from iccbrdf.errors import UsageError
from iccbrdf.icc import Profile
from iccbrdf.images import ImageSource, Place


@dataclass(frozen=True)
class Built:
    """The profiles for one kind of image."""

    pair: Pair
    colour: ColourMid | None

    @property
    def chain(self) -> list[Profile]:
        """From the image to XYZ."""
        return [self.colour.mid if self.colour else self.pair.mid, self.pair.mvis]

    @property
    def files(self) -> dict[str, bytes]:
        """What is written to a folder, by file name."""
        return self.pair.files | (self.colour.files if self.colour else {})

    @property
    def executed(self) -> int:
        """Operators for a pixel at most."""
        return self.pair.compiled.executed + (self.colour.compiled.executed if self.colour else 0)


@dataclass(frozen=True)
class ScenePlan:
    """What an image calls for under some lights and a view.

    findings, decision: of each effect, and of all that are left out together.
    is_colour: whether the image holds XYZ, for a colour MID, rather than parameters.
    names: its channels.
    full, reduced: the profiles with all effects, and with those alone that the scene calls for.
    seconds: spent on `reading` the image, on `decoding` it to parameters, and on `bounding`.
    """

    recipe: Recipe
    findings: tuple[Finding, ...]
    decision: Decision
    tolerance: float
    is_colour: bool
    names: tuple[str, ...]
    full: Built
    reduced: Built
    seconds: Mapping[str, float]


def plan_image(
    source: ImageSource,
    recipe: Recipe,
    lights: Directions,
    view: Directions,
    *,
    tolerance: float = 0.0,
    env: Mapping[str, float] | None = None,
    names: Sequence[str] | None = None,
) -> ScenePlan:
    """
    Plan which effects an image calls for.

    Parameters
    ----------
    source
        A BRDF image (the parameters of the recipe's model, perhaps normals) or XYZ and normals.
    recipe
        What the profiles are made of.
    lights, view
        Directions: lights are points or ranges, of views there is one.
    tolerance
        CIEDE2000 that may be lost; 0: float32 rounding alone.
    env
        Further run-time variables (`litI`, `ambI`).
    names
        The image's channels, where it does not say them itself.

    Raises
    ------
    UsageError
        The channels fit neither kind of image.
    """
    pair = recipe.pair()
    names = _names(source, pair.compiled.inputs, names)
    is_colour = set("XYZ") <= set(names)
    places = list(source.places())
    seconds = {"reading": 0.0}
    first = _timed_read(source, places[0], seconds)
    reference = _mean_XYZ(first, names, source.samples) if is_colour else None

    def made(without: Collection[str], note: str = "") -> Built:
        # An angle for a term that is left out would be a contradiction.
        less = replace(recipe, fresnel_angle=None) if "fresnel" in without else recipe
        if not is_colour:
            return Built(less.pair(without, device=pair.compiled.inputs, note=note), None)
        colour = less.colour_mid(without, reference=reference, device=DEVICE, note=note)
        return Built(less.pair(without, note=note) if without else pair, colour)

    full = made(())
    decoders = {
        way: _decoder(made(way) if way else full, names, source.samples) for way in _ways(recipe, is_colour)
    }
    defaults = dict(zip(pair.compiled.inputs, pair.compiled.defaults, strict=True))
    planner = Planner(recipe.reflection(env or {}), decoders, defaults, lights, view, tolerance)
    for place in places:
        data = first if place is places[0] else _timed_read(source, place, seconds)
        planner.look(place.y0, place.x0, data)
    decision = planner.decide(lambda without: made(without).executed)
    return ScenePlan(
        recipe,
        planner.findings(decision),
        decision,
        tolerance,
        is_colour,
        names,
        full,
        made(decision.without, _note(decision)) if decision.without else full,
        {**seconds, **planner.seconds},
    )


@dataclass(frozen=True)
class Check:
    """How far the reduced proof of an image is from the full one, both in float32.

    dE: the largest CIEDE2000; place: row and column of its pixel; relative: the largest difference of XYZ by
    the larger of the two values, which tells rounding from loss; scenes: how many sets of run-time variables
    it was looked for under.
    """

    dE: float
    place: tuple[int, int]
    relative: float
    scenes: int


def check_image(source: ImageSource, plan: ScenePlan, environments: Sequence[Mapping[str, float]]) -> Check:
    """Run the image through the full and the reduced profiles, under each set of run-time variables."""
    transforms = [
        link(built.chain, channels=plan.names, samples=source.samples) for built in (plan.full, plan.reduced)
    ]
    white = plan.recipe.primaries.white
    worst = Check(0.0, (0, 0), 0.0, len(environments))
    for place in source.places():
        data = source.read(place).data
        for env in environments:
            one, other = (
                transform.with_env({name: env[name] for name in env if name in transform.variables})(data)
                for transform in transforms
            )
            dE = _distances(one, other, white)
            y, x = np.unravel_index(np.argmax(dE), dE.shape)
            relative = max(worst.relative, _relative(one, other))
            if dE[y, x] > worst.dE:
                worst = Check(float(dE[y, x]), (place.y0 + int(y), place.x0 + int(x)), relative, worst.scenes)
            worst = replace(worst, relative=relative)
    return worst


def _distances(one: Samples, other: Samples, white: tuple[float, ...]) -> Array:
    """CIEDE2000 of two images of XYZ; 0 where both are the same, whatever that is."""
    with np.errstate(all="ignore"):
        dE = delta_E_CIE2000(XYZ_to_Lab(one, white), XYZ_to_Lab(other, white))
    same = np.all((one == other) | (np.isnan(one) & np.isnan(other)), axis=-1)
    return np.where(same, 0.0, np.where(np.isnan(dE), np.inf, dE))


def _relative(one: Samples, other: Samples) -> float:
    with np.errstate(all="ignore"):
        ratio = np.abs(one - other) / np.maximum(np.abs(one), np.abs(other))
    return float(np.max(ratio, where=~np.isnan(ratio), initial=0.0))


def _names(source: ImageSource, own: Sequence[str], declared: Sequence[str] | None) -> tuple[str, ...]:
    """The channels of an image, which may go without names where their number is that of a MID's."""
    named = declared or source.names
    if named is not None:
        if len(named) != source.channels:
            raise UsageError(f"{len(named)} channels are named, the image has {source.channels}")
        return tuple(named)
    for names in (own, DEVICE):
        if source.channels == len(names):
            return tuple(names)
    raise UsageError(
        f"the image has {source.channels} channels without names, expected {len(own)} ({', '.join(own)}) or "
        f"{len(DEVICE)} ({', '.join(DEVICE)}); name them with --channels"
    )


def _ways(recipe: Recipe, is_colour: bool) -> list[Way]:
    """Which of slope and interpolation there are to leave out."""
    if not is_colour:
        return [FULL]
    ways = [FULL, Way({"interpolation"})]
    return ways if recipe.slopes is None else [*ways, *(way | {"slope"} for way in ways)]


def _note(decision: Decision) -> str:
    loss = "no loss" if decision.exact else f"CIEDE2000 at most {decision.bound:.3g}"
    return f", reduced for a scene: without {', '.join(decision.without)} ({loss})"


def _decoder(built: Built, names: tuple[str, ...], samples: str) -> Decoder:
    mid = built.colour.mid if built.colour else built.pair.mid
    transform = link([mid], channels=names, samples=samples, dtype=np.float64)
    return Decoder(transform.channels_out, transform)


def _timed_read(source: ImageSource, place: Place, seconds: dict[str, float]) -> Samples:
    begun = time.perf_counter()
    data = source.read(place).data
    seconds["reading"] += time.perf_counter() - begun
    return data


def _mean_XYZ(data: Samples, names: Sequence[str], samples: str) -> tuple[float, ...]:
    """Of the pixels of a block that have one."""
    XYZ = np.stack([data[..., names.index(axis)].ravel() for axis in "XYZ"], axis=-1).astype(np.float64)
    XYZ = XYZ[np.all(np.isfinite(XYZ), axis=-1)]
    mean = XYZ.mean(axis=0) * (XYZ_RANGE[1] if samples == "device" else 1.0) if len(XYZ) else np.zeros(3)
    return tuple(mean.tolist())
