"""What the tests of the file format share: commented hex, and two profiles that use every structure."""

import json
import zipfile

import numpy as np
import pytest
from conftest import SHARED

from iccbrdf.calc.program import parse
from iccbrdf.icc import (
    XYZ,
    Calculator,
    Clut,
    CurveSet,
    ExtendedClut,
    FormulaSegment,
    Header,
    Matrix,
    Mluc,
    MultiProcess,
    NumberArray,
    PlainText,
    Profile,
    SampledCurve,
    SampledSegment,
    SegmentedCurve,
    SignatureTag,
    TagArray,
    TintArray,
    ViewingConditions,
)


def unhex(text):
    """The bytes of hex digits in lines, each of which may end in a comment after `#`."""
    return bytes.fromhex("".join(line.partition("#")[0] for line in text.splitlines()))


def shared(name):
    path = SHARED / name
    if not path.exists():
        pytest.skip(f"{path} is not there")
    return path


def conformance_profiles():
    """Name and bytes of the small profiles that the ICC's own tools wrote, one calculator program each."""
    with zipfile.ZipFile(shared("conformance/calculator-cases.zip")) as archive:
        for case in json.loads(archive.read("index.json")):
            yield case["name"], archive.read(case["name"] + ".icc")


def a_mid():
    """Two device channels to two multiplex channels, by one element of every kind."""
    curve = SegmentedCurve(
        (0.25, 0.75),
        (FormulaSegment(0, (1, 2, 0.1, 0)), SampledSegment([0.3, 0.9]), FormulaSegment(0, (2, 1, 0, 0.3375))),
    )
    calculator = Calculator(
        2,
        2,
        parse("{ in(0,2) mtx(0) in(0) tint(1) elem(2) add(2) out(0,2) }"),
        (
            Matrix.of([[0, 1], [1, 0]], [0.25, 0]),
            TintArray.of([[0, 0], [0.5, 1]]),
            ExtendedClut([[[0, 0], [0, 1]], [[1, 0], [1, 1]]], 2),
        ),
    )
    elements = (
        CurveSet((curve, SampledCurve(0, 1, 0, [0, 0.5, 1]))),
        Clut([[[0, 0], [0, 1]], [[1, 0], [1, 1]]]),
        calculator,
    )
    return Profile(
        Header(device_class="mid ", colour_space="nc0002", mcs="mc0002"),
        {
            "desc": Mluc.of("A MID"),
            "cprt": Mluc.of("none"),
            "mcta": TagArray.of_texts(["kd.X", "kd.Y"]),
            "A2M0": MultiProcess(2, 2, elements),
        },
    )


def an_mvis():
    """Two multiplex channels to XYZ, with viewing conditions and default values."""
    description = Mluc.of("An MVIS")
    return Profile(
        Header(device_class="mvis", pcs="XYZ ", mcs="mc0002", illuminant=(0.95, 1, 1.09)),
        {
            "desc": description,
            "cprt": description,
            "mcta": TagArray.of_texts(["kd.X", "kd.Y"]),
            "mdv ": NumberArray("ui16", [65535, 0]),
            "wtpt": XYZ.of(0.95, 1, 1.09),
            "svcn": ViewingConditions(
                observer=1,
                illuminant=2,
                illuminant_XYZ=(95, 100, 109),
                surround_XYZ=(19, 20, 21.8),
                observer_range=(400, 700),
                observer_table=np.arange(12).reshape(3, 4),
                illuminant_range=(400, 700),
                spd=[1, 1, 1, 1],
            ),
            "c2sp": MultiProcess.of(Matrix.of(np.eye(3))),
            "s2cp": MultiProcess.of(Matrix.of(np.eye(3))),
            "tech": SignatureTag("CRT "),
            "targ": PlainText("a target"),
            "M2B0": MultiProcess.of(Matrix.of([[1, 0], [0, 1], [0.5, 0.5]])),
        },
    )
