"""The tag types in XML that versions 2 and 4 have."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import UsageError
from iccbrdf.icc.classic import (
    MACINTOSH,
    Chromaticity,
    ColorantOrder,
    DataTag,
    Measurement,
    NamedColour,
    NamedColours,
    PlainViewingConditions,
    TextDescription,
)
from iccbrdf.icc.printer import (
    BlackGeneration,
    CrdInfo,
    DeviceSettings,
    ResponseCurve,
    ResponseCurves,
    Screening,
)
from iccbrdf.icc.xml.arrays import Triple
from iccbrdf.icc.xml.composite import TYPE_FORMS, BytesForm
from iccbrdf.icc.xml.forms import (
    Attribute,
    Content,
    Form,
    Inside,
    Part,
    Rows,
    Seen,
    read_numbers,
    read_parts,
)
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.tags import ILLUMINANT, OBSERVER, TEXT, TextData
from iccbrdf.icc.xml.values import (
    FIXED16,
    FLOAT32,
    HEX,
    HEX_LINES,
    SIGNATURE,
    U8,
    U16,
    U32,
    Codec,
    choice,
    signature_bytes,
    signature_text,
)

# Texts -------------------------------------------------------------------------------------------------

_LANGUAGE = Codec(
    lambda text: int.from_bytes(signature_bytes(text), "big"),
    lambda number: signature_text(number.to_bytes(4, "big")),
)


class _Macintosh(Part):
    """The Macintosh text: its bytes, how many of them are used if not all, and are stored if not 67."""

    attributes = ("ScriptCode", "Used", "Stored")

    def read(self, node: Node, seen: Seen) -> None:
        Attribute("ScriptCode", "script", U16).read(node, seen)
        data = node.value(HEX, node.text)
        stored = node.value(U8, node.attributes.get("Stored", str(MACINTOSH)), "Stored")
        used = node.value(U8, node.attributes["Used"], "Used") if "Used" in node.attributes else len(data)
        seen["macintosh"], seen["macintosh_size"] = data.ljust(stored, b"\0"), used

    def write(self, out: Target, record: TextDescription) -> None:
        data = record.macintosh[: max(record.macintosh_size, len(record.macintosh.rstrip(b"\0")))]
        out.set("ScriptCode", str(record.script))
        if len(data) != record.macintosh_size:
            out.set("Used", str(record.macintosh_size))
        if len(record.macintosh) != MACINTOSH:
            out.set("Stored", str(len(record.macintosh)))
        out.write(HEX.write(data))


TYPE_FORMS.add(
    Form(
        "textDescriptionType",
        TextDescription,
        TextData(),
        Inside(
            "Unicode",
            Attribute("LanguageCode", "language", _LANGUAGE, 0, omitted=True),
            Content("unicode", TEXT),
            default=lambda seen: {"unicode": "", "language": 0},
            present=lambda record: record.unicode or record.language,
        ),
        Inside(
            "MacScript",
            _Macintosh(),
            default=lambda seen: {"macintosh": bytes(MACINTOSH), "macintosh_size": 0, "script": 0},
            present=lambda r: r.script or r.macintosh_size or r.macintosh != bytes(MACINTOSH),
        ),
    )
)

# Conditions --------------------------------------------------------------------------------------------

_LARGEST = (1 << 32) - 1
_GEOMETRY = choice(
    {
        0: ("Geometry Unknown",),
        1: ("Geometry 0-45 or 45-0",),
        2: ("Geometry 0-d or d-0",),
        _LARGEST: ("Max Geometry",),
    }
)
_FLARES = choice({0: ("Flare 0",), 1 << 16: ("Flare 100",), _LARGEST: ("Max Flare",)})
_FLARE = Codec(
    lambda text: _FLARES.read(text) / (1 << 16), lambda value: _FLARES.write(round(value * (1 << 16)))
)
_COLORANTS = choice(
    {
        0: ("Customized Encoding", "Unknown"),
        1: ("ITU-R BT.709",),
        2: ("SMPTE RP145-1994",),
        3: ("EBU Tech.3213-E",),
        4: ("P22",),
    }
)
# The ICC's tools write an `f` behind x.
_FIXED16_F = Codec(lambda text: FIXED16.read(text.strip().removesuffix("f")), FIXED16.write)


class _Order(Part):
    """Numbers in elements of their own."""

    children = ("n",)

    def read(self, node: Node, seen: Seen) -> None:
        seen["order"] = tuple(node.value(U8, child.text) for child in node)

    def write(self, out: Target, record: ColorantOrder) -> None:
        for number in record.order:
            out.child("n").write(str(number))


def _pair(**values: float) -> tuple[float, float]:
    return values["x"], values["y"]


class _Channels(Rows):
    """Chromaticities of channels."""

    def __init__(self) -> None:
        super().__init__("Channel", "xy", _pair, *(Attribute(name, name, _FIXED16_F) for name in "xy"))

    def write(self, out: Target, record: Chromaticity) -> None:
        for pair in record.xy:
            child = out.child(self.name)
            for name, value in zip("xy", pair, strict=True):
                child.set(name, FIXED16.write(value))


TYPE_FORMS.add(
    Form(
        "viewingConditionsType",
        PlainViewingConditions,
        Inside("IlluminantXYZ", Triple("illuminant_XYZ", FIXED16)),
        Inside("SurroundXYZ", Triple("surround_XYZ", FIXED16)),
        Inside("IllumType", Content("illuminant", ILLUMINANT)),
    ),
    Form(
        "measurementType",
        Measurement,
        Inside("StandardObserver", Content("observer", OBSERVER)),
        Inside("MeasurementBacking", Triple("backing", FIXED16)),
        Inside("Geometry", Content("geometry", _GEOMETRY)),
        Inside("Flare", Content("flare", _FLARE)),
        Inside("StandardIlluminant", Content("illuminant", ILLUMINANT)),
    ),
    Form("chromaticityType", Chromaticity, Inside("Colorant", Content("colorants", _COLORANTS)), _Channels()),
    Form("colorantOrderType", ColorantOrder, Inside("ColorantOrder", _Order())),
)

# Colours by name ---------------------------------------------------------------------------------------

_FLAGS = Codec(lambda text: int.from_bytes(HEX.read(text.rjust(8, "0")), "big"), lambda value: f"{value:08x}")


@dataclass(frozen=True)
class _Space:
    """How a connection space is stored in 16 bits: `scale` steps per unit, behind `offset`."""

    colour: Triple
    scale: npt.NDArray[np.float64]
    offset: npt.NDArray[np.float64]


_LAB = _Space(
    Triple("pcs", FLOAT32, ("L", "a", "b")), np.array([652.8, 256.0, 256.0]), np.array([0.0, 128.0, 128.0])
)
_XYZ = _Space(Triple("pcs", FLOAT32), np.full(3, 32768.0), np.zeros(3))
_STEPS = {8: 257, 16: 1, 32: 65535}
"""Of a 16-bit device value per unit of one of so many bits."""
_BITS = choice({8: ("int8",), 16: ("int16",), 32: ("float",)})


class _NamedColours(Part):
    """Colours as L*, a*, b* or as X, Y, Z, each with the device values in it."""

    attributes = ("DeviceEncoding",)
    children = ("LabNamedColor", "XYZNamedColor", "NamedColor")

    def read(self, node: Node, seen: Seen) -> None:
        bits = node.value(_BITS, node.get("DeviceEncoding"), "DeviceEncoding")
        steps = _STEPS.get(bits, 1)
        seen["colours"] = tuple(self._colour(child, steps) for child in node if child.name in self.children)

    @staticmethod
    def _colour(node: Node, steps: int) -> NamedColour:
        space = _XYZ if "X" in node.attributes else _LAB
        node.expect(("Name", *space.colour.attributes), ("n", "f"))
        values: Seen = {}
        space.colour.read(node, values)
        pcs = (np.array(values["pcs"]) + space.offset) * space.scale
        device = read_numbers(node, np.float32, 0) * steps
        try:
            with np.errstate(invalid="ignore"):  # what is no number becomes one out of range
                stored = [tuple(np.rint(found).astype(int).tolist()) for found in (pcs, device)]
            return NamedColour(node.get("Name"), *stored)
        except UsageError as error:
            raise node.error(str(error)) from None

    def write(self, out: Target, record: NamedColours) -> None:
        out.set("DeviceEncoding", "int16")
        for colour in record.colours:
            child = out.child(self.children[0])
            child.set("Name", colour.name)
            values = np.array(colour.pcs) / _LAB.scale - _LAB.offset
            for name, value in zip(_LAB.colour.attributes, values.tolist(), strict=True):
                child.set(name, f"{value:.6f}")
            child.write(" ".join(map(str, colour.device)))


_KIND = choice({0: ("ASCII",), 1: ("binary",)})

TYPE_FORMS.add(
    Form(
        "namedColor2Type",
        NamedColours,
        Inside(
            "NamedColors",
            Attribute("VendorFlag", "flags", _FLAGS),
            Attribute("CountOfDeviceCoords", "channels", U32),
            Attribute("Prefix", "prefix", TEXT),
            Attribute("Suffix", "suffix", TEXT),
            _NamedColours(),
        ),
    ),
    Form("dataType", DataTag, Inside("Data", Attribute("Flag", "kind", _KIND), Content("data", HEX_LINES))),
)

# Printers ----------------------------------------------------------------------------------------------

_UNITS = {
    "StaA": "Status A",
    "StaE": "Status E",
    "StaI": "Status I",
    "StaT": "Status T",
    "StaM": "Status M",
    "DN  ": "DIN with no polarizing filter",
    "DN P": "DIN with polarizing filter",
    "DNN ": "Narrow band DIN with no polarizing filter",
    "DNNP": "Narrow band DIN with polarizing filter",
}
_UNIT_OF = {name: unit for unit, name in _UNITS.items()}


def _read_unit(text: str) -> str:
    other = re.fullmatch(r"Unknown Measurement Type '(.*)'", text)
    return _UNIT_OF.get(text) or str(SIGNATURE.read(other[1] if other else text))


_UNIT = Codec(_read_unit, lambda unit: _UNITS.get(unit) or SIGNATURE.write(unit))


class _Responses(Part):
    """The responses of each channel, with XYZ of its full amount."""

    children = ("ChannelResponses",)
    _maximum = Triple("maximum", FIXED16)
    _rows = Rows(
        "Measurement",
        "rows",
        lambda **row: (row["code"], row["value"]),
        Attribute("DeviceCode", "code", U16),
        Attribute("MeasValue", "value", FIXED16),
    )

    def read(self, node: Node, seen: Seen) -> None:
        channels: list[dict[str, Any]] = []
        for child in node:
            channels.append({})
            read_parts((self._maximum, self._rows), child, channels[-1])
        seen["maxima"] = tuple(channel["maximum"] for channel in channels)
        seen["responses"] = tuple(np.reshape(channel["rows"], (-1, 2)) for channel in channels)

    def write(self, out: Target, record: ResponseCurve) -> None:
        for maximum, rows in zip(record.maxima, record.responses, strict=True):
            channel = out.child(self.children[0])
            for name, value in zip("XYZ", maximum, strict=True):
                channel.set(name, FIXED16.write(value))
            for code, value in rows.tolist():
                row = channel.child("Measurement")
                row.set("DeviceCode", str(int(code)))
                row.set("MeasValue", FIXED16.write(value))
                row.set("Reserved", "0")  # without which the ICC's tools write what was in memory


TYPE_FORMS.add(
    Form(
        "responseCurveSet16Type",
        ResponseCurves,
        Inside("CountOfChannels", Content("channels", U16)),
        Rows(
            "ResponseCurve",
            "curves",
            ResponseCurve,
            Attribute("MeasUnitSignature", "unit", _UNIT),
            _Responses(),
        ),
    ),
    # The ICC's tools have names for these, but write what is in them as bytes.
    BytesForm("crdInfoType", CrdInfo),
    BytesForm("screeningType", Screening),
    BytesForm("ucrBgType", BlackGeneration),
    BytesForm("deviceSettingsType", DeviceSettings),
)
