"""Every operator on values worked out by hand, as scalars and as tiles, in both dtypes."""

import math

import numpy as np
import pytest

from iccbrdf.calc.interpreter import run
from iccbrdf.calc.operators import OPERATORS, Kind, Operand, apply, markdown, stack_effect
from iccbrdf.calc.program import parse

INF, NAN = math.inf, math.nan
INT_MIN = -2147483648.0
E = math.e

# (program between in(0,n) and out(0,m), inputs, outputs).  The operator of a case is its first word.
CASES = [
    # constants
    ("data(3fc00000)", [], [1.5]),
    ("data(ff800000)", [], [-INF]),
    ("pi", [], [3.14159265]),
    ("+INF", [], [INF]),
    ("-INF", [], [-INF]),
    ("NaN", [], [NAN]),
    # channels and memory
    ("in(1,2)", [1, 2, 3], [1, 2, 3, 2, 3]),
    ("out(1,2)", [7, 8], [0, 7, 8]),
    ("tput(5,2) tget(5,2)", [7, 8], [7, 8]),
    ("tget(9)", [], [0]),
    ("tsav(3,2) tget(4) tget(3)", [7, 8], [7, 8, 8, 7]),
    ("env(true)", [], [1, 1]),
    ("env(ndef)", [], [0, 0]),
    ("env(litX)", [], [0.25, 1]),
    ("env(none)", [], [0, 0]),
    # the stack
    ("copy", [4], [4, 4]),
    ("copy(2,2)", [1, 2], [1, 2, 1, 2, 1, 2]),
    ("rotl(5,2)", [1, 2, 3, 4, 5], [3, 4, 5, 1, 2]),
    ("rotl(3,7)", [1, 2, 3], [2, 3, 1]),
    ("rotr(5,2)", [1, 2, 3, 4, 5], [4, 5, 1, 2, 3]),
    ("rotr(3,3)", [1, 2, 3], [1, 2, 3]),
    ("posd(3)", [1, 2, 3, 4], [1, 2, 3, 4, 2]),
    ("posd(4,2)", [1, 2, 3, 4], [1, 2, 3, 4, 1, 1]),
    ("flip", [1, 2], [2, 1]),
    ("flip(3)", [1, 2, 3, 4], [1, 4, 3, 2]),
    ("pop(2)", [1, 2, 3], [1]),
    ("scnt", [5, 6, 7], [5, 6, 7, 3]),
    ("noop", [5], [5]),
    # matrices
    ("tran(2,3)", [1, 2, 3, 4, 5, 6], [1, 4, 2, 5, 3, 6]),
    ("tran(3,2)", [1, 4, 2, 5, 3, 6], [1, 2, 3, 4, 5, 6]),
    ("solv", [4, 2], [0.5, 1]),
    ("solv(2,2)", [1, 2, 3, 4, 5, 11], [1, 2, 1]),
    ("solv(3,3)", [0, 2, 0, 1, 0, 0, 0, 0, 4, 6, 5, 2], [5, 3, 0.5, 1]),
    ("solv(3,3)", [1, 2, 3, 4, 5, 6, 7, 8, 9, 1, 1, 1], [0, 0, 0, 0]),
    ("solv(2,2)", [0, 0, 0, 0, 1, 1], [0, 0, 0]),
    ("solv(2,2)", [1, NAN, 0, 1, 1, 1], [0, 0, 0]),
    # x + y = 2, x - y = 0, x = 1 hold together; and the shortest x of 3 x1 + 4 x2 = 25
    ("solv(3,2)", [1, 1, 1, -1, 1, 0, 2, 0, 1], [1, 1, 1]),
    ("solv(1,2)", [3, 4, 25], [3, 4, 1]),
    # many to one
    ("sum", [1, 2], [3]),
    ("sum(4)", [1, 2, 3, 4], [10]),
    ("prod(3)", [2, 3, -4], [-24]),
    ("min", [2, -1], [-1]),
    ("min", [1, NAN], [NAN]),
    ("min", [NAN, 1], [1]),
    ("min(3)", [NAN, 1, 2], [NAN]),
    ("min(3)", [3, NAN, 2], [2]),
    ("max", [2, -1], [2]),
    ("max", [1, NAN], [NAN]),
    ("max", [NAN, 1], [1]),
    ("max(3)", [NAN, 1, 2], [NAN]),
    ("max(3)", [3, NAN, 4], [4]),
    ("and", [0.5, 1], [1]),
    ("and", [1, 0.49], [0]),
    ("and(3)", [1, NAN, 7], [1]),
    ("or", [0.49, 0.5], [1]),
    ("or(3)", [0.49, -3, NAN], [0]),
    # one operand
    ("neg(2)", [1, -2], [-1, 2]),
    ("sq(2)", [3, -0.5], [9, 0.25]),
    ("sqrt(2)", [9, -1], [3, NAN]),
    ("cb(2)", [3, -2], [27, -8]),
    ("cbrt(2)", [27, -8], [3, -2]),
    ("abs(3)", [-2, 3, NAN], [2, 3, NAN]),
    ("sign(4)", [-7, 0, 0.25, NAN], [-1, 0, 1, 0]),
    ("flor(4)", [1.5, -1.5, 3e9, NAN], [1, -2, 3e9, NAN]),
    ("ceil(3)", [1.5, -1.5, INF], [2, -1, INF]),
    ("trnc(2)", [1.75, -1.75], [1, -1]),
    ("trnc(4)", [3e9, -3e9, NAN, INF], [INT_MIN] * 4),
    ("rond(6)", [0.5, 2.5, -0.5, -2.5, 0.49, -0.49], [1, 3, -1, -3, 0, 0]),
    ("rond(3)", [3e9, NAN, -INF], [INT_MIN] * 3),
    ("exp(3)", [0, 1, -INF], [1, E, 0]),
    ("exp", [1000], [INF]),
    ("log(4)", [1000, 1, 0, -1], [3, 0, -INF, NAN]),
    ("ln(4)", [E, 1, 0, -1], [1, 0, -INF, NAN]),
    ("sin(2)", [math.pi / 6, INF], [0.5, NAN]),
    ("cos(2)", [math.pi / 3, 0], [0.5, 1]),
    ("tan", [math.pi / 4], [1]),
    ("asin(3)", [0.5, -1, 1.01], [math.pi / 6, -math.pi / 2, NAN]),
    ("acos(3)", [0.5, 1, -1.01], [math.pi / 3, 0, NAN]),
    ("atan(2)", [1, -INF], [math.pi / 4, -math.pi / 2]),
    ("rnum(5)", [0, 1e30, INF, -INF, NAN], [1, 1, 0, 0, 0]),
    ("not(5)", [0.5, 0.49, 1, -3, NAN], [0, 1, 0, 1, 1]),
    # two operands: all the first ones, then all the second ones
    ("add(2)", [1, 2, 10, 20], [11, 22]),
    ("sub(2)", [1, 2, 10, 5], [-9, -3]),
    ("mul(2)", [2, 3, 10, 20], [20, 60]),
    ("div(4)", [1, 1, -1, 0, 4, 0, 0, 0], [0.25, INF, -INF, NAN]),
    ("mod(4)", [-5.5, 5.5, -7, 5, 2, -2, 3, 0], [-1.5, 1.5, -1, 5]),
    ("mod(2)", [3e9, 2.0**33, 7, 3], [3e9 % 7, 2**33 % 3]),
    ("mod", [0, 0], [0]),
    ("pow(5)", [-2, -2, 0, 0, -8, 0.5, 2, 0, -1, 3], [NAN, 4, 1, INF, -512]),
    ("atn2(2)", [1, -1, 2, 0], [1.10714872, math.pi]),
    ("ctop(2)", [-1, 3, -1, 4], [math.sqrt(2), 5, 225, 53.1301024]),
    ("ptoc(2)", [2, 1, 30, 180], [math.sqrt(3), -1, 1, -8.742278e-8]),
    ("lt(3)", [1, 2, NAN, 2, 2, 1], [1, 0, 0]),
    ("le(3)", [1, 2, NAN, 2, 2, 1], [1, 1, 0]),
    ("eq(4)", [1, 2, NAN, 0, 2, 2, NAN, -0.0], [0, 1, 1, 1]),
    ("neq(3)", [1, 2, NAN, 2, 2, NAN], [1, 0, 0]),
    ("eq(2)", [NAN, 1, 1, NAN], [0, 0]),
    ("ge(3)", [1, 2, NAN, 2, 2, 1], [0, 1, 0]),
    ("gt(3)", [3, 2, NAN, 2, 2, 1], [1, 0, 0]),
    ("near(4)", [1, 1, INF, NAN, 1.00002, 1.000005, INF, NAN], [0, 1, 0, 0]),
    ("vmin(4)", [1, 3, NAN, 1, 2, 2, 1, NAN], [1, 2, 1, NAN]),
    ("vmax(4)", [1, 3, NAN, 1, 2, 2, 1, NAN], [2, 3, 1, NAN]),
    ("vand(4)", [1, 1, 0, NAN, 0.5, 0.4, 0, 1], [1, 0, 0, 0]),
    ("vor(4)", [1, 1, 0, NAN, 0.5, 0.4, 0, 0], [1, 1, 0, 0]),
    ("vxor(4)", [1, 1, 0, NAN, 0.5, 0.4, 0, 1], [0, 1, 0, 1]),
    # n values and one
    ("gama(3)", [-2, 3, 4, 2], [4, 9, 16]),
    ("sadd(2)", [1, 2, 10], [11, 12]),
    ("ssub(2)", [1, 2, 10], [-9, -8]),
    ("smul(2)", [1, 2, 10], [10, 20]),
    ("sdiv(3)", [1, -1, 0, 0], [INF, -INF, NAN]),
    # white is L* 100; Y 0.125 is f 0.5, L* 42; below 216/24389 the line: a* of X -0.1 (and f of 0 is 16/116)
    ("tLab(2)", [1, 0, 1, 0.125, 1, 0], [100, 42, 0, -500 * (0.5 - 16 / 116), 0, 200 * (0.5 - 16 / 116)]),
    ("tLab", [-0.1, 0, 0], [0, -389.35185, 0]),
    ("tXYZ(2)", [100, 42, 0, 0, 0, 0], [1, 0.125, 1, 0.125, 1, 0.125]),
    ("tXYZ", [8, 0, 0], [8 / 903.2971] * 3),
    ("tXYZ", [0, -20, 20], [0, 0, 0]),
    # control
    ("if { 1 } else { 2 }", [0.5], [1]),
    ("if { 1 } else { 2 }", [0.49], [2]),
    ("if { 1 } else { 2 }", [NAN], [2]),
    ("else", None, None),
    ("sel case { 10 } case { 20 } dflt { 30 }", [0.5], [20]),
    ("sel case { 10 } case { 20 } dflt { 30 }", [-0.4], [10]),
    ("sel case { 10 } case { 20 } dflt { 30 }", [-0.5], [30]),
    ("sel case { 10 } case { 20 } dflt { 30 }", [1.5], [30]),
    ("sel case { 10 } case { 20 } dflt { 30 }", [NAN], [30]),
    ("sel case { pop 10 }", [8, 0], [10]),
    ("sel case { pop 10 }", [8, 1], [8]),
    ("case", None, None),
    ("dflt", None, None),
]
# Shown with real elements in test_calc_elements.py.
ELSEWHERE = {"curv", "mtx", "clut", "tint", "tJab", "fJab", "calc", "elem"}


