"""A calculator program: the flat list of 8-byte operations that an ICC.2 calculator element holds."""

from __future__ import annotations

import struct
from typing import NamedTuple, TypeAlias


class Op(NamedTuple):
    """One operation as stored: its signature without the padding blanks, and its four operand bytes as a u32.

    What the operand means (a float32, two u16, a count, a signature) is a column of the operator table,
    so that decode -> encode is lossless whatever stands in unused operands.
    """

    name: str
    operand: int = 0

    @property
    def s(self) -> int:
        """The first u16 of the operand."""
        return self.operand >> 16

    @property
    def t(self) -> int:
        """The second u16 of the operand."""
        return self.operand & 0xFFFF

    @property
    def value(self) -> float:
        """The operand read as a float32 (`data`)."""
        return float(struct.unpack(">f", struct.pack(">I", self.operand))[0])


Program: TypeAlias = tuple[Op, ...]
