"""The tag types in XML that are plain data."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np

from iccbrdf.icc.composite import Dictionary, Entry
from iccbrdf.icc.curves import SegmentedCurve
from iccbrdf.icc.elements import MultiProcess
from iccbrdf.icc.gamut import GamutBoundary
from iccbrdf.icc.packed import CompressedUtf8, CompressedXml, HeightImage, NormalImage, VendorXml
from iccbrdf.icc.spectral import SpectralDataInfo
from iccbrdf.icc.tags import (
    XYZ,
    Colorant,
    ColorantTable,
    DateTime,
    LocalisedText,
    Mluc,
    PlainText,
    SignatureTag,
    Utf8,
    Utf16,
    VideoCodePoints,
    ViewingConditions,
)
from iccbrdf.icc.xml.arrays import NUMBER_FORMS, Triple, Wavelengths, spectral_range
from iccbrdf.icc.xml.composite import TYPE_FORMS, BytesForm
from iccbrdf.icc.xml.elements import CHANNELS, CURVE_FORMS, ELEMENT_FORMS
from iccbrdf.icc.xml.forms import (
    Attribute,
    Content,
    Form,
    Inside,
    Numbers,
    Part,
    Records,
    Rows,
    Seen,
    read_numbers,
    read_parts,
    write_numbers,
)
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.values import (
    COLOUR,
    FIXED16,
    FLOAT32,
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


class TextData(Part):
    """Text in one element or several, as such, in hexadecimal digits, or in a file."""

    children: tuple[str, ...] = ("TextData", "HexTextData")
    _attributes = ("File",)

    def read(self, node: Node, seen: Seen) -> None:
        seen["text"] = "".join(self._piece(child) for child in node if child.name in self.children)

    def _piece(self, node: Node) -> str:
        node.expect(self._attributes, ())
        if node.name == "HexTextData":
            data = node.value(HEX_LINES, node.text)
        elif "File" in node.attributes:
            _, data = node.document.named(node, node.get("File"))
        else:
            return node.text
        try:
            return str(data, "utf-8")
        except UnicodeDecodeError as error:
            raise node.error(f"found bytes that are no UTF-8 ({error.reason})") from None

    def write(self, out: Target, record: Any) -> None:
        if _CONTROL.search(record.text):  # which XML cannot hold
            out.child("HexTextData").write(HEX_LINES.write(record.text.encode("utf-8")))
        else:
            out.child("TextData").write(record.text)


_CONTROL = re.compile("[\0-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


class _Compressed(TextData):
    """A compressed text as its bytes, or as text that is to be compressed."""

    children = ("HexCompressedData", *TextData.children)

    def read(self, node: Node, seen: Seen) -> None:
        packed = node.child("HexCompressedData")
        if packed is None:
            text: Seen = {}
            super().read(node, text)
            seen["data"] = CompressedUtf8.of(text["text"]).data
            return
        seen["data"] = packed.value(HEX_LINES, packed.text)

    def write(self, out: Target, record: Any) -> None:
        out.child("HexCompressedData").write(HEX_LINES.write(record.data))


class Language(Part):
    """Language and country in one attribute; written under the first of the `names`, read under any."""

    def __init__(self, *names: str) -> None:
        self.attributes = names

    def read(self, node: Node, seen: Seen) -> None:
        name = next((name for name in self.attributes if name in node.attributes), self.attributes[0])
        code = node.value(_CODE, node.get(name), name)
        seen["language"], seen["country"] = code[:2], code[2:]

    def write(self, out: Target, record: LocalisedText) -> None:
        out.set(self.attributes[0], _CODE.write(record.language + record.country))


_CODE = Codec(
    lambda text: signature_bytes(text).decode("latin-1"),
    lambda code: signature_text(code.encode("latin-1")),
)


TEXT = Codec(str, str)
LOCALISED = (Language("LanguageCountry"), Content("text", TEXT))


class _Translations(Part):
    """The texts of a dictionary's name or value in several languages; None where there are none."""

    def __init__(self, name: str, field: str) -> None:
        self.children = (name,)
        self.field = field
        self._rows = Rows(name, "texts", LocalisedText, *LOCALISED)

    def read(self, node: Node, seen: Seen) -> None:
        found: Seen = {}
        self._rows.read(node, found)
        seen[self.field] = Mluc(found["texts"]) if found["texts"] else None

    def write(self, out: Target, record: Entry) -> None:
        value: Mluc | None = getattr(record, self.field)
        if value is not None:
            self._rows.write(out, value)


