"""Adversarial geometry and material, and how far a program in float32 may be from float64 on it.

Shared by the tests and by tools/hard_cases.py.  Directions and pixels are float32 numbers throughout: what
float64 computes from them is what float32 is measured against.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

import iccbrdf
from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.brdf.models import MODELS
from iccbrdf.brdf.primaries import Primaries, Primary, read_primaries
from iccbrdf.brdf.slopes import Slope, Slopes, read_slopes, slope_adjust, slope_angle
from iccbrdf.build import build_pair
from iccbrdf.build.literal import literal_mvis
from iccbrdf.cmm import Transform
from iccbrdf.icc import Profile
from iccbrdf.resources import folder

Array = NDArray[np.float64]
Pixels = NDArray[np.float32]

BACKENDS = ("interpreter", "numpy", "llvm")[: 3 if find_spec("llvmlite") else 2]
DTYPES = ("float32", "float64")

LENGTHS = (1e-3, 4.0)
"""Of normals that have a direction; the longest is four times what a channel is declared to hold."""


class Promise(NamedTuple):
    """The largest relative error of the whole, diffuse and specular, in float32 with kd of at least .01."""

    least_m: float
    least_cosine: float
    """Of light and viewer with the normal."""
    error: float
    grows: bool = True
    """Whether more is promised below that cosine, as one over the cosine, and not nothing.

    Directions of length 1 in float32 are uncertain by 1e-7.  That is a relative error of 1e-7 / cos of a
    cosine, and as much of the half vector where light and viewer graze a surface from opposite sides.  In
    the exact geometry it does not grow.
    """

    def from_cosine(self, geometry: str) -> float:
        """The least cosine for which the error itself is promised."""
        return LEAST_COSINE if geometry == "exact" and self.grows else self.least_cosine


GRAZING = 0.02
"""Cosine of a degree above the horizon."""

PROMISES = (
    Promise(0.05, 0.04, 1e-4),
    Promise(0.01, 0.1, 5e-4, grows=False),
    Promise(0.01, GRAZING, 2e-3),
    Promise(1e-3, GRAZING, 5e-2),
)

LEAST_COSINE = 1e-7
"""Below it nothing is promised: in the plain geometry a cosine's sign is lost, and with it what is lit."""

NOTHING_LEFT = 0.5
"""A promise that has grown to this is none: the exponent of a lobe is known to no digit, and is one of e."""


def promised(m: Array, cosine: Array, geometry: str = "plain") -> Array:
    """The largest relative error by m and cosine, which broadcast; infinite where nothing is promised."""
    error = np.full(np.broadcast_shapes(m.shape, cosine.shape), np.inf)
    for promise in PROMISES:
        growth = np.maximum(1, promise.from_cosine(geometry) / np.maximum(cosine, LEAST_COSINE))
        holds = (m >= promise.least_m) & (promise.grows | (growth == 1))
        error = np.where(holds, np.minimum(error, promise.error * growth), error)
    return np.where((error < NOTHING_LEFT) & (cosine >= LEAST_COSINE), error, np.inf)


def primaries(model: str) -> Primaries:
    """A primaries file's contents in memory; the parameters of its one colour do not enter a MVIS."""
    return Primaries(
        model=model,
        illuminant="D50",
        observer="CIE 1931 2 Degree Standard Observer",
        white=(0.9642, 1.0, 0.8249),
        geometry="45:0",
        source="none",
        primaries=(Primary("any", (0.5,) * 3, (0.5,) * len(MODELS[model].channels)),),
    )


@cache
def mvis_of(model: str, fresnel_angle: str | None = None, geometry: str = "plain") -> Profile:
    """A model's MVIS."""
    return build_pair(primaries(model), fresnel_angle=fresnel_angle, geometry=geometry).mvis


@cache
def printed_formulas(model: str) -> Transform:
    """The model in float32 as the papers print it, by the quickest back end."""
    return iccbrdf.link([literal_mvis(build_pair(primaries(model)), model)[0]], backend=BACKENDS[-1])


def held_index() -> float:
    """The refractive index whose R0 is the float32 that a program holds for 1.5."""
    root = np.sqrt(float(np.float32(0.04)))
    return float((1 + root) / (1 - root))


def variables(light: Array, view: Array) -> dict[str, float]:
    """The run-time variables of two directions."""
    names = ("litX", "litY", "litZ", "vueX", "vueY", "vueZ")
    return dict(zip(names, map(float, (*light, *view)), strict=True))


# Directions -------------------------------------------------------------------------------------------------


