import numpy as np
import pytest
from icc_examples import unhex

from iccbrdf.calc.program import Op
from iccbrdf.errors import ProfileError, ProfileWarning, UsageError
from iccbrdf.icc import (
    ELEMENTS,
    TAGS,
    Calculator,
    Clut,
    CurveSet,
    ExtendedClut,
    FormulaSegment,
    Matrix,
    MultiProcess,
    NumberArray,
    SampledCalculatorCurve,
    SampledCurve,
    SampledSegment,
    SegmentedCurve,
    TintArray,
    UnknownElement,
)
from iccbrdf.icc.reader import Reader

SQUARE = (Op("in", 0), Op("sq", 0), Op("out", 0))


def read(data):
    return ELEMENTS.read(Reader(data, "a.icc", "element"))


EXAMPLES = {
    "matf": (
        Matrix(3, [[1, 2, 3], [-1, 0.5, 0]], [0.25, 0]),
        """
        6d617466 00000000       # 'matf', reserved
        0003 0002               # 3 inputs, 2 outputs
        3f800000 40000000 40400000  # first output: 1 2 3
        bf800000 3f000000 00000000  # second: -1 .5 0
        3e800000 00000000       # offsets
        """,
    ),
    "matf constants": (Matrix(2, None, [1]), "6d617466 00000000 0002 0001 3f800000"),
    "clut": (
        Clut([[[1, 2], [3, 4], [5, 6]], [[7, 8], [9, 10], [11, 12]]]),
        """
        636c7574 00000000       # 'clut', reserved
        0002 0002               # 2 inputs, 2 outputs
        02030000 00000000 00000000 00000000  # 2 x 3 grid points
        3f800000 40000000  40400000 40800000  40a00000 40c00000  # the second input varies fastest
        40e00000 41000000  41100000 41200000  41300000 41400000
        """,
    ),
    "xclt": (
        ExtendedClut([[0, 1], [0.2, 0.4], [1, 0]], 3),
        """
        78636c74 00000000       # 'xclt', reserved
        0001 0002               # 1 input, 2 outputs
        0003 0000               # value encoding uInt8, reserved
        03000000 00000000 00000000 00000000  # 3 grid points
        00ff 3366 ff00
        """,
    ),
    "tint": (
        TintArray(2, NumberArray("ui08", [0, 255, 51, 0])),
        """
        74696e74 00000000       # 'tint', reserved
        0001 0002               # 1 input, 2 outputs
        75693038 00000000       # a numeric array of type 'ui08'
        00ff 3300               # two rows
        """,
    ),
    "cvst": (
        CurveSet(
            (
                SegmentedCurve(
                    (0.25, 0.75),
                    (
                        FormulaSegment(0, (1, 2, 0.5, 0)),
                        SampledSegment([0.25, 1]),
                        FormulaSegment(6, (1, 2, 3, 4, 5, 6, 7)),
                    ),
                ),
                SampledCurve(0, 1, 1, [0, 0.2, 1], 3),
                SampledCalculatorCurve(17, -1, 1, 0, Calculator(1, 1, SQUARE)),
            )
        ),
        """
        63767374 00000000       # 'cvst', reserved
        0003 0003               # 3 inputs, 3 outputs
        00000024 0000006c       # 108 bytes at 36
        00000090 0000001b       # 27 bytes at 144
        000000ac 00000054       # 84 bytes at 172
        63757266 00000000       # 'curf', reserved
        0003 0000               # three segments, reserved
        3e800000 3f400000       # break points .25 .75
        70617266 00000000 0000 0000  # 'parf' of type 0
        3f800000 40000000 3f000000 00000000  # g a b c
        73616d66 00000000       # 'samf', reserved
        00000002                # two values
        3e800000 3f800000
        70617266 00000000 0006 0000  # 'parf' of type 6
        3f800000 40000000 40400000 40800000 40a00000 40c00000 40e00000
        736e6766 00000000       # 'sngf', reserved
        00000003                # three values
        00000000 3f800000       # from 0 to 1
        0001 0003               # extended beyond, value encoding uInt8
        00 33 ff  00            # and a pad byte
        636c6366 00000000       # 'clcf', reserved
        00000011                # to be sampled at 17 places
        bf800000 3f800000       # from -1 to 1
        0000 0000               # clipped beyond, reserved
        63616c63 00000000 0001 0001 00000000 00000018 00000024
        66756e63 00000000 00000003
        696e2020 00000000 73712020 00000000 6f757420 00000000
        """,
    ),
    "calc": (
        Calculator(
            3,
            1,
            (Op("data", 0x3F800000), Op("in", 0x00000001), Op("mtx", 0), Op("out", 0)),
            (Matrix.of([[0.5, 2]]),),
        ),
        """
        63616c63 00000000       # 'calc', reserved
        0003 0001               # 3 inputs, 1 output
        00000001                # 1 sub-element
        00000020 0000002c       # main function: 44 bytes at 32
        0000004c 00000018       # sub-element 0: 24 bytes at 76
        66756e63 00000000       # 'func', reserved
        00000004                # 4 operations
        64617461 3f800000       # 1
        696e2020 0000 0001      # in(0,2)
        6d747820 0000 0000      # mtx(0)
        6f757420 0000 0000      # out(0)
        6d617466 00000000 0002 0001 3f000000 40000000 00000000
        """,
    ),
    "unknown": (
        UnknownElement("smet", bytes(4), 3, 3, b"anything"),
        "736d6574 00000000 0003 0003 616e797468696e67",
    ),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_bytes_and_object(name):
    element, text = EXAMPLES[name]
    assert element.to_bytes() == unhex(text)
    found = read(unhex(text))
    assert type(found) is type(element)
    assert found == element
    assert (found.signature, found.inputs, found.outputs) == (
        element.signature,
        element.inputs,
        element.outputs,
    )


@pytest.mark.parametrize("name", [n for n in EXAMPLES if n != "unknown"])
def test_no_truncation_passes(name):
    element, text = EXAMPLES[name]
    data = unhex(text)
    for size in range(len(data)):
        # A matrix cut short may be one without offsets, a tint array one of fewer rows: others, not errors.
        try:
            assert read(data[:size]) != element
        except ProfileError as error:
            assert "a.icc: element" in str(error)  # noqa: PT017


def test_values():
    clut = read(unhex(EXAMPLES["clut"][1]))
    assert clut.table.shape == (2, 3, 2)
    assert clut.table[1, 2].tolist() == [11, 12]
    xclt = read(unhex(EXAMPLES["xclt"][1]))
    np.testing.assert_array_equal(xclt.table, np.float32([[0, 1], [0.2, 0.4], [1, 0]]))
    tint = read(unhex(EXAMPLES["tint"][1]))
    np.testing.assert_array_equal(tint.table, np.float32([[0, 1], [0.2, 0]]))
    matrix = read(unhex(EXAMPLES["matf"][1]))
    assert matrix.matrix.tolist() == [[1, 2, 3], [-1, 0.5, 0]]
    assert matrix.offset.tolist() == [0.25, 0]
    curves = read(unhex(EXAMPLES["cvst"][1])).curves
    assert curves[0].breakpoints == (0.25, 0.75)
    assert curves[0].segments[2].parameters == (1, 2, 3, 4, 5, 6, 7)
    assert curves[2].calculator.program == SQUARE
    assert (curves[2].size, curves[2].first, curves[2].last) == (17, -1, 1)
    assert read(unhex(EXAMPLES["matf constants"][1])).matrix is None


@pytest.mark.parametrize(
    ("encoding", "stored"), [(0, 0.3), (1, 0.300048828125), (2, 19661 / 65535), (3, 77 / 255)]
)
def test_value_encodings(encoding, stored):
    """0.3 in single precision is a little above 19660.5 / 65535 and 76.5 / 255; in half, 0.300048828125."""
    curve = SampledCurve(0, 1, 0, [0, 1, 0.3], encoding)
    np.testing.assert_array_equal(curve.values, np.float32([0, 1, stored]))
    found = read(CurveSet((curve,)).to_bytes()).curves[0]
    np.testing.assert_array_equal(found.values, curve.values)
    assert len(curve.to_bytes()) == 24 + 3 * (4, 2, 2, 1)[encoding]
    table = ExtendedClut([[0], [1], [0.3]], encoding)
    np.testing.assert_array_equal(table.table, read(table.to_bytes()).table)
    assert table.table[2, 0] == curve.values[2]


def test_matrix_without_offsets():
    data = EXAMPLES["matf"][0].to_bytes()[:-8]
    assert read(data) == Matrix.of([[1, 2, 3], [-1, 0.5, 0]])


def test_overstated_function_size_is_read():
    """The reference implementation adds the function's offset (here 32) to its size."""
    data = bytearray(unhex(EXAMPLES["calc"][1]))
    data[23] = 44 + 32
    with pytest.warns(ProfileWarning, match="found size 76, it takes 44"):
        assert read(bytes(data)) == EXAMPLES["calc"][0]


def test_a_limits_block_between_positions_and_function_is_stepped_over():
    data = unhex(
        """
        63616c63 00000000 0001 0001 00000000
        00000034 00000024       # main function: 36 bytes at 52
        636c6d74 00000000 00000010 00000000 00000020 00000000 00000000  # 'clmt'
        66756e63 00000000 00000003
        696e2020 00000000 73712020 00000000 6f757420 00000000
        """
    )
    assert read(data).program == SQUARE


def test_shared_curves_stay_shared():
    curve = SampledCurve(0, 1, 0, [0, 1])
    data = CurveSet((curve, curve)).to_bytes()
    assert len(data) == 12 + 16 + 32
    found = read(data)
    assert found.curves[0] is found.curves[1]
    assert found.to_bytes() == data


def test_calculators_nest():
    inner = Calculator(1, 1, SQUARE)
    outer = Calculator(1, 1, (Op("in", 0), Op("calc", 0), Op("out", 0)), (inner,))
    assert read(outer.to_bytes()).elements == (inner,)


def test_mpet():
    tag = MultiProcess(1, 2, (TintArray.of([[0, 1], [1, 0]]), Matrix.of([[1, 0], [0, 1]])))
    data = unhex(
        """
        6d706574 00000000       # 'mpet', reserved
        0001 0002 00000002      # 1 input, 2 outputs, 2 elements
        00000020 00000024       # 36 bytes at 32
        00000044 00000024       # 36 bytes at 68
        74696e74 00000000 0001 0002 666c3332 00000000 00000000 3f800000 3f800000 00000000
        6d617466 00000000 0002 0002 3f800000 00000000 00000000 3f800000 00000000 00000000
        """
    )
    assert tag.to_bytes() == data
    assert TAGS.read(Reader(data, "a.icc", "tag A2M0")) == tag


def test_numbers_are_single_precision_at_once():
    assert FormulaSegment(0, (0.1, 1, 0, 0)).parameters[0] == float(np.float32(0.1))
    assert Matrix.of([[0.1]]).matrix[0, 0] == np.float32(0.1)


CURVE = SampledCurve(0, 1, 0, [0, 1])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Matrix(2, [[1, 2, 3]], [0]), r"matrix: found shape \(1, 3\), expected \(1, 2\)"),
        (lambda: Matrix(1, None, [0]), "found None for one input"),
        (lambda: Matrix.of([[1e39]]), "which float32 cannot hold"),
        (lambda: Clut([[1], [2]] * 200), "2 to 255 grid points"),
        (lambda: Clut([[1, 2]]), "2 to 255 grid points"),
        (lambda: Clut(np.zeros((2,) * 17 + (1,))), "expected 1 to 16 inputs"),
        (lambda: ExtendedClut([[0], [1.5]], 2), r"outside 0..1"),
        (lambda: ExtendedClut([[0], [1e6]], 1), "which float16 cannot hold"),
        (lambda: ExtendedClut([[0], [1]], 4), "encoding: found 4, expected 0 to 3"),
        (lambda: TintArray.of([[1, 2]]), "two or more rows of 2"),
        (lambda: SegmentedCurve((0.5,), (FormulaSegment(0, (1, 1, 0, 0)),)), "found 1 segments, expected 2"),
        (lambda: SegmentedCurve((0.5, 0.5), (FormulaSegment(0, (1, 1, 0, 0)),) * 3), "increase strictly"),
        (lambda: SegmentedCurve((np.nan,), (FormulaSegment(0, (1, 1, 0, 0)),) * 2), "increase strictly"),
        (lambda: SegmentedCurve((), (SampledSegment([1]),)), "sampled one first or last"),
        (lambda: FormulaSegment(8, ()), "type: found 8"),
        (lambda: FormulaSegment(0, (1, 2)), "found 2, expected 4 for type 0"),
        (lambda: SampledCurve(1, 1, 0, [0, 1]), "expected finite ones that increase"),
        (lambda: SampledCurve(0, 1, 0, [0]), "expected two or more"),
        (lambda: SampledCurve(0, 1, 2, [0, 1]), "extension: found 2, expected 0 or 1"),
        (lambda: CurveSet((Matrix.of([[1]]),)), "found Matrix, expected a curve"),
        (lambda: Calculator(1, 1, (), (CURVE,)), "expected a processing element"),
        (
            lambda: MultiProcess(1, 2, (Matrix.of([[1]]),)),
            "found 1 channels after the last element, expected 2",
        ),
        (lambda: MultiProcess(2, 1, (Matrix.of([[1]]),)), "element 0: found 1 inputs, expected 2"),
        (lambda: MultiProcess(1, 3, ()), "found 1 channels"),
    ],
)
def test_what_the_file_cannot_hold_is_refused(make, message):
    with pytest.raises(UsageError, match=message):
        make()


