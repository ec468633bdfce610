"""Arrays of intervals, and the ranges of directions that lights and views may come from.

Ends are float64 and not rounded outwards: what is bounded with them are float32 results, to which the last
bits of float64 are nothing; `iccbrdf.build.bounds` widens where float32 itself is not exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.brdf.geometry import Array, direction
from iccbrdf.errors import UsageError


@dataclass(frozen=True)
class Span:
    """All numbers from `lo` to `hi`, arrays of shapes that broadcast."""

    lo: Array
    hi: Array

    @classmethod
    def of(cls, value: ArrayLike) -> Span:
        """Single numbers."""
        array = np.asarray(value, np.float64)
        return cls(array, array)

    @classmethod
    def around(cls, *values: Array) -> Span:
        """The narrowest that holds arrays which broadcast."""
        lo = hi = values[0]
        for value in values[1:]:
            lo, hi = np.minimum(lo, value), np.maximum(hi, value)
        return cls(lo, hi)

    @property
    def is_one(self) -> bool:
        """Whether these are single numbers; the ends are then one and the same array."""
        return self.lo is self.hi

    def __getitem__(self, rows: Any) -> Span:
        """Parts of both ends."""
        low = self.lo[rows]
        return Span(low, low if self.is_one else self.hi[rows])

    def __add__(self, other: Span) -> Span:
        low = self.lo + other.lo
        return Span(low, low if self.is_one and other.is_one else self.hi + other.hi)

    def __sub__(self, other: Span) -> Span:
        low = self.lo - other.hi
        return Span(low, low if self.is_one and other.is_one else self.hi - other.lo)

    def __neg__(self) -> Span:
        return Span(-self.hi, -self.lo)

    def __mul__(self, other: Span) -> Span:
        if self.is_one:
            self, other = other, self
        if not other.is_one:
            return Span.around(self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi)
        product = self.lo * other.lo
        return Span(product, product) if self.is_one else Span.around(product, self.hi * other.lo)

    def times(self, factor: Span | Array | float) -> Span:
        """Times numbers that are not negative."""
        if not isinstance(factor, Span):
            return Span(self.lo * factor, self.hi * factor)
        return Span(
            np.minimum(self.lo * factor.lo, self.lo * factor.hi),
            np.maximum(self.hi * factor.lo, self.hi * factor.hi),
        )

    def join(self, other: Span) -> Span:
        """The narrowest around both."""
        return Span(np.minimum(self.lo, other.lo), np.maximum(self.hi, other.hi))

    def meet(self, other: Span) -> Span:
        """What is in both, of spans that bound the same numbers."""
        return Span(np.maximum(self.lo, other.lo), np.minimum(self.hi, other.hi))

    def within(self, low: float, high: float) -> Span:
        """Numbers held within bounds."""
        return Span(*(np.minimum(np.maximum(end, low), high) for end in (self.lo, self.hi)))

    def widened(self, by: Array | float) -> Span:
        """So much wider at both ends."""
        return Span(self.lo - by, self.hi + by)

    def square(self) -> Span:
        """x x, which is never negative."""
        near = np.maximum(np.maximum(self.lo, -self.hi), 0)
        return Span(near * near, np.maximum(self.lo * self.lo, self.hi * self.hi))

    @property
    def magnitude(self) -> Array:
        """The largest absolute value."""
        return np.maximum(np.abs(self.lo), np.abs(self.hi))

    def where(self, condition: NDArray[np.bool_], other: Span) -> Span:
        """This one where `condition` holds, `other` elsewhere."""
        return Span(np.where(condition, self.lo, other.lo), np.where(condition, self.hi, other.hi))

    def sum(self) -> Span:
        """Over the first axis."""
        low = np.add.reduce(self.lo)
        return Span(low, low if self.is_one else np.add.reduce(self.hi))


ZERO = Span.of(0.0)
ONE = Span.of(1.0)

_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


def positive_product(*factors: Span) -> Span:
    """Of numbers none of which is negative."""
    low, high = factors[0].lo, factors[0].hi
    for factor in factors[1:]:
        low, high = low * factor.lo, high * factor.hi
    return Span(low, high)


def dot(a: Span, b: Span) -> Span:
    """The scalar products of vectors, whose first axis is x, y, z."""
    return (a * b).sum()


def cross(a: Span, b: Span) -> Span:
    """The vector products."""
    return a[_NEXT] * b[_LAST] - a[_LAST] * b[_NEXT]


CELL = 5.0
"""Degrees of zenith and azimuth that a part of a range of directions spans at most."""


@dataclass(frozen=True)
class Directions:
    """Unit vectors: each of n elements is one direction, or all that a part of a range holds."""

    vector: Span
    """Components x, y, z, shape (3, n)."""
    examples: Array
    """One of the directions of each element, shape (n, 3)."""
    texts: tuple[str, ...]
    """For people."""

    def __len__(self) -> int:
        return len(self.texts)

    @classmethod
    def single(cls, vectors: ArrayLike, texts: Sequence[str]) -> Directions:
        """Directions by their vectors (n, 3); UsageError where one has no length."""
        vectors = np.asarray(vectors, np.float64)
        lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
        if not lengths.all():
            raise UsageError("light or view: found a vector of length 0, which has no direction")
        unit = vectors / lengths
        return cls(Span.of(unit.T), unit, tuple(texts))

    @classmethod
    def between(cls, start: tuple[float, float], end: tuple[float, float]) -> Directions:
        """Every direction whose zenith and azimuth lie between those of two, in degrees.

        Cut into cells of at most `CELL` degrees.
        """
        cells = []
        for a, b in zip(start, end, strict=True):
            edges = np.linspace(a, b, max(1, int(np.ceil(abs(b - a) / CELL))) + 1)
            cells.append(list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)))
        pairs = [(zenith, azimuth) for zenith in cells[0] for azimuth in cells[1]]
        zeniths, azimuths = (np.array(part) for part in zip(*pairs, strict=True))
        sin_z, cos_z = _sine(zeniths), _sine(zeniths + 90)
        components = (sin_z * _sine(azimuths + 90), sin_z * _sine(azimuths), cos_z)
        vector = Span(np.stack([c.lo for c in components]), np.stack([c.hi for c in components]))
        texts = [f"{z[0]:g}..{z[1]:g},{a[0]:g}..{a[1]:g}" for z, a in pairs]
        examples = direction(zeniths.mean(axis=1), azimuths.mean(axis=1))
        return cls(vector, examples, tuple(texts))

    def join(self, other: Directions) -> Directions:
        """These and those."""
        lo = np.concatenate([self.vector.lo, other.vector.lo], axis=1)
        one = self.vector.is_one and other.vector.is_one
        hi = lo if one else np.concatenate([self.vector.hi, other.vector.hi], axis=1)
        examples = np.concatenate([self.examples, other.examples])
        return Directions(Span(lo, hi), examples, self.texts + other.texts)


def _sine(degrees: Array) -> Span:
    """Of the angles between the two of each row, shape (n, 2)."""
    low, high = np.min(degrees, axis=1), np.max(degrees, axis=1)
    ends = [direction(end, 0.0)[..., 0] for end in (low, high)]
    span = Span.around(*ends)
    crest = np.ceil((low - 90) / 360) * 360 + 90 <= high
    trough = np.ceil((low + 90) / 360) * 360 - 90 <= high
    return Span(np.where(trough, -1.0, span.lo), np.where(crest, 1.0, span.hi))
