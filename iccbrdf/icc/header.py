"""The 128-byte profile header (ICC.2, 7.2)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from iccbrdf.icc.fields import F16, S15, SIGNATURE, U8, U16, U32, U64, Bytes, Constant, Repeat, Signature
from iccbrdf.icc.layout import Field, FieldType, Layout, Record, Seen
from iccbrdf.icc.reader import Reader

SIZE = 128
D50 = (0.9642, 1.0, 0.8249)
"""XYZ of the connection space's illuminant, Y = 1."""
MCS_SUBSET = 1 << 2
"""Flag: a profile that this one is linked with must have all the MCS channels of this one."""
EXTENDED_RANGE = 1 << 3
"""Flag: connection space values go beyond the usual range; the tags H2S0..3 take them to it."""

_COUNTED = re.compile(r"(nc|mc|rs|ts|es|bs|sm)[0-9a-f]{4}")
_CHANNELS = {
    "GRAY": 1, "RGB ": 3, "XYZ ": 3, "Lab ": 3, "Luv ": 3, "YCbr": 3, "Yxy ": 3, "HSV ": 3, "HLS ": 3,
    "CMY ": 3, "CMYK": 4,
}  # fmt: skip


class Colour(Signature):
    """A colour space: four characters, or two letters with a channel count, `nc000a` for 6e 63 00 0a."""

    def decode(self, data: bytes) -> str:
        text = f"{data[:2].decode('latin-1')}{data[2:].hex()}"
        return text if _COUNTED.fullmatch(text) else super().decode(data)

    def encode(self, value: str) -> bytes:
        if isinstance(value, str) and _COUNTED.fullmatch(value.lower()):
            return value[:2].lower().encode("ascii") + bytes.fromhex(value[2:])
        return super().encode(value)


class Version(FieldType):
    """Major version in one byte, minor and bug fix version in the halves of the next."""

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[int, int, int]:
        major, rest = reader.take(2, name)
        return major, rest >> 4, rest & 15

    def write(self, out: bytearray, value: tuple[int, int, int], record: Any) -> None:
        out += bytes((value[0], value[1] << 4 | value[2]))

    def normal(self, value: Any) -> tuple[int, int, int]:
        major, minor, fix = value
        if not (0 <= major < 256 and 0 <= minor < 16 and 0 <= fix < 16):
            raise ValueError(f"found {value}, expected (major, minor, bug fix), the last two up to 15")
        return major, minor, fix


_RANGE = Repeat(F16, 2)


@dataclass(frozen=True, eq=False)
class Header(Record):
    """The header of a profile.

    Signatures are four characters, "" where the file has zeros; colour spaces with a channel count are
    two letters and four hexadecimal digits (`nc000a`: ten channels).  `size` and `profile_id` are what was
    read; they are computed anew when a profile is written.  The creation date has a fixed default, not the
    clock's, so that the same input gives the same file.
    """

    device_class: str
    colour_space: str = ""
    pcs: str = ""
    mcs: str = ""
    version: tuple[int, int, int] = (5, 0, 0)
    subclass_version: tuple[int, int] = (0, 0)
    created: tuple[int, int, int, int, int, int] = (2020, 1, 1, 0, 0, 0)
    flags: int = 0
    rendering_intent: int = 1
    illuminant: tuple[float, float, float] = D50
    attributes: int = 0
    cmm: str = ""
    platform: str = ""
    manufacturer: str = ""
    model: str = ""
    creator: str = ""
    device_subclass: str = ""
    spectral_pcs: str = ""
    spectral_range: tuple[float, float] = (0.0, 0.0)
    spectral_steps: int = 0
    bispectral_range: tuple[float, float] = (0.0, 0.0)
    bispectral_steps: int = 0
    size: int = 0
    profile_id: bytes = bytes(16)
    reserved: bytes = bytes(4)

    layout = Layout(
        Field("size", U32),
        Field("cmm", SIGNATURE),
        Field("version", Version()),
        Field("subclass_version", Repeat(U8, 2)),
        Field("device_class", SIGNATURE),
        Field("colour_space", Colour()),
        Field("pcs", Colour()),
        Field("created", Repeat(U16, 6)),
        Constant(b"acsp", ", which every ICC profile has there"),
        Field("platform", SIGNATURE),
        Field("flags", U32),
        Field("manufacturer", SIGNATURE),
        Field("model", SIGNATURE),
        Field("attributes", U64),
        Field("rendering_intent", U32),
        Field("illuminant", Repeat(S15, 3)),
        Field("creator", SIGNATURE),
        Field("profile_id", Bytes(16)),
        Field("spectral_pcs", Colour()),
        Field("spectral_range", _RANGE),
        Field("spectral_steps", U16),
        Field("bispectral_range", _RANGE),
        Field("bispectral_steps", U16),
        Field("mcs", Colour()),
        Field("device_subclass", SIGNATURE),
        Field("reserved", Bytes(4)),
    )

    @property
    def mcs_subset(self) -> bool:
        """Whether the other profile of a link must have all the MCS channels of this one."""
        return bool(self.flags & MCS_SUBSET)

    @property
    def extended_range(self) -> bool:
        """Whether connection space values go beyond the usual range."""
        return bool(self.flags & EXTENDED_RANGE)


def channel_count(space: str) -> int | None:
    """The number of channels of a colour space as the header names it; None for one that is not known here.

    >>> channel_count("nc000a"), channel_count("CMYK"), channel_count("7CLR")
    (10, 4, 7)
    """
    if _COUNTED.fullmatch(space):
        return int(space[2:], 16)
    if re.fullmatch(r"[1-9A-F]CLR", space):
        return int(space[0], 16)
    return _CHANNELS.get(space)
