"""The processing elements in XML, but for calculators (which are in `calculator`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from iccbrdf.icc.appearance import JabToXYZ, XYZToJab
from iccbrdf.icc.curves import (
    CurveSet,
    FormulaSegment,
    SampledCalculatorCurve,
    SampledCurve,
    SampledSegment,
    SegmentedCurve,
)
from iccbrdf.icc.elements import (
    ELEMENTS,
    BeginAlternateSpace,
    Clut,
    EndAlternateSpace,
    ExtendedClut,
    Matrix,
    TintArray,
    UnknownElement,
)
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.spectral import (
    EmissionClut,
    EmissionMatrix,
    EmissionObserver,
    InverseEmissionMatrix,
    ReflectanceClut,
    ReflectanceObserver,
)
from iccbrdf.icc.tone import ToneFunction, ToneMap
from iccbrdf.icc.xml.arrays import NUMBER_FORMS, Grid, Triple, Wavelengths
from iccbrdf.icc.xml.forms import (
    Attribute,
    Content,
    Form,
    Forms,
    Inside,
    Numbers,
    Part,
    Records,
    Seen,
    Single,
    write_numbers,
)
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.values import (
    FLOAT32,
    HEX_LINES,
    RESERVED,
    SIGNATURE,
    U16,
    U32,
)


class _Type(Attribute):
    """The signature of an unknown element: the ICC's tools write it as `Type` and read it as `type`."""

    def __init__(self) -> None:
        super().__init__("type", "signature", SIGNATURE)
        self.attributes = ("type", "Type")

    def read(self, node: Node, seen: Seen) -> None:
        name = "type" if "type" in node.attributes else "Type"
        seen["signature"] = node.value(SIGNATURE, node.get(name), name)

    def write(self, out: Target, record: UnknownElement) -> None:
        for name in self.attributes:
            out.set(name, SIGNATURE.write(record.signature))


class _ElementForms(Forms):
    """The forms of elements, and that of an element as bytes, whether its type has a record or not."""

    def read(self, node: Node) -> Any:
        if node.name != _UNKNOWN.name:
            return super().read(node)
        unknown = _UNKNOWN.read(node)
        return ELEMENTS.read(Reader(unknown.to_bytes(), node.source, f"line {node.line}"))

    def write(self, out: Target, record: Any) -> None:
        if isinstance(record, UnknownElement):
            _UNKNOWN.write(out.child(_UNKNOWN.name), record)
        else:
            super().write(out, record)


CHANNELS = (Attribute("InputChannels", "inputs", U16), Attribute("OutputChannels", "outputs", U16))

_UNKNOWN = Form(
    "UnknownElement",
    UnknownElement,
    _Type(),
    *CHANNELS,
    Attribute("Reserved", "reserved", RESERVED, bytes(4), omitted=True),
    Content("data", HEX_LINES),
    signature="",
)

CURVE_FORMS = Forms("curve")
SEGMENT_FORMS = Forms("curve segment")
ELEMENT_FORMS = _ElementForms("processing element")
_FUNCTION_FORMS = Forms("tone function")


# Curves ------------------------------------------------------------------------------------------------


class _Ends(Part):
    """The range of a segment, which its curve reads and writes."""

    attributes = ("Start", "End")


class _Segments(Part):
    """The segments of a curve, each with the ends of its range."""

    children = None

    def read(self, node: Node, seen: Seen) -> None:
        segments, starts = [], []
        expected: float = -np.inf
        for child in node:
            start, end = (self._end(child, name) for name in _Ends.attributes)
            if start != expected:
                child.warn(f"Start: found {start}, expected {expected}, where the one before ends")
            segments.append(SEGMENT_FORMS.read(child))
            starts.append(start)
            expected = end
        if expected != np.inf:
            node.warn(f"found segments up to {expected}, expected them up to +infinity")
        # Where ends and starts differ, the ICC's tools keep the starts, but for the first.
        seen["segments"] = tuple(segments)
        seen["breakpoints"] = tuple(starts[1:])

    @staticmethod
    def _end(node: Node, name: str) -> float:
        text = node.get(name)
        if text.startswith(("-inf", "+inf")):
            return float(text[:4])
        with np.errstate(over="ignore"):
            end = float(np.float32(node.value(FLOAT32, text, name)))
        if not np.isfinite(end):
            raise node.error(f"{name}: found {text!r}, expected a number that float32 holds, or an infinity")
        return end

    def write(self, out: Target, record: SegmentedCurve) -> None:
        ends = ["-infinity", *(FLOAT32.write(point) for point in record.breakpoints), "+infinity"]
        for segment, start, end in zip(record.segments, ends, ends[1:], strict=False):
            form = SEGMENT_FORMS.by_signature[segment.signature]
            child = out.child(form.name)
            child.set("Start", start)
            child.set("End", end)
            form.write(child, segment)


