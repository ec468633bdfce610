"""Costs as pictures, PNG: time against error, and where in the image the errors are."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import Array
from iccbrdf.cmm import standard_XYZ
from iccbrdf.images.display import xyz_to_srgb
from iccbrdf.report.cost import Cost, CostReport, Statistic, pareto

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORST = 10
"""Tiles that are shown."""

_DPI = 110
_FLOOR = 1e-6
"""CIEDE2000 at which errors of nothing are drawn, as logarithms have no 0."""
_STYLES = {
    "number type": ("o", "tab:blue"),
    "effects": ("D", "tab:green"),
    "interpolation": ("P", "tab:gray"),
    "tables": ("s", "tab:orange"),
    "model": ("X", "tab:gray"),
    "formulas": ("^", "tab:purple"),
    "output": ("v", "tab:red"),
    "resolution": ("*", "tab:brown"),
}
"""Marker and colour by `Way.axis`."""
_AROUND = (
    (1, 0, "left"), (-1, 0, "right"), (0.7, 0.7, "left"), (0.7, -0.7, "left"),
    (-0.7, 0.7, "right"), (-0.7, -0.7, "right"), (0, 1.2, "center"), (0, -1.2, "center"),
)  # fmt: skip
"""Where a name may stand, in units of its distance, and how it is aligned there."""

_LONGEST_SIDE = 900
"""Of the map, in its pixels."""


def plot_front(
    report: CostReport, *, title: str, recommended: Cost | None, budget: float | None = None
) -> bytes:
    """Time a pixel against the largest error, both logarithmic, with the Pareto front.

    A line goes from each way's mean error to its largest.
    """
    figure = _figure(10, 6.4)
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log", xlabel="nanoseconds a pixel (one thread)",
             ylabel="error, CIEDE2000: mean to largest", title=title)  # fmt: skip
    front = pareto(report.costs)
    axes.step([c.ns for c in front], [_height(c, "max") for c in front], where="post", color="black",
              linewidth=1.2, label="Pareto front: nothing is both faster and nearer", zorder=1)  # fmt: skip
    seen: set[str] = set()
    for cost in report.costs:
        marker, colour = _STYLES[cost.way.axis]
        label = None if cost.way.axis in seen else cost.way.axis
        seen.add(cost.way.axis)
        low, high = _height(cost, "mean"), _height(cost, "max")
        axes.plot([cost.ns, cost.ns], [low, high], color=colour, linewidth=0.8, alpha=0.5, zorder=1)
        axes.plot(cost.ns, high, marker, color=colour, label=label, markersize=9 if marker == "*" else 7,
                  markerfacecolor=colour if cost.way.same_answer else "none", zorder=3)  # fmt: skip
    if recommended is not None:
        axes.plot(recommended.ns, _height(recommended, "max"), "o", markersize=16, markerfacecolor="none",
                  markeredgecolor="black", label="recommended", zorder=2)  # fmt: skip
    if budget is not None:
        axes.axhline(budget, color="black", linestyle=":", linewidth=0.8)
        axes.annotate(f"budget {budget:g}", (1, budget), xycoords=("axes fraction", "data"), ha="right",
                      va="bottom", fontsize=8)  # fmt: skip
    _widen(axes, report.costs)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    figure.subplots_adjust(left=0.08, right=0.78, bottom=0.09, top=0.93)
    _label(figure, axes, report.costs, front)
    return _png(figure)


def _height(cost: Cost, statistic: Statistic) -> float:
    return max(cost.error(statistic), _FLOOR)


def _widen(axes: Axes, costs: Sequence[Cost]) -> None:
    """Limits with room for the labels; the lowest line stands for 0."""
    times = [cost.ns for cost in costs]
    axes.set_xlim(min(times) / 1.6, max(times) * 2.5)
    axes.set_ylim(_FLOOR / 1.8, max(10.0, *(_height(cost, "max") * 2 for cost in costs)))
    axes.grid(alpha=0.25, which="major")
    ticks = [10.0**power for power in range(-6, 2)]
    axes.set_yticks(ticks, ["0" if tick == _FLOOR else f"{tick:g}" for tick in ticks])


def _label(figure: Figure, axes: Axes, costs: Sequence[Cost], front: Sequence[Cost]) -> None:
    """Names beside the markers, those of the front first, where they hide the least."""
    canvas: Any = figure.canvas
    renderer = canvas.get_renderer()
    points = axes.transData.transform([(cost.ns, _height(cost, "max")) for cost in costs])
    taken: list[Any] = []

    def hidden(box: Any) -> int:
        names = sum(bool(box.overlaps(other)) for other in taken)
        x, y = points.T
        markers = (box.x0 - 4 < x) & (x < box.x1 + 4) & (box.y0 - 4 < y) & (y < box.y1 + 4)
        frame = axes.bbox
        beyond = box.x0 < frame.x0 or box.x1 > frame.x1 or box.y0 < frame.y0 or box.y1 > frame.y1
        return names + int(markers.sum()) + 5 * bool(beyond)

    for cost in sorted(costs, key=lambda cost: cost not in front):
        best: tuple[int, Any] | None = None
        for text in _names_around(axes, cost, is_bold=cost in front):
            hides = hidden(text.get_window_extent(renderer))
            if best is None or hides < best[0]:
                if best is not None:
                    best[1].remove()
                best = hides, text
            else:
                text.remove()
            if not best[0]:
                break
        if best is not None:
            taken.append(best[1].get_window_extent(renderer))


def _names_around(axes: Axes, cost: Cost, *, is_bold: bool) -> Iterator[Any]:
    """The name of a way, drawn at one place after the other, farther and farther from its marker."""
    for distance in (8, 16, 26, 38, 52, 68, 90):
        line = {"arrowstyle": "-", "color": "0.7", "linewidth": 0.5} if distance > 8 else None
        for dx, dy, alignment in _AROUND:
            yield axes.annotate(
                cost.way.name,
                (cost.ns, _height(cost, "max")),
                (dx * distance, dy * distance),
                textcoords="offset points",
                horizontalalignment=alignment,
                verticalalignment="center",
                fontsize=8 if is_bold else 7,
                fontweight="bold" if is_bold else "normal",
                color="black" if is_bold else "0.3",
                arrowprops=line,
            )


def plot_errors(report: CostReport, cost: Cost) -> bytes:
    """Where one way errs: a map in false colours, and the worst tiles, exact, by the way, and the error."""
    scene = report.scene
    worst = np.argsort(-cost.dE.max(axis=(1, 2)), kind="stable")[:WORST]
    largest = max(float(cost.dE.max()), 1e-9)
    figure = _figure(12, 9.5)
    grid = figure.add_gridspec(4, WORST, height_ratios=(6, 1, 1, 1), hspace=0.08, wspace=0.06,
                               left=0.06, right=0.93, bottom=0.02, top=0.94)  # fmt: skip
    overview = figure.add_subplot(grid[0, :])
    colours: dict[str, Any] = {"cmap": "inferno", "vmin": 0, "vmax": largest, "interpolation": "nearest"}
    height, width = scene.size
    shown = overview.imshow(_map(report, cost.dE), extent=(0, width, height, 0), **colours)
    overview.set_facecolor("0.6")
    sampled = "" if scene.is_whole else "; grey: not in the sample"
    overview.set_title(f"{cost.way.name}: CIEDE2000 to the exact proof{sampled}")
    figure.colorbar(shown, ax=overview, fraction=0.03, pad=0.01)
    exact = scene.exact(scene.tiles[worst])
    proofs = [_as_seen(report, XYZ) for XYZ in (exact, cost.proof(scene.tiles[worst]))]
    down, across = cost.dE.shape[1:]
    for j, tile in enumerate(worst):
        y, x = scene.places[tile]
        overview.add_patch(_rectangle(x, y, across, down))
        overview.annotate(str(j + 1), (x + across, y), color="cyan", fontsize=8, va="top")
        pictures = (proofs[0][j], proofs[1][j], cost.dE[tile])
        for i, (picture, name) in enumerate(zip(pictures, ("exact", "this way", "error"), strict=True)):
            axes = figure.add_subplot(grid[i + 1, j])
            axes.imshow(picture, **colours)
            axes.set(xticks=[], yticks=[])
            if j == 0:
                axes.set_ylabel(name)
            if i == 0:
                axes.set_title(f"{j + 1}: {cost.dE[tile].max():.2g}", fontsize=8)
    return _png(figure)


def _map(report: CostReport, dE: NDArray[np.float32]) -> NDArray[np.float32]:
    """A smaller picture of the largest error that falls on each of its pixels, NaN where none does."""
    scene = report.scene
    step = max(1, -(-max(scene.size) // _LONGEST_SIDE))
    picture = np.full([-(-length // step) for length in scene.size], np.nan, np.float32)
    down, across = (np.arange(length) for length in dE.shape[1:])
    for (y, x), tile in zip(scene.places, dE, strict=True):
        rows, columns = np.meshgrid((y + down) // step, (x + across) // step, indexing="ij")
        np.fmax.at(picture, (rows, columns), tile)
    return picture


def _as_seen(report: CostReport, XYZ: Array) -> NDArray[np.float32]:
    """XYZ (n, height, width, 3) in sRGB, clipped."""
    to_display = standard_XYZ(report.scene.recipe.pair().mvis)
    flat = to_display(XYZ.astype(np.float32)).reshape(1, -1, 3)
    return xyz_to_srgb(flat).clip(0, 1).reshape(XYZ.shape)


def _rectangle(x: float, y: float, width: float, height: float) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), width, height, fill=False, edgecolor="cyan", linewidth=0.8)


def _figure(width: float, height: float) -> Figure:
    # Takes a second to import.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=_DPI)
    FigureCanvasAgg(figure)
    return figure


def _png(figure: Figure) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()
