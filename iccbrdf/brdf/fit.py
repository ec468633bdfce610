"""From goniometric measurements of patches to parameters of a reflection model, and how far to trust them.

References
----------
-   [Habib2020] T. Habib, P. Green, P. Nussbaum: BRDF rendering by interpolation of optimised model
    parameters. Color and Imaging Conference 28, 2020.
-   [Habib2023] T. Habib, P. Green, P. Nussbaum: An appearance reproduction framework for printed 3D
    surfaces. Journal of Imaging Science and Technology, 2023.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.brdf.fit_diagnostics import REGIONS, Finding, diagnose, regions
from iccbrdf.brdf.fit_problem import Objective, Problem
from iccbrdf.brdf.fit_solvers import data_starts, least_squares, nelder_mead
from iccbrdf.brdf.fit_uncertainty import confidence_intervals
from iccbrdf.brdf.geometry import Array, unit
from iccbrdf.brdf.models import find_model
from iccbrdf.brdf.primaries import REFRACTIVE_INDEX
from iccbrdf.errors import InputError, UsageError, nearest

Solver = Literal["least_squares", "nelder_mead"]

SOLVERS: dict[str, Callable[[Problem, Array], tuple[Array, Array]]] = {
    "least_squares": least_squares,
    "nelder_mead": nelder_mead,
}

STARTS = 3

_SAME = 1e-3
"""Starts whose objective is within this of the best, relatively, have reached the best."""
_SAME_ZERO = {"rms CIEDE2000": 1e-4, "mean CIEDE2000": 1e-4, "rms XYZ": 1e-6}
"""The same where the best is 0."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """Fitted parameters of p patches, and how far to trust them."""

    model: str
    objective: str
    solver: str
    as_published: bool
    names: tuple[str, ...]
    """The parameters that were fitted, k of them: the model's channels, then perhaps `refractive_index`."""
    parameters: Array
    """Channels of the model in order, (p, channels)."""
    refractive_index: Array
    """Given or fitted, (p,); without meaning for models that have none."""
    intervals: Array
    """Lower and upper ends of the 95 % confidence intervals, in the order of `names`, (p, k, 2)."""
    value: Array
    """The objective at the optimum, (p,)."""
    mean_difference: Array
    """Mean CIEDE2000 in each of `REGIONS`, (p, 3); NaN where a region was not measured."""
    max_difference: Array
    """Largest CIEDE2000 in each of `REGIONS`, (p, 3)."""
    lack_of_fit: Array
    """Root mean square CIEDE2000 less the scatter of repeated readings, where that is known, (p,)."""
    geometries: NDArray[np.intp]
    """How many each patch was measured in, (p,)."""
    agreement: Array
    """Share of the starts that reached the best optimum, (p,)."""
    seconds: float
    """Time of the solver."""
    findings: tuple[tuple[Finding, ...], ...]
    """For each patch what each check found."""

    @property
    def flags(self) -> tuple[tuple[Finding, ...], ...]:
        """For each patch the findings that say that its fit must not be trusted."""
        return tuple(tuple(finding for finding in patch if finding.flagged) for patch in self.findings)


def fit(
    XYZ: ArrayLike,
    light: ArrayLike,
    view: ArrayLike,
    white: ArrayLike,
    *,
    model: str = "brdf1",
    objective: Objective = "rms CIEDE2000",
    solver: Solver = "least_squares",
    refractive_index: float | Literal["free"] = REFRACTIVE_INDEX,
    as_published: bool = False,
    starts: int | ArrayLike = STARTS,
    repeat_scatter: float = 0.0,
    patches: Sequence[str] | None = None,
) -> FitResult:
    """
    Fit a reflection model to each of p patches.

    Parameters
    ----------
    XYZ
        Measurements, (p, g, 3): pi times the BRDF as XYZ, Y = 1 for the perfect diffuser, which is the
        reflectance factor; NaN where not measured.
    light, view
        Directions to light and viewer in the frame of the patch, above it, (g, 3), any length.
    white
        XYZ of the perfect diffuser, (3,).
    model
        Key of `MODELS`.
    objective
        `rms CIEDE2000`, `mean CIEDE2000` (the CD of [Habib2023]) or `rms XYZ` (its RMSE), over the
        geometries.
    solver
        `least_squares` (all patches and starts together) or `nelder_mead` (as in the papers).
    refractive_index
        A number, or `free` to fit it to each patch.  ks times the Fresnel term at normal incidence is nearly
        constant, so that fitted, it takes ks with it.
    as_published
        Compare the model's I, its cos theta_i included, with the measured reflectance, as the papers write
        it; otherwise the same quantity of both.
    starts
        Number of starts made from the data, or parameters to start from, (s, k) or (p, s, k), k with the
        refractive index last where it is free.
    repeat_scatter
        Root mean square CIEDE2000 between repeated readings, to be taken off the lack of fit.
    patches
        Names for messages, p of them.

    Returns
    -------
    FitResult

    Raises
    ------
    UsageError
        An unknown name, arrays that do not go together, or a light or viewer not above the surface.
    InputError
        A patch was measured in no more geometries than it has parameters.

    Examples
    --------
    >>> from iccbrdf.brdf.geometry import planar
    >>> from iccbrdf.brdf.models import evaluate
    >>> theta_i, theta_v = np.repeat([15.0, 45.0, 60.0], 27), np.tile(np.arange(-65.0, 70, 5), 3)
    >>> light, view = planar(-theta_i), planar(theta_v)
    >>> truth = [0.5, 0.4, 0.1, 0.2, 0.2, 0.2, 0.25]
    >>> XYZ = evaluate("brdf1", truth, planar(0), light, view, intensity=np.pi / light[:, 2:])
    >>> fit(XYZ[np.newaxis], light, view, [0.9642, 1, 0.8249]).parameters.round(6).tolist()
    [[0.5, 0.4, 0.1, 0.2, 0.2, 0.2, 0.25]]
    """
    problem = _problem(XYZ, light, view, white, model, objective, refractive_index, as_published)
    if solver not in SOLVERS:
        raise UsageError(f"unknown solver {solver!r}: {nearest(solver, SOLVERS)}")
    _check_counts(problem, patches)
    started = time.perf_counter()
    optima, values = SOLVERS[solver](problem, _starts(problem, starts))
    seconds = time.perf_counter() - started

    best = np.argmin(values, axis=1)[:, np.newaxis]
    value = np.take_along_axis(values, best, axis=1)
    parameters = np.take_along_axis(optima, best[..., np.newaxis], axis=1)[:, 0]
    agreement = np.mean(values <= value * (1 + _SAME) + _SAME_ZERO[objective], axis=1)
    index = parameters[:, -1] if problem.fits_index else np.full(len(parameters), problem.refractive_index)
    difference = problem.colour_differences(problem.XYZ, problem.predict(parameters))
    mean, largest = _by_region(difference, regions(problem.light, problem.view))
    squared = np.nanmean(difference**2, axis=1)
    return FitResult(
        model=model,
        objective=objective,
        solver=solver,
        as_published=as_published,
        names=problem.names,
        parameters=parameters[:, : len(problem.model.channels)],
        refractive_index=index,
        intervals=confidence_intervals(problem, parameters),
        value=value[:, 0],
        mean_difference=mean,
        max_difference=largest,
        lack_of_fit=np.sqrt(np.maximum(squared - repeat_scatter**2, 0)),
        geometries=np.count_nonzero(problem.measured, axis=1),
        agreement=agreement,
        seconds=seconds,
        findings=diagnose(problem, parameters, index, agreement),
    )


