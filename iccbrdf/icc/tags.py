"""The tag types that are plain data: texts, numbers, signatures, arrays of tags, viewing conditions.

`TAGS` is the registry; a further type is a `Record` with its layout and `@TAGS.add("sign")`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.icc.fields import (
    F16,
    F32,
    S15,
    SIGNATURE,
    U8,
    U16,
    U32,
    Bytes,
    FloatArray,
    Floats,
    Positioned,
    Repeat,
    Reserved,
    Text,
    frozen,
    tag_layout,
    utf16_text,
)
from iccbrdf.icc.layout import Field, FieldType, Layout, Record, Registry, Seen
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.rows import PaddedText, Structures

TAGS = Registry("tag type")

_NO_FLOATS = np.zeros(0, np.float32)


@dataclass(frozen=True, eq=False)
class Unknown(Record):
    """A tag of a type that is not in the registry: everything after its signature as it stands."""

    signature: str
    reserved: bytes
    data: bytes

    layout = Layout(Field("signature", SIGNATURE), Field("reserved", Bytes(4)), Field("data", Bytes()))


TAGS.unknown = Unknown


@TAGS.add("utf8")
@dataclass(frozen=True, eq=False)
class Utf8(Record):
    """utf8Type: UTF-8 text.  A NUL at its end, which some writers add, is dropped on reading."""

    text: str

    signature = "utf8"
    layout = tag_layout(signature, Field("text", Text("utf-8")))


@TAGS.add("text")
@dataclass(frozen=True, eq=False)
class PlainText(Record):
    """textType: 7-bit text that a NUL ends; read as Latin-1, which old profiles put there."""

    text: str

    signature = "text"
    layout = tag_layout(signature, Field("text", Text("latin-1", end=b"\0")))


@TAGS.add("ut16")
@dataclass(frozen=True, eq=False)
class Utf16(Record):
    """utf16Type: UTF-16 text.  A NUL at its end, which some writers add, is dropped on reading."""

    text: str

    signature = "ut16"
    layout = tag_layout(signature, Field("text", Text("utf-16-be")))


@TAGS.add("dtim")
@dataclass(frozen=True, eq=False)
class DateTime(Record):
    """dateTimeType: year, month, day, hours, minutes, seconds; UTC."""

    value: tuple[int, int, int, int, int, int]

    signature = "dtim"
    layout = tag_layout(signature, Field("value", Repeat(U16, 6)))


@TAGS.add("cicp")
@dataclass(frozen=True, eq=False)
class VideoCodePoints(Record):
    """cicpType: the coding-independent code points of ITU-T H.273 that a video signal is described by."""

    colour_primaries: int
    transfer_characteristics: int
    matrix_coefficients: int
    full_range: int

    signature = "cicp"
    layout = tag_layout(
        signature,
        Field("colour_primaries", U8),
        Field("transfer_characteristics", U8),
        Field("matrix_coefficients", U8),
        Field("full_range", U8),
    )


@TAGS.add("sig ")
@dataclass(frozen=True, eq=False)
class SignatureTag(Record):
    """signatureType: four characters."""

    value: str

    signature = "sig "
    layout = tag_layout(signature, Field("value", SIGNATURE))


@TAGS.add("XYZ ")
@dataclass(frozen=True, eq=False)
class XYZ(Record):
    """XYZType: triples of X, Y, Z in steps of 1/65536, usually one, with Y = 1 for white."""

    values: tuple[tuple[float, float, float], ...]

    signature = "XYZ "
    layout = tag_layout(signature, Field("values", Repeat(Repeat(S15, 3))))

    @classmethod
    def of(cls, X: float, Y: float, Z: float) -> XYZ:
        """One triple."""
        return cls(((X, Y, Z),))


@dataclass(frozen=True)
class LocalisedText:
    """A text with its ISO 639-1 language and ISO 3166-1 country, two characters each."""

    language: str
    country: str
    text: str


class _LocalisedTexts(FieldType):
    """The records and UTF-16 texts of a multiLocalizedUnicodeType, after its record count and size."""

    _record = struct.Struct(">2s2sII")

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[LocalisedText, ...]:
        table = reader.take(self._record.size * seen["count"], "text records")
        heads = list(self._record.iter_unpack(table))
        spans = [(offset, size) for *_, size, offset in heads if size]
        texts = iter(reader.parts(spans, lambda i: f"text {i}", lambda part, _: utf16_text(part)))
        return tuple(
            LocalisedText(lang.decode("latin-1"), country.decode("latin-1"), next(texts) if size else "")
            for lang, country, size, _ in heads
        )

    def write(self, out: bytearray, value: Sequence[LocalisedText], record: Any) -> None:
        start = len(out) + self._record.size * len(value)
        encoded = [v.text.encode("utf-16-be") for v in value]
        for item, data in zip(value, encoded, strict=True):
            head = item.language.encode("latin-1"), item.country.encode("latin-1")
            out += self._record.pack(*head, len(data), start)
            start += len(data)
        out += b"".join(encoded)

    def normal(self, value: Iterable[LocalisedText]) -> tuple[LocalisedText, ...]:
        for item in value:
            if not isinstance(item, LocalisedText):
                raise ValueError(f"found {item!r}, expected a LocalisedText")
            if len(item.language.encode("latin-1")) != 2 or len(item.country.encode("latin-1")) != 2:
                raise ValueError(f"found {item.language!r}, {item.country!r}, expected two characters each")
            item.text.encode("utf-16-be")
        return tuple(value)


@TAGS.add("mluc")
@dataclass(frozen=True, eq=False)
class Mluc(Record):
    """multiLocalizedUnicodeType: one text in several languages."""

    texts: tuple[LocalisedText, ...]

    signature = "mluc"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.texts)),
        Field("record_size", U32, derived=lambda r: 12, valid=(12,)),
        Field("texts", _LocalisedTexts()),
    )

    @classmethod
    def of(cls, text: str, language: str = "en", country: str = "US") -> Mluc:
        """One text in one language."""
        return cls((LocalisedText(language, country, text),))

    @property
    def text(self) -> str:
        """The English text, else the first one, else ""."""
        english = [t.text for t in self.texts if t.language == "en"]
        return (english or [t.text for t in self.texts] or [""])[0]


NUMBERS: dict[str, tuple[str, str, int]] = {
    "ui08": ("u1", ">u1", 1),
    "ui16": ("u2", ">u2", 1),
    "ui32": ("u4", ">u4", 1),
    "ui64": ("u8", ">u8", 1),
    "fl16": ("f2", ">f2", 1),
    "fl32": ("f4", ">f4", 1),
    "fl64": ("f8", ">f8", 1),
    "sf32": ("f8", ">i4", 65536),
    "uf32": ("f8", ">u4", 65536),
}
"""Type in memory, type in the file and steps per unit of the numeric array types."""


class _Numbers(FieldType):
    """Numbers of the type that the signature names, to the end of the structure."""

    def read(self, reader: Reader, name: str, seen: Seen) -> npt.NDArray[Any]:
        memory, stored, steps = NUMBERS[seen["signature"]]
        if reader.left % np.dtype(stored).itemsize:
            raise reader.error(f"found {reader.left} bytes, no whole number of {seen['signature']} values")
        numbers = np.frombuffer(reader.take(reader.left, name), stored)
        reader.count_numbers(numbers.size)
        return numbers / steps if steps > 1 else numbers.astype(memory)

    def write(self, out: bytearray, value: npt.NDArray[Any], record: Any) -> None:
        _, stored, steps = NUMBERS[record.signature]
        out += (np.rint(value * steps) if steps > 1 else value).astype(stored).tobytes()


@TAGS.add(*NUMBERS)
@dataclass(frozen=True, eq=False)
class NumberArray(Record):
    """One of the numeric array types, `signature` in `NUMBERS`: a flat array in its own NumPy type.

    The fixed-point types (`sf32`, `uf32`) are held as float64, exactly.
    """

    signature: str
    values: npt.NDArray[Any]

    layout = Layout(Field("signature", SIGNATURE, valid=NUMBERS), Reserved(4), Field("values", _Numbers()))

    def check(self) -> None:
        memory, stored, steps = NUMBERS[self.signature]
        values = frozen(self.values, memory)
        if values.ndim != 1:
            raise ValueError(f"values: found {values.ndim} dimensions, expected 1")
        if steps > 1:
            # Finite and in range once scaled, and rounded to what the file can hold.
            with np.errstate(invalid="ignore"):
                values = frozen(frozen(np.rint(values * steps), stored) / steps, memory)
        object.__setattr__(self, "values", values)

    def normalised(self) -> npt.NDArray[np.float64]:
        """The numbers as float64, ui08 and ui16 scaled so that their largest stands for 1."""
        scale = {"ui08": 255.0, "ui16": 65535.0}.get(self.signature, 1.0)
        return self.values.astype(np.float64) / scale


@TAGS.add("tary")
@dataclass(frozen=True, eq=False)
class TagArray(Record):
    """tagArrayType: tags in a row; None for a null position.

    A material type array (`mcta`) is one of `Utf8`.  Its array type is written as `utf8`, which the
    reference implementation demands; the standard's `mcta` is read as well.
    """

    array_type: str
    items: tuple[Any, ...]

    signature = "tary"
    layout = tag_layout(
        signature,
        Field("array_type", SIGNATURE),
        Field("count", U32, derived=lambda r: len(r.items)),
        Field("items", Positioned(TAGS, "item", lambda seen: int(seen["count"]), optional=True)),
    )

    @classmethod
    def of_texts(cls, texts: Iterable[str]) -> TagArray:
        """An array of UTF-8 texts, such as the names of MCS channels."""
        return cls("utf8", tuple(Utf8(text) for text in texts))

    def texts(self) -> tuple[str, ...]:
        """The texts of an array of `Utf8`; ValueError where it holds anything else."""
        for index, item in enumerate(self.items):
            if not isinstance(item, Utf8):
                found = "nothing" if item is None else f"type {item.signature!r}"
                raise ValueError(f"item {index}: found {found}, expected type 'utf8'")
        return tuple(item.text for item in self.items)


@dataclass(frozen=True, eq=False)
class Colorant(Record):
    """A device channel's name and its colour in the connection space, as stored in 16 bits (0: not said)."""

    name: str
    pcs: tuple[int, int, int] = (0, 0, 0)

    layout = Layout(Field("name", PaddedText(32, shortest=1)), Field("pcs", Repeat(U16, 3)))