def _date(text: str) -> tuple[int, ...]:
    match = re.fullmatch(r"\s*(\d{1,5})-(\d\d?)-(\d\d?)T(\d\d?):(\d\d?):(\d\d?)\s*", text)
    if match is None:
        raise ValueError(f"found {text!r:.40}, expected year-month-dayThours:minutes:seconds")
    return tuple(map(int, match.groups()))


DATE = Codec(_date, lambda d: f"{d[0]}-{d[1]:02}-{d[2]:02}T{d[3]:02}:{d[4]:02}:{d[5]:02}")

TYPE_FORMS.add(
    Form("utf8Type", Utf8, TextData(), aliases=("utf8TextType",)),
    Form("utf16Type", Utf16, TextData()),
    Form("textType", PlainText, TextData()),
    Form(
        "utf8ZipType",
        CompressedUtf8,
        _Compressed(),
        aliases=("zipUtf8TextType",),
    ),
    Form("zipXmlType", CompressedXml, _Compressed()),
    BytesForm("ZIPXmlType", VendorXml),
    Form("multiLocalizedUnicodeType", Mluc, Rows("LocalizedText", "texts", LocalisedText, *LOCALISED)),
    Form("signatureType", SignatureTag, Inside("Signature", Content("value", SIGNATURE))),
    Form("dateTimeType", DateTime, Inside("DateTime", Content("value", DATE))),
    Form(
        "dictType",
        Dictionary,
        Attribute("RecordSize", "record_size", U32, 32, omitted=True),
        Rows(
            "DictEntry",
            "entries",
            Entry,
            Attribute("Name", "name", TEXT),
            Attribute("Value", "value", TEXT, None, omitted=True),
            _Translations("LocalizedName", "display_name"),
            _Translations("LocalizedValue", "display_value"),
        ),
    ),
)


# Colours and light -------------------------------------------------------------------------------------


class _XYZNumbers(Part):
    """Any number of triples."""

    children = ("XYZNumber",)
    _triple = Triple("values", FIXED16)

    def read(self, node: Node, seen: Seen) -> None:
        values = []
        for child in node:
            row: Seen = {}
            read_parts((self._triple,), child, row)
            values.append(row["values"])
        seen["values"] = tuple(values)

    def write(self, out: Target, record: XYZ) -> None:
        for triple in record.values:
            self._triple.write(out.child(*self.children), SimpleNamespace(values=triple))


class _Lab(Part):
    """The colour of a colorant, stored in 16 bits, as L*, a*, b*."""

    attributes = ("Channel1", "Channel2", "Channel3")
    _scale, _offset = np.array([100.0, 255.0, 255.0]), np.array([0.0, 128.0, 128.0])

    def read(self, node: Node, seen: Seen) -> None:
        lab: Seen = {}
        Triple("lab", FLOAT32, self.attributes).read(node, lab)
        stored = np.rint((np.array(lab["lab"]) + self._offset) / self._scale * 65535)
        if not ((stored >= 0) & (stored <= 65535)).all():
            raise node.error(f"found the colour {lab['lab']}, expected L* in 0..100, a* and b* in -128..127")
        seen["pcs"] = tuple(int(n) for n in stored)

    def write(self, out: Target, record: Colorant) -> None:
        lab = np.array(record.pcs) / 65535 * self._scale - self._offset
        for name, value in zip(self.attributes, lab.tolist(), strict=True):
            out.set(name, f"{value:.6f}")


