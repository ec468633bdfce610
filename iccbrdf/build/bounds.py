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
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.cook_torrance import M_MIN, fresnel_schlick
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.models import MODELS
from iccbrdf.build.spans import ONE, ZERO, Span, cross, dot, positive_product

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
    def white_column(self) -> Array:
        """The white, shape (3, 1)."""
        return np.array(self.white)[:, None]

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


Planes = Callable[[Sequence[str]], Array]
"""From channels by name to their values by pixel, (channels, height, width)."""

Reduce = Callable[[Array], Span]
"""From values (k, height, width) to their spans (k, n); of (k, 1, 1), which all pixels have, to (k, 1)."""


@dataclass(frozen=True)
class Columns:
    """A model's parameters by pixel, (3, height, width) for X, Y and Z; what serves all three is (1, ...).

    Rd is the diffuse reflectance, of which `d` is left beside the glossy share; ks_off and m_off are ks and m
    less those of Y.
    """

    d: Array
    ks: Array
    m: Array
    Rd: Array
    ks_off: Array
    m_off: Array


def columns(reflection: Reflection, planes: Planes) -> Columns:
    """The parameters of pixels from their channels."""
    families = {}
    for family, width in MODELS[reflection.model].parameters:
        families[family] = planes([f"{family}.{axis}" for axis in "XYZ"] if width == 3 else [family])
    Rd, ks = families["Rd" if "Rd" in families else "kd"], families["ks"]
    m = np.maximum(families["m"], M_MIN)
    d = (1 - ks) * Rd if reflection.has_share else Rd
    return Columns(d, ks, m, Rd, _less(ks, of_Y(ks)), _less(m, of_Y(m)))


def _span_of(family: str) -> cached_property[Span]:
    return cached_property(lambda parameters: parameters.reduce(getattr(parameters.pixels, family)))


class Parameters:
    """The spans of columns, each of shape (3, n) or (1, n), taken when it is first asked for."""

    def __init__(self, pixels: Columns, reduce: Reduce) -> None:
        self.pixels, self.reduce = pixels, reduce

    d = _span_of("d")
    ks = _span_of("ks")
    m = _span_of("m")
    Rd = _span_of("Rd")
    ks_off = _span_of("ks_off")
    m_off = _span_of("m_off")


def differences(one: Columns, other: Columns) -> Columns:
    """Each of the columns less those of another set, for the same pixels."""
    pairs = zip(vars(one).values(), vars(other).values(), strict=True)
    return Columns(*(_less(a, b) for a, b in pairs))


def _less(one: Array, other: Array) -> Array:
    return np.zeros((1, 1, 1)) if one is other else one - other


Rows = TypeVar("Rows", Array, Span)


def of_Y(values: Rows) -> Rows:
    """Of values for X, Y and Z those for Y; values that serve all three themselves."""
    shape = values.lo.shape if isinstance(values, Span) else values.shape
    return values if shape[0] == 1 else values[1:2]


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


def geometry(normal: Span, light: Span, view: Span) -> Geometry:
    """From components of unit vectors, (3, n) or (3, 1)."""
    h = light + view
    cos_i = dot(normal, light).within(-1, 1).widened(COSINE_ERROR)
    cos_v = dot(normal, view).within(-1, 1).widened(COSINE_ERROR)
    lit = (cos_i.lo > LIT) & (cos_v.lo > LIT)
    dark = (cos_i.hi <= LIT) | (cos_v.hi <= LIT)
    cos_i, cos_v = cos_i.within(LIT, 2), cos_v.within(LIT, 2)
    n_dot_h = dot(normal, h).widened(COSINE_ERROR).meet(cos_i + cos_v).within(LIT, 4)
    h2 = h.square().sum().widened(4 * COSINE_ERROR).within(LIT, 4)
    # |n x h|^2 both from its components and as |h|^2 - (n.h)^2, whichever is narrower.
    direct = cross(normal, h).square().sum()
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

    sides = (m.lo,) if m.is_one else (m.lo, m.hi)
    least = most = value(tan2.lo, sides[0])
    for t, x in [(tan2.hi, sides[0])] + [(t, m.hi) for t in (tan2.lo, tan2.hi) if not m.is_one]:
        corner = value(t, x)
        least, most = np.minimum(least, corner), np.maximum(most, corner)
    for x in sides:
        best_t = power * x * x - 1
        # Mostly the best one is below the interval, of which the nearest end has been looked at.
        if np.any(best_t > tan2.lo):
            most = np.maximum(most, value(np.clip(best_t, tan2.lo, tan2.hi), x))
    if not m.is_one:
        for t in (tan2.lo, tan2.hi):
            most = np.maximum(most, value(t, np.clip(np.sqrt(t), m.lo, m.hi)))
    return Span(least, most)


