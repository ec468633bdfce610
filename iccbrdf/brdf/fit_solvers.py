"""The two solvers: Levenberg-Marquardt for all patches and starts at once, and Nelder-Mead for each alone.

References
----------
-   [Marquardt1963] D. Marquardt: An algorithm for least-squares estimation of nonlinear parameters. Journal
    of the Society for Industrial and Applied Mathematics 11(2), 1963.
-   [Nelder1965] J. Nelder, R. Mead: A simplex method for function minimization. The Computer Journal 7(4),
    1965.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.fit_problem import Problem
from iccbrdf.brdf.geometry import Array

_M_OF_STARTS = (0.06, 0.5)
"""The least and largest m of the starts from the data."""
_INDEX_OF_STARTS = 1.5
_LEAST_OF_STARTS = 1e-3
"""Where a diffuse or specular part starts that the data say is not there: what is 0 has no logarithm."""

_ITERATIONS = 200
_LARGEST_STEP = 2.0
"""Of a logarithm: further, the linear model of the residuals says nothing."""
_STEP_TOLERANCE = 1e-9
_COST_TOLERANCE = 1e-12
_LEAST_DAMPING, _LARGEST_DAMPING = 1e-12, 1e12
_LEAST_DISTANCE = 3e-3
"""The mean of colour differences is smoothed below this, where its derivative jumps."""
_BATCH = 64
"""Starts that are solved together: as many as keep their residuals in the processor's cache."""

_EVALUATIONS = 5000
_SIMPLEX_TOLERANCE = 1e-5


def data_starts(problem: Problem, count: int) -> Array:
    """
    Return starts made from the measurements: kd and ks by linear least squares, for each of some m.

    Rows weigh X^(-2/3), as a step of lightness does, or the mirror direction would be all that counts.

    Parameters
    ----------
    problem
        Measurements of p patches.
    count
        How many values of m.

    Returns
    -------
    Parameters, (p, count, k).
    """
    weights = problem.measured[..., np.newaxis] * np.maximum(problem.XYZ, _LEAST_OF_STARTS) ** (-4 / 3)

    def product(a: Array, b: Array) -> Array:
        return np.asarray(np.sum(weights * a * b, axis=-2))

    starts = []
    for m in np.geomspace(*_M_OF_STARTS, count):
        none, unit = np.zeros(3), np.ones(3)
        base = problem.predict(_assembled(problem, unit, none, m))
        lobe = problem.predict(_assembled(problem, none, unit, m))
        determinant = product(base, base) * product(lobe, lobe) - product(base, lobe) ** 2
        ks = (
            product(base, base) * product(lobe, problem.XYZ)
            - product(base, lobe) * product(base, problem.XYZ)
        ) / np.maximum(determinant, np.finfo(np.float64).tiny)
        high = np.exp(problem.bounds[1, 3])
        parameters = _assembled(problem, none, np.clip(ks, _LEAST_OF_STARTS, high / 2), m)
        # The lobe that the model has room for, which is one for all of X, Y, Z in some, decides what is left.
        specular = problem.predict(parameters)
        base = problem.predict(np.concatenate([np.ones_like(ks), parameters[:, 3:]], axis=-1)) - specular
        diffuse = product(base, problem.XYZ - specular) / product(base, base)
        parameters[:, :3] = np.clip(diffuse, _LEAST_OF_STARTS, np.exp(problem.bounds[1, :3]) / 1.1)
        starts.append(parameters)
    return np.stack(starts, axis=1)


def _assembled(problem: Problem, diffuse: Array, ks: Array, m: float) -> Array:
    """Parameters (..., k) of diffuse and specular parts (..., 3)."""
    widths = dict(problem.model.parameters)
    shared = ks if widths["ks"] == 3 else ks.mean(axis=-1, keepdims=True)
    rest = np.full(len(problem.names) - 3 - widths["ks"], _INDEX_OF_STARTS)
    rest[: widths["m"]] = m
    parts = (np.broadcast_to(diffuse, ks.shape), shared, np.broadcast_to(rest, (*ks.shape[:-1], rest.size)))
    return np.concatenate(parts, axis=-1)


def least_squares(problem: Problem, starts: Array) -> tuple[Array, Array]:
    """
    Minimise the objective from each start by Levenberg-Marquardt [Marquardt1963], within the bounds.

    The mean of colour differences takes the Hessian of their distances in place of that of their squares.

    Parameters
    ----------
    problem
        Measurements of p patches.
    starts
        Parameters, (p, s, k).

    Returns
    -------
    The optima (p, s, k) and the objective there (p, s).
    """
    patches, count, k = starts.shape
    low, high = problem.bounds
    logs = np.clip(np.log(starts), low, high).reshape(-1, k)
    patch = np.repeat(np.arange(patches), count)
    values = np.empty(len(logs))
    for first in range(0, len(logs), _BATCH):
        batch = slice(first, first + _BATCH)
        logs[batch], values[batch] = _levenberg_marquardt(problem, logs[batch], patch[batch])
    return np.exp(logs).reshape(starts.shape), values.reshape(patches, count)


