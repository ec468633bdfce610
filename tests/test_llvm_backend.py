"""The LLVM back end against the interpreter: programs, profiles, branches, tables, memory, threads."""

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from calc_programs import INPUTS, OUTPUTS, random_program
from graph_examples import SPECIALS, calculator, hard_pixels, interpreted, same_bits, scheduled, walk
from hypothesis import given, settings
from hypothesis import strategies as st
from icc_examples import conformance_profiles
from llvm_examples import POSSIBLE, run, ulps_apart

from iccbrdf import read_profile
from iccbrdf.calc.elements import apply
from iccbrdf.calc.graph import LOGIC, TRUTHS, Graph
from iccbrdf.calc.llvm import codegen, compile_llvm, engine, operands, order, target, wide
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.program import parse
from iccbrdf.calc.schedule import Branch, Schedule, computed, schedule, uniform_values
from iccbrdf.errors import UnsupportedError, UsageError
from iccbrdf.icc import (
    Clut,
    CurveSet,
    FormulaSegment,
    Profile,
    SampledCurve,
    SampledSegment,
    SegmentedCurve,
    TintArray,
)
from iccbrdf.resources import folder

ENVIRONMENTS = ({}, {"litX": 0.75}, {"litX": -0.0, "a": float("nan")})
MODELS = ("fogra39_gloss/mvis", "fogra39_gloss/colour-mid", "landscape/mvis", "ward_painting/mvis")

widths = pytest.mark.parametrize("width", POSSIBLE)
dtypes = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def plan_of(text, inputs=2, outputs=1, dtype=np.float32, elements=()):
    return scheduled(calculator(parse(text), inputs, outputs, elements), dtype)


@pytest.fixture
def rounded_once(monkeypatch):
    """The C library's functions in float64, so that nothing but the code around them can differ."""

    def library(name):
        return lambda *values: values[0].code.each_lane(name, *values)

    monkeypatch.setattr(codegen, "_PLAIN", {})
    names = {"ln": "log", "log": "log10"}
    for op in ("exp", "ln", "log", "sin", "cos", "tan", "asin", "acos", "atan", "cbrt", "pow"):
        monkeypatch.setitem(codegen._SINGLE, op, library(names.get(op, op)))
    monkeypatch.setitem(codegen._SINGLE, "atn2", lambda x, y: x.code.each_lane("atan2", y, x))
    monkeypatch.setattr(
        wide, "known_power", lambda x, y: x.code.each_lane("pow", x, x.code.constant(y, x.type))
    )


# Programs ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", range(0, 120, 40))
def test_random_programs(first, rounded_once):
    compared = 0
    for seed in range(first, first + 40):
        element = calculator(random_program(seed, 40), INPUTS, OUTPUTS)
        plan = scheduled(element)
        if any(node.op == "solve" for node in computed(plan.body)):
            continue
        pixels = hard_pixels(64, INPUTS, np.float32, seed)
        env = ENVIRONMENTS[seed % 3]
        assert same_bits(run(plan, pixels, env), interpreted(element, pixels, env)), seed
        compared += 1
    assert compared > 25


EXACT = (
    "add", "sub", "mul", "div", "mod", "vmin", "vmax", "neg", "abs", "sqrt", "flor", "trnc", "rond", "sign",
    "lt", "le", "ge", "gt", "rnum", "not", "vand", "vor", "vxor", "select", "select",
)  # fmt: skip
DRAWN_NODES = st.tuples(st.sampled_from(EXACT), *[st.integers(0, 1000)] * 3)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(DRAWN_NODES, min_size=1, max_size=60),
    st.lists(st.integers(0, 1000), min_size=1, max_size=6),
    st.sampled_from([np.float32, np.float64]),
    st.sampled_from(POSSIBLE),
    st.integers(0, 100),
)
def test_random_graphs(drawn, outputs, dtype, width, seed):
    graph = Graph(dtype=dtype)
    numbers = [graph.input(i) for i in range(3)]
    numbers += [graph.number(value) for value in (0.0, -0.0, 0.3, np.nan, -np.inf)]
    numbers.append(graph.add("variable", detail="litX"))
    truths = [graph.add("defined", detail="litX"), graph.apply("lt", numbers[0], numbers[1])]
    for op, *places in drawn:
        takes = 3 if op == "select" else OPERATORS[op].pops(0, 0)
        pools = [truths if op in LOGIC else numbers + truths] * takes
        if op == "select":
            pools[0] = truths
        node = graph.apply(op, *(pool[place % len(pool)] for pool, place in zip(pools, places, strict=False)))
        (truths if op in TRUTHS else numbers).append(node)
    both = numbers + truths
    # The last ones are made of the most others.
    graph.outputs = tuple(both[-1 - place % len(both)] for place in outputs)
    plan = schedule(graph, 3)
    pixels = hard_pixels(40, 3, dtype, seed)
    for env in ENVIRONMENTS[:2]:
        assert same_bits(run(plan, pixels, env, width), walk(plan, pixels, env))


