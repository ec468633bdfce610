"""What profiles are made of, kept together so that the full and the reduced ones are made alike."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from numpy.typing import ArrayLike

from iccbrdf.brdf.primaries import Primaries
from iccbrdf.brdf.slopes import Slopes
from iccbrdf.build.bounds import Reflection
from iccbrdf.build.colour_mid import ColourMid, build_colour_mid
from iccbrdf.build.pair import Pair, build_pair


@dataclass(frozen=True)
class Recipe:
    """The arguments of `build_pair` and `build_colour_mid`, but for the effects."""

    primaries: Primaries
    slopes: Slopes | None = None
    interpolation: str = "smooth"
    slope_method: str = "affine"
    p: float = 2.0
    exponent: float = -1.0
    fresnel_angle: str | None = None
    variables: Mapping[str, float] = field(default_factory=dict)

    def pair(
        self,
        without: Collection[str] = (),
        *,
        effects: Collection[str] | None = None,
        device: Sequence[str] | None = None,
        note: str = "",
    ) -> Pair:
        """The binding MID and the MVIS."""
        return build_pair(
            self.primaries,
            effects=effects,
            without=without,
            fresnel_angle=self.fresnel_angle,
            variables=self.variables,
            device=device,
            note=note,
        )

    def colour_mid(
        self,
        without: Collection[str] = (),
        *,
        effects: Collection[str] | None = None,
        reference: ArrayLike | None = None,
        device: Sequence[str] | None = None,
        note: str = "",
    ) -> ColourMid:
        """The colour MID."""
        return build_colour_mid(
            self.primaries,
            interpolation=self.interpolation,
            slopes=self.slopes,
            slope_method=self.slope_method,
            p=self.p,
            exponent=self.exponent,
            effects=effects,
            without=without,
            reference=reference,
            device=device,
            note=note,
        )

    def reflection(self, env: Mapping[str, float]) -> Reflection:
        """What the bounds must know of the MVIS, under the run-time variables `env`."""
        model = self.primaries.model
        values = {"litI": 1.0 if model == "cook_torrance_2020" else math.pi, "ambI": 0.0}
        values |= self.variables
        values |= env
        return Reflection(
            model,
            self.primaries.white,
            self.primaries.refractive_index,
            self.fresnel_angle or "theta_i",
            values["litI"],
            values["ambI"],
        )