@TAGS.add("clrt")
@dataclass(frozen=True, eq=False)
class ColorantTable(Record):
    """colorantTableType: the names of the device channels, in order."""

    colorants: tuple[Colorant, ...]

    signature = "clrt"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.colorants)),
        Field("colorants", Structures(Colorant, lambda seen: int(seen["count"]))),
    )

    @classmethod
    def of(cls, names: Iterable[str]) -> ColorantTable:
        """Names alone."""
        return cls(tuple(Colorant(name) for name in names))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(colorant.name for colorant in self.colorants)


OBSERVERS = {"CIE 1931 2 Degree Standard Observer": 1, "CIE 1964 10 Degree Standard Observer": 2}
"""Observer -> id in spectralViewingConditionsType (ICC.2, 10.2.21); names of colour-science."""
ILLUMINANTS = {
    "D50": 1, "D65": 2, "D55": 5, "A": 6, "E": 7, "B": 11, "C": 12,
    "FL1": 13, "FL2": 4, "FL3": 14, "FL4": 15, "FL5": 16, "FL6": 17,
    "FL7": 18, "FL8": 8, "FL9": 19, "FL10": 20, "FL11": 21, "FL12": 22,
}  # fmt: skip
"""Illuminant -> id in spectralViewingConditionsType; names of colour-science."""


