"""Tables and curves: what reads numbers from memory.

A table is an argument of the compiled function, not a part of it, so that programs that differ in nothing
else share code.  `Tables` collects them; positions are clipped before they become indices, NaN to 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from iccbrdf.calc.elements import Piece, formula, piece_nodes, pieces
from iccbrdf.calc.llvm.assembler import Assembler, Type, Value
from iccbrdf.calc.llvm.rows import load_channels
from iccbrdf.calc.llvm.wide import wide_exp, wide_log, wide_log10, wide_power
from iccbrdf.errors import UnsupportedError

MOST_READ = 4096
"""Numbers of a look-up table that are read for a pixel (2^inputs corners times the outputs): code grows with
them."""
MAX_TABLES = 1 << 27
"""Bytes of all tables, one that is read at several places counted for each: every one is converted."""


class Tables:
    """The tables of a program, each once."""

    def __init__(self, code: Assembler) -> None:
        self.arrays: list[NDArray[Any]] = []
        self._code = code
        self._bytes = 0
        self._known: dict[tuple[Any, ...], str] = {}

    def base(self, array: NDArray[Any]) -> str:
        """The address of a table, as a name in the function."""
        array = np.ascontiguousarray(array)
        self._bytes += array.nbytes
        if self._bytes > MAX_TABLES:
            raise UnsupportedError(f"look-up tables of more than {MAX_TABLES} bytes")
        key = (array.dtype, array.size, array.tobytes())
        if key not in self._known:
            self._known[key] = f"%table{len(self.arrays)}"
            self.arrays.append(array)
        return self._known[key]

    def prologue(self) -> list[str]:
        """Instructions that fetch the addresses from the array of them."""
        lines = []
        for number in range(len(self.arrays)):
            lines.append(f"  %place{number} = getelementptr inbounds ptr, ptr %tables, i64 {number}")
            lines.append(f"  %table{number} = load ptr, ptr %place{number}, align 8")
        return lines


# Tables of numbers of the working type -----------------------------------------------------------------


def look_up(tables: Tables, element: Any, channels: Sequence[Value]) -> list[Value]:
    """The outputs of a CLUT, summed over the corners of a cell in the interpreter's order.

    Pixel by pixel, with a node's outputs as a vector: they lie side by side in the table.
    """
    code, type = channels[0].code, channels[0].type
    *grid, outputs = element.table.shape
    if 2 ** len(grid) * outputs > MOST_READ:
        raise UnsupportedError(
            f"clut of {len(grid)} inputs and {outputs} outputs: {2 ** len(grid) * outputs} numbers are read "
            f"for a pixel, at most {MOST_READ} by LLVM"
        )
    dtype = np.float32 if type.element == "float" else np.float64
    base = tables.base(element.table.astype(dtype))
    cells, offsets, weights = _cells(element.table.shape, channels)
    lanes = type.lanes
    cell_buffer = code.buffer("i32", lanes)
    weight_buffer = code.buffer(type.element, lanes * len(weights))
    result_buffer = code.buffer(type.element, lanes * outputs)
    code.store(cells, cell_buffer, 0)
    for number, weight in enumerate(weights):
        code.store(weight, weight_buffer, number * lanes)
    row = Type(type.element, outputs)

    def pixel(lane: str) -> None:
        cell = code.scalar(f"load i32, ptr {code.address(cell_buffer, 'i32', lane)}, align 4")
        wide = code.scalar(f"zext i32 {cell} to i64")
        corner = code.address(base, type.element, wide)
        weight_here = code.address(weight_buffer, type.element, lane)
        total = code.constant(0.0, row)
        for number, offset in enumerate(offsets):
            weight = code.load_broadcast(weight_here, row, number * lanes)
            total = total + weight * code.load(corner, row, offset)
        start = code.scalar(f"mul nuw nsw i64 {lane}, {outputs}")
        code.store(total, result_buffer, start)

    code.loop(lanes, pixel)
    results = load_channels(code, result_buffer, type, outputs, range(outputs))
    return [results[output] for output in range(outputs)]


def _cells(shape: Sequence[int], channels: Sequence[Value]) -> tuple[Value, list[int], list[Value]]:
    """Where each pixel's cell begins in the table, and offsets and weights of the cell's corners."""
    code = channels[0].code
    stride = int(np.prod(shape))
    cells = code.constant(0, channels[0].type.of("i32"))
    offsets: list[int] = [0]
    weights: list[Value] = []
    for x, count in zip(channels, shape[:-1], strict=True):
        stride //= count
        position = _clipped(x) * float(count - 1)
        left = code.intrinsic("floor", position)
        left = code.select(left < count - 2.0, left, count - 2.0)
        cells = cells + code.cast("fptosi", left, cells.type) * stride
        part = position - left
        sides = (1.0 - part, part)
        offsets = [offset + step for offset in offsets for step in (0, stride)]
        weights = [weight * side for weight in weights for side in sides] or list(sides)
    return cells, offsets, weights


def _clipped(x: Value) -> Value:
    """Into 0..1, NaN to 0."""
    code = x.code
    return code.select(x > 0.0, code.select(x < 1.0, x, 1.0), 0.0)


# Tables of float64 -------------------------------------------------------------------------------------


def tint(tables: Tables, element: Any, channels: Sequence[Value]) -> list[Value]:
    """The outputs of a tint array."""
    code = channels[0].code
    rows = element.table.astype(np.float64)
    position = code.widen(_clipped(channels[0])) * float(len(rows) - 1)
    values = [_interpolated(tables, column, position) for column in rows.T]
    return [code.narrow(value, channels[0].type) for value in values]


def curve(tables: Tables, detail: Any, x: Value) -> Value:
    """A curve, computed in float64 and rounded once."""
    code = x.code
    function = _CURVES.get(detail.signature)
    if function is None:
        raise UnsupportedError(f"curve {detail.signature!r} cannot be run by LLVM, only {', '.join(_CURVES)}")
    return code.narrow(function(tables, detail, code.widen(x)), x.type)


def _interpolated(tables: Tables, nodes: NDArray[Any], position: Value) -> Value:
    """Straight lines between nodes at a position counted in nodes; the lines at the ends go on."""
    code = position.code
    base = tables.base(nodes)
    left = code.intrinsic("floor", position)
    left = code.select(left > 0.0, left, 0.0)
    left = code.select(left < len(nodes) - 2.0, left, len(nodes) - 2.0)
    index = code.cast("fptosi", left, left.type.of("i32"))
    low = code.gather(base, index, left.type)
    high = code.gather(code.address(base, "double", 1), index, left.type)
    return low + (position - left) * (high - low)


def _sampled(tables: Tables, detail: Any, x: Value) -> Value:
    nodes = np.asarray(detail.values, np.float64)
    first, last = float(detail.first), float(detail.last)
    position = (x - first) / (last - first) * float(len(nodes) - 1)
    if detail.extension == 0:
        position = _between(position, 0.0, len(nodes) - 1.0)
    return _interpolated(tables, nodes, position)


def _between(x: Value, low: float, high: float) -> Value:
    """Clipped; NaN stays NaN."""
    code = x.code
    x = code.select(x < low, low, x)
    return code.select(x > high, high, x)


def _segmented(tables: Tables, detail: Any, x: Value) -> Value:
    result = x
    code = x.code
    with np.errstate(all="ignore"):
        parts = pieces(detail)
    for piece in reversed(parts):
        inside = x <= piece.end
        if piece.start > -np.inf:
            inside = inside & (x > piece.start)
        (value,) = code.where_any(inside, partial(_piece, tables, piece, x))
        result = code.select(inside, value, result)
    return result


def _piece(tables: Tables, piece: Piece, x: Value) -> list[Value]:
    if piece.segment.signature == "parf":
        value = formula(piece.segment, _Traced(x)).value
        return [value if isinstance(value, Value) else x.code.constant(value, x.type)]
    nodes = piece_nodes(piece)
    start, end = float(piece.start), float(piece.end)
    return [_interpolated(tables, nodes, (x - start) / (end - start) * float(len(nodes) - 1))]


_CURVES: Mapping[str, Callable[[Tables, Any, Value], Value]] = {"curf": _segmented, "sngf": _sampled}


# Formulas ----------------------------------------------------------------------------------------------


class _Traced(NDArrayOperatorsMixin):
    """A value in the place of an array: what NumPy would compute with it becomes instructions.

    So a curve's formulas are written once, in calc/elements.py.
    """

    dtype = np.dtype(np.float64)

    def __init__(self, value: Value) -> None:
        self.value = value

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any) -> Any:
        return _Traced(_UFUNCS[ufunc](self.value.code, *map(_plain, inputs)))

    def __array_function__(self, function: Any, types: Any, arguments: Any, options: Any) -> Any:
        if function is not np.where:
            return NotImplemented
        return _Traced(self.value.code.select(*map(_plain, arguments)))

    def __getitem__(self, key: tuple[()]) -> _Traced:
        return self


def _plain(value: Any) -> Any:
    return value.value if isinstance(value, _Traced) else value if isinstance(value, Value) else float(value)


def _power(code: Assembler, x: Any, y: Any) -> Value:
    type = (x if isinstance(x, Value) else y).type
    return wide_power(x if isinstance(x, Value) else code.constant(x, type), y)


_UFUNCS: Mapping[Any, Callable[..., Value]] = {
    np.add: lambda code, x, y: x + y,
    np.subtract: lambda code, x, y: x - y,
    np.multiply: lambda code, x, y: x * y,
    np.divide: lambda code, x, y: x / y,
    np.greater: lambda code, x, y: x > y,
    np.maximum: lambda code, x, y: code.select(x < y, y, x),
    np.exp: lambda code, x: wide_exp(x),
    np.log: lambda code, x: wide_log(x),
    np.log10: lambda code, x: wide_log10(x),
    np.power: _power,
}
