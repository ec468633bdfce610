"""The look-up-table tag types of version 4 profiles, lutAToBType and lutBToAType, and their curves.

Every stage takes and gives values in 0..1, the encoding of the space that it stands for (ICC.1, 10.12 and
10.13).  Plain data, run elsewhere.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from iccbrdf.icc.elements import ExtendedClut
from iccbrdf.icc.fields import S15, U8, U16, U32, Floats, Repeat, Reserved, tag_layout
from iccbrdf.icc.layout import Field, FieldType, Layout, Record, Registry, Seen
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.tags import TAGS

LUT_CURVES = Registry("curve")

PARAMETERS = {0: 1, 1: 3, 2: 4, 3: 5, 4: 7}
"""How many parameters the function of each type has."""


@TAGS.add("curv")
@LUT_CURVES.add("curv")
@dataclass(frozen=True, eq=False)
class Curve(Record):
    """curveType: no entry is the identity, one is a gamma times 256, more are samples times 65535."""

    entries: tuple[int, ...] = ()

    signature = "curv"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.entries)),
        Field("entries", Repeat(U16, lambda seen: int(seen["count"]))),
    )


@TAGS.add("para")
@LUT_CURVES.add("para")
@dataclass(frozen=True, eq=False)
class ParametricCurve(Record):
    """parametricCurveType; parameters g a b c d e f in this order, as many as the type has.

    Types, with X the input: 0 X^g; 1 (aX+b)^g, below X = -b/a 0; 2 (aX+b)^g + c, below it c; 3 (aX+b)^g,
    below X = d cX; 4 (aX+b)^g + e, below it cX + f.
    """

    type: int
    parameters: tuple[float, ...]

    signature = "para"
    layout = tag_layout(
        signature,
        Field("type", U16, valid=PARAMETERS),
        Reserved(2),
        Field("parameters", Repeat(S15, lambda seen: PARAMETERS[seen["type"]])),
    )

    def check(self) -> None:
        expected = PARAMETERS[self.type]
        if len(self.parameters) != expected:
            raise ValueError(
                f"parameters: found {len(self.parameters)}, expected {expected} for type {self.type}"
            )


class _Curves(FieldType):
    """Curves one after the other, each at a multiple of four bytes; `side` is the field that counts them."""

    def __init__(self, side: str) -> None:
        self.side = side

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Any, ...]:
        curves = []
        for _ in range(seen[self.side]):
            reader.take(min(-reader.position % 4, reader.left), "padding")
            curves.append(LUT_CURVES.read(reader))
        return tuple(curves)

    def write(self, out: bytearray, value: Sequence[Any], record: Any) -> None:
        for curve in value:
            out += bytes(-len(out) % 4)
            out += curve.to_bytes()


_PRECISION = {2: 2, 3: 1}
"""Value encoding of a table -> bytes a value."""


class _Table(FieldType):
    """Grid points of up to 16 inputs, bytes a value, three reserved bytes, values."""

    _head = struct.Struct(">16sB3x")

    def read(self, reader: Reader, name: str, seen: Seen) -> ExtendedClut:
        at = reader.position
        points, precision = self._head.unpack(reader.take(self._head.size, "grid"))
        grid = tuple(points[: seen["inputs"]])
        if len(grid) < seen["inputs"] or min(grid) < 2:
            raise reader.error(f"grid: found {grid}, expected 2 or more points for every input", at=at)
        encoding = next((e for e, size in _PRECISION.items() if size == precision), None)
        if encoding is None:
            raise reader.error(f"precision: found {precision}, expected 1 or 2", at=at + 16)
        values = Floats(lambda _: (*grid, seen["outputs"]))
        return ExtendedClut(values.read(reader, "table", {"encoding": encoding}), encoding)

    def write(self, out: bytearray, value: ExtendedClut, record: Any) -> None:
        out += self._head.pack(bytes(value.table.shape[:-1]), _PRECISION[value.encoding])
        Floats(lambda _: value.table.shape).write(out, value.table, value)


_MATRIX = Repeat(S15, 12)
_OFFSETS = struct.Struct(">5I")


class _Parts(FieldType):
    """Five offsets from the start of the tag, and what stands there; None for an offset of 0.

    `connection` and `device`: the fields that count the channels of either side.
    """

    def __init__(self, connection: str, device: str) -> None:
        self.types: dict[str, FieldType] = {
            "b_curves": _Curves(connection),
            "matrix": _MATRIX,
            "m_curves": _Curves(connection),
            "clut": _Table(),
            "a_curves": _Curves(device),
        }

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Any, ...]:
        offsets = _OFFSETS.unpack(reader.take(_OFFSETS.size, "offsets"))
        start = reader.position
        parts: list[Any] = []
        for (part, field), offset in zip(self.types.items(), offsets, strict=True):
            if not offset:
                parts.append(None)
                continue
            if offset < start:
                raise reader.error(f"{part}: found it at {offset}, expected {start} or later", at=offset)
            # No size is stated: a part may go on to where the next one begins.
            end = min((o for o in offsets if o > offset), default=max(offset, len(reader)))
            parts.append(field.read(reader.part(offset, end - offset, part), part, seen))
        return tuple(parts)

    def write(self, out: bytearray, value: Sequence[Any], record: Any) -> None:
        table = len(out)
        out += bytes(_OFFSETS.size)
        for index, (field, part) in enumerate(zip(self.types.values(), value, strict=True)):
            if part is not None:
                out += bytes(-len(out) % 4)
                struct.pack_into(">I", out, table + 4 * index, len(out))
                field.write(out, part, record)


def _layout(signature: str, connection: str, device: str) -> Layout:
    return tag_layout(
        signature,
        Field("inputs", U8, derived=lambda r: r.inputs, valid=range(1, 256)),
        Field("outputs", U8, derived=lambda r: r.outputs, valid=range(1, 256)),
        Reserved(2),
        Field("parts", _Parts(connection, device), derived=lambda r: r.parts),
    )


@dataclass(frozen=True, eq=False)
class _Lut(Record):
    """What the two types share."""

    b_curves: tuple[Curve | ParametricCurve, ...]
    matrix: tuple[float, ...] | None = None
    m_curves: tuple[Curve | ParametricCurve, ...] | None = None
    clut: ExtendedClut | None = None
    a_curves: tuple[Curve | ParametricCurve, ...] | None = None

    sides: ClassVar[tuple[str, str]]
    """Which of `inputs` and `outputs` is the connection space, and which the device."""

    @property
    def inputs(self) -> int:
        return self.clut.inputs if self.clut else len(self.b_curves)

    @property
    def outputs(self) -> int:
        return self.clut.outputs if self.clut else len(self.b_curves)

    @property
    def parts(self) -> tuple[Any, ...]:
        """All parts, in the order of their offsets."""
        return self.b_curves, self.matrix, self.m_curves, self.clut, self.a_curves

    @classmethod
    def build(cls, seen: Seen) -> Any:
        return cls(*seen["parts"])

    def check(self) -> None:
        if not self.b_curves:
            raise ValueError("b_curves: found none, expected one for each channel of the connection space")
        connection, device = (getattr(self, side) for side in self.sides)
        for name, curves, count in (
            ("b_curves", self.b_curves, connection),
            ("m_curves", self.m_curves, connection),
            ("a_curves", self.a_curves, device),
        ):
            if curves is not None:
                object.__setattr__(self, name, tuple(LUT_CURVES.check(curve) for curve in curves))
                if len(curves) != count:
                    raise ValueError(f"{name}: found {len(curves)}, expected {count}")
        if self.matrix is not None:
            object.__setattr__(self, "matrix", _MATRIX.normal(self.matrix))
            if connection != 3:
                raise ValueError(f"matrix: found one for {connection} channels, expected 3")
        if self.clut is not None and self.clut.encoding not in _PRECISION:
            raise ValueError(f"clut: found value encoding {self.clut.encoding}, expected 2 or 3")


@TAGS.add("mBA ")
@dataclass(frozen=True, eq=False)
class LutBToA(_Lut):
    """lutBToAType: connection space -> device, by B curves, matrix, M curves, table and A curves.

    Only the B curves must be there.  `matrix` is e1 to e12: three rows, then three offsets.  `clut` is
    stored as uInt16 (its value encoding 2) or uInt8 (3).
    """

    signature = "mBA "
    sides = ("inputs", "outputs")
    layout = _layout(signature, *sides)


@TAGS.add("mAB ")
@dataclass(frozen=True, eq=False)
class LutAToB(_Lut):
    """lutAToBType: device -> connection space, by A curves, table, M curves, matrix and B curves.

    The parts are those of `LutBToA`.
    """

    signature = "mAB "
    sides = ("outputs", "inputs")
    layout = _layout(signature, *sides)
