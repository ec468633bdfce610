"""The experiments as pictures, PNG.  Matplotlib is imported when the first one is drawn."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from iccbrdf.brdf.fit_diagnostics import REGIONS
from iccbrdf.brdf.geometry import Array
from iccbrdf.report.appearance import MEASURED, Appearance, mean
from iccbrdf.report.evaluation import INTERPOLATED, MODELS_2020, OPTIMISED, Evaluation
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
    """Draw an evaluation: PNG files by name, as in `PICTURES`."""
    return {name: draw(evaluation) for name, draw in PICTURES.items()}


def _test_patch(model: str, which: str, evaluation: Evaluation) -> bytes:
    """The patch without K whose specular Y, as interpolated, has the median or the worst RMSD."""
    tests = evaluation.models[model].tests
    return _panels(tests, _chosen(by_rmsd(tests, INTERPOLATED), which), f"{MODEL_NAMES[model]}, {which}")


def _primary(model: str, evaluation: Evaluation) -> bytes:
    """The primary whose specular Y has the worst RMSD."""
    primaries = evaluation.models[model].primaries
    return _panels(primaries, by_rmsd(primaries, OPTIMISED)[-1], f"{MODEL_NAMES[model]}, worst primary")


def _slope(which: str, evaluation: Evaluation) -> bytes:
    """The patch on a slope with the median or the worst mean CIEDE2000 of AIB."""
    ordered = ranked([mean(patch) for patch in evaluation.slopes.differences("AIB")])
    return _panels(evaluation.slopes, _chosen(ordered, which), f"{which} of the slopes")


def _chosen(ordered: list[int], which: str) -> int:
    return ordered[-1] if which == "worst" else ordered[len(ordered) // 2]


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


def _chromaticities(model: str, evaluation: Evaluation) -> bytes:
    tests, name = evaluation.models[model].tests, MODEL_NAMES[model]
    figure = _figure(8, 4)
    for axes, region in zip(figure.subplots(1, 2), (REGIONS[0], REGIONS[-1]), strict=True):
        for source, marker in zip((MEASURED, *tests.computed), "o+x", strict=True):
            x, y = tests.chromaticity(source, region).T
            axes.plot(x, y, marker, fillstyle="none", label=source)
        axes.set(xlabel="x", ylabel="y", title=f"{name}, mean of {region} readings")
    axes.legend()
    return _png(figure)


def _histogram(evaluation: Evaluation) -> bytes:
    figure = _figure(6, 4)
    axes = figure.subplots()
    edges, *counts = histograms(evaluation.slopes).items()
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


PICTURES: dict[str, Callable[[Evaluation], bytes]] = {
    **{
        f"2020-{model}-{what}.png": draw
        for model in MODELS_2020
        for what, draw in (
            ("median", partial(_test_patch, model, "median")),
            ("worst", partial(_test_patch, model, "worst")),
            ("primary-worst", partial(_primary, model)),
            ("chromaticity", partial(_chromaticities, model)),
        )
    },
    "2023-median.png": partial(_slope, "median"),
    "2023-worst.png": partial(_slope, "worst"),
    "2023-histogram.png": _histogram,
}
"""What is drawn, by the name of the file."""
