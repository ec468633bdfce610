"""The profile header in XML."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from iccbrdf.errors import nearest
from iccbrdf.icc.header import Header
from iccbrdf.icc.xml.arrays import Triple, spectral_range
from iccbrdf.icc.xml.forms import Content, Form, Inside, Part, Seen, optional
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.tags import DATE
from iccbrdf.icc.xml.values import COLOUR, FIXED16, HEX, SIGNATURE, Codec, choice


def _decimal(byte: int) -> str:
    """A byte of two decimal digits."""
    high, low = byte >> 4, byte & 15
    if high > 9 or low > 9:
        raise ValueError(f"found the byte 0x{byte:02x}, expected two decimal digits")
    return f"{high}{low}"


def _byte(text: str) -> int:
    if not text.isdecimal() or len(text) > 2:
        raise ValueError(f"found {text!r:.20}, expected up to two digits")
    return int(text) // 10 << 4 | int(text) % 10


def _read_version(text: str) -> tuple[int, int, int]:
    # `4.3` is 4.0.3 and `4.30` is 4.3.0: the second number holds both digits, as the ICC's tools have it.
    major, _, minor = text.strip().partition(".")
    number, rest = _byte(major), _byte(minor or "0")
    return number, rest >> 4, rest & 15


def _read_pair(text: str) -> tuple[int, int]:
    major, _, minor = text.strip().partition(".")
    return _byte(major), _byte(minor or "0")


_VERSION = Codec(_read_version, lambda v: f"{int(_decimal(v[0]))}.{_decimal(v[1] << 4 | v[2])}")
_PAIR = Codec(_read_pair, lambda v: f"{int(_decimal(v[0]))}.{_decimal(v[1])}")
_INTENT = choice(
    {
        0: ("Perceptual",),
        1: ("Relative", "Relative Colorimetric"),
        2: ("Saturation",),
        3: ("Absolute", "Absolute Colorimetric"),
    }
)


def _read_created(text: str) -> tuple[int, ...]:
    # The clock is not asked: the same file gives the same profile.
    return Header.created if text.strip().lower() == "now" else tuple(DATE.read(text))


def _read_hex_number(text: str) -> int:
    if not re.fullmatch(r"(0x)?[0-9A-Fa-f]{1,16}", text.strip()):
        raise ValueError(f"found {text!r:.40}, expected hexadecimal digits")
    return int(text, 16)


_HEX_NUMBER = Codec(_read_hex_number, hex)


class _Bits(Part):
    """A number whose bits are attributes of one element; those without a name are in `rest`, hexadecimal.

    names: attribute -> bit, and the values that stand for 0 and 1.
    """

    def __init__(self, field: str, rest: str, digits: int, names: Mapping[str, tuple[int, str, str]]) -> None:
        self.attributes = (*names, rest)
        self.field = field
        self.rest = rest
        self.digits = digits
        self.names = names

    def read(self, node: Node, seen: Seen) -> None:
        value = 0
        for name, (bit, *states) in self.names.items():
            state = node.attributes.get(name, states[0])
            if state.lower() not in (states[0].lower(), states[1].lower()):
                raise node.error(f"{name}: found {state!r:.40}: {nearest(state, states)}")
            value |= (state.lower() == states[1].lower()) << bit
        rest = node.value(_HEX_NUMBER, node.attributes.get(self.rest, "0"), self.rest)
        seen[self.field] = value | rest

    def write(self, out: Target, record: Any) -> None:
        value = getattr(record, self.field)
        for name, (bit, *states) in self.names.items():
            out.set(name, states[value >> bit & 1])
            value &= ~(1 << bit)
        if value:
            out.set(self.rest, f"{value:0{self.digits}x}")


def _present(name: str, field: str, codec: Codec, default: Any = "") -> Inside:
    """A value that is written always and may be missing."""
    return Inside(name, Content(field, codec), default=lambda seen: {field: default})


ATTRIBUTES = Inside(
    "DeviceAttributes",
    _Bits(
        "attributes",
        "VendorSpecific",
        16,
        {
            "ReflectiveOrTransparency": (0, "reflective", "transparency"),
            "GlossyOrMatte": (1, "glossy", "matte"),
            "MediaPolarity": (2, "positive", "negative"),
            "MediaColour": (3, "colour", "blackAndWhite"),
        },
    ),
    default=lambda seen: {"attributes": 0},
)
"""What a device does with light, in a header or a profile sequence."""

HEADER = Form(
    "Header",
    Header,
    _present("PreferredCMMType", "cmm", SIGNATURE),
    _present("ProfileVersion", "version", _VERSION, Header.version),
    optional("ProfileSubClassVersion", Content("subclass_version", _PAIR), (0, 0)),
    Inside("ProfileDeviceClass", Content("device_class", SIGNATURE)),
    optional("ProfileDeviceSubClass", Content("device_subclass", SIGNATURE), ""),
    _present("DataColourSpace", "colour_space", COLOUR),
    _present("PCS", "pcs", COLOUR),
    _present("CreationDateTime", "created", Codec(_read_created, DATE.write), Header.created),
    optional("PrimaryPlatform", Content("platform", SIGNATURE), ""),
    Inside(
        "ProfileFlags",
        _Bits(
            "flags",
            "VendorFlags",
            8,
            {
                "EmbeddedInFile": (0, "false", "true"),
                "UseWithEmbeddedDataOnly": (1, "false", "true"),
                "ExtendedRangePCS": (3, "false", "true"),
                "MCSNeedsSubset": (2, "false", "true"),
            },
        ),
        default=lambda seen: {"flags": 0},
    ),
    optional("DeviceManufacturer", Content("manufacturer", SIGNATURE), ""),
    optional("DeviceModel", Content("model", SIGNATURE), ""),
    ATTRIBUTES,
    _present("RenderingIntent", "rendering_intent", _INTENT, 0),
    Inside(
        "PCSIlluminant",
        Inside("XYZNumber", Triple("illuminant", FIXED16)),
        default=lambda seen: {"illuminant": (0.0, 0.0, 0.0)},
    ),
    _present("ProfileCreator", "creator", SIGNATURE),
    optional("ProfileID", Content("profile_id", Codec(lambda text: bytes(16), HEX.write)), bytes(16)),
    optional("SpectralPCS", Content("spectral_pcs", COLOUR), ""),
    spectral_range("SpectralRange", "spectral_range", "spectral_steps"),
    spectral_range("BiSpectralRange", "bispectral_range", "bispectral_steps"),
    optional("MCS", Content("mcs", COLOUR), ""),
    optional("Reserved", Content("reserved", HEX), bytes(4)),
    signature="",
)
