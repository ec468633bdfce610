"""iccbrdf simulate: measurements of a synthetic print by a synthetic goniometer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from iccbrdf.brdf.primaries import ILLUMINANTS, OBSERVERS
from iccbrdf.cli.options import FiniteRange, emit, force_option, json_option
from iccbrdf.files import check_target, make_folder
from iccbrdf.measure import report
from iccbrdf.measure.fogra39 import ILLUMINANT, OBSERVER
from iccbrdf.measure.goniometer import LAMP_EXCLUSIONS, Sensor
from iccbrdf.measure.simulation import FILES, simulate, write_simulation

_OBSERVERS = {"2": OBSERVERS[0], "10": OBSERVERS[1]}
_OBSERVER_2 = next(degrees for degrees, name in _OBSERVERS.items() if name == OBSERVER)

EPILOG = """
\b
Examples:
  iccbrdf simulate -o print
  Another print, measured without noise in the geometries that leave 65 without normal incidence:
  iccbrdf simulate -o print --seed 1 --noise 0 --lamp-exclusion 20
"""


@click.command("simulate", epilog=EPILOG)
@click.option("-o", "--output", "folder", required=True, type=click.Path(path_type=Path, file_okay=False),
              help="Folder for the files; made if need be.")  # fmt: skip
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True,
              help="Draws the print and the noise.")  # fmt: skip
@click.option("--noise", type=FiniteRange(0, 1), default=Sensor.noise, show_default=True,
              help="Of a reading: standard deviation, relative.")  # fmt: skip
@click.option("--aperture", type=FiniteRange(0, 5), default=Sensor.aperture, show_default=True,
              help="Half angle in degrees that the sensor averages over.")  # fmt: skip
@click.option("--scatter", type=FiniteRange(0, 1), default=0.01, show_default=True,
              help="Of the patches' film thickness and roughness: standard deviation, relative.")  # fmt: skip
@click.option("--lamp-exclusion", type=click.Choice([str(angle) for angle in LAMP_EXCLUSIONS]),
              default=str(LAMP_EXCLUSIONS[0]), show_default=True,
              help="Degrees around the lamp that the sensor cannot see: 15 leaves 68 geometries, "
              "20 leaves 65, those of normal incidence not counted.")  # fmt: skip
@click.option("--illuminant", type=click.Choice(ILLUMINANTS), default=ILLUMINANT, show_default=True,
              help="Of the XYZ.")  # fmt: skip
@click.option("--observer", type=click.Choice(list(_OBSERVERS)), default=_OBSERVER_2, show_default=True,
              help="Of the XYZ: 2 or 10 degrees.")  # fmt: skip
@force_option
@json_option
def command(
    folder: Path,
    seed: int,
    noise: float,
    aperture: float,
    scatter: float,
    lamp_exclusion: str,
    illuminant: str,
    observer: str,
    force: bool,
    as_json: bool,
) -> None:
    """Simulate the goniometric measurements of a print; no real ones of CMYK patches are public.

    \b
    primaries.csv    paper, primaries, secondaries and both blacks on the flat
    tests.csv        15 test patches on the flat
    slopes.csv       all of them on slopes of 15, 30, 45 and 60 degrees
    slopes.json      white and black on the slopes, for `iccbrdf build --slopes`
    simulation.json  that it is a simulation, and of what

    The print has the colours of FOGRA39 and reflects by laws that none of the fitted models holds.
    """
    make_folder(folder)
    for name in FILES:
        check_target(folder / name, overwrite=force)
    simulation = simulate(
        seed,
        sensor=Sensor(noise, aperture),
        scatter=scatter,
        lamp_exclusion=float(lamp_exclusion),
        illuminant=illuminant,
        observer=_OBSERVERS[observer],
    )
    paths = write_simulation(simulation, folder, overwrite=force)
    tables = {"primaries": simulation.primaries, "tests": simulation.tests, "slopes": simulation.slopes}
    reports: dict[str, Any] = {name: report(table) for name, table in tables.items()}
    text = [
        f"simulated, not measured: seed {seed}, noise {noise:g}, scatter {scatter:g}; {illuminant}, "
        f"{_OBSERVERS[observer]}",
        *(
            f"{name:<9}  {len(found['patches'])} patches, {found['geometries']} geometries"
            for name, found in reports.items()
        ),
        *(f"  -> {path}" for path in paths),
    ]
    result = {
        "simulated": True,
        "options": simulation.options,
        **reports,
        "files": [str(path) for path in paths],
    }
    emit(as_json, "iccbrdf.simulate/1", result, "\n".join(text))