def evaluate(text, inputs, n_out, dtype=np.float32):
    stack = f"in(0,{len(inputs)})" if inputs else ""
    results = f"out(0,{n_out})" if not text.startswith("out") else ""
    program = parse(f"{stack} {text} {results}")
    return run(program, inputs, n_out, env={"litX": 0.25}, dtype=dtype)


def test_every_operator_has_a_case():
    assert {text.split("(")[0].split()[0] for text, _, _ in CASES} | ELSEWHERE == set(OPERATORS)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("text", "inputs", "expected"), [case for case in CASES if case[1] is not None])
def test_meaning(text, inputs, expected, dtype):
    scalars = evaluate(text, inputs, len(expected), dtype)
    np.testing.assert_allclose(scalars, expected, rtol=2e-6, atol=2e-7)
    assert all(value.dtype == dtype for value in scalars)
    assert all(np.ndim(value) == 0 for value in scalars), "a uniform value became a tile"
    tiles = evaluate(text, [np.full(3, value) for value in inputs], len(expected), dtype)
    for tile, scalar in zip(tiles, scalars, strict=True):
        assert tile.dtype == dtype
        np.testing.assert_array_equal(tile, np.full(np.shape(tile), scalar))


def test_float32_sums_round_after_every_addition():
    # 2^24 + 1 is no float32: twice 1 added one by one is lost, their sum is not.
    assert evaluate("sum(3)", [2.0**24, 1, 1], 1)[0] == 2.0**24
    assert evaluate("sum(3)", [1, 1, 2.0**24], 1)[0] == 2.0**24 + 2
    assert evaluate("sum(3)", [2.0**24, 1, 1], 1, np.float64)[0] == 2.0**24 + 2


