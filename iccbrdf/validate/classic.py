"""Checks of the tag types that versions 2 and 4 have, and of profiles inside tags."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeAlias

from iccbrdf.errors import IccBrdfError
from iccbrdf.icc import (
    Chromaticity,
    ColorantOrder,
    DataTag,
    EmbeddedProfile,
    Measurement,
    NamedColours,
    PlainViewingConditions,
    Screening,
    channel_count,
)
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.subject import Subject

_ILLUMINANTS = range(9)
_CHOICES: Mapping[type, tuple[tuple[str, range], ...]] = {
    Chromaticity: (("colorants", range(5)),),
    DataTag: (("kind", range(2)),),
    Measurement: (("observer", range(3)), ("geometry", range(3)), ("illuminant", _ILLUMINANTS)),
    PlainViewingConditions: (("illuminant", _ILLUMINANTS),),
}
"""Fields of the types that stand for a choice, and what they may be."""

_SHAPES = range(8)
"""Of the dots of a screen."""


def check_classic(subject: Subject) -> Iterator[Finding]:
    """What the fields of these types say about one another and about the header."""
    for tag in subject.distinct:
        for field, allowed in _CHOICES.get(type(tag.value), ()):
            yield from _choice(tag.place, field, getattr(tag.value, field), allowed)
        check = _CHECKS.get(type(tag.value))
        if check is not None:
            yield from check(subject, tag.value, tag.place)


def _choice(place: Place, field: str, found: int, allowed: range) -> Iterator[Finding]:
    if found not in allowed:
        yield finding("TAG-011", place, f"{field}: found {found}, expected 0 to {allowed.stop - 1}")


def _screening(subject: Subject, value: Screening, place: Place) -> Iterator[Finding]:
    for index, screen in enumerate(value.screens):
        yield from _choice(place.inner(f"channel {index}", place.offset), "shape", screen.shape, _SHAPES)


def _order(subject: Subject, value: ColorantOrder, place: Place) -> Iterator[Finding]:
    channels = _device_channels(subject)
    if channels is not None and len(value.order) != channels:
        yield finding("TAG-012", place, f"found {len(value.order)} colorants, expected {channels}")
    for number, times in Counter(value.order).items():
        if times > 1:
            yield finding("TAG-012", place, f"found colorant {number} {times} times, expected it once")


def _named(subject: Subject, value: NamedColours, place: Place) -> Iterator[Finding]:
    channels = _device_channels(subject)
    if channels is not None and value.channels not in (0, channels):
        message = f"found {value.channels} device values of each colour, expected {channels} or none"
        yield finding("TAG-013", place, message)
    for name, times in Counter(colour.name for colour in value.colours).items():
        if times > 1:
            yield finding("TAG-014", place, f"found the name {name!r} {times} times, expected it once")


def _device_channels(subject: Subject) -> int | None:
    return channel_count(subject.header.colour_space) if subject.header else None


def _embedded(subject: Subject, value: EmbeddedProfile, place: Place) -> Iterator[Finding]:
    try:
        _ = value.profile
    except IccBrdfError as error:
        yield finding("TAG-010", place, str(error).removeprefix("embedded profile: "))


_Check: TypeAlias = Callable[[Subject, Any, Place], Iterator[Finding]]
_CHECKS: Mapping[type, _Check] = {
    ColorantOrder: _order,
    EmbeddedProfile: _embedded,
    NamedColours: _named,
    Screening: _screening,
}
