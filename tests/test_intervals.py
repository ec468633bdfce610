"""Interval analysis: every value is where it is said to be, and what is sound is seen to be sound."""

import math

import numpy as np
import pytest
from calc_programs import INPUTS, OUTPUTS, random_program
from graph_examples import calculator, lifted

from iccbrdf import read_profile
from iccbrdf.calc import elements, intervals
from iccbrdf.calc import ranges as ranges_module
from iccbrdf.calc.graph import meaning
from iccbrdf.calc.hazards import expression
from iccbrdf.calc.intervals import INF, Arithmetic, Interval
from iccbrdf.calc.meanings import solve
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.program import parse
from iccbrdf.calc.ranges import analyse
from iccbrdf.calc.table_ranges import curve_range, table_range
from iccbrdf.icc import FormulaSegment, SampledCurve, SampledSegment, SegmentedCurve
from iccbrdf.resources import folder

# Every value that a pixel needs --------------------------------------------------------------------------


def needed_values(graph, pixels, env):
    """Node by node of a lifted graph its values, and for which pixels an output needs them."""
    dtype, values = graph.dtype, {}
    count = len(pixels)

    def number(node):
        return np.broadcast_to(values[node], count).astype(dtype)

    def value(node):
        if node.op == "const":
            return np.full(count, node.detail[0], dtype)
        if node.op == "input":
            return pixels[:, node.detail]
        if node.op == "variable":
            return np.full(count, env.get(node.detail, 0.0), dtype)
        if node.op == "defined":
            return np.full(count, node.detail in env, dtype)
        if node.op == "select":
            return np.where(number(node.arguments[0]) >= 0.5, *map(number, node.arguments[1:]))
        if node.op == "pick":
            return values[node.arguments[0]][node.detail]
        arguments = [number(argument) for argument in node.arguments]
        if node.op == "curve":
            return elements.apply_curve(node.detail, arguments[0], {})
        if node.op in ("clut", "tint"):
            return elements.apply(node.detail, arguments, dtype=dtype)
        if node.op == "solve":
            return solve(arguments, *(n - 1 for n in node.detail))
        return meaning(node.op)(*arguments)

    live = graph.live()
    with np.errstate(all="ignore"):
        for node in live:
            values[node] = value(node)
    needed = {node: np.zeros(count, bool) for node in live}
    for output in graph.outputs:
        needed[output][:] = True
    for node in reversed(live):
        for position, argument in enumerate(node.arguments):
            reads = needed[node]
            if node.op == "select" and position:
                reads = reads & ((number(node.arguments[0]) >= 0.5) == (position == 1))
            needed[argument] |= reads
    return [(node, number(node), needed[node]) for node in live if node.width == 1]


def assert_contained(graph, analysis, pixels, env, where=""):
    for node, values, needed in needed_values(graph, pixels, env):
        if not needed.any():
            continue
        interval = analysis.ranges[node]
        wanted = values[needed]
        nan = np.isnan(wanted)
        assert interval.nan or not nan.any(), f"{where}: {node} is NaN, not in {interval}"
        low, high = wanted[~nan].min(initial=np.inf), wanted[~nan].max(initial=-np.inf)
        assert interval.low <= low, f"{where}: {node} is {low}, not in {interval}"
        assert high <= interval.high, f"{where}: {node} is {high}, not in {interval}"
    if not analysis.hazards:
        outputs = set(graph.outputs)
        for node, values, _ in needed_values(graph, pixels, env):
            assert node not in outputs or np.isfinite(values).all()


def samples(ranges, count, seed, dtype):
    """Pixels within `ranges`, many of them at ends, at zeros and at round numbers."""
    rng = np.random.default_rng(seed)
    low, high = np.array(ranges, dtype).T
    pixels = rng.uniform(low, high, (count, len(ranges))).astype(dtype)
    for special in (low, high, dtype(0), dtype(-0.0), dtype(0.5), dtype(1), np.round(pixels)):
        pixels = np.where(rng.random(pixels.shape) < 0.1, special, pixels)
    return np.clip(pixels, low, high).astype(dtype)


