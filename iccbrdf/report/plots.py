"""The experiments as pictures, PNG.  Matplotlib is imported when the first one is drawn."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from iccbrdf.brdf.fit_diagnostics import REGIONS
from iccbrdf.brdf.geometry import Array
from iccbrdf.report.appearance import MEASURED, Appearance, mean
from iccbrdf.report.evaluation import INTERPOLATED, OPTIMISED, Evaluation, ModelEvaluation
from iccbrdf.report.tables import MODEL_NAMES, by_rmsd, histograms, ranked

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_D50 = (0.9642, 1.0, 0.8249)
_STYLES = ("k.", "-", "--")
_DPI = 100
_MARGIN = 0.75
"""Inches."""


def plots(evaluation: Evaluation) -> dict[str, bytes]:
    """
    Draw an evaluation.

    Returns
    -------
    PNG files by name: for each model of 2020 the test patches with the median and the worst RMSD of specular
    Y as interpolated, the worst primary and the chromaticities; the patches on slopes with the median and the
    worst mean CIEDE2000 of AIB; histograms of IB and AIB.
    """
    pictures: dict[str, bytes] = {}
    for model, found in evaluation.models.items():
        name = MODEL_NAMES[model]
        tests, primaries = by_rmsd(found.tests, INTERPOLATED), by_rmsd(found.primaries, OPTIMISED)
        pictures[f"2020-{model}-median.png"] = _panels(found.tests, tests[len(tests) // 2], f"{name}, median")
        pictures[f"2020-{model}-worst.png"] = _panels(found.tests, tests[-1], f"{name}, worst")
        pictures[f"2020-{model}-primary-worst.png"] = _panels(
            found.primaries, primaries[-1], f"{name}, worst primary"
        )
        pictures[f"2020-{model}-chromaticity.png"] = _chromaticities(found, name)
    slopes = evaluation.slopes
    ordered = ranked([mean(patch) for patch in slopes.differences("AIB")])
    pictures["2023-median.png"] = _panels(slopes, ordered[len(ordered) // 2], "median of the slopes")
    pictures["2023-worst.png"] = _panels(slopes, ordered[-1], "worst of the slopes")
    pictures["2023-histogram.png"] = _histogram(slopes)
    return pictures


def _panels(appearance: Appearance, patch: int, title: str) -> bytes:
    """Y against theta_r with a panel for each incidence, strips of colour below: sources from the top."""
    measurements = appearance.measurements
    sources = (MEASURED, *appearance.computed)
    incidences = np.unique(measurements.theta_i[measurements.in_plane])
    figure = _figure(3 * len(incidences), 4.5)
    axes = figure.subplots(2, len(incidences), squeeze=False, height_ratios=(4, 1), sharex="col")
    name, slope = measurements.keys[patch]
    where = f" on {slope:g} degrees" if slope else ""
    figure.suptitle(f"{name}{where}: {title}; strips: {', '.join(sources)}")
    for theta_i, (curves, strips) in zip(incidences, axes.T, strict=True):
        rows = np.flatnonzero(measurements.in_plane & (measurements.theta_i == theta_i))
        rows = rows[np.argsort(measurements.theta_r[rows])]
        XYZ = np.stack([appearance.XYZ(source)[patch, rows] for source in sources])
        theta_r, XYZ = _with_gaps(measurements.theta_r[rows], XYZ)
        for source, style, Y in zip(sources, _STYLES, XYZ[..., 1], strict=False):
            curves.plot(theta_r, Y, style, label=source)
        curves.set(title=f"theta_i {theta_i:g}", ylim=(0, None))
        _strips(strips, theta_r, XYZ, np.array(measurements.white))
        strips.set(xlabel="theta_r, degrees", yticks=[])
    axes[0, 0].set_ylabel("Y")
    axes[0, 0].legend()
    return _png(figure)


def _with_gaps(theta_r: Array, XYZ: Array) -> tuple[Array, Array]:
    """Angles and XYZ (sources, angles, 3), with NaN where the lamp hides the print, which no line crosses."""
    steps = np.diff(theta_r)
    gaps = np.flatnonzero(steps > 1.5 * np.median(steps)) + 1 if steps.size else np.array([], dtype=int)
    filled = np.insert(theta_r, gaps, (theta_r[gaps] + theta_r[gaps - 1]) / 2)
    return filled, np.insert(XYZ, gaps, np.nan, axis=1)


def _strips(axes: Axes, theta_r: Array, XYZ: Array, white: Array) -> None:
    """Colours (sources, angles, 3) as rows of fields, centred on their angles, each as a display has it."""
    from iccbrdf.images.display import xyz_to_srgb

    measured = np.isfinite(XYZ).all(axis=-1, keepdims=True).astype(np.float32)
    # To the display's white by ratios of XYZ: for the eye, not for figures.
    rgb = xyz_to_srgb((XYZ * (_D50 / white)).astype(np.float32)).clip(0, 1)
    between = (theta_r[1:] + theta_r[:-1]) / 2
    ends = (1.5 * theta_r[[0, -1]] - 0.5 * theta_r[[1, -2]]) if len(theta_r) > 1 else theta_r[0] + [-1, 1]
    edges = np.concatenate([ends[:1], between, ends[1:]])
    axes.pcolormesh(edges, np.arange(len(XYZ) + 1), np.concatenate([rgb, measured], axis=-1))
    axes.patch.set(hatch="////", edgecolor="0.7")
    axes.invert_yaxis()


def _chromaticities(found: ModelEvaluation, name: str) -> bytes:
    figure = _figure(8, 4)
    for axes, region in zip(figure.subplots(1, 2), (REGIONS[0], REGIONS[-1]), strict=True):
        for source, marker in zip((MEASURED, *found.tests.computed), "o+x", strict=True):
            x, y = found.tests.chromaticity(source, region).T
            axes.plot(x, y, marker, fillstyle="none", label=source)
        axes.set(xlabel="x", ylabel="y", title=f"{name}, mean of {region} readings")
    axes.legend()
    return _png(figure)


def _histogram(slopes: Appearance) -> bytes:
    figure = _figure(6, 4)
    axes = figure.subplots()
    edges, *counts = histograms(slopes).items()
    for source, values in counts:
        axes.stairs(values, edges[1], label=source)
    axes.set(xlabel="CIEDE2000", ylabel="readings", title="Test patches on slopes")
    axes.legend()
    return _png(figure)


def _figure(width: float, height: float) -> Figure:
    # Takes a second to import.
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=_DPI)
    # Matplotlib's own layout of panels takes as long as the rest of the picture.
    left, bottom = _MARGIN / width, _MARGIN / height
    figure.subplots_adjust(left, bottom, 1 - left / 4, 1 - bottom, wspace=0.25, hspace=0.1)
    return figure


def _png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()