def changed(name, offset, text):
    data = bytearray(unhex(EXAMPLES[name][1]))
    new = bytes.fromhex(text)
    data[offset : offset + len(new)] = new
    return bytes(data)


@pytest.mark.parametrize(
    ("name", "offset", "text", "message"),
    [
        ("clut", 8, "0011", "inputs: found 17, expected 1 to 16"),
        ("clut", 10, "0000", "outputs: found 0, expected 1 to 65535"),
        ("clut", 12, "01", r"grid: found \(1, 3\), expected 2 or more"),
        ("clut", 12, "ffff", "table: found 48 bytes, expected 520200"),
        ("clut", 12, "0202", "found 16 bytes more, expected the end"),
        ("xclt", 12, "0004", "encoding: found 4, expected 0 to 3"),
        ("matf", 10, "ffff", "matrix: found 32 bytes, expected 786420"),
        ("tint", 8, "0002", "inputs: found 2, expected 1"),
        ("tint", 10, "0004", "two or more rows of 4"),
        ("tint", 12, "58595a20", r"values \(XYZ\): byte offset 24: values: found 0 bytes, expected 4"),
        ("tint", 12, "74657874", "values: found type 'text', expected a numeric array"),
        ("cvst", 10, "0002", "outputs: found 2, expected 3"),
        ("cvst", 12, "00000000", "curve 0: found it at 0 of this structure, expected 36"),
        ("cvst", 16, "00000000", "curve 0: byte offset 36: signature of a curve: found 0 bytes"),
        ("cvst", 16, "00000070", "curve 1: found it at 144 of this structure, expected 148"),
        ("cvst", 36, "6d617466", "curve: found 'matf', expected 'curf' or 'sngf' or 'clcf'"),
        ("cvst", 44, "0000", "count: found 0, expected 1 to 65535"),
        ("cvst", 48, "3f800000", "expected finite ones that increase strictly"),
        ("cvst", 48, "7fc00000", "expected finite ones that increase strictly"),
        ("cvst", 56, "58585858", r"\(cvst\), curve 0 \(curf\): byte offset 56: curve segment: found 'XXXX'"),
        ("cvst", 64, "0009", "type: found 9, expected 0 or 1"),
        ("cvst", 92, "ffffffff", "values: found 48 bytes, expected 17179869180"),
        ("cvst", 152, "00000001", "found shape .1,., expected two or more"),
        ("cvst", 160, "00000000", "found entries from 0.0 to 0.0"),
        ("cvst", 196, "6d617466", r"2 \(clcf\), calculator \(matf\): byte offset 216: found 40 bytes more"),
        ("calc", 12, "7fffffff", "position table of 2147483648 calculator parts: found 84 bytes"),
        ("calc", 16, "00000010", "main function"),
        ("calc", 16, "ffffffff", "main function: found 0 bytes, expected 4"),
        ("calc", 20, "0000002b", "main function: found size 43, expected 44"),
        ("calc", 24, "00000000", "sub-element 0: found it at 0 of this structure"),
        ("calc", 24, "00000024", "sub-element 0: found it at 36 of this structure, expected 76"),
        ("calc", 32, "66756e64", "expected b'func'"),
        ("calc", 40, "0fffffff", "main function: found size 44, expected 2147483652"),
    ],
)  # fmt: skip
def test_malformed(name, offset, text, message):
    with pytest.raises(ProfileError, match=message):
        read(changed(name, offset, text))
