"""One declarative block per element of the dialect, from which reading and writing follow.

A `Form` ties an element to a record class by its parts: attributes, text, and elements inside.  As in
`iccbrdf.icc.layout`, the parts are read in order into the values `seen`, from which the record is made.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import LimitError, UsageError, nearest
from iccbrdf.icc.fields import ENCODINGS
from iccbrdf.icc.layout import shown
from iccbrdf.icc.reader import MAX_DEPTH
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.values import U16, Codec, choice, decimals, numbers

Seen: TypeAlias = dict[str, Any]
"""The values of a record read so far."""

ANYWHERE = ("Reserved", "Reserved2", "reserved", "Name")
"""Attributes that every element may have: bytes that the format says are zeros, names in calculators."""

REQUIRED = object()


class Part:
    """A part of an element.

    `attributes` and `children` are the names that it accounts for; None for `children`: whatever is there.
    """

    attributes: tuple[str, ...] = ()
    children: tuple[str, ...] | None = ()

    def read(self, node: Node, seen: Seen) -> None:
        """Put what `node` says into `seen`."""

    def write(self, out: Target, record: Any) -> None:
        """Put what `record` holds into `out`."""


def read_parts(parts: Sequence[Part], node: Node, seen: Seen) -> None:
    """Read all parts, and refuse what none of them accounts for."""
    attributes = (*(name for part in parts for name in part.attributes), *ANYWHERE)
    named = [part.children for part in parts]
    children = None if None in named else tuple(name for names in named for name in names or ())
    node.expect(attributes, children)
    for part in parts:
        part.read(node, seen)


class Attribute(Part):
    """An attribute.

    One that may be missing has a `default`; it is written all the same, unless `omitted` where it is that.
    """

    def __init__(
        self, name: str, field: str, codec: Codec, default: Any = REQUIRED, *, omitted: bool = False
    ) -> None:
        self.attributes = (name,)
        self.field = field
        self.codec = codec
        self.default = default
        self.omitted = omitted

    def read(self, node: Node, seen: Seen) -> None:
        (name,) = self.attributes
        if name not in node.attributes and self.default is not REQUIRED:
            seen[self.field] = self.default
            return
        seen[self.field] = node.value(self.codec, node.get(name), name)

    def write(self, out: Target, record: Any) -> None:
        value = getattr(record, self.field)
        if value != self.default or not self.omitted:
            out.set(self.attributes[0], self.codec.write(value))


class Content(Part):
    """The text of the element."""

    def __init__(self, field: str, codec: Codec) -> None:
        self.field = field
        self.codec = codec

    def read(self, node: Node, seen: Seen) -> None:
        seen[self.field] = node.value(self.codec, node.text)

    def write(self, out: Target, record: Any) -> None:
        out.write(self.codec.write(getattr(record, self.field)))


class Numbers(Part):
    """Numbers as the text of the element, or in the file that it names.

    `shape` gives the shape that they must fill; without it they are flat.  A line holds the last axis.
    """

    attributes: tuple[str, ...] = ("Filename", "File", "Format", "FileEncoding", "StorageType", "Endian")
    children: tuple[str, ...] = ("f", "n")

    def __init__(
        self,
        field: str,
        shape: Callable[[Seen], tuple[int, ...]] | None = None,
        dtype: npt.DTypeLike = np.float32,
    ) -> None:
        self.field = field
        self.shape = shape
        self.dtype = np.dtype(dtype)

    def read(self, node: Node, seen: Seen) -> None:
        values = read_numbers(node, self.dtype, seen.get("encoding", 0))
        if self.shape is not None:
            shape = self.shape(seen)
            expected = int(np.prod(shape, dtype=object))
            if values.size != expected:
                raise node.error(f"found {values.size} numbers, expected {expected} ({_product(shape)})")
            values = values.reshape(shape)
        seen[self.field] = values

    def write(self, out: Target, record: Any) -> None:
        write_numbers(out, np.asarray(getattr(record, self.field)))


def _product(shape: Iterable[int]) -> str:
    return " x ".join(map(str, shape)) or "one"


def write_numbers(out: Target, values: npt.NDArray[Any]) -> None:
    """Numbers as text: those of the last axis in a line where there are several axes, else eight."""
    # At least a digit and a blank each: known before millions of them are made text.
    out.check_text(2 * values.size - 1)
    texts = decimals(values.reshape(-1))
    width = values.shape[-1] if values.ndim > 1 else 8
    lines = [" ".join(texts[i : i + width]) for i in range(0, len(texts), max(1, width))]
    out.write(lines[0] if len(lines) == 1 else "\n".join(["", *lines, ""]))


def read_numbers(node: Node, dtype: npt.DTypeLike, encoding: int) -> npt.NDArray[Any]:
    """The numbers of an element: its text, the elements `f` or `n` in it, or the file that it names.

    A binary file holds values of the value encoding `encoding` unless `StorageType` or `FileEncoding` says
    otherwise; so does a text file for the two integer encodings, whose numbers stand for 0..1.
    """
    filename = node.attributes.get("Filename") or node.attributes.get("File")
    if not filename:
        inline: npt.NDArray[Any] = node.value(
            numbers(dtype), " ".join([node.text, *(child.text for child in node)])
        )
        return inline
    for name, codec in (("FileEncoding", _FILE_ENCODING), ("StorageType", U16)):
        if name in node.attributes:
            encoding = node.value(codec, node.attributes[name], name)
            break
    if encoding >= len(ENCODINGS):
        raise node.error(f"StorageType: found {encoding}, expected 0 to {len(ENCODINGS) - 1}")
    stored, scale = ENCODINGS[encoding]
    binary = node.value(_FILE_FORMAT, node.attributes.get("Format", "text"), "Format")
    path, data = node.document.named(node, filename)
    if binary:
        kind = np.dtype(stored)
        if node.attributes.get("Endian") == "little":
            kind = kind.newbyteorder("<")
        if len(data) % kind.itemsize:
            raise node.error(f"{path}: found {len(data)} bytes, no whole number of values")
        values = np.frombuffer(data, kind).astype(np.float64)
    else:
        values = node.value(numbers(dtype), data.decode("utf-8", "replace"), str(path))
    return values / scale if scale > 1 else values


_FILE_ENCODING = choice({0: ("float",), 2: ("int16",), 3: ("int8",)})
_FILE_FORMAT = choice({0: ("text",), 1: ("binary",)})


class Inside(Part):
    """Parts that stand in an element of their own.

    `default` gives the values where the element is missing, which without it is an error; `present` says
    whether it is written for a record.
    """

    def __init__(
        self,
        name: str,
        *parts: Part,
        aliases: tuple[str, ...] = (),
        default: Callable[[Seen], Seen] | None = None,
        present: Callable[[Any], bool] = lambda record: True,
    ) -> None:
        self.children: tuple[str, ...] = (name, *aliases)
        self.name = name
        self.parts = parts
        self.default = default
        self.present = present

    def read(self, node: Node, seen: Seen) -> None:
        child = node.child(*self.children)
        if child is not None:
            read_parts(self.parts, child, seen)
        elif self.default is not None:
            seen.update(self.default(seen))
        else:
            raise node.error(f"no <{self.name}> found in it, expected one")

    def write(self, out: Target, record: Any) -> None:
        if self.present(record):
            child = out.child(self.name)
            for part in self.parts:
                part.write(child, record)


def optional(name: str, part: Attribute | Content, default: Any) -> Inside:
    """One value in an element of its own that may be missing, and is where it is the default."""
    field = part.field
    return Inside(
        name, part, default=lambda seen: {field: default}, present=lambda r: getattr(r, field) != default
    )


class Rows(Part):
    """A tuple of values, each an element of the same name; `make` makes one of what its parts hold."""

    def __init__(self, name: str, field: str, make: Callable[..., Any], *parts: Part) -> None:
        self.children = (name,)
        self.name = name
        self.field = field
        self.make = make
        self.parts = parts

    def read(self, node: Node, seen: Seen) -> None:
        rows = []
        for child in node:
            if child.name == self.name:
                row: Seen = {}
                read_parts(self.parts, child, row)
                try:
                    rows.append(self.make(**row))
                except UsageError as error:
                    raise child.error(str(error)) from None
        seen[self.field] = tuple(rows)

    def write(self, out: Target, record: Any) -> None:
        for row in getattr(record, self.field):
            child = out.child(self.name)
            for part in self.parts:
                part.write(child, row)


class Form:
    """An element that stands for a record.

    `signature`: that of the records, where the class has several.  `make` makes the record, by default its
    class.  `aliases` are further names under which it is read.
    """

    def __init__(
        self,
        name: str,
        record: type[Any],
        *parts: Part,
        signature: str | None = None,
        aliases: tuple[str, ...] = (),
        make: Callable[..., Any] | None = None,
    ) -> None:
        self.name = name
        self.record = record
        self.parts = parts
        self.signature: str = record.signature if signature is None else signature
        self.aliases = aliases
        self._constant = {"signature": signature} if signature else {}
        self._make = make or record
        self._fields = {f.name for f in fields(record) if f.init}

    def read(self, node: Node) -> Any:
        """The record of an element; ProfileError where the element is malformed."""
        seen: Seen = dict(self._constant)
        read_parts(self.parts, node, seen)
        try:
            record = self._make(**{name: value for name, value in seen.items() if name in self._fields})
        except UsageError as error:
            raise node.error(str(error)) from None
        for name, value in seen.items():
            if name not in self._fields and getattr(record, name, value) != value:
                raise node.error(f"{name}: found {value}, expected {getattr(record, name)}")
        return record

    def write(self, out: Target, record: Any) -> None:
        """Put a record into an element."""
        for part in self.parts:
            part.write(out, record)


class Forms:
    """The forms of one kind of record (tag types, elements, curves), by name and by signature."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.by_name: dict[str, Form] = {}
        self.by_signature: dict[str, Form] = {}

    def add(self, *forms: Form) -> None:
        for form in forms:
            self.by_signature[form.signature] = form
            self.by_name.update(dict.fromkeys((form.name, *form.aliases), form))

    def read(self, node: Node) -> Any:
        """The record that an element stands for."""
        if node.records == MAX_DEPTH:
            raise node.error(f"nested deeper than the limit of {MAX_DEPTH}", kind=LimitError)
        node.records += 1
        if node.name in self.by_name:
            return self.by_name[node.name].read(node)
        raise node.error(f"no {self.kind}: {nearest(node.name, self.by_name)}")

    def write(self, out: Target, record: Any) -> None:
        """Put a record into a new element at the end of `out`."""
        form = self.by_signature.get(record.signature)
        if form is None:
            raise out.error(f"a {self.kind} {shown(record.signature)!r} has no form in XML")
        form.write(out.child(form.name), record)


