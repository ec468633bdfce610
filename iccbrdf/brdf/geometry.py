"""Directions, the half vector and the cosines that the models are written in.

Frame: x to the right of the print, y to its top, z out of it.  Normal `n`, `light` and `view` point away
from the surface.  Arrays of vectors have the shape (..., 3); leading axes broadcast.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.errors import UsageError

Array = NDArray[np.float64]

HORIZON = 1e-70
"""A cosine up to here counts as below the horizon.

Far below what any normal or light can hold, and far enough above the smallest float64 that no fourth
power of a cosine in the models underflows.
"""


class Cosines(NamedTuple):
    """Cosines of the papers' four angles, each of shape (...)."""

    theta_i: Array
    """Light and normal."""
    theta_v: Array
    """Viewer and normal."""
    theta_h: Array
    """Half vector and normal."""
    alpha: Array
    """Viewer and half vector, which is half the angle between light and viewer."""


def direction(zenith: ArrayLike, azimuth: ArrayLike = 0.0) -> Array:
    """
    Return the unit vector of a direction given by its angles.

    Parameters
    ----------
    zenith
        Angle from the z axis in degrees, shape (...); 90 is the horizon.
    azimuth
        Angle from the x axis in degrees, counter-clockwise seen from above the print, shape (...).

    Returns
    -------
    Unit vectors, shape (..., 3).  Multiples of 90 degrees are exact, so that a light on the horizon has a
    cosine of exactly 0.

    Examples
    --------
    >>> direction(90, 180)
    array([-1.,  0.,  0.])
    >>> direction(60, 90).round(6)
    array([0.      , 0.866025, 0.5     ])
    """
    sin_zenith, cos_zenith = _sin_cos(zenith)
    sin_azimuth, cos_azimuth = _sin_cos(azimuth)
    x, y, z = np.broadcast_arrays(sin_zenith * cos_azimuth, sin_zenith * sin_azimuth, cos_zenith)
    # A sum with +0 turns -0, which looks like a sign in a listing, into 0.
    return np.stack([x, y, z], axis=-1) + 0.0


def planar(theta: ArrayLike) -> Array:
    """
    Return the unit vector of a signed angle in the plane of incidence, the geometry of both papers.

    Parameters
    ----------
    theta
        Angle from the z axis in degrees, shape (...), positive to the right (+x).  A light of incidence
        `theta_i` shines from the left, `planar(-theta_i)`, so that viewing angles are positive on the
        mirror side: `planar(theta_i)` is the mirror direction and `planar(-theta_i)` looks back along the
        light.

    Returns
    -------
    Unit vectors (sin theta, 0, cos theta), shape (..., 3).

    Examples
    --------
    >>> half_vector(planar(-45), planar(45))
    array([0., 0., 1.])
    """
    return direction(theta, 0.0)


def unit(vectors: ArrayLike) -> Array:
    """
    Return vectors scaled to length 1, shape (..., 3).

    A vector that has no direction (zero, infinite or not a number) becomes zero, which every model shows
    as black.

    Raises
    ------
    UsageError
        The last axis does not have the length 3.
    """
    vectors = np.asarray(vectors, dtype=np.float64)
    if vectors.ndim == 0 or vectors.shape[-1] != 3:
        raise UsageError(f"vectors have the shape {vectors.shape}, expected (..., 3)")
    # Squares of very long or short vectors leave the range of float64: scale by the largest component.
    largest = np.max(np.abs(vectors), axis=-1, keepdims=True)
    has_direction = np.isfinite(largest) & (largest > 0)
    scaled: Array = np.divide(vectors, largest, out=np.zeros_like(vectors), where=has_direction)
    np.divide(scaled, np.sqrt(dot(scaled, scaled))[..., np.newaxis], out=scaled, where=has_direction)
    return scaled


def half_vector(light: ArrayLike, view: ArrayLike) -> Array:
    """Return the normalised half vector of light and viewer, shape (..., 3): zero where they are opposite."""
    return unit(unit(light) + unit(view))


def cosines(n: ArrayLike, light: ArrayLike, view: ArrayLike) -> Cosines:
    """Return the cosines of the papers' angles, from vectors of shape (..., 3) and any length."""
    normal, to_light, to_viewer = unit(n), unit(light), unit(view)
    half = half_vector(light, view)
    return Cosines(
        theta_i=dot(normal, to_light),
        theta_v=dot(normal, to_viewer),
        theta_h=dot(normal, half),
        alpha=dot(to_viewer, half),
    )


def tan2_theta_h(n: ArrayLike, half: ArrayLike) -> Array:
    """
    Return tan^2 theta_h = |n x h|^2 / (n . h)^2.

    The stable form of the half vector's angle: neither vector need be of unit length, and near the mirror
    direction nothing cancels, where the arc cosine of a number near 1 has lost half its digits.

    Parameters
    ----------
    n, half
        Normals and half vectors, shape (..., 3), not at right angles.

    Returns
    -------
    Squared tangents, shape (...).
    """
    n, half = np.asarray(n, dtype=np.float64), np.asarray(half, dtype=np.float64)
    normal_to_both = np.cross(n, half)
    tan2: Array = dot(normal_to_both, normal_to_both) / dot(n, half) ** 2
    return tan2


def dot(a: Array, b: Array) -> Array:
    """Return the scalar products of vectors of shape (..., 3), shape (...)."""
    products: Array = np.einsum("...i,...i->...", a, b)
    return products


def is_lit(cosine: Cosines) -> NDArray[np.bool_]:
    """Return where light and viewer both stand above the surface, shape (...)."""
    lit: NDArray[np.bool_] = (cosine.theta_i > HORIZON) & (cosine.theta_v > HORIZON)
    return lit


def _sin_cos(degrees: ArrayLike) -> tuple[Array, Array]:
    """Sine and cosine of angles in degrees, exact at multiples of 90."""
    degrees = np.asarray(degrees, dtype=np.float64)
    quadrant = np.rint(degrees / 90)
    rest = np.radians(degrees - 90 * quadrant)
    sin, cos = np.sin(rest), np.cos(rest)
    choices = [np.mod(quadrant, 4) == k for k in range(4)]
    return (
        np.select(choices, [sin, cos, -sin, -cos], default=np.nan),
        np.select(choices, [cos, -sin, -cos, sin], default=np.nan),
    )
