"""Whole pictures in memory: the maps (normals, heights, gloss) that come with a job as PNG or TIFF."""

from __future__ import annotations

from pathlib import Path

import imagecodecs
import numpy as np

from iccbrdf.errors import InputError, LimitError
from iccbrdf.files import StrPath, read_whole
from iccbrdf.images.blocks import Array
from iccbrdf.images.record import Samples
from iccbrdf.images.tiff_reader import open_tiff

MAX_SAMPLES = 1 << 30

_MOST_PNG_CHANNELS = 4
_MOST_PNG_BYTES = 3 * MAX_SAMPLES
"""Of a file: two for each sample, where nothing is gained by compression, and other chunks."""
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_IHDR_END = 24
"""The first bytes of a PNG: signature 8, length and name of IHDR 8, width 4, height 4."""


def read_picture(path: StrPath, samples: Samples | None = None, size: tuple[int, int] | None = None) -> Array:
    """Read a PNG or TIFF as numbers; a colour profile or gamma in the file is not applied.

    Parameters
    ----------
    path
        The kind of file is told by its first bytes.
    samples
        What the samples of a float TIFF mean, as in `open_tiff`.
    size
        The height and width that it must have.

    Returns
    -------
    Array
        float32, shape (height, width, channels); integers scaled to 0..1.

    Raises
    ------
    InputError
        The file is missing or damaged, or neither PNG nor TIFF, or of another size.
    UnsupportedError
        A TIFF of a kind that `open_tiff` does not read.
    LimitError
        More than 2^30 samples (4 GiB in memory), or a PNG of more than 3 GiB.
    """
    try:
        with Path(path).open("rb") as file:
            start = file.read(_IHDR_END)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    if start.startswith(_PNG_SIGNATURE):
        return _read_png(path, start, size)
    if not start.startswith((b"II", b"MM")):
        raise InputError(f"{path}: neither a PNG nor a TIFF")
    with open_tiff(path, samples) as source:
        _check_size(path, source.height, source.width, source.channels, size)
        picture = np.empty((source.height, source.width, source.channels), np.float32)
        for y0, x0, data in source.blocks():
            picture[y0 : y0 + data.shape[0], x0 : x0 + data.shape[1]] = data
        return picture


def _read_png(path: StrPath, start: bytes, size: tuple[int, int] | None) -> Array:
    width, height = (int.from_bytes(start[i : i + 4], "big") for i in (16, 20))
    _check_size(path, height, width, _MOST_PNG_CHANNELS, size)
    try:
        pixels = imagecodecs.png_decode(read_whole(path, _MOST_PNG_BYTES))
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{path}: damaged PNG: {error}") from error
    picture: Array = np.divide(pixels, np.float32(np.iinfo(pixels.dtype).max), dtype=np.float32)
    return picture.reshape(height, width, -1)


def _check_size(path: StrPath, height: int, width: int, channels: int, size: tuple[int, int] | None) -> None:
    if size is not None and size != (height, width):
        raise InputError(
            f"{path}: the relief has {width} x {height} pixels, expected the image's {size[1]} x {size[0]}"
        )
    if height * width * channels > MAX_SAMPLES:
        raise LimitError(
            f"{path}: {height} x {width} pixels with {channels} channels, the limit for a map is "
            f"{MAX_SAMPLES} samples"
        )
