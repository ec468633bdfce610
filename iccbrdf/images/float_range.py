"""A quick look at many floats."""

from __future__ import annotations

import numpy as np

from iccbrdf.images.blocks import Array


def all_within(data: Array, limit: float) -> bool:
    """Whether all of `data`, floats of any size and byte order, are surely in 0..limit.

    One pass without a temporary array, where comparisons would take several: as unsigned integers, the bits
    of floats in 0..limit are those up to the bits of `limit`; those of infinity, NaN and whatever has a sign,
    -0 included, are larger.
    """
    bits = data.dtype.str.replace("f", "u")
    return bool(data.view(bits).max() <= np.full(1, limit, data.dtype).view(bits)[0])
