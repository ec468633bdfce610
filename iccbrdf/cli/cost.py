"""iccbrdf cost: what accuracy costs in time, on an image of one's own."""

from __future__ import annotations

import json
import os
import platform
import sys
from pathlib import Path
from typing import Any

import click

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import INTERPOLATIONS, SLOPE_METHODS
from iccbrdf.build.recipe import Recipe
from iccbrdf.cli.options import (
    CHECK_FAILED,
    FiniteRange,
    emit,
    environment,
    force_option,
    json_option,
    name_list,
    scene_options,
)
from iccbrdf.cli.pipeline import open_image
from iccbrdf.errors import UsageError, nearest
from iccbrdf.files import as_text, check_target, make_folder, write_together
from iccbrdf.images import Samples
from iccbrdf.planning import Planning
from iccbrdf.report.cost import RUNS, STATISTICS, Cost, CostReport, Statistic, measure_image, recommend
from iccbrdf.report.cost_plots import plot_errors, plot_front
from iccbrdf.report.cost_scene import PIXELS
from iccbrdf.report.cost_tables import markdown, text
from iccbrdf.report.cost_ways import PLAIN

SCHEMA = "iccbrdf.cost/1"
BUDGET = 1.0
"""CIEDE2000, where nothing else is asked for."""

EPILOG = """
\b
Examples:
  iccbrdf cost relief.tif --primaries primaries.json --light 50,180 -o cost
  From XYZ and normals, the most accurate way in 50 nanoseconds a pixel:
  iccbrdf cost xyzn.tif --primaries primaries.json --slopes slopes.json --time 50 -o cost
  Then make the profiles of the cheapest way within a budget:
  iccbrdf build primaries.json -o out --for relief.tif --light 50,180 --budget 0.5
"""


@click.command("cost", epilog=EPILOG)
@click.argument("image", type=click.Path(path_type=Path))
@click.option("--primaries", required=True, type=click.Path(path_type=Path),
              help="The primaries file that the profiles are made of.")  # fmt: skip
@click.option("--slopes", type=click.Path(path_type=Path), help="The slopes file, for an image of XYZ.")
@click.option("--slope-method", type=click.Choice(SLOPE_METHODS), default="affine", show_default=True,
              help="From the flat colour to the one on a slope: continuous, or as published.")  # fmt: skip
@click.option("--interpolation", type=click.Choice(INTERPOLATIONS), default="smooth", show_default=True,
              help="The method whose float64 result is exact, for an image of XYZ.")  # fmt: skip
@click.option("--samples", type=click.Choice(("device", "real")),
              help="What a float image holds, where it does not say so itself.")  # fmt: skip
@click.option("--channels", metavar="NAMES",
              help="Names of the image's channels, separated by commas, where it does not say them."
              )  # fmt: skip
@click.option("-o", "--output", "folder", required=True, type=click.Path(path_type=Path, file_okay=False),
              help="Folder for the table, its numbers and the pictures; made if need be.")  # fmt: skip
@click.option("--budget", type=FiniteRange(min=0), metavar="DE",
              help="Recommend the cheapest way within this CIEDE2000.  "
              f"Default: {BUDGET:g}, unless --time is given.")  # fmt: skip
@click.option("--time", "ns", type=FiniteRange(min=0, min_open=True), metavar="NS",
              help="Recommend the most accurate way within so many nanoseconds a pixel.")  # fmt: skip
@click.option("--by", "statistic", type=click.Choice(STATISTICS), default="max", show_default=True,
              help="Which error of the pixels counts: the largest, the 95 % point, or the mean.")  # fmt: skip
@click.option("--show", "shown", metavar="WAY",
              help="Draw the errors of this way, named as in the table.  Default: of the recommended one, or "
              "of float32.")  # fmt: skip
@click.option("--pixels", type=click.IntRange(1), default=PIXELS, show_default=True,
              help="Of a larger image, a sample of tiles with so many pixels is measured.")  # fmt: skip
@click.option("--runs", type=click.IntRange(1), default=RUNS, show_default=True,
              help="Of each way; the time is their median.")  # fmt: skip