@widths
@dtypes
def test_products_and_sums_are_rounded_apart(dtype, width):
    plan = plan_of("in[0] in[1] mul in[2] add out[0] in[2] in[0] in[1] mul sub out[1]", 3, 2, dtype)
    pixels = np.random.default_rng(5).normal(size=(5000, 3)).astype(dtype)
    pixels[:, 2] = -pixels[:, 0] * pixels[:, 1]
    a, b, c = pixels.T
    assert same_bits(run(plan, pixels, width=width), np.stack([a * b + c, c - a * b], axis=1))


@widths
@pytest.mark.parametrize("name", MODELS)
def test_shipped_profiles(name, width):
    profile = read_profile(folder("profiles") / f"{name}.icc")
    element = profile["A2M0" if "A2M0" in profile else "M2B0"].elements[-1]
    rng = np.random.default_rng(1)
    pixels = rng.uniform(0, 1, (3000, element.inputs)).astype(np.float32)
    pixels[:, -3:] = rng.normal([0.5, 0.5, 1.0], 0.1, (3000, 3))
    for env in ({}, {"litX": 0.3, "litZ": 0.1, "vueX": -0.4}):
        expected = interpreted(element, pixels, env)
        assert np.isfinite(expected).all()
        found = run(scheduled(element), pixels, env, width)
        np.testing.assert_allclose(found, expected, rtol=2e-6, atol=1e-7)
    exact = interpreted(element, pixels.astype(np.float64))
    found = run(scheduled(element, np.float64), pixels.astype(np.float64), width=width)
    np.testing.assert_allclose(found, exact, rtol=1e-12, atol=1e-14)


@pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")
def test_conformance_cases(rounded_once):
    compared = 0
    for name, data in conformance_profiles():
        profile = Profile.from_bytes(data, name)
        (element,) = profile["A2M0"].elements
        plan = scheduled(element)
        if any(node.op == "solve" for node in computed(plan.body)):
            continue
        pixels = hard_pixels(100, element.inputs)
        found = run(plan, pixels, ENVIRONMENTS[1])
        assert same_bits(found, interpreted(element, pixels, ENVIRONMENTS[1])), name
        compared += 1
    assert compared > 20


@pytest.mark.parametrize(("terms", "called"), [(10, False), (300, True)])
def test_long_programs(terms, called):
    """Functions are written out where they are used, or called where they are many."""
    graph = Graph(dtype=np.float32)
    x, y = graph.input(0), graph.input(1)
    total = graph.number(0.0)
    for number in range(terms):
        angle = graph.apply("add", graph.apply("mul", x, graph.number(number)), y)
        wave = graph.apply("exp", graph.apply("sin", angle))
        root = graph.apply("cbrt", graph.apply("add", wave, graph.apply("atn2", x, angle)))
        total = graph.apply("add", total, graph.apply("vmax", root, y))
    graph.outputs = (total,)
    plan = schedule(graph, 2)
    assert ("call fastcc" in codegen.assemble(plan, target.host()).text) == called
    pixels = np.random.default_rng(2).uniform(0.1, 1, (100, 2)).astype(np.float32)
    np.testing.assert_allclose(run(plan, pixels), walk(plan, pixels), rtol=1e-4)


@widths
def test_code_made_with_less_care(width, monkeypatch, rounded_once):
    monkeypatch.setattr(engine, "LARGE", 0)
    for seed in range(0, 40, 3):
        plan = scheduled(calculator(random_program(seed, 60), INPUTS, OUTPUTS))
        if not any(node.op == "solve" for node in computed(plan.body)):
            pixels = hard_pixels(40, INPUTS, np.float32, seed)
            assert same_bits(run(plan, pixels, width=width), walk(plan, pixels)), seed


