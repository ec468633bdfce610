"""The processing elements that programs and profiles apply, on planar values.

They are described in ICC.2, multiProcessElementsType.  The objects are those that the profile reader
makes; only their attributes are used here.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from iccbrdf.calc.meanings import Value, where
from iccbrdf.errors import ProfileError, UnsupportedError

Environment: TypeAlias = Mapping[str, float]


def apply(
    element: Any,
    channels: Sequence[ArrayLike],
    *,
    env: Environment | None = None,
    dtype: DTypeLike = np.float32,
) -> list[Value]:
    """The output channels of a processing element.

    channels: `element.inputs` 1-D arrays of pixels, or numbers that hold for all pixels.  env: run-time
    variables for calculators.  Computes in `dtype`; returns `element.outputs` arrays or scalars of it.

    matf: M x + o.  clut, xclt: multilinear, inputs clipped to 0..1, NaN as 0.  tint: linear, as clut.
    cvst: a break point belongs to the segment on its left; NaN stays NaN.  calc: see interpreter.run.
    Raises UnsupportedError for any other element.
    """
    function = _FUNCTIONS.get(element.signature)
    if function is None:
        raise UnsupportedError(
            f"processing element {element.signature!r} cannot be evaluated, only {', '.join(_FUNCTIONS)}"
        )
    values = [np.asarray(channel, dtype)[()] for channel in channels]
    with np.errstate(all="ignore"):
        return function(element, values, env or {})


def _matrix(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    dtype = channels[0].dtype
    offset = element.offset.astype(dtype)
    if element.matrix is None:
        return list(offset)
    rows = element.matrix.astype(dtype)
    return [
        reduce(np.add, map(np.multiply, row, channels)) + constant
        for row, constant in zip(rows, offset, strict=True)
    ]


def _clip(x: Value) -> Value:
    """Into 0..1, NaN to 0."""
    one = x.dtype.type(1)
    return where(x > 0, np.minimum(x, one), x.dtype.type(0))


def _look_up_table(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    """Sum over the corners of the cell that a pixel lies in; the last channel varies fastest."""
    grid, nodes = element.table.shape[:-1], element.table.reshape(-1, element.outputs)
    dtype = channels[0].dtype
    cell: Value = np.asarray(0)
    axes = []
    stride = nodes.shape[0]
    for x, count in zip(channels, grid, strict=True):
        stride //= count
        position = _clip(x) * dtype.type(count - 1)
        left = np.minimum(np.floor(position), dtype.type(count - 2))
        cell = cell + left.astype(np.intp) * stride
        axes.append(((0, 1 - (position - left)), (stride, position - left)))
    outputs: list[Value] = [np.asarray(dtype.type(0))[()]] * element.outputs
    for corner in itertools.product(*axes):
        weight = reduce(np.multiply, (part for _, part in corner))
        values = nodes[cell + sum(step for step, _ in corner)].astype(dtype, copy=False)
        outputs = [total + weight * values[..., j] for j, total in enumerate(outputs)]
    return outputs


def _interpolate(nodes: Value, position: Value) -> Value:
    """Straight lines between `nodes` at a float64 position counted in nodes; the lines at the ends go on."""
    left = np.minimum(np.floor(position), len(nodes) - 2)
    index = np.where(left > 0, left, 0).astype(np.intp)
    value: Value = nodes[index] + (position - index) * (nodes[index + 1] - nodes[index])
    return value


def _tint(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    rows = element.table.astype(np.float64)
    position = _clip(channels[0]).astype(np.float64) * (len(rows) - 1)
    return [_interpolate(column, position).astype(channels[0].dtype) for column in rows.T]


def _calculator(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    # Calculators hold elements and elements hold calculators.
    from iccbrdf.calc.interpreter import run

    return run(
        element.program,
        channels,
        element.outputs,
        elements=element.elements,
        env=env,
        dtype=channels[0].dtype,
    )


# Curves: float64 in, float64 out -----------------------------------------------------------------------


def apply_curve(curve: Any, x: Value, env: Environment) -> Value:
    """One curve of a curve set: computed in float64, rounded once to the type of x."""
    if curve.signature not in _CURVES:
        known = ", ".join(_CURVES)
        raise UnsupportedError(f"curve {curve.signature!r} cannot be evaluated, only {known}")
    wide = _CURVES[curve.signature](curve, x.astype(np.float64), env)
    rounded: Value = wide.astype(x.dtype)[()]
    return rounded


def _curve_set(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    return [apply_curve(curve, x, env) for curve, x in zip(element.curves, channels, strict=True)]


def _segmented(curve: Any, x: Value, env: Environment) -> Value:
    starts = [-np.inf, *curve.breakpoints]
    ends = [*curve.breakpoints, np.inf]
    pieces = []
    joint: Value | None = None
    for start, end, segment in zip(starts, ends, curve.segments, strict=True):
        pieces.append((end, _segment(segment, x, start, end, joint)))
        joint = _segment(segment, np.asarray(end, np.float64), start, end, joint)
    result = x
    for end, values in reversed(pieces):
        result = where(x <= end, values, result)
    return result


def _segment(segment: Any, x: Value, start: float, end: float, joint: Value | None) -> Value:
    """One segment over (start, end]; `joint` is the value of the one before at `start`."""
    if segment.signature == "parf":
        if segment.type not in _FORMULAS:
            raise UnsupportedError(f"formula segment of type {segment.type}, expected 0 to {max(_FORMULAS)}")
        return _FORMULAS[segment.type](x, *map(float, segment.parameters))
    if segment.signature != "samf":
        raise UnsupportedError(f"curve segment {segment.signature!r} cannot be evaluated, only parf, samf")
    if joint is None or np.isinf(end):
        raise ProfileError("sampled segment as the first or last of its curve, expected a formula segment")
    nodes = np.concatenate([[joint], segment.values]).astype(np.float64)
    return _interpolate(nodes, (x - start) / (end - start) * len(segment.values))


def _sampled(curve: Any, x: Value, env: Environment) -> Value:
    return _between(np.asarray(curve.values, np.float64), curve, x)


def _sampled_calculator(curve: Any, x: Value, env: Environment) -> Value:
    return _between(calculator_samples(curve, env), curve, x)


def calculator_samples(curve: Any, env: Environment) -> Value:
    """The samples of a calculator curve (float32 numbers in float64), equally spaced."""
    entries = np.linspace(curve.first, curve.last, curve.size)
    (values,) = _calculator(curve.calculator, [entries.astype(np.float32)], env)
    return np.broadcast_to(values, entries.shape).astype(np.float64)


def _between(nodes: Value, curve: Any, x: Value) -> Value:
    """Equally spaced nodes from `curve.first` to `curve.last`; beyond them extension 0 clips, 1 goes on."""
    position = (x - curve.first) / (curve.last - curve.first) * (len(nodes) - 1)
    if curve.extension == 0:
        position = np.clip(position, 0.0, len(nodes) - 1.0)
    return _interpolate(nodes, position)


def _positive_power(base: Value, exponent: float) -> Value:
    """A power that is 0 for bases up to 0, even for the exponent 0."""
    return where(base > 0, np.power(base, exponent), base.dtype.type(0))


# Parameters in stored order (ICC.2, formula curve segments).
_FORMULAS: Mapping[int, Callable[..., Value]] = {
    0: lambda x, g, a, b, c: np.power(a * x + b, g) + c,
    1: lambda x, g, a, b, c, d: a * np.log10(b * np.power(x, g) + c) + d,
    2: lambda x, a, b, c, d, e: a * np.power(b, c * x + d) + e,
    3: lambda x, g, a, b, c, d: a * _positive_power(b * x + c, g) + d,
    4: lambda x, g, a, b, c, d: a * np.log(d * np.power(x, g) - b) + c,
    5: lambda x, g, a, b, c, d, e: e * np.exp((d * np.power(x, g) - c) / a) + b,
    6: lambda x, w, g, a, b, c, d, e: (
        d * np.power(np.maximum(e * np.power(x, g) - a, 0) / (b - c * np.power(x, g)), w)
    ),
    7: lambda x, w, g, a, b, c, d: d * np.power((a + b * np.power(x, g)) / (1 + c * np.power(x, g)), w),
}

_CURVES: Mapping[str, Callable[[Any, Value, Environment], Value]] = {
    "curf": _segmented,
    "sngf": _sampled,
    "clcf": _sampled_calculator,
}

_FUNCTIONS: Mapping[str, Callable[[Any, Sequence[Value], Environment], list[Value]]] = {
    "matf": _matrix,
    "clut": _look_up_table,
    "xclt": _look_up_table,
    "cvst": _curve_set,
    "tint": _tint,
    "calc": _calculator,
}

SIGNATURES = tuple(_FUNCTIONS)
"""Signatures of the elements that `apply` can evaluate."""
