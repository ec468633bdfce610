"""Tag types made of other tags or of named values: structures and dictionaries."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from iccbrdf.icc.fields import SIGNATURE, U32, tag_layout, utf16_text
from iccbrdf.icc.layout import Field, FieldType, Record, Seen, shown
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.tags import TAGS, Mluc


@dataclass(frozen=True)
class Member:
    """A tag inside a structure, and the four characters that it is known by there."""

    signature: str
    value: Any


class _Members(FieldType):
    """A table of (signature, offset, size) from the start of the structure, and the tags behind it.

    One object in several places is stored once.
    """

    _entry = struct.Struct(">4sII")

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Member, ...]:
        table = reader.take(self._entry.size * seen["count"], f"table of {seen['count']} members")
        entries = list(self._entry.iter_unpack(table))
        names = [SIGNATURE.decode(signature) for signature, _, _ in entries]
        values = reader.parts(
            [(offset, size) for _, offset, size in entries],
            lambda index: f"member {shown(names[index])}",
            lambda part, _: TAGS.read(part),
        )
        return tuple(map(Member, names, values))

    def write(self, out: bytearray, value: Sequence[Member], record: Any) -> None:
        table = len(out)
        out += bytes(self._entry.size * len(value))
        placed: dict[int, tuple[int, int]] = {}
        for index, member in enumerate(value):
            if id(member.value) not in placed:
                out += bytes(-len(out) % 4)
                data = member.value.to_bytes()
                placed[id(member.value)] = len(out), len(data)
                out += data
            head = SIGNATURE.encode(member.signature)
            self._entry.pack_into(out, table + self._entry.size * index, head, *placed[id(member.value)])

    def normal(self, value: Iterable[Member]) -> tuple[Member, ...]:
        members = tuple(Member(SIGNATURE.normal(m.signature), TAGS.check(m.value)) for m in value)
        names = [m.signature for m in members]
        if len(set(names)) < len(names):
            raise ValueError(f"found {', '.join(map(shown, names))}, expected every signature once")
        return members


@TAGS.add("tstr")
@dataclass(frozen=True, eq=False)
class TagStruct(Record):
    """tagStructType: tags by signature; `type` says which ones to expect (`brdf`: parameters of a BRDF)."""

    type: str
    members: tuple[Member, ...]

    signature = "tstr"
    layout = tag_layout(
        signature,
        Field("type", SIGNATURE),
        Field("count", U32, derived=lambda r: len(r.members)),
        Field("members", _Members()),
    )

    def get(self, signature: str) -> Any:
        """The member's tag, None where there is none of that signature."""
        return next((m.value for m in self.members if m.signature == signature), None)


@dataclass(frozen=True)
class Entry:
    """A name with its value, None where it has none, and both as users of other languages see them."""

    name: str
    value: str | None = None
    display_name: Mluc | None = None
    display_value: Mluc | None = None


class _Entries(FieldType):
    """Records of two to four positions (offset and size; 0 and 0 for none), and what they point to."""

    _position = struct.Struct(">II")

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Entry, ...]:
        table = reader.take(seen["record_size"] * seen["count"], f"{seen['count']} records")
        columns = seen["record_size"] // 8
        spans = list(self._position.iter_unpack(table))
        stored = [index for index, (_, size) in enumerate(spans) if size]
        parts = reader.parts(
            [spans[index] for index in stored],
            lambda i: f"record {stored[i] // columns}",
            lambda part, i: self._localised(part) if stored[i] % columns > 1 else utf16_text(part),
        )
        values: dict[int, Any] = dict(zip(stored, parts, strict=True))
        # A text that begins somewhere but has no size is there and empty.
        values |= {i: "" for i, (at, size) in enumerate(spans) if at and not size and i % columns < 2}
        rows = range(0, len(spans), columns)
        return tuple(
            Entry(values.get(row, ""), *(values.get(row + i) for i in range(1, columns))) for row in rows
        )

    @staticmethod
    def _localised(reader: Reader) -> Mluc:
        value = TAGS.read(reader)
        if not isinstance(value, Mluc):
            raise reader.error(f"found type {value.signature!r}, expected 'mluc'", at=0)
        return value

    def write(self, out: bytearray, value: Sequence[Entry], record: Any) -> None:
        columns = record.record_size // 8
        table = len(out)
        out += bytes(record.record_size * len(value))
        for row, entry in enumerate(value):
            parts = (entry.name, entry.value, entry.display_name, entry.display_value)
            for column, part in enumerate(parts):
                if part is not None:
                    out += bytes(-len(out) % 4)
                    data = part.encode("utf-16-be") if isinstance(part, str) else part.to_bytes()
                    at = table + 8 * (columns * row + column)
                    self._position.pack_into(out, at, len(out), len(data))
                    out += data

    def normal(self, value: Iterable[Entry]) -> tuple[Entry, ...]:
        entries = tuple(value)
        for entry in entries:
            if not isinstance(entry, Entry):
                raise ValueError(f"found {entry!r}, expected an Entry")
            for text in (entry.name, entry.value):
                if text is not None:
                    text.encode("utf-16-be")
            for localised in (entry.display_name, entry.display_value):
                if localised is not None and not isinstance(localised, Mluc):
                    raise ValueError(f"found {localised!r}, expected an Mluc")
        return entries


@TAGS.add("dict")
@dataclass(frozen=True, eq=False)
class Dictionary(Record):
    """dictType: names and values of whatever a profile's maker wants to say (tag `meta`).

    `record_size`: 32 bytes, or 24 without room for the values' translations, or 16 without that for names.
    """

    entries: tuple[Entry, ...]
    record_size: int = 32

    signature = "dict"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.entries)),
        Field("record_size", U32, valid=(16, 24, 32)),
        Field("entries", _Entries()),
    )

    def check(self) -> None:
        for entry in self.entries:
            needed = 32 if entry.display_value else 24 if entry.display_name else 16
            if needed > self.record_size:
                raise ValueError(
                    f"record_size: found {self.record_size}, expected {needed} for entry {entry.name!r}"
                )
