"""Every processing element, every kind of curve and every way to store numbers, against the ICC's own CMM."""

import numpy as np
import pytest
from cmm_examples import TEXTS, reference

import iccbrdf
from iccbrdf.calc.program import parse
from iccbrdf.icc import (
    CURVES,
    ELEMENTS,
    SEGMENTS,
    BeginAlternateSpace,
    Calculator,
    Clut,
    CurveSet,
    EndAlternateSpace,
    ExtendedClut,
    FormulaSegment,
    Header,
    JabToXYZ,
    Matrix,
    MultiProcess,
    NumberArray,
    Profile,
    SampledCalculatorCurve,
    SampledCurve,
    SampledSegment,
    SegmentedCurve,
    TagArray,
    TintArray,
    ToneFunction,
    ToneMap,
    XYZToJab,
)
from iccbrdf.icc.curves import PARAMETERS
from iccbrdf.icc.tags import NUMBERS

RANDOM = np.random.default_rng(11)
LINE = FormulaSegment(0, (1, 1, 0, 0))
CAMERA = ((96.42, 100.0, 82.49), 64.0)


def table(*shape):
    return RANDOM.uniform(0, 1, shape).astype(np.float32)


def curve(*segments, at=()):
    return CurveSet((SegmentedCurve(at, segments),))


def sampled(encoding, extension):
    return CurveSet((SampledCurve(0.125, 0.75, extension, [0, 1, 0.25, 0.5], encoding),))


def formula(kind, *parameters):
    return curve(FormulaSegment(kind, parameters))


def tint(signature, *values):
    return TintArray(2, NumberArray(signature, values))


CALCULATOR = Calculator(1, 1, parse("in(0) sq 2 mul out(0)"))
CASES = {
    "matf": Matrix.of([[1, 2, 3], [-1, 0.5, 0]], [0.25, -0.5]),
    "matf constants": Matrix(3, None, [0.25, 0.75]),
    **{f"clut {n}": Clut(table(*range(2, 2 + n), 2)) for n in (1, 2, 3, 4, 5)},
    "clut 8": Clut(table(*[2] * 8, 3)),
    **{f"xclt {encoding}": ExtendedClut(table(3, 4, 2), encoding) for encoding in range(4)},
    "tint fl32": tint("fl32", 0, 1, -0.5, 3, 2, 0.25),
    "tint fl16": tint("fl16", 0, 1, -0.5, 3, 2, 0.25),
    "tint fl64": tint("fl64", 0, 1, -0.5, 3, 2, 0.25),
    "tint ui08": tint("ui08", 0, 255, 7, 9),
    "tint ui16": tint("ui16", 0, 65535, 7, 9000),
    "tint sf32": tint("sf32", 0, 1, -0.5, 3),
    "tint uf32": tint("uf32", 0, 1, 0.5, 3),
    "formula 0": formula(0, 2.2, 0.9, 0.05, 0.01),
    "formula 1": formula(1, 1.5, 0.5, 2, 0.25, 0.1),
    "formula 2": formula(2, 0.5, 2, 1.5, -0.5, 0.1),
    "formula 3": formula(3, 2.4, 0.9, 1.1, -0.25, 0.1),
    "formula 4": formula(4, 1.5, 0.5, -0.5, 0.25, 2),
    "formula 5": formula(5, 1.5, 0.5, 0.25, 0.1, 0.2, 2),
    "formula 6": formula(6, 1.2, 0.9, 0.1, 2, 0.5, 1.5, 1),
    "formula 7": formula(7, 1.2, 0.9, 0.1, 2, 0.5, 1.5),
    "segments": curve(LINE, SampledSegment([0.5, 0.1]), FormulaSegment(2, (1, 2, 1, 0, 0)), at=(0.2, 0.6)),
    **{f"sngf {e}, extension {x}": sampled(e, x) for e in range(4) for x in range(2)},
    "clcf": CurveSet((SampledCalculatorCurve(9, 0, 1, 0, CALCULATOR),)),
    "clcf extended": CurveSet((SampledCalculatorCurve(5, 0.25, 0.5, 1, CALCULATOR),)),
    "cvst": CurveSet(tuple(SampledCurve(0, 1, 0, [0, n, 1]) for n in range(4))),
    "calc": Calculator(
        2,
        2,
        parse("in(0,2) add out(0) in(0,2) calc(0) elem(1) out(1)"),
        (
            Calculator(2, 1, parse("in(0,2) mul curv(0) out(0)"), (sampled(0, 0),)),
            Matrix.of([[3]], [0.5]),
        ),
    ),
    "XtoJ": XYZToJab(*CAMERA),
    "JtoX": JabToXYZ(*CAMERA),
    "bACS": (BeginAlternateSpace(2, "abcd"), Matrix.of([[0, 1], [1, 0]]), EndAlternateSpace(2, "abcd")),
    "eACS": (
        Matrix.of([[0, 1], [1, 0]]),
        BeginAlternateSpace(2, "abcd", b"1234"),
        EndAlternateSpace(2, "abcd"),
    ),
    "tmap": ToneMap(
        SampledCurve(0, 1, 0, [0.5, 1, 2]), (ToneFunction((2, 0.5, 0.25)), ToneFunction((1, 0, -1)))
    ),
}  # fmt: skip

