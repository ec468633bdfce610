"""A profile: its header and its tags, read lazily and written back untouched."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

from iccbrdf.errors import (
    IccBrdfError,
    LimitError,
    ProfileError,
    UnsupportedError,
    UsageError,
    nearest,
)
from iccbrdf.files import StrPath, atomic_output, read_whole
from iccbrdf.icc.elements import MultiProcess
from iccbrdf.icc.header import SIZE, Header, channel_count
from iccbrdf.icc.layout import Record, shown
from iccbrdf.icc.reader import Budget, Reader
from iccbrdf.icc.tags import TAGS

MAX_BYTES = 1 << 28
MAX_TAGS = 1024

_ENTRY = struct.Struct(">4sII")
_SIDES = {
    "A2M0": ("colour_space", "mcs"),
    "M2A0": ("mcs", "colour_space"),
    **{f"M2B{i}": ("mcs", "pcs") for i in range(4)},
    **{f"M2S{i}": ("mcs", "spectral_pcs") for i in range(4)},
}
"""Header fields that state the input and output channels of a transform."""


class MissingTagError(ProfileError, KeyError):
    """A tag that was asked for is not in the profile."""

    def __str__(self) -> str:
        return ProfileError.__str__(self)


class _Stored:
    """The data of one tag or of several that share it, as it stands in a file."""

    def __init__(
        self, data: bytes | memoryview, source: str, signature: str, offset: int, budget: Budget | None = None
    ) -> None:
        self.data = data
        self.offset = offset
        self._source = source
        self._signature = signature
        self._budget = budget or Budget()

    def __reduce__(self) -> tuple[Any, ...]:
        # A memoryview does not pickle.
        return type(self), (bytes(self.data), self._source, self._signature, self.offset)

    @property
    def value(self) -> Any:
        value, problem = self._outcome
        if problem is not None:
            raise problem
        return value

    @cached_property
    def _outcome(self) -> tuple[Any, IccBrdfError | None]:
        """The value, or the error about it: to read what is malformed again would spend the budget again."""
        place, budget = f"tag {shown(self._signature)}", Budget(self._budget)
        reader = Reader(self.data, self._source, place, start=self.offset, budget=budget)
        try:
            return TAGS.read(reader), None
        except IccBrdfError as error:
            # Without the frames of the reading, which hold its data.
            return None, error.with_traceback(None)


class _Made:
    """A tag made in memory."""

    offset = None

    def __init__(self, value: Record) -> None:
        self.value = value

    @cached_property
    def data(self) -> bytes:
        return self.value.to_bytes()


class Profile(Mapping[str, Any]):
    """A header and tags by signature, in the order of the file.

    `profile["A2M0"]` gives the tag's record (`MultiProcess`, `Mluc`, ..., `Unknown`), decoded when it is
    first asked for.  A tag of a known type that is malformed raises ProfileError then, and hinders
    nothing else.  Tags that share their data in the file are one object, and one object under several
    signatures is written once.

    A profile does not change and pickles; `replace` makes a changed one, in which the tags that were not
    replaced keep their bytes.  Two profiles are equal when they are written as the same bytes.
    """

    def __init__(self, header: Header, tags: Mapping[str, Record], *, source: str = "<new>") -> None:
        self.header = header
        self.source = source
        self._raw: bytes | None = None
        self._tags: dict[str, _Stored | _Made] = {}
        made: dict[int, _Made] = {}
        for signature, value in tags.items():
            self._check_new(signature, value)
            self._tags[signature] = made.setdefault(id(value), _Made(value))

    def _check_new(self, signature: str, value: Record) -> None:
        if len(signature) != 4 or not signature.isascii():
            raise UsageError(f"tag {signature!r}: expected a signature of four ASCII characters")
        try:
            TAGS.check(value)
        except ValueError as error:
            raise UsageError(f"tag {shown(signature)}: {error}") from None
        if problem := self._contradiction(signature, value):
            raise UsageError(f"tag {shown(signature)}: {problem}")

    @classmethod
    def from_bytes(cls, data: bytes, source: str = "<bytes>") -> Profile:
        """The profile that `data` begins with; `source` names it in messages.

        Raises
        ------
        ProfileError
            The header or the tag table is malformed.
        UnsupportedError
            The profile is of a later major version than 5.
        LimitError
            There are more tags than `MAX_TAGS`.
        """
        data = bytes(data)
        head = Reader(data, source, "header")
        header = Header.read(head)
        if header.version[0] > 5:
            raise UnsupportedError(
                f"{source}: header: byte offset 8: found major version {header.version[0]}, expected up to 5"
            )
        if not SIZE + 4 <= header.size <= len(data):
            raise head.error(
                f"size: found {header.size}, expected {SIZE + 4} to the {len(data)} of the file", at=0
            )
        profile = cls(header, {}, source=source)
        profile._raw = data
        profile._tags.update(_read_table(data[: header.size], source))
        return profile

    def __getitem__(self, signature: str) -> Any:
        """The tag's record.  Raises MissingTagError (a ProfileError and a KeyError), ProfileError."""
        value = self._tag(signature).value
        if problem := self._contradiction(signature, value):
            raise ProfileError(f"{self.source}: tag {shown(signature)}: {problem}")
        return value

    def _contradiction(self, signature: str, value: Record) -> str | None:
        """What speaks against the channels of a transform, seen from the header."""
        if not isinstance(value, MultiProcess) or signature not in _SIDES:
            return None
        for found, side, name in zip(
            (value.inputs, value.outputs), ("inputs", "outputs"), _SIDES[signature], strict=True
        ):
            space = getattr(self.header, name)
            expected = channel_count(space)
            if expected is not None and found != expected:
                return f"found {found} {side}, expected {expected} for the header's {name} {space!r}"
        return None

    def __contains__(self, signature: object) -> bool:
        return signature in self._tags

    def __iter__(self) -> Iterator[str]:
        return iter(self._tags)

    def __len__(self) -> int:
        return len(self._tags)

    def __eq__(self, other: object) -> bool:
        return self.to_bytes() == other.to_bytes() if isinstance(other, Profile) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.to_bytes())

    def __repr__(self) -> str:
        return f"<Profile {self.source}: {self.header.device_class!r}, {len(self)} tags>"

    def tag_data(self, signature: str) -> bytes:
        """The bytes of a tag as they are, or will be, in the file, its type signature included."""
        return bytes(self._tag(signature).data)

    def tag_size(self, signature: str) -> int:
        """How many bytes those are."""
        return len(self._tag(signature).data)

    def tag_offset(self, signature: str) -> int | None:
        """Where the tag's data begins in the file that was read; None for a tag made in memory."""
        return self._tag(signature).offset

    def _tag(self, signature: str) -> _Stored | _Made:
        if signature not in self._tags:
            raise MissingTagError(
                f"{self.source}: tag {shown(signature)} is missing: {nearest(signature, self._tags)}"
            )
        return self._tags[signature]

    def replace(
        self,
        *,
        header: Header | None = None,
        tags: Mapping[str, Record] | None = None,
        remove: Iterable[str] = (),
    ) -> Profile:
        """A changed copy: another header, `tags` put in place or at the end, those in `remove` left out."""
        changed = Profile(header or self.header, tags or {}, source=self.source)
        changed._tags = {**self._tags, **changed._tags}
        for signature in remove:
            changed._tags.pop(signature, None)
        return changed

    def to_bytes(self) -> bytes:
        """The file.

        A profile as it was read gives the bytes that it was read from, every one of them.  Any other is
        laid out anew: table, then the data in the order of the tags, each at a multiple of four bytes;
        size and profile ID (MD5, from version 4 on) are computed.
        """
        if self._raw is not None:
            return self._raw
        table = struct.pack(">I", len(self._tags))
        body = bytearray()
        start = SIZE + len(table) + _ENTRY.size * len(self._tags)
        placed: dict[int, int] = {}
        for signature, tag in self._tags.items():
            if id(tag) not in placed:
                placed[id(tag)] = start + len(body)
                body += tag.data
                body += bytes(-len(body) % 4)
            table += _ENTRY.pack(signature.encode("latin-1"), placed[id(tag)], len(tag.data))
        header = replace(self.header, size=start + len(body))
        data = header.to_bytes() + table + body
        if header.version[0] < 4:
            return data
        return replace(header, profile_id=compute_profile_id(data)).to_bytes() + data[SIZE:]


