"""Normal and height maps, to unit normals in the print's frame: x right, y to the top, z out of the print."""

from __future__ import annotations

import warnings
from typing import Literal

import numpy as np

from iccbrdf.errors import InputError, InputWarning, UsageError, nearest
from iccbrdf.files import StrPath
from iccbrdf.images.blocks import Array
from iccbrdf.images.pictures import read_picture
from iccbrdf.images.record import Samples

Convention = Literal["opengl", "directx"]
CONVENTIONS: tuple[Convention, ...] = ("opengl", "directx")

# Grey in 8 bits, 127 or 128, decodes to a vector of length 0.007, which is no direction but rounding.
_SHORTEST = 0.02
_BAND_PIXELS = 1 << 22


def read_normal_map(
    path: StrPath, convention: Convention = "opengl", size: tuple[int, int] | None = None
) -> Array:
    """Read a normal map: RGB (an alpha channel is ignored), a component n stored as (n + 1)/2.

    Parameters
    ----------
    path
        PNG or TIFF, 8 or 16 bits, or float in 0..1.
    convention
        Which way green points: "opengl" to the top of the image, "directx" to its bottom.
    size
        The height and width that it must have.

    Returns
    -------
    Array
        float32 unit vectors, shape (height, width, 3).

    Warns
    -----
    InputWarning
        Pixels without a direction (vectors shorter than 0.02) are taken as flat: how many there are.

    Raises
    ------
    InputError
        As `iccbrdf.images.pictures.read_picture`; other than 3 or 4 channels, or values outside 0..1.
    UsageError
        An unknown convention.
    """
    if convention not in CONVENTIONS:
        hint = nearest(convention, CONVENTIONS)
        raise UsageError(f"{path}: unknown normal map convention {convention!r}: {hint}")
    picture = read_picture(path, "device", size)
    if picture.shape[2] not in (3, 4):
        raise InputError(f"{path}: {picture.shape[2]} channels, expected a normal map in red, green and blue")
    if not (picture.min() >= 0 and picture.max() <= 1):
        raise InputError(
            f"{path}: values from {picture.min():.6g} to {picture.max():.6g}, "
            "expected (n + 1)/2 of each component, in 0..1"
        )
    normals: Array = 2 * picture[:, :, :3] - 1
    if convention == "directx":
        normals[:, :, 1] *= -1
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    shapeless = length[:, :, 0] < _SHORTEST
    if shapeless.any():
        count = np.count_nonzero(shapeless)
        warnings.warn(
            f"{path}: {count} pixels without a direction are taken as flat", InputWarning, stacklevel=2
        )
        normals[shapeless] = 0, 0, 1
        length[shapeless] = 1
    normals /= length
    return normals


def read_height_map(
    path: StrPath, scale: float = 1.0, samples: Samples | None = None, size: tuple[int, int] | None = None
) -> Array:
    """Read a height map, one channel.

    Parameters
    ----------
    path
        PNG or TIFF: integers (0..1 over their range) or float.
    scale
        What 1 stands for, in the unit of the pixel pitch: for integers the height of white above black.
    samples
        As in `open_tiff`: a float TIFF whose heights leave 0..1 wants "real".
    size
        The height and width that it must have.

    Returns
    -------
    Array
        float32, shape (height, width).

    Raises
    ------
    InputError
        As `iccbrdf.images.pictures.read_picture`, or more than one channel.
    """
    picture = read_picture(path, samples, size)
    if picture.shape[2] != 1:
        raise InputError(f"{path}: {picture.shape[2]} channels, expected a height map in grey")
    heights: Array = picture[:, :, 0] * np.float32(scale)
    return heights


def height_to_normals(height: Array, pitch: float) -> Array:
    """Normals of a relief: normalised (-dz/dx, -dz/dy, 1), y to the top, so against the order of the rows.

    Differences are central, at the edges one-sided.  So a band of an image, given with one more row on each
    side, gives exactly the rows of the whole.

    Parameters
    ----------
    height
        Heights, shape (height, width), large towards the viewer.
    pitch
        Distance of neighbouring pixels, in the unit of the heights.

    Returns
    -------
    Array
        float32 unit vectors, shape (height, width, 3).  NaN among the heights gives NaN around.

    Raises
    ------
    InputError
        Not two dimensions.
    UsageError
        A pitch that is not positive.
    """
    if not 0 < pitch < np.inf:
        raise UsageError(f"pixel pitch {pitch}, expected a positive length")
    if np.ndim(height) != 2:
        raise InputError(f"heights of shape {np.shape(height)}, expected (height, width)")
    # Differences of unsigned integers would wrap around.
    height = np.asarray(height, np.result_type(height, np.float32))
    normals = np.empty((*height.shape, 3), np.float32)
    # Band by band, as what comes in between takes twice the memory of the normals.
    rows = max(1, _BAND_PIXELS // max(1, height.shape[1]))
    for y0 in range(0, len(height), rows):
        above, below = max(0, y0 - 1), y0 + rows + 1
        inner = slice(y0 - above, y0 - above + rows)
        normals[y0 : y0 + rows] = _normals(height[above:below], pitch)[inner]
    return normals


def _normals(height: Array, pitch: float) -> Array:
    normals = np.empty((*height.shape, 3), np.float32)
    normals[:, :, 0] = -_slope(height, pitch, axis=1)
    normals[:, :, 1] = _slope(height, pitch, axis=0)
    normals[:, :, 2] = 1
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    return normals


def _slope(height: Array, pitch: float, axis: int) -> Array:
    if height.shape[axis] == 1:
        return np.zeros_like(height)
    slope: Array = np.gradient(height, pitch, axis=axis)
    return slope