def _names(*names: str) -> tuple[str, ...]:
    return (*(f"Illuminant {name}" for name in names), *names)


OBSERVER = choice(
    {
        0: ("Unknown observer", "Unknown Observer", "Custom"),
        1: ("CIE 1931 (two degree) standard observer", "CIE 1931 standard colorimetric observer"),
        2: ("CIE 1964 (ten degree) standard observer", "CIE 1964 standard colorimetric observer"),
    }
)
_ILLUMINANTS = (
    "Unknown", "D50", "D65", "D93", "F2", "D55", "A", "EquiPowerE", "F8", "Black Body", "Daylight",
    "B", "C", "F1", "F3", "F4", "F5", "F6", "F7", "F9", "F10", "F11", "F12",
)  # fmt: skip
_MORE_NAMES = {0: ("Custom",), 7: _names("E")}
ILLUMINANT = choice(
    {number: (*_names(name), *_MORE_NAMES.get(number, ())) for number, name in enumerate(_ILLUMINANTS)}
)


_TEMPERATURE = Codec(
    lambda text: 0.0 if text.strip() in ("", "Unknown") else FLOAT32.read(text), FLOAT32.write
)


def _spectral(name: str, prefix: str, field: str, rows: int) -> Inside:
    """Numbers with their wavelengths; left out where there are none."""
    span, steps = f"{prefix}_range", f"{prefix}_steps"

    def shape(seen: Seen) -> tuple[int, ...]:
        return (rows, seen[steps]) if rows > 1 else (seen[steps],)

    def count(record: Any) -> int:
        return int(getattr(record, field).shape[-1])

    return Inside(
        name,
        Wavelengths(span, steps, count),
        Numbers(field, shape),
        default=lambda seen: {span: (0.0, 0.0), field: np.zeros(shape({steps: 0}))},
        present=lambda record: any(getattr(record, span)) or count(record) > 0,
    )


TYPE_FORMS.add(
    *NUMBER_FORMS.by_signature.values(),
    Form(
        "XYZArrayType",
        XYZ,
        _XYZNumbers(),
        aliases=("XYZType",),
    ),
    Form(
        "colorantTableType",
        ColorantTable,
        Inside(
            "ColorantTable",
            Rows("Colorant", "colorants", Colorant, Attribute("Name", "name", TEXT), _Lab()),
        ),
    ),
    Form(
        "cicpType",
        VideoCodePoints,
        Inside(
            "cicpFields",
            Attribute("ColorPrimaries", "colour_primaries", U8),
            Attribute("TransferCharacteristics", "transfer_characteristics", U8),
            Attribute("MatrixCoefficients", "matrix_coefficients", U8),
            Attribute("VideoFullRangeFlag", "full_range", U8),
        ),
    ),
    Form(
        "spectralViewingConditionsType",
        ViewingConditions,
        Inside("StdObserver", Content("observer", OBSERVER)),
        Inside("IlluminantXYZ", Triple("illuminant_XYZ", FLOAT32)),
        _spectral("ObserverFuncs", "observer", "observer_table", 3),
        Inside("StdIlluminant", Content("illuminant", ILLUMINANT)),
        Inside("ColorTemperature", Content("cct", _TEMPERATURE), default=lambda seen: {"cct": 0.0}),
        _spectral("IlluminantSPD", "illuminant", "spd", 1),
        Inside("SurroundXYZ", Triple("surround_XYZ", FLOAT32)),
    ),
    Form(
        "spectralDataInfoType",
        SpectralDataInfo,
        Inside("SpectralSpace", Content("space", COLOUR)),
        spectral_range("SpectralRange", "wavelengths", "steps"),
        spectral_range("BiSpectralRange", "bispectral_wavelengths", "bispectral_steps"),
    ),
)


