"""The relief of a job, as normals of the image's size."""

from __future__ import annotations

import warnings

import numpy as np

from iccbrdf.errors import InputError, InputWarning
from iccbrdf.files import StrPath
from iccbrdf.images import height_to_normals, read_height_map, read_normal_map
from iccbrdf.images.blocks import Array
from iccbrdf.proof.job import Job

_SAME_SHAPE = 0.01
"""Relative difference of two aspect ratios that are taken as the same."""


def read_normals(job: Job, height: int, width: int) -> Array | None:
    """Unit normals, float32, (height, width, 3), of the job's height or normal map; None where it has none.

    Raises InputError where the map cannot be read, or is of another size and is not to be resampled.
    """
    if job.height is not None and job.pixel_pitch is not None:
        heights = _fitted(read_height_map(job.height, job.relief), job.height, job, height, width)
        return height_to_normals(heights, job.pixel_pitch)
    if job.normals is None:
        return None
    found = read_normal_map(job.normals, "opengl" if job.green == "up" else "directx")
    fitted = _fitted(found, job.normals, job, height, width)
    if fitted is not found:
        fitted /= np.linalg.norm(fitted, axis=2, keepdims=True)
    return fitted


def _fitted(picture: Array, path: StrPath, job: Job, height: int, width: int) -> Array:
    rows, columns = picture.shape[:2]
    if (rows, columns) == (height, width):
        return picture
    if not job.fit_relief:
        raise InputError(
            f"{path}: the relief has {columns} x {rows} pixels, {job.image} has {width} x {height}; "
            "--fit-relief resamples it"
        )
    stretch = (height / rows) / (width / columns)
    if abs(stretch - 1) > _SAME_SHAPE:
        warnings.warn(
            f"{path}: of {columns} x {rows} pixels, is stretched to {width} x {height}: its height by "
            f"{stretch:.3g} times more than its width",
            InputWarning,
            stacklevel=2,
        )
    # Half a second to import.
    from scipy.ndimage import zoom

    factors = (height / rows, width / columns) + (1,) * (picture.ndim - 2)
    fitted: Array = zoom(picture, factors, order=1, mode="nearest", grid_mode=True)
    return fitted