# What is left out, and in which order ---------------------------------------------------------------------


@widths
@dtypes
@pytest.mark.parametrize(("least", "greatest", "factor", "skipped"), [
    (1e-30, 1e15, 0.7, (True, True)), (1e-30, 1e15, -0.7, (True, False)), (1e-30, 1e15, 1e300, (True, False)),
    (1e-30, np.inf, 0.7, (False, False)), (0.0, 1e15, 0.7, (False, False)), (-1.0, 1e15, 0.7, (False, False)),
])  # fmt: skip
def test_sums_of_what_conditions_choose(least, greatest, factor, skipped, dtype, width):
    """What is not chosen is skipped where 0 times it changes nothing: not if it may be infinite or -0."""
    graph = Graph(dtype=dtype)
    x = [graph.input(i) for i in range(4)]
    w = [graph.apply("vmax", each, graph.number(least)) for each in x]
    w = [graph.apply("vmin", each, graph.number(greatest)) for each in w]
    place, total, weighted = graph.number(0.0), w[0], graph.apply("mul", w[0], graph.number(factor))
    for i in range(1, 4):
        taken = graph.apply("lt", x[i], x[0])
        place = graph.apply("add", place, taken)
        part = graph.apply("mul", taken, w[i])
        total = graph.apply("add", part, total)
        weighted = graph.apply("add", weighted, graph.apply("mul", part, graph.number(factor)))
    graph.outputs = (place, total, weighted, graph.apply("mul", graph.apply("gt", x[1], x[2]), w[3]))
    plan = schedule(graph, 4)
    known = operands.Operands(plan)
    assert tuple(known.masked(node) is not None for node in graph.outputs[:3]) == (True, *skipped)
    pixels = hard_pixels(1000, 4, dtype)
    assert same_bits(run(plan, pixels, width=width), walk(plan, pixels))


def in_order(block, done):
    """Whether each node comes after what it reads; `done` grows."""
    for item in block:
        if isinstance(item, Branch):
            if item.condition not in done or not in_order(item.yes, done) or not in_order(item.no, done):
                return False
            done.update(item.selects)
        else:
            if not done.issuperset(item.arguments):
                return False
            done.add(item)
    return True


@pytest.mark.parametrize("name", MODELS)
def test_the_order_is_of_all_nodes_each_after_what_it_reads(name):
    profile = read_profile(folder("profiles") / f"{name}.icc")
    plan = scheduled(profile["A2M0" if "A2M0" in profile else "M2B0"].elements[-1])
    known = {node for node in plan.graph.nodes if node.op == "const"} | set(plan.arguments)
    for block in (plan.body, order.in_turn(plan.body, lambda node: node.arguments)):
        done = set(known)
        assert in_order(block, done)
        assert done - known == set(computed(plan.body))


def test_long_chains_of_conditions_and_sums_are_no_harm():
    graph = Graph(dtype=np.float32)
    condition = graph.apply("lt", graph.input(0), graph.input(1))
    total = graph.apply("add", condition, condition)
    for number in range(3000):
        condition = graph.apply("vand", condition, graph.apply("gt", graph.input(0), graph.number(-number)))
        total = graph.apply("add", total, total) if number < 100 else graph.apply("add", total, condition)
    graph.outputs = (total, condition)
    plan = schedule(graph, 2)
    pixels = hard_pixels(64, 2)
    assert same_bits(run(plan, pixels), walk(plan, pixels))


# Branches ----------------------------------------------------------------------------------------------

NESTED = """
    in[0] 0 gt
    if { in[1] sqrt exp in[0] 1 gt if { sin tan in[0] div } else { asin acos atan } }
    else { in[0] neg ln in[1] cbrt mul sqrt }
    out[0]
"""


@widths
@pytest.mark.parametrize(
    "first",
    [[2.0, 2.0], [0.5, 0.5], [-1.0, -1.0], [np.nan, -1.0], [2.0, 0.5], [2.0, -1.0], [2.0, -1.0, 0.5]],
)
def test_sides_of_branches(first, width, rounded_once):
    plan = plan_of(NESTED)
    assert any(isinstance(item, Branch) for item in plan.body)
    pixels = np.array([np.resize(first, 35), np.full(35, 0.3)], np.float32).T
    assert same_bits(run(plan, pixels, width=width), walk(plan, pixels))


