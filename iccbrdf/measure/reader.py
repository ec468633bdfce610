"""Files of measurements in any of the formats, by what is declared about them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.primaries import white_of
from iccbrdf.errors import InputError, LimitError
from iccbrdf.files import StrPath, as_text
from iccbrdf.measure.colorimetry import (
    SPECTRAL_ILLUMINANT,
    SPECTRAL_OBSERVER,
    Lab_to_XYZ,
    spectral_gap,
    weights,
)
from iccbrdf.measure.columns import CIELAB, INKS, TRISTIMULUS, Columns
from iccbrdf.measure.declarations import Declarations
from iccbrdf.measure.measurements import Measurements, canonical
from iccbrdf.measure.tables import Table, read_cgats, read_cornell, read_csv

_FORMATS = {
    ".csv": "csv", ".tsv": "tsv", ".ti3": "cgats", ".cgats": "cgats", ".txt": "cgats", ".brdf": "cornell",
}  # fmt: skip

_MAX_VALUES = 2**27
"""Most numbers of a data set, patches x geometries x values: 1 GB."""


def read_measurements(path: StrPath, **declarations: Any) -> Measurements:
    """
    Read a file of measurements.

    Parameters
    ----------
    path
        CSV or TSV in long form (a row for each patch and geometry), CGATS text (`.ti3`, `.txt`), or the
        text format of the Cornell Program of Computer Graphics (`.brdf`).
    declarations
        What the file's numbers are, as `iccbrdf.measure.declarations` lists it.  A file that
        `write_measurements` wrote says it all itself, one of Cornell all but illuminant and observer.

    Returns
    -------
    Pi times the BRDF in the papers' angles.  XYZ is taken from columns X, Y, Z, else from L*, a*, b*, else
    from the spectra.  Repeated readings of one patch in one geometry are averaged, combinations that were not
    measured are NaN; the notes say so.

    Raises
    ------
    InputError
        The file is unreadable or malformed, or a declaration is missing, unknown or contradicts the file.
    LimitError
        The data would fill more than a gigabyte.

    Examples
    --------
    >>> read_measurements("FOGRA39L.ti3", geometry="45:0", quantity="reflectance", scale=100,
    ...     illuminant="D50", observer="CIE 1931 2 Degree Standard Observer")    # doctest: +SKIP
    """
    declared = Declarations(path, declarations)
    table = _read_table(path, declared)
    declared = declared.with_header(table.header)
    columns = Columns(table, declared)

    theta_i, theta_r, phi = _angles(table, columns, declared)
    rows = _arrange(table, columns, theta_i, theta_r, phi)
    readings = _readings(columns, declared, theta_i)
    parts = [readings.XYZ] if readings.spectra is None else [readings.XYZ, readings.spectra]
    values, repeats = _spread(rows, np.hstack(parts), path)

    notes = [*table.notes, *readings.notes]
    if repeats:
        notes.append(f"{repeats} repeated readings averaged")
    if columns.ignored():
        notes.append(f"columns left out: {', '.join(columns.ignored())}")
    angles = np.array(rows.geometries)
    return Measurements(
        patches=tuple(name for name, _ in rows.patches),
        theta_i=angles[:, 0],
        theta_r=angles[:, 1],
        phi=angles[:, 2],
        XYZ=values[..., :3],
        illuminant=readings.illuminant,
        observer=readings.observer,
        white=readings.white,
        source=declared.text("source", as_text(Path(path).name)),
        cmyk=_inks(table, columns, rows) if columns.has(INKS) else None,
        slopes=np.array([slope for _, slope in rows.patches]) if "slope" in columns else None,
        wavelengths=columns.wavelengths if columns.spectral else None,
        spectra=values[..., 3:] if columns.spectral else None,
        notes=tuple(notes),
    )


class _Readings(NamedTuple):
    """Pi times the BRDF of each row of a long table."""

    XYZ: Array
    """(rows, 3)."""
    spectra: Array | None
    """(rows, wavelengths)."""
    illuminant: str
    observer: str
    white: tuple[float, ...]
    notes: tuple[str, ...] = ()


class _Rows(NamedTuple):
    """Where each row of a long table belongs among patches (name, slope) and geometries (angles)."""

    patches: list[tuple[str, float]]
    geometries: list[tuple[float, float, float]]
    patch: list[int]
    geometry: list[int]


def _read_table(path: StrPath, declared: Declarations) -> Table:
    ending = Path(path).suffix.lower()
    format_ = declared.choice("format", _FORMATS.get(ending))
    if format_ == "cornell":
        return read_cornell(path)
    if format_ == "cgats":
        return read_cgats(path)
    return read_csv(path, declared.delimiter() if format_ == "csv" else "\t")


def _angles(table: Table, columns: Columns, declared: Declarations) -> tuple[Array, Array, Array]:
    """theta_i, theta_r and phi of each row as `Measurements` has them."""
    if "geometry" in declared:
        if "theta_i" in columns or "theta_r" in columns:
            raise columns.error("geometry is declared, but the table has columns of angles")
        theta_i, theta_r = (np.full(len(table.lines), angle) for angle in declared.geometry())
        phi = np.zeros_like(theta_i)
    else:
        angles = columns.numbers("theta_i", "theta_r")
        unit = 1.0 if declared.choice("angles") == "degree" else np.degrees(1.0)
        theta_i, theta_r = (angles * unit).T
        phi = np.zeros_like(theta_i)
        side = declared.choice("view_angles")
        if side == "azimuth":
            phi = columns.numbers("phi")[:, 0] * unit
            if "phi_i" in columns:
                phi = phi - columns.numbers("phi_i")[:, 0] * unit
        elif side == "mirror":
            theta_r = -theta_r
    _check(table, "theta_i", theta_i, (theta_i >= 0) & (theta_i < 90), "0 to less than 90")
    _check(table, "theta_r", theta_r, np.abs(theta_r) < 90, "more than -90 and less than 90")
    _check(table, "phi", phi, np.isfinite(phi), "a number")
    return theta_i, *canonical(theta_r, phi)


def _check(table: Table, name: str, values: Array, valid: NDArray[np.bool_], expected: str) -> None:
    for k in np.flatnonzero(~valid):
        raise InputError(f"{table.row(int(k))}: {name} is {values[k]:g} degrees, expected {expected}")


def _readings(columns: Columns, declared: Declarations, theta_i: Array) -> _Readings:
    quantity = declared.choice("quantity")
    has_XYZ, has_Lab = columns.has(TRISTIMULUS), columns.has(CIELAB)
    of_spectra = bool(columns.spectral) and not has_XYZ and not has_Lab
    illuminant = declared.choice("illuminant", SPECTRAL_ILLUMINANT if of_spectra else None)
    observer = declared.choice("observer", SPECTRAL_OBSERVER if of_spectra else None)
    white = declared.white() or white_of(illuminant, observer)

    spectra = None
    if columns.spectral:
        spectra = columns.spectra() * _to_reflectance(quantity, theta_i) / declared.scale()
    if has_XYZ:
        XYZ = columns.numbers(*TRISTIMULUS) * _to_reflectance(quantity, theta_i) / declared.scale()
        return _Readings(XYZ, spectra, illuminant, observer, white)
    if has_Lab:
        if quantity != "reflectance":
            raise columns.error(f"quantity is {quantity}, expected reflectance: the table holds CIELAB")
        XYZ = Lab_to_XYZ(columns.numbers(*CIELAB), white)
        return _Readings(XYZ, spectra, illuminant, observer, white, ("XYZ computed from CIELAB",))
    if spectra is not None:
        gap = spectral_gap(columns.wavelengths)
        if gap:
            raise columns.error(gap)
        XYZ = spectra @ weights(columns.wavelengths, illuminant, observer)
        return _Readings(XYZ, spectra, illuminant, observer, white, ("XYZ computed from the spectra",))
    raise columns.error(
        f"found the columns {', '.join(columns.table.columns)}, "
        "expected X, Y, Z, or LAB_L, LAB_A, LAB_B, or wavelengths such as 400"
    )


def _to_reflectance(quantity: str, theta_i: Array) -> Array:
    """What a row's values are multiplied by to become pi times the BRDF, (rows, 1)."""
    factors = {
        "brdf": np.full_like(theta_i, np.pi),
        "reflectance": np.ones_like(theta_i),
        "radiance": 1 / np.cos(np.radians(theta_i)),
    }
    return factors[quantity][:, np.newaxis]


