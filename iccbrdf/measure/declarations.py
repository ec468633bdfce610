"""What the numbers of a table are: declared by its user, never guessed.

    format           csv, tsv, cgats, cornell; optional, by default of the file name's ending
    delimiter        between the fields of csv; optional (,)
    angles           degree or radian
    view_angles      lamp: theta_r is signed in the plane of incidence, positive on the lamp's side (the
                     papers' convention, mirror direction -theta_i); mirror: positive on the mirror's side;
                     azimuth: a column phi gives the viewer's azimuth, 0 on the lamp's side, 180 in the mirror
                     direction (less that of the lamp, where there is a column phi_i)
    geometry         for a table without angles, "45:0": theta_i and theta_r of all its rows, in degrees
    quantity         brdf (1/sr), reflectance (factor: 1 for the perfect diffuser in every geometry) or
                     radiance (1 for the perfect diffuser that faces the lamp; falls with cos theta_i)
    scale            the number that stands for 1: 1, or 100 for per cent; for brdf optional (1)
    illuminant       of the XYZ: "D50", ...; for spectra optional (D65)
    observer         of the XYZ: its name in colour-science; for spectra optional (10 degrees)
    white            XYZ of the perfect diffuser, Y = 1; optional, by default of illuminant and observer
    source           where the measurements come from; optional, by default the file's name
    columns          a table from our names of columns to the file's, for those that differ:
                     patch, slope, CMYK_C, CMYK_M, CMYK_Y, CMYK_K, theta_i, phi_i, theta_r, phi, X, Y, Z,
                     LAB_L, LAB_A, LAB_B
    spectral_prefix  text before the wavelength in the names of spectral columns; optional, by default of
                     several usual ones (400, 400nm, nm400, R400, SPECTRAL_NM400)

They come from keyword arguments, from a TOML file, or from comment lines of TOML at the head of a CSV file
whose first line is `# schema = "iccbrdf-measurements"`, as `write_measurements` writes them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from iccbrdf.brdf.primaries import ILLUMINANTS, OBSERVERS
from iccbrdf.brdf.records import Record
from iccbrdf.errors import InputError, LimitError, UsageError
from iccbrdf.files import StrPath, read_whole
from iccbrdf.toml import parse_toml

MAX_BYTES = 1 << 16
"""Of declarations, in a file or at the head of a table: the reading of TOML may take their square."""
SCHEMA = "iccbrdf-measurements"
VERSION = 1

CHOICES: dict[str, tuple[str, ...]] = {
    "format": ("csv", "tsv", "cgats", "cornell"),
    "angles": ("degree", "radian"),
    "view_angles": ("lamp", "mirror", "azimuth"),
    "quantity": ("brdf", "reflectance", "radiance"),
    "illuminant": ILLUMINANTS,
    "observer": OBSERVERS,
}
"""The declarations that are one of a few words."""

KEYS = (*CHOICES, "delimiter", "geometry", "scale", "white", "source", "columns", "spectral_prefix")


class Declarations:
    """The declarations about one file, checked as they are asked for."""

    def __init__(self, path: StrPath, values: Mapping[str, Any]) -> None:
        # Through JSON, which `Record` is made for: tuples become lists, and TOML's dates become texts.
        self.record = Record(str(path), "declarations", json.loads(json.dumps(dict(values), default=str)))
        self.record.check_keys(KEYS)
        for key in CHOICES:
            if key in self:
                self.choice(key)

    def __contains__(self, key: str) -> bool:
        return key in self.record.values

    def with_header(self, header: Mapping[str, Any]) -> Declarations:
        """
        Return these declarations and those of the file itself.

        Raises
        ------
        InputError
            The two contradict each other, or a key of the file's is unknown.
        """
        values = Declarations(self.record.file, header).record.values
        for key, value in self.record.values.items():
            if values.setdefault(key, value) != value:
                raise self.record.error(f"{key} is {value!r}, but the file says {values[key]!r}")
        return Declarations(self.record.file, values)

    def choice(self, key: str, default: str | None = None) -> str:
        """Return one of the words of `CHOICES`; without a default it must be declared."""
        if key in self:
            return self.record.choice(key, CHOICES[key])
        if default is None:
            raise self.missing(key, " or ".join(CHOICES[key]) if len(CHOICES[key]) < 5 else "its name")
        return default

    def missing(self, key: str, expected: str) -> InputError:
        """Return the error about a declaration that is needed and not there."""
        return InputError(f"{self.record.file}: {key} is not declared, expected {expected}")

    def scale(self) -> float:
        """Return the number that stands for 1."""
        if "scale" in self:
            return self.record.number("scale", 1e-12)
        if self.choice("quantity") == "brdf":
            return 1.0
        raise self.missing("scale", "the number that stands for the perfect diffuser, such as 1 or 100")

    def geometry(self) -> tuple[float, float]:
        """Return theta_i and theta_r in degrees of a table without angles."""
        text = self.record.text("geometry")
        try:
            theta_i, theta_r = (float(part) for part in text.split(":"))
        except ValueError:
            raise self.record.error(
                f'geometry is {text!r}, expected theta_i:theta_r, such as "45:0"'
            ) from None
        return theta_i, theta_r

    def white(self) -> tuple[float, ...] | None:
        """Return the declared XYZ of the perfect diffuser."""
        return self.record.numbers("white", 3, 1e-4) if "white" in self else None

    def delimiter(self) -> str:
        """Return the character between the fields of a CSV file."""
        delimiter = self.text("delimiter", ",") if self.record.values.get("delimiter") != "\t" else "\t"
        if len(delimiter) != 1 or delimiter in '"\r\n':
            raise self.record.error(f"delimiter is {delimiter!r}, expected one character")
        return delimiter

    def columns(self) -> dict[str, str]:
        """Return the file's names of columns by ours, for those that were declared."""
        if "columns" not in self:
            return {}
        columns = self.record.record("columns")
        return {name: columns.text(name) for name in columns.values}

    def text(self, key: str, default: str) -> str:
        """Return a text or its default."""
        return self.record.text(key) if key in self else default


