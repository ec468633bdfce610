"""How much an effect changes a proof at most: sound bounds of XYZ, and of CIEDE2000, from intervals.

What is known are intervals: of each parameter and of the components of the unit normal, over a tile or of
one pixel, and of light and view.  The models are those of calc_templates, written as

    XYZ = g (d cos theta_i + ks F D V) + ambient,

g the irradiance (over pi), d the diffuse reflectance, D Beckmann's or Ward's lobe, and V what is left of the
shadowing G and the cosines, G / cos theta_v or sqrt(cos theta_i / cos theta_r).  Effects are left out one
after the other, each from what the ones before it have left; so every bound here holds whichever of
the others is left out too, and the bounds of a set of effects may be added:

    specular             ks F D V
    chromatic-specular   (ks_c - ks_Y) F D V
    chromatic-roughness  ks F (D(m_c) - D(m_Y)) V, with the larger of ks_c, ks_Y
    shadowing            ks F D (1 - G) / cos theta_v, with the larger of ks and D of c and Y
    fresnel              ks (1 - F) D V, the same, and with V that of G = 1
    below-horizon        nothing where both cosines are above 0 for certain, else without bound
    highlight-range      what is above the white

and, of the ways to a pixel's parameters and normal, relief, slope and interpolation: the difference of both
sums, term by term.

Each term is monotone in its parts, or has one maximum along each of them (see `_lobe`), so that the ends of
intervals give its bounds.  Programs compute in float32: cosines are taken to be wrong by up to
`COSINE_ERROR`.

CIEDE2000: S_L, S_C and S_H are at least 1, and with |R_T| <= 2 sin 60 degrees the form x^2 + y^2 + R_T x y
is at most (1 + sin 60 degrees)(x^2 + y^2); a' is at most 1.5 a.  Hence

    dE00^2 <= dL^2 + 1.866 1.5^2 (da^2 + db^2),

which is a norm of the difference in L*a*b*, so that bounds of steps add up; and dE00 <= 2.05 dE*ab.

References
----------
-   G. Sharma, W. Wu, E. Dalal: The CIEDE2000 color-difference formula. Color Research and Application
    30(1), 2005.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.cook_torrance import M_MIN, fresnel_schlick
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.models import MODELS
from iccbrdf.build.spans import ONE, ZERO, Span, Vector, cross, dot

COSINE_ERROR = 1e-6
"""Of cosines and vector products in float32, 16 units in the last place of 1."""

LIT = 1e-16
"""The cosine above which the templates take a surface for lit."""

CHROMATIC_WEIGHT = (1 + math.sin(math.radians(60))) * 1.5**2

EXACT = 2.0**-24
"""A change of so much of a value is half a unit in its last place in float32."""

VANISHING = 1e-45
"""Smaller numbers are 0 in float32."""

ROUNDING = 1e-6
"""Of each component, by how much two float32 programs for the same value may disagree."""

GROUP = ("chromatic-specular", "chromatic-roughness", "shadowing", "fresnel")
"""The effects that are part of `specular`, in the order in which they are left out."""


@dataclass(frozen=True)
class Reflection:
    """What the bounds must know of an MVIS."""

    model: str
    white: tuple[float, ...]
    refractive_index: float = 1.5
    fresnel_angle: str = "theta_i"
    intensity: float = math.pi
    ambient: float = 0.0

    @property
    def has_facets(self) -> bool:
        """Cook-Torrance: D is Beckmann's and V is G / cos theta_v."""
        return self.model != "ward"

    @property
    def has_share(self) -> bool:
        """Cook-Torrance 2020: what is glossy is not diffuse, and reflectance is without pi."""
        return self.model == "cook_torrance_2020"

    @property
    def has_fresnel(self) -> bool:
        return MODELS[self.model].has_fresnel

    @property
    def scale(self) -> float:
        """g."""
        return self.intensity if self.has_share else self.intensity / math.pi


Three = tuple[Span, Span, Span]
"""For X, Y and Z."""

ThreeArrays = tuple[Array, Array, Array]

Reduce = Callable[[Array], Span]
"""From values by pixel to their spans; of a value of no axis, which all pixels have, to that."""