def _problem(
    XYZ: ArrayLike,
    light: ArrayLike,
    view: ArrayLike,
    white: ArrayLike,
    model: str,
    objective: Objective,
    refractive_index: float | Literal["free"],
    as_published: bool,
) -> Problem:
    entry = find_model(model)
    if objective not in get_args(Objective):
        raise UsageError(f"unknown objective {objective!r}: {nearest(objective, get_args(Objective))}")
    if refractive_index == "free":
        if not entry.has_fresnel:
            raise UsageError(f"{model} has no refractive index to be fitted")
    elif not 1 <= refractive_index < np.inf:
        raise UsageError(
            f"the refractive index is {refractive_index}, expected a finite number from 1, or 'free'"
        )
    XYZ, white = np.asarray(XYZ, dtype=np.float64), np.asarray(white, dtype=np.float64)
    light, view = unit(light), unit(view)
    if light.ndim != 2 or view.shape != light.shape:
        raise UsageError(f"light and view have the shapes {light.shape} and {view.shape}, expected (g, 3)")
    if XYZ.ndim != 3 or XYZ.shape[1:] != light.shape:
        raise UsageError(f"XYZ has the shape {XYZ.shape}, expected (patches, {len(light)}, 3)")
    if white.shape != (3,) or not np.all(white > 0):
        raise UsageError(f"white is {white.tolist()}, expected three numbers above 0")
    for name, vectors in (("light", light), ("view", view)):
        below = np.flatnonzero(vectors[:, 2] <= 0)
        if below.size:
            raise UsageError(
                f"{name} {below[0]} is {vectors[below[0]].round(6).tolist()}, expected above the surface"
            )
    index = None if refractive_index == "free" else float(refractive_index)
    return Problem(entry, XYZ, light, view, white, objective, index, as_published)


def _check_counts(problem: Problem, patches: Sequence[str] | None) -> None:
    k = len(problem.names)
    for p, count in enumerate(np.count_nonzero(problem.measured, axis=1)):
        if count <= k:
            raise InputError(
                f"patch {patches[p] if patches is not None else p} was measured in {count} geometries, "
                f"expected more than the {k} parameters of the fit"
            )


def _starts(problem: Problem, starts: int | ArrayLike) -> Array:
    """Parameters to start from, (p, s, k)."""
    if isinstance(starts, int):
        if starts < 1:
            raise UsageError(f"{starts} starts, expected at least 1")
        return data_starts(problem, starts)
    given, k = np.asarray(starts, dtype=np.float64), len(problem.names)
    shape = (len(problem.XYZ), *given.shape[-2:])
    if given.ndim not in (2, 3) or given.shape[-1] != k or np.broadcast_shapes(given.shape, shape) != shape:
        raise UsageError(f"starts have the shape {given.shape}, expected (s, {k}) or (patches, s, {k})")
    if not np.all(given > 0):
        raise UsageError("starts hold parameters that are not above 0")
    return np.broadcast_to(given, shape)


def _by_region(difference: Array, region: NDArray[np.intp]) -> tuple[Array, Array]:
    """Mean and largest of differences (p, g) in each region, (p, 3) each."""
    shape = len(difference), len(REGIONS)
    mean, largest = np.full(shape, np.nan), np.full(shape, np.nan)
    for k in range(len(REGIONS)):
        inside = np.where(region == k, difference, np.nan)
        some = np.isfinite(inside).any(axis=1)
        mean[some, k], largest[some, k] = np.nanmean(inside[some], axis=1), np.nanmax(inside[some], axis=1)
    return mean, largest
