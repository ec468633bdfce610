"""The pixels of a block, and what the cells that it is cut into hold at least and at most.

Values by pixel are arrays (k, height, width), or (k, 1, 1) where all pixels have the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.models import NORMAL
from iccbrdf.build.bounds import Columns, Reflection, columns, differences
from iccbrdf.build.spans import Span

LEVELS = (64, 8, 2, 1)
"""Pixels along the sides of the cells that are judged at once: tiles, parts of those that fail, pixels."""

Way = frozenset[str]
"""The effects among relief, slope and interpolation that a way to the pixel leaves out."""

FULL: Way = frozenset()

TINY = 1e-37
"""What the templates add to a squared length, so that no length is 0."""

_SHORTEST = 1e-30
"""Squared length of normals from which on they are of unit length once normalised."""

_CACHED = 1 << 12
"""Pixels whose channels stay in the processor's cache."""

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Pixels:
    """A block's parameters, and its unit normals (3, height, width) or (3, 1, 1)."""

    columns: Columns
    normal: Array

    @classmethod
    def of(
        cls, reflection: Reflection, names: Sequence[str], image: Array, defaults: Mapping[str, float]
    ) -> Pixels:
        """From channels by name, (height, width, channels), and what the others are."""
        values = _planes(image)

        def planes(wanted: Sequence[str]) -> Array:
            rows = [names.index(name) if name in names else None for name in wanted]
            if not any(row is not None for row in rows):
                return np.array([defaults[name] for name in wanted])[:, None, None]
            first = rows[0]
            if first is not None and rows == list(range(first, first + len(rows))):
                return values[first : first + len(rows)]
            found = [
                np.full(values.shape[1:], defaults[name]) if row is None else values[row]
                for name, row in zip(wanted, rows, strict=True)
            ]
            return np.stack(found)

        with np.errstate(all="ignore"):
            return cls(columns(reflection, planes), _unit(planes(NORMAL)))


def _planes(image: Array) -> Array:
    """From (height, width, channels) to (channels, height, width)."""
    height, width, channels = image.shape
    pixels = image.reshape(-1, channels)
    planes = np.empty((channels, len(pixels)))
    for start in range(0, len(pixels), _CACHED):
        here = slice(start, start + _CACHED)
        planes[:, here] = pixels[here].T
    return planes.reshape(channels, height, width)


def _unit(normal: Array) -> Array:
    """As the templates do it.  What they make of vectors next to nothing is not a number here."""
    x, y, z = normal
    squares = x * x + y * y + z * z
    length = np.sqrt(squares + TINY)
    length[(squares > 0) & (squares < _SHORTEST)] = np.nan
    unit: Array = normal / length
    return unit


class Block:
    """A block of pixels by the way to them, and the cells of each level, numbered row by row."""

    def __init__(self, y0: int, x0: int, shape: tuple[int, ...], pixels: Mapping[Way, Pixels]) -> None:
        self.pixels = pixels
        self._corner = y0, x0
        self._shape = shape
        self._off: dict[Way, Columns] = {}
        self._spans: dict[tuple[int, int], Span] = {}

    def _size(self, level: int) -> tuple[int, int]:
        height, width = self._shape
        return -(-height // LEVELS[level]), -(-width // LEVELS[level])

    def count(self, level: int) -> int:
        """The number of cells."""
        rows, columns = self._size(level)
        return rows * columns

    def off(self, way: Way) -> Columns:
        """The parameters of the full way less those of another."""
        if way not in self._off:
            self._off[way] = differences(self.pixels[FULL].columns, self.pixels[way].columns)
        return self._off[way]

    def spans(self, values: Array, level: int, cells: Index) -> Span:
        """The spans (k, n) of values by pixel in some cells; (k, 1) where all pixels have the same.

        `values` must be the block's own.
        """
        if values.shape[1:] == (1, 1):
            return Span.of(values[:, :, 0])
        whole = self._whole(values, level)
        low = whole.lo.take(cells, axis=1)
        return Span(low, low if whole.is_one else whole.hi.take(cells, axis=1))

    def _whole(self, values: Array, level: int) -> Span:
        """The spans of all cells."""
        key = id(values), level
        if key not in self._spans:
            if LEVELS[level] == 1:
                whole = Span.of(values.reshape(len(values), -1))
            else:
                # Tiles of their parts, all others of pixels.
                finer = level + 1 if level == 0 else len(LEVELS) - 1
                times, size = LEVELS[level] // LEVELS[finer], self._size(finer)
                ends = self._whole(values, finer)
                low, high = (
                    _joined(function, end.reshape(-1, *size), times).reshape(len(values), -1)
                    for function, end in ((np.minimum, ends.lo), (np.maximum, ends.hi))
                )
                whole = Span(low, high)
            self._spans[key] = whole
        return self._spans[key]

    def finer(self, level: int, cells: Index) -> tuple[Index, Index]:
        """The cells of the next level within `cells`, and which of these each of them lies in."""
        times = LEVELS[level] // LEVELS[level + 1]
        y, x = np.divmod(cells, self._size(level)[1])
        rows, columns = self._size(level + 1)
        steps = np.arange(times)
        children_y = (y[:, None, None] * times + steps[:, None]) + 0 * steps
        children_x = (x[:, None, None] * times + steps) + 0 * steps[:, None]
        inside = (children_y < rows) & (children_x < columns)
        parents = np.broadcast_to(np.arange(len(cells))[:, None, None], inside.shape)
        return (children_y * columns + children_x)[inside], parents[inside]

    def place(self, level: int, cell: int) -> tuple[int, int]:
        """Row and column in the image of a cell's first pixel."""
        y, x = divmod(cell, self._size(level)[1])
        return self._corner[0] + y * LEVELS[level], self._corner[1] + x * LEVELS[level]


def _joined(function: np.ufunc, values: Array, times: int) -> Array:
    """Squares of so many values along each side as one by a function of two; the last may be smaller."""
    k, height, width = values.shape
    full = height // times * times
    rows = np.empty((k, -(-height // times), width))
    # Whole rows first, which processors are quick at.
    function.reduce(values[:, :full].reshape(k, -1, times, width), axis=2, out=rows[:, : full // times])
    if full < height:
        function.reduce(values[:, full:], axis=1, out=rows[:, -1])
    joined: Array = rows[:, :, ::times].copy()
    for first in range(1, times):
        columns = rows[:, :, first::times]
        part = joined[:, :, : columns.shape[2]]
        function(part, columns, out=part)
    return joined
