"""iccbrdf build: primaries -> profiles."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

import click

from iccbrdf.brdf.primaries import MIN_NODES, read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import GRIDS, INTERPOLATIONS, SLOPE_METHODS, ColourMid, build_tables
from iccbrdf.build.pair import FRESNEL_ANGLES, GEOMETRIES
from iccbrdf.build.recipe import Recipe
from iccbrdf.cli.options import (
    CHECK_FAILED,
    FiniteRange,
    emit,
    environment,
    force_option,
    json_option,
    name_list,
    plan_options,
    scene_options,
)
from iccbrdf.errors import UsageError
from iccbrdf.files import make_folder, write_together
from iccbrdf.images.record import Samples

ROUNDING = 1e-3
"""CIEDE2000 that float32 may make of nothing."""

EPILOG = """
\b
Examples:
  iccbrdf build profiles/fogra39_gloss/primaries.json -o out
  The colour MID, from XYZ and normals, with slope adjustment:
  iccbrdf build primaries.json -o out --slopes slopes.json
  The same as tables, for systems that run no calculator:
  iccbrdf build primaries.json -o out --table 33
  Only what an image calls for, under the light that it is for:
  iccbrdf build primaries.json -o out --for relief.tif --light 50,180 --tolerance 0.5
  The quickest profiles within a CIEDE2000 of the exact proof of an image:
  iccbrdf build primaries.json -o out --for relief.tif --light 50,180 --budget 0.5
  Without the Fresnel term, and with other defaults for light and view:
  iccbrdf build primaries.json -o out --without fresnel --light 60,90 --view 10,270
