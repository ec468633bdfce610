"""The processing elements that programs and profiles apply, on planar values.

They are described in ICC.2, multiProcessElementsType.  The objects are those that the profile reader
makes; only their attributes are used here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from iccbrdf.calc.appearance import jab_to_xyz, xyz_to_jab
from iccbrdf.calc.meanings import Value, where
from iccbrdf.calc.tables import TetrahedralTable, clip, multilinear, tetrahedral
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
    cvst: a break point belongs to the segment on its left; NaN stays NaN.  tmap: gain y (x + offset) + black,
    where y is the curve of the last input.  XtoJ, JtoX: see appearance.  calc: see interpreter.run.
    bACS, eACS: nothing.
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


def _look_up_table(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    return multilinear(element.table, channels)


def _tetrahedral(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    return tetrahedral(element.table, channels)


def _interpolate(nodes: Value, position: Value) -> Value:
    """Straight lines between `nodes` at a float64 position counted in nodes; the lines at the ends go on."""
    left = np.minimum(np.floor(position), len(nodes) - 2)
    index = np.where(left > 0, left, 0).astype(np.intp)
    value: Value = nodes[index] + (position - index) * (nodes[index + 1] - nodes[index])
    return value


def _tint(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    rows = element.table.astype(np.float64)
    position = clip(channels[0]).astype(np.float64) * (len(rows) - 1)
    return [_interpolate(column, position).astype(channels[0].dtype) for column in rows.T]


def _tone_map(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    *colours, luminance = channels
    level = apply_curve(element.luminance, luminance, env)
    return [
        gain * level * (x + offset) + black
        for x, function in zip(colours, element.functions, strict=True)
        for gain, offset, black in [map(x.dtype.type, function.parameters)]
    ]


def _xyz_to_jab(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    return xyz_to_jab(element, list(channels))


def _jab_to_xyz(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    return jab_to_xyz(element, list(channels))


def _nothing(element: Any, channels: Sequence[Value], env: Environment) -> list[Value]:
    return list(channels)


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
    result = x
    for piece in reversed(pieces(curve)):
        values = _segment(piece, x)
        result = where(x <= piece.end, values, result)
    return result


class Piece(NamedTuple):
    """One segment of a curve, over (start, end]; `joint` is the value of the one before at `start`."""

    segment: Any
    start: float
    end: float
    joint: Value | None


def pieces(curve: Any) -> list[Piece]:
    """The segments of a segmented curve with what they need to know of each other."""
    found: list[Piece] = []
    joint: Value | None = None
    starts, ends = [-np.inf, *curve.breakpoints], [*curve.breakpoints, np.inf]
    for start, end, segment in zip(starts, ends, curve.segments, strict=True):
        found.append(Piece(segment, start, end, joint))
        joint = _segment(found[-1], np.asarray(end, np.float64))
    return found


def _segment(piece: Piece, x: Value) -> Value:
    if piece.segment.signature == "parf":
        values: Value = formula(piece.segment, x)
        return values
    nodes = piece_nodes(piece)
    return _interpolate(nodes, (x - piece.start) / (piece.end - piece.start) * (len(nodes) - 1))


def formula(segment: Any, x: Any) -> Any:
    """A formula segment of x: an array, or whatever takes NumPy's arithmetic."""
    if segment.type not in _FORMULAS:
        raise UnsupportedError(f"formula segment of type {segment.type}, expected 0 to {max(_FORMULAS)}")
    return _FORMULAS[segment.type](x, *map(float, segment.parameters))


def piece_nodes(piece: Piece) -> Value:
    """The float64 values of a sampled segment at equal distances from its start to its end."""
    if piece.segment.signature != "samf":
        raise UnsupportedError(
            f"curve segment {piece.segment.signature!r} cannot be evaluated, only parf, samf"
        )
    if piece.joint is None or np.isinf(piece.end):
        raise ProfileError("sampled segment as the first or last of its curve, expected a formula segment")
    return np.concatenate([[piece.joint], piece.segment.values]).astype(np.float64)


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
    "tmap": _tone_map,
    "XtoJ": _xyz_to_jab,
    "JtoX": _jab_to_xyz,
    "bACS": _nothing,
    "eACS": _nothing,
    TetrahedralTable.signature: _tetrahedral,
}

SIGNATURES = tuple(_FUNCTIONS)
"""Signatures of the elements that `apply` can evaluate."""