@dataclass(frozen=True)
class Columns:
    """A model's parameters by pixel, for X, Y and Z; what serves all three is one array thrice.

    Rd is the diffuse reflectance, of which `d` is left beside the glossy share; ks_off and m_off are ks and m
    less those of Y.
    """

    d: ThreeArrays
    ks: ThreeArrays
    m: ThreeArrays
    Rd: ThreeArrays
    ks_off: ThreeArrays
    m_off: ThreeArrays


def columns(reflection: Reflection, channels: Mapping[str, Array]) -> Columns:
    """The parameters of pixels from their channels by name."""
    families: dict[str, ThreeArrays] = {}
    for family, width in MODELS[reflection.model].parameters:
        names = [f"{family}.{axis}" for axis in "XYZ"] if width == 3 else [family]
        found = [np.asarray(channels[name], np.float64) for name in names]
        if family == "m":
            found = [np.maximum(m, M_MIN) for m in found]
        x, y, z = found if width == 3 else found * 3
        families[family] = (x, y, z)
    Rd = families["Rd" if "Rd" in families else "kd"]
    ks, m = families["ks"], families["m"]
    d = Rd
    if reflection.has_share:
        d = ((1 - ks[0]) * Rd[0], (1 - ks[0]) * Rd[1], (1 - ks[0]) * Rd[2])
    return Columns(d, ks, m, Rd, _less(ks, (ks[1],) * 3), _less(m, (m[1],) * 3))


@dataclass(frozen=True)
class Parameters:
    """Spans of `Columns`."""

    d: Three
    ks: Three
    m: Three
    Rd: Three
    ks_off: Three
    m_off: Three


def parameters(pixels: Columns, reduce: Reduce) -> Parameters:
    """The spans of columns."""
    return Parameters(*(_spans(family, reduce) for family in vars(pixels).values()))


def differences(one: Columns, other: Columns) -> Columns:
    """Each of the columns less those of another set, for the same pixels."""
    pairs = zip(vars(one).values(), vars(other).values(), strict=True)
    return Columns(*(_less(a, b) for a, b in pairs))


def _less(one: ThreeArrays, other: ThreeArrays) -> ThreeArrays:
    x, y, z = (np.zeros(()) if a is b else a - b for a, b in zip(one, other, strict=True))
    return x, y, z


def _spans(family: ThreeArrays, reduce: Reduce) -> Three:
    x, y, z = family
    return reduce(x), reduce(y), reduce(z)


# Geometry ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Geometry:
    """What the models take of normal, light and view; cosines are those of lit surfaces."""

    cos_i: Span
    cos_v: Span
    tan2_h: Span
    h2: Span
    """|i + v|^2."""
    q: Span
    """4 n.h / |i + v|^2."""
    lit: NDArray[np.bool_]
    """Where light and viewer are above the surface for certain."""
    dark: NDArray[np.bool_]
    """Where one of them is below it for certain."""


def geometry(normal: Vector, light: Vector, view: Vector) -> Geometry:
    """From components of unit vectors whose shapes broadcast."""
    h = (light[0] + view[0], light[1] + view[1], light[2] + view[2])
    cos_i = dot(normal, light).within(-1, 1).widened(COSINE_ERROR)
    cos_v = dot(normal, view).within(-1, 1).widened(COSINE_ERROR)
    lit = (cos_i.lo > LIT) & (cos_v.lo > LIT)
    dark = (cos_i.hi <= LIT) | (cos_v.hi <= LIT)
    cos_i, cos_v = cos_i.within(LIT, 2), cos_v.within(LIT, 2)
    n_dot_h = dot(normal, h).widened(COSINE_ERROR).meet(cos_i + cos_v).within(LIT, 4)
    squares = [component.square() for component in h]
    h2 = (squares[0] + squares[1] + squares[2]).widened(4 * COSINE_ERROR).within(LIT, 4)
    # |n x h|^2 both from its components and as |h|^2 - (n.h)^2, whichever is narrower.
    squares = [component.square() for component in cross(normal, h)]
    direct = squares[0] + squares[1] + squares[2]
    rest = h2 - n_dot_h.square()
    cross_h = direct.meet(rest).within(0, 4)
    length = Span(np.sqrt(cross_h.lo), np.sqrt(cross_h.hi)).widened(COSINE_ERROR).within(0, 4)
    tan2_h = Span(length.lo / n_dot_h.hi, length.hi / n_dot_h.lo).square()
    q = Span(4 * n_dot_h.lo / h2.hi, 4 * n_dot_h.hi / h2.lo)
    return Geometry(cos_i, cos_v, tan2_h, h2, q, lit, dark)