def _read_table(data: bytes, source: str) -> dict[str, _Stored | _Made]:
    reader = Reader(data, source, "tag table")
    reader.take(SIZE, "header")
    count = int.from_bytes(reader.take(4, "tag count"), "big")
    if count > MAX_TAGS:
        raise LimitError(f"{reader.where}: {count} tags, more than the limit of {MAX_TAGS}")
    entries = list(_ENTRY.iter_unpack(reader.take(_ENTRY.size * count, f"{count} entries")))
    names = [signature.decode("latin-1") for signature, _, _ in entries]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise reader.error(
                f"found tag {name!r} a second time, expected every signature once",
                at=SIZE + 4 + _ENTRY.size * index,
            )
    budget = Budget()
    stored = reader.parts(
        [(offset, size) for _, offset, size in entries],
        lambda index: f"tag {shown(names[index])}",
        lambda part, index: _Stored(part.take(part.left, "data"), source, names[index], part.start, budget),
    )
    return dict(zip(names, stored, strict=True))


def compute_profile_id(data: bytes) -> bytes:
    """The profile ID that belongs to the file `data`: MD5 with flags, rendering intent and ID as zeros."""
    size = int.from_bytes(data[:4], "big")
    zeroed = bytearray(data[:size])
    for start, end in ((44, 48), (64, 68), (84, 100)):
        zeroed[start:end] = bytes(end - start)
    return hashlib.md5(zeroed, usedforsecurity=False).digest()


def read_profile(path: StrPath) -> Profile:
    """Read a profile from a file (ICC.2, version 5; also ICC.1, versions 2 and 4).

    Raises
    ------
    InputError, UsageError
        As `iccbrdf.files.read_whole`.
    LimitError
        The file is larger than `MAX_BYTES`, or as `Profile.from_bytes`.
    ProfileError, UnsupportedError
        As `Profile.from_bytes`.
    """
    return Profile.from_bytes(read_whole(path, MAX_BYTES), source=str(path))


def write_profile(profile: Profile, path: StrPath, *, overwrite: bool = False) -> None:
    """Write a profile to a file, which appears whole or not at all.

    Raises UsageError where the file exists and `overwrite` is not set, or cannot be written, or where
    `profile` is none; LimitError where the disk is full.
    """
    if not isinstance(profile, Profile):
        raise UsageError(f"found {profile!r}, expected a Profile to write")
    data = profile.to_bytes()
    with atomic_output(path, overwrite=overwrite) as temporary:
        temporary.write_bytes(data)
