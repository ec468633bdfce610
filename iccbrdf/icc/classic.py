"""The tag types of versions 2 and 4 that version 5 has other means for (ICC.1:2010, 10; ICC.1:2001-04, 6.5).

Those that only printers have are in `printer`.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

from iccbrdf.errors import ProfileWarning
from iccbrdf.icc.fields import (
    S15,
    U8,
    U16,
    U16_16,
    U32,
    Bytes,
    Repeat,
    tag_layout,
)
from iccbrdf.icc.layout import Field, FieldType, Layout, Record, Seen
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.rows import CountedText, PaddedText, Structures
from iccbrdf.icc.tags import TAGS

MACINTOSH = 67
"""Bytes of the Macintosh text of a textDescriptionType, however long it is."""


class _Rest(FieldType):
    """A field that old writers left out, as far as the structure goes: zeros, with a warning."""

    def __init__(self, type: FieldType, size: int) -> None:
        self.type = type
        self.size = size

    def read(self, reader: Reader, name: str, seen: Seen) -> Any:
        if reader.left >= self.size:
            return self.type.read(reader, name, seen)
        message = f"{reader.where}: {name}: found {reader.left} bytes, expected {self.size}; zeros are taken"
        warnings.warn(message, ProfileWarning, stacklevel=2)
        data = bytes(reader.take(reader.left, name)).ljust(self.size, b"\0")
        return self.type.read(Reader(data, reader.source, reader.place), name, seen)

    def write(self, out: bytearray, value: Any, record: Any) -> None:
        self.type.write(out, value, record)

    def normal(self, value: Any) -> Any:
        return self.type.normal(value)


class _Macintosh(Bytes):
    """The bytes to the end of the structure, up to 67; some writers store fewer."""

    def read(self, reader: Reader, name: str, seen: Seen) -> bytes:
        return bytes(reader.take(min(reader.left, MACINTOSH), name))


@TAGS.add("desc")
@dataclass(frozen=True, eq=False)
class TextDescription(Record):
    """textDescriptionType of version 2: a text in ASCII and, where a writer cared, in two other forms.

    text : read as Latin-1, which old profiles put there
    unicode : the same for all languages, of which `language` is the code
    macintosh : 67 bytes, by some writers fewer, of which `macintosh_size` are used, in Macintosh `script`
    """

    text: str
    unicode: str = ""
    language: int = 0
    script: int = 0
    macintosh_size: int = 0
    macintosh: bytes = bytes(MACINTOSH)

    signature = "desc"
    layout = tag_layout(
        signature,
        Field("text", CountedText("latin-1")),
        Field("language", _Rest(U32, 4)),
        Field("unicode", _Rest(CountedText("utf-16-be", 2, empty=0), 4)),
        Field("script", _Rest(U16, 2)),
        Field("macintosh_size", _Rest(U8, 1)),
        Field("macintosh", _Macintosh()),
    )

    def check(self) -> None:
        if max(self.macintosh_size, len(self.macintosh)) > MACINTOSH:
            raise ValueError(
                f"macintosh: found {self.macintosh_size} of {len(self.macintosh)} bytes, expected up to "
                f"{MACINTOSH}"
            )


@TAGS.add("view")
@dataclass(frozen=True, eq=False)
class PlainViewingConditions(Record):
    """viewingConditionsType: what colours are seen under, as XYZ in cd/m^2.

    `illuminant` is its kind, as that of `ViewingConditions`, the type of version 5.
    """

    illuminant_XYZ: tuple[float, float, float]
    surround_XYZ: tuple[float, float, float]
    illuminant: int

    signature = "view"
    layout = tag_layout(
        signature,
        Field("illuminant_XYZ", Repeat(S15, 3)),
        Field("surround_XYZ", Repeat(S15, 3)),
        Field("illuminant", U32),
    )


@TAGS.add("meas")
@dataclass(frozen=True, eq=False)
class Measurement(Record):
    """measurementType: how the colours were measured that a profile was made of.

    observer : 0 not known, 1 CIE 1931 (2 degree), 2 CIE 1964 (10 degree)
    backing : XYZ of what lay behind the samples
    geometry : 0 not known, 1 0/45 or 45/0, 2 0/d or d/0
    flare : 0..1
    illuminant : its kind, as that of `ViewingConditions`
    """

    observer: int
    backing: tuple[float, float, float]
    geometry: int
    flare: float
    illuminant: int

    signature = "meas"
    layout = tag_layout(
        signature,
        Field("observer", U32),
        Field("backing", Repeat(S15, 3)),
        Field("geometry", U32),
        Field("flare", U16_16),
        Field("illuminant", U32),
    )


@TAGS.add("chrm")
@dataclass(frozen=True, eq=False)
class Chromaticity(Record):
    """chromaticityType: x and y of each channel's phosphor or colorant.

    `colorants` names a known set of them: 1 ITU-R BT.709, 2 SMPTE RP 145, 3 EBU Tech. 3213-E, 4 P22; 0 none.
    """

    colorants: int
    xy: tuple[tuple[float, float], ...]

    signature = "chrm"
    layout = tag_layout(
        signature,
        Field("channels", U16, derived=lambda r: len(r.xy)),
        Field("colorants", U16),
        Field("xy", Repeat(Repeat(U16_16, 2), lambda seen: int(seen["channels"]))),
    )


@TAGS.add("clro")
@dataclass(frozen=True, eq=False)
class ColorantOrder(Record):
    """colorantOrderType: the numbers of the device channels in the order in which they are laid down."""

    order: tuple[int, ...]

    signature = "clro"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.order), valid=range(1 << 16)),
        Field("order", Repeat(U8, lambda seen: int(seen["count"]))),
    )


@dataclass(frozen=True, eq=False)
class NamedColour(Record):
    """A name with its colour, as stored in 16 bits, in the connection space and as device values."""

    name: str
    pcs: tuple[int, int, int]
    device: tuple[int, ...] = ()

    layout = Layout(
        Field("name", PaddedText(32, shortest=1)),
        Field("pcs", Repeat(U16, 3)),
        Field("device", Repeat(U16, lambda seen: int(seen["channels"]))),
    )


@TAGS.add("ncl2")
@dataclass(frozen=True, eq=False)
class NamedColours(Record):
    """namedColor2Type: colours by name.

    Each name stands between `prefix` and `suffix`.  The 16-bit numbers stand for 0..1 of a device channel,
    and in the connection space for XYZ or, as in version 2, for L* 0..100 up to 65280, a*, b* around 32768.
    `channels` of the device are told, 0 to 16.  `flags` are the maker's.
    """

    colours: tuple[NamedColour, ...]
    channels: int = 0
    prefix: str = ""
    suffix: str = ""
    flags: int = 0

    signature = "ncl2"
    layout = tag_layout(
        signature,
        Field("flags", U32),
        Field("count", U32, derived=lambda r: len(r.colours)),
        Field("channels", U32, valid=range(17)),
        Field("prefix", PaddedText(32)),
        Field("suffix", PaddedText(32)),
        Field("colours", Structures(NamedColour, lambda seen: int(seen["count"]))),
    )

    def check(self) -> None:
        for colour in self.colours:
            if len(colour.device) != self.channels:
                raise ValueError(
                    f"colour {colour.name!r}: found {len(colour.device)} device values, "
                    f"expected {self.channels}"
                )


@TAGS.add("data")
@dataclass(frozen=True, eq=False)
class DataTag(Record):
    """dataType: bytes whose meaning is agreed upon elsewhere; `kind` 0 is 7-bit text, 1 binary data."""

    kind: int
    data: bytes

    signature = "data"
    layout = tag_layout(signature, Field("kind", U32), Field("data", Bytes()))