def test_a_side_that_no_pixel_takes_is_jumped_over(monkeypatch):
    """A table outside the memory of the process would be read otherwise."""
    graph = Graph(dtype=np.float32)
    x = graph.input(0)
    positive = graph.apply("gt", x, graph.number(0.0))
    tint = graph.add("tint", [x], TintArray.of([[0.0], [1.0]]))
    inside = graph.pick(tint, 0)
    chosen = graph.apply("select", positive, inside, x)
    graph.outputs = (chosen,)
    plan = Schedule(graph, 1, (), (), (x, positive, Branch(positive, (tint, inside), (), (chosen,))))
    kernel = compile_llvm(plan)
    kernel._addresses[:] = 8
    pixels = -np.ones((64, 1), np.float32)
    out = np.empty_like(pixels)
    kernel.run(pixels, out, ())
    assert (out == -1).all()


def test_selects_of_a_branch_take_constants_and_conditions():
    graph = Graph(dtype=np.float64)
    x = graph.input(0)
    one, zero = graph.number(1.0), graph.number(0.0)
    positive, large = graph.apply("gt", x, zero), graph.apply("gt", x, one)
    heavy, test = graph.apply("sqrt", x), graph.apply("lt", graph.apply("mul", x, x), one)
    selects = [
        graph.apply("select", positive, *sides)
        for sides in ([heavy, zero], [test, one], [large, one], [one, x], [x, x], [one, zero])
    ]
    graph.outputs = (*selects, large)
    body = (x, positive, large, Branch(positive, (heavy, test.arguments[0], test), (), tuple(selects)))
    plan = Schedule(graph, 1, (one, zero), (), body)
    for column in ([2.0, 0.5], [-1.0, -0.0], [2.0, -1.0, np.nan]):
        pixels = np.array([column]).T
        assert same_bits(run(plan, pixels), walk(plan, pixels))


@pytest.mark.parametrize("env", [{}, {"litX": 2.0}])
def test_a_condition_of_the_whole_run(env, rounded_once):
    plan = plan_of("env(litX) if { in[0] sin exp sqrt add } else { in[0] add } out[0]")
    pixels = np.array([[0.1, 0.2], [0.7, np.nan]], np.float32)
    assert same_bits(run(plan, pixels, env), walk(plan, pixels, env))


# Tables and curves -------------------------------------------------------------------------------------


@widths
@dtypes
@pytest.mark.parametrize("shape", [(2, 1), (5, 3), (3, 4, 2), (4, 2, 3, 4), (2, 3, 2, 3, 9), (*(2,) * 6, 17)])
def test_look_up_tables(shape, dtype, width):
    rng = np.random.default_rng(3)
    table = Clut(rng.normal(size=shape).astype(np.float32))
    inputs, outputs = len(shape) - 1, shape[-1]
    plan = plan_of(f"in[0,{inputs}] clut(0) out[0,{outputs}]", inputs, outputs, dtype, [table])
    pixels = np.concatenate([hard_pixels(200, inputs, dtype), rng.uniform(0, 1, (200, inputs)).astype(dtype)])
    expected = np.stack(apply(table, list(pixels.T), dtype=dtype), axis=1)
    assert same_bits(run(plan, pixels, width=width), expected)


@dtypes
def test_tint_arrays(dtype):
    rows = TintArray.of(np.random.default_rng(3).normal(size=(6, 3)))
    plan = plan_of("in[0] tint(0) out[0,3]", 1, 3, dtype, [rows])
    pixels = np.concatenate([SPECIALS, np.linspace(-0.1, 1.1, 300)]).astype(dtype)[:, None]
    assert same_bits(run(plan, pixels), np.stack(apply(rows, [pixels[:, 0]], dtype=dtype), axis=1))


def formula(kind, *parameters):
    return FormulaSegment(kind, parameters)


def segmented(breakpoints, *segments):
    return SegmentedCurve(breakpoints, segments)


