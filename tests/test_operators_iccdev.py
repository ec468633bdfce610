"""Every operator in a profile that our writer makes, run by the ICC's reference implementation and by us."""

from collections.abc import Callable
from dataclasses import dataclass

import iccdev
import numpy as np
import pytest

from iccbrdf.calc.interpreter import run
from iccbrdf.calc.operators import OPERATORS, Kind
from iccbrdf.calc.program import parse
from iccbrdf.calc.verify import verify
from iccbrdf.icc import (
    Calculator,
    Clut,
    CurveSet,
    ExtendedClut,
    FormulaSegment,
    Header,
    JabToXYZ,
    Matrix,
    Mluc,
    MultiProcess,
    Profile,
    SampledCurve,
    SampledSegment,
    SegmentedCurve,
    TagArray,
    TintArray,
    ToneFunction,
    ToneMap,
    XYZToJab,
    write_profile,
)

FINITE = [0, -0.0, 1, -1, 0.5, -0.5, 0.49999997, 1.5, 2.5, -2.5, 3, -7, 1e-5, 1e-30, 1e30, 90, -200, 3e9]
EDGES = np.array([*FINITE, np.inf, -np.inf, np.nan], np.float32)


@dataclass(frozen=True)
class Case:
    """A program that reads n inputs and writes m outputs, and the pixels on which both must agree.

    `usable` is a mask of pixels; where it leaves out some, or a tolerance is wider, `reason` says why.
    """

    text: str
    n: int
    m: int
    elements: tuple = ()
    usable: Callable = lambda x: np.ones(len(x), bool)
    reason: str = ""
    rtol: float = 2e-6
    atol: float = 1e-7


def twice(name):
    """An operator repeated for two planes."""
    row = OPERATORS[name]
    n, m = row.pops(1, 0), row.pushes(1, 0)
    return f"in(0,{n}) {name}(2) out(0,{m})", n, m


def unit(x):
    return ((x >= 0) & (x <= 1)).all(axis=1)


def finite(x):
    return np.isfinite(x).all(axis=1)


INT32 = {
    "usable": lambda x: (np.abs(x) < 2.0**31).all(axis=1),
    "reason": "casts of other numbers to int are undefined in C: INT_MIN in one build, clipped in another",
}
DIVISION = "the version of the reference in this package answers 0 to a division by 0, others inf or NaN"

SPECIAL = {
    "div": Case(*twice("div"), usable=lambda x: (x[:, 2:] != 0).all(axis=1), reason=DIVISION),
    "sdiv": Case("in(0,3) sdiv(2) out(0,2)", 3, 2, usable=lambda x: x[:, 2] != 0, reason=DIVISION),
    "mod": Case(*twice("mod"), usable=lambda x: finite(x) & (x[:, 2:] != 0).all(axis=1), reason=DIVISION),
    "trnc": Case(*twice("trnc"), **INT32),
    "rond": Case(*twice("rond"), **INT32),
    "tLab": Case(
        *twice("tLab"),
        usable=lambda x: (np.abs(x) < 100).all(axis=1),
        reason="cube roots differ in the last bit of a float32, and 500 times that is seen",
        rtol=1e-5,
        atol=2e-4,
    ),
}

# Of three outputs or four the reference adds the offset last, as we do; of others first.
MATRIX = Matrix.of([[1, 2, -3], [0.5, 0.25, 8], [0.1, 0, 7]], [0.125, -4, 0.3])
CURVES = CurveSet(
    (
        SegmentedCurve(
            (0.0, 1.0),
            (
                FormulaSegment(0, (1.0, 2.0, 0.5, 0.25)),
                SampledSegment(np.array([5.0, 7.0])),
                FormulaSegment(2, (1.0, 2.0, 1.0, 0.5, 3.0)),
            ),
        ),
        SampledCurve(-1.0, 1.0, 0, np.array([1.0, 3.0, 2.0])),
        SampledCurve(-1.0, 1.0, 1, np.array([1.0, 3.0, 2.0])),
        SegmentedCurve(
            (0.5,),
            (FormulaSegment(3, (2.0, 1.0, 0.5, 2.0, 1.0)), FormulaSegment(1, (1.0, 2.0, 3.0, 4.0, 5.0))),
        ),
    )
)
TWO = CurveSet(CURVES.curves[1:3])
NODES = np.random.default_rng(5).normal(size=(3, 4, 2, 2))
UNIT = {"usable": unit, "reason": "the reference reads outside of tables for inputs outside of 0..1"}

