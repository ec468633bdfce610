"""Checks of the tag table: where the tags are, and what is between them."""

from __future__ import annotations

from collections.abc import Iterator

from iccbrdf.icc.layout import shown
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.subject import Entry, Subject


def check_table(subject: Subject) -> Iterator[Finding]:
    """Each row, and the rows together."""
    if subject.header is None:
        return
    seen: set[str] = set()
    for entry in subject.entries:
        if entry.signature in seen:
            yield finding("TAB-003", entry.place, "found the signature a second time")
        seen.add(entry.signature)
        if entry.offset < subject.table_end or entry.end > subject.end:
            message = (
                f"found bytes {entry.offset} to {entry.end}, expected {subject.table_end} to {subject.end}"
            )
            yield finding("TAB-004", entry.place, message)
        if entry.offset % 4:
            yield finding("TAB-005", entry.place, f"found offset {entry.offset}, expected a multiple of 4")
        if entry.size < 8:
            yield finding("TAB-007", entry.place, f"found {entry.size} bytes, expected at least 8")
    yield from _between(subject)


def _between(subject: Subject) -> Iterator[Finding]:
    """Tags that overlap, and what stands between them."""
    inside = [e for e in subject.entries if subject.table_end <= e.offset and e.end <= subject.end]
    spans: dict[tuple[int, int], Entry] = {}
    for entry in inside:
        spans.setdefault((entry.offset, entry.size), entry)
    end, last = subject.table_end, "tag table"
    for (offset, size), entry in sorted(spans.items(), key=lambda item: item[0]):
        if offset < end:
            message = f"found it at {offset}, inside of {last}, which ends at {end}"
            yield finding("TAB-006", entry.place, message)
        else:
            yield from _gap(subject, end, offset)
        if offset + size > end:
            end, last = offset + size, shown(entry.signature)
    if len(inside) == len(subject.entries):
        yield from _gap(subject, end, subject.end)


def _gap(subject: Subject, start: int, end: int) -> Iterator[Finding]:
    between = subject.data[start:end]
    place = Place("between tags", start)
    if len(between) > 3:
        yield finding("TAB-008", place, f"found {len(between)} bytes that no tag points to, expected up to 3")
    elif any(between):
        yield finding("TAB-008", place, f"found {between.hex()}, expected zeros")