# Surfaces and transforms -------------------------------------------------------------------------------


class _Vertices(Part):
    """The vertices of a gamut boundary, in the connection space and as device values."""

    children = ("Vertices",)
    _fields = (("PCSValues", "pcs"), ("DeviceValues", "device"))

    def read(self, node: Node, seen: Seen) -> None:
        vertices = node.child("Vertices")
        if vertices is None:
            raise node.error("no <Vertices> found in it, expected them")
        vertices.expect((), tuple(name for name, _ in self._fields))
        for name, field in self._fields:
            child = vertices.child(name)
            if child is not None:
                seen[field] = self._values(child)
            elif field == "device":
                seen[field] = np.zeros((len(seen["pcs"]), 0))
            else:
                raise vertices.error(f"no <{name}> found in it, expected one")

    @staticmethod
    def _values(node: Node) -> Any:
        channels = node.value(U16, node.get("channels"), "channels")
        values = read_numbers(node, np.float32, 0)
        if not channels or values.size % channels:
            raise node.error(f"found {values.size} numbers, expected a multiple of {channels} channels")
        return values.reshape(-1, channels)

    def write(self, out: Target, record: GamutBoundary) -> None:
        vertices = out.child("Vertices")
        for name, field in self._fields:
            values = getattr(record, field)
            if values.shape[1]:
                child = vertices.child(name)
                child.set("channels", str(values.shape[1]))
                write_numbers(child, values)


class _Triangles(Part):
    """The vertex numbers of each triangle."""

    children = ("Triangles",)

    def read(self, node: Node, seen: Seen) -> None:
        rows = []
        for child in node.child("Triangles") or ():
            rows.append(read_numbers(child, np.uint32, 0))
            if child.name != "T" or rows[-1].size != 3:
                raise child.error(f"found {rows[-1].size} numbers, expected three in <T>")
        seen["triangles"] = np.array(rows, np.uint32).reshape(-1, 3)

    def write(self, out: Target, record: GamutBoundary) -> None:
        triangles = out.child("Triangles")
        for row in record.triangles.tolist():
            triangles.child("T").write(" ".join(map(str, row)))


class _File(Part):
    """The bytes of a file: hexadecimal digits, or in a file that is named."""

    attributes = ("File", "Filename")

    def read(self, node: Node, seen: Seen) -> None:
        name = node.attributes.get("File") or node.attributes.get("Filename")
        if name:
            seen["image"] = node.document.named(node, name)[1]
        else:
            Content("image", HEX_LINES).read(node, seen)

    def write(self, out: Target, record: HeightImage | NormalImage) -> None:
        out.write(HEX_LINES.write(record.image))


_IMAGE = (Attribute("SeamlessIndicator", "seamless", U32), Attribute("EncodingFormat", "format", U32))
_IMAGE_FILE = Inside("Image", _File(), default=lambda seen: {"image": b""}, present=lambda r: bool(r.image))

TYPE_FORMS.add(
    Form(
        "multiProcessElementType",
        MultiProcess,
        Inside("MultiProcessElements", *CHANNELS, Records("elements", ELEMENT_FORMS)),
    ),
    Form(
        "segmentedCurveType",
        SegmentedCurve,
        Inside("SegmentedCurve", *CURVE_FORMS.by_name["SegmentedCurve"].parts),
    ),
    Form("gamutBoundaryDescType", GamutBoundary, _Vertices(), _Triangles()),
    Form(
        "embeddedHeightImageType",
        HeightImage,
        Inside(
            "HeightImage",
            *_IMAGE,
            Attribute("MetersMinPixelValue", "lowest", FLOAT32),
            Attribute("MetersMaxPixelValue", "highest", FLOAT32),
            _IMAGE_FILE,
        ),
    ),
    Form("embeddedNormalImageType", NormalImage, Inside("NormalImage", *_IMAGE, _IMAGE_FILE)),
)
