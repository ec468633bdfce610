"""A whole set of simulated measurements, as the papers' experiments need it.

    primaries.csv    paper, primaries and secondaries, and both blacks (CMY, K), on the flat
    tests.csv        15 test patches, nine of them without K, on the flat
    slopes.csv       all 24 patches on slopes of 15, 30, 45 and 60 degrees, angles to the slope's own normal
    slopes.json      white and K on the flat and on the slopes, at 45:0: a slopes file
    simulation.json  that it is a simulation, its options, and what the seed has drawn

Nothing in these files was measured.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from iccbrdf.brdf.slopes import Slope, Slopes, write_slopes
from iccbrdf.files import atomic_output
from iccbrdf.json_text import to_json
from iccbrdf.measure import fogra39
from iccbrdf.measure.goniometer import LAMP_EXCLUSIONS, Sensor, measure
from iccbrdf.measure.measurements import Measurements
from iccbrdf.measure.synthetic_print import Behaviour, Film, SyntheticPrint, draw_behaviour
from iccbrdf.measure.writer import write_measurements

SCHEMA = "iccbrdf-simulation"
VERSION = 1

FILES = ("primaries.csv", "tests.csv", "slopes.csv", "slopes.json", "simulation.json")

PRIMARIES = {
    "White": (0, 0, 0, 0),
    "C": (100, 0, 0, 0),
    "M": (0, 100, 0, 0),
    "Y": (0, 0, 100, 0),
    "CM": (100, 100, 0, 0),
    "CY": (100, 0, 100, 0),
    "MY": (0, 100, 100, 0),
    "CMY": (100, 100, 100, 0),
    "K": (0, 0, 0, 100),
}
"""Inks in per cent.  The 2020 paper's eighth node is CMY, the 2023 paper's K."""

TESTS = {
    " ".join(f"{ink}{amount}" for ink, amount in zip("CMYK", inks, strict=True) if amount): inks
    for inks in fogra39.TEST_PATCHES
}
"""Inks in per cent by name, such as `C40 M40 Y40`."""

SLOPES = (0.0, 15.0, 30.0, 45.0, 60.0)
"""Degrees."""


@dataclass(frozen=True)
class Simulation:
    """Simulated measurements of one print."""

    primaries: Measurements
    tests: Measurements
    slopes: Measurements
    colours: Slopes
    """White and K on every slope."""
    options: dict[str, Any]
    behaviour: Behaviour
    """The truth that the seed has drawn."""


def simulate(
    seed: int = 0,
    *,
    sensor: Sensor | None = None,
    scatter: float = 0.01,
    lamp_exclusion: float = LAMP_EXCLUSIONS[0],
    illuminant: str = fogra39.ILLUMINANT,
    observer: str = fogra39.OBSERVER,
) -> Simulation:
    """
    Simulate the measurements of one print.

    Parameters
    ----------
    seed
        Draws the print, the scatter and the noise, each on its own: without noise the print is the same.
    sensor
        Errors of the instrument; by default those of `Sensor`.
    scatter
        Standard deviation, relative, by which each patch's film thickness and roughness miss the print's.
    lamp_exclusion
        Degrees around the lamp that the sensor cannot see.
    illuminant, observer
        Of the XYZ; by default those of the FOGRA39 figures.

    Returns
    -------
    The same arguments give the same numbers.
    """
    sensor = sensor or Sensor()
    of_print, of_patches, of_sensor = np.random.default_rng(seed).spawn(3)
    behaviour = draw_behaviour(of_print)
    patches = {**PRIMARIES, **TESTS}
    repeats = len(SLOPES)
    slopes = np.repeat(SLOPES, len(patches))
    thickness, roughness = np.exp(scatter * of_patches.standard_normal((2, len(slopes))))
    measured = measure(
        SyntheticPrint(behaviour),
        tuple(patches) * repeats,
        np.tile(np.array(list(patches.values()), dtype=np.float64), (repeats, 1)),
        slopes,
        Film(thickness, roughness),
        sensor=sensor,
        lamp_exclusion=lamp_exclusion,
        illuminant=illuminant,
        observer=observer,
        source=(
            f"Simulated, not measured: synthetic print and goniometer of iccbrdf simulate, seed {seed}. "
            f"Colours: {fogra39.SOURCE}."
        ),
        random=of_sensor,
    )
    flat, is_primary = slopes == 0, np.isin(measured.patches, list(PRIMARIES))
    return Simulation(
        primaries=measured.select(flat & is_primary),
        tests=measured.select(flat & ~is_primary),
        slopes=measured.select(~flat),
        colours=_slope_colours(measured),
        options={
            "seed": seed,
            **asdict(sensor),
            "scatter": scatter,
            "lamp_exclusion": lamp_exclusion,
            "illuminant": illuminant,
            "observer": observer,
        },
        behaviour=behaviour,
    )


def write_simulation(simulation: Simulation, folder: Path, *, overwrite: bool = False) -> list[Path]:
    """
    Write the files of a simulation, all or none, and return their paths.

    Raises
    ------
    UsageError
        The folder does not exist, or a file exists and `overwrite` is not set.
    """
    paths = [folder / name for name in FILES]
    with ExitStack() as stack:
        temporaries = [stack.enter_context(atomic_output(path, overwrite=overwrite)) for path in paths]
        tables = (simulation.primaries, simulation.tests, simulation.slopes)
        for table, temporary in zip(tables, temporaries, strict=False):
            write_measurements(table, temporary, overwrite=True)
        write_slopes(simulation.colours, temporaries[3], overwrite=True)
        temporaries[4].write_bytes(f"{to_json(_record(simulation))}\n".encode())
    return paths


def _slope_colours(measured: Measurements) -> Slopes:
    """White and K at 45:0."""
    at_45_0 = int(np.flatnonzero((measured.theta_i == 45) & (measured.theta_r == 0))[0])
    XYZ = {
        key: tuple(reading[at_45_0].tolist())
        for key, reading in zip(measured.keys, measured.XYZ, strict=True)
    }
    return Slopes(
        illuminant=measured.illuminant,
        observer=measured.observer,
        white=measured.white,
        geometry="45:0",
        source=measured.source,
        slopes=tuple(Slope(angle, XYZ["White", angle], XYZ["K", angle]) for angle in SLOPES),
    )


def _record(simulation: Simulation) -> dict[str, Any]:
    truth = asdict(simulation.behaviour)
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "note": "A simulation: nothing in these files was measured.",
        "source": simulation.primaries.source,
        "options": simulation.options,
        "truth": {**truth, "alpha": truth["alpha"].tolist()},
    }
