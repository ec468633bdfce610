"""The plan of an image: what the effects that it calls for are, the profiles of those alone, and the check.

The image is read once for the plan, once more for the check.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import Array
from iccbrdf.build.cells import FULL, Way
from iccbrdf.build.colour_mid import DEVICE, ColourMid
from iccbrdf.build.pair import Pair
from iccbrdf.build.plan import Decision, Decoder, Finding, Planner, Samples
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

    planning: the image, and what its profiles are made of.
    findings, decision: of each effect, and of all that are left out together.
    seconds: spent on `reading` the image, on `decoding` it to parameters, and on `bounding`.
    """

    planning: Planning
    findings: tuple[Finding, ...]
    decision: Decision
    tolerance: float
    seconds: Mapping[str, float]

    @property
    def full(self) -> Built:
        """The profiles with all effects."""
        return self.planning.built()

    @cached_property
    def reduced(self) -> Built:
        """The profiles with those effects alone that the scene calls for, which say so."""
        without, exact = self.decision.without, self.decision.exact
        if not without:
            return self.full
        loss = "no loss" if exact else f"CIEDE2000 at most {self.decision.bound:.3g}"
        return self.planning.built(without, f", reduced for a scene: without {', '.join(without)} ({loss})")


class Planning:
    """An image and what its profiles are made of, to be planned under any lights.

    Parameters
    ----------
    source
        A BRDF image (the parameters of the recipe's model, perhaps normals) or XYZ and normals.
    recipe
        What the profiles are made of.
    names
        The image's channels, where it does not say them itself.

    Raises
    ------
    UsageError
        The channels fit neither kind of image.
    """

    def __init__(self, source: ImageSource, recipe: Recipe, names: Sequence[str] | None = None) -> None:
        self.source, self.recipe = source, recipe
        self._built: dict[tuple[frozenset[str], str], Built] = {}
        self._pair = recipe.pair()
        self.names = _names(source, self._pair.compiled.inputs, names)
        self.is_colour = set("XYZ") <= set(self.names)
        """Whether the image holds XYZ, for a colour MID, rather than parameters."""
        self._reference: tuple[float, ...] | None = None

    def built(self, without: Collection[str] = (), note: str = "") -> Built:
        """The profiles less some effects, with a note in their descriptions."""
        key = frozenset(without), note
        if key not in self._built:
            colour, device = None, None
            if self.is_colour:
                colour = self.recipe.colour_mid(without, reference=self._reference, device=DEVICE, note=note)
            else:
                device = self._pair.compiled.inputs
            self._built[key] = Built(self.recipe.pair(without, device=device, note=note), colour)
        return self._built[key]

    def plan(
        self,
        lights: Directions,
        view: Directions,
        *,
        tolerance: float = 0.0,
        env: Mapping[str, float] | None = None,
    ) -> ScenePlan:
        """
        Plan which effects the image calls for, reading it once.

        Parameters
        ----------
        lights, view
            Directions: lights are points or ranges, of views there is one.
        tolerance
            CIEDE2000 that may be lost; 0: float32 rounding alone.
        env
            Further run-time variables (`litI`, `ambI`).
        """
        seconds = {"reading": 0.0}
        first = self._read(self._places[0], seconds)
        if self.is_colour and self._reference is None:
            self._reference = _mean_XYZ(first, self.names, self.source.samples)
        compiled = self._pair.compiled
        planner = Planner(
            self.recipe.reflection(env or {}),
            self._decoders,
            dict(zip(compiled.inputs, compiled.defaults, strict=True)),
            lights,
            view,
            tolerance,
        )
        for place in self._places:
            data = first if place is self._places[0] else self._read(place, seconds)
            planner.look(place.y0, place.x0, data)
        decision = planner.decide(lambda without: self.built(without).executed)
        return ScenePlan(
            self, planner.findings(decision), decision, tolerance, {**seconds, **planner.seconds}
        )

    @cached_property
    def _places(self) -> list[Place]:
        return list(self.source.places())

    @cached_property
    def _decoders(self) -> dict[Way, Decoder]:
        """By what they leave out of slope and interpolation, as far as there is either."""
        ways = [FULL]
        if self.is_colour:
            ways.append(Way({"interpolation"}))
            if self.recipe.slopes is not None:
                ways += [way | {"slope"} for way in ways]
        decoders = {}
        for way in ways:
            settings: dict[str, Any] = {
                "channels": self.names,
                "samples": self.source.samples,
                "dtype": np.float64,
            }
            transform = link(self.built(way).chain[:1], **settings)
            decoders[way] = Decoder(transform.channels_out, transform)
        return decoders

    def _read(self, place: Place, seconds: dict[str, float]) -> Samples:
        begun = time.perf_counter()
        data = self.source.read(place).data
        seconds["reading"] += time.perf_counter() - begun
        return data


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


def check_image(plan: ScenePlan, environments: Sequence[Mapping[str, float]]) -> Check:
    """Run the image through the full and the reduced profiles, under each set of run-time variables."""
    source, names = plan.planning.source, plan.planning.names
    transforms = [
        link(built.chain, channels=names, samples=source.samples) for built in (plan.full, plan.reduced)
    ]
    white = plan.planning.recipe.primaries.white
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


def _mean_XYZ(data: Samples, names: Sequence[str], samples: str) -> tuple[float, ...]:
    """Of the pixels of a block that have one."""
    XYZ = np.stack([data[..., names.index(axis)].ravel() for axis in "XYZ"], axis=-1).astype(np.float64)
    XYZ = XYZ[np.all(np.isfinite(XYZ), axis=-1)]
    mean = XYZ.mean(axis=0) * (XYZ_RANGE[1] if samples == "device" else 1.0) if len(XYZ) else np.zeros(3)
    return tuple(mean.tolist())
