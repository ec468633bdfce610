"""What the calculator operators compute, as NumPy functions.

A value is a 1-D array (one number a pixel of a tile) or a NumPy scalar (the same number for every pixel);
all values of a run have one dtype, float32 as a CMM has or float64.  Functions return new values of
that dtype, never change their arguments, and keep scalars scalar.

`+ - * /` and what is made of them are rounded to the dtype after every operation, left to right, as C
floats are; roots, powers, logarithms and angles are computed in float64 and rounded once.  Both as
the ICC's reference implementation does it.  Invalid operations give IEEE results; the caller silences
NumPy's warnings.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import reduce, wraps
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Value: TypeAlias = NDArray[Any]
"""An array of a tile's pixels or a NumPy scalar, of the working dtype."""

INT_MIN = -(2.0**31)
NEAR = 1.0e-5

# CIE 15: f is a cube root above EPSILON and a line below, meeting at f = 6/29; rounded as in ICC profiles.
EPSILON, SLOPE, OFFSET, KNEE = 0.008856, 7.787037, 16.0 / 116.0, 0.206893


def where(mask: Value, yes: Value, no: Value) -> Value:
    """`np.where` that leaves scalars scalar."""
    chosen: Value = np.where(mask, yes, no)[()]
    return chosen


def truth(mask: Value, like: Value) -> Value:
    """A condition as the numbers 1 and 0 of the dtype of `like`."""
    return mask.astype(like.dtype)


def is_true(value: Value) -> Value:
    """The calculator's truth: 0.5 and above.  NaN is false."""
    return np.greater_equal(value, 0.5)


def in_double(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compute in float64, round every result once to the dtype of the arguments."""

    @wraps(function)
    def rounded(*values: Value) -> Any:
        dtype = values[0].dtype
        result = function(*(value.astype(np.float64) for value in values))
        if isinstance(result, tuple):
            return tuple(part.astype(dtype) for part in result)
        return result.astype(dtype)

    return rounded


def to_int32(value: Value) -> Value:
    """C's cast to a 32-bit int as x86 does it: toward zero, no -0; NaN and what does not fit is INT_MIN."""
    fits = np.abs(value) < -INT_MIN
    return where(fits, np.trunc(value) + 0.0, value.dtype.type(INT_MIN))


SQRT, CBRT, SIN, COS = map(in_double, (np.sqrt, np.cbrt, np.sin, np.cos))


# One value ---------------------------------------------------------------------------------------------


def square(a: Value) -> Value:
    result: Value = a * a
    return result


def cube(a: Value) -> Value:
    result: Value = a * a * a
    return result


def sign(a: Value) -> Value:
    return truth(a > 0, a) - truth(a < 0, a)


@in_double
def round_half_away(a: Value) -> Value:
    """Nearest integer as the C cast of a +- 0.5 gives it."""
    return to_int32(where(a < 0, a - 0.5, a + 0.5))


def is_real(a: Value) -> Value:
    return truth(np.isfinite(a), a)


def logical_not(a: Value) -> Value:
    return truth(~is_true(a), a)


# Two values --------------------------------------------------------------------------------------------


def modulo(a: Value, b: Value) -> Value:
    """Remainder with the sign of a, exact as C's fmod; a where b is 0."""
    return where(b == 0, a, np.fmod(a, b))


def near(a: Value, b: Value) -> Value:
    # The float64 tolerance lies a little above the float32 one, and C compares with the former.
    return truth(np.abs(a - b) < np.float64(NEAR), a)


def minimum(a: Value, b: Value) -> Value:
    return where(a < b, a, b)


def maximum(a: Value, b: Value) -> Value:
    return where(a > b, a, b)


def equal(a: Value, b: Value) -> Value:
    """The reference compares bits where there is a NaN: one NaN equals another."""
    return truth((a == b) | (np.isnan(a) & np.isnan(b)), a)


def differs(a: Value, b: Value) -> Value:
    return 1 - equal(a, b)


def compare(test: Callable[[Value, Value], Value]) -> Callable[[Value, Value], Value]:
    """An IEEE comparison as an operator: false where there is a NaN."""
    return lambda a, b: truth(test(a, b), a)


def logical(test: Callable[[Value, Value], Value]) -> Callable[[Value, Value], Value]:
    return lambda a, b: truth(test(is_true(a), is_true(b)), a)


@in_double
def power(a: Value, b: Value) -> Value:
    """C's pow.  NumPy takes a root where the exponent is 0.5 for all pixels, which is -0 for -0, not 0."""
    rooted = (b == 0.5) & ((a == 0) | (a == -np.inf))
    return where(rooted, np.abs(a), np.power(a, b))


@in_double
def angle(x: Value, y: Value) -> Value:
    """In radians; the abscissa comes first."""
    result: Value = np.arctan2(y, x)
    return result


def cartesian_to_polar(x: Value, y: Value) -> tuple[Value, Value]:
    degrees = angle(x, y) * 180 / math.pi
    return SQRT(x * x + y * y), where(degrees < 0, degrees + 360, degrees)


def polar_to_cartesian(radius: Value, degrees: Value) -> tuple[Value, Value]:
    radians = degrees * math.pi / 180
    return radius * COS(radians), radius * SIN(radians)


# Three values ------------------------------------------------------------------------------------------


def xyz_to_lab(x: Value, y: Value, z: Value) -> tuple[Value, Value, Value]:
    """CIELAB of XYZ that is already divided by the white.  The line goes on below zero."""
    fx, fy, fz = (where(v > EPSILON, CBRT(v), SLOPE * v + OFFSET) for v in (x, y, z))
    return 116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)


