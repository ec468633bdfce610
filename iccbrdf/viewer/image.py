"""A print's channels for the page: box-filtered to a size, in 16 bits a channel, packed for a browser.

A sample is an integer code: (code - zero) * scale, so that 0 is exact, and `NOT_FINITE` for what is no finite
number.  Packed are the differences of neighbours in a row, the low bytes of all pixels before the high ones,
by gzip, in base64: what browsers unpack by themselves.
"""

from __future__ import annotations

import base64
import gzip
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.images import ImageSource

Array = npt.NDArray[Any]

NOT_FINITE = 65535
"""The code of what is no finite number."""
_LAST = NOT_FINITE - 1
_LEVEL = 6
"""Of gzip; the higher ones take long and gain a percent."""


def reduced(
    source: ImageSource, convert: Callable[[Array], Array], channels: int, max_pixels: int
) -> tuple[Array, int]:
    """The image of `source`, at most `max_pixels` large, and what its height and width were divided by.

    Parameters
    ----------
    convert
        From blocks (height, width, channels of the source) to (height, width, channels).
    max_pixels
        An image of more pixels is made smaller by a whole number in both directions, each pixel the mean of
        those that it covers; samples that are not finite do not count unless all of them are not.

    Returns
    -------
    tuple
        float32 (height, width, channels), and the divisor, 1 for an image in its own size.
    """
    divisor = max(1, math.ceil(math.sqrt(source.height * source.width / max_pixels)))
    while _cells(source.height, divisor) * _cells(source.width, divisor) > max_pixels:
        divisor += 1
    size = _cells(source.height, divisor), _cells(source.width, divisor), channels
    total = np.zeros(size, np.float32)
    if divisor == 1:
        for place in source.places():
            block = source.read(place)
            height, width, _ = block.data.shape
            total[block.y0 : block.y0 + height, block.x0 : block.x0 + width] = convert(block.data)
        return total, 1
    count = np.zeros(size, np.uint32)
    for place in source.places():
        block = source.read(place)
        data = convert(block.data)
        (rows, at_y), (columns, at_x) = (
            _covered(start, length, divisor)
            for start, length in zip((block.y0, block.x0), data.shape[:2], strict=True)
        )
        finite = np.isfinite(data)
        total[rows, columns] += _sums(np.where(finite, data, 0), at_y, at_x, np.float64)
        count[rows, columns] += _sums(finite, at_y, at_x, np.uint32)
    with np.errstate(invalid="ignore", divide="ignore"):
        return total / count, divisor


def _cells(length: int, divisor: int) -> int:
    return -(-length // divisor)


def _covered(start: int, length: int, divisor: int) -> tuple[slice, Array]:
    """The cells that a stretch of pixels falls into, and where in the stretch each begins."""
    cells, begins = np.unique(np.arange(start, start + length) // divisor, return_index=True)
    return slice(cells[0], cells[-1] + 1), begins


def _sums(data: Array, at_y: Array, at_x: Array, dtype: type[np.generic]) -> Array:
    sums: Array = np.add.reduceat(np.add.reduceat(data, at_y, axis=0, dtype=dtype), at_x, axis=1)
    return sums


@dataclass(frozen=True)
class Layer:
    """One channel in 16 bits."""

    name: str
    codes: npt.NDArray[np.uint16]
    zero: int
    """The code of 0."""
    scale: float
    """What a step of the code stands for; exact in float32."""

    @property
    def has_gaps(self) -> bool:
        """Whether there are samples that are not finite."""
        return bool((self.codes == NOT_FINITE).any())

    def decoded(self) -> npt.NDArray[np.float32]:
        """The samples as the page has them."""
        steps = self.codes.astype(np.float32) - np.float32(self.zero)
        samples: npt.NDArray[np.float32] = steps * np.float32(self.scale)
        samples[self.codes == NOT_FINITE] = np.nan
        return samples

    def packed(self) -> str:
        """Base64 text of the codes."""
        left = np.zeros_like(self.codes)
        left[:, 1:] = self.codes[:, :-1]
        planes = (self.codes - left).astype("<u2").view(np.uint8).reshape(-1, 2).T
        data = gzip.compress(np.ascontiguousarray(planes).tobytes(), _LEVEL, mtime=0)
        return base64.b64encode(data).decode("ascii")


def layers(image: Array, names: Sequence[str]) -> list[Layer]:
    """The channels of `image`, (height, width, channels), in 16 bits; their ranges are widened to 0."""
    return [_layer(image[..., k], name) for k, name in enumerate(names)]


def _layer(samples: Array, name: str) -> Layer:
    finite = np.isfinite(samples)
    known = samples[finite]
    low, high = (min(0.0, float(known.min())), max(0.0, float(known.max()))) if known.size else (0.0, 0.0)
    # One code is lost to the rounding of `zero`.
    scale = float(np.float32((high - low) / (_LAST - 1))) or 1.0
    zero = round(-low / scale)
    codes = np.rint(np.where(finite, samples, 0) / np.float64(scale)) + zero
    return Layer(name, np.where(finite, codes.clip(0, _LAST), NOT_FINITE).astype(np.uint16), zero, scale)