class Terms:
    """The parts of the gloss of some parameters under some geometry."""

    def __init__(self, reflection: Reflection, given: Parameters, under: Geometry) -> None:
        self.reflection, self.given, self.under = reflection, given, under
        self.D = _lobe(reflection, under.tan2_h, given.m)
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

    @cached_property
    def diffuse(self) -> Span:
        """g d cos theta_i."""
        return self.given.d.times(self.under.cos_i).times(self.reflection.scale)

    @cached_property
    def FV(self) -> Span:
        """F V."""
        return positive_product(self.F, self.V)

    @cached_property
    def gloss(self) -> Span:
        """g ks F D V."""
        return self.given.ks.times(positive_product(self.D, self.FV)).times(self.reflection.scale)

    @cached_property
    def seen(self) -> Span:
        """All of it, of surfaces that are lit."""
        lit = self.diffuse + self.gloss
        ambient = self.reflection.ambient
        return lit + self.given.Rd.times(ambient) if ambient else lit


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
    g, D, FV, V = reflection.scale, terms.D, terms.FV, terms.V_unshadowed
    ks = given.ks.join(of_Y(given.ks))
    either = D.join(of_Y(D))
    found: dict[str, Change] = {}

    def step(change: Span, most: Span) -> Change:
        """Gloss changes thus, and is as much as `most` before or after."""
        floor, ceiling = terms.diffuse.lo + np.minimum(most.lo, 0), terms.diffuse.hi + most.hi
        return _where_seen(reflection, under, change, floor, ceiling)

    if "specular" in wanted:
        found["specular"] = step(terms.gloss, terms.gloss)
    if "chromatic-specular" in wanted:
        lobe = positive_product(D, FV).times(g)
        found["chromatic-specular"] = step(given.ks_off.times(lobe), ks.times(lobe))
    if "chromatic-roughness" in wanted:
        off = (D - of_Y(D)).where(given.m_off.magnitude > 0, ZERO)
        most = ks.times(positive_product(either, FV).times(g))
        found["chromatic-roughness"] = step((ks * off).times(FV).times(g), most)
    if "shadowing" in wanted or "fresnel" in wanted:
        facets = ks.times(either.times(g))
        if "shadowing" in wanted:
            change = -facets.times(positive_product(terms.F, terms.shadow))
            found["shadowing"] = step(change, facets.times(positive_product(terms.F, V)))
        if "fresnel" in wanted:
            change = -facets.times(positive_product(ONE - terms.F, terms.V.join(V)))
            found["fresnel"] = step(change, facets.times(V))
    if "below-horizon" in wanted:
        found["below-horizon"] = Change(under.lit, lambda: np.array(np.inf))
    if "highlight-range" in wanted:
        found["highlight-range"] = _above_white(terms)
    return found


def change_of_ways(full: Terms, other: Terms, off: Parameters, n_off: Span, light: Span) -> Change:
    """What it does at most to take other parameters, another normal, or both: relief, slope, interpolation.

    `off` are `differences` of the parameters, `n_off` the one normal less the other.
    """
    reflection, g = full.reflection, full.reflection.scale
    one, two = full.under, other.under
    aligned = np.all(n_off.magnitude == 0, axis=0)
    certain = (one.lit & two.lit) | aligned
    diffuse = (full.given.d * dot(n_off, light) + off.d.times(two.cos_i)).times(g)
    D_off = (full.D - other.D).where(off.m.magnitude > 0, ZERO)
    same_place = (off.ks.times(full.D) + other.given.ks * D_off).times(full.FV)
    change = diffuse + same_place.times(g).where(aligned, full.gloss - other.gloss)
    under = replace(one, lit=one.lit & two.lit, dark=one.dark & two.dark)
    if reflection.ambient:
        # What is left where the lamp alone is below the surface.
        ambient = off.Rd.times(reflection.ambient)
        change = (change + ambient).join(ambient)
        under = replace(under, dark=np.zeros_like(under.dark))
    before, after = full.seen, other.seen
    change = change.where(certain, before.join(ZERO) - after.join(ZERO))
    floor, ceiling = np.minimum(before.lo, after.lo), np.maximum(before.hi, after.hi)
    return _where_seen(reflection, under, change, floor, ceiling)


def _above_white(terms: Terms) -> Change:
    white, seen = terms.reflection.white_column, terms.seen
    change = Span(np.maximum(seen.lo - white, 0), np.maximum(seen.hi - white, 0))
    always = replace(terms.under, lit=np.ones_like(terms.under.lit), dark=np.zeros_like(terms.under.dark))
    return _where_seen(terms.reflection, always, change, white, np.maximum(seen.hi, white))


def _where_seen(
    reflection: Reflection, under: Geometry, change: Span, floor: Array, ceiling: Array
) -> Change:
    """The change of XYZ: none where the surface is dark, perhaps none where it is not lit for certain.

    `floor` and `ceiling` bound the XYZ of lit surfaces before and after.
    """
    low = np.where(under.lit, floor, np.minimum(floor, 0))
    change = ZERO.where(under.dark, change.where(under.lit, change.join(ZERO)))
    # What is not a number compares as false, and so counts as the worst.
    exact = np.all(change.magnitude <= EXACT * np.abs(low) + VANISHING, axis=0)

    def bound() -> Array:
        f = _lightness_change(change, low, np.maximum(ceiling, 0), reflection.white_column)
        dL, da, db = f[1].magnitude * 116, (f[0] - f[1]).magnitude * 500, (f[1] - f[2]).magnitude * 200
        dE: Array = np.sqrt(dL * dL + CHROMATIC_WEIGHT * (da * da + db * db))
        return dE

    return Change(exact, bound)


def _lightness_change(change: Span, low: Array, high: Array, white: Array) -> Span:
    """The change of f(x / white), the function in L*a*b*, where x lies between `low` and `high` throughout.

    It is concave, so that a step of a given size does most at the low end and least at the high one.
    """
    low, high = low / white, high / white
    f_low, f_high = _f(low), _f(high)

    def most(step: Array) -> Array:
        up = step > 0
        moved: Array = _f(np.where(up, low, high) + step) - np.where(up, f_low, f_high)
        return moved

    return Span(-most(-change.lo / white), most(change.hi / white)).widened(ROUNDING * f_high)


def _f(x: Array) -> Array:
    """CIE 15: of L* = 116 f - 16."""
    f: Array = np.where(x > (6 / 29) ** 3, np.cbrt(x), x * (841 / 108) + 4 / 29)
    return f
