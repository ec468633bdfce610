"""Interval arithmetic of the calculator's operators: sound for every back end, NaN and infinities included.

An interval holds every value that an operator can give for operands in theirs.  Rounding to nearest is
monotone, so that for + - * / and roots the operator itself, at the ends, gives the narrowest interval
that is right; other functions are widened by `LIBRARY_ULPS`, within which all back ends agree.

A condition is an interval, too: `FALSE`, `TRUE` or `EITHER`.  0 stands for both zeros.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from iccbrdf.calc.meanings import INT_MIN

INF = math.inf

LIBRARY_ULPS = 8
"""How far off in units of the last place a function may be: back ends promise 4 beside the interpreter."""

_FAR = 1e6
"""Angles in radians beyond which sine and cosine count as anything within -1..1."""
_STEEPEST = 1e19
"""No floating-point number is so near to a pole of the tangent that the tangent would be larger."""


class Interval(NamedTuple):
    """All numbers from `low` to `high`, infinities where an end is one, and NaN where `nan` says so.

    One with `low` above `high` is empty: no pixel comes there.
    """

    low: float
    high: float
    nan: bool = False

    @classmethod
    def point(cls, value: float) -> Interval:
        """One number; of NaN all that is known is that it may be one."""
        return ANYTHING if math.isnan(value) else cls(value, value)

    @property
    def empty(self) -> bool:
        return self.low > self.high

    @property
    def finite(self) -> bool:
        """Whether neither infinities nor NaN are in it."""
        return not self.nan and self.low > -INF and self.high < INF

    @property
    def magnitude(self) -> float:
        """The largest absolute value."""
        return max(abs(self.low), abs(self.high))

    @property
    def mignitude(self) -> float:
        """The smallest absolute value."""
        return 0.0 if self.holds(0.0) else min(abs(self.low), abs(self.high))

    def holds(self, value: float) -> bool:
        """Whether a number, or NaN, is in it."""
        return self.nan if math.isnan(value) else self.low <= value <= self.high

    def join(self, other: Interval) -> Interval:
        """The smallest interval around both."""
        return Interval(min(self.low, other.low), max(self.high, other.high), self.nan or other.nan)

    def meet(self, other: Interval) -> Interval:
        """What is in both; where that is NaN alone, anything."""
        low, high = max(self.low, other.low), min(self.high, other.high)
        if self.nan and other.nan:
            return ANYTHING if low > high else Interval(low, high, True)
        return Interval(low, high)

    def __str__(self) -> str:
        return f"{self.low:.4g} to {self.high:.4g}" + (" or NaN" if self.nan else "")


ANYTHING = Interval(-INF, INF, True)
EMPTY = Interval(INF, -INF)
FALSE, TRUE, EITHER = Interval(0.0, 0.0), Interval(1.0, 1.0), Interval(0.0, 1.0)


def truth(may_hold: bool, may_fail: bool) -> Interval:
    """A condition of which this is known."""
    return EITHER if may_hold and may_fail else TRUE if may_hold else FALSE


def opposite(a: Interval) -> Interval:
    """The negation of a condition."""
    return Interval(1.0 - a.high, 1.0 - a.low)


class Arithmetic:
    """The operators on intervals of one floating type; the caller silences NumPy's warnings."""

    def __init__(self, dtype: type[np.floating[Any]]) -> None:
        limits = np.finfo(dtype)
        self.dtype = dtype
        self.largest = float(limits.max)
        self.smallest_normal = float(limits.tiny)
        self.smallest = float(limits.smallest_subnormal)
        self.epsilon = float(limits.eps)

    def round(self, value: float) -> float:
        """To the nearest number of the type."""
        return float(self.dtype(value))

    def above(self, value: float) -> float:
        """The next number of the type."""
        return float(np.nextafter(self.dtype(value), self.dtype(INF)))

    def below(self, value: float) -> float:
        """The number of the type before."""
        return float(np.nextafter(self.dtype(value), self.dtype(-INF)))

    def ulp(self, value: float) -> float:
        """The distance between numbers of the type around `value`."""
        return max(abs(value) * self.epsilon, self.smallest)

    def rounded(self, low: float, high: float, nan: bool = False, ulps: float = LIBRARY_ULPS) -> Interval:
        """Bounds that were computed in float64, in the type; widened by so many units in the last place."""
        low, high = self.round(low), self.round(high)
        if math.isfinite(low):
            low = self.round(low - ulps * self.ulp(low))
        if math.isfinite(high):
            high = self.round(high + ulps * self.ulp(high))
        return Interval(low, high, nan)

    def apply(self, op: str, *arguments: Interval) -> Interval:
        """The values of an operator of lifted graphs that takes nothing but numbers or conditions."""
        if any(argument.empty for argument in arguments):
            return EMPTY
        return _OPERATORS[op](self, *arguments)


def _ends(function: Callable[[float], Any], x: Interval) -> Interval:
    """A function that never falls, at the ends."""
    return Interval(float(function(x.low)), float(function(x.high)), x.nan)


