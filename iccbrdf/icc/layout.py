"""One declarative block per binary structure, from which reading, writing and the text form follow.

A `Layout` lists the fields of a structure in the order of the file.  A `Record` is a frozen dataclass with
a layout: its attributes are what the fields hold, brought to what the file can store when it is made, so
that an object always equals the one read back.
"""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections import ChainMap
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias, TypeVar

from iccbrdf.errors import UsageError
from iccbrdf.icc.reader import Reader

Seen: TypeAlias = Mapping[str, Any]
"""The fields of a structure read so far."""


class FieldType(ABC):
    """How one field is stored."""

    @abstractmethod
    def read(self, reader: Reader, name: str, seen: Seen) -> Any:
        """The value at the reader's position."""

    @abstractmethod
    def write(self, out: bytearray, value: Any, record: Any) -> None:
        """Append `value` of `record` to `out`, which begins where the structure begins."""

    def normal(self, value: Any) -> Any:
        """`value` as it will be read back; ValueError, with what was expected, where it cannot be stored."""
        return value


@dataclass(frozen=True)
class Field:
    """A named field.

    `derived` computes the stored value from the record (a count, a constant), which then has no such
    attribute to set; in a file the two must agree.  `valid` lists the values that a file may hold, checked
    before anything that depends on them is read.
    """

    name: str
    type: FieldType
    derived: Callable[[Any], Any] | None = None
    valid: Container[Any] | None = None


class Layout:
    """The fields of a structure, in order; a bare field type is one without a name (reserved, constant).

    `exact`: nothing may follow the last field.
    """

    def __init__(self, *fields: Field | FieldType, exact: bool = False) -> None:
        self.fields = tuple(f if isinstance(f, Field) else Field("", f) for f in fields)
        self.exact = exact

    def read(self, reader: Reader, around: Seen) -> dict[str, Any]:
        """All named fields from the reader's position on; `around`: those of the structure that holds it."""
        seen: dict[str, Any] = {}
        visible = ChainMap(seen, dict(around)) if around else seen
        for field in self.fields:
            at = reader.position
            value = field.type.read(reader, field.name, visible)
            if field.valid is not None and value not in field.valid:
                raise reader.error(f"{field.name}: found {value}, expected {_listed(field.valid)}", at=at)
            if field.name:
                seen[field.name] = value
        if self.exact and reader.left:
            raise reader.error(f"found {reader.left} bytes more, expected the end of the structure")
        return seen

    def write(self, record: Any) -> bytes:
        """The bytes of a record that has the fields as attributes."""
        out = bytearray()
        for field in self.fields:
            field.type.write(out, self.value(field, record), record)
        return bytes(out)

    @staticmethod
    def value(field: Field, record: Any) -> Any:
        """What `field` stores of `record`; None for a field without a name."""
        if field.derived is not None:
            return field.derived(record)
        return getattr(record, field.name) if field.name else None


def _listed(valid: Container[Any]) -> str:
    if isinstance(valid, range):
        return f"{valid.start} to {valid.stop - 1}"
    if isinstance(valid, (tuple, list, dict)):
        return " or ".join(str(v) for v in valid)
    return str(valid)


def shown(signature: str) -> str:
    """A signature for messages: without its padding blanks, escaped where it does not print."""
    return signature.strip() if signature.isprintable() and signature.strip() else repr(signature)


R = TypeVar("R", bound="Record")


class Record:
    """Base of the frozen dataclasses that stand for a binary structure.

    Two records are equal when they are stored as the same bytes (so a NaN equals itself).
    """

    signature: str
    """The four characters that the structure begins with in the file."""
    layout: Layout

    def __post_init__(self) -> None:
        for field in self.layout.fields:
            if field.name and field.derived is None:
                self._normalise(field)
        try:
            self.check()
        except ValueError as error:
            raise UsageError(f"{type(self).__name__}: {error}") from None

    def _normalise(self, field: Field) -> None:
        try:
            value = field.type.normal(getattr(self, field.name))
            if field.valid is not None and value not in field.valid:
                raise ValueError(f"found {value}, expected {_listed(field.valid)}")
        except (TypeError, ValueError) as error:
            raise UsageError(f"{type(self).__name__}.{field.name}: {error}") from None
        object.__setattr__(self, field.name, value)

    def check(self) -> None:
        """Raise ValueError, saying what was found and what was expected, where the fields contradict."""

    @classmethod
    def read(cls: type[R], reader: Reader, around: Seen = MappingProxyType({})) -> R:
        """Read one from the reader's position on; ProfileError where it is malformed.

        Its fields may depend on `around`, those of the structure that holds it.
        """
        at = reader.position
        seen = cls.layout.read(reader, around)
        try:
            record = cls.build(seen)
        except UsageError as error:
            raise reader.error(str(error), at=at) from None
        for field in cls.layout.fields:
            if field.derived is not None and field.derived(record) != seen[field.name]:
                raise reader.error(
                    f"{field.name}: found {seen[field.name]}, expected {field.derived(record)}", at=at
                )
        return record

    @classmethod
    def build(cls: type[R], seen: Seen) -> R:
        """The record of the fields read."""
        named = (f.name for f in cls.layout.fields if f.name and f.derived is None)
        return cls(**{name: seen[name] for name in named})

    def to_bytes(self) -> bytes:
        """The structure as stored, without padding after it."""
        return self.layout.write(self)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self is other or self.to_bytes() == other.to_bytes()

    def __hash__(self) -> int:
        # Kept, as a table may be large and asked for at every turn; the same in every process, as records
        # pickle.
        if "_hash" not in self.__dict__:
            digest = hashlib.blake2b(self.to_bytes(), digest_size=7).digest()
            object.__setattr__(self, "_hash", int.from_bytes(digest, "big"))
        return int(self.__dict__["_hash"])


RecordType = TypeVar("RecordType", bound=type[Record])


class Registry:
    """The record classes of one kind (tag types, elements), by signature.

    `unknown` is the class for a signature that is not there; without one, such a structure is an error.
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.classes: dict[str, type[Record]] = {}
        self.unknown: type[Record] | None = None

    def add(self, *signatures: str) -> Callable[[RecordType], RecordType]:
        """Class decorator: records of these signatures are read by the class."""

        def register(cls: RecordType) -> RecordType:
            self.classes.update(dict.fromkeys(signatures, cls))
            return cls

        return register

    def read(self, reader: Reader) -> Any:
        """Read the record at the reader's position, whichever it is."""
        signature = bytes(reader.peek(reader.position, 4, f"signature of a {self.kind}")).decode("latin-1")
        cls = self.classes.get(signature, self.unknown)
        if cls is None:
            raise reader.error(
                f"{self.kind}: found {signature!r}, expected {' or '.join(map(repr, self.classes))}"
            )
        if reader.position == 0:
            reader.place += f" ({shown(signature)})"
        return cls.read(reader)

    def check(self, value: object) -> Any:
        """`value`; ValueError where it is no record that this registry reads back as the same class."""
        found = isinstance(value, Record) and self.classes.get(value.signature, self.unknown)
        if found is not type(value):
            raise ValueError(f"found {type(value).__name__}, expected a {self.kind}")
        return value