LINE = formula(0, 1.0, 0.5, 0.1, 0.0)
CURVES = {
    "gamma": segmented((), formula(0, 2.4, 0.9, 0.1, -0.05)),
    "whole power": segmented((), formula(0, 3.0, 0.9, 0.1, -0.05)),
    "inverse": segmented((), formula(0, -2.0, 0.9, 0.1, 0.5)),
    "logarithm": segmented((), formula(1, 1.2, 0.5, 0.9, 0.1, 0.2)),
    "exponential": segmented((), formula(2, 1.2, 2.5, 0.9, 0.1, 0.2)),
    "power from 0": segmented((), formula(3, 0.0, 2.5, 0.9, -0.1, 0.2)),
    "natural logarithm": segmented((), formula(4, 1.0, 0.18, 1.5, 0.2, 0.3)),
    "natural exponential": segmented((), formula(5, 1.0, 0.18, 0.3, 0.5, 1.2, 0.7)),
    "PQ": segmented((), formula(6, 6.277, 0.0127, 0.8359, 18.8516, 18.6875, 1.0, 1.0)),
    "HLG": segmented((), formula(7, 78.84, 0.1593, 0.8359, 18.8516, 18.6875, 1.0)),
    "three pieces": segmented((0.25, 0.75), LINE, formula(0, 2.2, 1.0, 0.0, 0.1), formula(2, 1, 2, 1, 0, 0)),
    "samples between": segmented((0.1, 0.75), LINE, SampledSegment([0.2, 0.7, 0.5]), LINE),
    "sampled, clipped": SampledCurve(0.0, 1.0, 0, [0.0, 0.3, 0.2, 1.0]),
    "sampled, going on": SampledCurve(-0.5, 2.0, 1, [0.0, 0.3, 0.2, 1.0]),
}


@dtypes
@pytest.mark.parametrize("name", CURVES)
def test_curves(name, dtype):
    curve = CURVES[name]
    graph = Graph(dtype=dtype)
    graph.outputs = (graph.add("curve", [graph.input(0)], curve),)
    rng = np.random.default_rng(9)
    values = [SPECIALS, [0.25, 0.75, 0.1], np.linspace(-1, 3, 801), 10 ** rng.uniform(-9, 9, 200)]
    pixels = np.concatenate(values).astype(dtype)[:, None]
    (expected,) = apply(CurveSet((curve,)), [pixels[:, 0]], dtype=dtype)
    apart = ulps_apart(run(schedule(graph, 1), pixels)[:, 0], expected)
    # Differences of nearly equal numbers magnify the last place of a float64; a float32 hides it.
    assert apart.max() <= (1 if dtype is np.float32 else 10_000)


def test_what_is_not_supported_is_named():
    with pytest.raises(UnsupportedError, match="solve"):
        compile_llvm(plan_of("in[0,2] in[0,2] in[0,2] solv(1,1) out[0,3]", 2, 3))
    large = Clut(np.zeros((2,) * 9 + (9,), np.float32))
    with pytest.raises(UnsupportedError, match="clut of 9 inputs"):
        compile_llvm(plan_of("in[0,9] clut(0) out[0,9]", 9, 9, elements=[large]))
    graph = Graph(dtype=np.float32)
    graph.outputs = (graph.add("curve", [graph.input(0)], large),)
    with pytest.raises(UnsupportedError, match="curve 'clut'"):
        compile_llvm(schedule(graph, 1))


# Memory, arguments, threads ----------------------------------------------------------------------------


@widths
@dtypes
@pytest.mark.parametrize("channels", [1, 2, 3, 4, 5, 7, 10, 17])
def test_rows_of_any_number_of_channels(channels, dtype, width):
    graph = Graph(dtype=dtype)
    graph.outputs = tuple(graph.input(channel) for channel in reversed(range(channels)))
    for count in (0, 1, 15, 16, 33):
        pixels = np.arange(count * channels, dtype=dtype).reshape(count, channels)
        assert np.array_equal(run(schedule(graph, channels), pixels, width=width), pixels[:, ::-1])


@widths
@pytest.mark.parametrize("outputs", [1, 2, 3, 5])
def test_channels_that_are_not_read(outputs, width):
    graph = Graph(dtype=np.float32)
    chosen = [9, 10, 0, 4, 9][:outputs]
    graph.outputs = tuple(graph.number(0.25) if i == 10 else graph.input(i) for i in chosen)
    pixels = np.random.default_rng(1).random((37, 11)).astype(np.float32)
    pixels[:, 10] = 0.25
    assert np.array_equal(run(schedule(graph, 11), pixels, width=width), pixels[:, chosen])


