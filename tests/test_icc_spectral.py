"""Spectral, appearance and tone elements in the file."""

import numpy as np
import pytest
from icc_examples import unhex

from iccbrdf.errors import ProfileError, UsageError
from iccbrdf.icc import (
    ELEMENTS,
    TAGS,
    BeginAlternateSpace,
    EmissionClut,
    EmissionMatrix,
    EmissionObserver,
    EndAlternateSpace,
    InverseEmissionMatrix,
    JabToXYZ,
    ReflectanceClut,
    ReflectanceObserver,
    SampledCurve,
    SpectralDataInfo,
    ToneFunction,
    ToneMap,
    XYZToJab,
)
from iccbrdf.icc.reader import Reader

RANGE = (400.0, 700.0)
CONDITIONS = ((0.5, 1.0, 2.0), 4.0, 8.0, 0.5, 1.0, 0.25)
_CONDITIONS = """
        3f000000 3f800000 40000000  # white
        40800000 41000000           # adapting luminance, background
        3f000000 3f800000 3e800000  # c, Nc, F
        """
_RANGE = "5e40 6178 0002"
"""400 to 700 nm as float16, two steps."""

EXAMPLES = {
    "emtx": (
        EmissionMatrix(RANGE, [1, 2], [[1, 0], [0, 1], [0.5, 0.5], [2, 2]], [0.25, 0]),
        f"""
        656d7478 00000000 0004 0003  # 'emtx', reserved, 4 inputs, 3 outputs
        {_RANGE}
        0000                    # reserved
        3f800000 40000000       # white
        3f800000 00000000  00000000 3f800000  3f000000 3f000000  40000000 40000000
        3e800000 00000000       # offset
        """,
    ),
    "iemx": (
        InverseEmissionMatrix(RANGE, [1, 2], [[1, 0], [0, 1], [1, 1]], [0, 1]),
        f"""
        69656d78 00000000 0003 0003  # 'iemx', reserved, 3 inputs, 3 outputs
        {_RANGE}
        0000 3f800000 40000000
        3f800000 00000000  00000000 3f800000  3f800000 3f800000
        00000000 3f800000
        """,
    ),
    "eclt": (
        EmissionClut(RANGE, [1, 0], [[0, 1], [1, 0.2], [0.4, 1]], 3, 2),
        f"""
        65636c74 00000000 0001 0003  # 'eclt', reserved, 1 input, 3 outputs
        00000002                # flags: Lab
        {_RANGE}
        0003                    # value encoding uInt8
        03000000 00000000 00000000 00000000  # three grid points
        00ff ff33 66ff          # their spectra
        ff00                    # white
        """,
    ),
    "rclt": (
        ReflectanceClut(RANGE, [1, 1], [[[0, 1], [1, 0]], [[1, 1], [0, 0]]], 0, 1),
        f"""
        72636c74 00000000 0002 0003  # 'rclt', reserved, 2 inputs, 3 outputs
        00000001                # flags: absolute
        {_RANGE}
        0000                    # value encoding float32
        02020000 00000000 00000000 00000000
        00000000 3f800000  3f800000 00000000  3f800000 3f800000  00000000 00000000
        3f800000 3f800000       # white
        """,
    ),
    "eobs": (
        EmissionObserver(RANGE, [1, 2], 3),
        f"656f6273 00000000 0002 0003 {_RANGE} 0003 3f800000 40000000",
    ),
    "robs": (
        ReflectanceObserver(RANGE, [1, 1]),
        f"726f6273 00000000 0002 0003 {_RANGE} 0000 3f800000 3f800000",
    ),
    "XtoJ": (XYZToJab(*CONDITIONS), "58746f4a 00000000 0003 0003" + _CONDITIONS),
    "JtoX": (JabToXYZ(*CONDITIONS), "4a746f58 00000000 0003 0003" + _CONDITIONS),
    "tmap": (
        ToneMap(SampledCurve(0, 1, 0, [0, 1]), (ToneFunction((1, 0, 0)), ToneFunction((2, 0.5, 0.25)))),
        """
        746d6170 00000000 0003 0002  # 'tmap', reserved, 3 inputs (luminance last), 2 outputs
        00000024 00000020       # luminance curve: 32 bytes at 36
        00000044 00000018       # function 0: 24 bytes at 68
        0000005c 00000018       # function 1: 24 bytes at 92
        736e6766 00000000 00000002 00000000 3f800000 0000 0000 00000000 3f800000
        6d617066 00000000 0000 0000 3f800000 00000000 00000000  # gain, offset, black
        6d617066 00000000 0000 0000 40000000 3f000000 3e800000
        """,
    ),
    "bACS": (BeginAlternateSpace(3, "abcd", b"xyz"), "62414353 00000000 0003 0003 61626364 78797a"),
    "eACS": (EndAlternateSpace(2, ""), "65414353 00000000 0002 0002 00000000"),
}


