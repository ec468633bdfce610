"""Multichannel TIFF written block by block, in memory that does not grow with the image.

The tags are written by tifffile.  It wants to pull the pixels, while here they are pushed; so an
uncompressed file is laid out first and its pixels are put in their places, and compressed segments wait
in an unnamed file until all are there.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import imagecodecs
import numpy as np
import tifffile

from iccbrdf.errors import UsageError, nearest
from iccbrdf.files import StrPath, atomic_output
from iccbrdf.images.blocks import Array, Assembler, Block, Coverage, Grid
from iccbrdf.images.in_order import in_order
from iccbrdf.images.record import SAMPLES, U1_15, U1_15_ONE, Record, Samples

SampleType = Literal["float32", "uint16", "uint8"]
Compression = Literal["deflate", "zstd"]
Put = Callable[[Block], None]

_DTYPES: dict[str, np.dtype[Any]] = {
    "float32": np.dtype("<f4"),
    "uint16": np.dtype("<u2"),
    "uint8": np.dtype("u1"),
}

_COMPRESSORS = {"deflate": "zlib_encode", "zstd": "zstd_encode"}
"""Functions of imagecodecs, which loads the code of each when it is first asked for."""

_STRIP_BYTES = 1 << 18
CLASSIC_BYTES = (1 << 32) - (1 << 25)
"""Of pixels in a TIFF that is no BigTIFF: it counts in 32 bits, and the rest is room for tags and tables."""


class Encoded(NamedTuple):
    """A block in the samples of the file, and how many of them did not fit."""

    block: Block
    clipped: int


class TiffSink:
    """A TIFF that is being written.  See `create_tiff`.

    Attributes
    ----------
    clipped
        How many samples so far did not fit the integers of the file, NaN (stored as 0) included.
    """

    def __init__(self, put: Put, coverage: Coverage, dtype: np.dtype[Any], one: int) -> None:
        self._put = put
        self._coverage = coverage
        self._dtype = dtype
        self._one = one
        self.clipped = 0

    def write(self, block: Block) -> None:
        """Write a block of floats, shape (height, width, channels); UsageError where it does not fit."""
        self.put(self.encode(block))

    def encode(self, block: Block) -> Encoded:
        """The part of `write` that any thread may do, for several blocks at a time; the rest is `put`."""
        self._coverage.check(block)
        if self._dtype.kind == "f":
            return Encoded(block._replace(data=np.asarray(block.data, self._dtype)), 0)
        with np.errstate(over="ignore"):
            scaled = np.rint(block.data * np.float32(self._one))
        largest = np.iinfo(self._dtype).max
        # NaN compares false, and so counts as not fitting.
        clipped = scaled.size - int(np.count_nonzero((scaled >= 0) & (scaled <= largest)))
        stored: Array = np.nan_to_num(scaled.clip(0, largest), copy=False).astype(self._dtype)
        return Encoded(block._replace(data=stored), clipped)

    def put(self, encoded: Encoded) -> None:
        """Write what `encode` gave, in row order."""
        self._coverage.count(encoded.block)
        self._put(encoded.block)
        self.clipped += encoded.clipped

    def put_elsewhere(self, pixels: int, clipped: int) -> None:
        """Count what copies of this sink have put in other processes; only of an uncompressed file."""
        self._coverage.count_pixels(pixels)
        self.clipped += clipped

    def finish(self) -> None:
        """UsageError where pixels are missing."""
        self._coverage.check_filled()


@contextmanager
def create_tiff(
    path: StrPath,
    height: int,
    width: int,
    names: Sequence[str],
    *,
    samples: Samples,
    dtype: SampleType = "float32",
    tile: tuple[int, int] | None = None,
    rows_per_strip: int | None = None,
    compression: Compression | None = None,
    profile: bytes | None = None,
    overwrite: bool = False,
    workers: int = 1,
) -> Iterator[TiffSink]:
    """Write a TIFF: a context manager that gives a sink, to be given blocks in row order.

    The file is one interleaved image, BigTIFF where it needs to be.  Other programs open it as grey with
    unspecified extra samples; names and meaning of the channels are in the ImageDescription
    (`iccbrdf.images.record`).  The same input gives the same bytes.  The file appears under its name when
    the block ends without an exception and all pixels are there.

    Parameters
    ----------
    names
        One name a channel, none twice.
    samples
        "device": values 0..1, which integers hold scaled to their range.  "real": physical values; as
        "uint16" only XYZ can be stored, as the ICC's u1.15 (value times 32768, up to 1.99997).
    tile
        Height and width of the tiles, multiples of 16; None for strips.
    rows_per_strip
        None for strips of about 256 KB.
    profile
        An ICC profile to embed (tag 34675).
    workers
        Threads that compress.

    Raises
    ------
    UsageError
        The target exists already, or the parameters contradict each other, both before anything is written;
        or the block ended before all pixels were there.
    LimitError
        The disk is full.

    Examples
    --------
    >>> with create_tiff("xyz.tif", 200, 300, "XYZ", samples="real") as sink:      # doctest: +SKIP
    ...     for block in blocks:
    ...         sink.write(block)
    """
    _check_parameters(path, height, width, names, samples, dtype, tile, rows_per_strip, compression)
    channels = len(names)
    stored = _DTYPES[dtype]
    xyz = samples == "real" and dtype == "uint16"
    record = Record(samples, tuple(names), U1_15 if xyz else None)
    if tile is None:
        row_bytes = width * channels * stored.itemsize
        grid = Grid(height, width, min(height, rows_per_strip or max(1, _STRIP_BYTES // row_bytes)), width)
    else:
        grid = Grid(height, width, *tile)
    tags = {
        "shape": (height, width, channels) if channels > 1 else (height, width),
        "dtype": stored,
        "photometric": "minisblack",
        "planarconfig": "contig" if channels > 1 else None,
        "extrasamples": ("unspecified",) * (channels - 1),
        "tile": tile,
        "rowsperstrip": None if tile else grid.segment_height,
        "description": record.to_description(),
        "metadata": None,
        "software": "iccbrdf",
        "iccprofile": profile,
    }
    with atomic_output(path, overwrite=overwrite) as temporary:
        if compression is None:
            layout = _in_place(temporary, grid, channels, stored, tags)
        else:
            layout = _compressed(temporary, grid, channels, stored, tags, compression, workers)
        coverage = Coverage(path, height, width, channels)
        one = U1_15_ONE if xyz else 1 if dtype == "float32" else np.iinfo(stored).max
        with layout as put:
            sink = TiffSink(put, coverage, stored, one)
            yield sink
            sink.finish()


def _check_parameters(
    path: StrPath,
    height: int,
    width: int,
    names: Sequence[str],
    samples: str,
    dtype: str,
    tile: tuple[int, int] | None,
    rows_per_strip: int | None,
    compression: str | None,
) -> None:
    for what, value, valid in (
        ("samples", samples, SAMPLES),
        ("sample type", dtype, _DTYPES),
        ("compression", compression, (None, *_COMPRESSORS)),
    ):
        if value not in valid:
            raise UsageError(f"{path}: unknown {what} {value!r}: {nearest(str(value), filter(None, valid))}")
    if height < 1 or width < 1 or not names:
        raise UsageError(f"{path}: an image of {height} x {width} pixels with {len(names)} channels is empty")
    twice = [name for name in names if list(names).count(name) > 1]
    if twice:
        raise UsageError(f"{path}: two channels are called {twice[0]!r}")
    if samples == "real" and dtype == "uint8":
        raise UsageError(f"{path}: real values do not fit 8 bits; write float32")
    if samples == "real" and dtype == "uint16" and tuple(names) != ("X", "Y", "Z"):
        raise UsageError(
            f"{path}: real values in 16 bits (u1.15) can only be X, Y, Z, not {', '.join(names)}; "
            "write float32"
        )
    if tile is not None and any(side < 16 or side % 16 for side in tile):
        raise UsageError(f"{path}: tiles of {tile[0]} x {tile[1]} pixels, expected multiples of 16")
    if tile is not None and rows_per_strip is not None:
        raise UsageError(f"{path}: tiles and rows per strip, expected one of them")
    if rows_per_strip is not None and rows_per_strip < 1:
        raise UsageError(f"{path}: {rows_per_strip} rows per strip, expected at least 1")


@dataclass(frozen=True)
class _Places:
    """Where the pixels of a file that has been laid out belong."""

    path: Path
    grid: Grid
    offsets: tuple[int, ...]
    pixel_bytes: int

    def put(self, block: Block) -> None:
        """Write a block to its place.  The file is opened for it, as several processes may do it."""
        height, width, _ = block.data.shape
        with self.path.open("r+b") as file:
            for part in self.grid.parts(block.y0, block.x0, height, width):
                for start, rows in self.grid.runs(part):
                    file.seek(self.offsets[part.segment] + start * self.pixel_bytes)
                    file.write(np.ascontiguousarray(block.data[rows, part.in_region[1]]).data)


@contextmanager
def _in_place(
    temporary: Path, grid: Grid, channels: int, dtype: np.dtype[Any], tags: dict[str, Any]
) -> Iterator[Put]:
    pixel_bytes = channels * dtype.itemsize
    size = grid.segments * grid.segment_height * grid.segment_width * pixel_bytes
    with tifffile.TiffWriter(temporary, bigtiff=size > CLASSIC_BYTES, byteorder="<") as writer:
        writer.write(None, **tags)
    with tifffile.TiffFile(temporary) as laid_out:
        offsets = tuple(laid_out.pages[0].dataoffsets)
    if not tags["tile"]:
        # The strips of a new file follow each other: taken for one, rows are written at one go.
        grid, offsets = Grid(grid.height, grid.width, grid.height, grid.width), offsets[:1]
    yield _Places(temporary, grid, offsets, pixel_bytes).put


@contextmanager
def _compressed(
    temporary: Path,
    grid: Grid,
    channels: int,
    dtype: np.dtype[Any],
    tags: dict[str, Any],
    compression: str,
    workers: int,
) -> Iterator[Put]:
    assembler = Assembler(grid, channels, dtype)
    compress = getattr(imagecodecs, _COMPRESSORS[compression])
    places: dict[int, tuple[int, int]] = {}

    def encode(segment: int, pixels: Array) -> tuple[int, bytes | bytearray]:
        if tags["tile"]:
            below, beside = (side - n for side, n in zip(tags["tile"], pixels.shape[:2], strict=True))
            pixels = np.pad(pixels, ((0, below), (0, beside), (0, 0)))
        return segment, compress(pixels.tobytes())

    with tempfile.TemporaryFile(dir=temporary.parent) as spool:

        def keep(encoded: tuple[int, bytes | bytearray]) -> None:
            segment, data = encoded
            places[segment] = spool.tell(), len(data)
            spool.write(data)

        with in_order(workers, keep) as submit:

            def put(block: Block) -> None:
                for segment, pixels in assembler.add(block):
                    submit(encode, segment, pixels)

            yield put

        def segments() -> Iterator[bytes]:
            for segment in range(grid.segments):
                offset, length = places[segment]
                spool.seek(offset)
                yield spool.read(length)

        big = spool.tell() > CLASSIC_BYTES
        with tifffile.TiffWriter(temporary, bigtiff=big, byteorder="<") as writer:
            writer.write(segments(), compression=compression, **tags)