# Terms -------------------------------------------------------------------------------------------------


def _lobe(reflection: Reflection, tan2: Span, m: Span) -> Span:
    """D over an interval of tan^2 theta_h and one of m.

    D = exp(-t / m^2) (1 + t)^p / m^2 with t = tan^2; p = 2 for Beckmann, p = 0 and a quarter for Ward.  Along
    m it has one maximum, at m^2 = t; along t one, at 1 + t = p m^2.  Where the two meet there is a saddle, so
    that the largest value is on an edge, and the least one in a corner.
    """
    power, scale = (2, 1 / math.pi if reflection.has_share else 1.0) if reflection.has_facets else (0, 0.25)

    def value(t: Array, m: Array) -> Array:
        m2 = m * m
        return scale * np.exp(-t / m2) * (1 + t) ** power / m2

    def best_m(t: Array) -> Array:
        return np.clip(np.sqrt(t), m.lo, m.hi)

    def best_t(m: Array) -> Array:
        return np.clip(power * m * m - 1, tan2.lo, tan2.hi)

    one_m = m.lo is m.hi
    sides = (m.lo,) if one_m else (m.lo, m.hi)
    corners = Span.around(*(value(t, x) for t in (tan2.lo, tan2.hi) for x in sides))
    edges = [value(best_t(x), x) for x in sides]
    if not one_m:
        edges += [value(t, best_m(t)) for t in (tan2.lo, tan2.hi)]
    return Span(corners.lo, Span.around(corners.hi, *edges).hi)


class Terms:
    """The parts of the gloss of some parameters under some geometry."""

    def __init__(self, reflection: Reflection, given: Parameters, under: Geometry) -> None:
        self.reflection, self.given, self.under = reflection, given, under
        x, y, z = given.m
        middle = _lobe(reflection, under.tan2_h, y)
        self.D: Three = (
            middle if x is y else _lobe(reflection, under.tan2_h, x),
            middle,
            middle if z is y else _lobe(reflection, under.tan2_h, z),
        )
        cos_i, cos_v = under.cos_i, under.cos_v
        if reflection.has_facets:
            q = under.q
            over_cos = np.minimum(q.lo, np.minimum(1.0, q.lo * cos_i.lo) / cos_v.hi)
            under_cos = np.minimum(q.hi, np.minimum(1.0, q.hi * cos_i.hi) / cos_v.lo)
            self.V = Span(over_cos, under_cos)
            self.V_unshadowed = Span(1 / cos_v.hi, 1 / cos_v.lo)
            G = Span(*(np.minimum(1.0, a * np.minimum(b, c)) for a, b, c in (
                (q.lo, cos_i.lo, cos_v.lo), (q.hi, cos_i.hi, cos_v.hi))))  # fmt: skip
            self.shadow = Span((1 - G.hi) / cos_v.hi, (1 - G.lo) / cos_v.lo)
        else:
            self.V = Span(np.sqrt(cos_i.lo / cos_v.hi), np.sqrt(cos_i.hi / cos_v.lo))
            self.V_unshadowed, self.shadow = self.V, ZERO
        self.F = self._fresnel()

    def _fresnel(self) -> Span:
        if not self.reflection.has_fresnel:
            return ONE
        cosine = self.under.cos_i
        if self.reflection.fresnel_angle == "alpha":
            cosine = Span(np.sqrt(self.under.h2.lo) / 2, np.sqrt(self.under.h2.hi) / 2)
        cosine, n = cosine.within(0, 1), self.reflection.refractive_index
        return Span(fresnel_schlick(cosine.hi, n), fresnel_schlick(cosine.lo, n))

    @property
    def diffuse(self) -> Three:
        """g d cos theta_i."""
        g = self.reflection.scale
        x, y, z = ((d * self.under.cos_i).times(g) for d in self.given.d)
        return x, y, z

    def gloss(self, c: int) -> Span:
        """g ks F D V of channel `c`."""
        return (self.given.ks[c] * self.F * self.D[c] * self.V).times(self.reflection.scale)


