"""What the tests of IccXML share: documents round their tags, and one record of every kind."""

import numpy as np

from iccbrdf.calc.program import parse
from iccbrdf.icc import (
    XYZ,
    BeginAlternateSpace,
    BlackGeneration,
    Calculator,
    Chromaticity,
    Clut,
    Colorant,
    ColorantOrder,
    ColorantTable,
    Combination,
    CompressedUtf8,
    CompressedXml,
    CrdInfo,
    Curve,
    CurveSet,
    DataTag,
    DateTime,
    DeviceSettings,
    Dictionary,
    EmbeddedProfile,
    EmissionClut,
    EmissionMatrix,
    EmissionObserver,
    EndAlternateSpace,
    Entry,
    ExtendedClut,
    FormulaSegment,
    GamutBoundary,
    Header,
    HeightImage,
    InverseEmissionMatrix,
    JabToXYZ,
    LocalisedText,
    Lut8,
    Lut16,
    LutAToB,
    LutBToA,
    Matrix,
    Measurement,
    Member,
    Mluc,
    MultiProcess,
    NamedColour,
    NamedColours,
    NormalImage,
    NumberArray,
    ParametricCurve,
    PlainText,
    PlainViewingConditions,
    PlatformSettings,
    Profile,
    ProfileDescription,
    ProfileIdentities,
    ProfileIdentity,
    ProfileSequence,
    ReflectanceClut,
    ReflectanceObserver,
    ResponseCurve,
    ResponseCurves,
    SampledCalculatorCurve,
    SampledCurve,
    SampledSegment,
    Screen,
    Screening,
    SegmentedCurve,
    Setting,
    SignatureTag,
    SparseMatrix,
    SparseMatrixArray,
    SpectralDataInfo,
    TagArray,
    TagStruct,
    TextDescription,
    TintArray,
    ToneFunction,
    ToneMap,
    Unknown,
    UnknownElement,
    Utf8,
    Utf16,
    VendorXml,
    VideoCodePoints,
    ViewingConditions,
    XYZToJab,
)

HEADER = "<Header><ProfileDeviceClass>spac</ProfileDeviceClass></Header>"


def document(tags, header=HEADER, before=""):
    """A document with these tags, as bytes."""
    return f"{before}<IccProfile>{header}<Tags>{tags}</Tags></IccProfile>".encode()


def transform(elements, inputs=3, outputs=3):
    """A document whose AToB0Tag has these elements."""
    return document(
        "<AToB0Tag><multiProcessElementType>"
        f'<MultiProcessElements InputChannels="{inputs}" OutputChannels="{outputs}">{elements}'
        "</MultiProcessElements></multiProcessElementType></AToB0Tag>"
    )


def a_profile(**tags):
    """A profile with tags of these signatures (`_` for a blank)."""
    named = {name.replace("_", " "): tag for name, tag in tags.items()}
    return Profile(Header(device_class="spac", version=(5, 0, 0)), named)


AWKWARD = [0.1, -0.0, 1e-40, 3.4028235e38, -1e-7, 1 / 3, 16777217, 0.30000004]
"""Numbers that seven digits, or rounding on the way through double precision, would change."""

WHITE = np.linspace(0.5, 1, 4)
CURVE = SegmentedCurve(
    (0.1, 0.75),
    (
        FormulaSegment(0, (1, 2, 1 / 3, 0)),
        SampledSegment([0.3, 0.9]),
        FormulaSegment(2, (2, 1, 0, 0.3375, 1e-30)),
    ),
)
SAMPLED = SampledCurve(0, 1, 1, [0, 0.25, 1], 2)
CALCULATOR = Calculator(1, 1, parse("in(0) sq out(0)"))
IDENTITY = tuple(Curve() for _ in range(3))

