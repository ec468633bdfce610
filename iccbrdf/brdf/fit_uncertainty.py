"""How far fitted parameters may lie from the true ones: confidence intervals.

References
----------
-   [White1982] H. White: Maximum likelihood estimation of misspecified models. Econometrica 50(1), 1982.
-   [Liang1986] K.-Y. Liang, S. Zeger: Longitudinal data analysis using generalized linear models. Biometrika
    73(1), 1986.
"""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from iccbrdf.brdf.fit_problem import Problem
from iccbrdf.brdf.geometry import Array

CONFIDENCE = 0.95

_LEAST_DISTANCE = 1e-9
_RIDGE = 1e-12
"""On a Hessian of diagonal 1: a direction that the data say nothing about gets an endless interval."""


def confidence_intervals(problem: Problem, parameters: Array) -> Array:
    """
    Return 95 % confidence intervals of fitted parameters, by the sandwich clustered by geometry.

    The covariance of the logarithms is A^-1 M A^-1 g / (g - k), A the Hessian of the objective, M the sum of
    the squared gradients of the geometries [White1982], the three components at a geometry being one cluster
    [Liang1986], as an error of its angle or its aperture moves them together.  Quantiles are Student's with
    g - k degrees of freedom.  The intervals answer for scatter between geometries, not for a model that does
    not fit.

    Parameters
    ----------
    problem
        Measurements of p patches.
    parameters
        Optima, (p, k).

    Returns
    -------
    Lower and upper ends, (p, k, 2), within the bounds; NaN for a parameter at a bound.
    """
    logs, (low, high) = np.log(parameters), problem.bounds
    patches, k = logs.shape
    residuals, jacobian = problem.linearise(logs, np.arange(patches))
    gradients = np.einsum("pgck,pgc->pgk", jacobian, residuals)
    hessians = np.swapaxes(jacobian, -1, -2) @ jacobian
    if problem.objective == "mean CIEDE2000":
        # Derivatives of |r|: J' u and J' (I - u u') J / |r|, with u = r / |r|.
        distance = np.maximum(np.linalg.norm(residuals, axis=-1), _LEAST_DISTANCE)[..., np.newaxis]
        gradients = gradients / distance
        along = gradients[..., np.newaxis] * gradients[..., np.newaxis, :]
        hessians = (hessians - along) / distance[..., np.newaxis]
    bread = hessians.sum(axis=1)
    geometries = np.count_nonzero(problem.measured, axis=-1)
    freedom = np.maximum(geometries - k, 1)

    inside = (logs > low) & (logs < high)
    both = inside[:, :, np.newaxis] & inside[:, np.newaxis, :]
    scale = np.sqrt(np.maximum(np.einsum("pii->pi", bread), np.finfo(np.float64).tiny))[:, np.newaxis]
    bread = np.where(both, bread / (scale * np.swapaxes(scale, -1, -2)), np.eye(k)) + _RIDGE * np.eye(k)
    # A^-1 M A^-1 is the sum over the geometries of squares of A^-1 times the gradient of each.
    influence = np.where(inside[:, np.newaxis], gradients / scale, 0.0) @ np.linalg.inv(bread) / scale
    variance = np.sum(influence**2, axis=1) * (geometries / freedom)[:, np.newaxis]
    reach = stdtrit(freedom, (1 + CONFIDENCE) / 2)[:, np.newaxis] * np.sqrt(variance)
    ends = np.stack([np.maximum(logs - reach, low), np.minimum(logs + reach, high)], axis=-1)
    return np.where(inside[..., np.newaxis], np.exp(ends), np.nan)
