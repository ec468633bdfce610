"""The costs of ways as tables, for a terminal and for a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from iccbrdf.report.cost import BACKEND_PIXELS, CostReport, Statistic, pareto
from iccbrdf.report.cost_scene import REGIONS

COLUMNS = (
    "way", "ns/pixel", "x exact", "x fastest", "mean", "95 %", "max",
    *(f"max {region}" for region in REGIONS), "above 1", "bytes", "operators", "by",
)  # fmt: skip

BACKEND_COLUMNS = ("back end", "ns/pixel", "max to exact", "max to the first")


def text(report: CostReport) -> str:
    """For a terminal."""
    return "\n".join([*notes(report), "", *_aligned(rows(report)), "", *_aligned(backend_rows(report))])


def markdown(report: CostReport) -> str:
    """For a page."""
    blocks = ("\n".join(_piped(table)) for table in (rows(report), backend_rows(report)))
    return "\n\n".join(["\n".join(f"- {note}" for note in notes(report)), *blocks]) + "\n"


def notes(report: CostReport) -> Iterator[str]:
    """What the tables are of."""
    scene = report.scene
    height, width = scene.size
    sample = f"a sample of {scene.pixels} pixels in {len(scene.places)} tiles"
    part = "all of it measured" if scene.is_whole else sample
    model = scene.recipe.primaries.model
    method = f", {scene.recipe.interpolation} interpolation" if scene.is_colour else ""
    if scene.is_colour and scene.recipe.slopes is not None:
        method += f", {scene.recipe.slope_method} slope adjustment"
    yield f"Image of {width} x {height} pixels, {part}"
    yield f"Exact is the float64 reference of what was asked for: {model}{method}"
    yield "Errors are CIEDE2000 to it; * marks other answers, which differ and do not err"
    yield "Specular: normals whose angle to the half vector has a tangent up to m; near-specular: up to 3 m"
    yield f"Times: one thread, in memory, medians of {report.runs} runs in turns; + marks the Pareto front"
    if report.backends:
        yield f"Back ends: on {BACKEND_PIXELS} pixels at most, so few that the start of a run shows"


def rows(report: CostReport, statistic: Statistic = "max") -> list[tuple[str, ...]]:
    """The head and a row for each way."""
    front = pareto(report.costs, statistic)
    table = [COLUMNS]
    for cost in report.costs:
        to_reference, to_fastest = report.ratios(cost)
        mark = ("+" if cost in front else "") + ("" if cost.way.same_answer else "*")
        table.append(
            (
                f"{cost.way.name} {mark}".strip(),
                _three(cost.ns),
                "-" if to_reference is None else _three(to_reference),
                _three(to_fastest),
                *(_three(value) for value in (cost.errors.mean, cost.errors.p95, cost.errors.max)),
                *(_three(cost.by_region[region].max) for region in REGIONS),
                f"{cost.noticed:.2%}",
                str(cost.profile_bytes) if cost.profile_bytes else "-",
                "-" if cost.operators is None else f"{cost.operators:.0f}",
                cost.backend,
            )
        )
    return table


def backend_rows(report: CostReport) -> list[tuple[str, ...]]:
    """The head and a row for each back end: the axis that changes times and not colours."""
    return [
        BACKEND_COLUMNS,
        *((b.name, _three(b.ns), _three(b.max_error), _three(b.from_first)) for b in report.backends),
    ]


def _three(value: float) -> str:
    """Three digits."""
    if np.isnan(value):
        return "-"
    if value == 0:
        return "0"
    if abs(value) < 1e-3:
        return f"{value:.1e}"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def _aligned(table: Sequence[tuple[str, ...]]) -> Iterator[str]:
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for first, *others in table:
        cells = (f"{cell:>{width}}" for cell, width in zip(others, widths[1:], strict=True))
        yield "  ".join([f"{first:<{widths[0]}}", *cells])


def _piped(table: Sequence[tuple[str, ...]]) -> Iterator[str]:
    head, *others = table
    yield f"| {' | '.join(head)} |"
    yield f"|---|{'---:|' * (len(head) - 1)}"
    for row in others:
        yield f"| {' | '.join(cell.replace('*', chr(92) + '*') for cell in row)} |"