RANGES = [(-1, 1), (0, 1), (0.25, 4), (-3, -0.5), (-1e6, 1e6), (2, 2), (-1e-30, 1e-3), (0, 3e38)]
ENVIRONMENTS = ({}, {"litX": 0.75}, {"litX": -0.0, "a": -999.0})


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("first", range(0, 60, 20))
def test_random_programs_are_contained(first, dtype):
    for seed in range(first, first + 20):
        rng = np.random.default_rng(seed)
        ranges = [RANGES[k] for k in rng.integers(len(RANGES), size=INPUTS)]
        element = calculator(random_program(seed, 40), INPUTS, OUTPUTS)
        graph = lifted(element, dtype, passes=()) if seed % 2 else lifted(element, dtype)
        pixels = samples(ranges, 200, seed, dtype)
        assert_contained(graph, analyse(graph, ranges), pixels, ENVIRONMENTS[seed % 3], f"program {seed}")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", ["fogra39_gloss/mvis", "fogra39_gloss/colour-mid", "ward_painting/mvis"])
def test_shipped_programs_are_contained(name, dtype):
    profile = read_profile(folder("profiles") / f"{name}.icc")
    element = profile["A2M0" if "A2M0" in profile else "M2B0"].elements[-1]
    ranges = [(-4, 4)] * element.inputs if "mvis" in name else [(0, 2)] * 3 + [(-1, 1)] * 3
    graph = lifted(element, dtype, passes=())
    analysis = analyse(graph, ranges)
    assert not analysis.hazards
    pixels = samples(ranges, 2000, 1, dtype)
    for env in ({}, {"litX": 1.0, "litZ": 1e-7}, {"litX": -0.6, "litZ": -0.8, "vueX": 0.6, "vueZ": 0.8}):
        assert_contained(graph, analysis, pixels, env)


# Single operators ---------------------------------------------------------------------------------------

ENDS = [-INF, -3e38, -1e10, -720.5, -3.0, -1.5, -1.0, -0.5, -1e-5, -1e-40, 0.0, 1e-45, 1e-3, 0.25, 1.0, 1.5,
        2.0, 2.5, 7.0, 88.0, 1e5, 3e9, 3e38, INF]  # fmt: skip


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("op", sorted(intervals._OPERATORS))
def test_operators_stay_in_their_intervals(op, dtype):
    arithmetic = Arithmetic(dtype)
    rng = np.random.default_rng(len(op))
    takes = OPERATORS[op].pops(0, 0)
    truths = op in ("not", "vand", "vor", "vxor")
    with np.errstate(all="ignore"):
        ends = np.array(ENDS, dtype)
        for _ in range(150):
            operands, values = [], []
            for _ in range(takes):
                low, high = sorted(rng.integers(2, size=2)) if truths else np.sort(rng.choice(ends, 2))
                nan = not truths and rng.random() < 0.2
                operands.append(Interval(float(low), float(high), nan))
                inside = np.concatenate([[low, high], ends[(low <= ends) & (ends <= high)], [0, -0.0, 0.5]])
                inside = rng.choice(np.clip(inside, low, high), 60)
                values.append(np.where(nan & (rng.random(60) < 0.2), np.nan, inside).astype(dtype))
            result = arithmetic.apply(op, *operands)
            found = meaning(op)(*values)
            number = found[~np.isnan(found)]
            assert result.nan or len(number) == len(found), (op, operands, result)
            outside = (number < result.low) | (number > result.high)
            assert not outside.any(), (op, operands, result, number[outside])


@pytest.mark.parametrize(
    ("op", "operands", "expected"),
    [
        ("add", [(1, 2), (3, 5)], (4, 7)),
        ("sub", [(1, 2), (3, 5)], (-4, -1)),
        ("mul", [(-1, 2), (3, 5)], (-5, 10)),
        ("div", [(1, 2), (4, 8)], (0.125, 0.5)),
        ("sqrt", [(4, 9)], (2, 3)),
        ("abs", [(-3, 2)], (0, 3)),
        ("mod", [(-5, 7), (2, 3)], (-3, 3)),
        ("mod", [(1, 2), (5, 6)], (1, 2)),
        ("vmin", [(0, 4), (1, 3)], (0, 3)),
        ("vmax", [(0, 4), (1, 3)], (1, 4)),
        ("flor", [(-1.5, 1.5)], (-2, 1)),
        ("rond", [(-1.5, 1.4)], (-2, 1)),
        ("trnc", [(-1.5, 1.5)], (-1, 1)),
        ("sign", [(0.5, 2)], (1, 1)),
        ("lt", [(0, 1), (2, 3)], (1, 1)),
        ("ge", [(0, 1), (1, 3)], (0, 1)),
        ("eq", [(0, 1), (2, 3)], (0, 0)),
        ("vxor", [(1, 1), (0, 1)], (0, 1)),
    ],
)
def test_intervals_of_exact_operators_are_as_narrow_as_they_can_be(op, operands, expected):
    result = Arithmetic(np.float32).apply(op, *(Interval(*map(float, ends)) for ends in operands))
    assert result == Interval(*expected)


