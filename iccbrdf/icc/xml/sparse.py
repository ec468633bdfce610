"""Sparse matrices in XML."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from iccbrdf.errors import UsageError
from iccbrdf.icc.sparse import SparseMatrix, SparseMatrixArray
from iccbrdf.icc.xml.composite import TYPE_FORMS
from iccbrdf.icc.xml.forms import Attribute, Form, Inside, Part, Seen, read_numbers, write_numbers
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.values import U16

_INTEGERS = (1, 2)
"""Matrix types of 8 and of 16 bits."""
_SMALL = 1 << 16
"""Entries of a matrix that may be written in full."""


class _Matrices(Part):
    """Matrices, each row by row with the entries that it has, or with all of them."""

    children = ("SparseMatrix", "FullMatrix")

    def read(self, node: Node, seen: Seen) -> None:
        integers = seen["kind"] in _INTEGERS
        seen["matrices"] = tuple(
            self._matrix(child, integers) for child in node if child.name in self.children
        )

    def _matrix(self, node: Node, integers: bool) -> SparseMatrix:
        node.expect(("rows", "cols"), ("SparseRow",))
        rows, columns = (node.value(U16, node.get(name), name) for name in ("rows", "cols"))
        try:
            if node.name == "FullMatrix":
                values = read_numbers(node, np.float32, 0)
                if values.size != rows * columns:
                    raise node.error(f"found {values.size} numbers, expected {rows} x {columns}")
                matrix = SparseMatrix.of(values.reshape(rows, columns))
            else:
                matrix = self._sparse(node, rows, columns)
        except UsageError as error:
            raise node.error(str(error)) from None
        within = np.clip(matrix.values, 0, 1)
        if not integers or np.array_equal(within, matrix.values):
            return matrix
        beyond = matrix.values[np.argmax(np.abs(matrix.values - within))]
        node.warn(f"found {beyond:g}, but integers stand for 0..1: the nearest of these is taken")
        return replace(matrix, values=within)

    @staticmethod
    def _sparse(node: Node, rows: int, columns: int) -> SparseMatrix:
        indices = [np.zeros(0, np.uint16)]
        values = [np.zeros(0)]
        starts = [0]
        for row in node:
            row.expect((), ("ColIndices", "ColData"))
            indices.append(read_numbers(row.required("ColIndices"), np.uint16, 0))
            values.append(read_numbers(row.required("ColData"), np.float32, 0))
            if len(indices[-1]) != len(values[-1]):
                raise row.error(f"found {len(indices[-1])} columns and {len(values[-1])} numbers")
            starts.append(starts[-1] + len(values[-1]))
        starts += [starts[-1]] * (rows + 1 - len(starts))  # rows that are left out have no entries
        return SparseMatrix(rows, columns, np.array(starts), np.concatenate(indices), np.concatenate(values))

    def write(self, out: Target, record: SparseMatrixArray) -> None:
        for matrix in record.matrices:
            counts = np.diff(matrix.starts.astype(int))
            # The ICC's tools do not read rows without entries.
            full = not counts.all() and matrix.values.all() and matrix.rows * matrix.columns <= _SMALL
            child = out.child("FullMatrix" if full else "SparseMatrix")
            child.set("rows", str(matrix.rows))
            child.set("cols", str(matrix.columns))
            if full:
                values = np.zeros((matrix.rows, matrix.columns), np.float32)
                values[np.repeat(np.arange(matrix.rows), counts), matrix.indices] = matrix.values
                write_numbers(child, values)
                continue
            for first, last in zip(matrix.starts[:-1], matrix.starts[1:], strict=True):
                row = child.child("SparseRow")
                write_numbers(row.child("ColIndices"), matrix.indices[first:last])
                write_numbers(row.child("ColData"), matrix.values[first:last])


TYPE_FORMS.add(
    Form(
        "sparseMatrixArrayType",
        SparseMatrixArray,
        Inside(
            "SparseMatrixArray",
            Attribute("outputChannels", "channels", U16),
            Attribute("matrixType", "kind", U16),
            _Matrices(),
        ),
    )
)