def _levenberg_marquardt(problem: Problem, logs: Array, patch: NDArray[np.intp]) -> tuple[Array, Array]:
    low, high = problem.bounds
    logs, damping = logs.copy(), np.full(len(logs), 1e-2)
    residuals, jacobian = problem.linearise(logs, patch)
    cost, gradient, hessian = _quadratic(problem, residuals, jacobian)
    values = problem.values(residuals, patch)
    active = np.arange(len(logs))
    for _ in range(_ITERATIONS):
        step = _step(gradient[active], hessian[active], damping[active], logs[active], low, high)
        trial = np.clip(logs[active] + step, low, high)
        residuals, jacobian = problem.linearise(trial, patch[active])
        new_cost, new_gradient, new_hessian = _quadratic(problem, residuals, jacobian)
        better = new_cost <= cost[active]
        moved = np.max(np.abs(trial - logs[active]), axis=-1)
        gain = cost[active] - new_cost
        done = better & ((moved <= _STEP_TOLERANCE) | (gain <= _COST_TOLERANCE * new_cost))
        damping[active] = np.maximum(damping[active] * np.where(better, 0.1, 8.0), _LEAST_DAMPING)
        done |= damping[active] > _LARGEST_DAMPING
        accepted = active[better]
        logs[accepted], cost[accepted] = trial[better], new_cost[better]
        gradient[accepted], hessian[accepted] = new_gradient[better], new_hessian[better]
        values[accepted] = problem.values(residuals[better], patch[accepted])
        active = active[~done]
        if not active.size:
            break
    return logs, values


def _quadratic(problem: Problem, residuals: Array, jacobian: Array) -> tuple[Array, Array, Array]:
    """Cost (b,), gradient (b, k) and Gauss-Newton Hessian (b, k, k) of the objective's sum."""
    squared = np.sum(residuals**2, axis=-1)
    gradients = np.einsum("bgck,bgc->bgk", jacobian, residuals)
    rows = jacobian.reshape(*residuals.shape[:1], -1, jacobian.shape[-1])
    if problem.objective != "mean CIEDE2000":
        return np.sum(squared, axis=-1) / 2, gradients.sum(axis=1), np.swapaxes(rows, -1, -2) @ rows
    # The distance d = |r| has the gradient J' u and the Hessian J' (I - u u') J / d, with u = r / d.
    distance = np.sqrt(squared + _LEAST_DISTANCE**2)[..., np.newaxis]
    gradients /= distance
    weighted = (jacobian / distance[..., np.newaxis]).reshape(rows.shape)
    along = gradients / np.sqrt(distance)
    hessian = np.swapaxes(weighted, -1, -2) @ rows - np.swapaxes(along, -1, -2) @ along
    return distance[..., 0].sum(axis=-1), gradients.sum(axis=1), hessian


def _step(gradient: Array, hessian: Array, damping: Array, logs: Array, low: Array, high: Array) -> Array:
    """The damped step, 0 along parameters that a bound holds."""
    k = logs.shape[-1]
    free = ~(((logs <= low) & (gradient > 0)) | ((logs >= high) & (gradient < 0)))
    diagonal = np.einsum("bii->bi", hessian)
    # A parameter without effect, as m is of a lobe that is not there, keeps a slope to stand on.
    scale = np.maximum(diagonal, 1e-12 * diagonal.max(axis=-1, keepdims=True)) + np.finfo(np.float64).tiny
    both = free[:, :, np.newaxis] & free[:, np.newaxis, :]
    damped = (
        np.where(both, hessian, 0.0)
        + np.eye(k) * np.where(free, damping[:, np.newaxis] * scale, 1.0)[:, np.newaxis]
    )
    step = -np.linalg.solve(damped, np.where(free, gradient, 0.0)[..., np.newaxis])[..., 0]
    return np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)


def nelder_mead(problem: Problem, starts: Array) -> tuple[Array, Array]:
    """
    Minimise the objective from each start by Nelder and Mead's simplex [Nelder1965], as the papers do.

    On the logarithms of the parameters, within the bounds, by SciPy.

    Parameters
    ----------
    problem
        Measurements of p patches.
    starts
        Parameters, (p, s, k).

    Returns
    -------
    The optima (p, s, k) and the objective there (p, s).
    """
    # Takes a tenth of a second to import, and the default solver does without.
    from scipy.optimize import minimize

    optima, values = np.empty_like(starts), np.empty(starts.shape[:2])
    for patch, start in np.ndindex(*values.shape):
        index = np.array([patch])

        def value(logs: Array, index: NDArray[np.intp] = index) -> float:
            residuals = problem.residuals(problem.predict(np.exp(logs))[np.newaxis], index)
            return problem.values(residuals, index).item()

        found = minimize(
            value,
            np.clip(np.log(starts[patch, start]), *problem.bounds),
            method="Nelder-Mead",
            bounds=problem.bounds.T,
            options={
                "maxfev": _EVALUATIONS,
                "xatol": _SIMPLEX_TOLERANCE,
                "fatol": _SIMPLEX_TOLERANCE,
                "adaptive": True,
            },
        )
        optima[patch, start], values[patch, start] = np.exp(found.x), found.fun
    return optima, values