ELEMENTS = {
    "matf": Matrix.of([[1, 2, 3], [-1, 0.5, 0]], [0.25, -0.0]),
    "matf awkward": Matrix.of([AWKWARD], [1e-38]),
    "matf not finite": Matrix.of([[np.inf, -np.inf, np.nan]], [np.nan]),
    "matf constants": Matrix(2, None, [1, 0]),
    "clut": Clut(np.arange(24).reshape(2, 3, 4) / 7),
    "xclt float16": ExtendedClut([[0, 1], [0.2, 0.4], [1, -3]], 1),
    "xclt uInt16": ExtendedClut([[0, 1], [0.2, 0.4], [1, 1 / 3]], 2),
    "xclt uInt8": ExtendedClut([[0, 1], [0.2, 0.4], [1, 1 / 3]], 3),
    "tint": TintArray(2, NumberArray("ui16", [0, 1, 65535, 2])),
    "calc": Calculator(2, 2, parse("in(0,2) if {1} mtx(0) out(0,2)"), (Matrix.of(np.eye(2)),)),
    "calc everything": Calculator(
        3,
        1,
        parse("in(0,3) sum(3) sel case { 1 pi } case { } dflt { env(ndef) rotl(3,2) } env(00ff0001)"
              " data(7f800000) data(ff800000) data(ffc00000) data(7fc00001) -0.0 0.30000004 +INF NaN out(0)"),
    ),
    "bACS": BeginAlternateSpace(3, "XYZ ", bytes(range(40))),
    "eACS": EndAlternateSpace(3, "XYZ "),
    "XtoJ": XYZToJab((95.05, 100, 108.9)),
    "JtoX": JabToXYZ((0.9505, 1, 1.089), 64, 0.2, 0.59, 0.9, 0.9),
    "cvst": CurveSet((CURVE, SAMPLED, CURVE, SampledCalculatorCurve(17, -1, 1 / 3, 1, CALCULATOR))),
    "emtx": EmissionMatrix((380.5, 780), WHITE, np.ones((2, 4)) / 3, np.zeros(4)),
    "iemx": InverseEmissionMatrix((380, 780), WHITE, np.ones((2, 4)) / 3, WHITE),
    "eclt": EmissionClut((380, 780), WHITE, np.ones((2, 2, 4)) / 2, 1, 2),
    "rclt": ReflectanceClut((380, 780), WHITE, np.ones((2, 2, 4)), 2, 1),
    "eobs": EmissionObserver((380, 780), WHITE, 3),
    "robs": ReflectanceObserver((380, 780), WHITE),
    "tmap": ToneMap(CURVE, (first := ToneFunction((1, 0, 1 / 3)), ToneFunction((2, 0, 0)), first)),
    "unknown": UnknownElement("what", b"\0\0\1\2", 2, 5, bytes(range(40))),
    "unknown without data": UnknownElement("\x01\xffab", bytes(4), 1, 1, b""),
}  # fmt: skip

