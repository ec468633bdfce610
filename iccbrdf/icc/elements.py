"""The processing elements of a multiProcessElementsType: plain data, run elsewhere (ICC.2, 11.2).

`ELEMENTS` is the registry; a further element is a `Record` with `inputs` and `outputs`, its layout and
`@ELEMENTS.add("sign")`.  The curve set is in `curves`.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from iccbrdf.calc.program import Program, decode_ops, encode_ops
from iccbrdf.errors import ProfileWarning
from iccbrdf.icc.fields import (
    SIGNATURE,
    U16,
    U32,
    Bytes,
    Embedded,
    FloatArray,
    Floats,
    Positioned,
    Reserved,
    encodable,
    frozen,
    read_spans,
    tag_layout,
    write_parts,
)
from iccbrdf.icc.layout import Field, FieldType, Layout, Record, Registry, Seen
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.tags import TAGS, NumberArray

ELEMENTS = Registry("processing element")


@dataclass(frozen=True, eq=False)
class UnknownElement(Record):
    """An element of a type that is not in the registry: everything after its channel counts as it stands."""

    signature: str
    reserved: bytes
    inputs: int
    outputs: int
    data: bytes

    layout = Layout(
        Field("signature", SIGNATURE),
        Field("reserved", Bytes(4)),
        Field("inputs", U16),
        Field("outputs", U16),
        Field("data", Bytes()),
    )


ELEMENTS.unknown = UnknownElement


class _MatrixValues(FieldType):
    """Rows of one output each; None where the element holds nothing but offsets."""

    def read(self, reader: Reader, name: str, seen: Seen) -> FloatArray | None:
        rows, columns = seen["outputs"], seen["inputs"]
        if columns != 1 and reader.left == 4 * rows:
            return None
        values = np.frombuffer(reader.take(4 * rows * columns, name), ">f4")
        return values.reshape(rows, columns).astype(np.float32)

    def write(self, out: bytearray, value: FloatArray | None, record: Any) -> None:
        if value is not None:
            out += value.astype(">f4").tobytes()

    def normal(self, value: Any) -> FloatArray | None:
        return None if value is None else frozen(value, np.float32)


class _Offsets(Floats):
    """One number an output; zeros where the element ends before them."""

    def read(self, reader: Reader, name: str, seen: Seen) -> FloatArray:
        if seen["matrix"] is not None and not reader.left:
            return np.zeros(seen["outputs"], np.float32)
        return super().read(reader, name, seen)


@ELEMENTS.add("matf")
@dataclass(frozen=True, eq=False)
class Matrix(Record):
    """outputs = matrix @ inputs + offset.

    `matrix` has shape (outputs, inputs), or is None where the outputs are the constants `offset` (shape
    (outputs,)) whatever the inputs.
    """

    inputs: int
    matrix: FloatArray | None
    offset: FloatArray

    signature = "matf"
    layout = tag_layout(
        signature,
        Field("inputs", U16),
        Field("outputs", U16, derived=lambda r: r.outputs),
        Field("matrix", _MatrixValues()),
        Field("offset", _Offsets(lambda seen: (seen["outputs"],))),
        exact=True,
    )

    @classmethod
    def of(cls, matrix: Any, offset: Any = None) -> Matrix:
        """The element of a matrix of shape (outputs, inputs), with zero offsets unless given."""
        rows = np.atleast_2d(np.asarray(matrix))
        return cls(rows.shape[1], rows, np.zeros(len(rows), np.float32) if offset is None else offset)

    @property
    def outputs(self) -> int:
        return len(self.offset)

    def check(self) -> None:
        if self.offset.ndim != 1:
            raise ValueError(f"offset: found shape {self.offset.shape}, expected (outputs,)")
        if self.matrix is not None and self.matrix.shape != (self.outputs, self.inputs):
            raise ValueError(
                f"matrix: found shape {self.matrix.shape}, expected {(self.outputs, self.inputs)}"
            )
        if self.matrix is None and self.inputs == 1:
            raise ValueError(
                "matrix: found None for one input, which would be read back as a matrix; expected one"
            )


class Grid(FieldType):
    """Sixteen bytes: the grid points of each input, then unused ones."""

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[int, ...]:
        at = reader.position
        grid = tuple(reader.take(16, name)[: seen["inputs"]])
        if min(grid) < 2:
            raise reader.error(f"{name}: found {grid}, expected 2 or more points for every input", at=at)
        return grid

    def write(self, out: bytearray, value: Sequence[int], record: Any) -> None:
        out += bytes(value).ljust(16, b"\0")


def _clut_layout(signature: str, *encoding: Any) -> Layout:
    return tag_layout(
        signature,
        Field("inputs", U16, derived=lambda r: r.inputs, valid=range(1, 17)),
        Field("outputs", U16, derived=lambda r: r.outputs, valid=range(1, 65536)),
        *encoding,
        Field("grid", Grid(), derived=lambda r: r.table.shape[:-1]),
        Field("table", Floats(lambda seen: (*seen["grid"], seen["outputs"]))),
        exact=True,
    )


class _Table(Record):
    """What the two CLUT elements share."""

    table: FloatArray

    @property
    def inputs(self) -> int:
        return self.table.ndim - 1

    @property
    def outputs(self) -> int:
        return int(self.table.shape[-1])

    def check(self) -> None:
        *grid, outputs = self.table.shape or (0,)
        if not 1 <= len(grid) <= 16 or not all(2 <= g <= 255 for g in grid) or not 1 <= outputs <= 65535:
            raise ValueError(
                f"table: found shape {self.table.shape}, expected 1 to 16 inputs of 2 to 255 grid points, "
                "then the outputs"
            )


@ELEMENTS.add("clut")
@dataclass(frozen=True, eq=False)
class Clut(_Table):
    """Interpolation in a table of shape (g_1, ..., g_inputs, outputs) whose inputs span 0..1."""

    table: FloatArray

    signature = "clut"
    encoding = 0
    layout = _clut_layout(signature)


@ELEMENTS.add("xclt")
@dataclass(frozen=True, eq=False)
class ExtendedClut(_Table):
    """A `Clut` stored as float32 (`encoding` 0), float16 (1), uInt16 (2) or uInt8 (3); 2 and 3 hold 0..1."""

    table: FloatArray
    encoding: int

    signature = "xclt"
    layout = _clut_layout(signature, Field("encoding", U16, valid=range(4)), Reserved(2))

    def check(self) -> None:
        super().check()
        object.__setattr__(self, "table", encodable(self.table, self.encoding))


@ELEMENTS.add("tint")
@dataclass(frozen=True, eq=False)
class TintArray(Record):
    """Linear interpolation between two or more rows of `outputs` numbers; the one input spans 0..1."""

    outputs: int
    values: NumberArray

    signature = "tint"
    layout = tag_layout(
        signature,
        Field("inputs", U16, derived=lambda r: r.inputs),
        Field("outputs", U16, valid=range(1, 65536)),
        Field("values", Embedded(TAGS)),
    )
    inputs = 1

    @classmethod
    def of(cls, table: Any) -> TintArray:
        """The element of a table of shape (rows, outputs), stored as float32."""
        array = np.asarray(table)
        return cls(array.shape[1], NumberArray("fl32", array.reshape(-1)))

    def check(self) -> None:
        values: Any = self.values
        if not isinstance(values, NumberArray):
            raise ValueError(f"values: found type {values.signature!r}, expected a numeric array")
        count = len(values.values)
        if count % self.outputs or count < 2 * self.outputs:
            raise ValueError(f"values: found {count}, expected two or more rows of {self.outputs}")

    @cached_property
    def table(self) -> FloatArray:
        """Shape (rows, outputs), float32; ui08 and ui16 scaled to 0..1."""
        return frozen(self.values.normalised().reshape(-1, self.outputs), np.float32)


class _Operations(FieldType):
    """A calculator program, eight bytes an operation."""

    def read(self, reader: Reader, name: str, seen: Seen) -> Program:
        where = reader.where
        reader.count_operations(seen["count"])
        return decode_ops(bytes(reader.take(8 * seen["count"], "operations")), where)

    def write(self, out: bytearray, value: Program, record: Any) -> None:
        out += encode_ops(value)


@dataclass(frozen=True, eq=False)
class _Function(Record):
    """The main function block of a calculator."""

    program: Program

    signature = "func"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.program)),
        Field("program", _Operations()),
    )


class _FunctionAndElements(FieldType):
    """The position table of a calculator, its main function first, and what it points to.

    The reference implementation overstates the size of the main function by its offset, so the size is
    taken from its operation count.  What else may lie between the parts (`clmt`) is stepped over.
    """

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Any, ...]:
        spans = read_spans(reader, seen["count"] + 1, "calculator part")
        offset, stated = spans[0]
        needed = 12 + 8 * int.from_bytes(reader.peek(offset + 8, 4, "main function"), "big")
        if stated < needed:
            raise reader.error(f"main function: found size {stated}, expected {needed}", at=offset)
        if stated > needed:
            warnings.warn(
                f"{reader.where}: main function: found size {stated}, it takes {needed}",
                ProfileWarning,
                stacklevel=2,
            )
        return tuple(reader.parts([(offset, needed), *spans[1:]], self._label, self._part))

    @staticmethod
    def _label(index: int) -> str:
        return f"sub-element {index - 1}" if index else "main function"

    @staticmethod
    def _part(reader: Reader, index: int) -> Any:
        return ELEMENTS.read(reader) if index else _Function.read(reader)

    def write(self, out: bytearray, value: Sequence[Record], record: Any) -> None:
        write_parts(out, value)


@ELEMENTS.add("calc")
@dataclass(frozen=True, eq=False)
class Calculator(Record):
    """A program on a stack machine, and the elements that its operations apply by index."""

    inputs: int
    outputs: int
    program: Program
    elements: tuple[Any, ...] = ()

    signature = "calc"
    layout = tag_layout(
        signature,
        Field("inputs", U16),
        Field("outputs", U16),
        Field("count", U32, derived=lambda r: len(r.elements)),
        Field("parts", _FunctionAndElements(), derived=lambda r: (_Function(r.program), *r.elements)),
    )

    @classmethod
    def build(cls, seen: Seen) -> Calculator:
        function, *elements = seen["parts"]
        return cls(seen["inputs"], seen["outputs"], function.program, tuple(elements))

    def check(self) -> None:
        object.__setattr__(self, "program", tuple(self.program))
        object.__setattr__(self, "elements", tuple(ELEMENTS.check(e) for e in self.elements))


def _marker_layout(signature: str) -> Layout:
    return tag_layout(
        signature,
        Field("channels", U16),
        Field("outputs", U16, derived=lambda r: r.outputs),
        Field("encoding", SIGNATURE),
        Field("data", Bytes()),
    )


class _Marker(Record):
    """What the two alternate connection space elements share: they pass `channels` channels on.

    `encoding` names the space that stands between a beginning and an end; `data` may tell more about it.
    """

    channels: int

    @property
    def inputs(self) -> int:
        return self.channels

    @property
    def outputs(self) -> int:
        return self.channels


@ELEMENTS.add("bACS")
@dataclass(frozen=True, eq=False)
class BeginAlternateSpace(_Marker):
    """Marks where an alternate connection space begins."""

    channels: int
    encoding: str
    data: bytes = b""

    signature = "bACS"
    layout = _marker_layout(signature)


@ELEMENTS.add("eACS")
@dataclass(frozen=True, eq=False)
class EndAlternateSpace(_Marker):
    """Marks where an alternate connection space ends."""

    channels: int
    encoding: str
    data: bytes = b""

    signature = "eACS"
    layout = _marker_layout(signature)


@TAGS.add("mpet")
@dataclass(frozen=True, eq=False)
class MultiProcess(Record):
    """multiProcessElementsType: elements, each taking the outputs of the one before.

    Without elements it is the identity.
    """

    inputs: int
    outputs: int
    elements: tuple[Any, ...]

    signature = "mpet"
    layout = tag_layout(
        signature,
        Field("inputs", U16),
        Field("outputs", U16),
        Field("count", U32, derived=lambda r: len(r.elements)),
        Field("elements", Positioned(ELEMENTS, "element", lambda seen: int(seen["count"]))),
    )

    @classmethod
    def of(cls, first: Any, *others: Any) -> MultiProcess:
        """The tag of these elements; its channel counts are theirs."""
        elements = (first, *others)
        return cls(first.inputs, elements[-1].outputs, elements)

    def check(self) -> None:
        channels = self.inputs
        for index, element in enumerate(self.elements):
            if element.inputs != channels:
                raise ValueError(f"element {index}: found {element.inputs} inputs, expected {channels}")
            channels = element.outputs
        if channels != self.outputs:
            raise ValueError(f"found {channels} channels after the last element, expected {self.outputs}")
