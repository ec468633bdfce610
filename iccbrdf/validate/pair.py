"""Checks of a MID and the MVIS that it is to be linked with."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

from iccbrdf.cmm import link
from iccbrdf.errors import IccBrdfError, nearest
from iccbrdf.icc import NumberArray, Profile, TagArray
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.subject import Subject

_LISTED = 8
"""Channels that a message lists."""


def is_pair(first: Subject, second: Subject) -> bool:
    """Are they a MID and an MVIS, in this order?"""
    classes = [subject.header.device_class if subject.header else "" for subject in (first, second)]
    return classes == ["mid ", "mvis"]


def check_pair(mid: Subject, mvis: Subject) -> Iterator[Finding]:
    """Their multiplex channels, matched by name, and whether they link."""
    given, taken = _names(mid), _names(mvis)
    place = Place("multiplex channels")
    if given and taken:
        yield from _missing(given, taken, _defaults(mvis), place)
        dropped = [name for name in given if name not in set(taken)]
        if dropped:
            yield finding("LNK-004", place, f"{_listed(dropped)} of the MID have no namesake in the MVIS")
        yield from _subset(mid, given, taken, place)
        yield from _subset(mvis, taken, given, place)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # each file's own findings tell of them
            link([Profile.from_bytes(subject.data, subject.source) for subject in (mid, mvis)])
    except IccBrdfError as error:
        yield finding("LNK-001", place, str(error))


def _names(subject: Subject) -> tuple[str, ...]:
    """The names of the multiplex channels; none where they cannot be told."""
    array = subject.value("mcta", TagArray)
    try:
        return array.texts() if array is not None else ()
    except ValueError:
        return ()


def _defaults(mvis: Subject) -> Any:
    array = mvis.value("mdv ", NumberArray)
    return () if array is None else array.normalised()


def _missing(
    given: tuple[str, ...], taken: tuple[str, ...], defaults: Any, place: Place
) -> Iterator[Finding]:
    """Channels that the MVIS takes and the MID does not give."""
    have, spare = set(given), [name for name in given if name not in set(taken)]
    for index, name in enumerate(taken):
        if name in have:
            continue
        value = f"takes its default, {defaults[index]:g}" if index < len(defaults) else "has no default"
        near = [other for other in spare if _alike(name, other)]
        if near:
            message = f"{name!r} of the MVIS is not in the MID, and {value}: {nearest(name, near)}"
            yield finding("LNK-002", place, message)
        else:
            yield finding("LNK-003", place, f"{name!r} of the MVIS is not in the MID, and {value}")


def _alike(a: str, b: str) -> bool:
    """Do two names differ by case, blanks and punctuation alone?"""
    first, second = ("".join(filter(str.isalnum, name.casefold())) for name in (a, b))
    return first == second


def _subset(asking: Subject, own: tuple[str, ...], other: tuple[str, ...], place: Place) -> Iterator[Finding]:
    """The order of names where a profile asks for all of its channels in the other one."""
    if asking.header is None or not asking.header.mcs_subset or not set(own) <= set(other):
        return  # the link itself fails where a channel is missing
    if own != other[: len(own)]:
        yield finding("LNK-005", place, f"{asking.source} asks for a subset; {_listed(list(own))} come in "
                      f"another order than {_listed(list(other))}")  # fmt: skip


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return ", ".join(map(repr, names[:_LISTED])) + more
