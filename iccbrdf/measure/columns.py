"""Which column of a table is what: by declaration, or by the names that are usual."""

from __future__ import annotations

import re

import numpy as np

from iccbrdf.brdf.geometry import Array
from iccbrdf.errors import InputError, nearest
from iccbrdf.measure.declarations import Declarations
from iccbrdf.measure.tables import Table

INKS = ("CMYK_C", "CMYK_M", "CMYK_Y", "CMYK_K")
TRISTIMULUS = ("X", "Y", "Z")
CIELAB = ("LAB_L", "LAB_A", "LAB_B")

NAMES: dict[str, tuple[str, ...]] = {
    **{name: (name,) for name in ("slope", "theta_i", "phi_i", "theta_r", "phi", *INKS, *CIELAB)},
    "patch": ("patch", "SAMPLE_NAME", "SAMPLE_ID"),
    "X": ("X", "XYZ_X"),
    "Y": ("Y", "XYZ_Y"),
    "Z": ("Z", "XYZ_Z"),
}
"""Our names, and what a column may be called that has not been declared: the first that is there counts."""

_SPECTRAL_PREFIX = r"(?:nm_?|r_?|spec_?|spectral_(?:nm_?)?)?"
_WAVELENGTHS = (200.0, 2500.0)
"""Range in nm of what the number in the name of a spectral column can be."""


class Columns:
    """
    The columns of a table under our names.

    Raises
    ------
    InputError
        A declared column is not in the table, or two are of one wavelength.
    """

    def __init__(self, table: Table, declared: Declarations) -> None:
        self.table = table
        self.names = self._find_names(declared.columns())
        self.spectral = self._find_spectral(declared)

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def texts(self, name: str) -> list[str]:
        """Return a column as text; InputError where it is missing."""
        return self.table.columns[self._column(name)]

    def numbers(self, *names: str) -> Array:
        """Return columns as numbers, (rows, columns), NaN where nothing was measured.

        Raises
        ------
        InputError
            A column is missing, or a field is no number.
        """
        return np.stack([self.table.numbers(self._column(name)) for name in names], axis=-1)

    @property
    def wavelengths(self) -> Array:
        """Of the spectral columns in nm, ascending, (wavelengths,)."""
        return np.array(list(self.spectral))

    def spectra(self) -> Array:
        """Return the spectral columns as numbers, (rows, wavelengths)."""
        return np.stack([self.table.numbers(column) for column in self.spectral.values()], axis=-1)

    def has(self, names: tuple[str, ...]) -> bool:
        """Return whether a group of columns is there; InputError where only a part of it is."""
        some = any(name in self for name in names)
        for name in names:
            if some:
                self._column(name)
        return some

    def ignored(self) -> list[str]:
        """Return the names of columns that mean nothing here."""
        used = {*self.names.values(), *self.spectral.values()}
        return [column for column in self.table.columns if column not in used]

    def _column(self, name: str) -> str:
        if name not in self.names:
            raise self.error(
                f"no column {' or '.join(map(repr, NAMES[name]))}, and {_instead(name)} is not declared: "
                f"{nearest(name, self.table.columns)}"
            )
        return self.names[name]

    def _find_names(self, declared: dict[str, str]) -> dict[str, str]:
        columns = self.table.columns
        for name, column in declared.items():
            if name not in NAMES:
                raise self.error(f"columns: unknown name {name!r}: {nearest(name, NAMES)}")
            if column not in columns:
                raise self.error(f"no column {column!r}, declared as {name}: {nearest(column, columns)}")
        found = dict(declared)
        for name, usual in NAMES.items():
            here = [column for column in usual if column in columns and column not in declared.values()]
            if name not in found and here:
                found[name] = here[0]
        return found

    def _find_spectral(self, declared: Declarations) -> dict[float, str]:
        """Names of spectral columns by wavelength in nm, ascending."""
        prefix = _SPECTRAL_PREFIX
        if "spectral_prefix" in declared:
            prefix = re.escape(declared.text("spectral_prefix", ""))
        pattern = re.compile(rf"{prefix}(\d+(?:\.\d+)?)\s*(?:nm)?", re.IGNORECASE)
        found: dict[float, str] = {}
        for column in self.table.columns:
            match = pattern.fullmatch(column)
            if match is None or column in self.names.values():
                continue
            wavelength = float(match[1])
            if wavelength in found:
                raise self.error(f"columns {found[wavelength]!r} and {column!r} are of one wavelength")
            if _WAVELENGTHS[0] <= wavelength <= _WAVELENGTHS[1]:
                found[wavelength] = column
        if not found and "spectral_prefix" in declared:
            raise self.error(
                f"no column is named {declared.text('spectral_prefix', '')!r} and a wavelength: "
                f"found {', '.join(self.table.columns)}"
            )
        return dict(sorted(found.items()))

    def error(self, message: str) -> InputError:
        """Return an error about the table, to be raised by the caller."""
        return InputError(f"{self.table.file}: {message}")


def _instead(name: str) -> str:
    """The declaration that does without a usual name."""
    return f"columns.{name} or geometry" if name.startswith("theta") else f"columns.{name}"
