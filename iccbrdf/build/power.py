"""The curves of tables are powers, which version 4 and version 5 profiles can both hold to the last bit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from iccbrdf.brdf.geometry import Array
from iccbrdf.icc import FormulaSegment, ParametricCurve, SegmentedCurve

STEPS = 65536
"""Of s15Fixed16, in which version 4 stores the parameters of its curves."""


@dataclass(frozen=True)
class Power:
    """y = (a x + b)^g + c, for x in 0..1.

    The parameters are whole multiples of 1 / `STEPS`, which float32 holds as well (below 256): the curve is
    the same one in every profile, and where a table's nodes lie is known exactly.
    """

    g: float
    a: float
    b: float
    c: float

    @property
    def parametric(self) -> ParametricCurve:
        """For a look-up-table tag."""
        return ParametricCurve(2, (self.g, self.a, self.b, self.c))

    @property
    def formula(self) -> FormulaSegment:
        """For a curve set."""
        return FormulaSegment(0, (self.g, self.a, self.b, self.c))

    @property
    def clipped(self) -> SegmentedCurve:
        """For a curve set, with y held at 0 and 1 where x lies outside of 0..1."""
        low, high = (FormulaSegment(0, (1, 0, end, 0)) for end in (0, 1))
        return SegmentedCurve((0, 1), (low, self.formula, high))

    def __call__(self, x: npt.ArrayLike) -> Array:
        """y of x, any shape."""
        y: Array = np.maximum(self.a * np.asarray(x, np.float64) + self.b, 0) ** self.g + self.c
        return y

    def inverse(self, y: npt.ArrayLike) -> Array:
        """x of y, any shape."""
        x: Array = (np.maximum(np.asarray(y, np.float64) - self.c, 0) ** (1 / self.g) - self.b) / self.a
        return x


def root(knee: float) -> Power:
    """The cube root of x + `knee`, stretched to 0..1 and never beyond it by rounding."""
    g = round(STEPS / 3) / STEPS
    low, high = knee ** (1 / 3), (1 + knee) ** (1 / 3)
    b = _down(knee / (high - low) ** 3)
    c = _up(-(b**g))
    return Power(g, _down((1 - c) ** (1 / g) - b), b, c)


def cube(knee: float, largest: float) -> Power:
    """From a cube root of y + `knee`, stretched to 0..1, back to y in 0..`largest`."""
    b = _down(knee ** (1 / 3))
    c = _up(-(b**3))
    return Power(3, _up((largest - c) ** (1 / 3) - b), b, c)


GLOSS_POWER = 16
"""High enough for the root to run like a logarithm, low enough for fixed-point parameters."""


def near_exponential(least: float, largest: float) -> Power:
    """From a `GLOSS_POWER`th root of y, stretched to 0..1, back to y in `least`..`largest`."""
    b = _down(least ** (1 / GLOSS_POWER))
    # A step more, for a channel that is the same everywhere must not make a 0.
    return Power(GLOSS_POWER, _up(largest ** (1 / GLOSS_POWER) - b) + 1 / STEPS, b, 0)


def quantised(x: Array) -> Array:
    """As a profile of version 4 stores it."""
    stored: Array = np.rint(x * STEPS) / STEPS
    return stored


def _down(x: float) -> float:
    return math.floor(x * STEPS) / STEPS


def _up(x: float) -> float:
    return math.ceil(x * STEPS) / STEPS
