"""Small prints that several tests of the evaluation share."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from iccbrdf.brdf.slopes import write_slopes
from iccbrdf.measure import Measurements, write_measurements
from iccbrdf.measure.simulation import simulate
from iccbrdf.report import PrintData

TESTS = ("C40", "M40", "C40 M40 Y40", "K40")


def simulated(seed: int = 0) -> PrintData:
    """All patches of a simulated print."""
    simulation = simulate(seed)
    return PrintData(simulation.primaries, simulation.tests, simulation.slopes, simulation.colours)


def small(data: PrintData) -> PrintData:
    """Four test patches, the slopes 30 and 60, the incidences 45 and 60."""

    def lit_steeply(table: Measurements, patches: list[int]) -> Measurements:
        return table.select(patches, table.theta_i >= 45)

    primaries, tests, slopes = data.primaries, data.tests, data.slopes
    names = {*primaries.patches, *TESTS}
    kept = [p for p, (name, slope) in enumerate(slopes.keys) if name in names and slope in (30, 60)]
    colours = data.colours
    return PrintData(
        lit_steeply(primaries, list(range(len(primaries.patches)))),
        lit_steeply(tests, [tests.patches.index(name) for name in TESTS]),
        lit_steeply(slopes, kept),
        replace(colours, slopes=tuple(slope for slope in colours.slopes if slope.angle in (0, 30, 60))),
    )


def write(data: PrintData, folder: Path) -> None:
    """The files that `iccbrdf evaluate` reads."""
    for name in ("primaries", "tests", "slopes"):
        write_measurements(getattr(data, name), folder / f"{name}.csv")
    write_slopes(data.colours, folder / "slopes.json")


def patches(XYZ: object, theta_i: list[float], theta_r: list[float]) -> Measurements:
    """Measurements of as many patches as XYZ (patches, geometries, 3) has."""
    array = np.asarray(XYZ, dtype=float)
    return Measurements(
        patches=tuple(f"patch {p}" for p in range(len(array))),
        theta_i=np.array(theta_i, dtype=float),
        theta_r=np.array(theta_r, dtype=float),
        phi=np.zeros(len(theta_i)),
        XYZ=array,
        illuminant="D50",
        observer="CIE 1931 2 Degree Standard Observer",
        white=(0.9642, 1.0, 0.8249),
        source="a test",
    )