"""


@click.command("build", epilog=EPILOG)
@click.argument("primaries", type=click.Path(path_type=Path))
@click.option("-o", "--output", "folder", required=True, type=click.Path(path_type=Path, file_okay=False),
              help="Folder for the profiles and their listings; made if need be.")  # fmt: skip
@click.option("--slopes", type=click.Path(path_type=Path),
              help="A slopes file: the colour MID adjusts XYZ to the slope.")  # fmt: skip
@click.option("--slope-method", type=click.Choice(SLOPE_METHODS),
              help="affine (default): continuous, exact for white and black; or as published.")  # fmt: skip
@click.option("--interpolation", type=click.Choice(INTERPOLATIONS),
              help="Of the colour MID.  smooth (default): continuous in XYZ; or as published.")  # fmt: skip
@click.option("--p", type=click.FloatRange(1, 8), default=2.0, show_default=True,
              help="Published interpolation: norm of the distance of chromaticities.")  # fmt: skip
@click.option("--exponent", type=click.FloatRange(-4, 4), default=-1.0, show_default=True,
              help="Published interpolation: exponent of the distance as weight.  -1 (2020) gives near nodes "
              "more weight, 1 (printed in 2023) far ones.")  # fmt: skip
@click.option("--table", "grid", type=click.Choice([str(grid) for grid in GRIDS]),
              help="Also write the interpolation as tables of so many points an axis.")  # fmt: skip
@click.option("--effects", metavar="NAMES", help="Simulate these effects only, separated by commas.")
@click.option("--without", metavar="NAMES", help="Simulate all effects but these, separated by commas.")
@click.option("--for", "image", type=click.Path(path_type=Path),
              help="Simulate what this image calls for only, under --light or --lights and --view (see "
              "iccbrdf plan).")  # fmt: skip
@click.option("--budget", type=FiniteRange(min=0), metavar="DE",
              help="With --for, instead of --tolerance: the quickest profiles whose proof is within this "
              "CIEDE2000, as measured on the image (see iccbrdf cost).")  # fmt: skip
@plan_options
@click.option("--no-source", is_flag=True,
              help="Leave out of the profiles what they are made from (templates, settings, names), which "
              "iccbrdf dump shows and iccbrdf plan takes.  They are then half as large.")  # fmt: skip
@click.option("--fresnel-angle", type=click.Choice(FRESNEL_ANGLES),
              help="Angle of the Fresnel term: of incidence, as printed (the default), or between half "
              "vector and view, which keeps the model reciprocal.")  # fmt: skip
@click.option("--geometry", type=click.Choice(GEOMETRIES), default="plain", show_default=True,
              help="exact: float32 keeps the digits of cosines and half vector down to the horizon, by "
              "programs of three times the length, which few pixels need.")  # fmt: skip
@scene_options
@force_option
@json_option
def command(
    primaries: Path,
    folder: Path,
    slopes: Path | None,
    slope_method: str | None,
    interpolation: Literal["smooth", "published"] | None,
    p: float,
    exponent: float,
    grid: str | None,
    effects: str | None,
    without: str | None,
    image: Path | None,
    budget: float | None,
    lights: tuple[str, ...],
    tolerance: float,
    samples: Samples | None,
    channels: str | None,
    no_source: bool,
    fresnel_angle: str | None,
    geometry: Literal["plain", "exact"],
    light: str | None,
    view: str | None,
    env: tuple[str, ...],
    force: bool,
    as_json: bool,
) -> None:
    """Make profiles from PRIMARIES, a primaries file.

    \b
    mid.icc         the binding MID: a BRDF image, each parameter in 0..1
    mvis.icc        the MVIS: the model, light and view
    colour-mid.icc  the colour MID: XYZ of the flat print and normals; alone it gives the BRDF image
    table-mid.icc   with --table: the colour MID as a table
    table-v4.icc    with --table: the same for systems of ICC version 4, XYZ to parameters
    *.txt           listings of their programs, errors of the tables

    The colour MID interpolates between the primaries and needs four of them; without, it is left out.
    --light, --view and --env set the defaults that the profiles hold; whoever runs them may set others.
    With --for, the MID is that of the image's kind, and the bound of what is lost stands in the descriptions;
    the proof of the image is made both ways then, and exit code 1 says that the bound did not hold.
    --budget measures the full profiles, those of some tolerances and tables, and makes the quickest of them.
    """
    if effects is not None and without is not None:
        raise UsageError("--effects and --without are two ways to say one thing: give one of them")
    source = read_primaries(primaries)
    if slope_method is not None and slopes is None:
        raise UsageError("--slope-method needs --slopes, the measurements that it works with")
    recipe = Recipe(
        source,
        read_slopes(slopes) if slopes is not None else None,
        interpolation or "smooth",
        slope_method or "affine",
        p,
        exponent,
        fresnel_angle,
        geometry,
        environment(light, view, env),
        with_source=not no_source,
    )
    if image is None and (lights or tolerance or samples or channels or budget is not None):
        raise UsageError("--budget, --lights, --tolerance, --samples and --channels belong to --for")
    if image is not None and (effects is not None or without is not None or grid is not None):
        raise UsageError("--for chooses the effects: leave out --effects, --without and --table")
    measured: dict[str, Any] | None = None
    plan: dict[str, Any] | None = None
    plan_text: list[str] = []
    holds = True
    colour: ColourMid | None = None
    if image is not None and budget is not None:
        if lights or tolerance:
            raise UsageError("--budget is measured under one light: leave out --lights and --tolerance")
        # What measures is needed for this alone.
        from iccbrdf.cli.cost import cheapest

        best = cheapest(image, recipe, budget, samples, channels)
        measured = {"budget": budget, "way": best.way.name, "max_delta_E_CIE2000": best.errors.max}
        plan_text = [f"within {budget:g} for {image}: {best.way.name}, CIEDE2000 up to {best.errors.max:.2g}"]
        if best.way.tolerance is None:
            image, grid = None, None if best.way.grid is None else str(best.way.grid)
        else:
            tolerance = best.way.tolerance
    if image is not None:
        # Images and a CMM are needed for this alone.
        from iccbrdf.cli.plan import plan_lines, plan_result, planned

        found, check = planned(image, recipe, lights, tolerance, samples, channels)
        pair, colour = found.reduced.pair, found.reduced.colour
        plan = {"image": str(image), **plan_result(found, check)}
        plan_text += [f"for {image}:", *plan_lines(found, check)]
        promised = found.decision.bound if budget is None else min(found.decision.bound, budget)
        holds = check.dE <= max(promised, ROUNDING)
    else:
        only = name_list(effects) if effects is not None else None
        pair = recipe.pair(name_list(without or ""), effects=only)
        wanted = interpolation is not None or slopes is not None or grid is not None
        if wanted or len(source.primaries) >= MIN_NODES:
            colour = recipe.colour_mid(name_list(without or ""), effects=only)
    built = pair.files | (colour.files if colour else {})
    tables = None
    if grid is not None:
        if (p, exponent) != (2, -1):
            raise UsageError("--table holds the published interpolation with --p 2 and --exponent -1 only")
        tables = build_tables(
            source,
            method=interpolation or "smooth",
            grid=int(grid),
            slopes=recipe.slopes,
            slope_method=recipe.slope_method,
        )
        built |= tables.files
    make_folder(folder)
    files = {folder / name: data for name, data in built.items()}
    write_together(files, overwrite=force)
    compiled = pair.compiled
    held = {**pair.effects, **(colour.effects if colour else {})}
    simulated = [name for name, on in held.items() if on]
    result = {
        "primaries": str(primaries),
        "model": source.model,
        "effects": simulated,
        "channels": list(compiled.inputs),
        "variables": dict(compiled.variables),
        "operators": len(compiled.program),
        "executed": compiled.executed,
        "colour_mid_executed": colour.compiled.executed if colour else None,
        "tables": [asdict(error) for error in tables.errors] if tables else [],
        "measured": measured,
        "plan": plan,
        "files": [str(file) for file in files],
    }
    text = [
        f"{source.model}: {len(compiled.program)} operators, at most {compiled.executed} run for a pixel",
        f"  effects: {', '.join(simulated) or 'none'}",
        *plan_text,
        f"colour MID: at most {colour.compiled.executed} operators run for a pixel"
        if colour
        else "no colour MID: the image holds parameters"
        if plan
        else f"no colour MID: {len(source.primaries)} primaries, {MIN_NODES} are needed",
        *([tables.report] if tables else []),
        *(f"  -> {file}" for file in files),
    ]
    emit(as_json, "iccbrdf.build/1", result, "\n".join(text))
    if not holds:
        click.echo("iccbrdf: the reduced proof is further from the full one than promised", err=True)
        click.get_current_context().exit(CHECK_FAILED)
