"""The look-up-table tag types and their curves in XML; all numbers of tables are integers there."""

from __future__ import annotations

from typing import Any

import numpy as np

from iccbrdf.icc.elements import ExtendedClut
from iccbrdf.icc.fields import ENCODINGS
from iccbrdf.icc.lut import Curve, LutAToB, LutBToA, ParametricCurve
from iccbrdf.icc.lut_tables import Lut8, Lut16
from iccbrdf.icc.xml.arrays import Grid
from iccbrdf.icc.xml.composite import TYPE_FORMS
from iccbrdf.icc.xml.elements import CHANNELS
from iccbrdf.icc.xml.forms import (
    Attribute,
    Form,
    Forms,
    Inside,
    Numbers,
    Part,
    Records,
    Seen,
    read_numbers,
    read_parts,
    write_numbers,
)
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.values import FIXED16, U16, U32

CURVE_FORMS = Forms("curve")

_MAX_IDENTITY = 65536


class _Entries(Part):
    """The entries of a curve, or the number of them for the identity."""

    attributes = (*Numbers.attributes, "IdentitySize")
    children = Numbers.children

    def read(self, node: Node, seen: Seen) -> None:
        seen["entries"] = tuple(curve_entries(node, 65535))

    def write(self, out: Target, record: Curve) -> None:
        if record.entries:
            write_numbers(out, np.array(record.entries, np.uint16))


def curve_entries(node: Node, greatest: int) -> list[int]:
    """The integers of a curve, up to `greatest`."""
    size = node.attributes.get("IdentitySize")
    values: list[int] = read_numbers(node, np.uint32, 0).tolist()
    if size is not None and not values:
        count = node.value(U32, size, "IdentitySize")
        if not 1 <= count <= _MAX_IDENTITY:
            raise node.error(f"IdentitySize: found {count}, expected 1 to {_MAX_IDENTITY}")
        # One entry is a gamma, in steps of 1/256.
        values = [256] if count == 1 else np.rint(np.linspace(0, greatest, count)).astype(int).tolist()
    if values and max(values) > greatest:
        raise node.error(f"found {max(values)}, expected up to {greatest}")
    return values


CURVE_FORMS.add(
    Form("Curve", Curve, _Entries()),
    Form(
        "ParametricCurve",
        ParametricCurve,
        Attribute("FunctionType", "type", U16),
        Numbers("parameters", dtype=np.float64),
    ),
)


# lutAToBType, lutBToAType ------------------------------------------------------------------------------


def _curves(name: str, field: str) -> Inside:
    return Inside(
        name,
        Records(field, CURVE_FORMS),
        default=lambda seen: {field: None},
        present=lambda record: getattr(record, field) is not None,
    )


class _Elements(Part):
    """The numbers of a matrix, row by row, then its offsets where it has some."""

    def __init__(self, count: int) -> None:
        self.attributes = tuple(f"e{i + 1}" for i in range(count))

    def read(self, node: Node, seen: Seen) -> None:
        texts = {name: node.get(name) for name in self.attributes[:9]}
        texts |= {name: node.attributes.get(name, "0") for name in self.attributes[9:]}
        seen["matrix"] = tuple(node.value(FIXED16, text, name) for name, text in texts.items())

    def write(self, out: Target, record: Any) -> None:
        for name, value in zip(self.attributes, record.matrix, strict=True):
            out.set(name, FIXED16.write(value))


def _read_table(node: Node, seen: Seen, encoding: int) -> Any:
    """The values of a table, which stand for 0..1 as the value encoding says."""
    greatest = ENCODINGS[encoding][1]
    shape = (*seen["grid"], seen["outputs"])
    values = read_numbers(node, np.uint32, 0)
    expected = int(np.prod(shape, dtype=object))
    if values.size != expected:
        raise node.error(f"found {values.size} numbers, expected {expected} ({' x '.join(map(str, shape))})")
    if values.max() > greatest:
        raise node.error(f"found {values.max()}, expected up to {greatest}")
    return (values / greatest).astype(np.float32).reshape(shape)


def _write_table(out: Target, values: Any, encoding: int) -> None:
    write_numbers(out, np.rint(values.astype(np.float64) * ENCODINGS[encoding][1]).astype(np.uint16))


