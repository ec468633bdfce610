"""Field types of the older tag types: texts of a stated or a fixed length, integers, rows of structures."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.icc.fields import Text, frozen
from iccbrdf.icc.layout import FieldType, Record, Seen
from iccbrdf.icc.reader import Reader


class CountedText(Text):
    """Text behind the 32-bit number of its code units, the NUL that ends it counted.

    `empty`: how many units there are where there is no text, none or the NUL.
    """

    def __init__(self, encoding: str, unit: int = 1, *, empty: int = 1) -> None:
        super().__init__(encoding)
        self.unit = unit
        self.empty = empty

    def read(self, reader: Reader, name: str, seen: Seen) -> str:
        count = int.from_bytes(reader.take(4, f"length of {name}"), "big")
        at = reader.position
        return self.decode(reader, bytes(reader.take(self.unit * count, name)), name, at)

    def write(self, out: bytearray, value: str, record: Any) -> None:
        data = value.encode(self.encoding) + bytes(self.unit)
        if not value:
            data = bytes(self.unit * self.empty)
        out += (len(data) // self.unit).to_bytes(4, "big") + data


class PaddedText(FieldType):
    """Latin-1 text of `shortest` characters or more in a fixed number of bytes, filled up with NUL."""

    def __init__(self, size: int, shortest: int = 0) -> None:
        self.size = size
        self.shortest = shortest

    def read(self, reader: Reader, name: str, seen: Seen) -> str:
        return bytes(reader.take(self.size, name)).split(b"\0")[0].decode("latin-1")

    def write(self, out: bytearray, value: str, record: Any) -> None:
        out += value.encode("latin-1").ljust(self.size, b"\0")

    def normal(self, value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError(f"found {value!r}, expected text")
        try:
            length = len(value.encode("latin-1"))
        except UnicodeEncodeError:
            length = -1
        if not self.shortest <= length < self.size or "\0" in value:
            raise ValueError(
                f"found {value!r}, expected {self.shortest} to {self.size - 1} characters of Latin-1"
            )
        return value


class Integers(FieldType):
    """An array of unsigned integers, stored as `stored`, with the shape that the fields before it give."""

    def __init__(self, stored: str, shape: Callable[[Seen], Sequence[int]]) -> None:
        self.stored = np.dtype(stored)
        self.shape = shape

    def read(self, reader: Reader, name: str, seen: Seen) -> npt.NDArray[Any]:
        shape = tuple(self.shape(seen))
        what = f"{name} of shape {shape}" if len(shape) > 1 else f"{shape[0]} numbers of {name}"
        data = reader.take(math.prod(shape) * self.stored.itemsize, what)
        reader.count_numbers(math.prod(shape))
        return self.normal(np.frombuffer(data, self.stored).reshape(shape))

    def write(self, out: bytearray, value: npt.NDArray[Any], record: Any) -> None:
        out += value.astype(self.stored).tobytes()

    def normal(self, value: Any) -> npt.NDArray[Any]:
        return frozen(value, self.stored.newbyteorder("="))


class Structures(FieldType):
    """Records of one class back to back; their fields may depend on those of the structure around them."""

    def __init__(self, record: type[Record], count: Callable[[Seen], int]) -> None:
        self.record = record
        self.count = count

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Record, ...]:
        count = self.count(seen)
        reader.count_parts(count)
        return tuple(self.record.read(reader, seen) for _ in range(count))

    def write(self, out: bytearray, value: Sequence[Record], record: Any) -> None:
        for item in value:
            out += item.to_bytes()

    def normal(self, value: Any) -> tuple[Record, ...]:
        return members(value, self.record)


def members(values: Any, record: type[Any]) -> tuple[Any, ...]:
    """`values` as a tuple; ValueError where one of them is none of the class `record`."""
    for value in values:
        if not isinstance(value, record):
            raise ValueError(f"found {value!r}, expected a {record.__name__}")
    return tuple(values)