# Changes -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Change:
    """What leaving an effect out does at most, element by element."""

    exact: NDArray[np.bool_]
    """Whether the result is the same but for float32 rounding."""
    bound: Callable[[], Array]
    """Computes the bound, where the result is not the same."""

    @cached_property
    def dE(self) -> Array:
        """Bound of the weighted distance in L*a*b* (see the module), and so of CIEDE2000; 0 where exact."""
        if self.exact.all():
            return np.zeros(self.exact.shape)
        dE = self.bound()
        return np.where(self.exact, 0.0, np.where(np.isnan(dE), np.inf, dE))

    def broadcast(self, shape: tuple[int, ...]) -> Change:
        """The same for all elements of an array of that shape."""
        return Change(np.broadcast_to(self.exact, shape), lambda: np.broadcast_to(self.bound(), shape))


def changes_of_effects(terms: Terms, wanted: Collection[str]) -> dict[str, Change]:
    """What each of the `wanted` effects of the MVIS but relief does at most, in the steps of the module."""
    reflection, given, under = terms.reflection, terms.given, terms.under
    g, D, F, V = reflection.scale, terms.D, terms.F, terms.V
    diffuse, gloss = terms.diffuse, [terms.gloss(c) for c in range(3)]
    ks = [k.join(given.ks[1]) for k in given.ks]
    either = [d.join(D[1]) for d in D]
    found: dict[str, Change] = {}

    def step(change: list[Span], most: list[Span]) -> Change:
        """Gloss changes thus, and is as much as `most` before or after."""
        floor = [d.lo + np.minimum(w.lo, 0) for d, w in zip(diffuse, most, strict=True)]
        ceiling = [d.hi + w.hi for d, w in zip(diffuse, most, strict=True)]
        return _where_seen(reflection, under, change, floor, ceiling)

    def product(left: Iterable[Span], middle: Iterable[Span], right: Span) -> list[Span]:
        return [(a * b * right).times(g) for a, b in zip(left, middle, strict=True)]

    if "specular" in wanted:
        found["specular"] = step(gloss, gloss)
    if "chromatic-specular" in wanted:
        found["chromatic-specular"] = step(product(given.ks_off, D, F * V), product(ks, D, F * V))
    if "chromatic-roughness" in wanted:
        off = [(d - D[1]).where(m.magnitude > 0, ZERO) for d, m in zip(D, given.m_off, strict=True)]
        found["chromatic-roughness"] = step(product(ks, off, F * V), product(ks, either, F * V))
    if "shadowing" in wanted:
        change = [-d for d in product(ks, either, F * terms.shadow)]
        found["shadowing"] = step(change, product(ks, either, F * terms.V_unshadowed))
    if "fresnel" in wanted:
        change = [-d for d in product(ks, either, (ONE - F) * V.join(terms.V_unshadowed))]
        found["fresnel"] = step(change, product(ks, either, terms.V_unshadowed))
    if "below-horizon" in wanted:
        found["below-horizon"] = Change(under.lit, lambda: np.array(np.inf))
    if "highlight-range" in wanted:
        found["highlight-range"] = _above_white(terms, gloss)
    return found