@pytest.mark.parametrize(
    ("op", "operands", "expected"),
    [
        ("exp", [(-1e30, 0)], (0, 1)),
        ("exp", [(-1e30, -500)], (0, 0)),
        ("pow", [(2, 3), (-1, 2)], (1 / 3, 9)),
        ("pow", [(-2, 1), (2, 2)], (0, 4)),
        ("pow", [(-2, 1), (3, 3)], (-8, 1)),
        ("sin", [(0, 3)], (0, 1)),
        ("cos", [(1, 4)], (-1, math.cos(1))),
        ("tan", [(-1, 1)], (-math.tan(1), math.tan(1))),
        ("atn2", [(1, 2), (-1, 1)], (-math.pi / 4, math.pi / 4)),
        ("atn2", [(-1, 1), (1, 2)], (math.pi / 4, 3 * math.pi / 4)),
        ("atn2", [(-1, 1), (0, 2)], (-math.pi, math.pi)),
        ("acos", [(-1, 0.5)], (math.acos(0.5), math.pi)),
        ("ln", [(1, 2)], (0, math.log(2))),
    ],
)
def test_intervals_of_functions_are_narrow(op, operands, expected):
    with np.errstate(all="ignore"):
        result = Arithmetic(np.float32).apply(op, *(Interval(*map(float, ends)) for ends in operands))
    assert not result.nan
    assert result[:2] == pytest.approx(expected, rel=3e-6, abs=3e-6)
    assert result.low <= np.float32(expected[0])
    assert np.float32(expected[1]) <= result.high


def test_meeting_and_joining():
    a, b = Interval(0, 2, True), Interval(1, 3)
    assert a.meet(b) == Interval(1, 2)
    assert a.join(b) == Interval(0, 3, True)
    assert Interval(0, 1).meet(Interval(2, 3)).empty
    assert Interval.point(math.nan).holds(5)
    assert a.holds(math.nan)
    assert not b.holds(math.nan)


# Tables and curves --------------------------------------------------------------------------------------


def curve_of(*formulas, points=()):
    return SegmentedCurve(points, tuple(formulas))


LINEAR = FormulaSegment(0, (1, 1, 0, 0))
CURVES = {
    "gamma": curve_of(FormulaSegment(0, (1, 0, 0, 0)), FormulaSegment(0, (2.2, 1, 0, 0)), points=(0,)),
    "samples": curve_of(LINEAR, SampledSegment(np.array([3, -1, 0.5])), LINEAR, points=(-0.5, 1)),
    "clipped": SampledCurve(-1, 1, 0, np.array([0.0, 5, -2, 1])),
    "extended": SampledCurve(-1, 1, 1, np.array([0.0, 5, -2, 1])),
    **{
        f"type {n}": curve_of(FormulaSegment(n, parameters))
        for n, parameters in {
            1: (1.5, 2, 0.5, 2, 1), 2: (2, 1.5, -1, 0.5, 3), 3: (1.8, 2, 1.5, 0.25, -1),
            4: (2, 1, -1, 0.5, 2), 5: (2, 1, 2, 1, 0.5, 3), 6: (2, 2, 0.1, 5, 0.5, 1, 2),
            7: (2, 2, 1, 2, 0.5, 1),
        }.items()
    },
}  # fmt: skip


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("ends", [(-2, 2), (0, 1), (0.2, 0.3), (-0.7, 0.1), (1, 1)])
def test_curves_stay_in_their_intervals(name, ends):
    curve = CURVES[name]
    x = np.linspace(*ends, 1001).astype(np.float32)
    with np.errstate(all="ignore"):
        result = curve_range(Arithmetic(np.float32), curve, Interval(*map(float, ends)))
        y = elements.apply_curve(curve, x, {})
    number = y[~np.isnan(y)]
    assert result.nan or len(number) == len(y)
    assert result.low <= number.min(initial=INF)
    assert number.max(initial=-INF) <= result.high
    if name in ("gamma", "clipped", "extended"):
        assert not result.nan
        assert result[:2] == pytest.approx((y.min(), y.max()), abs=2e-2)


