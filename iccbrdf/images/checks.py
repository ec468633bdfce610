"""What is looked at in every block: cheap looks, as the rest costs little, too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np

from iccbrdf.brdf.models import NORMAL
from iccbrdf.errors import InputError
from iccbrdf.images.blocks import Array, Block

NonFinite: TypeAlias = Literal["keep", "zero", "error"]
"""What becomes of a pixel with samples that are not finite: it goes on, all its samples are 0, or no more."""

_BRIGHTEST = 10.0
"""Mean Y of a block of a flat print, at most: white has 1, and where it has 100, most have more."""


def all_within(data: Array, limit: float) -> bool:
    """Whether all of `data`, floats of any size and byte order, are surely in 0..limit.

    One pass without a temporary array, where comparisons would take several: as unsigned integers, the bits
    of floats in 0..limit are those up to the bits of `limit`; those of infinity, NaN and whatever has a sign,
    -0 included, are larger.
    """
    bits = data.dtype.str.replace("f", "u")
    return bool(data.view(bits).max() <= np.full(1, limit, data.dtype).view(bits)[0])


def not_finite(data: Array) -> int:
    """The number of floats in `data` that are infinite or NaN."""
    # Colours and device values are seldom negative, and then one look is enough.
    if all_within(data, float(np.finfo(data.dtype).max)):
        return 0
    return data.size - int(np.count_nonzero(np.isfinite(data)))


def not_finite_pixels(data: Array) -> int:
    """The number of pixels, shape (height, width, channels), with a sample that is infinite or NaN."""
    return int(np.count_nonzero(~np.isfinite(data).all(axis=2))) if not_finite(data) else 0


def admitted(block: Block, treatment: NonFinite, label: str) -> tuple[Block, int]:
    """A block as it is to go on, and the number of its samples that are not finite.

    Raises
    ------
    InputError
        There is such a sample and the treatment is "error"; `label` names the image.
    """
    count = not_finite(block.data)
    if not count or treatment == "keep":
        return block, count
    finite = np.isfinite(block.data)
    if treatment == "zero":
        return block._replace(data=np.where(finite.all(axis=-1, keepdims=True), block.data, 0)), count
    y, x, channel = np.argwhere(~finite)[0]
    raise InputError(
        f"{label}: row {block.y0 + y}, column {block.x0 + x}, channel {channel}: found "
        f"{float(block.data[y, x, channel]):g}, expected a finite number; --nonfinite says what else to do"
    )


def check_scale(block: Block, samples: str, names: Sequence[str], label: str) -> None:
    """Refuse a flat print, of real X, Y, Z and normals, on another scale than Y = 1 for white.

    Parameters are those of `admitted` and `steeper`.

    Raises
    ------
    InputError
        The mean of Y is above 10, as it is where white has 100.
    """
    if samples != "real" or not {"X", "Y", "Z", *NORMAL} <= set(names):
        return
    with np.errstate(over="ignore", invalid="ignore"):
        mean = float(block.data[..., names.index("Y")].mean())
    if _BRIGHTEST < mean < np.inf:
        raise InputError(
            f"{label}: rows from {block.y0}: the mean of Y is {mean:.3g}, expected XYZ with Y = 1 for white"
        )


def steeper(data: Array, samples: str, names: Sequence[str], limit: float | None) -> int:
    """The number of pixels whose normal leans by more than a limit.

    Parameters
    ----------
    data
        Pixels, shape (height, width, channels).
    samples
        "device", where a component n of a normal is stored as (n + 1)/2, or "real".
    names
        Of the channels.  Without a normal among them, none is steeper.
    limit
        Angle to the z axis in degrees, 0..90; None for no limit.
    """
    if limit is None or not set(NORMAL) <= set(names):
        return 0
    normals = (data[..., names.index(name)] for name in NORMAL)
    x, y, z = (np.asarray(2 * n - 1 if samples == "device" else n, np.float64) for n in normals)
    # float32 normals of just that slope are not steeper.
    angle = np.radians(limit + 1e-3)
    # The sine of the excess angle is above 0, without an arc tangent for each pixel.
    with np.errstate(invalid="ignore"):
        above = np.sqrt(x * x + y * y) * np.cos(angle) > z * np.sin(angle)
    return int(np.count_nonzero(above))
