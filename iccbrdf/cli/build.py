"""iccbrdf build: primaries -> profiles."""

from __future__ import annotations

from pathlib import Path

import click

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.build import Pair, build_pair
from iccbrdf.cli.options import emit, environment, force_option, json_option, name_list, scene_options
from iccbrdf.errors import UsageError
from iccbrdf.files import make_folder, write_together

EPILOG = """
\b
Examples:
  iccbrdf build profiles/fogra39_gloss/primaries.json -o out
  Without the Fresnel term, and with other defaults for light and view:
  iccbrdf build primaries.json -o out --without fresnel --light 60,90 --view 10,270
"""


@click.command("build", epilog=EPILOG)
@click.argument("primaries", type=click.Path(path_type=Path))
@click.option("-o", "--output", "folder", required=True, type=click.Path(path_type=Path, file_okay=False),
              help="Folder for mid.icc, mvis.icc and mvis.txt, the listing; made if need be.")  # fmt: skip
@click.option("--effects", metavar="NAMES", help="Simulate these effects only, separated by commas.")
@click.option("--without", metavar="NAMES", help="Simulate all effects but these, separated by commas.")
@click.option("--fresnel-angle", type=click.Choice(("theta_i", "alpha")),
              help="Angle of the Fresnel term: of incidence, as printed (the default), or between half "
              "vector and view, which keeps the model reciprocal.")  # fmt: skip
@scene_options
@force_option
@json_option
def command(
    primaries: Path,
    folder: Path,
    effects: str | None,
    without: str | None,
    fresnel_angle: str | None,
    light: str | None,
    view: str | None,
    env: tuple[str, ...],
    force: bool,
    as_json: bool,
) -> None:
    """Make a MID and the MVIS it goes with from PRIMARIES, a primaries file.

    --light, --view and --env set the defaults that the profiles hold; whoever runs them may set others.
    """
    if effects is not None and without is not None:
        raise UsageError("--effects and --without are two ways to say one thing: give one of them")
    source = read_primaries(primaries)
    pair = build_pair(
        source,
        effects=name_list(effects) if effects is not None else None,
        without=name_list(without or ""),
        fresnel_angle=fresnel_angle,
        variables=environment(light, view, env),
    )
    files = write_pair(pair, folder, overwrite=force)
    compiled = pair.compiled
    simulated = [name for name, on in compiled.effects.items() if on]
    result = {
        "primaries": str(primaries),
        "model": source.model,
        "effects": simulated,
        "channels": list(compiled.inputs),
        "variables": dict(compiled.variables),
        "operators": len(compiled.program),
        "executed": compiled.executed,
        "files": [str(file) for file in files],
    }
    text = [
        f"{source.model}: {len(compiled.program)} operators, at most {compiled.executed} run for a pixel",
        f"  effects: {', '.join(simulated) or 'none'}",
        *(f"  -> {file}" for file in files),
    ]
    emit(as_json, "iccbrdf.build/1", result, "\n".join(text))


def write_pair(pair: Pair, folder: Path, *, overwrite: bool) -> list[Path]:
    """Write mid.icc, mvis.icc and their listing, all of them or none; returns their paths."""
    make_folder(folder)
    files = {folder / name: data for name, data in pair.files.items()}
    write_together(files, overwrite=overwrite)
    return list(files)
