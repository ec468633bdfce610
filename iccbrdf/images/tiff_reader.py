"""Multichannel TIFF as a stream of blocks whose meaning is known."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from types import TracebackType

import numpy as np

from iccbrdf.errors import InputError, UsageError, nearest
from iccbrdf.files import StrPath
from iccbrdf.images.blocks import Array, Block, Place
from iccbrdf.images.checks import all_within
from iccbrdf.images.record import SAMPLES, U1_15_ONE, Record, Samples, from_description
from iccbrdf.images.tiff_storage import TiffStorage

BLOCK_PIXELS = 1 << 17
"""Pixels of a block, unless a caller says otherwise: enough that handing it on costs nothing beside."""
BLOCK_SAMPLES = 1 << 22
"""Samples of a block at most, which bounds the memory of a block of many channels."""


def open_tiff(path: StrPath, samples: Samples | None = None, *, lab: bool = False) -> TiffSource:
    """Open a TIFF of one image for reading; use it in a `with` statement.

    Parameters
    ----------
    path
        Strips or tiles, interleaved or planar, classic or BigTIFF, compressed or not; 8 and 16-bit unsigned
        integers, 16, 32 and 64-bit floats; grey, RGB, CMYK or any channels.
    samples
        What the samples mean, for a float file that does not say so itself (see `iccbrdf.images.record`):
        "device" (0..1, the default) or "real" (physical values).  Integers without a record are "device".
    lab
        Also L*a*b* images, whose integers come scaled to 0..1 like all others (`photometric` says which).

    Raises
    ------
    InputError
        The file is missing, is no TIFF or is damaged; or `samples` contradicts what the file says.
    UnsupportedError
        Another sample type, photometric interpretation or orientation, or several images in the file.
    LimitError
        A compressed segment or the whole image is too large.

    Examples
    --------
    >>> with open_tiff("brdf.tif") as source:                 # doctest: +SKIP
    ...     for y0, x0, data in source.blocks():
    ...         process(data)
    """
    return TiffSource(path, samples, lab=lab)


def _reopened(path: str, samples: Samples | None, lab: bool) -> TiffSource:
    return TiffSource(path, samples, lab=lab)


class TiffSource:
    """An open TIFF.  See `open_tiff`.

    Attributes
    ----------
    height, width, channels
        The size of the image.
    names
        The channels' names, where the file has a record of them, else None.
    dtype
        The type of the samples in the file (those of the blocks are float32 always).
    samples
        "device" or "real".
    profile
        The ICC profile embedded in the file (tag 34675), or None.
    photometric, extra_samples, ink_set
        As `iccbrdf.images.tiff_storage.TiffStorage` has them.
    """

    def __init__(self, path: StrPath, samples: Samples | None = None, *, lab: bool = False) -> None:
        if samples is not None and samples not in SAMPLES:
            raise UsageError(f"{path}: unknown samples {samples!r}: {nearest(samples, SAMPLES)}")
        self._path = path
        self._declared, self._lab = samples, lab
        self._storage = TiffStorage(path, lab=lab)
        self.height: int = self._storage.height
        self.width: int = self._storage.width
        self.channels = self._storage.channels
        self.dtype = self._storage.dtype
        self.profile = self._storage.profile
        self.photometric = self._storage.photometric
        self.extra_samples = self._storage.extra_samples
        self.ink_set = self._storage.ink_set
        try:
            record = from_description(self._storage.description, path)
            self._check_meaning(record, samples)
        except BaseException:
            self._storage.close()
            raise
        is_float = self.dtype.kind == "f"
        self.names = record.channels if record else None
        self.samples: Samples = record.samples if record else samples or "device"
        # What a stored integer is divided by.
        self._one = 1 if is_float else U1_15_ONE if self.samples == "real" else np.iinfo(self.dtype).max
        self._must_show = is_float and record is None and samples is None

    def __enter__(self) -> TiffSource:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._storage.close()

    def __reduce__(self) -> tuple[Callable[..., TiffSource], tuple[str, Samples | None, bool]]:
        # An open file does not go to another process, which opens it itself.
        return _reopened, (os.path.abspath(self._path), self._declared, self._lab)

    def _check_meaning(self, record: Record | None, declared: Samples | None) -> None:
        path, is_float = self._path, self.dtype.kind == "f"
        if record is None:
            if declared == "real" and not is_float:
                raise InputError(f"{path}: declared as 'real', but samples of {self.dtype.name} are 'device'")
            return
        if declared is not None and declared != record.samples:
            raise InputError(f"{path}: declared as {declared!r}, but the file says {record.samples!r}")
        if len(record.channels) != self.channels:
            raise InputError(
                f"{path}: the ImageDescription names {len(record.channels)} channels "
                f"({', '.join(record.channels)}), but the image has {self.channels}"
            )
        if record.encoding is None:
            fits = is_float or record.samples == "device"
        else:
            fits = record.samples == "real" and self.dtype.name == "uint16"
        if not fits:
            raise InputError(
                f"{path}: the ImageDescription says {record.samples!r} samples in encoding "
                f"{record.encoding!r}, which does not go with {self.dtype.name}"
            )

    def blocks(self, max_pixels: int = BLOCK_PIXELS) -> Iterator[Block]:
        """The image block by block: `read` at each of `places`."""
        return map(self.read, self.places(max_pixels))

    def places(self, max_pixels: int = BLOCK_PIXELS) -> Iterator[Place]:
        """Where the blocks of the image lie, in row order.

        Parameters
        ----------
        max_pixels
            Blocks have at most so many pixels, and 2^22 samples, except where a single compressed segment has
            more.
        """
        max_pixels = min(max_pixels, BLOCK_SAMPLES // self.channels)
        unit_height, unit_width = self._storage.unit
        unit_pixels = unit_height * unit_width
        columns = unit_width * min(-(-self.width // unit_width), max(1, max_pixels // unit_pixels))
        rows = unit_height * max(1, max_pixels // (unit_height * columns))
        for y0 in range(0, self.height, rows):
            for x0 in range(0, self.width, columns):
                yield Place(y0, x0, min(rows, self.height - y0), min(columns, self.width - x0))

    def read(self, place: Place) -> Block:
        """The block at a place, float32; integers scaled to 0..1 (real XYZ in u1.15 to XYZ).

        Floats come as they are, those that are not finite included.  Several threads may read at a time.

        Raises
        ------
        InputError
            A segment is damaged; or the meaning of a float file is neither recorded nor declared and a value
            lies outside 0..1.
        """
        stored = self._storage.read(*place)
        if self._must_show:
            self._check_range(stored, place)
        return Block(place.y0, place.x0, self._values(stored))

    def _values(self, stored: Array) -> Array:
        if self._one != 1:
            values: Array = np.divide(stored, np.float32(self._one), dtype=np.float32)
            return values
        # A float64 beyond float32 becomes infinite, which is passed on like any infinity.
        with np.errstate(over="ignore"):
            return stored.astype(np.float32, copy=False)

    def _check_range(self, stored: Array, place: Place) -> None:
        if all_within(stored, 1):
            return
        outside = ((stored < 0) | (stored > 1)) & np.isfinite(stored)
        if outside.any():
            y, x, channel = np.argwhere(outside)[0]
            raise InputError(
                f"{self._path}: row {place.y0 + y}, column {place.x0 + x}, channel {channel} is "
                f"{float(stored[y, x, channel]):.9g}, but device values are in 0..1, and the file does not "
                "say what its samples mean; if they are physical values as they are, declare it: "
                "--samples real (samples='real' in Python)"
            )
