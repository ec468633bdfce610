"""OpenEXR in and out as streams of scan lines: images whose channels have names (`kd.X`, `m`, `n.x`, ...).

Needs the official package OpenEXR (`pip install iccbrdf[exr]`).  EXR keeps channels in the order of their
names; the record in the attribute `comments` (`iccbrdf.images.record`) keeps ours, and says what they mean.
"""

from __future__ import annotations

import errno
import importlib
import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Literal

import numpy as np

from iccbrdf.errors import InputError, LimitError, UnsupportedError, UsageError, nearest
from iccbrdf.files import StrPath, atomic_output
from iccbrdf.images.blocks import Assembler, Block, Coverage, Grid, Place
from iccbrdf.images.exr_header import check_header
from iccbrdf.images.record import SAMPLES, Record, Samples, from_description

MAX_CHANNELS = 256
MAX_BAND_BYTES = 1 << 28
"""Of the scan lines that are decoded together, all channels in float32."""

ExrType = Literal["float32", "float16"]
EXR_TYPES: tuple[ExrType, ...] = ("float32", "float16")

_BAND_ROWS = 32
_BLOCK_PIXELS = 1 << 18
# The largest number of scan lines that one compressed chunk holds (DWAB).
_CHUNK_ROWS = 256
_LARGEST_HALF = float(np.finfo(np.float16).max)


def open_exr(path: StrPath, samples: Samples | None = None) -> ExrSource:
    """Open an OpenEXR file of one flat image for reading; use it in a `with` statement.

    Parameters
    ----------
    path
        Scan lines or tiles, any compression, half, float or 32-bit integer channels, all of full size.
    samples
        "real" or "device", as in `open_tiff`, for a file without a record of ours; "real" by default.

    Raises
    ------
    InputError
        The file is missing, is no OpenEXR file, is damaged or truncated, or contradicts `samples`.
    UnsupportedError
        Subsampled channels, deep pixels or several parts.
    LimitError
        More than 256 channels, or lines so long that the rows decoded together pass 256 MB.
    UsageError
        The package OpenEXR is not installed.

    Examples
    --------
    >>> with open_exr("brdf.exr") as source:                  # doctest: +SKIP
    ...     for place in source.places():
    ...         process(source.read(place).data)
    """
    return ExrSource(path, samples)