class Records(Part):
    """Records of one kind: all the elements inside.

    duplicate: the name of an element that stands for an earlier one again, by its `Index`.
    """

    children = None

    def __init__(self, field: str, forms: Forms, duplicate: str | None = None) -> None:
        self.field = field
        self.forms = forms
        self.duplicate = duplicate

    def read(self, node: Node, seen: Seen) -> None:
        records: list[Any] = []
        for child in node:
            if child.name != self.duplicate:
                records.append(self.forms.read(child))
                continue
            index = child.get("Index").strip()
            if not index.isdecimal() or int(index) >= len(records):
                raise child.error(f"Index: found {index!r:.20}, expected less than {len(records)}")
            records.append(records[int(index)])
        seen[self.field] = tuple(records)

    def write(self, out: Target, record: Any) -> None:
        records = getattr(record, self.field)
        first: dict[int, int] = {}
        for index, item in enumerate(records):
            if self.duplicate and id(item) in first:
                out.child(self.duplicate).set("Index", str(first[id(item)]))
            else:
                first[id(item)] = index
                self.forms.write(out, item)


class Single(Part):
    """One record: the one element inside."""

    children = None

    def __init__(self, field: str, forms: Forms) -> None:
        self.field = field
        self.forms = forms

    def read(self, node: Node, seen: Seen) -> None:
        children = list(node)
        if len(children) != 1:
            raise node.error(f"found {len(children)} elements in it, expected one {self.forms.kind}")
        seen[self.field] = self.forms.read(children[0])

    def write(self, out: Target, record: Any) -> None:
        self.forms.write(out, getattr(record, self.field))
