"""Checks of processing elements: channels along the chain, and the numbers of matrices, tables and curves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from iccbrdf.icc import (
    CurveSet,
    LutAToB,
    LutBToA,
    Matrix,
    MultiProcess,
    TintArray,
    UnknownElement,
    channel_count,
)
from iccbrdf.validate.elements import Located
from iccbrdf.validate.findings import Finding, finding
from iccbrdf.validate.registry import SIDES
from iccbrdf.validate.subject import Subject

_CONVERSIONS = ("c2sp", "s2cp")
"""Transforms from XYZ to XYZ."""
_ELEMENT_HEAD = 12
"""Bytes of an element before its own data: type, reserved, channels."""


def check_channels(subject: Subject) -> Iterator[Finding]:
    """Transforms against the spaces that the header states."""
    for tag in subject.tags.values():
        value = tag.value
        if not isinstance(value, (MultiProcess, LutAToB, LutBToA)):
            continue
        if isinstance(value, MultiProcess) and not value.elements:
            yield finding("MPE-004", tag.place, "found no element: the transform is the identity")
        found = value.inputs, value.outputs
        for side, count, (space, expected) in zip(
            ("inputs", "outputs"), found, _expected(subject, tag.signature), strict=True
        ):
            if expected is not None and count != expected:
                yield finding("MPE-001", tag.place, f"found {count} {side}, expected {expected} for {space}")


def _expected(subject: Subject, signature: str) -> Iterator[tuple[str, int | None]]:
    """Of both sides of a transform the space, in words, and its channels if they are known."""
    if signature in _CONVERSIONS:
        yield from [("XYZ", 3)] * 2
        return
    for field in SIDES.get(signature, (None, None)):
        space = getattr(subject.header, field) if field else ""
        yield f"the header's {field} {space!r}", channel_count(space)


def check_elements(subject: Subject) -> Iterator[Finding]:
    """Each element by itself."""
    for element in subject.elements():
        record = element.record
        if any(element.data[4:8]):
            message = f"found {bytes(element.data[4:8]).hex()}, expected zeros"
            yield finding("MPE-006", element.place, message)
        if not record.inputs or not record.outputs:
            message = f"found {record.inputs} inputs and {record.outputs} outputs, expected at least one"
            yield finding("MPE-007", element.place, message)
        if isinstance(record, UnknownElement):
            message = "found an element that is not known here, so that the transform cannot run"
            yield finding("MPE-005", element.place, message)
        if isinstance(record, Matrix):
            yield from _stored_whole(element)
        yield from _finite(element)


def _stored_whole(element: Located) -> Iterator[Finding]:
    """The reference writes all numbers of a matrix, and its reader tolerates two shorter forms."""
    matrix = element.record
    expected = 4 * matrix.outputs * (matrix.inputs + 1)
    stored = len(element.data) - _ELEMENT_HEAD
    if stored != expected:
        what = "no coefficients, so that inputs are ignored" if matrix.matrix is None else "no offsets"
        yield finding("MPE-009", element.place, f"found {what} ({stored} bytes), expected {expected} bytes")


def _finite(element: Located) -> Iterator[Finding]:
    for name, values in _numbers(element.record):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            message = f"{name}: found {values.reshape(-1)[bad[0]]} as value {bad[0]} ({len(bad)} such)"
            yield finding("MPE-008", element.place, message)


def _numbers(record: Any) -> Iterator[tuple[str, Any]]:
    """The arrays of an element, by name."""
    if isinstance(record, CurveSet):
        for index, curve in enumerate(record.curves):
            for part in (curve, *getattr(curve, "segments", ())):
                yield from ((f"curve {index}, {name}", values) for name, values in _own(part))
    elif isinstance(record, TintArray):
        yield "values", np.asarray(record.values.values, np.float64)
    else:
        yield from _own(record)


def _own(record: Any) -> Iterator[tuple[str, Any]]:
    """The arrays of a record, and its tuples of numbers."""
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            yield field.name, value
        elif isinstance(value, tuple) and value and all(isinstance(v, float) for v in value):
            yield field.name, np.array(value)
