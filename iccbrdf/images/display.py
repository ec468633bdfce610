"""XYZ for the eye: through an sRGB display profile into a PNG, by Little CMS (imagecodecs)."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from contextlib import contextmanager
from typing import BinaryIO, Literal, NamedTuple

import imagecodecs
import numpy as np

from iccbrdf.errors import UsageError
from iccbrdf.files import StrPath, atomic_output
from iccbrdf.images.blocks import Array, Assembler, Block, Coverage, Grid
from iccbrdf.images.png import LONGEST_SIDE, PngWriter

_BAND_ROWS = 16
# Little CMS turns infinities into black; beyond this value everything is white anyway.
_BRIGHTEST = 1e6


@functools.cache
def srgb_profile() -> bytes:
    """The sRGB display profile of Little CMS, dated 2000-01-01 so that it is the same on every day."""
    profile = bytearray(imagecodecs.cms_profile("srgb"))
    profile[24:36] = b"\x07\xd0\0\x01\0\x01" + bytes(6)
    return bytes(profile)


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
    finite = np.nan_to_num(np.asarray(xyz, np.float32), posinf=_BRIGHTEST, neginf=-_BRIGHTEST)
    rgb: Array = imagecodecs.cms_transform(
        finite.clip(-_BRIGHTEST, _BRIGHTEST),
        imagecodecs.cms_profile("xyz"),
        srgb_profile(),
        colorspace="xyz",
        outcolorspace="rgb",
        outdtype=np.float32,
        intent=imagecodecs.CMS.INTENT.RELATIVE_COLORIMETRIC,
    )
    return rgb


class Levels(NamedTuple):
    """A block in the levels of the display, and how many of its pixels `PngSink` counts as what."""

    block: Block
    above_white: int
    out_of_gamut: int
    not_finite: int


class PngSink:
    """A PNG that is being written.  See `create_png`.

    Attributes
    ----------
    above_white
        Pixels so far with a component above the display's largest, and so clipped.
    out_of_gamut
        Pixels so far with a component below zero: colours more saturated than the display's.
    not_finite
        Pixels so far with NaN or an infinity.
    """

    def __init__(
        self, file: BinaryIO, path: StrPath, height: int, width: int, depth: int, exposure: float
    ) -> None:
        self._path = path
        self._exposure = np.float32(exposure)
        self._largest = 2**depth - 1
        self._dtype = np.dtype(f"u{depth // 8}")
        self._coverage = Coverage(path, height, width, 3)
        self._assembler = Assembler(Grid(height, width, _BAND_ROWS, width), 3, self._dtype)
        self._writer = PngWriter(file, height, width, self._dtype, srgb_profile())
        self._next_band = 0
        self.above_white = 0
        self.out_of_gamut = 0
        self.not_finite = 0

    def write(self, block: Block) -> None:
        """Write a block of XYZ (D50, Y = 1 for white); UsageError where it does not fit or follow."""
        self.put(self.encode(block))

    def encode(self, block: Block) -> Levels:
        """The part of `write` that any thread may do, for several blocks at a time; the rest is `put`."""
        self._coverage.check(block)
        not_finite = _pixels(~np.isfinite(block.data))
        levels = np.rint(xyz_to_srgb(block.data * self._exposure) * self._largest)
        above, outside = _pixels(levels > self._largest), _pixels(levels < 0)
        pixels = levels.clip(0, self._largest).astype(self._dtype)
        return Levels(block._replace(data=pixels), above, outside, not_finite)

    def put(self, levels: Levels) -> None:
        """Write what `encode` gave; UsageError where it does not follow."""
        block = levels.block
        self._coverage.count(block)
        self.above_white += levels.above_white
        self.out_of_gamut += levels.out_of_gamut
        self.not_finite += levels.not_finite
        for band, rows in self._assembler.add(block):
            if band != self._next_band:
                raise UsageError(
                    f"{self._path}: a block at row {block.y0} came before those above it; "
                    "a PNG is written from the top"
                )
            self._next_band += 1
            self._writer.write_rows(rows)

    def finish(self) -> None:
        """Write what belongs after the last row; UsageError where rows are missing."""
        self._coverage.check_filled()
        self._writer.finish()


def _pixels(mask: Array) -> int:
    return int(np.count_nonzero(mask.any(axis=2)))


@contextmanager
def create_png(
    path: StrPath,
    height: int,
    width: int,
    *,
    depth: Literal[8, 16] = 8,
    exposure: float = 1.0,
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

    Raises
    ------
    UsageError
        The target exists already, before anything is written; an empty image, another depth or an exposure
        that is not positive; or the block ended before all pixels were there.
    LimitError
        The disk is full.
    """
    if min(height, width) < 1 or max(height, width) > LONGEST_SIDE:
        raise UsageError(f"{path}: a PNG of {height} x {width} pixels, expected 1 to {LONGEST_SIDE} each way")
    if depth not in (8, 16):
        raise UsageError(f"{path}: {depth} bits per sample, a PNG has 8 or 16")
    if not 0 < exposure < np.inf:
        raise UsageError(f"{path}: exposure {exposure}, expected a positive factor")
    with atomic_output(path, overwrite=overwrite) as temporary, temporary.open("wb") as file:
        sink = PngSink(file, path, height, width, depth, exposure)
        yield sink
        sink.finish()
