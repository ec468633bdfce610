"""iccbrdf plan: which effects an image calls for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import Any

import click
import numpy as np

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import INTERPOLATIONS, SLOPE_METHODS
from iccbrdf.build.effects import EFFECTS
from iccbrdf.build.recipe import Recipe, recipe_of
from iccbrdf.build.source import left_out
from iccbrdf.build.spans import Directions
from iccbrdf.cli.options import emit, environment, json_option, name_list, plan_options, scene_options
from iccbrdf.errors import UsageError
from iccbrdf.icc import read_profile
from iccbrdf.icc.source_tag import read_source
from iccbrdf.images import Samples, open_tiff
from iccbrdf.planning import Check, Planning, ScenePlan, check_image
from iccbrdf.scene import LIGHT, VIEW, parse_direction, parse_number

MAX_CHECKS = 8
"""Lights that a plan is checked under: all of few, some of many."""

EPILOG = """
\b
Examples:
  What a print calls for, lit from the left and seen from above:
    iccbrdf plan relief.tif -p mid.icc -p mvis.icc --light 50,180
    iccbrdf plan relief.tif --primaries primaries.json --light 50,180
  For a light that goes round, where CIEDE2000 of 0.5 may be lost:
    iccbrdf plan relief.tif --primaries primaries.json --lights 60,0:60,360 --tolerance 0.5
  The profiles of that:
    iccbrdf build primaries.json -o out --for relief.tif --lights 60,0:60,360 --tolerance 0.5
