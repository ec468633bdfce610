"""The primaries file: model, colorimetry and the fitted parameters of the colours that a print is made of.

A JSON object with these keys:

    schema            "iccbrdf-primaries"
    version           1
    model             name of the model, as in `iccbrdf.brdf.models.MODELS`
    refractive_index  of the coat; optional (1.5), only for models with a Fresnel term
    illuminant        of the XYZ and the parameters: "D50", ...
    observer          "CIE 1931 2 Degree Standard Observer" or "CIE 1964 10 Degree Standard Observer"
    white             XYZ of the perfect diffuser, Y = 1; optional, by default of that illuminant and observer
    geometry          of the XYZ: "45:0"
    source            where the figures come from
    encoding          what a device value of 1 stands for, by family of parameters; optional (1)
    primaries         list of objects: name, XYZ (Y = 1 for white), parameters (a list for X, Y, Z or a
                      number, by family), and optionally CMYK in per cent
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from iccbrdf.brdf.cook_torrance import M_MIN
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.models import MODELS, Model
from iccbrdf.brdf.records import Record, read_record
from iccbrdf.errors import InputError
from iccbrdf.files import StrPath, atomic_output
from iccbrdf.json_text import to_json

SCHEMA = "iccbrdf-primaries"
VERSION = 1

REFRACTIVE_INDEX = 1.5

MIN_NODES, MAX_NODES = 4, 16
"""How many primaries span an interpolation; the papers use 8."""

_COINCIDE = 1e-5
"""Nodes no further apart in each of X, Y, Z are one colour: a tenth of the last digit that is measured."""

OBSERVERS = ("CIE 1931 2 Degree Standard Observer", "CIE 1964 10 Degree Standard Observer")
"""The observers that a profile can state, by the names of colour-science."""

ILLUMINANTS = ("D50", "D65", "D55", "A", "B", "C", "E", *(f"FL{k}" for k in range(1, 13)))
"""The illuminants that a profile can state, by the names of colour-science."""


@dataclass(frozen=True)
class Primary:
    """One colour: its XYZ and its parameters in channel order."""

    name: str
    XYZ: tuple[float, ...]
    parameters: tuple[float, ...]
    CMYK: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Primaries:
    """The contents of a primaries file; see the module for the meaning of the fields."""

    model: str
    illuminant: str
    observer: str
    white: tuple[float, ...]
    geometry: str
    source: str
    primaries: tuple[Primary, ...]
    encoding: Mapping[str, float] = field(default_factory=dict)
    refractive_index: float = REFRACTIVE_INDEX
    file: str = field(default="", compare=False)
    """Where it was read from, for messages."""

    @property
    def scales(self) -> Array:
        """The parameter that a device value of 1 stands for, by channel of the model, shape (k,)."""
        return np.array(
            [
                scale
                for family, width in MODELS[self.model].parameters
                for scale in [self.encoding.get(family, 1.0)] * width
            ]
        )

    @property
    def XYZ(self) -> Array:
        """XYZ of the primaries, Y = 1 for white, shape (primaries, 3)."""
        return np.array([primary.XYZ for primary in self.primaries])

    @property
    def parameters(self) -> Array:
        """Parameters of the primaries in channel order, shape (primaries, k)."""
        return np.array([primary.parameters for primary in self.primaries])


def read_primaries(path: StrPath) -> Primaries:
    """
    Read a primaries file.

    Raises
    ------
    InputError
        The file cannot be read, a key is missing, unknown or of the wrong type, Y of the
        white is not 1, two primaries have the same name, an XYZ is not positive, a parameter is out of the
        range of its encoding or m is below `M_MIN`.
        The message names the file, the entry, what was found and what was expected.
    """
    record = read_record(path, SCHEMA, VERSION)
    model = MODELS[record.choice("model", MODELS)]
    keys = ["schema", "version", "model", "illuminant", "observer", "white", "geometry", "source"]
    if model.has_fresnel:
        keys.append("refractive_index")
    elif "refractive_index" in record.values:
        raise record.error(f"refractive_index is given, but the model {model.name} has none")
    record.check_keys([*keys, "encoding", "primaries"])
    illuminant = record.choice("illuminant", ILLUMINANTS)
    observer = record.choice("observer", OBSERVERS)
    encoding = read_encoding(record, model)
    return Primaries(
        model=model.name,
        illuminant=illuminant,
        observer=observer,
        white=read_white(record, illuminant, observer),
        geometry=record.text("geometry"),
        source=record.text("source"),
        primaries=read_entries(record, model, encoding),
        encoding=encoding,
        refractive_index=(
            record.number("refractive_index", 1) if "refractive_index" in record.values else REFRACTIVE_INDEX
        ),
        file=record.file,
    )


def check_nodes(primaries: Primaries) -> None:
    """
    Refuse primaries that a map from XYZ to parameters cannot be interpolated between.

    Raises
    ------
    InputError
        Fewer than 4 or more than 16 primaries, an XYZ that is not above 0, or two of one colour.
    """
    count = len(primaries.primaries)
    file = f"{primaries.file}: " if primaries.file else ""
    if not MIN_NODES <= count <= MAX_NODES:
        raise InputError(
            f"{file}{count} primaries, expected {MIN_NODES} to {MAX_NODES} to interpolate between"
        )
    XYZ = primaries.XYZ
    for k, primary in enumerate(primaries.primaries):
        where = f"{file}primary {k + 1} ({primary.name})"
        if not np.all(XYZ[k] > 0):
            raise InputError(f"{where}: XYZ is {list(primary.XYZ)}, expected numbers above 0")
        same = np.flatnonzero(np.max(np.abs(XYZ[:k] - XYZ[k]), axis=-1) <= _COINCIDE)
        if same.size:
            raise InputError(
                f"{where}: XYZ is {list(primary.XYZ)}, that of primary {same[0] + 1} "
                f"({primaries.primaries[same[0]].name}), expected colours more than {_COINCIDE:g} apart"
            )


def write_primaries(primaries: Primaries, path: StrPath, *, overwrite: bool = False) -> None:
    """
    Write a primaries file; the same primaries give the same bytes.

    Raises
    ------
    UsageError
        The file cannot be written, or exists and `overwrite` is not set.
    """
    model = MODELS[primaries.model]
    contents = {
        "schema": SCHEMA,
        "version": VERSION,
        "model": model.name,
        **({"refractive_index": primaries.refractive_index} if model.has_fresnel else {}),
        "illuminant": primaries.illuminant,
        "observer": primaries.observer,
        "white": list(primaries.white),
        "geometry": primaries.geometry,
        "source": primaries.source,
        "encoding": encoding_of(primaries),
        "primaries": entries_of(primaries),
    }
    with atomic_output(path, overwrite=overwrite) as temporary:
        temporary.write_bytes(f"{to_json(contents)}\n".encode())


def encoding_of(primaries: Primaries) -> dict[str, float]:
    """Return what stands under `encoding` in a primaries file."""
    families = MODELS[primaries.model].parameters
    return {family: primaries.encoding.get(family, 1.0) for family, _ in families}


def entries_of(primaries: Primaries) -> list[dict[str, Any]]:
    """Return what stands under `primaries` in a primaries file."""
    model = MODELS[primaries.model]
    entries = []
    for primary in primaries.primaries:
        families = model.split(primary.parameters)
        entries.append(
            {
                "name": primary.name,
                **({"CMYK": list(primary.CMYK)} if primary.CMYK is not None else {}),
                "XYZ": list(primary.XYZ),
                "parameters": {
                    family: values.tolist() if width > 1 else values.item()
                    for (family, width), values in zip(model.parameters, families, strict=True)
                },
            }
        )
    return entries


def white_of(illuminant: str, observer: str) -> tuple[float, float, float]:
    """
    Return the XYZ of the perfect diffuser, Y = 1, by integration of the illuminant's spectrum.

    Parameters
    ----------
    illuminant, observer
        One of `ILLUMINANTS`, one of `OBSERVERS`.
    """
    # Takes a second to import, and most primaries files state their white.
    import colour

    matching_functions = colour.MSDS_CMFS[observer]
    diffuser = colour.sd_ones(matching_functions.shape)
    spectrum = colour.SDS_ILLUMINANTS[illuminant].copy().align(matching_functions.shape)
    X, Y, Z = colour.sd_to_XYZ(diffuser, matching_functions, spectrum, method="Integration")
    return (float(X / Y), 1.0, float(Z / Y))


def read_white(record: Record, illuminant: str, observer: str) -> tuple[float, ...]:
    """Return the white that a file states, or else that of its illuminant and observer."""
    if "white" not in record.values:
        return white_of(illuminant, observer)
    white = record.numbers("white", 3, 1e-4)
    if white[1] != 1:
        raise record.error(f"white[1] is {white[1]:g}, expected 1, the Y of the perfect diffuser")
    return white


def read_encoding(record: Record, model: Model) -> dict[str, float]:
    """Return the encoding that a file states, or else 1 for each family."""
    if "encoding" not in record.values:
        return {family: 1.0 for family, _ in model.parameters}
    encoding = record.record("encoding")
    families = [family for family, _ in model.parameters]
    encoding.check_keys(families)
    return {
        family: encoding.number(family, M_MIN) if family in encoding.values else 1.0 for family in families
    }


def read_entries(record: Record, model: Model, encoding: Mapping[str, float]) -> tuple[Primary, ...]:
    """Return the primaries of a file; errors as those of `read_primaries`."""
    entries: dict[str, Primary] = {}
    for entry in record.records("primaries", "primary"):
        entry.check_keys(["name", "CMYK", "XYZ", "parameters"])
        name = entry.text("name")
        if name in entries:
            raise entry.error(f"name {name!r} stands twice, expected different names")
        entries[name] = Primary(
            name=name,
            XYZ=entry.numbers("XYZ", 3, 1e-6),
            parameters=_read_parameters(entry.record("parameters"), model, encoding),
            CMYK=entry.numbers("CMYK", 4, 0, 100) if "CMYK" in entry.values else None,
        )
    return tuple(entries.values())


def _read_parameters(record: Record, model: Model, encoding: Mapping[str, float]) -> tuple[float, ...]:
    record.check_keys(family for family, _ in model.parameters)
    parameters: list[float] = []
    for family, width in model.parameters:
        low = M_MIN if family == "m" else 0.0
        if width == 1:
            parameters.append(record.number(family, low, encoding[family]))
        else:
            parameters += record.numbers(family, width, low, encoding[family])
    return tuple(parameters)