@scene_options
@force_option
@json_option
def command(
    image: Path,
    primaries: Path,
    slopes: Path | None,
    slope_method: str,
    interpolation: str,
    samples: Samples | None,
    channels: str | None,
    folder: Path,
    budget: float | None,
    ns: float | None,
    statistic: Statistic,
    shown: str | None,
    pixels: int,
    runs: int,
    light: str | None,
    view: str | None,
    env: tuple[str, ...],
    force: bool,
    as_json: bool,
) -> None:
    """Measure ways to the proof of IMAGE: how long they take and how far they are from the exact one.

    IMAGE is one for `iccbrdf apply`, of XYZ and normals or of BRDF parameters.

    \b
    cost.json, cost.md  the numbers, and the table of them
    cost.png            time against error
    cost_errors.png     where a way errs, and its worst tiles

    Exit code 1 says that no way is within the budget.
    """
    if budget is not None and ns is not None:
        raise UsageError("--budget and --time are two limits: give one of them")
    if budget is None and ns is None:
        budget = BUDGET
    recipe = Recipe(
        read_primaries(primaries),
        read_slopes(slopes) if slopes is not None else None,
        interpolation,
        slope_method,
    )
    targets = {name: folder / name for name in ("cost.json", "cost.md", "cost.png", "cost_errors.png")}
    if folder.exists():
        for target in targets.values():
            check_target(target, overwrite=force)
    declared = name_list(channels) if channels is not None else None
    with open_image(image, samples) as source:
        planning = Planning(source, recipe, declared)
        make_folder(folder)
        report = measure_image(
            planning, environment(light, view, env), pixels=pixels, runs=runs, told=_progress()
        )
    best = recommend(report.costs, budget=budget, ns=ns, statistic=statistic)
    result = {
        "file": str(image),
        "primaries": str(primaries),
        "machine": machine(),
        **report.to_dict(),
        "limit": {"delta_E_CIE2000": budget, "ns_per_pixel": ns, "statistic": statistic},
        "recommended": None if best is None else {"name": best.way.name, "advice": best.way.advice},
        "files": [str(target) for target in targets.values()],
    }
    contents = {
        "cost.json": (json.dumps({"schema": SCHEMA, **result}, indent=1) + "\n").encode(),
        "cost.md": markdown(report).encode(),
        **pictures(report, image.name, best, budget, shown),
    }
    write_together({targets[name]: data for name, data in contents.items()}, overwrite=force)
    lines = [
        f"{image}:",
        text(report),
        "",
        _advice(best, budget, ns, statistic),
        *(f"  -> {target}" for target in targets.values()),
    ]
    emit(as_json, SCHEMA, result, "\n".join(lines))
    if best is None:
        click.get_current_context().exit(CHECK_FAILED)


def cheapest(
    image: Path, recipe: Recipe, budget: float, samples: Samples | None, channels: str | None
) -> Cost:
    """The quickest of the ways that are a matter of profiles alone whose errors are all within a budget.

    Raises UsageError where there is none.
    """
    with open_image(image, samples) as source:
        planning = Planning(source, recipe, name_list(channels) if channels is not None else None)
        report = measure_image(
            planning, recipe.variables, only=lambda way: way.is_built, backends=(), told=_progress()
        )
    best = recommend(report.costs, budget=budget)
    if best is None:
        least = min(report.costs, key=lambda cost: cost.errors.max)
        raise UsageError(
            f"--budget {budget:g}: no profiles are within it; nearest is {least.way.name} "
            f"with {least.errors.max:.2g}"
        )
    return best


def pictures(
    report: CostReport, title: str, best: Cost | None, budget: float | None, shown: str | None = None
) -> dict[str, bytes]:
    """The pictures of a report by the names of their files; `shown` names the way whose errors are drawn.

    Raises UsageError where there is no such way.
    """
    by_name = {cost.way.name: cost for cost in report.costs}
    name = shown or (best.way if best else PLAIN).name
    if name not in by_name:
        raise UsageError(f"--show: no way {name!r} was measured: {nearest(name, by_name)}")
    heading = f"Ways to the proof of {as_text(title)}"
    return {
        "cost.png": plot_front(report, title=heading, recommended=best, budget=budget),
        "cost_errors.png": plot_errors(report, by_name[name]),
    }


def machine() -> str:
    """What the times are those of."""
    return f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"


def _advice(best: Cost | None, budget: float | None, ns: float | None, statistic: Statistic) -> str:
    limit = f"{statistic} CIEDE2000 {budget:g}" if budget is not None else f"{ns:g} ns a pixel"
    if best is None:
        return f"no way is within {limit}"
    return (
        f"within {limit}: {best.way.name}, {best.ns:.3g} ns a pixel, {statistic} CIEDE2000 "
        f"{best.error(statistic):.2g}\n  {best.way.advice}"
    )


def _progress() -> Any:
    """Tells the name of the way that is made ready where stderr is a terminal."""
    if not sys.stderr.isatty():
        return lambda name: None
    return lambda name: click.echo(f"  {name}", err=True)