def test_tables_are_narrow_where_their_inputs_are():
    table = np.zeros((5, 3, 2))
    table[..., 0] = np.arange(15).reshape(5, 3)
    table[4, :, 1] = 100
    inputs = [Interval(0.0, 0.4), Interval(-3.0, 0.5)]
    arithmetic = Arithmetic(np.float32)
    assert table_range(arithmetic, table, inputs, 0)[:2] == pytest.approx((0, 8), abs=1e-4)
    assert table_range(arithmetic, table, inputs, 1)[:2] == pytest.approx((0, 0), abs=1e-4)
    nan = [Interval(0.9, 1.0, True), Interval(0.0, 1.0)]
    assert table_range(arithmetic, table, nan, 1)[:2] == pytest.approx((0, 100), abs=1e-3)
    table[0, 0, 0] = np.nan
    assert table_range(arithmetic, table, inputs, 0).nan


# What is known of expressions ---------------------------------------------------------------------------


def outputs_of(text, ranges, variables=None, *, count=1, dtype=np.float32, **options):
    """The hazards of a program, by kind and operator, and the intervals of its outputs."""
    graph = lifted(calculator(parse(text), len(ranges), count), dtype, passes=())
    analysis = analyse(graph, ranges, variables, **options)
    found = [(hazard.kind, hazard.node.op, hazard.guard) for hazard in analysis.hazards]
    return found, [analysis.ranges[output] for output in graph.outputs]


NORM = "in(0,3) sq(3) 1e-37 sum(4) sqrt"


@pytest.mark.parametrize(
    ("text", "ranges", "expected"),
    [
        ("in(0) in(0) mul out(0)", [(-2, 1)], (0, 4)),
        (f"in(0) {NORM} div out(0)", [(-5, 5)] * 3, (-1, 1)),
        (f"in(0) {NORM} 0.01 add div out(0)", [(-5, 5)] * 3, (-1, 1)),
        (f"in(0,3) {NORM} sdiv(3) in(3,3) in(3,3) sq(3) 1e-37 sum(4) sqrt sdiv(3) "
         "mul(3) sum(3) out(0)", [(-5, 5)] * 6, (-1, 1)),
        ("in(0) sq in(0) sq in(1) sq 1 sum(3) div out(0)", [(-5, 5)] * 2, (0, 1)),
        ("in(0) in(0) in(1) vmax div out(0)", [(1, 5), (0, 9)], (1 / 9, 1)),
        ("in(0) in(0,2) vmin div out(0)", [(1, 5), (1, 9)], (1, 5)),
        ("in(0,3) 2 3 4 mul(3) sum(3) in(0,3) sum(3) div out(0)", [(0.1, 5)] * 3, (2, 4)),
        ("in(0,3) in(0,3) sum(3) sdiv(3) -2 3 4 mul(3) sum(3) out(0)", [(0.1, 5)] * 3, (-1.953333, 4)),
        ("in(0) in(1) sq add in(0) sub out(0)", [(-5, 5)] * 2, (0, 35)),
        ("in(0) 0 gt if { in(0) } else { 3 } out(0)", [(-5, 5)], (0, 5)),
        ("in(0) abs 1 ge if { 1 in(0) div } else { 0 } out(0)", [(0, 5)], (0, 1)),
        ("in(0) 1 lt not in(0) 2 gt not vand if { in(0) } else { 1 } out(0)", [(-5, 5)], (1, 2)),
        ("in(0) 1 gt if { 1 } else { 0 } 0.5 ge if { in(0) } else { 2 } out(0)", [(-5, 5)], (1, 5)),
        ("env(litX) if { } else { pop 7 } out(0)", [(0, 1)], (-1000, 1000)),
    ],
)  # fmt: skip
def test_values_of_expressions_whose_operands_depend_on_each_other(text, ranges, expected):
    hazards, (value,) = outputs_of(text, ranges)
    assert not hazards
    assert value.low == pytest.approx(expected[0], abs=2e-5)
    assert value.high == pytest.approx(expected[1], rel=2e-5)


DECIDED = (
    "1 in(0) 0.5 gt if {{ in(1) }} else {{ {otherwise} }} in(0) 0.5 gt if {{ 1 }} else {{ in(1) }} add "
    + "".join(f"in(2) {k} gt in({i}) mul add " for k in range(5) for i in (3, 4, 5))
    + "div out(0)"
)
"""One condition decides, five others are only counted, and more often."""
EXISTENCE = "1 in(0) in(0,3) min(3) le in(1) in(0,3) min(3) le in(2) in(0,3) min(3) le sum(3) div out(0)"