def unit(v: Array) -> Array:
    """Vectors (..., 3) at length 1; those of no length stay 0."""
    length = np.sqrt(np.sum(v * v, axis=-1, keepdims=True))
    scaled: Array = np.divide(v, length, out=np.zeros_like(v), where=length > 0)
    return scaled


def _upwards(rng: np.random.Generator) -> Array:
    """A direction above the print, all zenith angles alike."""
    zenith, azimuth = rng.uniform(0, np.pi / 2), rng.uniform(0, 2 * np.pi)
    return np.array([np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)])


def _at_cosine(axis: Array, cosine: Array, rng: np.random.Generator) -> Array:
    """Unit vectors (n, 3) of given cosines (n) with a unit axis, at random azimuths."""
    across = unit(np.cross(axis, rng.normal(size=(len(cosine), 3))))
    return cosine[:, None] * axis + np.sqrt(1 - cosine[:, None] ** 2) * across


def _mirrored(rng: np.random.Generator) -> tuple[Array, Array]:
    """Light and viewer on two sides of an axis, down to grazing."""
    axis = _upwards(rng)
    half = axis * 10 ** rng.uniform(-7, 0)
    across = _at_cosine(axis, np.zeros(1), rng)[0] * np.sqrt(1 - half @ half)
    return half + across, half - across


def _opposite(rng: np.random.Generator, lowest: float) -> tuple[Array, Array]:
    """Light and viewer that graze some surface from opposite sides, nearly in one plane."""
    axis = _upwards(rng)
    (across,) = _at_cosine(axis, np.zeros(1), rng)
    low, other = 10 ** rng.uniform(np.log10(lowest), -1.3, 2)
    aside = np.cross(axis, across) * 10 ** rng.uniform(np.log10(lowest), -1)
    return across + low * axis, other * axis - across + aside


def _level(v: Array, z: float = 0.0) -> Array:
    return np.array([v[0], v[1] + 1e-3, z])


