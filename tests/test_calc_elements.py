"""Processing elements on values worked out by hand, and programs that apply them."""

from types import SimpleNamespace

import numpy as np
import pytest

from iccbrdf.calc.elements import apply
from iccbrdf.calc.interpreter import run
from iccbrdf.calc.program import parse
from iccbrdf.errors import ProfileError, UnsupportedError


def element(signature, inputs, outputs, **fields):
    return SimpleNamespace(signature=signature, inputs=inputs, outputs=outputs, **fields)


def matrix(rows, offset):
    rows = None if rows is None else np.array(rows, np.float32)
    return element("matf", 2, len(offset), matrix=rows, offset=np.array(offset, np.float32))


def clut(table, inputs, signature="clut"):
    table = np.array(table, np.float32)
    return element(signature, inputs, table.shape[-1], table=table)


def tint(table):
    table = np.array(table, np.float32)
    return element("tint", 1, table.shape[1], table=table)


def calculator(text, inputs, outputs, elements=()):
    return element("calc", inputs, outputs, program=parse(text), elements=tuple(elements))


def curves(*curves):
    return element("cvst", len(curves), len(curves), curves=curves)


def segmented(breakpoints, *segments):
    return SimpleNamespace(signature="curf", breakpoints=breakpoints, segments=segments)


def formula(kind, *parameters):
    return SimpleNamespace(signature="parf", type=kind, parameters=parameters)


def samples(*values):
    return SimpleNamespace(signature="samf", values=np.array(values, np.float32))


def sampled(values, first=0.0, last=1.0, extension=0):
    values = np.array(values, np.float32)
    return SimpleNamespace(signature="sngf", first=first, last=last, extension=extension, values=values)


LINE = formula(0, 1.0, 1.0, 0.0, 0.0)
LINES = curves(segmented((), LINE), segmented((), LINE))
CURVE = curves(sampled([0, 10]))
MATRIX = matrix([[1, 2], [3, 4], [5, 6]], [10, 20, 30])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_matrix(dtype):
    outs = apply(MATRIX, [[1, 0], [1, 2]], dtype=dtype)
    np.testing.assert_array_equal(outs, [[13, 14], [27, 28], [41, 42]])
    assert outs[0].dtype == dtype


def test_matrix_of_constants_only():
    assert apply(matrix(None, [4, 5]), [[1.0, 2.0], 3.0]) == [4, 5]


def test_uniform_inputs_give_uniform_outputs():
    for applied in (MATRIX, clut(np.ones((2, 2, 1)), 2), calculator("in(0) out(0)", 2, 1), LINES):
        assert all(np.ndim(out) == 0 for out in apply(applied, [1.0, 2.0]))


def test_look_up_table_is_multilinear():
    # the product of the inputs is bilinear: a table of its corners gives it everywhere
    x, y = np.meshgrid(np.linspace(0, 1, 7), np.linspace(0, 1, 5))
    (out,) = apply(clut([[[0], [0]], [[0], [1]]], 2), [x.ravel(), y.ravel()], dtype=np.float64)
    np.testing.assert_allclose(out, (x * y).ravel(), atol=1e-15)


def test_look_up_table_of_three_channels_and_unequal_grids():
    r, g, b = np.meshgrid(np.linspace(0, 1, 2), np.linspace(0, 1, 3), np.linspace(0, 1, 4), indexing="ij")
    table = np.stack([r + 2 * g + 4 * b, r * b], axis=-1)
    points = np.array([[0.3, 0.0, 1.0, 0.9], [0.5, 0.75, 1.0, 0.1], [1 / 3, 0.4, 1.0, 0.7]])
    first, second = apply(clut(table, 3, "xclt"), list(points), dtype=np.float64)
    np.testing.assert_allclose(first, points[0] + 2 * points[1] + 4 * points[2], rtol=1e-6)
    np.testing.assert_allclose(second, points[0] * points[2], rtol=1e-6, atol=1e-7)


def test_look_up_table_clips_and_takes_nan_for_zero():
    (out,) = apply(clut([[1], [2], [4]], 1), [[-5, 0, 0.25, 0.5, 1, 7, np.inf, -np.inf, np.nan]])
    np.testing.assert_array_equal(out, [1, 1, 1.5, 2, 4, 4, 4, 1, 1])


def test_look_up_table_of_many_channels():
    count = 10
    table = np.zeros([2] * count + [1])
    table[(1,) * count] = 1
    (out,) = apply(clut(table, count), [[0.5, 1.0]] * count)
    np.testing.assert_array_equal(out, [2.0**-count, 1])


