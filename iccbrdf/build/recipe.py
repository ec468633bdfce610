"""What profiles are made of, kept together so that the full and the reduced ones are made alike.

The private tag of a profile (`iccbrdf.icc.source_tag`) holds its part of the recipe: `build_pair` and
`build_colour_mid` write it, `recipe_of` puts the parts together again.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import ArrayLike

from iccbrdf.brdf.models import MODELS as SCIENCE
from iccbrdf.brdf.primaries import (
    ILLUMINANTS,
    OBSERVERS,
    REFRACTIVE_INDEX,
    Primaries,
    read_encoding,
    read_entries,
    read_white,
)
from iccbrdf.brdf.records import Record
from iccbrdf.brdf.slopes import Slopes
from iccbrdf.brdf.slopes import read_entries as read_slope_entries
from iccbrdf.build.bounds import Reflection
from iccbrdf.build.colour_mid import INTERPOLATIONS, SLOPE_METHODS, ColourMid, build_colour_mid
from iccbrdf.build.pair import FRESNEL_ANGLES, GEOMETRIES, Pair, build_pair
from iccbrdf.build.source import LEFT_OUT
from iccbrdf.errors import InputError, ProfileError, UsageError
from iccbrdf.icc import Profile
from iccbrdf.icc.source_tag import SIGNATURE, read_source


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
    geometry: str = "plain"
    variables: Mapping[str, float] = field(default_factory=dict)
    with_source: bool = True

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
            geometry=self.geometry,
            variables=self.variables,
            device=device,
            note=note,
            with_source=self.with_source,
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
            with_source=self.with_source,
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


def recipe_of(profiles: Sequence[Profile]) -> Recipe:
    """The recipe of a MID and the MVIS that it goes with, with all effects, whatever the profiles leave out.

    Raises
    ------
    UsageError
        A profile does not hold its part, there is no MID or no MVIS, or they were not made of the same.
    ProfileError
        The tag is malformed.
    """
    parts: dict[str, Any] = {}
    places: dict[str, str] = {}
    for profile in profiles:
        part = read_source(profile).recipe
        if not part:
            raise UsageError(
                f"{profile.source}: does not say what it was made of (tag {SIGNATURE}), as profiles of "
                "iccbrdf build do; give the primaries file instead (--primaries)"
            )
        for key, value in part.items():
            if key != LEFT_OUT and parts.setdefault(key, value) != value:
                raise UsageError(
                    f"{profile.source}: its {key} is not that of {places[key]}; expected a MID and the MVIS "
                    "that it goes with"
                )
            places.setdefault(key, profile.source)
    classes = [profile.header.device_class for profile in profiles]
    for device_class, name in (("mid ", "MID"), ("mvis", "MVIS")):
        if device_class not in classes:
            found = ", ".join(profile.source for profile in profiles)
            raise UsageError(f"{found}: found no {name}, expected a MID and the MVIS that it goes with")
    try:
        return _recipe(Record(", ".join(dict.fromkeys(places.values())), f"tag {SIGNATURE}", parts))
    except InputError as error:
        raise ProfileError(str(error)) from None


def _recipe(record: Record) -> Recipe:
    model = SCIENCE[record.choice("model", SCIENCE)]
    illuminant = record.choice("illuminant", ILLUMINANTS)
    observer = record.choice("observer", OBSERVERS)
    encoding = read_encoding(record, model)
    has = record.values.__contains__
    index = record.number("refractive_index", 1) if has("refractive_index") else REFRACTIVE_INDEX
    primaries = Primaries(
        model=model.name,
        illuminant=illuminant,
        observer=observer,
        white=read_white(record, illuminant, observer),
        geometry="",
        source=record.file,
        primaries=read_entries(record, model, encoding) if has("primaries") else (),
        encoding=encoding,
        refractive_index=index,
        file=record.file,
    )
    slopes = None
    if has("slopes"):
        entries = read_slope_entries(record)
        slopes = Slopes(illuminant, observer, primaries.white, "", record.file, entries, record.file)
    variables = record.record("variables")
    return Recipe(
        primaries,
        slopes,
        record.choice("interpolation", INTERPOLATIONS) if has("interpolation") else "smooth",
        record.choice("slope_method", SLOPE_METHODS) if has("slope_method") else "affine",
        record.number("p", 1, 8) if has("p") else 2.0,
        record.number("exponent", -4, 4) if has("exponent") else -1.0,
        record.choice("fresnel_angle", FRESNEL_ANGLES) if has("fresnel_angle") else None,
        record.choice("geometry", GEOMETRIES) if has("geometry") else "plain",
        {name: variables.number(name, -math.inf) for name in variables.values},
    )
