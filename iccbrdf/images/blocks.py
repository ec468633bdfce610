"""Pieces of an image on their way from a file to a file, and the grid of segments that files are cut into."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import UsageError

Array = npt.NDArray[Any]


class Block(NamedTuple):
    """A rectangle of pixels: `data` of shape (height, width, channels), its corner at row `y0`, column `x0`.

    Streams give blocks in row order: bands from top to bottom, the blocks of a band from left to right.
    """

    y0: int
    x0: int
    data: Array


class Place(NamedTuple):
    """Where a block lies in its image: first row, first column, height and width in pixels."""

    y0: int
    x0: int
    height: int
    width: int


class Part(NamedTuple):
    """Where a rectangle meets a segment: the segment's number and the common pixels, seen from both sides."""

    segment: int
    in_segment: tuple[slice, slice]
    in_region: tuple[slice, slice]


@dataclass(frozen=True)
class Grid:
    """An image cut into segments (strips or tiles) of one size, numbered row by row from the top left."""

    height: int
    width: int
    segment_height: int
    segment_width: int

    @property
    def across(self) -> int:
        return math.ceil(self.width / self.segment_width)

    @property
    def segments(self) -> int:
        return self.across * math.ceil(self.height / self.segment_height)

    def extent(self, segment: int) -> tuple[int, int, int, int]:
        """First row, first column, height and width of a segment's part of the image."""
        row, column = divmod(segment, self.across)
        y0, x0 = row * self.segment_height, column * self.segment_width
        return y0, x0, min(self.segment_height, self.height - y0), min(self.segment_width, self.width - x0)

    def parts(self, y0: int, x0: int, height: int, width: int) -> Iterator[Part]:
        """The segments that a rectangle touches, in their order."""
        for row in range(y0 // self.segment_height, math.ceil((y0 + height) / self.segment_height)):
            in_rows, rows = _overlap(row * self.segment_height, self.segment_height, y0, height)
            for column in range(x0 // self.segment_width, math.ceil((x0 + width) / self.segment_width)):
                in_columns, columns = _overlap(column * self.segment_width, self.segment_width, x0, width)
                yield Part(row * self.across + column, (in_rows, in_columns), (rows, columns))

    def runs(self, part: Part) -> Iterator[tuple[int, slice]]:
        """The stretches of pixels of a part that lie together when its segment is stored row by row.

        Yields the offset of each from the segment's start, in pixels, and the rows of the region it fills.
        """
        (rows, columns), (region_rows, _) = part.in_segment, part.in_region
        start = rows.start * self.segment_width + columns.start
        if columns.stop - columns.start == self.segment_width:
            yield start, region_rows
            return
        for i, y in enumerate(range(region_rows.start, region_rows.stop)):
            yield start + i * self.segment_width, slice(y, y + 1)


def _overlap(a: int, length_a: int, b: int, length_b: int) -> tuple[slice, slice]:
    start, stop = max(a, b), min(a + length_a, b + length_b)
    return slice(start - a, stop - a), slice(start - b, stop - b)


class Coverage:
    """Checks that the blocks given to a sink fit the image and fill it."""

    def __init__(self, path: object, height: int, width: int, channels: int) -> None:
        self._path = path
        self._shape = height, width, channels
        self._missing = height * width

    def check(self, block: Block) -> None:
        """UsageError where a block does not fit."""
        height, width, channels = self._shape
        shape = block.data.shape
        fits = len(shape) == 3 and shape[2] == channels
        if not fits or not (0 <= block.y0 <= height - shape[0] and 0 <= block.x0 <= width - shape[1]):
            raise UsageError(
                f"{self._path}: a block of shape {shape} at row {block.y0}, column {block.x0} does not fit "
                f"an image of {height} x {width} pixels with {channels} channels"
            )

    def count(self, block: Block) -> None:
        """Count a block as written."""
        height, width, _ = block.data.shape
        self.count_pixels(height * width)

    def count_pixels(self, pixels: int) -> None:
        """Count so many pixels as written."""
        self._missing -= pixels

    def check_filled(self) -> None:
        """UsageError unless as many pixels came as the image has."""
        height, width, _ = self._shape
        if self._missing:
            written = height * width - self._missing
            raise UsageError(f"{self._path}: {written} pixels were written to an image of {height} x {width}")


class Assembler:
    """Collects blocks into whole segments.  Holds only the segments that blocks have begun to fill."""

    def __init__(self, grid: Grid, channels: int, dtype: npt.DTypeLike) -> None:
        self._grid = grid
        self._channels = channels
        self._dtype = dtype
        self._begun: dict[int, tuple[Array, int]] = {}

    def add(self, block: Block) -> Iterator[tuple[int, Array]]:
        """Yield the number and the pixels of each segment that this block completes."""
        grid = self._grid
        height, width, _ = block.data.shape
        for part in grid.parts(block.y0, block.x0, height, width):
            _, _, rows, columns = grid.extent(part.segment)
            pixels, missing = self._begun.pop(part.segment, (None, rows * columns))
            if pixels is None:
                pixels = np.empty((rows, columns, self._channels), self._dtype)
            piece = block.data[part.in_region]
            pixels[part.in_segment] = piece
            missing -= piece.shape[0] * piece.shape[1]
            if missing > 0:
                self._begun[part.segment] = pixels, missing
            else:
                yield part.segment, pixels
