"""The pixels of a TIFF as they are stored, any rectangle of them.

The parsing of the file and the decoding of compressed segments are tifffile's (with imagecodecs).
Uncompressed pixels are read from their place, so that even a file in one piece needs no memory for more
than the rectangle; a compressed segment can only be decoded as a whole, and one that is too large is refused.
Several threads may read at a time.
"""

from __future__ import annotations

import os
import threading
from itertools import islice
from operator import index
from typing import Any

import numpy as np
import tifffile

from iccbrdf.errors import IccBrdfError, InputError, LimitError, UnsupportedError
from iccbrdf.files import StrPath
from iccbrdf.images.blocks import Array, Grid

MAX_SEGMENT_BYTES = 1 << 28
MAX_SAMPLES = 1 << 40
MAX_CHANNELS = 256
MAX_PAGES = 64
"""Thumbnails and other reductions included.  Those of a damaged file may point to each other for ever."""

_FLOAT_PREDICTOR = 3
_DTYPES = ("u1", "u2", "f2", "f4", "f8")
_PHOTOMETRICS = ("MINISBLACK", "RGB", "SEPARATED")
LAB_PHOTOMETRICS = ("CIELAB", "ICCLAB")
_COMPRESSIONS = ("NONE", "LZW", "ADOBE_DEFLATE", "DEFLATE", "PACKBITS", "LZMA", "ZSTD")