CASES = {
    "constants": Case("in(0) pop 0.1 -2.5e-7 pi +INF -INF NaN out(0,6)", 1, 6),
    "channels": Case("in(0,3) in(1,2) out(1,4) out(0)", 3, 5),
    "temporaries": Case("tget(7) in(0,3) tput(4,3) tget(4,2) tsav(7) out(0,3)", 3, 3),
    "environment": Case("in(0) env(true) env(ndef) env(none) out(0,7)", 1, 7),
    "stack": Case("in(0,5) rotl(4,3) rotr(5,2) flip(3) copy(2,2) noop posd(4,2) pop scnt out(0,11)", 5, 11),
    "flip": Case("in(0,5) flip out(0,5)", 5, 5),
    "transpose": Case("in(0,6) tran(2,3) out(0,6)", 6, 6),
    "solve": Case(
        "in(0,9) 30 sadd(9) in(1,8) in(0) sub(9) 5 0 0 0 5 0 0 0 5 add(9) in(9,3) solv(3,3) out(0,4)",
        12, 4,
        usable=lambda x: (np.abs(x) < 2).all(axis=1),
        reason="only of well-conditioned matrices: the reference solves in float32, and only of 3 by 3",
        rtol=1e-4, atol=1e-4,
    ),
    "solve singular": Case(
        "1 2 3 4 5 6 7 8 9 in(0,3) solv(3,3) out(0,4)", 3, 4, usable=finite, reason="as solve"
    ),
    "if": Case("in(0) if { in(1) 2 mul } else { in(2) } in(1) if { out(0) } else { out(1) }", 3, 2),
    "sel": Case("in(0) sel case { 1 } case { in(1) } case { 3 } dflt { 4 } out(0)", 2, 1, **INT32),
    "sel without dflt": Case("7 in(0) sel case { 1 add } case { in(1) add } out(0)", 2, 1, **INT32),
    "mtx": Case("in(0,3) mtx(0) out(0,3)", 3, 3, (MATRIX,)),
    "curv": Case(
        "in(0,4) curv(0) out(0,4)", 4, 4, (CURVES,),
        usable=finite,
        reason="the reference lets +inf pass segmented curves, and in sampled ones NaN is undefined",
    ),
    "clut": Case("in(0,3) clut(0) in(1,3) clut(1) out(0,4)", 4, 4,
                 (Clut(NODES), ExtendedClut(np.abs(NODES) % 1, 2)), **UNIT, rtol=1e-5, atol=1e-6),
    "tint": Case("in(0) tint(0) out(0,3)", 1, 3, (TintArray.of([[0, 1, 2], [5, 4, 3], [1, 1, 9]]),), **UNIT),
    "calc": Case(
        "5 tput(0) in(0,2) calc(0) tget(0) out(0,4)", 2, 4,
        (Calculator(2, 3, parse("tget(0) out(0) in(0,2) curv(0) out(1,2) 9 tput(0)"), (TWO,)),),
        usable=finite, reason="as curv",
    ),
    "tJab": Case(
        "in(0,3) 30 smul(3) tJab(0) out(0,3)", 3, 3, (XYZToJab((96.42, 100.0, 82.49)),), **UNIT,
        rtol=2e-4, atol=5e-4,
    ),
    "fJab": Case(
        "in(0) 90 mul in(1,2) 40 smul(2) fJab(0) out(0,3)", 3, 3, (JabToXYZ((96.42, 100.0, 82.49)),), **UNIT,
        rtol=5e-4, atol=5e-3,
    ),
    "tone map": Case("in(0,3) elem(0) out(0,2)", 3, 2, (ToneMap(CURVES.curves[1], (
        ToneFunction((2, 0.5, 0.25)), ToneFunction((0.5, -1, 0)))),), usable=finite, reason="as curv"),
    "elem": Case(
        "in(0,3) elem(1) out(0,3) in(0,4) elem(0) out(3,4)", 4, 7, (CURVES, MATRIX),
        usable=finite, reason="as curv",
    ),
}  # fmt: skip
for name, row in OPERATORS.items():
    if row.kind in (Kind.EACH, Kind.SCALAR):
        CASES[name] = SPECIAL.get(name) or Case(*twice(name))
    if row.kind is Kind.REDUCE:
        CASES[f"{name}(2)"] = Case(f"in(0,2) {name} out(0)", 2, 1)
        CASES[f"{name}(4)"] = Case(f"in(0,4) {name}(4) out(0)", 4, 1)


def make_profile(case, path):
    program = parse(case.text)
    verify(program, case.n, case.m, case.elements)
    header = Header(device_class="mid ", colour_space=f"nc{case.n:04x}", mcs=f"mc{case.m:04x}")
    tags = {
        "A2M0": MultiProcess.of(Calculator(case.n, case.m, program, case.elements)),
        "mcta": TagArray.of_texts(f"c{i}" for i in range(case.m)),
        "desc": Mluc.of("operator"),
        "cprt": Mluc.of("none"),
    }
    write_profile(Profile(header, tags), path)
    return program


def reference(path, pixels):
    with iccdev.IccCmm() as cmm:
        cmm.attach(str(path), lut_type=iccdev.LutType.MCS)
        cmm.begin()
        return cmm.apply_ndarray(np.ascontiguousarray(pixels))


def make_pixels(case):
    draw = np.random.default_rng(1)
    wide = draw.normal(0, 3, (200, case.n))
    narrow = draw.uniform(0, 1, (200, case.n))
    edges = draw.choice(EDGES, (600, case.n))
    pixels = np.concatenate([wide, narrow, edges]).astype(np.float32)
    return pixels[case.usable(pixels)]


@pytest.mark.parametrize("name", CASES)
def test_operator(name, tmp_path):
    case = CASES[name]
    path = tmp_path / "case.icc"
    program = make_profile(case, path)
    pixels = make_pixels(case)
    assert len(pixels) >= 200
    outputs = run(program, list(pixels.T), case.m, elements=case.elements)
    ours = np.stack([np.broadcast_to(output, len(pixels)) for output in outputs], axis=1)
    np.testing.assert_allclose(ours, reference(path, pixels), rtol=case.rtol, atol=case.atol)


def test_every_operator_is_compared():
    used = {op.name for case in CASES.values() for op in parse(case.text)}
    assert used == set(OPERATORS)
