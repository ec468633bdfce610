"""Checks of the names of the multiplex channels and of their defaults."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from iccbrdf.icc import NumberArray, TagArray, channel_count
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.subject import Subject

DEFAULT_TYPES = ("ui08", "ui16", "fl16", "fl32", "fl64")
"""Types that a CMM takes multiplex defaults in."""


def check_names(subject: Subject) -> Iterator[Finding]:
    """The tag mcta."""
    array = subject.value("mcta", TagArray)
    if array is None or subject.header is None:
        return
    place = subject.place("mcta")
    if array.array_type == "mcta":
        yield finding("MCS-004", place, "found array type 'mcta', expected 'utf8'")
    elif array.array_type != "utf8":
        yield finding("MCS-005", place, f"found array type {array.array_type!r}, expected 'utf8'")
    try:
        names = array.texts()
    except ValueError as error:
        yield finding("MCS-001", place, str(error))
        return
    expected = channel_count(subject.header.mcs) if subject.header.mcs.startswith("mc") else None
    if expected is not None and len(names) != expected:
        message = f"found {len(names)} names, expected {expected} by the header's {subject.header.mcs!r}"
        yield finding("MCS-002", place, message)
    yield from _distinct(names, place)


def _distinct(names: tuple[str, ...], place: Place) -> Iterator[Finding]:
    seen: set[str] = set()
    folded: dict[str, str] = {}
    for index, name in enumerate(names):
        here = place.inner(f"item {index}", place.offset)
        alike = folded.setdefault(name.casefold(), name)
        if name in seen:
            yield finding("MCS-003", here, f"found channel {name!r} a second time")
        elif alike != name:
            yield finding("MCS-006", here, f"found {name!r}, which differs from {alike!r} by case alone")
        elif not name.strip() or name != name.strip():
            yield finding("MCS-006", here, f"found {name!r}, expected a name without blanks around it")
        seen.add(name)


def check_defaults(subject: Subject) -> Iterator[Finding]:
    """The tag mdv."""
    if "mdv " not in subject.tags or subject.header is None:
        return
    place, found = subject.place("mdv "), subject.tags["mdv "].type
    if found not in DEFAULT_TYPES:
        message = f"found type {found!r}, expected {' or '.join(DEFAULT_TYPES)}"
        yield finding("MCS-007", place, message)
    values = subject.value("mdv ", NumberArray)
    if values is None:
        return
    expected = channel_count(subject.header.mcs) if subject.header.mcs.startswith("mc") else None
    if expected is not None and len(values.values) != expected:
        yield finding("MCS-008", place, f"found {len(values.values)} values, expected {expected}")
    if not np.isfinite(values.values).all():
        index = int(np.flatnonzero(~np.isfinite(values.values))[0])
        yield finding("MCS-009", place, f"found {values.values[index]} as value {index}, expected a number")