def test_transcendentals_are_float64_rounded_once():
    x = np.float32(0.7)
    assert evaluate("sin", [x], 1)[0] == np.float32(math.sin(float(x)))
    assert evaluate("pow", [x, 3.3], 1)[0] == np.float32(float(x) ** float(np.float32(3.3)))


def test_near_is_strict_at_its_tolerance():
    assert evaluate("near", [0, 1e-5], 1, np.float64)[0] == 0
    assert evaluate("near", [1, 1.00001], 1)[0] == 0
    assert evaluate("near", [100, 100.00001], 1)[0] == 1


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (2, 5), (5, 5), (7, 3), (9, 9)])
def test_solve_and_transpose_in_general(rows, columns):
    random = np.random.default_rng(rows)
    matrix, right = random.normal(size=(rows, columns)), random.normal(size=rows)
    *x, flag = evaluate(f"solv({rows},{columns})", [*matrix.ravel(), *right], columns + 1, np.float64)
    np.testing.assert_allclose(x, np.linalg.lstsq(matrix, right, rcond=None)[0], rtol=1e-9)
    assert flag == 1
    found = evaluate(f"tran({rows},{columns})", list(matrix.ravel()), rows * columns, np.float64)
    np.testing.assert_array_equal(found, matrix.T.ravel())


