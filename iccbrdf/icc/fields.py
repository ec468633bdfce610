"""The field types: how numbers, signatures, arrays and tables of positions are stored (all big-endian)."""

from __future__ import annotations

import math
import operator
import struct
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from iccbrdf.icc.layout import FieldType, Layout, Registry, Seen
from iccbrdf.icc.reader import Reader

Count: TypeAlias = int | Callable[[Seen], int]
"""How many of something a field holds: a number, or a function of the fields read before."""
FloatArray: TypeAlias = npt.NDArray[np.floating[Any]]
"""Any floating-point array will do to make a record; in the record it is float32 and read-only."""


def frozen(values: Any, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """A read-only copy as `dtype`; ValueError where a value is outside the range of `dtype`.

    What is read-only, of that type and owner of its numbers is given back as it is.
    """
    given = np.asarray(values)
    flags = given.flags
    if given.dtype == dtype and flags.owndata and flags.c_contiguous and not flags.writeable:
        return given
    with np.errstate(over="ignore", invalid="ignore"):
        array = np.array(given, dtype=dtype, order="C")
        if array.dtype == given.dtype:
            lost = None  # tables may be large, and most are of this type
        elif array.dtype.kind == "f":
            lost = np.isinf(array) & ~np.isinf(given if given.dtype.kind == "f" else given.astype(np.float64))
        else:
            lost = array != given
    if lost is not None and lost.any():
        raise ValueError(f"found {given[lost].flat[0]}, which {array.dtype.name} cannot hold")
    array.setflags(write=False)
    return array


class Constant(FieldType):
    """Fixed bytes that mark a structure; anything else there is an error."""

    def __init__(self, expected: bytes, why: str = "") -> None:
        self.expected = expected
        self.why = why

    def read(self, reader: Reader, name: str, seen: Seen) -> bytes:
        at = reader.position
        found = bytes(reader.take(len(self.expected), f"signature {self.expected!r}"))
        if found != self.expected:
            raise reader.error(f"found {found!r}, expected {self.expected!r}{self.why}", at=at)
        return found

    def write(self, out: bytearray, value: Any, record: Any) -> None:
        out += self.expected


class Reserved(FieldType):
    """Bytes written as zeros and not looked at."""

    def __init__(self, size: int) -> None:
        self.size = size

    def read(self, reader: Reader, name: str, seen: Seen) -> None:
        reader.take(self.size, "reserved bytes")

    def write(self, out: bytearray, value: Any, record: Any) -> None:
        out += bytes(self.size)


class Bytes(FieldType):
    """Raw bytes: `size` of them, or all to the end of the structure."""

    def __init__(self, size: Count | None = None) -> None:
        self.size = size

    def read(self, reader: Reader, name: str, seen: Seen) -> bytes:
        size = self.size(seen) if callable(self.size) else self.size
        data = reader.take(reader.left if size is None else size, name)
        reader.count_bytes(len(data))
        return bytes(data)

    def write(self, out: bytearray, value: bytes, record: Any) -> None:
        out += value

    def normal(self, value: Any) -> bytes:
        if not isinstance(value, (bytes, bytearray, memoryview)):
            raise ValueError(f"found {value!r}, expected bytes")
        if isinstance(self.size, int) and len(value) != self.size:
            raise ValueError(f"found {len(value)} bytes, expected {self.size}")
        return bytes(value)


def utf16_text(reader: Reader) -> str:
    """All of a window as UTF-16, any NUL characters included."""
    reader.count_bytes(reader.left)
    try:
        return bytes(reader.take(reader.left, "text")).decode("utf-16-be")
    except UnicodeDecodeError as error:
        raise reader.error(f"found bytes that are no UTF-16 ({error.reason})", at=error.start) from None


class Text(FieldType):
    """Text to the end of the structure, without the NUL characters that may end it."""

    def __init__(self, encoding: str, end: bytes = b"") -> None:
        self.encoding = encoding
        self.end = end

    def read(self, reader: Reader, name: str, seen: Seen) -> str:
        at = reader.position
        return self.decode(reader, bytes(reader.take(reader.left, name)), name, at)

    def decode(self, reader: Reader, data: bytes, name: str, at: int) -> str:
        """The text that `data`, read at window offset `at`, stands for."""
        reader.count_bytes(len(data))
        try:
            return data.decode(self.encoding).rstrip("\0")
        except UnicodeDecodeError as error:
            raise reader.error(
                f"{name}: found bytes that are no {self.encoding} ({error.reason})", at=at + error.start
            ) from None

    def write(self, out: bytearray, value: str, record: Any) -> None:
        out += value.encode(self.encoding) + self.end

    def normal(self, value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError(f"found {value!r}, expected text")
        try:
            value.encode(self.encoding)
        except UnicodeEncodeError as error:
            raise ValueError(f"found {value!r}, expected {self.encoding} text: {error.reason}") from None
        return value.rstrip("\0")


class Integer(FieldType):
    """An unsigned integer; `code` as in the struct module."""

    def __init__(self, code: str) -> None:
        self._struct = struct.Struct(">" + code)
        self.limit = 256**self._struct.size

    def read(self, reader: Reader, name: str, seen: Seen) -> int:
        return int(self._struct.unpack(reader.take(self._struct.size, name))[0])

    def write(self, out: bytearray, value: int, record: Any) -> None:
        out += self._struct.pack(value)

    def normal(self, value: Any) -> int:
        number = operator.index(value)
        if not 0 <= number < self.limit:
            raise ValueError(f"found {number}, expected 0 to {self.limit - 1}")
        return number


class Float(FieldType):
    """An IEEE floating-point number; `code` as in the struct module."""

    def __init__(self, code: str) -> None:
        self._struct = struct.Struct(">" + code)

    def read(self, reader: Reader, name: str, seen: Seen) -> float:
        return float(self._struct.unpack(reader.take(self._struct.size, name))[0])

    def write(self, out: bytearray, value: float, record: Any) -> None:
        out += self._struct.pack(value)

    def normal(self, value: Any) -> float:
        try:
            return float(self._struct.unpack(self._struct.pack(value))[0])
        except (OverflowError, struct.error):
            raise ValueError(
                f"found {value!r}, expected a number in the range of {8 * self._struct.size}-bit floats"
            ) from None


class Fixed16(FieldType):
    """A fixed-point number of 32 bits in steps of 1/65536, rounded half away from zero."""

    def __init__(self, *, signed: bool) -> None:
        self.signed = signed
        self.first = -(2**31) if signed else 0

    def read(self, reader: Reader, name: str, seen: Seen) -> float:
        return int.from_bytes(reader.take(4, name), "big", signed=self.signed) / 65536

    def write(self, out: bytearray, value: float, record: Any) -> None:
        out += round(value * 65536).to_bytes(4, "big", signed=self.signed)

    def normal(self, value: Any) -> float:
        steps = float(value) * 65536
        if not self.first - 0.5 < steps < self.first + 2.0**32 - 0.5:
            lowest = self.first // 65536
            raise ValueError(f"found {value}, expected {lowest} to {lowest + 65535}.99998")
        return math.copysign(math.floor(abs(steps) + 0.5), steps) / 65536


class Signature(FieldType):
    """Four characters; "" for four zero bytes."""

    def read(self, reader: Reader, name: str, seen: Seen) -> str:
        return self.decode(bytes(reader.take(4, name)))

    def write(self, out: bytearray, value: str, record: Any) -> None:
        out += self.encode(value)

    def normal(self, value: Any) -> str:
        return self.decode(self.encode(value))

    def decode(self, data: bytes) -> str:
        return data.decode("latin-1") if any(data) else ""

    def encode(self, value: str) -> bytes:
        try:
            data = value.encode("latin-1")
        except (AttributeError, UnicodeEncodeError):
            data = b"?"
        if len(data) not in (0, 4):
            raise ValueError(f"found {value!r}, expected four characters or none")
        return data or bytes(4)


U8, U16, U32, U64 = (Integer(code) for code in "BHIQ")
F16, F32 = Float("e"), Float("f")
S15, U16_16 = Fixed16(signed=True), Fixed16(signed=False)
SIGNATURE = Signature()


_ONE_BY_ONE = 32
"""Numbers of an array that take the memory and the time of one that is read for itself."""


class Repeat(FieldType):
    """A tuple of `count` values of one type; without a count, as many as there are to the end."""

    def __init__(self, item: FieldType, count: Count | None = None) -> None:
        self.item = item
        self.count = count

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Any, ...]:
        if self.count is None:
            values = []
            while reader.left:
                reader.count_numbers(_ONE_BY_ONE)
                values.append(self.item.read(reader, name, seen))
            return tuple(values)
        count = self.count(seen) if callable(self.count) else self.count
        # There is no use in counting what will not be found.
        reader.count_numbers(_ONE_BY_ONE * min(count, reader.left))
        return tuple(self.item.read(reader, name, seen) for _ in range(count))

    def write(self, out: bytearray, value: Sequence[Any], record: Any) -> None:
        for item in value:
            self.item.write(out, item, record)

    def normal(self, value: Any) -> tuple[Any, ...]:
        values = tuple(self.item.normal(v) for v in value)
        if isinstance(self.count, int) and len(values) != self.count:
            raise ValueError(f"found {len(values)} values, expected {self.count}")
        return values


_PIECE = 1 << 20

ENCODINGS = ((">f4", 1), (">f2", 1), (">u2", 65535), (">u1", 255))
"""Storage type and divisor of the valueEncodingType 0 to 3."""


class Floats(FieldType):
    """An array of float32 with the shape that the fields before it give, which fills the structure or less.

    `encoding` says how the values are stored: 0 float32, 1 float16, 2 uInt16 and 3 uInt8, which stand for
    0..1; where the structure has a field of that name, this says it instead.
    """

    def __init__(self, shape: Callable[[Seen], Sequence[int]], encoding: int = 0) -> None:
        self.shape = shape
        self.encoding = encoding

    def read(self, reader: Reader, name: str, seen: Seen) -> FloatArray:
        shape = tuple(self.shape(seen))
        dtype, scale = ENCODINGS[seen.get("encoding", self.encoding)]
        count = math.prod(shape)
        data = reader.take(count * np.dtype(dtype).itemsize, name)
        reader.count_numbers(count)
        values = np.empty(shape, np.float32)
        with np.errstate(invalid="ignore"):  # a signalling NaN warns when it is widened
            values.reshape(-1)[:] = np.frombuffer(data, dtype)
        if scale > 1:
            values /= np.float32(scale)
        values.setflags(write=False)
        return values

    def write(self, out: bytearray, value: FloatArray, record: Any) -> None:
        dtype, scale = ENCODINGS[getattr(record, "encoding", self.encoding)]
        for piece in _pieces(value):
            out += (np.rint(piece.astype(np.float64) * scale) if scale > 1 else piece).astype(dtype).tobytes()

    def normal(self, value: Any) -> FloatArray:
        return frozen(value, np.float32)


def _pieces(values: FloatArray) -> Iterator[FloatArray]:
    """All values, some at a time: as float64 a table takes up to eight times its bytes."""
    flat = values.reshape(-1)
    for start in range(0, flat.size, _PIECE):
        yield flat[start : start + _PIECE]


def encodable(values: FloatArray, encoding: int) -> FloatArray:
    """`values` as value encoding `encoding` gives them back; ValueError where they are out of its range."""
    dtype, scale = ENCODINGS[encoding]
    if scale > 1:
        if values.size and not (values.min() >= 0 and values.max() <= 1):
            raise ValueError(f"found values outside 0..1, expected none for value encoding {encoding}")
        rounded = np.empty(values.shape, np.float32)
        for source, target in zip(_pieces(values), _pieces(rounded), strict=True):
            target[:] = np.rint(source.astype(np.float64) * scale)
        rounded /= np.float32(scale)
        rounded.setflags(write=False)
        return rounded
    return frozen(frozen(values, dtype), np.float32)


class Embedded(FieldType):
    """One record of a registry that fills the rest of the structure; its offsets count from its own start."""

    def __init__(self, registry: Registry) -> None:
        self.registry = registry

    def read(self, reader: Reader, name: str, seen: Seen) -> Any:
        return self.registry.read(reader.part(reader.position, reader.left, name))

    def write(self, out: bytearray, value: Any, record: Any) -> None:
        out += value.to_bytes()

    def normal(self, value: Any) -> Any:
        return self.registry.check(value)


class Sequential(FieldType):
    """Records of a registry back to back, without positions."""

    def __init__(self, registry: Registry, count: Callable[[Seen], int]) -> None:
        self.registry = registry
        self.count = count

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Any, ...]:
        count = self.count(seen)
        reader.count_parts(count)
        return tuple(self.registry.read(reader) for _ in range(count))

    def write(self, out: bytearray, value: Sequence[Any], record: Any) -> None:
        for item in value:
            out += item.to_bytes()

    def normal(self, value: Any) -> tuple[Any, ...]:
        return tuple(self.registry.check(v) for v in value)