def change_of_ways(full: Terms, other: Terms, off: Parameters, n_off: Vector, light: Vector) -> Change:
    """What it does at most to take other parameters, another normal, or both: relief, slope, interpolation.

    `off` are `differences` of the parameters, `n_off` the one normal less the other.
    """
    reflection, g = full.reflection, full.reflection.scale
    one, two = full.under, other.under
    aligned = (n_off[0].magnitude == 0) & (n_off[1].magnitude == 0) & (n_off[2].magnitude == 0)
    cos_off = dot(n_off, light)
    change, floor, ceiling = [], [], []
    certain = (one.lit & two.lit) | aligned
    for c in range(3):
        before, after = (
            terms.diffuse[c] + terms.gloss(c) + terms.given.Rd[c].times(reflection.ambient)
            for terms in (full, other)
        )
        diffuse = (full.given.d[c] * cos_off + off.d[c] * two.cos_i).times(g)
        D_off = (full.D[c] - other.D[c]).where(off.m[c].magnitude > 0, ZERO)
        same_place = (off.ks[c] * full.D[c] + other.given.ks[c] * D_off) * full.F * full.V
        gloss = same_place.times(g).where(aligned, full.gloss(c) - other.gloss(c))
        seen = diffuse + gloss + off.Rd[c].times(reflection.ambient)
        if reflection.ambient:
            # What is left where the lamp alone is below the surface.
            seen = seen.join(off.Rd[c].times(reflection.ambient))
        change.append(seen.where(certain, before.join(ZERO) - after.join(ZERO)))
        floor.append(np.minimum(before.lo, after.lo))
        ceiling.append(np.maximum(before.hi, after.hi))
    under = replace(one, lit=one.lit & two.lit, dark=one.dark & two.dark)
    if reflection.ambient:
        under = replace(under, dark=np.zeros_like(under.dark))
    return _where_seen(reflection, under, change, floor, ceiling)


def _above_white(terms: Terms, gloss: list[Span]) -> Change:
    reflection = terms.reflection
    change, floor, ceiling = [], [], []
    for c, white in enumerate(reflection.white):
        seen = terms.diffuse[c] + gloss[c] + terms.given.Rd[c].times(reflection.ambient)
        change.append(Span(np.maximum(seen.lo - white, 0), np.maximum(seen.hi - white, 0)))
        floor.append(np.full(np.shape(seen.hi), white))
        ceiling.append(np.maximum(seen.hi, white))
    always = replace(terms.under, lit=np.ones_like(terms.under.lit), dark=np.zeros_like(terms.under.dark))
    return _where_seen(reflection, always, change, floor, ceiling)


def _where_seen(
    reflection: Reflection, under: Geometry, change: list[Span], floor: list[Array], ceiling: list[Array]
) -> Change:
    """The change of XYZ: none where the surface is dark, perhaps none where it is not lit for certain.

    `floor` and `ceiling` bound the XYZ of lit surfaces before and after.
    """
    low = [np.where(under.lit, x, np.minimum(x, 0)) for x in floor]
    high = [np.maximum(x, 0) for x in ceiling]
    change = [ZERO.where(under.dark, d.where(under.lit, d.join(ZERO))) for d in change]
    pairs = list(zip(change, low, strict=True))
    # What is not a number compares as false, and so counts as the worst.
    exact = np.logical_and.reduce([d.magnitude <= EXACT * np.abs(x) + VANISHING for d, x in pairs])

    def bound() -> Array:
        f = [
            _lightness_change(d, x, y, white)
            for (d, x), y, white in zip(pairs, high, reflection.white, strict=True)
        ]
        dL, da, db = f[1].magnitude * 116, (f[0] - f[1]).magnitude * 500, (f[1] - f[2]).magnitude * 200
        dE: Array = np.sqrt(dL * dL + CHROMATIC_WEIGHT * (da * da + db * db))
        return dE

    return Change(exact, bound)


def _lightness_change(change: Span, low: Array, high: Array, white: float) -> Span:
    """The change of f(x / white), the function in L*a*b*, where x lies between `low` and `high` throughout.

    It is concave, so that a step of a given size does most at the low end and least at the high one.
    """
    low, high = low / white, high / white
    up, down = change.hi / white, -change.lo / white
    most_up = np.where(up > 0, _f(low + np.abs(up)) - _f(low), _f(high - np.abs(up)) - _f(high))
    most_down = np.where(down > 0, _f(low + np.abs(down)) - _f(low), _f(high - np.abs(down)) - _f(high))
    return Span(-most_down, most_up).widened(ROUNDING * _f(high))


def _f(x: Array) -> Array:
    """CIE 15: of L* = 116 f - 16."""
    f: Array = np.where(x > (6 / 29) ** 3, np.cbrt(x), x * (841 / 108) + 4 / 29)
    return f