@pytest.mark.parametrize(
    ("text", "ranges"),
    [
        # A quotient of what grows and an exponential that shrinks faster.
        ("in(0) 1 add sq in(0) 1e-8 div neg exp mul out(0)", [(0, 1e18)]),
        # One of three is the least of them.
        (EXISTENCE, [(-5, 5)] * 3),
        (DECIDED.format(otherwise=1), [(0, 1), (0, 1), (0, 5), (0, 1), (0, 1), (0, 1)]),
        # A condition as a number keeps a sum from 0.
        ("1 in(0) in(0) 0.5 lt add div out(0)", [(0, 5)]),
        # x^2 - x + 1 has no root.
        ("1 in(0) sq in(0) sub 1 add div out(0)", [(-4, 4)]),
        # What is done only where it can be.
        ("in(0) in(1) in(1) abs 1e-9 gt if { div } else { add } out(0)", [(-1, 1), (-2, 2)]),
        ("in(0) rnum if { in(0) } else { 0 } out(0)", [(-1, 1)]),
        ("in(0) 0 neq if { 1e-30 in(0) sq 1e-9 add div } else { 0 } out(0)", [(-1, 1)]),
    ],
)
def test_programs_that_cannot_fail_are_seen_not_to(text, ranges):
    hazards, (value,) = outputs_of(text, ranges)
    assert not hazards
    assert value.finite


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_same_programs_without_their_guards_are_not(dtype):
    for text, ranges in [
        ("in(0) 1 add sq in(0) mul out(0)", [(0, 1e150)]),
        ("1 in(0) in(1) lt in(1) in(0) lt add div out(0)", [(-5, 5)] * 2),
        ("1 in(0) sq in(0) sub 0.25 add div out(0)", [(-4, 4)]),
        ("in(0) in(1) in(1) abs 1e-9 lt if { div } else { add } out(0)", [(-1, 1), (-2, 2)]),
        ("1 in(0) in(0) sq 1 sub 0 mul add div out(0)", [(-4, 4)]),
        (DECIDED.format(otherwise=0), [(0, 1), (0, 1), (0, 5), (0, 1), (0, 1), (0, 1)]),
    ]:
        assert outputs_of(text, ranges, dtype=dtype)[0], text


def test_variables():
    text = "env(a) pop out(0)"
    assert outputs_of(text, [(0, 1)])[1] == [Interval(-1000, 1000)]
    assert outputs_of(text, [(0, 1)], {"a": (2, 3)})[1] == [Interval(2, 3)]
    assert outputs_of(text, [(0, 1)], others=(2, 3))[1] == [Interval(0, 3)]
    assert outputs_of(text, [(0, 1)], others=None)[1] == [Interval(0, 0)]
    guarded = "env(a) if { -1 pow } else { pop 1 } out(0)"
    assert outputs_of(guarded, [(0, 1)], {"a": (2, 4)})[1][0][:2] == pytest.approx((0.25, 0.5), rel=1e-5)


def test_long_programs_need_no_recursion():
    text = "in(0) " + "abs neg 1 add " * 1000 + "out(0)"
    hazards, (value,) = outputs_of(text, [(-1, 1)])
    assert not hazards
    assert value == Interval(0, 1)


def test_selects_in_a_row_do_not_multiply():
    step = "copy(1,1) 0.5 gt if { 0.9 mul } else { 0.3 add } "
    hazards, (value,) = outputs_of("in(0) " + step * 60 + "out(0)", [(0, 1)])
    assert not hazards
    assert value.low >= 0.3 - 1e-6
    assert value.high <= 0.9 + 1e-6


def test_large_graphs_are_analysed_without_contexts(monkeypatch):
    monkeypatch.setattr(ranges_module, "MAX_CONTEXTUAL", 5)
    text = "in(0) 0 gt if { 1 in(0) div } else { 0 } out(0)"
    assert outputs_of(text, [(-1, 1)])[0] == [("division", "div", "divide only where abs(x) > 2e-38")]
    assert outputs_of("in(0) 2 mul out(0)", [(-1, 1)])[1] == [Interval(-2, 2)]


# Hazards ------------------------------------------------------------------------------------------------