class Positioned(FieldType):
    """A table of (offset, size) from the start of the structure, and the records of a registry behind it.

    A position 0, 0 is None where `optional`.  One object in several places is stored once.
    """

    def __init__(
        self, registry: Registry, name: str, count: Callable[[Seen], int], *, optional: bool = False
    ) -> None:
        self.registry = registry
        self.name = name
        self.count = count
        self.optional = optional

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Any, ...]:
        spans = read_spans(reader, self.count(seen), self.name)
        present = [s for s in spans if s != (0, 0) or not self.optional]
        parts = reader.parts(present, lambda i: f"{self.name} {i}", lambda part, _: self.registry.read(part))
        values = iter(parts)
        return tuple(None if s == (0, 0) and self.optional else next(values) for s in spans)

    def write(self, out: bytearray, value: Sequence[Any], record: Any) -> None:
        write_parts(out, value)

    def normal(self, value: Any) -> tuple[Any, ...]:
        return tuple(None if v is None and self.optional else self.registry.check(v) for v in value)


def read_spans(reader: Reader, count: int, name: str) -> list[tuple[int, int]]:
    """A position table of `count` entries: (offset, size) each."""
    return list(struct.iter_unpack(">II", reader.take(8 * count, f"position table of {count} {name}s")))


def write_parts(out: bytearray, values: Sequence[Any]) -> None:
    """Append a position table and, each at a multiple of four bytes, the parts that it points to."""
    table = len(out)
    out += bytes(8 * len(values))
    placed: dict[int, tuple[int, int]] = {}
    for index, value in enumerate(values):
        if value is None:
            continue
        if id(value) not in placed:
            out += bytes(-len(out) % 4)
            data = value.to_bytes()
            placed[id(value)] = len(out), len(data)
            out += data
        struct.pack_into(">II", out, table + 8 * index, *placed[id(value)])


def tag_layout(signature: str, *fields: Any, exact: bool = False) -> Layout:
    """The layout of a tag type: its signature, four reserved bytes, and `fields`."""
    return Layout(Constant(signature.encode("ascii")), Reserved(4), *fields, exact=exact)