class _Samples(Numbers):
    """The values of a sampled segment.

    The first number stands for the value at its start, which is not stored, being that of the segment
    before; it is written as 0.
    """

    def read(self, node: Node, seen: Seen) -> None:
        super().read(node, seen)
        seen[self.field] = seen[self.field][1:]

    def write(self, out: Target, record: SampledSegment) -> None:
        write_numbers(out, np.append(np.float32(0), record.values))


_FIRST_AND_LAST = (Attribute("FirstEntry", "first", FLOAT32), Attribute("LastEntry", "last", FLOAT32))

SEGMENT_FORMS.add(
    Form(
        "FormulaSegment",
        FormulaSegment,
        _Ends(),
        Attribute("FunctionType", "type", U16),
        Numbers("parameters"),
    ),
    Form("SampledSegment", SampledSegment, _Ends(), _Samples("values")),
)
CURVE_FORMS.add(
    Form("SegmentedCurve", SegmentedCurve, _Segments()),
    Form(
        "SingleSampledCurve",
        SampledCurve,
        *_FIRST_AND_LAST,
        Attribute("StorageType", "encoding", U16, 0),
        Attribute("ExtensionType", "extension", U16, 0),
        Numbers("values"),
    ),
    Form(
        "SampledCalculatorCurve",
        SampledCalculatorCurve,
        *_FIRST_AND_LAST,
        Attribute("ExtensionType", "extension", U16, 0),
        Attribute("DesiredSize", "size", U32),
        Single("calculator", ELEMENT_FORMS),
    ),
)
ELEMENT_FORMS.add(
    Form("CurveSetElement", CurveSet, *CHANNELS, Records("curves", CURVE_FORMS, "DuplicateCurve"))
)

# The tone map ------------------------------------------------------------------------------------------

_FUNCTION_FORMS.add(
    Form("ToneMapFunction", ToneFunction, Attribute("FunctionType", "type", U16), Numbers("parameters"))
)
ELEMENT_FORMS.add(
    Form(
        "ToneMapElement",
        ToneMap,
        *CHANNELS,
        Inside("LuminanceCurve", Single("luminance", CURVE_FORMS)),
        Inside("ToneMapFunctions", Records("functions", _FUNCTION_FORMS, "DuplicateFunction")),
    )
)


# Matrices and tables -----------------------------------------------------------------------------------


class _MatrixValues(Numbers):
    """The matrix row by row, or the one that it is the inverse of."""

    attributes = (*Numbers.attributes, "InvertMatrix")

    def read(self, node: Node, seen: Seen) -> None:
        super().read(node, seen)
        invert = node.attributes.get("InvertMatrix", "false").lower()
        if invert not in ("true", "false"):
            raise node.error(f"InvertMatrix: found {invert!r}, expected 'true' or 'false'")
        if invert == "true":
            try:
                seen[self.field] = np.linalg.inv(seen[self.field])
            except np.linalg.LinAlgError as error:
                raise node.error(f"InvertMatrix: {error}, expected a matrix that has an inverse") from None


def _matrix(inputs: int, matrix: Any, offset: Any) -> Matrix:
    # Of one input, a matrix that is missing would be read back as the offsets.
    return Matrix(inputs, np.zeros((len(offset), 1)) if matrix is None and inputs == 1 else matrix, offset)


