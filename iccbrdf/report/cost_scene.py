"""The pixels that ways are compared on, what is exact for them, and which of them show gloss."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import Array, tan2_theta_h, unit
from iccbrdf.brdf.interpolation import InterpolationMethod, interpolate
from iccbrdf.brdf.models import MODELS, NORMAL, evaluate
from iccbrdf.brdf.slopes import SlopeMethod, slope_adjust, slope_angle
from iccbrdf.build.pair import Pair
from iccbrdf.build.profiles import ranges
from iccbrdf.build.recipe import Recipe
from iccbrdf.icc import Profile
from iccbrdf.images import Place
from iccbrdf.planning import Planning
from iccbrdf.scene import LIGHT, VIEW

SIDE = 64
"""Pixels along the side of a tile."""

PIXELS = 1 << 18
"""Of a sample, unless more are asked for."""

REGIONS = ("diffuse", "near-specular", "specular")

_REGION_ENDS = (3.0, 1.0)
"""Tangents of the angle between normal and half vector, in units of m.  Beckmann's distribution falls to
exp(-1) of its peak at the one and to about exp(-9), a ten-thousandth, at the other."""

Tiles = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class CostScene:
    """Tiles of an image, and what its proof is made of."""

    recipe: Recipe
    names: tuple[str, ...]
    """The channels of the image."""
    samples: str
    """`device` or `real`."""
    env: Mapping[str, float]
    """Run-time variables that are not the profiles' own."""
    tiles: Tiles
    """Shape (tiles, height, width, channels), in random order."""
    places: tuple[tuple[int, int], ...]
    """Row and column of the corner of each tile."""
    size: tuple[int, int]
    """Height and width of the image."""

    @property
    def is_colour(self) -> bool:
        """Whether the image holds XYZ of the flat print rather than parameters."""
        return set("XYZ") <= set(self.names)

    @property
    def pixels(self) -> int:
        """In the sample."""
        return self.tiles[..., 0].size

    @property
    def is_whole(self) -> bool:
        """Whether the sample is all of the image."""
        height, width = self.size
        down, across = self.tiles.shape[1:3]
        return len(self.places) == len(_starts(height, down)) * len(_starts(width, across))

    @cached_property
    def pair(self) -> Pair:
        """The binding MID and the MVIS, with all effects."""
        return self.recipe.pair()

    @cached_property
    def mid(self) -> Profile:
        """The MID that takes the image."""
        return self.recipe.colour_mid().mid if self.is_colour else self.pair.mid

    @cached_property
    def variables(self) -> dict[str, float]:
        """All run-time variables, with the profiles' own values where `env` names none."""
        return {**self.pair.compiled.variables, **self.env}

    @property
    def light(self) -> Array:
        """Direction to the light, (3,)."""
        return unit([self.variables[name] for name in LIGHT])

    @property
    def view(self) -> Array:
        """Direction to the viewer, (3,)."""
        return unit([self.variables[name] for name in VIEW])

    def exact(self, tiles: Tiles) -> Array:
        """XYZ of tiles in float64, by the functions written from the papers, shape (..., 3)."""
        parameters, normals = self._parameters(tiles)
        recipe, variables = self.recipe, self.variables
        model = MODELS[recipe.primaries.model]
        settings = {
            "intensity": variables["litI"],
            "ambient": variables.get("ambI", 0.0),
            "refractive_index": recipe.primaries.refractive_index,
            "fresnel_angle": recipe.fresnel_angle or "theta_i",
        }
        options: dict[str, Any] = {name: settings[name] for name in model.options if name in settings}
        return evaluate(model.name, parameters, normals, self.light, self.view, **options)

    def regions(self, tiles: Tiles) -> NDArray[np.intp]:
        """Index in `REGIONS` of each pixel of tiles, shape (...)."""
        parameters, normals = self._parameters(tiles)
        names = MODELS[self.recipe.primaries.model].channels
        m = parameters[..., names.index("m" if "m" in names else "m.Y")]
        with np.errstate(all="ignore"):
            away = np.sqrt(tan2_theta_h(unit(normals), self.light + self.view)) / m
        return sum((away <= end).astype(np.intp) for end in _REGION_ENDS)  # type: ignore[return-value]

    def _parameters(self, tiles: Tiles) -> tuple[Array, Array]:
        """The model's parameters (..., k) and the normals (..., 3)."""
        recipe = self.recipe
        values = self._real(tiles)
        shape = tiles.shape[:-1]
        normals = np.stack([np.broadcast_to(values[name], shape) for name in NORMAL], axis=-1)
        if not self.is_colour:
            names = MODELS[recipe.primaries.model].channels
            return np.stack([np.broadcast_to(values[name], shape) for name in names], axis=-1), normals
        XYZ = np.stack([values[axis] for axis in "XYZ"], axis=-1)
        if recipe.slopes is not None:
            slope_method: SlopeMethod = "published" if recipe.slope_method == "published" else "affine"
            XYZ = slope_adjust(XYZ, slope_angle(normals), recipe.slopes, method=slope_method)
        method: InterpolationMethod = "published" if recipe.interpolation == "published" else "smooth"
        primaries = recipe.primaries
        return interpolate(XYZ, primaries, method=method, p=recipe.p, exponent=recipe.exponent), normals

    def _real(self, tiles: Tiles) -> dict[str, Array]:
        """Physical values by channel; what the image lacks has the profiles' default, without axes."""
        compiled = self.pair.compiled
        defaults = zip(compiled.inputs, compiled.defaults, strict=True)
        values: dict[str, Array] = {name: np.array(value) for name, value in defaults}
        limits = ranges(self.names, {} if self.is_colour else self.recipe.primaries.encoding)
        for name, (low, high), channel in zip(self.names, limits, np.moveaxis(tiles, -1, 0), strict=True):
            real = channel.astype(np.float64)
            values[name] = real if self.samples == "real" else low + (high - low) * real
        return values


def sample_scene(planning: Planning, env: Mapping[str, float], *, pixels: int = PIXELS) -> CostScene:
    """
    Take tiles of an image: all, or so many at random (the same ones every time) that they have `pixels`.

    Tiles at the right and lower edges overlap their neighbours; images narrower than a tile make narrow ones,
    of whole multiples of four pixels where they can.

    Parameters
    ----------
    planning
        The image, and what its profiles are made of.
    env
        Run-time variables.
    """
    source = planning.source
    down, across = (min(SIDE, length // 4 * 4 or length) for length in (source.height, source.width))
    corners = [(y, x) for y in _starts(source.height, down) for x in _starts(source.width, across)]
    order = np.random.default_rng(0).permutation(len(corners))
    places = [corners[i] for i in order[: max(1, pixels // (down * across))]]
    tiles = np.stack([source.read(Place(y, x, down, across)).data for y, x in places])
    return CostScene(
        planning.recipe,
        planning.names,
        source.samples,
        dict(env),
        np.ascontiguousarray(tiles, np.float32),
        tuple(places),
        (source.height, source.width),
    )


def _starts(length: int, side: int) -> list[int]:
    """Where tiles begin that cover a length, the last one ending with it."""
    return [*range(0, length - side, side), length - side]
