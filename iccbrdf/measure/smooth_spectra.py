"""Reflectance spectra for given XYZ: many have them, the smoothest is taken.

References
----------
-   [Burns2020] S. A. Burns: Numerical methods for smoothest reflectance reconstruction. Color Research and
    Application 45(1), 2020.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.geometry import Array
from iccbrdf.errors import UsageError

_STEPS = 100
"""Of Newton's method; the colours of prints take some ten."""
_CLOSE = 1e-12
"""Error of X, Y, Z."""
_SMALL_CHANGE = 1e-6
"""Of z in the last step, whose square is the error after it."""


def smoothest_spectra(XYZ: ArrayLike, weights: ArrayLike) -> Array:
    """
    Return the reflectance spectra between 0 and 1 whose hyperbolic tangent form is smoothest [Burns2020].

    With r = (1 + tanh z) / 2, the sum of squared steps of z is least among all spectra of this XYZ: Newton's
    method on the Lagrange conditions.

    Parameters
    ----------
    XYZ
        Shape (k, 3), Y = 1 for the perfect diffuser.
    weights
        From `iccbrdf.measure.colorimetry.weights`, shape (w, 3).

    Returns
    -------
    Spectra, shape (k, w).

    Raises
    ------
    UsageError
        No spectrum between 0 and 1 has these XYZ.
    """
    weights = np.asarray(weights, dtype=np.float64)
    return np.stack([_smoothest(target, weights) for target in np.asarray(XYZ, dtype=np.float64)])


def _smoothest(XYZ: Array, weights: Array) -> Array:
    w = len(weights)
    steps = np.diff(np.eye(w), axis=0)
    roughness = 2 * steps.T @ steps
    # The grey of this Y is the start.
    z, multipliers = np.full(w, np.arctanh(np.clip(2 * XYZ[1] - 1, -0.999, 0.999))), np.zeros(3)
    for _ in range(_STEPS):
        tanh = np.tanh(z)
        slope = (1 - tanh**2) / 2
        gradient = roughness @ z + slope * (weights @ multipliers)
        residual = weights.T @ ((1 + tanh) / 2) - XYZ
        constraints = slope[:, np.newaxis] * weights
        curvature = roughness - 2 * np.diag(slope * tanh * (weights @ multipliers))
        system = np.block([[curvature, constraints], [constraints.T, np.zeros((3, 3))]])
        try:
            change = np.linalg.solve(system, -np.concatenate([gradient, residual]))
        except np.linalg.LinAlgError:
            break
        # A full step from afar lands where tanh is flat.
        change /= max(1.0, np.max(np.abs(change[:w])))
        z, multipliers = z + change[:w], multipliers + change[w:]
        if np.max(np.abs(residual)) < _CLOSE and np.max(np.abs(change[:w])) < _SMALL_CHANGE:
            spectrum: Array = (1 + np.tanh(z)) / 2
            return spectrum
    raise UsageError(f"no reflectance spectrum found for the XYZ {XYZ.tolist()}, Y = 1 for white")