class TiffStorage:
    """The one image of a TIFF.  Errors as `iccbrdf.images.open_tiff` lists them.

    Attributes
    ----------
    height, width, channels
        The size of the image.
    dtype
        The type of the samples, with the byte order of the file.
    description, profile
        The ImageDescription ("" without one) and the embedded ICC profile (None without one).
    photometric
        What the samples are, by the name of the tag's value: "RGB", "SEPARATED", ...
    extra_samples
        How many channels are more than the photometric interpretation has.
    ink_set
        Of separated samples: 1 for CMYK, else other inks.
    unit
        Height and width of what can only be read together: a compressed segment, or one pixel.
    """

    def __init__(self, path: StrPath, *, lab: bool = False) -> None:
        self._path = path
        self._photometrics = _PHOTOMETRICS + LAB_PHOTOMETRICS * lab
        try:
            self._file: Any = tifffile.TiffFile(path)
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
        # Whatever its parsing of a damaged file runs into leaves tifffile as it is.
        except Exception as error:
            raise InputError(f"{path}: not a readable TIFF: {error}") from error
        self._seeking = threading.Lock()
        try:
            self._parse()
        except IccBrdfError:
            self.close()
            raise
        except Exception as error:
            self.close()
            raise InputError(f"{path}: damaged TIFF: {error}") from error

    def close(self) -> None:
        self._file.close()

    def _parse(self) -> None:
        path = self._path
        page = self._page = _only_image(self._file, path, self._photometrics)
        # A damaged file may have fractions here and below, which index refuses.
        self._planes, _, self.height, self.width, contiguous = map(index, page.shaped)
        self.channels: int = self._planes * contiguous
        if self.channels > MAX_CHANNELS:
            raise LimitError(f"{path}: {self.channels} channels, the limit is {MAX_CHANNELS}")
        if self.height * self.width * self.channels > MAX_SAMPLES:
            raise LimitError(
                f"{path}: {self.height} x {self.width} pixels with {self.channels} channels, "
                f"the limit is {MAX_SAMPLES} samples"
            )
        self.dtype = _sample_type(page, self._file.byteorder, path)
        if page.predictor == _FLOAT_PREDICTOR and self.dtype.kind != "f":
            raise InputError(f"{path}: damaged TIFF: predictor {_FLOAT_PREDICTOR}, of floats, on integers")
        self.description: str = page.description
        self.profile: bytes | None = page.iccprofile
        if not isinstance(self.profile, bytes | None):
            raise InputError(
                f"{path}: damaged TIFF: the embedded profile is stored as numbers, expected bytes"
            )
        self.photometric: str = page.photometric.name
        self.extra_samples = len(page.extrasamples)
        self.ink_set: int = page.tags.valueof(332, 1)
        self._pixel_bytes = contiguous * self.dtype.itemsize
        if page.is_tiled:
            self._grid = Grid(self.height, self.width, index(page.tilelength), index(page.tilewidth))
        else:
            strip = min(index(page.rowsperstrip), self.height)
            self._grid = Grid(self.height, self.width, strip, self.width)
        self._in_place = page.compression == 1 and page.predictor == 1 and page.fillorder == 1
        self.unit = (1, 1) if self._in_place else (self._grid.segment_height, self._grid.segment_width)
        self._offsets = [index(offset) for offset in page.dataoffsets]
        self._counts = [index(count) for count in page.databytecounts]
        self._check_segments()
        if self._in_place:
            self._join_strips()

    def _check_segments(self) -> None:
        path, grid = self._path, self._grid
        expected = self._planes * grid.segments
        if len(self._offsets) < expected or len(self._counts) < expected:
            raise InputError(
                f"{path}: damaged TIFF: {len(self._offsets)} offsets and {len(self._counts)} byte counts, "
                f"expected {expected} of each"
            )
        size = os.path.getsize(path)
        segment_bytes = grid.segment_height * grid.segment_width * self._pixel_bytes
        for i in range(expected):
            offset, count = self._offsets[i], self._counts[i]
            if offset + count > size:
                raise InputError(
                    f"{path}: truncated: segment {i} of {expected} ends at byte {offset + count}, "
                    f"the file at byte {size}"
                )
            if not self._in_place:
                self._check_size(count, "encoded")
            elif count:
                _, _, rows, _ = grid.extent(i % grid.segments)
                needed = segment_bytes if self._page.is_tiled else rows * self.width * self._pixel_bytes
                if count < needed:
                    raise InputError(
                        f"{path}: damaged TIFF: segment {i} has {count} bytes, expected {needed}"
                    )
        if not self._in_place:
            self._check_size(segment_bytes * self._planes, "decoded, all channels together,")

    def _check_size(self, size: int, what: str) -> None:
        if size > MAX_SEGMENT_BYTES:
            raise LimitError(
                f"{self._path}: a compressed segment of {self.unit[0]} x {self.unit[1]} pixels takes {size} "
                f"bytes {what} and can only be decoded as a whole; the limit is {MAX_SEGMENT_BYTES}: "
                "save the file uncompressed, or with smaller strips or tiles"
            )

    def _join_strips(self) -> None:
        """Take strips that follow each other without a gap for one, so that rows are read at one go."""
        grid = self._grid
        strip_bytes = grid.segment_height * self.width * self._pixel_bytes
        first = self._offsets[:: grid.segments]
        joined = [start + i * strip_bytes for start in first for i in range(grid.segments)]
        if self._page.is_tiled or 0 in self._counts or self._offsets != joined:
            return
        self._grid = Grid(self.height, self.width, self.height, self.width)
        self._offsets = first

    def read(self, y0: int, x0: int, height: int, width: int) -> Array:
        """A rectangle of pixels, shape (height, width, channels), in the file's sample type.

        Pixels of a planar file stay plane by plane in memory.
        """
        pixels = np.empty((self._planes, height, width, self.channels // self._planes), self.dtype)
        for plane, target in enumerate(pixels):
            for part in self._grid.parts(y0, x0, height, width):
                segment = plane * self._grid.segments + part.segment
                if self._counts[segment] == 0:
                    # Segments that a sparse file leaves out are zero, as other readers have it.
                    target[part.in_region] = 0
                elif self._in_place:
                    for start, rows in self._grid.runs(part):
                        offset = self._offsets[segment] + start * self._pixel_bytes
                        self._read_into(target[rows, part.in_region[1]], offset)
                else:
                    target[part.in_region] = self._decoded(segment)[part.in_segment]
        return pixels[0] if self._planes == 1 else np.moveaxis(pixels[..., 0], 0, 2)

    def _read_into(self, target: Array, offset: int) -> None:
        if not target.flags.c_contiguous:
            pixels = np.empty(target.shape, target.dtype)
            self._read_into(pixels, offset)
            target[...] = pixels
            return
        left = target.reshape(-1).view(np.uint8).data
        while left:
            # A system may give less than it was asked for: Linux at most 2 GiB.
            count = self._read_at(offset, left)
            if not count:
                raise InputError(f"{self._path}: truncated: no {len(left)} bytes at byte {offset}")
            left, offset = left[count:], offset + count

    def _read_at(self, offset: int, buffer: memoryview) -> int:
        if hasattr(os, "preadv"):
            return os.preadv(self._file.filehandle.fileno(), [buffer], offset)
        with self._seeking:
            self._file.filehandle.seek(offset)
            count: int = self._file.filehandle.readinto(buffer)
            return count

    def _decoded(self, segment: int) -> Array:
        data = np.empty(self._counts[segment], np.uint8)
        self._read_into(data, self._offsets[segment])
        try:
            pixels: Array = self._page.decode(data.tobytes(), segment, jpegtables=self._page.jpegtables)[0][0]
        # Every codec has an exception of its own.
        except Exception as error:
            raise InputError(f"{self._path}: segment {segment} cannot be decoded: {error}") from error
        return pixels


def _only_image(file: Any, path: StrPath, photometrics: tuple[str, ...]) -> Any:
    """The one page of a file that is neither a thumbnail nor another reduction."""
    found = list(islice(file.pages, MAX_PAGES + 1))
    if len(found) > MAX_PAGES:
        raise LimitError(f"{path}: more than {MAX_PAGES} images in one file")
    pages = [page for page in found if not page.is_reduced]
    if not pages:
        raise InputError(f"{path}: damaged TIFF: there is no image in it")
    if len(pages) != 1:
        raise UnsupportedError(
            f"{path}: holds {len(pages)} images, expected one, with the channels interleaved or planar in it"
        )
    page = pages[0]
    if 0 in page.shaped:
        raise InputError(f"{path}: the image is empty")
    if page.shaped[1] != 1:
        raise UnsupportedError(f"{path}: an image of {page.shaped[1]} slices, expected a flat one")
    for what, value, supported in (
        ("photometric interpretation", page.photometric, photometrics),
        # Not the lossy ones: what they lose is measured for the eye, not for normals and roughness.
        ("compression", page.compression, _COMPRESSIONS),
    ):
        name = getattr(value, "name", str(value))
        if name not in supported:
            raise UnsupportedError(f"{path}: {what} {name}, supported are {', '.join(supported)}")
    orientation = page.tags.valueof(274, 1)
    if orientation != 1:
        raise UnsupportedError(f"{path}: orientation {orientation}, supported is 1 (first row at the top)")
    return page


def _sample_type(page: Any, byteorder: str, path: StrPath) -> np.dtype[Any]:
    if page.dtype is not None:
        dtype: np.dtype[Any] = np.dtype(page.dtype).newbyteorder(byteorder)
        if dtype.str[1:] in _DTYPES and page.bitspersample == 8 * dtype.itemsize:
            return dtype
    raise UnsupportedError(
        f"{path}: samples of {page.bitspersample} bits, format {getattr(page.sampleformat, 'name', '?')}; "
        "supported are unsigned integers of 8 and 16 bits and floats of 16, 32 and 64 bits"
    )
