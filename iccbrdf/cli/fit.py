"""iccbrdf fit: goniometric measurements -> primaries."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, get_args

import click
import numpy as np

from iccbrdf.brdf.fit import SOLVERS, STARTS, FitResult, fit
from iccbrdf.brdf.fit_diagnostics import REGIONS
from iccbrdf.brdf.fit_problem import Objective
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.models import MODELS
from iccbrdf.brdf.primaries import REFRACTIVE_INDEX, Primaries, Primary, write_primaries
from iccbrdf.cli.options import CHECK_FAILED, FiniteRange, emit, force_option, json_option, name_list
from iccbrdf.cli.progress import progress
from iccbrdf.errors import InputError, UsageError, nearest
from iccbrdf.files import check_target
from iccbrdf.measure import (
    Measurements,
    parse_declarations,
    read_declarations,
    read_measurements,
    report,
    report_text,
)

EPILOG = """
\b
Examples:
  iccbrdf simulate -o print
  iccbrdf fit print/primaries.csv -o primaries.json
  A table that does not say what its numbers are:
    iccbrdf fit table.csv -o primaries.json -d angles=degree -d view_angles=lamp \\
      -d quantity=reflectance -d scale=100 -d illuminant=D50 \\
      -d "observer=CIE 1931 2 Degree Standard Observer" -d columns.theta_i=Inc
  As the papers fit, and both solvers beside each other:
    iccbrdf fit print/primaries.csv -o published.json --objective mean-CIEDE2000 \\
      --solver nelder_mead --as-published --compare