class _Values(Part):
    """The table of a `CLUT`, in 16 bits or, with a precision of 1, in 8."""

    children = ("TableData",)

    def read(self, node: Node, seen: Seen) -> None:
        table = node.child("TableData")
        if table is None:
            raise node.error("no <TableData> found in it, expected one")
        table.expect((*Numbers.attributes, "Precision"), Numbers.children)
        precision = table.attributes.get("Precision", "2")
        if precision not in ("1", "2"):
            raise table.error(f"Precision: found {precision!r:.20}, expected 1 or 2")
        encoding = 3 if precision == "1" else 2
        seen["clut"] = ExtendedClut(_read_table(table, seen, encoding), encoding)

    def write(self, out: Target, record: ExtendedClut) -> None:
        table = out.child("TableData")
        if record.encoding == 3:
            table.set("Precision", "1")
        _write_table(table, record.table, record.encoding)


class _Clut(Part):
    """The table of a look-up table, where it has one."""

    children = ("CLUT",)
    _parts = (Grid(), _Values())

    def read(self, node: Node, seen: Seen) -> None:
        clut = node.child("CLUT")
        seen["clut"] = None
        if clut is not None:
            read_parts(self._parts, clut, seen)

    def write(self, out: Target, record: LutAToB | LutBToA) -> None:
        if record.clut is not None:
            child = out.child("CLUT")
            for part in self._parts:
                part.write(child, record.clut)


_B_TO_A: tuple[Part, ...] = (
    _curves("BCurves", "b_curves"),
    Inside(
        "Matrix",
        _Elements(12),
        default=lambda seen: {"matrix": None},
        present=lambda record: record.matrix is not None,
    ),
    _curves("MCurves", "m_curves"),
    _Clut(),
    _curves("ACurves", "a_curves"),
)


# lut8Type, lut16Type -----------------------------------------------------------------------------------


class _Tables(Part):
    """Curves as rows of integers; `BCurves` are those of the inputs, `ACurves` those of the outputs."""

    def __init__(self, name: str, field: str, encoding: int) -> None:
        self.children = (name,)
        self.name = name
        self.field = field
        self.greatest = ENCODINGS[encoding][1]

    def read(self, node: Node, seen: Seen) -> None:
        curves = node.child(self.name)
        if curves is None:
            raise node.error(f"no <{self.name}> found in it, expected one")
        curves.expect((), ("Curve",))
        rows = []
        for child in curves:
            child.expect(_Entries.attributes, _Entries.children)
            rows.append(curve_entries(child, self.greatest))
        if len({len(row) for row in rows}) != 1:
            raise curves.error(f"found {[*map(len, rows)]} entries, expected the same in every curve")
        seen[self.field] = np.array(rows) / self.greatest

    def write(self, out: Target, record: Any) -> None:
        curves = out.child(self.name)
        rows = np.rint(getattr(record, self.field).astype(np.float64) * self.greatest).astype(np.uint16)
        for row in rows:
            write_numbers(curves.child("Curve"), row)


class _SquareTable(Part):
    """A table with as many grid points for every input."""

    children = ("CLUT",)

    def __init__(self, encoding: int) -> None:
        self.encoding = encoding

    def read(self, node: Node, seen: Seen) -> None:
        clut = node.child("CLUT")
        if clut is None:
            raise node.error("no <CLUT> found in it, expected one")
        clut.expect(Grid.attributes, ("GridPoints", "TableData"))
        Grid().read(clut, seen)
        table = clut.child("TableData")
        if table is None:
            raise clut.error("no <TableData> found in it, expected one")
        table.expect(Numbers.attributes, Numbers.children)
        seen["table"] = _read_table(table, seen, self.encoding)

    def write(self, out: Target, record: Any) -> None:
        clut = out.child("CLUT")
        clut.set("GridGranularity", str(record.table.shape[0]))
        _write_table(clut.child("TableData"), record.table, self.encoding)


def _tables(encoding: int) -> tuple[Part, ...]:
    return (
        Inside("Channels", *CHANNELS),
        Inside("Matrix", _Elements(9), default=lambda seen: {}),
        _Tables("BCurves", "input_tables", encoding),
        _SquareTable(encoding),
        _Tables("ACurves", "output_tables", encoding),
    )


TYPE_FORMS.add(
    Form("curveType", Curve, Inside("Curve", *CURVE_FORMS.by_name["Curve"].parts)),
    Form(
        "parametricCurveType",
        ParametricCurve,
        Inside("ParametricCurve", *CURVE_FORMS.by_name["ParametricCurve"].parts),
    ),
    Form("lutAtoBType", LutAToB, Inside("Channels", *CHANNELS), *reversed(_B_TO_A)),
    Form("lutBtoAType", LutBToA, Inside("Channels", *CHANNELS), *_B_TO_A),
    Form("lut8Type", Lut8, *_tables(Lut8.stored)),
    Form("lut16Type", Lut16, *_tables(Lut16.stored)),
)