# Rounded once ------------------------------------------------------------------------------------------


def _add(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    nan = x.nan or y.nan or (x.high == INF and y.low == -INF) or (x.low == -INF and y.high == INF)
    low = -INF if -INF in (x.low, y.low) else a.round(x.low + y.low)
    high = INF if INF in (x.high, y.high) else a.round(x.high + y.high)
    return Interval(low, high, nan)


def _negative(a: Arithmetic, x: Interval) -> Interval:
    return Interval(-x.high, -x.low, x.nan)


def _subtract(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    return _add(a, x, _negative(a, y))


def _multiply(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    nan = x.nan or y.nan or (x.holds(0.0) and y.magnitude == INF) or (y.holds(0.0) and x.magnitude == INF)
    corners = [0.0 if 0 in (p, q) else a.round(p * q) for p, q in product(x[:2], y[:2])]
    return Interval(min(corners), max(corners), nan)


def square(a: Arithmetic, x: Interval) -> Interval:
    """x x, which is never negative."""
    return Interval(a.round(x.mignitude * x.mignitude), a.round(x.magnitude * x.magnitude), x.nan)


def _divide(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    nan = x.nan or y.nan or (x.magnitude == INF and y.magnitude == INF)
    if y.holds(0.0):
        return Interval(-INF, INF, nan or x.holds(0.0))
    corners = [0.0 if math.isinf(q) else a.round(p / q) for p, q in product(x[:2], y[:2])]
    return Interval(min(corners), max(corners), nan)


def _root(a: Arithmetic, x: Interval) -> Interval:
    if x.high < 0:
        return ANYTHING
    result = _ends(lambda end: a.round(math.sqrt(max(end, 0.0))), x)
    return result._replace(nan=x.nan or x.low < 0)


# Exact -------------------------------------------------------------------------------------------------


def _absolute(a: Arithmetic, x: Interval) -> Interval:
    return Interval(x.mignitude, x.magnitude, x.nan)


def _floor(a: Arithmetic, x: Interval) -> Interval:
    return _ends(np.floor, x)


def _ceiling(a: Arithmetic, x: Interval) -> Interval:
    return _ends(np.ceil, x)


def _sign(a: Arithmetic, x: Interval) -> Interval:
    result = _ends(np.sign, x)._replace(nan=False)
    return result.join(FALSE) if x.nan else result


def _integer(a: Arithmetic, x: Interval) -> Interval:
    """C's cast to a 32-bit int: what does not fit is -2^31."""
    result = _ends(lambda end: a.round(np.trunc(min(max(end, INT_MIN), -INT_MIN))), x)._replace(nan=False)
    return result if fits_integer(x) else result.join(Interval.point(INT_MIN))


def _nearest_integer(a: Arithmetic, x: Interval) -> Interval:
    return _integer(a, _ends(lambda end: end - 0.5 if end < 0 else end + 0.5, x))


def fits_integer(x: Interval) -> bool:
    """Whether every value, rounded, is a 32-bit int."""
    return not x.nan and x.low - 0.5 > INT_MIN and x.high + 0.5 < -INT_MIN


def _remainder(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    nan = x.nan or y.nan or x.magnitude == INF
    if x.magnitude < y.mignitude:
        return Interval(x.low, x.high, nan)
    bound = x.magnitude if y.holds(0.0) else min(x.magnitude, y.magnitude)
    return Interval(max(-bound, min(x.low, 0.0)), min(bound, max(x.high, 0.0)), nan)


def _minimum(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    result = Interval(min(x.low, y.low), min(x.high, y.high), y.nan)
    return result.join(y) if x.nan else result


def _maximum(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    result = Interval(max(x.low, y.low), max(x.high, y.high), y.nan)
    return result.join(y) if x.nan else result


# Functions of a library --------------------------------------------------------------------------------


def _rising(
    function: Callable[[float], Any], least: float = -INF, most: float = INF
) -> Callable[..., Interval]:
    """A function that rises over its domain from `least` to `most`, and is NaN outside."""

    def bounds(a: Arithmetic, x: Interval) -> Interval:
        outside = x.low < least or x.high > most
        low, high, nan = _ends(lambda end: function(min(max(end, least), most)), x)
        return a.rounded(low, high, nan or outside)

    return bounds


def _exponential(a: Arithmetic, x: Interval) -> Interval:
    result = _rising(np.exp)(a, x)
    # Far below where it is rounded to 0, it is 0 in every back end.
    high = 0.0 if x.high < 2 * math.log(a.smallest) else result.high
    return Interval(max(result.low, 0.0), high, result.nan)


def _arc_cosine(a: Arithmetic, x: Interval) -> Interval:
    arc = _rising(lambda value: -np.arccos(value), -1.0, 1.0)
    return _negative(a, arc(a, x))


def _wave(function: Callable[[float], Any], crest: float) -> Callable[..., Interval]:
    """Sine or cosine, whose value is 1 at `crest` and -1 half a turn from there."""

    def bounds(a: Arithmetic, x: Interval) -> Interval:
        nan = x.nan or x.magnitude == INF
        if x.magnitude > _FAR:
            return a.rounded(-1.0, 1.0, nan)
        ends = [float(function(end)) for end in x[:2]]
        low = -1.0 if _meets(x, crest + math.pi) else min(ends)
        high = 1.0 if _meets(x, crest) else max(ends)
        return a.rounded(low, high, nan)

    return bounds


def _meets(x: Interval, angle: float, turn: float = math.tau) -> bool:
    """Whether `angle`, or it and whole turns, lies in x, or so close that rounding might have moved it."""
    near = 1e-9
    return math.ceil((x.low - angle) / turn - near) <= math.floor((x.high - angle) / turn + near)


def _tangent(a: Arithmetic, x: Interval) -> Interval:
    nan = x.nan or x.magnitude == INF
    if x.magnitude > _FAR or _meets(x, math.pi / 2, math.pi):
        return Interval(-_STEEPEST, _STEEPEST, nan)
    return a.rounded(math.tan(x.low), math.tan(x.high), nan)


def _angle(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    """atan2(y, x); where the point may lie on the cut or at the origin, any angle."""
    if x.low <= 0 and y.holds(0.0):
        return a.rounded(-math.pi, math.pi, x.nan or y.nan)
    corners = [math.atan2(q, p) for p, q in product(x[:2], y[:2])]
    return a.rounded(min(corners), max(corners), x.nan or y.nan)


def _power(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    result, nan = EMPTY, x.nan or y.nan
    if x.high >= 0:
        result = _power_of_positive(a, Interval(max(x.low, 0.0), x.high), y)
        if x.holds(0.0) and y.low < 0:
            # The pole at -0 has the other sign for odd exponents.
            result = result._replace(low=-INF)
    if x.low < 0:
        size = _power_of_positive(a, Interval(max(-x.high, 0.0), -x.low), y)
        whole = y.low == y.high and y.low.is_integer()
        if whole and y.low % 2 == 0:
            result = result.join(size)
        else:
            result = result.join(Interval(-size.high, -size.low if whole else size.high))
        nan = nan or not whole
    # NaN^0 and 1^NaN are 1.
    return result.join(Interval(1.0, 1.0, True)) if nan else result


def _power_of_positive(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    """y ln x, and with it the power, takes its extremes at the corners."""
    corners = [float(np.power(p, q)) for p, q in product(x[:2], y[:2])]
    result = a.rounded(min(corners), max(corners))
    return result._replace(low=max(result.low, 0.0))


# Conditions --------------------------------------------------------------------------------------------


def _less(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    return truth(x.low < y.high, x.nan or y.nan or x.high >= y.low)


def _less_or_equal(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    return truth(x.low <= y.high, x.nan or y.nan or x.high > y.low)


def _equal(a: Arithmetic, x: Interval, y: Interval) -> Interval:
    same = x.low == x.high == y.low == y.high
    return truth(x.low <= y.high and y.low <= x.high, x.nan or y.nan or not same)


def _real(a: Arithmetic, x: Interval) -> Interval:
    return truth(x.low < INF and x.high > -INF, not x.finite)


_OPERATORS: Mapping[str, Callable[..., Interval]] = {
    "add": _add,
    "sub": _subtract,
    "mul": _multiply,
    "div": _divide,
    "neg": _negative,
    "sqrt": _root,
    "abs": _absolute,
    "flor": _floor,
    "ceil": _ceiling,
    "trnc": _integer,
    "rond": _nearest_integer,
    "sign": _sign,
    "mod": _remainder,
    "vmin": _minimum,
    "vmax": _maximum,
    "cbrt": _rising(np.cbrt),
    "exp": _exponential,
    "log": _rising(np.log10, 0.0),
    "ln": _rising(np.log, 0.0),
    "sin": _wave(np.sin, math.pi / 2),
    "cos": _wave(np.cos, 0.0),
    "tan": _tangent,
    "asin": _rising(np.arcsin, -1.0, 1.0),
    "acos": _arc_cosine,
    "atan": _rising(np.arctan),
    "atn2": _angle,
    "pow": _power,
    "lt": _less,
    "le": _less_or_equal,
    "gt": lambda a, x, y: _less(a, y, x),
    "ge": lambda a, x, y: _less_or_equal(a, y, x),
    "eq": _equal,
    "neq": lambda a, x, y: opposite(_equal(a, x, y)),
    "rnum": _real,
    "not": lambda a, x: opposite(x),
    "vand": lambda a, x, y: Interval(min(x.low, y.low), min(x.high, y.high)),
    "vor": lambda a, x, y: Interval(max(x.low, y.low), max(x.high, y.high)),
    "vxor": lambda a, x, y: y if x == FALSE else opposite(y) if x == TRUE else EITHER,
}
