"""XYZ for the eye: pictures with the display's profile embedded, PNG and TIFF, written as blocks come."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO, Literal, NamedTuple

import numpy as np
import tifffile

from iccbrdf.errors import UsageError
from iccbrdf.files import StrPath, atomic_output
from iccbrdf.images.blocks import Array, Assembler, Block, Coverage, Grid
from iccbrdf.images.checks import not_finite_pixels
from iccbrdf.images.little_cms import from_XYZ
from iccbrdf.images.png import LONGEST_SIDE, PngWriter
from iccbrdf.images.showing import Showing, finite, srgb
from iccbrdf.images.tiff_writer import CLASSIC_BYTES

_BAND_ROWS = 16


def srgb_profile() -> bytes:
    """The profile of `iccbrdf.images.showing.srgb`, as the bytes of a file."""
    return srgb().to_bytes()


def xyz_to_srgb(xyz: Array) -> Array:
    """Encoded sRGB of XYZ relative to D50 (the connection space), Y = 1 for white.

    Parameters
    ----------
    xyz
        Shape (height, width, 3).  NaN counts as 0, infinities as very large.

    Returns
    -------
    Array
        float32, shape (height, width, 3), nominally 0..1, not clipped: colours outside the display's gamut
        lie outside.  The relative intent: (0.9642, 1, 0.8249) becomes (1, 1, 1).
    """
    return from_XYZ(finite(np.asarray(xyz, np.float32)), srgb())


class Levels(NamedTuple):
    """A block in the levels of the display, and how many of its pixels `PictureSink` counts as what."""

    block: Block
    above_white: int
    out_of_gamut: int
    not_finite: int


class PictureSink(ABC):
    """A picture that is being written.  See `create_png` and `create_rgb_tiff`.

    Attributes
    ----------
    above_white
        Pixels so far that are brighter than the display's white.
    out_of_gamut
        Other pixels so far that the display shows in a colour that is noticeably another one.
    not_finite
        Pixels so far with NaN or an infinity.
    """

    def __init__(self, path: StrPath, height: int, width: int, depth: int, showing: Showing) -> None:
        self._path = path
        self._showing = showing
        self._largest = 2**depth - 1
        self._dtype = np.dtype(f"u{depth // 8}")
        self._coverage = Coverage(path, height, width, 3)
        self.above_white = 0
        self.out_of_gamut = 0
        self.not_finite = 0

    @property
    def clipped(self) -> int:
        """Pixels so far that are not shown as they are: out of gamut, or above white and not rolled off."""
        return self.out_of_gamut + (self.above_white if self._showing.highlights == "clip" else 0)

    def write(self, block: Block) -> None:
        """Write a block of XYZ (D50, Y = 1 for white); UsageError where it does not fit or follow."""
        self.put(self.encode(block))

    def encode(self, block: Block) -> Levels:
        """The part of `write` that any thread may do, for several blocks at a time; the rest is `put`."""
        self._coverage.check(block)
        shown = self._showing(block.data)
        return Levels(
            block._replace(data=np.rint(shown.device * self._largest).astype(self._dtype)),
            above_white=int(np.count_nonzero(shown.above_white)),
            out_of_gamut=int(np.count_nonzero(shown.out_of_gamut)),
            not_finite=not_finite_pixels(block.data),
        )

    def put(self, levels: Levels) -> None:
        """Write what `encode` gave; UsageError where it does not follow."""
        self._coverage.count(levels.block)
        self.above_white += levels.above_white
        self.out_of_gamut += levels.out_of_gamut
        self.not_finite += levels.not_finite
        self._put(levels.block)

    def finish(self) -> None:
        """Write what belongs after the last row; UsageError where rows are missing."""
        self._coverage.check_filled()

    @abstractmethod
    def _put(self, block: Block) -> None:
        """Write the samples of a block."""


class PngSink(PictureSink):
    """A PNG that is being written.  See `create_png`."""

    def __init__(
        self, file: BinaryIO, path: StrPath, height: int, width: int, depth: int, showing: Showing
    ) -> None:
        super().__init__(path, height, width, depth, showing)
        self._assembler = Assembler(Grid(height, width, _BAND_ROWS, width), 3, self._dtype)
        self._writer = PngWriter(file, height, width, self._dtype, showing.profile.to_bytes())
        self._next_band = 0

    def _put(self, block: Block) -> None:
        for band, rows in self._assembler.add(block):
            if band != self._next_band:
                raise UsageError(
                    f"{self._path}: a block at row {block.y0} came before those above it; "
                    "a PNG is written from the top"
                )
            self._next_band += 1
            self._writer.write_rows(rows)

    def finish(self) -> None:
        super().finish()
        self._writer.finish()


class RgbTiffSink(PictureSink):
    """An RGB TIFF that is being written.  See `create_rgb_tiff`."""

    def __init__(
        self, pixels: Array, path: StrPath, height: int, width: int, depth: int, showing: Showing
    ) -> None:
        super().__init__(path, height, width, depth, showing)
        self._pixels = pixels

    def _put(self, block: Block) -> None:
        height, width, _ = block.data.shape
        self._pixels[block.y0 : block.y0 + height, block.x0 : block.x0 + width] = block.data


@contextmanager
def create_png(
    path: StrPath,
    height: int,
    width: int,
    *,
    depth: Literal[8, 16] = 8,
    exposure: float = 1.0,
    showing: Showing | None = None,
    overwrite: bool = False,
) -> Iterator[PngSink]:
    """Write a picture: a context manager that gives a sink, to be given blocks of XYZ in row order.

    The PNG appears under its name when the block ends without an exception and all pixels are there.  It is
    written as the blocks come, in memory that does not grow with the height of the image.

    Parameters
    ----------
    depth
        Bits per sample.
    exposure
        Factor on XYZ; above 1 for prints in dim light, below 1 to keep highlights from clipping.
    showing
        On which display and how, instead of on sRGB with `exposure`.

    Raises
    ------
    UsageError
        The target exists already, before anything is written; an empty image, another depth or an exposure
        that is not positive; or the block ended before all pixels were there.
    LimitError
        The disk is full.
    """
    _check("PNG", path, height, width, depth)
    showing = showing or _on_srgb(path, exposure)
    with atomic_output(path, overwrite=overwrite) as temporary, temporary.open("wb") as file:
        sink = PngSink(file, path, height, width, depth, showing)
        yield sink
        sink.finish()


@contextmanager
def create_rgb_tiff(
    path: StrPath,
    height: int,
    width: int,
    *,
    depth: Literal[8, 16] = 8,
    showing: Showing,
    overwrite: bool = False,
) -> Iterator[RgbTiffSink]:
    """Write an uncompressed RGB TIFF, BigTIFF where it needs to be; otherwise as `create_png`."""
    _check("TIFF", path, height, width, depth)
    size = height * width * 3 * depth // 8
    with atomic_output(path, overwrite=overwrite) as temporary:
        pixels = tifffile.memmap(
            temporary,
            shape=(height, width, 3),
            dtype=f"<u{depth // 8}",
            photometric="rgb",
            iccprofile=showing.profile.to_bytes(),
            bigtiff=size > CLASSIC_BYTES,
            byteorder="<",
            metadata=None,
            description=None,
            software="iccbrdf",
        )
        sink = RgbTiffSink(pixels, path, height, width, depth, showing)
        yield sink
        sink.finish()
        pixels.flush()


def _on_srgb(path: StrPath, exposure: float) -> Showing:
    try:
        return Showing(srgb(), exposure)
    except UsageError as error:
        raise UsageError(f"{path}: {error}") from None


def _check(kind: str, path: StrPath, height: int, width: int, depth: int) -> None:
    if min(height, width) < 1 or max(height, width) > LONGEST_SIDE:
        raise UsageError(
            f"{path}: a {kind} of {height} x {width} pixels, expected 1 to {LONGEST_SIDE} each way"
        )
    if depth not in (8, 16):
        raise UsageError(f"{path}: {depth} bits per sample, a picture has 8 or 16")