def test_solve_of_a_tile_with_singular_pixels():
    matrix = np.array([[2.0, 0, 0, 2, 6, 8], [1.0, 1, 1, 1, 6, 8]])
    x, y, flag = evaluate("solv(2,2)", list(matrix.T), 3)
    np.testing.assert_array_equal([x, y, flag], [[3, 0], [4, 0], [1, 0]])


def test_stack_effects_as_the_standard_states_them():
    stated = {
        "in(0,4)": (0, 4), "out(0,4)": (4, 0), "tsav(0,4)": (4, 4), "env(true)": (0, 2), "copy(3,2)": (3, 9),
        "posd(3,2)": (3, 5), "rotl(4,1)": (4, 4), "flip(3)": (3, 3), "pop(3)": (3, 0), "solv(3,3)": (12, 4),
        "solv(2,3)": (8, 4), "tran(2,3)": (6, 6), "sum(5)": (5, 1), "add(3)": (6, 3), "gama(3)": (4, 3),
        "tLab(2)": (6, 6), "ctop(2)": (4, 4), "sin(3)": (3, 3), "scnt": (0, 1), "noop": (0, 0), "sel": (1, 0),
    }  # fmt: skip
    for text, effect in stated.items():
        op = parse(text if text != "sel" else "sel case {}")[0]
        assert stack_effect(OPERATORS[op.name], op.s, op.t, ()) == effect, text


def test_control_operators_have_no_meaning_of_their_own():
    with pytest.raises(TypeError, match="if is a control operator"):
        apply(OPERATORS["if"], None, [], 0, 0)


def test_table_is_consistent():
    for name, row in OPERATORS.items():
        assert len(name) <= 4, name
        assert (row.function is None) == (row.kind is Kind.CONTROL), name
        assert (row.pops is None) == (row.operand is Operand.ELEMENT), name
        assert row.text, name


def test_markdown_has_a_row_an_operator():
    rows = markdown().splitlines()[2:]
    assert len(rows) == len(OPERATORS)
    assert "| `flip` | S = n - 2 | reverse the top n |" in rows
    assert all(row.replace("\\|", "").count("|") == 4 for row in rows)
