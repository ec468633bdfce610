"""Arrays of intervals, and the ranges of directions that lights and views may come from.

Ends are float64 and not rounded outwards: what is bounded with them are float32 results, to which the last
bits of float64 are nothing; `iccbrdf.build.bounds` widens where float32 itself is not exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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

    def __add__(self, other: Span) -> Span:
        return Span(self.lo + other.lo, self.hi + other.hi)

    def __sub__(self, other: Span) -> Span:
        return Span(self.lo - other.hi, self.hi - other.lo)

    def __neg__(self) -> Span:
        return Span(-self.hi, -self.lo)

    def __mul__(self, other: Span) -> Span:
        return Span.around(self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi)

    def times(self, factor: Array | float) -> Span:
        """Times numbers that are not negative."""
        return Span(self.lo * factor, self.hi * factor)

    def join(self, other: Span) -> Span:
        """The narrowest around both."""
        return Span(np.minimum(self.lo, other.lo), np.maximum(self.hi, other.hi))

    def meet(self, other: Span) -> Span:
        """What is in both, of spans that bound the same numbers."""
        return Span(np.maximum(self.lo, other.lo), np.minimum(self.hi, other.hi))

    def within(self, low: float, high: float) -> Span:
        """Numbers held within bounds."""
        return Span(np.clip(self.lo, low, high), np.clip(self.hi, low, high))

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


Vector = tuple[Span, Span, Span]
"""x, y and z."""

ZERO = Span.of(0.0)
ONE = Span.of(1.0)


def dot(a: Sequence[Span], b: Sequence[Span]) -> Span:
    """The scalar products of vectors."""
    x, y, z = (p * q for p, q in zip(a, b, strict=True))
    return x + y + z


def cross(a: Vector, b: Vector) -> Vector:
    """The vector products."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


CELL = 5.0
"""Degrees of zenith and azimuth that a part of a range of directions spans at most."""


@dataclass(frozen=True)
class Directions:
    """Unit vectors: each of n elements is one direction, or all that a part of a range holds."""

    vector: Vector
    """Components of shape (n,)."""
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
        x, y, z = (Span.of(component) for component in unit.T)
        return cls((x, y, z), unit, tuple(texts))

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
        vector = (sin_z * _sine(azimuths + 90), sin_z * _sine(azimuths), cos_z)
        texts = [f"{z[0]:g}..{z[1]:g},{a[0]:g}..{a[1]:g}" for z, a in pairs]
        examples = direction(zeniths.mean(axis=1), azimuths.mean(axis=1))
        return cls(vector, examples, tuple(texts))

    def join(self, other: Directions) -> Directions:
        """These and those."""
        x, y, z = (
            Span(np.concatenate([a.lo, b.lo]), np.concatenate([a.hi, b.hi]))
            for a, b in zip(self.vector, other.vector, strict=True)
        )
        examples = np.concatenate([self.examples, other.examples])
        return Directions((x, y, z), examples, self.texts + other.texts)


def _sine(degrees: Array) -> Span:
    """Of the angles between the two of each row, shape (n, 2)."""
    low, high = np.min(degrees, axis=1), np.max(degrees, axis=1)
    ends = [direction(end, 0.0)[..., 0] for end in (low, high)]
    span = Span.around(*ends)
    crest = np.ceil((low - 90) / 360) * 360 + 90 <= high
    trough = np.ceil((low + 90) / 360) * 360 - 90 <= high
    return Span(np.where(trough, -1.0, span.lo), np.where(crest, 1.0, span.hi))
