"""Checks of the tags as such: their types, whether they belong here, and which ones are missing."""

from __future__ import annotations

from collections.abc import Iterator

from iccbrdf.errors import nearest
from iccbrdf.icc.layout import shown
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.registry import TAGS, Required, required
from iccbrdf.validate.subject import TABLE, Subject, Tag

_LOCALISED = ("desc", "cprt", "dmnd", "dmdd", "vued")
"""Texts whose type changed between the versions."""
_OUTPUT_TABLES = ("A2B1", "A2B2", "B2A1", "B2A2", "gamt")
"""What an output profile of version 2 or 4 with tables has besides A2B0 and B2A0."""


def check_tags(subject: Subject) -> Iterator[Finding]:
    """Each tag by its signature and its type."""
    for tag in subject.tags.values():
        if any(tag.data[4:8]):
            yield finding("TAG-006", tag.place, f"found {tag.data[4:8].hex()}, expected zeros")
        if tag.signature in TAGS:
            yield from _registered(subject, tag)
        else:
            yield _private(tag)


def _registered(subject: Subject, tag: Tag) -> Iterator[Finding]:
    row = TAGS[tag.signature]
    types = row.types
    if tag.signature in _LOCALISED and subject.version == 4:
        types = ("mluc",)
    if types and tag.type not in types:
        message = f"found type {tag.type!r}, expected {' or '.join(map(repr, types))}"
        yield finding("TAG-005", tag.place, message)
    device_class = subject.header.device_class if subject.header else ""
    if row.classes and device_class not in row.classes:
        classes = " or ".join(map(repr, row.classes))
        message = f"found it in a profile of class {device_class!r}, expected {classes}"
        yield finding("TAG-007", tag.place, message)


def _private(tag: Tag) -> Finding:
    """A registered signature in other letters is a mistake, any other one may be somebody's own."""
    folded = {name.casefold().strip(): name for name in TAGS}
    near = folded.get(tag.signature.casefold().strip("\0 "))
    if near is not None:
        message = f"found {tag.signature!r}: {nearest(tag.signature, [near])}"
        return finding("TAG-008", tag.place, message)
    return finding("TAG-009", tag.place, f"found a private tag of type {tag.type!r}")


def check_required(subject: Subject) -> Iterator[Finding]:
    """The tags that the class asks for; one that is there but malformed is not missing."""
    header = subject.header
    if header is None:
        return
    present = {entry.signature for entry in subject.entries}
    table = Place("tag table", TABLE)
    wanted = list(required(subject.version, header.device_class))
    if header.device_class == "mvis":
        if header.pcs:
            wanted.append(Required("REQ-002", (("wtpt",),)))
        wanted.append(Required("REQ-006", (("mdv ",),)))
    if header.device_class == "prtr" and subject.version < 5:
        if "A2B0" in present:
            wanted.append(Required("REQ-005", (_OUTPUT_TABLES,)))
        if subject.version == 4 and header.colour_space.endswith("CLR"):
            wanted.append(Required("REQ-005", (("clrt",),)))
    for one in wanted:
        if not any(present.issuperset(tags) for tags in one.tags):
            yield finding(one.rule, table, f"found none, expected {_written(one, present)}")


def _written(one: Required, present: set[str]) -> str:
    """The tags that would do; of a single set those that are not there."""
    if len(one.tags) == 1:
        return " and ".join(shown(tag) for tag in one.tags[0] if tag not in present)
    return " or ".join(" with ".join(shown(tag) for tag in tags) for tags in one.tags)