def test_tint():
    outs = apply(tint([[0, 10], [1, 20], [3, 20]]), [[-1, 0, 0.25, 0.5, 0.75, 1, 2, np.nan]])
    np.testing.assert_array_equal(outs[0], [0, 0, 0.5, 1, 2, 3, 3, 0])
    np.testing.assert_array_equal(outs[1], [10, 10, 15, 20, 20, 20, 20, 10])


def test_each_channel_has_its_curve():
    outs = apply(curves(sampled([0, 10]), segmented((), formula(0, 2.0, 1.0, 1.0, 0.5))), [[0.25], [2.0]])
    assert [float(out[0]) for out in outs] == [2.5, 9.5]


@pytest.mark.parametrize(
    ("segment", "x", "expected"),
    [
        (formula(0, 2.0, 3.0, 1.0, 0.5), 2.0, 49.5),
        (formula(0, 0.5, 1.0, 0.0, 0.0), -1.0, np.nan),
        (formula(1, 2.0, 3.0, 5.0, 5.0, 0.25), np.sqrt(19.0), 6.25),
        (formula(2, 3.0, 2.0, 1.0, 4.0, 0.5), -1.0, 24.5),
        (formula(3, 2.0, 3.0, 1.0, 1.0, 0.5), 2.0, 27.5),
        (formula(3, 2.0, 3.0, 1.0, 1.0, 0.5), -2.0, 0.5),
        (formula(3, 0.0, 3.0, 1.0, 1.0, 0.5), -2.0, 0.5),
        (formula(4, 2.0, 3.0, 1.0, 0.5, 2.0), 1.0, 0.5 + 3 * np.log(1.0)),
        (formula(5, 1.0, 2.0, 0.5, 1.0, 4.0, 3.0), 0.25, 3.5),
        (formula(6, 2.0, 1.0, 1.0, 9.0, 1.0, 3.0, 2.0), 4.0, 3 * (7 / 5) ** 2),
        (formula(6, 2.0, 1.0, 1.0, 9.0, 1.0, 3.0, 2.0), 0.25, 0.0),
        (formula(7, 2.0, 1.0, 1.0, 2.0, 0.5, 3.0), 4.0, 27.0),
    ],
)
def test_formulas(segment, x, expected):
    (out,) = apply(curves(segmented((), segment)), [x], dtype=np.float64)
    np.testing.assert_allclose(out, expected, rtol=1e-14)


def test_break_points_belong_to_the_left():
    low, middle, high = (formula(0, 1.0, 0.0, 0.0, value) for value in (1.0, 2.0, 3.0))
    x = np.array([-1e30, -1, 0, np.nextafter(0, 1), 0.5, 1, 1.0000001, 1e30])
    (out,) = apply(curves(segmented((0.0, 1.0), low, middle, high)), [x], dtype=np.float64)
    np.testing.assert_array_equal(out, [1, 1, 1, 2, 2, 2, 3, 3])


def test_nan_passes_segmented_curves():
    (out,) = apply(curves(segmented((), formula(0, 1.0, 0.0, 0.0, 7.0))), [[np.nan, 1]])
    np.testing.assert_array_equal(out, [np.nan, 7])


def test_sampled_segment_starts_where_the_one_before_ends():
    curve = segmented((0.0, 1.0, 2.0), formula(0, 1.0, 0.0, 0.0, 3.0), samples(5, 7), samples(1), LINE)
    (out,) = apply(curves(curve), [[-1, 0, 0.25, 0.5, 0.75, 1, 1.5, 2, 3]])
    np.testing.assert_array_equal(out, [3, 3, 4, 5, 6, 7, 4, 1, 3])


@pytest.mark.parametrize("segments", [(samples(1), LINE), (LINE, samples(1))])
def test_sampled_segment_needs_two_neighbours(segments):
    with pytest.raises(ProfileError, match="expected a formula segment"):
        apply(curves(segmented((0.0,), *segments)), [1.0])


def test_sampled_curve_and_its_extensions():
    x = [-1, 2, 3, 3.5, 4, 5, np.inf, np.nan]
    (clipped,) = apply(curves(sampled([1, 3, 2], 2.0, 4.0)), [x])
    np.testing.assert_array_equal(clipped, [1, 1, 3, 2.5, 2, 2, 2, np.nan])
    (extended,) = apply(curves(sampled([1, 3, 2], 2.0, 4.0, 1)), [x])
    np.testing.assert_array_equal(extended, [-5, 1, 3, 2.5, 2, 1, -np.inf, np.nan])