TAGS = {
    "utf8": Utf8("θ <&>\"' ]]> \r\n  two lines\t"),
    "text": PlainText("ISO 12647-2 <&>"),
    "ut16": Utf16("θ𝄞"),
    "zut8": CompressedUtf8.of("ab" * 40),
    "zxml": CompressedXml.of("<x/>"),
    "dtim": DateTime((2020, 1, 2, 3, 4, 59)),
    "cicp": VideoCodePoints(9, 16, 0, 1),
    "sig": SignatureTag("CRT "),
    "sig zero": SignatureTag(""),
    "sig binary": SignatureTag("a\x00b\xff"),
    "XYZ": XYZ(((0.9642, 1, 0.8249), (-32768, 32767.99998, 1 / 65536))),
    "mluc": Mluc((LocalisedText("en", "US", "a & b"), LocalisedText("de", "CH", " Grüße 𝄞 "))),
    "mluc empty": Mluc(()),
    "mluc without language": Mluc((LocalisedText("\0\0", "\0\0", ""),)),
    "ui08": NumberArray("ui08", [0, 255]),
    "ui16": NumberArray("ui16", [0, 65535]),
    "ui32": NumberArray("ui32", [0, 2**32 - 1]),
    "ui64": NumberArray("ui64", np.array([0, 2**64 - 1], np.uint64)),
    "fl16": NumberArray("fl16", [0.1, 65504, np.inf, np.nan]),
    "fl32": NumberArray("fl32", [*AWKWARD, np.inf, -np.inf, np.nan]),
    "fl64": NumberArray("fl64", [0.1, 1e-310, np.pi, -np.inf]),
    "sf32": NumberArray("sf32", [-32768, 1 / 65536, 32767.5]),
    "uf32": NumberArray("uf32", [0, 65535 + 65535 / 65536]),
    "fl32 empty": NumberArray("fl32", []),
    "tary": TagArray.of_texts(["kd.X", "kd.Y"]),
    "tary nested": TagArray(
        "abcd", (TagArray("nmcl", (None, Utf8("a"))), Unknown("what", bytes(4), b"\1\2"))
    ),
    "tstr": TagStruct("brdf", (Member("type", SignatureTag("CT10")), Member("x\0yz", Utf8("a")))),
    "dict": Dictionary(
        (Entry("a<b", "1\n2"), Entry("none"), Entry("θ", "", Mluc.of("name"), Mluc.of("value", "de", "DE")))
    ),
    "dict short": Dictionary((Entry("a", "b"),), 16),
    "clrt": ColorantTable((Colorant("Cyan"), Colorant("a & b", (65535, 1, 32768)))),
    "svcn": ViewingConditions(
        1, 2, (95, 100, 109), (19, 20, 21.8), (400, 700), np.arange(12).reshape(3, 4) / 7, (400.5, 700),
        WHITE, 6504.5,
    ),
    "svcn named alone": ViewingConditions(2, 9, (95, 100, 109), (19, 20, 21.8), cct=2856),
    "svcn numbered": ViewingConditions(77, 99, (1, 1, 1), (1, 1, 1)),
    "curf": CURVE,
    "gbd": GamutBoundary([[0, 1, 2], [0, 2, 3]], np.arange(12).reshape(4, 3) / 7, np.eye(4)),
    "gbd without device": GamutBoundary([[0, 1, 2]], np.arange(12).reshape(4, 3), np.zeros((4, 0))),
    "gbd without vertices": GamutBoundary(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4))),
    "curv": Curve((0, 1, 65535)),
    "curv identity": Curve(),
    "para": ParametricCurve(3, (2.4, 0.9478, 0.0521, 0.0774, 0.0404)),
    "mBA": LutBToA(IDENTITY, tuple(np.arange(12) / 8), IDENTITY, ExtendedClut(np.ones((2, 2, 2, 4)) / 3, 3),
                   (Curve((256,)),) * 4),
    "mAB": LutAToB(IDENTITY, clut=ExtendedClut(np.arange(24).reshape(2, 2, 2, 3) / 23, 2),
                   a_curves=(Curve(), ParametricCurve(0, (1 / 3,)), Curve((0, 65535)))),
    "mft1": Lut8(np.linspace(0, 1, 512).reshape(2, 256), np.ones((3, 3, 1)) / 3, np.zeros((1, 256))),
    "mft2": Lut16([[0, 0.5, 1]], np.ones((2, 3)) / 3, np.zeros((3, 2)), tuple(np.arange(9) / 4)),
    "ehim": HeightImage(1, 1, -0.001, 0.25, b"II*\0" + bytes(60)),
    "enim": NormalImage(0, 0, b""),
    "sdin": SpectralDataInfo("rs001f", (400, 700), 31, (380, 780), 5),
    "desc": TextDescription("a & b", "θ <c>", 0x656E5553, 3, 4, b"abcd".ljust(67, b"\0")),
    "desc plain": TextDescription("é\1"),
    "desc short": TextDescription("", macintosh=b""),
    "desc with more than is used": TextDescription("a", macintosh_size=1, macintosh=b"abc".ljust(66, b"\0")),
    "view": PlainViewingConditions((95, 100, 109), (19, 20, 21.8), 2),
    "meas": Measurement(1, (0.1, 0.2, 0.3), 2, 1.0, 1),
    "meas numbers": Measurement(3, (0, 0, 0), 9, 0.25, 99),
    "chrm": Chromaticity(1, ((0.64, 0.33), (0.3, 0.6), (0.15, 65535.5))),
    "chrm empty": Chromaticity(77, ()),
    "clro": ColorantOrder((3, 0, 255)),
    "ncl2": NamedColours(
        (NamedColour("a & b", (65280, 32768, 1), (0, 65535)), NamedColour("é", (0, 65535, 12345), (7, 8))),
        2, "<", ">", 0x0102ABCD,
    ),
    "ncl2 without device": NamedColours((NamedColour("a", (1, 2, 3)),)),
    "data": DataTag(1, bytes(range(70))),
    "data text": DataTag(0, b"abc"),
    "rcs2": ResponseCurves(
        2,
        (
            ResponseCurve("StaT", ((0.1, 0.2, 0.3), (1, 1, 1)), ([[0, 0], [65535, 1.5]], [[3, 0.25]])),
            ResponseCurve("abc ", ((0, 0, 0), (0, 0, 0)), (np.zeros((0, 2)), [[3, -0.25]])),
        ),
    ),
    "rcs2 short": ResponseCurves(1, (ResponseCurve("DN P", ((1, 1, 1),), ([[0, 0], [9, 2.5]],)),)),
    "crdi": CrdInfo("Printer 1", ("a", "b", "", "d")),
    "scrn": Screening(3, (Screen(150, 45, 2), Screen(150.5, -15))),
    "bfd": BlackGeneration([0, 65535], [50], "GCR"),
    "devs": DeviceSettings(
        (PlatformSettings("MSFT", (Combination((Setting("rsln", 8, bytes(16)),)), Combination(()))),)
    ),
    "pseq": ProfileSequence(
        (
            ProfileDescription("abcd", "", 0x80000000000000A2, "CRT ", Mluc.of("a"), Mluc.of("bc")),
            ProfileDescription("", "efgh", 0, "", Mluc(()), Mluc.of("a")),
        )
    ),
    "pseq packed": ProfileSequence(
        (ProfileDescription("abcd", "efgh", 3, "", Mluc.of("a"), Mluc.of("a", "de", "DE")),) * 2, False
    ),
    "pseq old": ProfileSequence(
        (ProfileDescription("abcd", "efgh", 0, "CRT ", TextDescription("a"), TextDescription("")),)
    ),
    "psid": ProfileIdentities(
        (ProfileIdentity(bytes(range(16)), Mluc.of("a & b")), ProfileIdentity(bytes(16), Mluc(())))
    ),
    "smat": SparseMatrixArray(
        36, 4, (SparseMatrix.of([[0, 1 / 3, 0], [0, 0, 0], [2, 0, -1]]), SparseMatrix.of(np.zeros((2, 1))))
    ),
    "smat stored zero": SparseMatrixArray(
        36, 4, (SparseMatrix(2, 2, [0, 0, 2], [0, 1], [0, 3]), SparseMatrix.of([[1, 2], [0, 3]]))
    ),
    "smat uInt8": SparseMatrixArray(9, 1, (SparseMatrix.of([[0.2, 0], [0, 1]]),)),
    "smat uInt16": SparseMatrixArray(9, 2, (SparseMatrix.of([[1 / 3]]),)),
    "smat float16": SparseMatrixArray(9, 3, ()),
    "ICCp": EmbeddedProfile.of(Profile(Header(device_class="spac"), {"cprt": Mluc.of("a")})),
    "ZXML": VendorXml.of("<x/>"),
    "unknown": Unknown("what", b"\0\0\0\7", bytes(range(70))),
}  # fmt: skip
TAGS |= {
    f"element {name}": MultiProcess(element.inputs, element.outputs, (element,))
    for name, element in ELEMENTS.items()
}