def read(data):
    return ELEMENTS.read(Reader(data, "a.icc", "element"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_bytes_and_object(name):
    element, text = EXAMPLES[name]
    assert element.to_bytes() == unhex(text)
    found = read(unhex(text))
    assert type(found) is type(element)
    assert found == element
    assert (found.signature, found.inputs, found.outputs) == (name, element.inputs, element.outputs)


@pytest.mark.parametrize("name", EXAMPLES)
def test_no_truncation_passes(name):
    element, text = EXAMPLES[name]
    data = unhex(text)
    for size in range(len(data)):
        try:
            assert read(data[:size]) != element
        except ProfileError as error:
            assert "a.icc: element" in str(error)  # noqa: PT017


def test_values():
    clut = read(unhex(EXAMPLES["eclt"][1]))
    np.testing.assert_array_equal(clut.table, np.float32([[0, 1], [1, 0.2], [0.4, 1]]))
    assert (clut.lab, clut.absolute, clut.steps) == (True, False, 2)
    assert read(unhex(EXAMPLES["rclt"][1])).absolute
    matrix = read(unhex(EXAMPLES["emtx"][1]))
    assert matrix.spectra.shape == (4, 2)
    assert matrix.offset.tolist() == [0.25, 0]


def test_spectral_matrix_without_offset():
    element = InverseEmissionMatrix(RANGE, [1, 2], [[1, 0], [0, 1], [1, 1]], [0, 0])
    assert read(element.to_bytes()[:-8]) == element


def test_kinds_of_spectra():
    tag = SpectralDataInfo("rs001f", (400, 700), 31)
    data = unhex("7364696e 00000000 7273001f 5e40 6178 001f 0000 0000 0000")
    assert tag.to_bytes() == data
    assert TAGS.read(Reader(data, "a.icc", "tag sdin")) == tag


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: EmissionMatrix((700, 400), [1, 1], [[1, 1]], [0, 0]), "wavelengths: found 700.0 to 400.0"),
        (lambda: EmissionMatrix(RANGE, [1], [[1]], [0]), "white: found shape"),
        (lambda: EmissionMatrix(RANGE, [1, 1], [[1, 1, 1]], [0, 0]), "spectra: found shape"),
        (lambda: EmissionMatrix(RANGE, [1, 1], [[1, 1]], [0]), "offset: found shape"),
        (lambda: EmissionClut(RANGE, [1, 1], [[1, 1]]), "2 to 255 grid points"),
        (lambda: EmissionClut(RANGE, [1, 2], [[1, 1], [0, 1]], 2), r"outside 0..1"),
        (lambda: XYZToJab((1, 1, 1), adaptation=np.inf), "expected finite ones"),
        (lambda: ToneMap(SampledCurve(0, 1, 0, [0, 1]), ()), "functions: found none"),
        (lambda: ToneFunction((1, 0, 0), 1), "type: found 1, expected 0"),
    ],
)
def test_what_the_file_cannot_hold_is_refused(make, message):
    with pytest.raises(UsageError, match=message):
        make()


@pytest.mark.parametrize(
    ("name", "offset", "text", "message"),
    [
        ("emtx", 10, "0004", "outputs: found 4, expected 3"),
        ("emtx", 16, "0000", "steps: found 0, expected 2 to 65535"),
        ("emtx", 16, "ffff", "white: found 48 bytes, expected 262140"),
        ("emtx", 12, "7e00", "wavelengths: found nan to 700.0"),
        ("iemx", 8, "0004", "inputs: found 4, expected 3"),
        ("eclt", 8, "0000", "inputs: found 0, expected 1 to 16"),
        ("eclt", 22, "0009", "encoding: found 9"),
        ("eclt", 24, "ff", "table: found 8 bytes, expected 510"),
        ("robs", 8, "0003", "inputs: found 3, expected 2"),
        ("XtoJ", 8, "0004", "inputs: found 4, expected 3"),
        ("tmap", 10, "0001", "inputs: found 3, expected 2"),
        ("tmap", 68, "746d6620", "tone function: found 'tmf ', expected 'mapf'"),
        ("tmap", 36, "6d617066", "curve: found 'mapf', expected 'curf' or"),
        ("bACS", 10, "0004", "outputs: found 4, expected 3"),
    ],
)
def test_malformed(name, offset, text, message):
    data = bytearray(unhex(EXAMPLES[name][1]))
    new = bytes.fromhex(text)
    data[offset : offset + len(new)] = new
    with pytest.raises(ProfileError, match=message):
        read(bytes(data))
