"""What is examined: the parts of a profile file, read one by one so that a broken one hides no other."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from iccbrdf.errors import LimitError, ProfileError, ProfileWarning
from iccbrdf.icc import TAGS, Header, MultiProcess, Unknown
from iccbrdf.icc.header import SIZE
from iccbrdf.icc.layout import shown
from iccbrdf.icc.profile import MAX_TAGS
from iccbrdf.icc.reader import Budget, Reader
from iccbrdf.validate.elements import Located, located, read_leniently
from iccbrdf.validate.findings import Finding, Place, finding, of_message

TABLE = SIZE
"""Byte offset of the tag table."""
ROW = 12
"""Bytes of a row of the tag table."""

OVERSTATED = "main function: found size"
"""How the reader's warning about a calculator begins whose function claims more bytes than it takes."""


@dataclass(frozen=True)
class Entry:
    """A row of the tag table; `position` is the byte offset of the row itself."""

    signature: str
    offset: int
    size: int
    position: int

    @property
    def place(self) -> Place:
        """The row, as a place in the tag table."""
        return Place(f"tag table, {shown(self.signature)}", self.position, self.signature)

    @property
    def end(self) -> int:
        return self.offset + self.size


@dataclass(frozen=True)
class Tag:
    """A tag that lies in the file; `value` is None where it cannot be decoded.

    `elements` are those that could be read of a multiProcessElementsType, with the ones inside them.
    """

    entry: Entry
    data: bytes
    value: Any
    elements: tuple[Located, ...]

    @property
    def signature(self) -> str:
        return self.entry.signature

    @property
    def type(self) -> str:
        """The signature of the tag's type."""
        return self.data[:4].decode("latin-1")

    @property
    def place(self) -> Place:
        return Place.of_tag(self.signature, self.entry.offset)


@dataclass
class Subject:
    """A profile file, and what went wrong while it was read.

    `header` is None for a file that is no profile at all; then there is nothing else.
    """

    source: str
    data: bytes
    header: Header | None = None
    entries: tuple[Entry, ...] = ()
    tags: dict[str, Tag] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)

    @property
    def end(self) -> int:
        """Where the profile ends: at the size in the header, but not beyond the file."""
        return min(len(self.data), self.header.size) if self.header else len(self.data)

    @property
    def table_end(self) -> int:
        return TABLE + 4 + ROW * len(self.entries)

    @property
    def version(self) -> int:
        """The major version."""
        return self.header.version[0] if self.header else 0

    def value(self, signature: str, *types: type) -> Any:
        """The decoded tag; None where it is missing, malformed or of none of the `types`."""
        tag = self.tags.get(signature)
        return tag.value if tag is not None and isinstance(tag.value, types) else None

    def place(self, signature: str) -> Place:
        """Where a tag is."""
        return self.tags[signature].place

    @cached_property
    def distinct(self) -> tuple[Tag, ...]:
        """The tags, of those that share their data the first one."""
        first: dict[tuple[int, int], Tag] = {}
        for tag in self.tags.values():
            first.setdefault((tag.entry.offset, tag.entry.size), tag)
        return tuple(first.values())

    def elements(self) -> Iterator[Located]:
        """All processing elements that could be read, those inside calculators and curves too."""
        for tag in self.distinct:
            yield from tag.elements


def open_subject(data: bytes, source: str) -> Subject:
    """Read all of `data` that can be read."""
    subject = Subject(source, data)
    try:
        subject.header = Header.read(Reader(data, source, "header"))
    except ProfileError as error:
        subject.findings.append(of_message("HDR-001", error, Place("header"), source))
        return subject
    _read_table(subject)
    _read_tags(subject)
    return subject


def _read_table(subject: Subject) -> None:
    place = Place("tag table", TABLE)
    room = subject.end - TABLE - 4
    if room < 0:
        subject.findings.append(finding("TAB-001", place, "the file ends before the number of tags"))
        return
    count = int.from_bytes(subject.data[TABLE : TABLE + 4], "big")
    if count * ROW > room:
        message = f"found {count} tags, expected at most {room // ROW}, for which the file has room"
        subject.findings.append(finding("TAB-001", place, message))
    if count > MAX_TAGS:
        message = f"found {count} tags, expected at most {MAX_TAGS}; only these are examined"
        subject.findings.append(finding("TAB-002", place, message))
    entries = []
    for index in range(min(count, room // ROW, MAX_TAGS)):
        position = TABLE + 4 + ROW * index
        name, offset, size = struct.unpack_from(">4sII", subject.data, position)
        entries.append(Entry(name.decode("latin-1"), offset, size, position))
    subject.entries = tuple(entries)


def _read_tags(subject: Subject) -> None:
    """Decode each tag whose bytes are in the file, those that are shared once."""
    known: dict[tuple[int, int], Tag] = {}
    budget, left = Budget(), subject.end
    for entry in subject.entries:
        if entry.end > subject.end or entry.size < 8 or entry.signature in subject.tags:
            continue
        span = entry.offset, entry.size
        if span not in known:
            left -= entry.size
            if left < 0:
                message = "found tags that overlap and hold more than the file together; it is not examined"
                place = Place.of_tag(entry.signature, entry.offset)
                subject.findings.append(finding("TAG-002", place, message))
                continue
            known[span] = _read_tag(subject, entry, budget)
        same = known[span]
        subject.tags[entry.signature] = Tag(entry, same.data, same.value, same.elements)


def _read_tag(subject: Subject, entry: Entry, budget: Budget) -> Tag:
    data = subject.data[entry.offset : entry.end]
    place = Place.of_tag(entry.signature, entry.offset)
    reader = Reader(data, subject.source, place.text, start=entry.offset, budget=Budget(budget))
    problem: Exception | None = None
    value: Any = None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            value = TAGS.read(reader)
        except (ProfileError, LimitError) as error:
            problem = error
    for warning in caught:
        if issubclass(warning.category, ProfileWarning):
            rule = "PRG-002" if OVERSTATED in str(warning.message) else "TAG-003"
            subject.findings.append(of_message(rule, warning.message, place, subject.source))
    elements: tuple[Located, ...] = ()
    if isinstance(value, MultiProcess):
        elements = located(value, data, place)
    if problem is not None:
        elements, found = read_leniently(data, place, subject.source, budget)
        if not found:
            rule = "TAG-002" if isinstance(problem, LimitError) else "TAG-001"
            found = [of_message(rule, problem, place, subject.source)]
        subject.findings += found
    elif isinstance(value, Unknown):
        message = f"found type {value.signature!r}, which is not decoded here"
        subject.findings.append(finding("TAG-004", place, message))
    return Tag(entry, data, value, elements)