GUARDS = [
    ("1 in(0) div out(0)", [(0, 1)], "division", "max(x, 2e-38)", "1 in(0) 2e-38 vmax div out(0)"),
    ("9 in(0) div out(0)", [(0, 1)], "division", "max(x, 3e-38)", "9 in(0) 3e-38 vmax div out(0)"),
    ("1 in(0) div out(0)", [(-1, 0)], "division", "min(x, -2e-38)", "1 in(0) -2e-38 vmin div out(0)"),
    ("1 in(0) div out(0)", [(-1, 1)], "division", "divide only where abs(x) > 2e-38",
     "in(0) abs 2e-38 gt if { 1 in(0) div } else { 0 } out(0)"),
    ("in(0) -2 pow out(0)", [(0, 1)], "division", "max(x, 6e-20)", "in(0) 6e-20 vmax -2 pow out(0)"),
    ("in(0) sqrt out(0)", [(-1, 1)], "domain", "max(x, 0)", "in(0) 0 vmax sqrt out(0)"),
    ("in(0) ln out(0)", [(0, 1)], "domain", "max(x, 2e-38)", "in(0) 2e-38 vmax ln out(0)"),
    ("in(0) log out(0)", [(-1, 1)], "domain", "max(x, 2e-38)", "in(0) 2e-38 vmax log out(0)"),
    ("in(0) acos out(0)", [(-1, 1.5)], "domain", "min(max(x, -1), 1)", "in(0) -1 vmax 1 vmin acos out(0)"),
    ("in(0) 0.5 pow out(0)", [(-1, 1)], "domain", "max(x, 0)", "in(0) 0 vmax 0.5 pow out(0)"),
    ("in(0) exp out(0)", [(0, 100)], "overflow", "min(x, 88)", "in(0) 88 vmin exp out(0)"),
    ("in(0) sq out(0)", [(0, 1e20)], "overflow", "min(x, 1.8e19)", "in(0) 1.8e19 vmin sq out(0)"),
    ("in(0) 1e10 mul out(0)", [(-1e30, 1)], "overflow", "max(x, -3.3e28)",
     "in(0) -3.3e28 vmax 1e10 mul out(0)"),
    ("1e30 in(0) div out(0)", [(1e-12, 1)], "overflow", "max(x, 3e-9)", "1e30 in(0) 3e-9 vmax div out(0)"),
    ("in(1) in(0) div out(0)", [(1e-12, 1), (0, 1e30)], "overflow", "min(x, 3.3e26)",
     "in(1) 3.3e26 vmin in(0) div out(0)"),
    ("in(0) in(1) add out(0)", [(0, 2e38), (0, 1.5e38)], "overflow", "min(x, 1.6e38)",
     "in(0) 1.6e38 vmin in(1) add out(0)"),
    ("2 in(0) mul out(0)", [(-1, 2e38)], "overflow", "min(x, 1.6e38)", "2 in(0) 1.6e38 vmin mul out(0)"),
    ("in(0) rond out(0)", [(0, 1e10)], "overflow", "min(x, 2.1e9)", "in(0) 2.1e9 vmin rond out(0)"),
    ("in(0) 5 pow out(0)", [(0, 1e9)], "overflow", "min(x, 5e7)", "in(0) 5e7 vmin 5 pow out(0)"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "ranges", "kind", "guard", "guarded"), GUARDS)
def test_hazards_name_the_smallest_guard(text, ranges, kind, guard, guarded):
    ((found, _, named),) = outputs_of(text, ranges)[0]
    assert (found, named) == (kind, guard)
    assert outputs_of(guarded, ranges)[0] == []


def test_what_follows_from_a_hazard_is_not_one():
    hazards, (value,) = outputs_of("in(0) sqrt 2 mul in(1) div ln out(0)", [(-1, 1), (1, 2)])
    assert [hazard[:2] for hazard in hazards] == [("domain", "sqrt")]
    assert value.nan


def test_outputs_that_are_not_finite_by_themselves():
    hazards, _ = outputs_of("+INF out(0)", [(0, 1)])
    assert [hazard[0] for hazard in hazards] == ["output"]


def test_expressions():
    graph = lifted(
        calculator(parse("in(0) env(litX) pop add in(1) sqrt vmax 0.5 div out(0)"), 2, 1), passes=()
    )
    (output,) = graph.outputs
    assert expression(output, ("a", "b")) == "(max((a + litX), sqrt(b)) / 0.5)"
    assert expression(output, depth=1) == "(... / 0.5)"