"""

_OBJECTIVES = {objective.replace(" ", "-"): objective for objective in get_args(Objective)}
_MAX_ANGLE = 70.0
"""Degrees.  Beyond, a few readings at grazing angles decide a fit that is bad everywhere else."""
_STANDARD = "45:0"
"""The geometry, incidence and view in degrees, whose XYZ stand for a colour."""
_SAME_ANGLE = 0.5
"""Degrees within which a measured geometry is the standard one."""
_SCALES = (1.0, 1.25, 1.5, 2.0, 2.5, 4.0, 5.0, 10.0)
"""What a device value of 1 may stand for."""
_DIGITS = 7
"""Significant ones of the numbers that are written."""


@click.command("fit", epilog=EPILOG)
@click.argument("table", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path),
              help="The primaries file to write.")  # fmt: skip
@click.option("-d", "--declare", "declared", multiple=True, metavar="KEY=VALUE",
              help="What the table's numbers are; repeatable.")  # fmt: skip
@click.option("--declarations", type=click.Path(path_type=Path), help="The same in a TOML file.")
@click.option("--patches", metavar="NAMES", help="Fit these patches only, separated by commas.")
@click.option("--max-angle", type=FiniteRange(0, 90, min_open=True, max_open=True),
              default=_MAX_ANGLE, show_default=True,
              help="Leave out geometries further from the normal, in degrees.")  # fmt: skip
@click.option("--model", type=click.Choice(list(MODELS)), default="brdf1", show_default=True,
              help="The reflection model that is fitted.")  # fmt: skip
@click.option("--objective", type=click.Choice(list(_OBJECTIVES)), default="rms-CIEDE2000",
              show_default=True, help="What is minimised, over the geometries.")  # fmt: skip
@click.option("--solver", type=click.Choice(list(SOLVERS)), default="least_squares", show_default=True,
              help="Batched least squares, or Nelder-Mead as in the papers, which takes many times as "
              "long.")  # fmt: skip
@click.option("--compare", is_flag=True, help="Run the other solver too and show both.")
@click.option("--starts", type=click.IntRange(1), default=STARTS, show_default=True,
              help="Starts made from the data.")  # fmt: skip
@click.option("--refractive-index", "index", metavar="NUMBER|free",
              help="Of the coat, or free: the median of what fits the patches.  "
              f"[default: {REFRACTIVE_INDEX}]")  # fmt: skip
@click.option("--as-published", is_flag=True,
              help="Compare the model's I, cosine included, with the measured reflectance, as the papers "
              "do; by default the same quantity of both.")  # fmt: skip
@click.option("--repeat-scatter", type=FiniteRange(0), default=0.0, metavar="DE",
              help="Root mean square CIEDE2000 between repeated readings, taken off the lack of "
              "fit.")  # fmt: skip
@click.option("--strict", is_flag=True, help="Exit with 1 where a fit must not be trusted.")
@force_option
@json_option
def command(
    table: Path,
    output: Path,
    declared: tuple[str, ...],
    declarations: Path | None,
    patches: str | None,
    max_angle: float,
    model: str,
    objective: str,
    solver: str,
    compare: bool,
    starts: int,
    index: str | None,
    as_published: bool,
    repeat_scatter: float,
    strict: bool,
    force: bool,
    as_json: bool,
) -> None:
    """Fit a reflection model to each patch of TABLE, and say how far to trust it.

    TABLE holds goniometric measurements: CSV, TSV, CGATS or the Cornell text format.  What its numbers are is
    declared, never guessed, unless `iccbrdf simulate` wrote it.  Patches on slopes are left out.
    """
    check_target(output, overwrite=force)
    if index is not None and not MODELS[model].has_fresnel:
        raise UsageError(f"--refractive-index: {model} has none")
    declaration = read_declarations(declarations) if declarations else {}
    with progress(f"reading {table}"):
        measured = read_measurements(table, **{**declaration, **parse_declarations(declared)})
    measured = _selected(measured, name_list(patches) if patches is not None else None, max_angle)
    settings: dict[str, Any] = {
        "model": model,
        "objective": _OBJECTIVES[objective],
        "starts": starts,
        "refractive_index": _refractive_index(index),
        "repeat_scatter": repeat_scatter,
        "patches": measured.patches,
    }

    def fitted(**more: Any) -> FitResult:
        arrays = measured.XYZ, measured.light, measured.view, measured.white
        with progress(f"fitting {len(measured.patches)} patches in {measured.theta_i.size} geometries"):
            return fit(*arrays, **{"solver": solver, "as_published": as_published, **settings, **more})

    if settings["refractive_index"] == "free":
        # One coat covers the print, and a primaries file holds one index.
        settings["refractive_index"] = round(float(np.median(fitted().refractive_index)), 3)
    result = fitted()
    # The other way to compare, so that nobody takes one figure for the other.
    quantities = {as_published: result, not as_published: fitted(as_published=not as_published)}
    solvers = [result]
    if compare:
        other = next(name for name in SOLVERS if name != solver)
        solvers.append(fitted(solver=other))
    primaries = _primaries(measured, result)
    write_primaries(primaries, output, overwrite=force)

    flagged = [name for name, flags in zip(measured.patches, result.flags, strict=True) if flags]
    answer = {
        "table": report(measured),
        "model": model,
        "objective": result.objective,
        "solver": result.solver,
        "as_published": as_published,
        **({"refractive_index": primaries.refractive_index} if MODELS[model].has_fresnel else {}),
        "geometry": primaries.geometry,
        "encoding": dict(primaries.encoding),
        "patches": [_patch(name, result, p) for p, name in enumerate(measured.patches)],
        "quantities": {
            "as published" if published else "same quantity": _differences(each.mean_difference.T)
            for published, each in sorted(quantities.items())
        },
        "solvers": [_solver(each) for each in solvers],
        "flagged": flagged,
        "files": [str(output)],
    }
    text = [
        report_text(measured),
        "",
        *_text(answer),
        f"{len(flagged)} of {len(measured.patches)} fits must not be trusted"
        if flagged
        else "no fit is flagged",
        f"  -> {output}",
    ]
    emit(as_json, "iccbrdf.fit/1", answer, "\n".join(text))
    if strict and flagged:
        click.get_current_context().exit(CHECK_FAILED)


def _refractive_index(text: str | None) -> float | Literal["free"]:
    if text is None:
        return REFRACTIVE_INDEX
    if text == "free":
        return "free"
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"--refractive-index: found {text!r}, expected a number or 'free'") from None


def _selected(measured: Measurements, names: list[str] | None, max_angle: float) -> Measurements:
    """The flat patches with these names, in the geometries up to an angle."""
    for name in names or ():
        if name not in measured.patches:
            raise UsageError(f"--patches: no patch {name!r}: {nearest(name, measured.patches)}")
    flat = np.ones(len(measured.patches), bool) if measured.slopes is None else measured.slopes == 0
    wanted = np.array([names is None or name in names for name in measured.patches])
    if not (flat & wanted).any():
        raise InputError(f"{measured.source}: holds no patch on the flat, expected at least one")
    steep = np.maximum(measured.theta_i, np.abs(measured.theta_r)) > max_angle + 1e-6
    selected = measured.select(flat & wanted, ~steep)
    notes = [
        f"{count} {what} left out"
        for count, what in (
            (np.count_nonzero(wanted & ~flat), "patches on slopes"),
            (np.count_nonzero(steep), f"geometries beyond {max_angle:g} degrees"),
        )
        if count
    ]
    return replace(selected, notes=(*selected.notes, *notes))


def _primaries(measured: Measurements, result: FitResult) -> Primaries:
    model = MODELS[result.model]
    row, geometry = _near_standard(measured)
    entries = []
    for p, name in enumerate(measured.patches):
        XYZ = measured.XYZ[p, row]
        if not np.all(XYZ > 0):
            raise InputError(
                f"{measured.source}: {name}: XYZ at {geometry} is {XYZ.tolist()}, expected numbers above 0"
            )
        cmyk = None if measured.cmyk is None else tuple(measured.cmyk[p].tolist())
        entries.append(Primary(name, _rounded(XYZ), _rounded(result.parameters[p]), cmyk))
    # A parameter at its bound is the bound once rounded, and may lie beyond it by a last digit before.
    rounded = np.array([entry.parameters for entry in entries])
    largest = [float(family.max()) for family in model.split(rounded)]
    encoding = {
        family: next(scale for scale in _SCALES if peak <= scale)
        for (family, _), peak in zip(model.parameters, largest, strict=True)
    }
    way = "I as published" if result.as_published else "the same quantity"
    return Primaries(
        model=result.model,
        illuminant=measured.illuminant,
        observer=measured.observer,
        white=measured.white,
        geometry=geometry,
        source=f"{measured.source.rstrip('.')}. Fitted: {result.objective} of {way}, {result.solver}.",
        primaries=tuple(entries),
        encoding=encoding,
        refractive_index=float(result.refractive_index[0]) if model.has_fresnel else REFRACTIVE_INDEX,
    )


def _near_standard(measured: Measurements) -> tuple[int, str]:
    """The geometry nearest to 45:0 in which every patch was measured, and its name."""
    everywhere = np.flatnonzero(np.isfinite(measured.XYZ).all(axis=(0, 2)))
    if not everywhere.size:
        raise InputError(f"{measured.source}: there is no geometry in which every patch was measured")
    theta_i, theta_r = measured.theta_i[everywhere], np.abs(measured.theta_r[everywhere])
    away = np.hypot(theta_i - 45, theta_r)
    row = int(everywhere[np.argmin(away)])
    if away.min() <= _SAME_ANGLE:
        return row, _STANDARD
    name = f"{measured.theta_i[row]:.4g}:{measured.theta_r[row]:.4g}"
    turned = f", phi {measured.phi[row]:.4g}" if not measured.in_plane[row] else ""
    return row, f"{name}{turned}, the measured geometry nearest to {_STANDARD}"


def _rounded(values: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.{_DIGITS}g}") for value in values)


def _number(value: float) -> float | None:
    """A number as JSON has them: there is no NaN."""
    return float(value) if np.isfinite(value) else None


def _differences(regions: Array) -> dict[str, float | None]:
    """Mean over the patches in each region, from (3, p)."""
    means = (values[np.isfinite(values)] for values in regions)
    return {
        region: float(values.mean()) if values.size else None
        for region, values in zip(REGIONS, means, strict=True)
    }


def _solver(result: FitResult) -> dict[str, Any]:
    return {
        "solver": result.solver,
        "seconds": result.seconds,
        result.objective: float(result.value.mean()),
        "starts_agree": float(result.agreement.mean()),
    }


def _patch(name: str, result: FitResult, p: int) -> dict[str, Any]:
    model = MODELS[result.model]
    return {
        "name": name,
        "parameters": dict(zip(model.channels, result.parameters[p].tolist(), strict=True)),
        "intervals": {
            channel: [_number(end) for end in ends]
            for channel, ends in zip(result.names, result.intervals[p], strict=True)
        },
        "geometries": int(result.geometries[p]),
        "objective": float(result.value[p]),
        "mean_CIEDE2000": _differences(result.mean_difference[p, :, np.newaxis]),
        "max_CIEDE2000": _differences(result.max_difference[p, :, np.newaxis]),
        "lack_of_fit": float(result.lack_of_fit[p]),
        "starts_agree": float(result.agreement[p]),
        "findings": [
            {
                "check": finding.check.name,
                "meaning": finding.detail or finding.check.meaning,
                "value": finding.value,
                "limit": finding.check.limit,
                "flagged": finding.flagged,
            }
            for finding in result.findings[p]
        ],
        "flags": [str(finding) for finding in result.flags[p]],
    }


def _text(answer: dict[str, Any]) -> list[str]:
    """The answer as lines for people."""
    index = f", refractive index {answer['refractive_index']:g}" if "refractive_index" in answer else ""
    width = max(len(patch["name"]) for patch in answer["patches"])
    how = f"{answer['model']}, {answer['objective']}, {answer['solver']}{index}"
    lines = [f"{how}; XYZ at {answer['geometry']}"]
    for patch in answer["patches"]:
        lines.append(f"{patch['name']:<{width}}  {_shown_parameters(patch)}")
        lines.append(
            f"{'':{width}}  {answer['objective']} {patch['objective']:.3f}, lack of fit "
            f"{patch['lack_of_fit']:.3f}; CIEDE2000 mean/max: {_shown_regions(patch)}"
        )
        lines += [f"{'':{width}}  FLAG {flag}" for flag in patch["flags"]]
        untested = [found["check"] for found in patch["findings"] if found["value"] is None]
        if untested:
            lines.append(f"{'':{width}}  not tested: {', '.join(untested)}")
    lines.append("")
    for name, means in answer["quantities"].items():
        shown = ", ".join(
            f"{region} {'none' if mean is None else f'{mean:.2f}'}" for region, mean in means.items()
        )
        lines.append(f"{name:<13}  mean CIEDE2000 {shown}")
    for solver in answer["solvers"]:
        lines.append(
            f"{solver['solver']:<13}  {solver['seconds']:.2f} s, {answer['objective']} "
            f"{solver[answer['objective']]:.4f}, {solver['starts_agree']:.0%} of the starts reach the best"
        )
    scales = ", ".join(f"{family} {scale:g}" for family, scale in answer["encoding"].items())
    lines.append(f"encoding       a device value of 1 stands for {scales}")
    return lines


def _shown_parameters(patch: dict[str, Any]) -> str:
    """Parameters with the half width of their intervals in per cent."""
    shown = []
    for name, value in patch["parameters"].items():
        low, high = patch["intervals"][name]
        reach = f"±{50 * (high - low) / value:.0f}%" if low is not None and high is not None else "(bound)"
        shown.append(f"{name} {value:.4g}{reach}")
    return "  ".join(shown)


def _shown_regions(patch: dict[str, Any]) -> str:
    return ", ".join(
        f"{region} none" if mean is None else f"{region} {mean:.2f}/{patch['max_CIEDE2000'][region]:.2f}"
        for region, mean in patch["mean_CIEDE2000"].items()
    )