def lab_to_xyz(lightness: Value, a: Value, b: Value) -> tuple[Value, Value, Value]:
    """XYZ over the white; never negative."""
    fy = (lightness + 16) / 116

    def inverse(f: Value) -> Value:
        line = where(f > OFFSET, (f - OFFSET) / SLOPE, f.dtype.type(0))
        return where(f > KNEE, f * f * f, line)

    return inverse(a / 500 + fy), inverse(fy), inverse(fy - b / 200)


# Any number of values to one ---------------------------------------------------------------------------


def total(values: Sequence[Value]) -> Value:
    return reduce(np.add, values)


def product(values: Sequence[Value]) -> Value:
    return reduce(np.multiply, values)


def least(values: Sequence[Value]) -> Value:
    """The reference compares two values the other way round than three, which only NaN and -0 show."""
    if len(values) == 2:
        return minimum(*values)
    return reduce(lambda best, value: where(value < best, value, best), values)


def greatest(values: Sequence[Value]) -> Value:
    if len(values) == 2:
        return maximum(*values)
    return reduce(lambda best, value: where(value > best, value, best), values)


def all_true(values: Sequence[Value]) -> Value:
    """1 unless some value is below 0.5: unlike everywhere else, NaN counts as true."""
    return truth(~reduce(np.logical_or, (value < 0.5 for value in values)), values[0])


def any_true(values: Sequence[Value]) -> Value:
    return truth(reduce(np.logical_or, map(is_true, values)), values[0])


# The whole of what is popped; s and t are the operand's two u16 ----------------------------------------


def copy(values: Sequence[Value], s: int, t: int) -> list[Value]:
    return list(values) * (t + 2)


def rotate_left(values: Sequence[Value], s: int, t: int) -> list[Value]:
    k = (t + 1) % len(values)
    return [*values[k:], *values[:k]]


def rotate_right(values: Sequence[Value], s: int, t: int) -> list[Value]:
    k = len(values) - (t + 1) % len(values)
    return [*values[k:], *values[:k]]


def duplicate(values: Sequence[Value], s: int, t: int) -> list[Value]:
    return [*values, *([values[0]] * (t + 1))]


def flip(values: Sequence[Value], s: int, t: int) -> list[Value]:
    return list(reversed(values))


def discard(values: Sequence[Value], s: int, t: int) -> list[Value]:
    return []


def transpose(values: Sequence[Value], s: int, t: int) -> list[Value]:
    columns = t + 1
    return [value for column in range(columns) for value in values[column::columns]]


def solve(values: Sequence[Value], s: int, t: int) -> list[Value]:
    """Solve M x = y for M of s+1 rows and t+1 columns (row by row, then y); push x, then the flag 1.

    With more rows than columns x is the least-squares solution, with fewer the shortest one.  Where M has
    not full rank (smallest singular value within rounding of zero) or a number is not finite, x and
    the flag are 0.
    """
    rows, columns = s + 1, t + 1
    dtype = values[0].dtype
    numbers = np.stack(np.broadcast_arrays(*values), axis=-1).astype(np.float64)
    finite: Value = np.asarray(np.isfinite(numbers).all(axis=-1))
    numbers = np.where(finite[..., None], numbers, 0.0)
    matrix = numbers[..., : rows * columns].reshape(*numbers.shape[:-1], rows, columns)
    u, sigma, vt = np.linalg.svd(matrix, full_matrices=False)
    tolerance = max(rows, columns) * np.finfo(np.float64).eps * sigma[..., 0]
    solvable: Value = np.asarray(finite & (sigma[..., -1] > tolerance))
    projected = np.einsum("...ij,...i->...j", u, numbers[..., rows * columns :])
    x = np.einsum("...ji,...j->...i", vt, projected / np.where(solvable[..., None], sigma, 1.0))
    x = np.where(solvable[..., None], x, 0.0).astype(dtype)
    return [*(x[..., column] for column in range(columns)), solvable.astype(dtype)[()]]