def test_sampled_calculator_curve():
    calc = calculator("in(0) sq env(k) pop add out(0)", 1, 1)
    curve = SimpleNamespace(signature="clcf", first=0.0, last=4.0, extension=0, size=3, calculator=calc)
    (out,) = apply(curves(curve), [[0, 1, 2, 3, 9]], env={"k": 1.0})
    np.testing.assert_array_equal(out, [1, 3, 5, 11, 17])
    curve.calculator = calculator("7 out(0)", 1, 1)
    np.testing.assert_array_equal(apply(curves(curve), [[0, 1]]), [[7, 7]])


@pytest.mark.parametrize("name", ["smet", "rclt", "eobs"])
def test_unknown_elements_are_named(name):
    with pytest.raises(UnsupportedError, match=f"'{name}' cannot be evaluated, only matf, clut"):
        apply(element(name, 1, 1), [1.0])


def test_unknown_parts_of_curves_are_named():
    with pytest.raises(UnsupportedError, match="curve 'abcd'"):
        apply(curves(SimpleNamespace(signature="abcd")), [1.0])
    with pytest.raises(UnsupportedError, match="curve segment 'abcd'"):
        apply(curves(segmented((), SimpleNamespace(signature="abcd"))), [1.0])
    with pytest.raises(UnsupportedError, match="formula segment of type 8, expected 0 to 7"):
        apply(curves(segmented((), formula(8))), [1.0])


@pytest.mark.parametrize("operator", ["mtx", "elem"])
def test_programs_apply_elements_by_index(operator):
    program = parse(f"9 in(0,2) {operator}(1) out(0,3) out(3)")
    outs = run(program, [[1.0, 0.0], [1.0, 2.0]], 4, elements=[CURVE, MATRIX])
    np.testing.assert_array_equal(outs[:3], [[13, 14], [27, 28], [41, 42]])
    assert outs[3] == 9


@pytest.mark.parametrize(
    ("operator", "applied", "expected"),
    [
        ("curv", CURVE, 2.5),
        ("clut", clut([[0], [4]], 1), 1),
        ("clut", clut([[0], [4]], 1, "xclt"), 1),
        ("tint", tint([[0], [8]]), 2),
        ("calc", calculator("in(0) 1 add out(0)", 1, 1), 1.25),
        ("elem", CURVE, 2.5),
    ],
)
def test_operators_of_elements(operator, applied, expected):
    assert run(parse(f"in(0) {operator}(0) out(0)"), [0.25], 1, elements=[applied]) == [expected]


@pytest.mark.parametrize(("operator", "signature"), [("tJab", "XtoJ"), ("fJab", "JtoX")])
def test_operators_of_the_appearance_model(operator, signature):
    white = {"white": (96.42, 100.0, 82.49), "luminance": 500.0, "background": 20.0}
    factors = {"surround": 0.69, "induction": 1.0, "adaptation": 1.0}
    applied = element(signature, 3, 3, **white, **factors)
    outs = run(parse(f"20 19 18 {operator}(0) out(0,3)"), [], 3, elements=[applied])
    assert outs == apply(applied, [20.0, 19.0, 18.0])


def test_tone_map():
    """Each channel: gain times luminance times (x + offset), then black is added."""
    functions = [SimpleNamespace(parameters=p) for p in ((2.0, 0.5, 0.25), (1.0, 0.0, -1.0))]
    tone = element("tmap", 3, 2, luminance=sampled([0, 10]), functions=functions)
    outs = apply(tone, [[1.0, 0.0], 3.0, [0.5, 0.25]])
    np.testing.assert_array_equal(outs[0], [2 * 5 * 1.5 + 0.25, 2 * 2.5 * 0.5 + 0.25])
    np.testing.assert_array_equal(outs[1], [5 * 3 - 1, 2.5 * 3 - 1])


@pytest.mark.parametrize("signature", ["bACS", "eACS"])
def test_marks_of_alternate_spaces_do_nothing(signature):
    assert apply(element(signature, 2, 2), [1.0, 2.0]) == [1, 2]


def test_nested_calculators_have_memory_and_stack_of_their_own():
    inner = calculator("scnt out(0) tget(0) env(litX) pop out(1,2) 8 tput(0)", 1, 3)
    outs = run(
        parse("5 tput(0) 1 2 3 calc(0) out(0,3) tget(0) out(3) scnt out(4)"),
        [],
        5,
        elements=[inner],
        env={"litX": 0.5},
    )
    assert outs == [0, 0, 0.5, 5, 2]
