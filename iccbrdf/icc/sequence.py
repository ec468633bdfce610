"""The tag types that speak of other profiles: those that a device link was made of, and one inside a tag."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from iccbrdf.icc.classic import TextDescription
from iccbrdf.icc.fields import SIGNATURE, U32, U64, Bytes, Embedded, read_spans, tag_layout, write_parts
from iccbrdf.icc.layout import Field, FieldType, Layout, Record, Seen
from iccbrdf.icc.profile import Profile
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.rows import members
from iccbrdf.icc.tags import TAGS, Mluc


@dataclass(frozen=True)
class ProfileDescription:
    """A profile of a sequence: fields of its header, its technology, and its tags dmnd and dmdd.

    A text that the profile does not have is an empty `Mluc` or, in version 2, an empty `TextDescription`.
    """

    manufacturer: str
    model: str
    attributes: int
    technology: str
    manufacturer_text: TextDescription | Mluc
    model_text: TextDescription | Mluc


_HEAD = (("manufacturer", SIGNATURE), ("model", SIGNATURE), ("attributes", U64), ("technology", SIGNATURE))
_HEAD_SIZE = 20
_TEXTS = ("manufacturer_text", "model_text")
_SIGNATURES = (b"desc", b"mluc")


class _Descriptions(FieldType):
    """Profile descriptions back to back; before a text or a description there may be bytes to align it."""

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[ProfileDescription, ...]:
        reader.count_parts(seen["count"])
        return tuple(self._description(reader) for _ in range(seen["count"]))

    def _description(self, reader: Reader) -> ProfileDescription:
        self._align(reader, _HEAD_SIZE)
        values: dict[str, Any] = {name: type.read(reader, name, {}) for name, type in _HEAD}
        for name in _TEXTS:
            self._align(reader, 0)
            values[name] = self._text(reader, name)
        return ProfileDescription(**values)

    @staticmethod
    def _align(reader: Reader, ahead: int) -> None:
        """Go to a multiple of four unless the signature of a text stands `ahead` of here."""
        here = reader.position + ahead
        padding = -reader.position % 4
        if padding and reader.left >= ahead + 4 and bytes(reader.peek(here, 4, "text")) not in _SIGNATURES:
            reader.take(padding, "padding")

    @staticmethod
    def _text(reader: Reader, name: str) -> TextDescription | Mluc:
        if bytes(reader.peek(reader.position, 4, name)) == b"mluc":
            window = reader.part(reader.position, reader.left, name)
            text = Mluc.read(window)
            reader.take(max(window.position, _end(window)), name)
            return text
        return TextDescription.read(reader)

    def write(self, out: bytearray, value: Sequence[ProfileDescription], record: Any) -> None:
        for description in value:
            for name, type in _HEAD:
                type.write(out, getattr(description, name), description)
            for name in _TEXTS:
                text = getattr(description, name)
                out += text.to_bytes()
                if record.aligned and isinstance(text, Mluc):
                    out += bytes(-len(out) % 4)

    def normal(self, value: Any) -> tuple[ProfileDescription, ...]:
        return tuple(map(self._normal, members(value, ProfileDescription)))

    @staticmethod
    def _normal(value: ProfileDescription) -> ProfileDescription:
        for name in _TEXTS:
            text: Any = getattr(value, name)
            if not isinstance(text, (TextDescription, Mluc)):
                raise ValueError(f"{name}: found {text!r}, expected a TextDescription or an Mluc")
        head: dict[str, Any] = {name: type.normal(getattr(value, name)) for name, type in _HEAD}
        return replace(value, **head)


class _Alignment(FieldType):
    """Whether the descriptions were aligned, which no field says; it shows in what they take."""

    def read(self, reader: Reader, name: str, seen: Seen) -> bool:
        packed, aligned = (_taken(seen["profiles"], choice) for choice in (False, True))
        return packed == aligned or len(reader) != packed

    def write(self, out: bytearray, value: bool, record: Any) -> None:
        pass


def _end(window: Reader) -> int:
    """Where the last text of the multiLocalizedUnicodeType in a window ends that has been read."""
    count = int.from_bytes(window.peek(8, 4, "number of texts"), "big")
    table = window.peek(16, 12 * count, "text records")
    return max((size + offset for _, size, offset in struct.iter_unpack(">4sII", table)), default=0)


@TAGS.add("pseq")
@dataclass(frozen=True, eq=False)
class ProfileSequence(Record):
    """profileSequenceDescType: the profiles that were combined, in their order.

    `aligned`: what follows a multiLocalizedUnicodeType begins at a multiple of four bytes, as the ICC's tools
    write it; some other writers do not.
    """

    profiles: tuple[ProfileDescription, ...]
    aligned: bool = True

    signature = "pseq"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.profiles)),
        Field("profiles", _Descriptions()),
        Field("aligned", _Alignment()),
    )


def _taken(profiles: tuple[ProfileDescription, ...], aligned: bool) -> int:
    """The size of a profile sequence."""
    return len(ProfileSequence(profiles, aligned).to_bytes())


@dataclass(frozen=True, eq=False)
class ProfileIdentity(Record):
    """The profile ID of a profile of a sequence, zeros where it has none, and its description."""

    id: bytes
    description: Mluc

    layout = Layout(Field("id", Bytes(16)), Field("description", Embedded(TAGS)))

    def check(self) -> None:
        description: Any = self.description
        if not isinstance(description, Mluc):
            raise ValueError(f"description: found type {description.signature!r}, expected 'mluc'")


class _Identities(FieldType):
    """A table of (offset, size) from the start of the structure, and what it points to."""

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[ProfileIdentity, ...]:
        spans = read_spans(reader, seen["count"], "profile")
        return tuple(
            reader.parts(spans, lambda index: f"profile {index}", lambda part, _: ProfileIdentity.read(part))
        )

    def write(self, out: bytearray, value: Sequence[ProfileIdentity], record: Any) -> None:
        write_parts(out, value)

    def normal(self, value: Any) -> tuple[ProfileIdentity, ...]:
        return members(value, ProfileIdentity)


@TAGS.add("psid")
@dataclass(frozen=True, eq=False)
class ProfileIdentities(Record):
    """profileSequenceIdentifierType: the profiles that were combined, in their order, by their IDs."""

    profiles: tuple[ProfileIdentity, ...]

    signature = "psid"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.profiles)),
        Field("profiles", _Identities()),
    )


@TAGS.add("ICCp")
@dataclass(frozen=True, eq=False)
class EmbeddedProfile(Record):
    """embeddedProfileType: the file of another profile, such as one of version 5 in one of version 4."""

    data: bytes

    signature = "ICCp"
    layout = tag_layout(signature, Field("data", Bytes()))

    @classmethod
    def of(cls, profile: Profile) -> EmbeddedProfile:
        """The tag of a profile."""
        return cls(profile.to_bytes())

    @cached_property
    def profile(self) -> Profile:
        """The profile; raises as `Profile.from_bytes` where the data is none."""
        return Profile.from_bytes(self.data, "embedded profile")
