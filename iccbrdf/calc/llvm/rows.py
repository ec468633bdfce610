"""Interleaved rows of pixels to vectors of one channel each, and back.

Four channels at a time: each row's four numbers lie side by side in memory, four rows of them are a square
that two rounds of shuffles turn over.  That is faster than gathering numbers one by one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain

from iccbrdf.calc.llvm.assembler import Assembler, Type, Value

_SIDE = 4


def load_channels(
    code: Assembler, base: str, type: Type, channels: int, used: Iterable[int]
) -> dict[int, Value]:
    """The used ones of all channels of as many rows as a vector has lanes."""
    loaded: dict[int, Value] = {}
    used = list(used)
    if not used:
        return loaded
    if channels < _SIDE:
        rows = code.load(base, Type(type.element, type.lanes * channels), 0)
        for channel in used:
            loaded[channel] = code.shuffle(rows, None, range(channel, type.lanes * channels, channels))
        return loaded
    for channel in used:
        if channel not in loaded:
            # The last square overlaps with the one before it.
            first = min(channel // _SIDE * _SIDE, channels - _SIDE)
            squares = [_load_square(code, base, type, channels, first, row) for row in range(_SIDE)]
            loaded.update(zip(range(first, first + _SIDE), _turned(code, squares), strict=True))
    return loaded


def store_channels(code: Assembler, base: str, values: Sequence[Value]) -> None:
    """Write one vector for each channel as rows."""
    count = len(values)
    if count >= _SIDE:
        for position in range(0, count, _SIDE):
            first = min(position, count - _SIDE)
            for row, square in enumerate(_turned(code, values[first : first + _SIDE])):
                _store_square(code, base, square, count, first, row)
        return
    lanes = values[0].type.lanes
    rows = values[0]
    for number, value in enumerate(values[1:], start=1):
        # Both sides of a shuffle are of one length.
        padded = code.shuffle(value, None, [*range(lanes), *[0] * (lanes * (number - 1))])
        rows = code.shuffle(rows, padded, range(lanes * (number + 1)))
    order = chain.from_iterable(range(lane, lanes * count, lanes) for lane in range(lanes))
    code.store(code.shuffle(rows, None, list(order)), base, 0)


def _load_square(code: Assembler, base: str, type: Type, channels: int, first: int, row: int) -> Value:
    """Rows `row`, `row` + 4, ...: four channels of each."""
    parts = [
        code.load(base, Type(type.element, _SIDE), number * channels + first)
        for number in range(row, type.lanes, _SIDE)
    ]
    while len(parts) > 1:
        length = 2 * parts[0].type.lanes
        parts = [code.shuffle(a, b, range(length)) for a, b in zip(parts[::2], parts[1::2], strict=True)]
    return parts[0]


def _store_square(code: Assembler, base: str, square: Value, channels: int, first: int, row: int) -> None:
    for lane in range(0, square.type.lanes, _SIDE):
        part = code.shuffle(square, None, range(lane, lane + _SIDE))
        code.store(part, base, (row + lane) * channels + first)


def _turned(code: Assembler, rows: Sequence[Value]) -> list[Value]:
    """Squares of four numbers, one in each quarter of four vectors, turned over."""
    a, b, c, d = rows
    low, high = (0, 1), (2, 3)
    pairs = [_interleaved(code, x, y, half) for half in (low, high) for x, y in ((a, b), (c, d))]
    return [_joined(code, x, y, half) for x, y in (pairs[:2], pairs[2:]) for half in (low, high)]


def _interleaved(code: Assembler, a: Value, b: Value, half: Sequence[int]) -> Value:
    """In each four lanes a_i b_i a_j b_j, where i and j are the half."""
    lanes = a.type.lanes
    order = [s + q + k for q in range(0, lanes, _SIDE) for k in half for s in (0, lanes)]
    return code.shuffle(a, b, order)


def _joined(code: Assembler, a: Value, b: Value, half: Sequence[int]) -> Value:
    """In each four lanes a_i a_j b_i b_j."""
    lanes = a.type.lanes
    order = [s + q + k for q in range(0, lanes, _SIDE) for s in (0, lanes) for k in half]
    return code.shuffle(a, b, order)