def test_neither_inputs_nor_outputs_are_overrun():
    graph = Graph(dtype=np.float32)
    graph.outputs = tuple(graph.apply("neg", graph.input(channel)) for channel in range(7))
    kernel = compile_llvm(schedule(graph, 7))
    for count in (1, 15, 16, 17, 48):
        pixels = np.ones((count, 7), np.float32)
        around = np.full((count + 64, 7), 5.0, np.float32)
        kernel.run(pixels, around[32 : count + 32], ())
        assert (around[32 : count + 32] == -1).all()
        assert (around[:32] == 5).all()
        assert (around[count + 32 :] == 5).all()


def test_memory_of_any_layout_and_type():
    plan = plan_of("in[0] in[1] sub out[0] in[1] out[1]", outputs=2)
    whole = np.arange(40.0).reshape(10, 4)
    for pixels in (
        whole[::2, 1:3],
        whole.astype(np.float32)[:, ::2],
        np.asfortranarray(whole)[:, 2:],
        whole.astype(int)[:, :2],
        whole[:, :2].astype(">f4"),
    ):
        large = np.full((2 * len(pixels), 5), -1.0, np.float32)
        compile_llvm(plan).run(pixels, large[::2, 1:4:2], ())
        assert (large[::2, 1] == pixels[:, 0] - pixels[:, 1]).all()
        assert (large[::2, 3] == pixels[:, 1]).all()
        assert (large[1::2] == -1).all()
        assert (large[:, [0, 2, 4]] == -1).all()


def test_another_light_needs_no_other_code():
    plan = plan_of("in[0] env(litX) if { mul } else { pop } out[0]")
    kernel = compile_llvm(plan)
    pixels = np.ones((5, 2), np.float32)
    for env, expected in (({"litX": 2.0}, 2.0), ({"litX": -3.0}, -3.0), ({}, 1.0)):
        out = np.empty((5, 1), np.float32)
        kernel.run(pixels, out, uniform_values(plan, env))
        assert (out == expected).all()


def test_equal_programs_share_code():
    def kernel(factor, *table):
        text = f"in[0] {factor} mul in[1] tint(0) out[0,2]"
        return compile_llvm(plan_of(text, 2, 2, elements=[TintArray.of(table)]))

    one, other, third = kernel(2.5, [0], [1]), kernel(2.5, [3], [4]), kernel(-2.5, [0], [1])
    assert one._code is other._code
    assert one._code is not third._code
    pixels = np.array([[2.0, 0.5]], np.float32)
    for kernel, expected in ((one, [5.0, 0.5]), (other, [5.0, 3.5]), (third, [-5.0, 0.5])):
        out = np.empty((1, 2), np.float32)
        kernel.run(pixels, out, ())
        assert out.tolist() == [expected]


def test_threads_share_a_kernel():
    plan = plan_of(NESTED)
    kernel = compile_llvm(plan)
    pixels = np.random.default_rng(4).uniform(-1, 2, (20 * 3000, 2)).astype(np.float32)
    out = np.empty((len(pixels), 1), np.float32)
    alone = run(plan, pixels)

    def part(start):
        kernel.run(pixels[start : start + 3000], out[start : start + 3000], ())

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(part, range(0, len(pixels), 3000)))
    assert same_bits(out, alone)


def test_other_threads_go_on_while_a_kernel_runs():
    plan = plan_of("in[0] sin cos tan exp sin cos tan exp out[0]", 1)
    kernel = compile_llvm(plan)
    pixels = np.full((2_000_000, 1), 0.5, np.float32)
    out = np.empty_like(pixels)
    worker = threading.Thread(target=kernel.run, args=(pixels, out, ()))
    steps = 0
    worker.start()
    while worker.is_alive():
        steps += 1
    assert steps > 100


# What it needs -----------------------------------------------------------------------------------------


def test_a_width_that_the_processor_lacks():
    with pytest.raises(UsageError, match="vectors of 5 numbers, expected 4"):
        compile_llvm(plan_of("in[0] out[0]"), width=5)


def test_llvmlite_is_missing(monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(target, "import_module", missing)
    with pytest.raises(UnsupportedError, match=r"pip install 'iccbrdf\[fast\]'"):
        target.binding()
