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

Panel = tuple[str, NDArray[np.float32], dict[str, Any]]
"""A name, a picture and how it is coloured."""

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
    """Time a pixel against error, both logarithmic, with the Pareto front.

    The marker of a way stands at its largest error; a line goes down to the mean.
    """
    figure = _figure(10, 7)
    axes = figure.subplots()
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="time, nanoseconds a pixel (one thread)",
        ylabel="error, CIEDE2000 (marker: largest; line down to the mean)",
        title=title,
    )
    front = pareto(report.costs)
    heights = [_height(cost, "max") for cost in front]
    axes.step([cost.ns for cost in front], heights, "k", where="post", linewidth=1.2, label="Pareto front")
    seen: set[str] = set()
    for cost in report.costs:
        marker, colour = _STYLES[cost.way.axis]
        low, high = _height(cost, "mean"), _height(cost, "max")
        axes.plot([cost.ns, cost.ns], [low, high], color=colour, linewidth=0.8, alpha=0.5)
        axes.plot(
            cost.ns,
            high,
            marker,
            color=colour,
            label=None if cost.way.axis in seen else _legend(cost),
            markersize=10 if marker == "*" else 7,
            markerfacecolor=colour if cost.way.same_answer else "none",
            zorder=3,
        )
        seen.add(cost.way.axis)
    if recommended is not None:
        height = _height(recommended, "max")
        axes.plot(recommended.ns, height, "o", color="black", markersize=15, markerfacecolor="none",
                  label="recommended")  # fmt: skip
    if budget is not None:
        axes.axhline(budget, color="black", linestyle=":", linewidth=0.8)
        axes.annotate(f"budget {budget:g} ", (1, budget), xycoords=("axes fraction", "data"),
                      horizontalalignment="right", verticalalignment="bottom", fontsize=8)  # fmt: skip
    _widen(axes, report.costs)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.09), ncols=5, frameon=False)
    figure.subplots_adjust(left=0.09, right=0.97, bottom=0.16, top=0.95)
    _label(figure, axes, report.costs, front)
    return _png(figure)


def _legend(cost: Cost) -> str:
    return cost.way.axis if cost.way.same_answer else f"{cost.way.axis} (another answer)"


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
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5},
            )


def plot_errors(report: CostReport, cost: Cost) -> bytes:
    """Where one way errs: the exact proof, the errors in false colours, and the worst tiles of both."""
    # Takes a second to import.
    from matplotlib.colors import PowerNorm

    scene = report.scene
    down, across = cost.dE.shape[1:]
    worst = _worst(report, cost)
    # By roots: large errors are few, and the small ones beside them shall be seen.
    norm = PowerNorm(0.5, 0, max(float(cost.dE.max()), _FLOOR))
    colours: dict[str, Any] = {"cmap": "inferno", "norm": norm, "interpolation": "nearest"}
    figure = _figure(12, 9.6)
    grid = figure.add_gridspec(4, WORST, height_ratios=(6, 1.15, 1.15, 1.15), hspace=0.14, wspace=0.06,
                               left=0.04, right=0.93, bottom=0.02, top=0.95)  # fmt: skip
    height, width = scene.size
    exact = _as_seen(report, scene.exact(scene.tiles))
    note = "" if scene.is_whole else " (grey: not in the sample)"
    halves: tuple[Panel, ...] = (
        (f"exact proof{note}", _spread(report, exact), {}),
        (f"{cost.way.name}: CIEDE2000 to it", _spread(report, cost.dE), colours),
    )
    overviews = []
    for i, (title, picture, how) in enumerate(halves):
        axes = figure.add_subplot(grid[0, i * WORST // 2 : (i + 1) * WORST // 2])
        shown = axes.imshow(picture, extent=(0, width, height, 0), **how)
        axes.set(title=title, xticks=[], yticks=[], facecolor="0.6")
        overviews.append(axes)
    figure.colorbar(shown, cax=overviews[-1].inset_axes((1.02, 0, 0.03, 1)))
    found = _as_seen(report, cost.proof(scene.tiles[worst]))
    for j, tile in enumerate(worst):
        y, x = scene.places[tile]
        for axes in overviews:
            axes.add_patch(_rectangle(x, y, across, down))
            axes.annotate(str(j + 1), (x + across, y), color="cyan", fontsize=8, verticalalignment="top")
        rows: tuple[Panel, ...] = (
            ("exact", exact[tile], {}),
            ("this way", found[j], {}),
            ("error", cost.dE[tile], colours),
        )
        for i, (name, picture, how) in enumerate(rows):
            axes = figure.add_subplot(grid[i + 1, j])
            axes.imshow(picture, **{"interpolation": "nearest", **how})
            axes.set(xticks=[], yticks=[], ylabel=name if j == 0 else "")
            if i == 0:
                axes.set_title(f"{j + 1}: {cost.dE[tile].max():.2g}", fontsize=8)
    return _png(figure)


def _worst(report: CostReport, cost: Cost) -> list[int]:
    """The tiles with the largest errors, none of which overlaps another."""
    down, across = cost.dE.shape[1:]
    places = report.scene.places
    chosen: list[int] = []
    for tile in np.argsort(-cost.dE.max(axis=(1, 2)), kind="stable"):
        y, x = places[tile]
        if all(abs(y - places[i][0]) >= down or abs(x - places[i][1]) >= across for i in chosen):
            chosen.append(int(tile))
    return chosen[:WORST]


def _spread(report: CostReport, tiles: NDArray[np.float32]) -> NDArray[np.float32]:
    """Tiles (n, height, width, ...) where they lie in a picture of the image, NaN elsewhere.

    It is a smaller one where the image is large; the largest value counts that falls on a pixel.
    """
    scene = report.scene
    step = max(1, -(-max(scene.size) // _LONGEST_SIDE))
    shape = [-(-length // step) for length in scene.size]
    picture = np.full((*shape, *tiles.shape[3:]), np.nan, np.float32)
    down, across = (np.arange(length) for length in tiles.shape[1:3])
    for (y, x), tile in zip(scene.places, tiles, strict=True):
        rows, columns = np.meshgrid((y + down) // step, (x + across) // step, indexing="ij")
        np.fmax.at(picture, (rows, columns), tile)
    return picture


def _as_seen(report: CostReport, XYZ: Array) -> NDArray[np.float32]:
    """XYZ (n, height, width, 3) in sRGB, clipped."""
    to_display = standard_XYZ(report.scene.pair.mvis)
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