def read_declarations(path: StrPath) -> dict[str, Any]:
    """
    Read declarations from a TOML file, for `read_measurements(table, **read_declarations(path))`.

    Raises
    ------
    InputError
        The file cannot be read or is not TOML.
    LimitError
        The file is larger than MAX_BYTES.
    """
    try:
        text = read_whole(path, MAX_BYTES).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not TOML: {error}") from error
    return _toml(text, str(path))


def parse_declarations(items: Iterable[str]) -> dict[str, Any]:
    """
    Return declarations written `KEY=VALUE`, as on a command line.

    Raises
    ------
    UsageError
        An item has no `=`.

    Examples
    --------
    >>> parse_declarations(["angles=radian", "scale=100", "columns.theta_i=Inc", "white=[0.9, 1, 1.1]"])
    {'angles': 'radian', 'scale': 100, 'white': [0.9, 1, 1.1], 'columns': {'theta_i': 'Inc'}}
    """
    values: dict[str, Any] = {}
    columns: dict[str, str] = {}
    for item in items:
        key, equals, text = item.partition("=")
        if not key or not equals:
            raise UsageError(f"{item!r} is no declaration, expected KEY=VALUE")
        if key.startswith("columns."):
            columns[key.removeprefix("columns.")] = text
        else:
            values[key] = _value(text)
    if columns:
        values["columns"] = columns
    return values


def header_declarations(text: str, path: StrPath) -> dict[str, Any]:
    """Return the declarations at the head of a file, TOML that states the schema.

    Raises
    ------
    InputError
        It is not TOML, or of another schema or version.
    LimitError
        It is larger than MAX_BYTES.
    """
    header = Record(str(path), "header", _toml(text, f"{path}: header"))
    header.choice("schema", [SCHEMA])
    if header.number("version", 1) != VERSION:
        raise header.error(f"version is {header.values['version']}, expected {VERSION}")
    return {key: value for key, value in header.values.items() if key not in ("schema", "version")}


def _toml(text: str, place: str) -> dict[str, Any]:
    if len(text) > MAX_BYTES:
        raise LimitError(f"{place}: larger than the limit of {MAX_BYTES} bytes")
    try:
        return parse_toml(text)
    except ValueError as error:
        raise InputError(f"{place}: is not TOML: {error}") from error


def _value(text: str) -> Any:
    """A number or a list, where the text is one."""
    try:
        value = parse_toml(f"value = {text}")["value"]
    except ValueError:
        return text
    return value if isinstance(value, int | float | list | str) else text