AGREED = {
    "tint ui08": tint("fl64", 0, 1, 7 / 255, 9 / 255),
    "tint ui16": tint("fl64", 0, 1, 7 / 65535, 9000 / 65535),
}
"""What the reference gets where it is wrong about the case itself: it puts a row of zeros before integers."""
ELSEWHERE = {"emtx", "iemx", "eclt", "rclt", "eobs", "robs"}
"""Elements that are compared in test_cmm_spectral."""


def profile_of(case):
    elements = case if isinstance(case, tuple) else (case,)
    process = MultiProcess.of(*elements)
    header = Header(
        device_class="mid ", colour_space=f"nc{process.inputs:04x}", mcs=f"mc{process.outputs:04x}"
    )
    names = TagArray.of_texts(str(n) for n in range(process.outputs))
    return Profile(header, {**TEXTS, "mcta": names, "A2M0": process})


@pytest.mark.parametrize("name", CASES)
def test_element(name, tmp_path):
    profile = profile_of(CASES[name])
    inputs = profile["A2M0"].inputs
    pixels = np.random.default_rng(5).uniform(0, 1, (60, inputs)).astype(np.float32)
    pixels[:3] = [[0] * inputs, [1] * inputs, [0.5] * inputs]
    if name in ("XtoJ", "JtoX"):
        pixels = pixels * 60 + 20
    theirs = reference(tmp_path, [profile_of(AGREED.get(name, CASES[name]))], pixels)
    assert np.ptp(theirs) > 0
    rough = name in ("XtoJ", "JtoX")
    for backend in ("interpreter", "auto"):
        found = iccbrdf.link([profile], backend=backend)(pixels)
        np.testing.assert_allclose(found, theirs, rtol=2e-4 if rough else 1e-5, atol=5e-4 if rough else 1e-5)


def test_everything_is_compared():
    parts = [e for case in CASES.values() for e in (case if isinstance(case, tuple) else (case,))]
    curves = [c for part in parts if isinstance(part, CurveSet) for c in part.curves]
    segments = [s for c in curves if isinstance(c, SegmentedCurve) for s in c.segments]
    assert {part.signature for part in parts} | ELSEWHERE == set(ELEMENTS.classes)
    assert {c.signature for c in curves} == set(CURVES.classes)
    assert {s.signature for s in segments} == set(SEGMENTS.classes)
    assert {s.type for s in segments if isinstance(s, FormulaSegment)} == set(PARAMETERS)
    rows = {part.values.signature for part in parts if isinstance(part, TintArray)}
    assert rows == set(NUMBERS) - {"ui32", "ui64"}  # which the reference does not interpolate
