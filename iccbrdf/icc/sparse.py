"""The tag type of sparse matrices, which bi-spectral colours are made of (ICC.2, 4.2.5 and 10.2.20)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import UsageError
from iccbrdf.icc.fields import ENCODINGS, U16, U32, FloatArray, Floats, encodable, frozen, tag_layout
from iccbrdf.icc.layout import Field, FieldType, Record, Seen
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.rows import Integers, members
from iccbrdf.icc.tags import TAGS


@dataclass(frozen=True, eq=False)
class SparseMatrix:
    """The entries of a matrix that are stored; all others are 0.

    rows, columns : its shape
    starts : shape (rows + 1,): row `i` has the entries starts[i] to starts[i + 1] - 1
    indices : shape (entries,): the column of each entry, which increases in a row
    values : shape (entries,), float32
    """

    rows: int
    columns: int
    starts: npt.NDArray[np.uint16]
    indices: npt.NDArray[np.uint16]
    values: FloatArray

    def __post_init__(self) -> None:
        try:
            for name in ("starts", "indices"):
                object.__setattr__(self, name, frozen(getattr(self, name), np.uint16))
            object.__setattr__(self, "values", frozen(self.values, np.float32))
            self._check()
        except ValueError as error:
            raise UsageError(f"SparseMatrix: {error}") from None

    def _check(self) -> None:
        U16.normal(self.rows), U16.normal(self.columns)
        count = len(self.values)
        if self.starts.shape != (self.rows + 1,) or self.starts[0] or self.starts[-1] != count:
            raise ValueError(
                f"starts: found {self.starts}, expected {self.rows + 1} of them from 0 to {count}"
            )
        if (self.starts[1:] < self.starts[:-1]).any():
            raise ValueError("starts: found a row that ends before it begins")
        if self.indices.shape != (count,) or self.values.ndim != 1:
            raise ValueError(f"found {self.indices.shape} indices of {self.values.shape} values")
        if count and self.indices.max() >= self.columns:
            raise ValueError(f"indices: found {self.indices.max()}, expected less than {self.columns}")
        within = np.ones(count + 1, bool)
        within[self.starts] = False
        if (self.indices[1:] <= self.indices[:-1])[within[1:count]].any():
            raise ValueError("indices: found two of a row that do not increase")

    @classmethod
    def of(cls, matrix: Any) -> SparseMatrix:
        """Of a matrix of shape (rows, columns): its entries that are not 0."""
        dense = np.atleast_2d(np.asarray(matrix, np.float32))
        row, indices = np.nonzero(dense)
        starts = np.searchsorted(row, np.arange(len(dense) + 1))
        rows, columns = dense.shape
        values = dense[row, indices]
        return cls(rows, columns, starts.astype(np.uint16), indices.astype(np.uint16), values)


class _Matrices(FieldType):
    """Matrices back to back, their indices and their values each filled up to a multiple of four bytes."""

    _starts = Integers(">u2", lambda seen: (seen["rows"] + 1,))
    _indices = Integers(">u2", lambda seen: (seen["entries"],))
    _values = Floats(lambda seen: (seen["entries"],))

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[SparseMatrix, ...]:
        reader.count_parts(seen["count"])
        return tuple(self._matrix(reader, 4 - seen["kind"]) for _ in range(seen["count"]))

    def _matrix(self, reader: Reader, encoding: int) -> SparseMatrix:
        at = reader.position
        rows, columns = (U16.read(reader, side, {}) for side in ("rows", "columns"))
        starts = self._starts.read(reader, "starts", {"rows": rows})
        shape = {"entries": int(starts[-1]), "encoding": encoding}
        indices = self._indices.read(reader, "indices", shape)
        reader.take(-reader.position % 4, "padding")
        values = self._values.read(reader, "values", shape)
        reader.take(-reader.position % 4, "padding")
        try:
            return SparseMatrix(rows, columns, starts, indices, values)
        except UsageError as error:
            raise reader.error(str(error), at=at) from None

    def write(self, out: bytearray, value: Sequence[SparseMatrix], record: Any) -> None:
        for matrix in value:
            for number in (matrix.rows, matrix.columns):
                U16.write(out, number, record)
            self._starts.write(out, matrix.starts, record)
            self._indices.write(out, matrix.indices, record)
            out += bytes(-len(out) % 4)
            self._values.write(out, matrix.values, record)
            out += bytes(-len(out) % 4)

    def normal(self, value: Any) -> tuple[SparseMatrix, ...]:
        return members(value, SparseMatrix)


@TAGS.add("smat")
@dataclass(frozen=True, eq=False)
class SparseMatrixArray(Record):
    """sparseMatrixArrayType: sparse matrices.

    channels : of the spectral connection space that a matrix stands for; readers that unpack the matrices to
        single precision keep four bytes a channel for each, in which its indices must find room as well
    kind : how values are stored: 1 uInt8, 2 uInt16 (1 and 2 stand for 0..1), 3 float16, 4 float32
    """

    channels: int
    kind: int
    matrices: tuple[SparseMatrix, ...]

    signature = "smat"
    layout = tag_layout(
        signature,
        Field("channels", U16),
        Field("kind", U16, valid=range(1, len(ENCODINGS) + 1)),
        Field("count", U32, derived=lambda r: len(r.matrices)),
        Field("matrices", _Matrices()),
    )

    @property
    def encoding(self) -> int:
        """The number of the value encoding, as that of an `ExtendedClut`."""
        return len(ENCODINGS) - self.kind

    def check(self) -> None:
        stored = (replace(m, values=encodable(m.values, self.encoding)) for m in self.matrices)
        object.__setattr__(self, "matrices", tuple(stored))
