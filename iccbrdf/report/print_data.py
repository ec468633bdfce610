"""The measurements of a print that its evaluation needs: primaries, test patches, both on slopes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from iccbrdf.brdf.fit_diagnostics import REGIONS, regions
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.slopes import Slopes, read_slopes
from iccbrdf.errors import InputError, nearest
from iccbrdf.files import StrPath
from iccbrdf.measure import Measurements, read_measurements

_CHROMATIC = ("White", "C", "M", "Y", "CM", "CY", "MY")
NODES_2020 = (*_CHROMATIC, "CMY")
NODES_2023 = (*_CHROMATIC, "K")
"""Names of the primaries that the papers interpolate between."""

_SAME_ANGLE = 0.5
_SAME_WHITE = 1e-4


@dataclass(frozen=True, eq=False)
class PrintData:
    """Measurements of one print, all under one illuminant and observer."""

    primaries: Measurements
    """On the flat, at least `NODES_2020` and K."""
    tests: Measurements
    """Test patches on the flat, with their inks; some without K."""
    slopes: Measurements
    """`NODES_2023` and the test patches on every slope of `colours` but the flat."""
    colours: Slopes
    """White and K on the flat and on the slopes, at 45:0."""

    def __post_init__(self) -> None:
        names = (*NODES_2023, *self.tests.patches)
        with _within("primaries"):
            rows(self.primaries, (*NODES_2020, "K"))
            self._check_table(self.primaries)
        with _within("tests"):
            if not self.tests_without_K.patches:
                raise InputError("found no patch without K, expected some, by the columns C, M, Y, K")
            self._check_table(self.tests)
        with _within("slopes"):
            if len(self.colours.slopes) < 2:
                raise InputError("found no slope but the flat, expected at least one")
            for angle in self.colours.angles[1:]:
                rows(self.slopes, names, angle)
            self._check_table(self.slopes)

    def _check_table(self, table: Measurements) -> None:
        at_45_0(table)
        if not np.any(regions(table.light, table.view) == REGIONS.index("specular")):
            raise InputError("found no readings in a mirror direction, expected some")
        found, expected = (
            (each.illuminant, each.observer, tuple(each.white)) for each in (table, self.colours)
        )
        if found[:2] != expected[:2] or not np.allclose(found[2], expected[2], atol=_SAME_WHITE):
            raise InputError(
                f"found {found[0]}, {found[1]}, white {found[2]}, expected {expected[0]}, {expected[1]}, "
                f"white {expected[2]} as in the slopes file"
            )

    @property
    def tests_without_K(self) -> Measurements:
        """The test patches whose inks are known and hold no K."""
        inks = self.tests.cmyk
        return self.tests.select(np.zeros(len(self.tests.patches), bool) if inks is None else inks[:, 3] == 0)


def read_print(folder: StrPath) -> PrintData:
    """
    Read the measurements of a print.

    Parameters
    ----------
    folder
        Holds `primaries.csv`, `tests.csv`, `slopes.csv` and `slopes.json` as `iccbrdf simulate` writes them.

    Raises
    ------
    InputError
        A file is unreadable or malformed, lacks a patch, slope or the geometry 45:0, or has another
        illuminant or observer than the rest.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder, expected one as iccbrdf simulate writes it")
    primaries = read_measurements(folder / "primaries.csv")
    tests = read_measurements(folder / "tests.csv")
    slopes = read_measurements(folder / "slopes.csv")
    colours = read_slopes(folder / "slopes.json")
    with _within(str(folder)):
        return PrintData(primaries, tests, slopes, colours)


def rows(measurements: Measurements, names: tuple[str, ...], slope: float = 0.0) -> list[int]:
    """
    Return where patches of some names stand on a slope in degrees.

    Raises
    ------
    InputError
        One of them is missing.
    """
    places = {key: row for row, key in enumerate(measurements.keys)}
    on_slope = [name for name, angle in places if angle == slope]
    for name in names:
        if (name, slope) not in places:
            raise InputError(f"no patch {name!r} on the slope {slope:g}: {nearest(name, on_slope)}")
    return [places[name, slope] for name in names]


def at_45_0(measurements: Measurements) -> Array:
    """
    Return the XYZ of the patches lit at 45 degrees and seen along the normal, (patches, 3).

    Raises
    ------
    InputError
        Not all were measured there, or one has an XYZ that is not above 0.
    """
    lit = np.abs(measurements.theta_i - 45) <= _SAME_ANGLE
    standard = np.flatnonzero(lit & (np.abs(measurements.theta_r) <= _SAME_ANGLE))
    if not standard.size:
        raise InputError("found no readings at 45:0, by which colours are compared")
    XYZ = measurements.XYZ[:, standard[0]]
    for (name, slope), colour in zip(measurements.keys, XYZ, strict=True):
        if not np.all(colour > 0):
            raise InputError(
                f"{name!r} on the slope {slope:g} has the XYZ {colour.tolist()} at 45:0, "
                "expected numbers above 0"
            )
    return XYZ


@contextmanager
def _within(place: str) -> Iterator[None]:
    """Say in errors where they are."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error}") from error
