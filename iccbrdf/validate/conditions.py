"""Checks of viewing conditions and media white."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from iccbrdf.calc.elements import apply
from iccbrdf.icc import D50, XYZ, Matrix, MultiProcess, ViewingConditions
from iccbrdf.validate.findings import Finding, finding
from iccbrdf.validate.header import field_place
from iccbrdf.validate.subject import Subject

_OBSERVERS, _ILLUMINANTS = range(3), range(23)
_CUSTOM = 0
_STANDARD = (1, 1)
"""Observer of 2 degrees, illuminant D50."""
_BY_TEMPERATURE = (9, 10)
_CLOSE = 1e-3
"""Whites that differ less are one: two s15Fixed16 numbers and a rounded table stand between them."""


def check_conditions(subject: Subject) -> Iterator[Finding]:
    """The tag svcn, the header's illuminant, and the transforms c2sp and s2cp."""
    header, svcn = subject.header, subject.value("svcn", ViewingConditions)
    if header is None or subject.version < 5:
        return
    if svcn is None:
        stated = header.illuminant
        if "svcn" not in subject.tags and header.pcs and any(stated) and _distance(stated, D50) > _CLOSE:
            message = f"found XYZ {_written(stated)} and no tag svcn, expected D50"
            yield finding("PCC-005", field_place("illuminant"), message)
        return
    sound = True
    for found in (*_listed(subject, svcn), *_tables(subject, svcn)):
        sound = False
        yield found
    if sound:
        yield from _agreement(subject, svcn)


def _listed(subject: Subject, svcn: ViewingConditions) -> Iterator[Finding]:
    place = subject.place("svcn")
    for what, found, known, table in (
        ("observer", svcn.observer, _OBSERVERS, svcn.observer_table),
        ("illuminant", svcn.illuminant, _ILLUMINANTS, svcn.spd),
    ):
        if found not in known:
            yield finding("PCC-001", place, f"{what}: found {found}, expected 0 to {known[-1]}")
        elif found == _CUSTOM and not table.size:
            yield finding("PCC-001", place, f"{what}: found a custom one without a table")
    if svcn.illuminant in _BY_TEMPERATURE and not (math.isfinite(svcn.cct) and svcn.cct > 0):
        message = f"found a colour temperature of {svcn.cct:g} K, expected one above 0"
        yield finding("PCC-001", place, message)


def _tables(subject: Subject, svcn: ViewingConditions) -> Iterator[Finding]:
    place = subject.place("svcn")
    for what, (first, last), table in (
        ("observer", svcn.observer_range, svcn.observer_table),
        ("illuminant", svcn.illuminant_range, svcn.spd),
    ):
        if table.size and not first < last:
            message = f"{what}: found wavelengths from {first:g} to {last:g} nm, expected ones that increase"
            yield finding("PCC-002", place, message)
        if not np.isfinite(table).all():
            yield finding("PCC-002", place, f"{what}: found a number in its table that is not finite")
    if not all(math.isfinite(v) and v > 0 for v in svcn.illuminant_XYZ):
        message = f"illuminant: found XYZ {_written(svcn.illuminant_XYZ)}, expected numbers above 0"
        yield finding("PCC-002", place, message)


def _agreement(subject: Subject, svcn: ViewingConditions) -> Iterator[Finding]:
    """Does the rest of the profile say the same as its viewing conditions?"""
    x, y, z = svcn.illuminant_XYZ
    white = (x / y, 1.0, z / y)
    stated = subject.header.illuminant if subject.header else white
    if any(stated) and _distance(stated, white) > _CLOSE:
        message = f"found XYZ {_written(stated)}, expected {_written(white)} by the tag svcn"
        yield finding("PCC-003", field_place("illuminant"), message)
    if (svcn.observer, svcn.illuminant) == _STANDARD:
        return
    for signature, source, target in (("c2sp", white, D50), ("s2cp", D50, white)):
        if all(entry.signature != signature for entry in subject.entries):
            message = f"the conditions are not D50 and 2 degrees, and there is no tag {signature}"
            yield finding("PCC-004", subject.place("svcn"), message)
            continue
        found = _through(subject.value(signature, MultiProcess), source)
        if found is not None and not _distance(found, target) <= _CLOSE:
            message = f"takes XYZ {_written(source)} to {_written(found)}, expected {_written(target)}"
            yield finding("PCC-006", subject.place(signature), message)


def _through(process: MultiProcess | None, white: tuple[float, ...]) -> tuple[float, ...] | None:
    """`white` after matrices from three to three channels; None for a transform of anything else."""
    if process is None or (process.inputs, process.outputs) != (3, 3):
        return None
    if not all(isinstance(element, Matrix) for element in process.elements):
        return None
    values: Any = white
    for element in process.elements:
        values = apply(element, values, dtype=np.float64)
    return tuple(map(float, values))


def check_media_white(subject: Subject) -> Iterator[Finding]:
    """The tag wtpt."""
    white = subject.value("wtpt", XYZ)
    if white is None:
        return
    if len(white.values) != 1 or min(white.values[0]) <= 0:
        message = f"found {white.values}, expected one XYZ above 0"
        yield finding("PCC-007", subject.place("wtpt"), message)


def _distance(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return max(abs(p - q) for p, q in zip(a, b, strict=True))


def _written(XYZ: tuple[float, ...]) -> str:
    return " ".join(f"{v:.5g}" for v in XYZ)