"""


@click.command("plan", epilog=EPILOG)
@click.argument("image", type=click.Path(path_type=Path))
@click.option("-p", "--profile", "profiles", multiple=True, type=click.Path(path_type=Path),
              help="A profile that the image is for: the MID or colour MID, then the MVIS.")  # fmt: skip
@click.option("--primaries", type=click.Path(path_type=Path),
              help="Instead of profiles: the primaries file that they are made of.")  # fmt: skip
@click.option("--slopes", type=click.Path(path_type=Path), help="The slopes file, for an image of XYZ.")
@click.option("--slope-method", type=click.Choice(SLOPE_METHODS), help="affine (default) or as published.")
@click.option("--interpolation", type=click.Choice(INTERPOLATIONS),
              help="smooth (default) or as published.")  # fmt: skip
@plan_options
@scene_options
@json_option
def command(
    image: Path,
    profiles: tuple[Path, ...],
    primaries: Path | None,
    slopes: Path | None,
    slope_method: str | None,
    interpolation: str | None,
    lights: tuple[str, ...],
    tolerance: float,
    samples: Samples | None,
    channels: str | None,
    light: str | None,
    view: str | None,
    env: tuple[str, ...],
    as_json: bool,
) -> None:
    """Say which effects IMAGE calls for, and why.

    The image is a TIFF for the binding MID (BRDF parameters and normals) or for the colour MID (XYZ and
    normals).  For each effect, a bound tells how far the proof without it is from the full one at most, over
    all pixels and lights; what stays below the tolerance can be left out.

    Profiles of iccbrdf build say what they are made of.  Of those that were built without some effects, the
    plan is that of all effects, and tells which of those that are lacking the image calls for.
    """
    chain = [read_profile(path) for path in profiles]
    if (primaries is None) != bool(chain):
        raise UsageError("give the profiles that the image is for (-p MID -p MVIS), or --primaries")
    if primaries is not None:
        recipe = Recipe(
            read_primaries(primaries),
            read_slopes(slopes) if slopes is not None else None,
            interpolation or "smooth",
            slope_method or "affine",
        )
    elif slopes is not None or slope_method is not None or interpolation is not None:
        raise UsageError("--slopes, --slope-method and --interpolation belong to --primaries")
    else:
        recipe = recipe_of(chain)
    recipe = replace(recipe, variables={**recipe.variables, **environment(light, view, env)})
    plan, check = planned(image, recipe, lights, tolerance, samples, channels)
    gone = {name for profile in chain for name in left_out(read_source(profile).recipe)}
    lacking = [finding.effect for finding in plan.findings if finding.called_for and finding.effect in gone]
    result = {
        "image": str(image),
        "profiles": [str(path) for path in profiles],
        "primaries": None if primaries is None else str(primaries),
        **plan_result(plan, check),
        "lacking": lacking,
    }
    text = [f"{image}:", *plan_lines(plan, check)]
    if lacking:
        text.append(f"  the profiles lack what is called for: {', '.join(lacking)}")
    emit(as_json, "iccbrdf.plan/1", result, "\n".join(text))


def planned(
    image: Path,
    recipe: Recipe,
    lights: Sequence[str],
    tolerance: float,
    samples: Samples | None,
    channels: str | None,
) -> tuple[ScenePlan, Check]:
    """The plan of an image under `lights`, or else the light that the recipe sets, and its check."""
    values = recipe.pair().compiled.variables
    directions = _directions(lights, [values[name] for name in LIGHT])
    eye = np.array([[values[name] for name in VIEW]])
    declared = name_list(channels) if channels is not None else None
    with open_tiff(image, samples) as source:
        planning = Planning(source, recipe, declared)
        eyes = Directions.single(eye, ["view"])
        plan = planning.plan(directions, eyes, tolerance=tolerance)
        chosen = np.unique(np.linspace(0, len(directions) - 1, MAX_CHECKS).round().astype(int))
        examples = directions.examples[chosen].tolist()
        return plan, check_image(plan, [dict(zip(LIGHT, example, strict=True)) for example in examples])


def _directions(texts: Sequence[str], light: Sequence[float]) -> Directions:
    if not texts:
        return Directions.single([light], ["light"])
    found = []
    for text in texts:
        ends = text.split(":")
        if len(ends) > 2:
            raise UsageError(f"--lights {text!r}: expected a direction, or two with a colon between them")
        vectors = [parse_direction("--lights", end) for end in ends]
        if len(ends) == 1:
            found.append(Directions.single(vectors, [text]))
        else:
            found.append(Directions.between(*(_angles(text, end) for end in ends)))
    return reduce(Directions.join, found)


def _angles(text: str, end: str) -> tuple[float, float]:
    parts = end.split(",")
    if len(parts) != 2:
        raise UsageError(f"--lights {text!r}: expected ZENITH,AZIMUTH in degrees at both ends, not a vector")
    return parse_number("--lights", parts[0]), parse_number("--lights", parts[1])


def plan_result(plan: ScenePlan, check: Check) -> dict[str, Any]:
    """A plan for JSON."""
    seconds = dict(plan.seconds)
    return {
        "kind": "XYZ" if plan.planning.is_colour else "BRDF",
        "tolerance": plan.tolerance,
        "effects": [
            {
                "effect": finding.effect,
                "called_for": finding.called_for,
                "bound": _finite(finding.bound),
                "exact": finding.exact,
                "place": finding.place,
                "light": finding.light,
            }
            for finding in plan.findings
        ],
        "without": list(plan.decision.without),
        "bound": plan.decision.bound,
        "exact": plan.decision.exact,
        "check": {
            "max_delta_E_CIE2000": _finite(check.dE),
            "place": check.place,
            "max_relative": check.relative,
            "lights": check.scenes,
        },
        "executed": {"full": plan.full.executed, "reduced": plan.reduced.executed},
        "seconds": seconds,
        "share_of_bounding": seconds["bounding"] / sum(seconds.values()),
    }


def plan_lines(plan: ScenePlan, check: Check) -> Iterator[str]:
    """A plan for people."""
    for finding in plan.findings:
        yield f"  {finding.effect:<20} {_verdict(plan, finding)}"
    left_out = ", ".join(plan.decision.without) or "nothing"
    loss = (
        "the same but for rounding" if plan.decision.exact else f"CIEDE2000 at most {plan.decision.bound:.3g}"
    )
    yield f"  leave out: {left_out} ({loss}; found {check.dE:.3g} on the image)"
    yield f"  operators for a pixel: {plan.reduced.executed} of {plan.full.executed}"
    seconds = ", ".join(f"{name} {value:.2f} s" for name, value in plan.seconds.items())
    yield f"  {seconds}"


def _verdict(plan: ScenePlan, finding: Any) -> str:
    bound = f"CIEDE2000 up to {finding.bound:.3g}" if math.isfinite(finding.bound) else "no bound"
    if finding.called_for and finding.place is not None:
        row, column = finding.place
        where = f"at row {row}, column {column}" + (
            f", light {finding.light}" if finding.light != "light" else ""
        )
        return f"called for: {bound} without it, {where}"
    if finding.called_for:
        return f"kept: {bound} without it, and the tolerance is used up" if not finding.exact else "kept"
    small = "no change without it" if finding.exact else f"{bound} without it"
    return small if EFFECTS[finding.effect].spares else f"{small}; kept, for it costs nothing"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