class ExrSource:
    """An open OpenEXR file, an `ImageSource`.  See `open_exr`.

    Attributes
    ----------
    height, width, channels
        The size of the image, which is the file's data window.
    names
        The channels' names, in the order of the record, without one in that of the file.
    samples
        "real" or "device".
    """

    def __init__(self, path: StrPath, samples: Samples | None = None) -> None:
        if samples is not None and samples not in SAMPLES:
            raise UsageError(f"{path}: unknown samples {samples!r}: {nearest(samples, SAMPLES)}")
        self._path = path
        self._exr, self._imath = _package()
        check_header(path)
        try:
            self._file = self._exr.InputFile(str(path))
            header = self._file.header()
            complete = self._file.isComplete()
        # The package has no exception of its own.
        except Exception as error:
            raise InputError(f"{path}: cannot be read as OpenEXR: {error}") from error
        self._lock = threading.Lock()
        window = header["dataWindow"]
        self._top = window.min.y
        self.height: int = window.max.y - window.min.y + 1
        self.width: int = window.max.x - window.min.x + 1
        stored = header["channels"]
        self.channels = len(stored)
        self._check(header, complete)
        record = from_description(_text(header.get("comments", b"")), path)
        if record is not None and sorted(record.channels) != sorted(stored):
            raise InputError(
                f"{path}: the attribute comments names the channels {', '.join(record.channels)}, "
                f"the file has {', '.join(stored)}"
            )
        if record is not None and samples not in (None, record.samples):
            raise InputError(f"{path}: declared as {samples!r}, but the file says {record.samples!r}")
        self.names: Sequence[str] | None = record.channels if record else tuple(stored)
        self.samples: Samples = record.samples if record else samples or "real"

    def __enter__(self) -> ExrSource:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def _check(self, header: dict[str, Any], complete: bool) -> None:
        path = self._path
        kind = _text(header.get("type", b"scanlineimage"))
        if kind not in ("scanlineimage", "tiledimage"):
            raise UnsupportedError(f"{path}: an OpenEXR file of type {kind}, expected a flat image")
        if not 1 <= self.channels <= MAX_CHANNELS:
            raise LimitError(f"{path}: {self.channels} channels, expected 1 to {MAX_CHANNELS}")
        for name, channel in header["channels"].items():
            if (channel.xSampling, channel.ySampling) != (1, 1):
                raise UnsupportedError(f"{path}: channel {name!r} is subsampled, expected one of full size")
        if not complete:
            raise InputError(f"{path}: truncated: not all of its scan lines or tiles are there")
        band_bytes = self.width * self.channels * 4 * _CHUNK_ROWS
        if band_bytes > MAX_BAND_BYTES:
            raise LimitError(
                f"{path}: lines of {self.width} pixels with {self.channels} channels: {_CHUNK_ROWS} of them "
                f"take {band_bytes} bytes, the limit is {MAX_BAND_BYTES}"
            )

    def places(self, max_pixels: int = _BLOCK_PIXELS) -> Iterator[Place]:
        """Where the blocks of the image lie, in row order: bands as wide as the image."""
        rows = max(1, max_pixels // self.width // _BAND_ROWS) * _BAND_ROWS
        for y0 in range(0, self.height, rows):
            yield Place(y0, 0, min(rows, self.height - y0), self.width)

    def read(self, place: Place) -> Block:
        """The block at a place, float32, values as they are stored; several threads may read at a time.

        Raises InputError where the lines cannot be decoded.
        """
        first = self._top + place.y0
        as_float = self._imath.PixelType(self._imath.PixelType.FLOAT)
        try:
            with self._lock:
                lines = self._file.channels(list(self.names or ()), as_float, first, first + place.height - 1)
        # As above.
        except Exception as error:
            raise InputError(f"{self._path}: row {place.y0}: cannot be decoded: {error}") from error
        columns = slice(place.x0, place.x0 + place.width)
        planes = [np.frombuffer(line, np.float32).reshape(place.height, self.width) for line in lines]
        return Block(place.y0, place.x0, np.stack([plane[:, columns] for plane in planes], axis=2))


class ExrSink:
    """An OpenEXR file that is being written.  See `create_exr`.

    Attributes
    ----------
    clipped
        How many finite samples so far were beyond float16, and became infinite.
    """

    def __init__(
        self, file: Any, path: StrPath, height: int, width: int, names: Sequence[str], dtype: np.dtype[Any]
    ) -> None:
        self._file = file
        self._path = path
        self._names = names
        self._dtype = dtype
        self._coverage = Coverage(path, height, width, len(names))
        self._assembler = Assembler(Grid(height, width, _BAND_ROWS, width), len(names), dtype)
        self._next_band = 0
        self.clipped = 0

    def write(self, block: Block) -> None:
        """Write a block of floats, shape (height, width, channels); UsageError where it does not fit."""
        self.put(self.encode(block))

    def encode(self, block: Block) -> tuple[Block, int]:
        """The part of `write` that any thread may do, for several blocks at a time; the rest is `put`."""
        self._coverage.check(block)
        beyond = 0
        if self._dtype == np.float16:
            beyond = int(np.count_nonzero((np.abs(block.data) > _LARGEST_HALF) & np.isfinite(block.data)))
        with np.errstate(over="ignore"):
            return block._replace(data=np.asarray(block.data, self._dtype)), beyond

    def put(self, encoded: tuple[Block, int]) -> None:
        """Write what `encode` gave; UsageError where it does not follow."""
        block, beyond = encoded
        self._coverage.count(block)
        self.clipped += beyond
        for band, rows in self._assembler.add(block):
            if band != self._next_band:
                raise UsageError(f"{self._path}: a block at row {block.y0} came before those above it")
            self._next_band += 1
            planes = {name: rows[:, :, i].tobytes() for i, name in enumerate(self._names)}
            with _numbered(self._path):
                self._file.writePixels(planes, len(rows))

    def finish(self) -> None:
        """UsageError where pixels are missing."""
        self._coverage.check_filled()


@contextmanager
def create_exr(
    path: StrPath,
    height: int,
    width: int,
    names: Sequence[str],
    *,
    samples: Samples,
    dtype: ExrType = "float32",
    overwrite: bool = False,
) -> Iterator[ExrSink]:
    """Write an OpenEXR file: a context manager that gives a sink, to be given blocks in row order.

    Scan lines, ZIP compression.  The file appears under its name when the block ends without an exception
    and all pixels are there.

    Parameters
    ----------
    names
        One name a channel, none twice, none empty.
    samples
        "real" (physical values) or "device" (0..1); it is recorded in the file.
    dtype
        "float32", or "float16", which keeps three digits and numbers up to 65504.

    Raises
    ------
    UsageError
        The target exists already, or the parameters contradict each other, both before anything is written;
        the block ended before all pixels were there; or the package OpenEXR is not installed.
    LimitError
        The disk is full.
    """
    for what, value, valid in (("samples", samples, SAMPLES), ("sample type", dtype, EXR_TYPES)):
        if value not in valid:
            raise UsageError(f"{path}: unknown {what} {value!r}: {nearest(str(value), valid)}")
    if height < 1 or width < 1 or not names:
        raise UsageError(f"{path}: an image of {height} x {width} pixels with {len(names)} channels is empty")
    if len(set(names)) < len(names) or not all(names):
        raise UsageError(f"{path}: channels {', '.join(names)}, expected different names")
    exr, imath = _package()
    kind = imath.PixelType.FLOAT if dtype == "float32" else imath.PixelType.HALF
    header = {
        **exr.Header(width, height),
        "channels": {name: imath.Channel(imath.PixelType(kind)) for name in names},
        "compression": imath.Compression(imath.Compression.ZIP_COMPRESSION),
        "comments": Record(samples, tuple(names)).to_description().encode(),
    }
    with atomic_output(path, overwrite=overwrite) as temporary:
        with _numbered(path):
            file = exr.OutputFile(str(temporary), header)
        try:
            sink = ExrSink(file, path, height, width, names, np.dtype(dtype))
            yield sink
            sink.finish()
        finally:
            file.close()


@contextmanager
def _numbered(path: StrPath) -> Iterator[None]:
    """Give the errors of the package, which are text alone, the number that their text stands for."""
    try:
        yield
    except OSError as error:
        text = str(error)
        number = next((n for n in errno.errorcode if os.strerror(n) in text), errno.EIO)
        raise OSError(number, os.strerror(number), os.fspath(path)) from error


def _package() -> tuple[Any, Any]:
    try:
        return importlib.import_module("OpenEXR"), importlib.import_module("Imath")
    except ImportError:
        raise UsageError("OpenEXR files need the package OpenEXR: pip install iccbrdf[exr]") from None


def _text(value: object) -> str:
    """The text of an attribute, which in a damaged file is of any type."""
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else ""
