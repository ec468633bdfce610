"""The look-up-table tag types of version 2 profiles, lut8Type and lut16Type: matrix, curves, table, curves.

All values stand for 0..1, the encoding of the space on either side (ICC.1, 10.10 and 10.11).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from iccbrdf.icc.fields import (
    S15,
    U8,
    U16,
    Bytes,
    FloatArray,
    Floats,
    Repeat,
    Reserved,
    encodable,
    tag_layout,
)
from iccbrdf.icc.layout import Field, Layout, Record, Seen
from iccbrdf.icc.tags import TAGS

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def _layout(signature: str, encoding: int, *sizes: Field) -> Layout:
    def entries(side: str, seen: Seen) -> int:
        return int(seen[f"{side}_entries"]) if sizes else 256

    return tag_layout(
        signature,
        Field("inputs", U8, derived=lambda r: r.inputs, valid=range(1, 17)),
        Field("outputs", U8, derived=lambda r: r.outputs, valid=range(1, 256)),
        Field("grid", U8, derived=lambda r: r.table.shape[0], valid=range(2, 256)),
        Reserved(1),
        Field("matrix", Repeat(S15, 9)),
        *sizes,
        Field("input_tables", Floats(lambda seen: (seen["inputs"], entries("input", seen)), encoding)),
        Field("table", Floats(lambda seen: (*[seen["grid"]] * seen["inputs"], seen["outputs"]), encoding)),
        Field("output_tables", Floats(lambda seen: (seen["outputs"], entries("output", seen)), encoding)),
        Field("padding", Bytes()),
    )


class _Tables(Record):
    """What the two types share.

    input_tables : shape (inputs, entries), a curve for each input over 0..1
    table : shape (grid, ..., grid, outputs)
    output_tables : shape (outputs, entries)
    matrix : three rows, applied first, where the inputs are XYZ
    padding : bytes after the last curve that some writers count in the size of the tag
    """

    input_tables: FloatArray
    table: FloatArray
    output_tables: FloatArray
    stored: int

    @property
    def inputs(self) -> int:
        return self.table.ndim - 1

    @property
    def outputs(self) -> int:
        return int(self.table.shape[-1])

    def check(self) -> None:
        *grid, outputs = self.table.shape or (0,)
        if not 1 <= len(grid) <= 16 or len(set(grid)) > 1 or not 2 <= grid[0] <= 255 or not 0 < outputs < 256:
            raise ValueError(
                f"table: found shape {self.table.shape}, expected 1 to 16 inputs of 2 to 255 grid points, "
                "the same for all, then up to 255 outputs"
            )
        for name, count in (("input_tables", len(grid)), ("output_tables", outputs)):
            shape = getattr(self, name).shape
            if len(shape) != 2 or shape[0] != count or not self.lengths(shape[1]):
                raise ValueError(f"{name}: found shape {shape}, expected {count} rows of {self.expected}")
        for name in ("input_tables", "table", "output_tables"):
            object.__setattr__(self, name, encodable(getattr(self, name), self.stored))

    expected: str
    """The number of entries of a curve, for messages."""

    def lengths(self, entries: int) -> bool:
        """Whether a curve may have so many entries."""
        raise NotImplementedError


@TAGS.add("mft1")
@dataclass(frozen=True, eq=False)
class Lut8(_Tables):
    """lut8Type: stored in 8 bits, curves of 256 entries."""

    input_tables: FloatArray
    table: FloatArray
    output_tables: FloatArray
    matrix: tuple[float, ...] = _IDENTITY
    padding: bytes = b""

    signature = "mft1"
    stored = 3
    expected = "256"
    layout = _layout(signature, stored)

    def lengths(self, entries: int) -> bool:
        return entries == 256


def _size(side: str) -> Field:
    def entries(record: Any) -> int:
        return int(getattr(record, f"{side}_tables").shape[1])

    return Field(f"{side}_entries", U16, derived=entries, valid=range(2, 4097))


@TAGS.add("mft2")
@dataclass(frozen=True, eq=False)
class Lut16(_Tables):
    """lut16Type: stored in 16 bits, curves of 2 to 4096 entries."""

    input_tables: FloatArray
    table: FloatArray
    output_tables: FloatArray
    matrix: tuple[float, ...] = _IDENTITY
    padding: bytes = b""

    signature = "mft2"
    stored = 2
    expected = "2 to 4096"
    layout = _layout(signature, stored, _size("input"), _size("output"))

    def lengths(self, entries: int) -> bool:
        return 2 <= entries <= 4096
