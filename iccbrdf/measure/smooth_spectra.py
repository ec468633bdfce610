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
_CLOSE = 1e-12


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
    XYZ, weights = np.asarray(XYZ, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    w = len(weights)
    steps = np.diff(np.eye(w), axis=0)
    roughness = 2 * steps.T @ steps
    spectra = np.empty((len(XYZ), w))
    for k, target in enumerate(XYZ):
        z, multipliers = np.full(w, np.arctanh(np.clip(2 * target[1] - 1, -0.999, 0.999))), np.zeros(3)
        for _ in range(_STEPS):
            tanh = np.tanh(z)
            slope = (1 - tanh**2) / 2
            gradient = roughness @ z + slope * (weights @ multipliers)
            residual = weights.T @ ((1 + tanh) / 2) - target
            constraints = slope[:, np.newaxis] * weights
            curvature = roughness - 2 * np.diag(slope * tanh * (weights @ multipliers))
            system = np.block([[curvature, constraints], [constraints.T, np.zeros((3, 3))]])
            change = np.linalg.solve(system, -np.concatenate([gradient, residual]))
            # A full step from afar lands where tanh is flat.
            change *= min(1.0, 1.0 / np.max(np.abs(change[:w])))
            z, multipliers = z + change[:w], multipliers + change[w:]
            if np.max(np.abs(residual)) < _CLOSE and np.max(np.abs(change[:w])) < _CLOSE**0.5:
                break
        else:
            raise UsageError(f"no reflectance spectrum found for XYZ {target.tolist()}, Y = 1 for white")
        spectra[k] = (1 + np.tanh(z)) / 2
    return spectra