def _arrange(table: Table, columns: Columns, theta_i: Array, theta_r: Array, phi: Array) -> _Rows:
    slopes = np.zeros_like(theta_i)
    if "slope" in columns:
        slopes = columns.numbers("slope")[:, 0]
        _check(table, "slope", slopes, (slopes >= 0) & (slopes <= 90), "0 to 90")
    # Blanks of any kind that nobody sees tell no patches apart.
    names = [" ".join(name.split()) for name in columns.texts("patch")]
    if "" in names:
        raise InputError(f"{table.row(names.index(''))}: the name of the patch is empty")
    patches: dict[tuple[str, float], int] = {}
    geometries: dict[tuple[float, float, float], int] = {}
    keys = zip(names, slopes.tolist(), strict=True)
    angles = zip(theta_i.tolist(), theta_r.tolist(), phi.tolist(), strict=True)
    patch = [patches.setdefault(key, len(patches)) for key in keys]
    geometry = [geometries.setdefault(key, len(geometries)) for key in angles]
    return _Rows(list(patches), list(geometries), patch, geometry)


def _spread(rows: _Rows, values: Array, path: StrPath) -> tuple[Array, int]:
    """Values (rows, k) as (patches, geometries, k), means where readings repeat, and how many repeat."""
    shape = (len(rows.patches), len(rows.geometries), values.shape[1])
    if np.prod(shape, dtype=float) > _MAX_VALUES:
        raise LimitError(
            f"{path}: {shape[0]} patches x {shape[1]} geometries x {shape[2]} values, expected at most "
            f"{_MAX_VALUES} numbers: is it the right column that names the patches?"
        )
    sums, counts = np.zeros(shape), np.zeros(shape, dtype=np.int64)
    measured = np.isfinite(values)
    np.add.at(sums, (rows.patch, rows.geometry), np.where(measured, values, 0.0))
    np.add.at(counts, (rows.patch, rows.geometry), measured)
    means = np.divide(sums, counts, out=np.full(shape, np.nan), where=counts > 0)
    return means, len(values) - len(set(zip(rows.patch, rows.geometry, strict=True)))


def _inks(table: Table, columns: Columns, rows: _Rows) -> Array:
    """Inks of each patch in per cent, (patches, 4)."""
    values = columns.numbers(*INKS)
    inks = np.full((len(rows.patches), 4), np.nan)
    for k, patch in enumerate(rows.patch):
        if not np.all((values[k] >= 0) & (values[k] <= 100)):
            raise InputError(f"{table.row(k)}: CMYK is {values[k].tolist()}, expected per cent, 0 to 100")
        if np.isnan(inks[patch, 0]):
            inks[patch] = values[k]
        elif not np.array_equal(inks[patch], values[k]):
            raise InputError(
                f"{table.row(k)}: CMYK is {values[k].tolist()}, expected {inks[patch].tolist()} as above "
                f"for the patch {rows.patches[patch][0]!r}"
            )
    return inks
