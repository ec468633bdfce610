"""Intervals of what curves, look-up tables and tint arrays give.  What they compute: calc/elements.py."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from iccbrdf.calc import elements
from iccbrdf.calc.intervals import ANYTHING, EMPTY, FALSE, INF, TRUE, Arithmetic, Interval

WIDE = Arithmetic(np.float64)
"""Curves are computed in float64 and rounded once."""


def curve_range(arithmetic: Arithmetic, curve: Any, x: Interval) -> Interval:
    """The values of one curve of a curve set, which is none of calculators."""
    result = _segmented(curve, x) if curve.signature == "curf" else _sampled(curve, x)
    if result.empty:
        return EMPTY
    return arithmetic.rounded(result.low, result.high, result.nan or x.nan)


def table_range(arithmetic: Arithmetic, table: Any, position: Sequence[Interval], channel: int) -> Interval:
    """The values of an output channel of a CLUT or tint array: between the nodes around its inputs.

    `table` is of shape (grid points of each input..., outputs); inputs are clipped to 0..1, NaN to 0.
    """
    chosen = []
    for x, count in zip(position, table.shape[:-1], strict=True):
        low, high = (min(max(end, 0.0), 1.0) * (count - 1) for end in (0.0 if x.nan else x.low, x.high))
        # A position may be rounded over a node, to the next cell.
        chosen.append(slice(max(math.floor(low * (1 - 1e-6)), 0), math.ceil(high * (1 + 1e-6)) + 1))
    result = _around(np.asarray(table[tuple(chosen)][..., channel], np.float64))
    # The weights of the corners add up to 1 but for rounding.
    slack = arithmetic.epsilon * 2 ** (len(position) + 2) * result.magnitude
    return arithmetic.rounded(result.low - slack, result.high + slack, result.nan)


def _around(values: NDArray[np.float64]) -> Interval:
    """The interval of these numbers; if one is not finite, anything, for weights of 0 make it NaN."""
    if not np.isfinite(values).all():
        return ANYTHING
    return Interval(float(values.min()), float(values.max()))


# Curves ------------------------------------------------------------------------------------------------


def _sampled(curve: Any, x: Interval) -> Interval:
    return _straight(curve, x, np.linspace(curve.first, curve.last, len(curve.values)))


def _segmented(curve: Any, x: Interval) -> Interval:
    result = EMPTY
    for piece in elements.pieces(curve):
        part = x._replace(nan=False).meet(Interval(piece.start, piece.end))
        if part.empty:
            continue
        if piece.segment.signature == "parf":
            result = result.join(elements.formula(piece.segment, _Operand(part)).interval)
            continue
        # The start belongs to the segment before.
        part = part._replace(low=max(part.low, WIDE.above(piece.start)))
        if not part.empty:
            knots = np.linspace(piece.start, piece.end, len(elements.piece_nodes(piece)))
            result = result.join(_straight(curve, part, knots))
    return result


def _straight(curve: Any, x: Interval, knots: NDArray[np.float64]) -> Interval:
    """Of a curve that runs straight between `knots`, and beyond them."""
    if x.magnitude == INF:
        return ANYTHING
    inside = knots[(x.low < knots) & (knots < x.high)]
    result = _around(elements.apply_curve(curve, np.array([x.low, *inside, x.high]), {}))
    slack = 16 * WIDE.epsilon * result.magnitude
    return Interval(result.low - slack, result.high + slack, result.nan)


class _Operand(NDArrayOperatorsMixin):
    """An interval that takes NumPy's arithmetic, for the formulas of segments."""

    dtype = np.dtype(np.float64)

    def __init__(self, interval: Interval) -> None:
        self.interval = interval

    def __array_ufunc__(self, ufunc: Any, method: str, *arguments: Any) -> _Operand:
        intervals = [_interval(argument) for argument in arguments]
        result = WIDE.apply(_UFUNCS[ufunc], *intervals)
        # Unlike the calculator's, NumPy's maximum gives every NaN on.
        return _Operand(result._replace(nan=result.nan or any(interval.nan for interval in intervals)))

    def __array_function__(self, function: Any, types: Any, arguments: Any, options: Any) -> _Operand:
        """`np.where`, which the formulas use for powers of what is above 0, and 0 otherwise."""
        if function is not np.where:
            raise TypeError(f"{function.__name__} of an interval")
        condition, yes, no = (_interval(argument) for argument in arguments)
        result = EMPTY if condition == TRUE else no
        return _Operand(result if condition == FALSE else result.join(yes.meet(Interval(0.0, INF))))

    def __getitem__(self, index: Any) -> _Operand:
        return self


def _interval(operand: Any) -> Interval:
    return operand.interval if isinstance(operand, _Operand) else Interval.point(float(operand))


_UFUNCS: Mapping[Callable[..., Any], str] = {
    np.add: "add",
    np.subtract: "sub",
    np.multiply: "mul",
    np.divide: "div",
    np.power: "pow",
    np.log10: "log",
    np.log: "ln",
    np.exp: "exp",
    np.maximum: "vmax",
    np.greater: "gt",
}
"""Operator of the calculator by NumPy's function."""