def directions(rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
    """Pairs of light and viewer without end, as float32 holds them; every kind in turn, of any length."""
    while True:
        light, view = _upwards(rng), _upwards(rng)
        low = 10 ** rng.uniform(-7, -1)
        near = 10 ** rng.uniform(-7, -3) * rng.normal(size=3)
        for pair in (
            (light, view),
            _mirrored(rng),
            (light, light),
            (light, light + near),
            (light, -light),
            (light, -light + near),
            _mirrored(rng),
            (_level(light, low), view),
            (light, _level(view, low)),
            (_level(light, low), -_level(light, -low)),
            (_level(light), view),
            (light, _level(view)),
            (np.array([0, 0, 1.0]), view),
            (_upwards(rng), _upwards(rng)),
            _opposite(rng, 5e-4),
            _opposite(rng, LEAST_COSINE),
        ):
            scaled = [v * 10 ** rng.choice([0, 0, rng.uniform(-3, 3)]) for v in pair]
            yield tuple(np.float32(v).astype(np.float64) for v in scaled)


def _normals(light: Array, view: Array, m: Array, rng: np.random.Generator) -> Array:
    """Half within 3 m of the half vector; others of all kinds, one in 16 of no direction; any length."""
    count = len(m)
    i, v = unit(light), unit(view)
    half = unit(i + v)
    angle = np.minimum(3 * m * rng.uniform(0, 1, count), np.pi / 2)
    n = _at_cosine(half, np.cos(angle), rng)
    kind = rng.integers(0, 16, count)
    low = 10 ** rng.uniform(-7, 0, count)
    for kinds, others in (
        ((8, 9, 10), unit(rng.normal(size=(count, 3)) * [1, 1, 2])),
        ((11,), _at_cosine(i, low, rng)),
        ((12,), _at_cosine(v, low, rng)),
        ((13,), np.broadcast_to([0.0, 0, 1], (count, 3))),
        ((14,), -n),
        ((15,), np.zeros((count, 3))),
    ):
        n = np.where(np.isin(kind, kinds)[:, None], others, n)
    length = np.where(
        rng.random(count) < 0.5, 1, 10 ** rng.uniform(np.log10(LENGTHS[0]), np.log10(LENGTHS[1]), count)
    )
    return np.asarray(n * length[:, None])


def smallest_cosine(pixels: Pixels, light: Array, view: Array) -> Array:
    """The lesser cosine of light and viewer with the normals, the last three channels; shape (n)."""
    n = unit(pixels[:, -3:].astype(np.float64))
    return np.minimum(n @ unit(light), n @ unit(view))


# Material ---------------------------------------------------------------------------------------------------


def prints(model: str, light: Array, view: Array, count: int, rng: np.random.Generator) -> Pixels:
    """Pixels (count, channels) of prints: kd at least .01, ks from 0, m from 1e-4; see `_normals`."""
    names = MODELS[model].channels
    columns = {}
    for name in names:
        if name.startswith("m"):
            columns[name] = 10 ** rng.uniform(-4, 0, count)
        elif name.startswith("ks"):
            columns[name] = rng.choice([0, 1, 1, 1], count) * 10 ** rng.uniform(-3, 0, count)
        else:
            columns[name] = 10 ** rng.uniform(-2, 0, count)
    if model == "cook_torrance_2020":
        # Its (1 - ks) Rd is what the others call kd.
        columns["ks"] *= 0.9
        for name in names[:3]:
            columns[name] = np.minimum(columns[name] / (1 - columns["ks"]) + 1e-6, 1)
    least_m = np.min([columns[name] for name in names if name.startswith("m")], axis=0)
    n = _normals(light, view, least_m, rng)
    return np.column_stack([*columns.values(), n]).astype(np.float32)


def anything(channels: int, count: int, rng: np.random.Generator, largest: float = 4.0) -> Pixels:
    """Pixels of any numbers up to `largest` in size: both signs, zeros, ones, and next to nothing."""
    values = rng.uniform(-largest, largest, (count, channels))
    tiny = rng.choice([-1, 1], values.shape) * 10 ** rng.uniform(-45, 0, values.shape)
    ends = rng.choice([0.0, -0.0, 1, -1, 1e-4, largest, -largest], values.shape)
    kind = rng.integers(0, 4, values.shape)
    mixed = np.select([kind == 0, kind == 1], [tiny, ends], np.where(kind == 2, abs(values), values))
    # Half a pixel's channels at a time: else hardly any would be lit.
    ordinary = rng.random((count, 1)) < 0.5
    mixed[:, -3:] = np.where(ordinary, rng.normal(size=(count, 3)) * [0.3, 0.3, 0] + [0, 0, 1], mixed[:, -3:])
    return mixed.astype(np.float32)


def roughness(model: str, pixels: Pixels) -> Array:
    """m for X, Y and Z, shape (n, 3)."""
    columns = [k for k, name in enumerate(MODELS[model].channels) if name.startswith("m")]
    return np.broadcast_to(pixels[:, columns].astype(np.float64), (len(pixels), 3))


def relative_error(found: NDArray[np.floating], expected: Array) -> Array:
    """|found - expected| / |expected|; what is not a number is infinitely wrong, 0 for 0 is right."""
    with np.errstate(all="ignore"):
        error = np.abs(found - expected) / np.abs(expected)
    error = np.where(found == expected, 0.0, error)
    return np.asarray(np.nan_to_num(error, nan=np.inf))


# Colours ----------------------------------------------------------------------------------------------------

COLOUR_MIDS = (("smooth", "affine"), ("smooth", "published"), ("published", "published"))
"""Interpolation and slope adjustment."""

EXAMPLE = folder("profiles") / "fogra39_gloss"


def held(values: ArrayLike) -> tuple[float, ...]:
    """Numbers as a program holds them."""
    return tuple(np.asarray(values, np.float32).astype(np.float64).tolist())


def _held_primaries() -> Primaries:
    example = read_primaries(EXAMPLE / "primaries.json")
    entries = (replace(e, XYZ=held(e.XYZ), parameters=held(e.parameters)) for e in example.primaries)
    return replace(example, white=held(example.white), primaries=tuple(entries))


def _held_slopes() -> Slopes:
    example = read_slopes(EXAMPLE / "slopes.json")
    return replace(example, slopes=tuple(Slope(s.angle, held(s.W), held(s.B)) for s in example.slopes))


PRIMARIES, SLOPES = _held_primaries(), _held_slopes()


def colours(count: int, rng: np.random.Generator) -> Pixels:
    """XYZ and normals (count, 6): in and out of every range, on nodes, ties, ends and segment boundaries."""
    nodes, white = PRIMARIES.XYZ, np.array(PRIMARIES.white)
    one, other = nodes[rng.integers(0, len(nodes), (2, count))]
    share = rng.uniform(0, 1, (count, 1))
    ends = np.concatenate([SLOPES.W, SLOPES.B, [white]])[rng.integers(0, 2 * len(SLOPES.W) + 1, count)]
    of_one_sum = one / one.sum(axis=1, keepdims=True) + other / other.sum(axis=1, keepdims=True)
    kinds = [
        share * one + (1 - share) * other,
        rng.dirichlet(np.full(len(nodes), 0.5), count) @ nodes,
        rng.uniform(-8, 8, (count, 3)),
        rng.uniform(0, 1, (count, 3)) ** 3,
        one,
        np.nextafter(one.astype(np.float32), np.float32(rng.choice([-1, 1]))),
        ends,
        share * of_one_sum,  # as near in chromaticity to the one as to the other
        share * white,
        rng.choice([0.0, 0.0, 1e-45, 1e-20, -1e-3, 1e-5, 8, -8], (count, 3)),
    ]
    XYZ = np.choose(rng.integers(0, len(kinds), (count, 1)), kinds)
    angles = np.select(
        [rng.random(count) < 0.5],
        [rng.choice([*SLOPES.angles, 89.9, 90, 135, 180], count)],
        rng.uniform(0, 180),
    )
    n = _at_cosine(np.array([0, 0, 1.0]), np.cos(np.radians(angles)), rng)
    n = np.where(rng.random((count, 1)) < 0.1, rng.uniform(-4, 4, (count, 3)), n)
    n = np.where(rng.random((count, 1)) < 0.05, 0, n * 10 ** rng.uniform(-1, 0.6, (count, 1)))
    return np.concatenate([XYZ, n], axis=1).astype(np.float32)


def on_slopes(pixels: Pixels, slope_method: str) -> Array:
    """The reference's XYZ of colours (n, 6) on their slopes."""
    XYZ, n = np.split(pixels.astype(np.float64), 2, axis=1)
    return slope_adjust(XYZ, slope_angle(n), SLOPES, method=slope_method)  # type: ignore[arg-type]


def is_beside_switch(XYZ: Array) -> NDArray[np.bool_]:
    """Where a rounding error may move the published interpolation's choice of nodes, (n).

    That is also where X + Y + Z nearly cancels, of a colour that cannot be: it has no steady chromaticity.
    """
    here = interpolate(XYZ, PRIMARIES, method="published")
    nudges = 1e-5 * np.array(list(product((-1, 1), repeat=3)))
    moved = (interpolate(XYZ + nudge * (abs(XYZ) + 0.01), PRIMARIES, method="published") for nudge in nudges)
    changes = [np.max(abs(there - here) / (abs(here) + 0.01), axis=1) for there in moved]
    cancels = abs(np.sum(XYZ, axis=1)) < 1e-3 * np.sum(abs(XYZ), axis=1)
    return np.asarray(cancels | (np.max(changes, axis=0) > 1e-3))


# All of it by every back end --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Look:
    """One light and one viewer on pixels of prints, which come first, and of any numbers."""

    model: str
    geometry: str
    light: Array
    view: Array
    pixels: Pixels
    prints: int
    XYZ: Mapping[tuple[str, str], NDArray[np.floating]]
    """Results by back end and number type."""

    @property
    def printed(self) -> Pixels:
        """The pixels of prints."""
        return self.pixels[: self.prints]

    @property
    def m(self) -> Array:
        """Roughness of the prints for X, Y and Z, (n, 3)."""
        return roughness(self.model, self.printed)

    @property
    def cosine(self) -> Array:
        """The lesser cosine of light and viewer on the prints, (n, 1)."""
        return smallest_cosine(self.printed, self.light, self.view)[:, None]

    @property
    def promised(self) -> Array:
        """The largest relative error that float32 may have on the prints, (n, 3)."""
        return promised(self.m, self.cosine, self.geometry)

    def as_printed(self) -> Array:
        """XYZ of the prints in float32 by the papers' formulas as they stand, (n, 3)."""
        transform = printed_formulas(self.model).with_env(variables(self.light, self.view))
        return transform(self.printed).astype(np.float64)

    def of_prints(self, backend: str, dtype: str) -> Array:
        """XYZ of the prints in float64, (n, 3)."""
        return self.XYZ[backend, dtype][: self.prints].astype(np.float64)


def looks(
    model: str, geometry: str, count: int, prints_each: int, anything_each: int, seed: int
) -> Iterator[Look]:
    """Results of a model's MVIS under so many lights and viewers, by every back end in both number types."""
    rng, mvis = np.random.default_rng(seed), mvis_of(model, geometry=geometry)
    transforms = {
        (backend, dtype): iccbrdf.link([mvis], backend=backend, dtype=dtype)
        for backend in BACKENDS
        for dtype in DTYPES
    }
    pairs = directions(rng)
    for _ in range(count):
        light, view = next(pairs)
        printed = prints(model, light, view, prints_each, rng)
        pixels = np.concatenate([printed, anything(printed.shape[1], anything_each, rng)])
        env = variables(light, view)
        found = {key: transform.with_env(env)(pixels) for key, transform in transforms.items()}
        yield Look(model, geometry, light, view, pixels, prints_each, found)