@TAGS.add("svcn")
@dataclass(frozen=True, eq=False)
class ViewingConditions(Record):
    """spectralViewingConditionsType: the observer and the illuminant that colours are seen with.

    observer : 0 custom, 1 CIE 1931 (2 degree), 2 CIE 1964 (10 degree)
    observer_table : colour-matching functions, shape (3, N), at N wavelengths over `observer_range` (nm)
    illuminant : 0 custom, 1 D50, 2 D65, 3 D93, 4 F2, 5 D55, 6 A, 7 E, 8 F8, 9 black body, 10 daylight, ...
    cct : correlated colour temperature in K, for illuminants 9 and 10
    spd : relative spectral power, shape (M,), at M wavelengths over `illuminant_range` (nm)
    illuminant_XYZ, surround_XYZ : absolute, Y in cd/m^2.  Stored as float32, as the reference
        implementation does, although the standard's text says XYZNumber.
    """

    observer: int
    illuminant: int
    illuminant_XYZ: tuple[float, float, float]
    surround_XYZ: tuple[float, float, float]
    observer_range: tuple[float, float] = (0.0, 0.0)
    observer_table: FloatArray = field(default_factory=lambda: _NO_FLOATS.reshape(3, 0))
    illuminant_range: tuple[float, float] = (0.0, 0.0)
    spd: FloatArray = field(default_factory=lambda: _NO_FLOATS)
    cct: float = 0.0

    signature = "svcn"
    layout = tag_layout(
        signature,
        Field("observer", U32),
        Field("observer_range", Repeat(F16, 2)),
        Field("observer_steps", U16, derived=lambda r: r.observer_table.shape[1]),
        Reserved(2),
        Field("observer_table", Floats(lambda seen: (3, seen["observer_steps"]))),
        Field("illuminant", U32),
        Field("cct", F32),
        Field("illuminant_range", Repeat(F16, 2)),
        Field("illuminant_steps", U16, derived=lambda r: len(r.spd)),
        Reserved(2),
        Field("spd", Floats(lambda seen: (seen["illuminant_steps"],))),
        Field("illuminant_XYZ", Repeat(F32, 3)),
        Field("surround_XYZ", Repeat(F32, 3)),
    )

    def check(self) -> None:
        if self.observer_table.ndim != 2 or len(self.observer_table) != 3:
            raise ValueError(f"observer_table: found shape {self.observer_table.shape}, expected (3, N)")
        if self.spd.ndim != 1:
            raise ValueError(f"spd: found shape {self.spd.shape}, expected (M,)")
        for name in ("observer_range", "illuminant_range"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name}: found {getattr(self, name)}, expected finite wavelengths")