_TABLE = (
    Grid(),
    Inside("TableData", Numbers("table", lambda seen: (*seen["grid"], seen["outputs"]))),
)
ELEMENT_FORMS.add(
    Form(
        "MatrixElement",
        Matrix,
        *CHANNELS,
        Inside(
            "MatrixData",
            _MatrixValues("matrix", lambda seen: (seen["outputs"], seen["inputs"])),
            default=lambda seen: {"matrix": None},
            present=lambda record: record.matrix is not None,
        ),
        Inside(
            "ConstantData",
            Numbers("offset", lambda seen: (seen["outputs"],)),
            default=lambda seen: {"offset": np.zeros(seen["outputs"])},
            present=lambda record: any(record.offset.tobytes()),
        ),
        make=_matrix,
    ),
    Form("CLutElement", Clut, *CHANNELS, *_TABLE),
    Form("ExtCLutElement", ExtendedClut, *CHANNELS, Attribute("StorageType", "encoding", U16, 0), *_TABLE),
    Form("TintArrayElement", TintArray, *CHANNELS, Single("values", NUMBER_FORMS)),
)


# Appearance and spectra --------------------------------------------------------------------------------

_APPEARANCE = (
    *CHANNELS,
    Inside(
        "ColorAppearanceParams",
        Inside("WhitePoint", Inside("XYZNumber", Triple("white", FLOAT32))),
        Inside("Luminance", Content("luminance", FLOAT32)),
        Inside("BackgroundLuminance", Content("background", FLOAT32)),
        Inside("ImpactSurround", Content("surround", FLOAT32)),
        Inside("ChromaticInductionFactor", Content("induction", FLOAT32)),
        Inside("AdaptationFactor", Content("adaptation", FLOAT32)),
    ),
)
_SPECTRUM = (
    Inside("Wavelengths", Wavelengths("wavelengths", "steps", lambda record: int(record.steps))),
    Inside("WhiteData", Numbers("white", lambda seen: (seen["steps"],))),
)
_FLAGS = Attribute("Flags", "flags", U32, 0)


def _spectra(device: str) -> tuple[Part, ...]:
    return (
        *CHANNELS,
        *_SPECTRUM,
        Inside("MatrixData", Numbers("spectra", lambda seen: (seen[device], seen["steps"]))),
        Inside(
            "OffsetData",
            Numbers("offset", lambda seen: (seen["steps"],)),
            default=lambda seen: {"offset": np.zeros(seen["steps"])},
        ),
    )


_SPECTRAL_TABLE = (
    *CHANNELS,
    _FLAGS,
    Attribute("StorageType", "encoding", U16, 0),
    *_SPECTRUM,
    Grid(),
    Inside("TableData", Numbers("table", lambda seen: (*seen["grid"], seen["steps"]))),
)

ELEMENT_FORMS.add(
    Form("XYZToJabElement", XYZToJab, *_APPEARANCE),
    Form("JabToXYZElement", JabToXYZ, *_APPEARANCE),
    Form("EmissionMatrixElement", EmissionMatrix, *_spectra("inputs")),
    Form("InvEmissionMatrixElement", InverseEmissionMatrix, *_spectra("outputs")),
    Form("EmissionCLutElement", EmissionClut, *_SPECTRAL_TABLE),
    Form("ReflectanceCLutElement", ReflectanceClut, *_SPECTRAL_TABLE, aliases=("ReflectanceCLutElem",)),
    Form("EmissionObserverElement", EmissionObserver, *CHANNELS, _FLAGS, *_SPECTRUM),
    Form("ReflectanceObserverElement", ReflectanceObserver, *CHANNELS, _FLAGS, *_SPECTRUM),
)


# Markers, which may carry bytes ------------------------------------------------------------------------

_MARKER = (
    Attribute("InputChannels", "channels", U16),
    Attribute("OutputChannels", "outputs", U16),
    Attribute("Signature", "encoding", SIGNATURE),
    Content("data", HEX_LINES),
)
ELEMENT_FORMS.add(
    Form("BAcsElement", BeginAlternateSpace, *_MARKER), Form("EAcsElement", EndAlternateSpace, *_MARKER)
)
