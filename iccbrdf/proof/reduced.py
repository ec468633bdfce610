"""Small pictures of large images: area averages of XYZ, gathered as blocks come; contact sheet, animation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from iccbrdf.files import StrPath, atomic_output
from iccbrdf.images.blocks import Array, Block
from iccbrdf.images.showing import Showing

_MARGIN = 10
_LABEL = 14
"""Pixels around the pictures of a contact sheet, and of the height of a label."""
_GREY, _BLACK = (205, 205, 205), (20, 20, 20)
FRAME_MS = 100
"""Milliseconds that a picture of an animation is shown."""


class Sums(NamedTuple):
    """Sums of XYZ, and numbers of pixels, over a rectangle of cells."""

    cells: tuple[slice, slice]
    XYZ: Array
    pixels: Array


class Reduction:
    """An image made smaller, so that its longest side is at most `longest` pixels; nothing is made larger.

    Each pixel of it is the average of the pixels of the image whose corner falls into it.  In linear light,
    so it looks as the large one does from further away.
    """

    def __init__(self, height: int, width: int, longest: int) -> None:
        factor = min(1.0, longest / max(height, width))
        self._size = height, width
        self.height, self.width = max(1, round(height * factor)), max(1, round(width * factor))
        self._sum = np.zeros((self.height, self.width, 3))
        self._count = np.zeros((self.height, self.width, 1))

    def encode(self, block: Block) -> Sums:
        """What a block of XYZ adds, for any thread to make; what is not finite counts as black."""
        rows, columns, _ = block.data.shape
        y, at_y = self._cells(block.y0, rows, axis=0)
        x, at_x = self._cells(block.x0, columns, axis=1)
        data = np.nan_to_num(block.data, posinf=0, neginf=0)
        sums = np.add.reduceat(np.add.reduceat(data, at_y, axis=0, dtype=np.float64), at_x, axis=1)
        counts = np.diff([*at_y, rows])[:, np.newaxis] * np.diff([*at_x, columns])
        return Sums((slice(y[0], y[-1] + 1), slice(x[0], x[-1] + 1)), sums, counts[:, :, np.newaxis])

    def put(self, sums: Sums) -> None:
        """Add what `encode` made of a block."""
        self._sum[sums.cells] += sums.XYZ
        self._count[sums.cells] += sums.pixels

    @property
    def XYZ(self) -> Array:
        """The averages, (height, width, 3)."""
        average: Array = self._sum / np.maximum(self._count, 1)
        return average

    def _cells(self, start: int, count: int, axis: int) -> tuple[Array, Array]:
        """The cells that a stretch of pixels falls into, and where in the stretch each begins."""
        cells = np.arange(start, start + count) * (self.height, self.width)[axis] // self._size[axis]
        return np.unique(cells, return_index=True)


@dataclass(frozen=True)
class Cell:
    """A picture of a contact sheet, in its row and column."""

    row: str
    column: str
    XYZ: Array


def write_sheet(
    path: StrPath, title: str, cells: Sequence[Cell], showing: Showing, *, overwrite: bool
) -> None:
    """Write a contact sheet, a PNG: a row a light, a column a view, each with its label."""
    from PIL import Image, ImageDraw

    rows, columns = (
        list(dict.fromkeys(names)) for names in zip(*((c.row, c.column) for c in cells), strict=True)
    )
    height, width, _ = cells[0].XYZ.shape
    step_y, step_x = height + _LABEL + 2 * _MARGIN, width + _MARGIN
    top = 2 * _LABEL + 2 * _MARGIN
    sheet = Image.new("RGB", (_MARGIN + step_x * len(columns), top + step_y * len(rows)), _GREY)
    draw = ImageDraw.Draw(sheet)
    draw.text((_MARGIN, _MARGIN), title, _BLACK, _font())
    for cell in cells:
        x = _MARGIN + step_x * columns.index(cell.column)
        y = top + step_y * rows.index(cell.row)
        draw.text((x, y - _MARGIN // 2), f"light {cell.row}   view {cell.column}", _BLACK, _font())
        sheet.paste(Image.fromarray(_pixels(cell.XYZ, showing)), (x, y + _LABEL))
    _save(path, [sheet], "png", showing, overwrite)


def write_animation(
    path: StrPath,
    frames: Sequence[Array],
    kind: Literal["png", "webp"],
    showing: Showing,
    *,
    overwrite: bool,
) -> None:
    """Write XYZ pictures, (height, width, 3) each, as an animated PNG or WebP that repeats for ever."""
    from PIL import Image

    _save(path, [Image.fromarray(_pixels(frame, showing)) for frame in frames], kind, showing, overwrite)


def _pixels(XYZ: Array, showing: Showing) -> Array:
    levels: Array = np.rint(showing(XYZ).device * 255).astype(np.uint8)
    return levels


def _font() -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(size=12)


def _save(path: StrPath, pictures: Sequence[Any], kind: str, showing: Showing, overwrite: bool) -> None:
    first, *others = pictures
    animated = {"save_all": True, "append_images": others, "duration": FRAME_MS, "loop": 0} if others else {}
    # Without "lossless" WebP changes colours, and so does the reduction of equal pictures.
    lossless = {"lossless": True, "quality": 60} if kind == "webp" else {}
    with atomic_output(path, overwrite=overwrite) as temporary:
        first.save(temporary, format=kind, icc_profile=showing.profile.to_bytes(), **animated, **lossless)
