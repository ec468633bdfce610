"""The NumPy back end against the interpreter: programs, profiles, branches, tiles, threads."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from calc_programs import INPUTS, OUTPUTS, random_program
from graph_examples import calculator, hard_pixels, interpreted, same_bits, scheduled, walk
from hypothesis import given, settings
from hypothesis import strategies as st
from icc_examples import conformance_profiles

from iccbrdf import read_profile
from iccbrdf.calc import numpy_functions
from iccbrdf.calc.buffers import Code, allocate
from iccbrdf.calc.graph import LOGIC, TRUTHS, Graph
from iccbrdf.calc.numpy_backend import compile_numpy
from iccbrdf.calc.numpy_lowering import lower
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.program import parse
from iccbrdf.calc.schedule import Branch, Schedule, schedule, uniform_values
from iccbrdf.icc import Clut, CurveSet, Profile, SampledCurve, TintArray
from iccbrdf.resources import folder

ENVIRONMENTS = ({}, {"litX": 0.75}, {"litX": -0.0, "a": float("nan")})
MODELS = ("fogra39_gloss/mvis", "fogra39_gloss/colour-mid", "landscape/mvis", "ward_painting/mvis")
TILE = 1 << 14


def run(plan, pixels, env=None):
    out = np.empty((len(pixels), len(plan.graph.outputs)), plan.graph.dtype)
    compile_numpy(plan).run(pixels, out, uniform_values(plan, env or {}))
    return out


def plan_of(text, inputs=2, outputs=1, dtype=np.float32):
    return scheduled(calculator(parse(text), inputs, outputs), dtype)


@pytest.fixture
def rounded_once(monkeypatch):
    """Functions as the definition has them, so that nothing but the code around them can differ."""

    def define(op):
        def function(*operands):
            *arguments, out = operands
            np.copyto(out, OPERATORS[op].function(*(np.asarray(a)[()] for a in arguments)))

        return function

    for op in ("exp", "log", "ln", "sin", "cos", "tan"):
        monkeypatch.setitem(numpy_functions.NUMBERS, op, define(op))
    for op in ("pow", "atn2", "atan", "asin", "acos", "cbrt"):
        function = define(op)
        monkeypatch.setitem(
            numpy_functions.MADE, op, lambda code, *reads, function=function: code.do(function, *reads)
        )


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("first", range(0, 150, 30))
def test_random_programs(first, dtype, rounded_once):
    for seed in range(first, first + 30):
        element = calculator(random_program(seed, 40), INPUTS, OUTPUTS)
        plan = scheduled(element, dtype)
        pixels = hard_pixels(64, INPUTS, dtype, seed)
        env = ENVIRONMENTS[seed % 3]
        assert same_bits(run(plan, pixels, env), interpreted(element, pixels, env)), seed


EXACT = (
    "add", "sub", "mul", "div", "mod", "vmin", "vmax", "neg", "abs", "sqrt", "flor", "trnc", "rond", "sign",
    "lt", "le", "eq", "gt", "rnum", "not", "vand", "vor", "vxor", "select", "select",
)  # fmt: skip
DRAWN_NODES = st.tuples(st.sampled_from(EXACT), *[st.integers(0, 1000)] * 3)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(DRAWN_NODES, min_size=1, max_size=80),
    st.lists(st.integers(0, 1000), min_size=1, max_size=4),
    st.sampled_from([np.float32, np.float64]),
    st.integers(0, 100),
)
def test_random_graphs(drawn, outputs, dtype, seed):
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
        assert same_bits(run(plan, pixels, env), walk(plan, pixels, env))


@pytest.mark.parametrize("vectors", [True, False])
@pytest.mark.parametrize("name", MODELS)
def test_shipped_profiles(name, vectors, monkeypatch):
    monkeypatch.setattr(numpy_functions, "has_vectors", lambda name: vectors)
    profile = read_profile(folder("profiles") / f"{name}.icc")
    element = profile["A2M0" if "A2M0" in profile else "M2B0"].elements[-1]
    rng = np.random.default_rng(1)
    pixels = rng.uniform(0, 1, (3000, element.inputs)).astype(np.float32)
    pixels[:, -3:] = rng.normal([0.5, 0.5, 1.0], 0.1, (3000, 3))
    for env in ({}, {"litX": 0.3, "litZ": 0.1, "vueX": -0.4}):
        expected = interpreted(element, pixels, env)
        assert np.isfinite(expected).all()
        np.testing.assert_allclose(run(scheduled(element), pixels, env), expected, rtol=2e-6, atol=1e-7)
    exact = interpreted(element, pixels.astype(np.float64))
    assert same_bits(run(scheduled(element, np.float64), pixels.astype(np.float64)), exact)


# Branches ----------------------------------------------------------------------------------------------

NESTED = """
    in[0] 0 gt
    if { in[1] sqrt exp in[0] 1 gt if { sin tan in[0] div } else { asin acos atan } }
    else { in[0] neg ln in[1] cbrt mul sqrt }
    out[0]
"""


def counted(monkeypatch, *ops):
    """A list to which every call of these operators' functions adds the name."""
    calls = []
    for op in ops:

        def function(*operands, op=op, ufunc=numpy_functions.NUMBERS[op]):
            calls.append(op)
            ufunc(*operands)

        monkeypatch.setitem(numpy_functions.NUMBERS, op, function)
    return calls


@pytest.mark.parametrize(
    ("first", "expected"),
    [
        ([2.0, 2.0], ["exp", "sin", "tan"]),
        ([0.5, 0.5], ["exp"]),
        ([-1.0, -1.0], ["ln"]),
        ([np.nan, -1.0], ["ln"]),
        ([2.0, 0.5], ["exp", "sin", "tan"]),
        ([2.0, -1.0], ["exp", "sin", "tan", "ln"]),
        ([2.0, -1.0, 0.5], ["exp", "sin", "tan", "ln"]),
        ([0.5, -1.0], ["exp", "ln"]),
    ],
)
def test_sides_that_no_pixel_takes_are_left_out(first, expected, monkeypatch, rounded_once):
    plan = plan_of(NESTED)
    calls = counted(monkeypatch, "exp", "sin", "tan", "ln")
    pixels = np.array([first, [0.3] * len(first)], np.float32).T
    assert same_bits(run(plan, pixels), walk(plan, pixels))
    assert calls == expected


def test_what_one_side_computes_is_computed_again_where_it_may_not_have_run():
    """A condition's number, made in a side that is skipped, is wanted after it."""
    graph = Graph(dtype=np.float32)
    x, y = graph.input(0), graph.input(1)
    zero = graph.number(0.0)
    outer, inner = graph.apply("gt", x, zero), graph.apply("gt", y, zero)
    inside = graph.apply("add", inner, x)
    chosen = graph.apply("select", outer, inside, y)
    after = graph.apply("mul", inner, chosen)
    selected = graph.apply("select", inner, x, y)
    graph.outputs = (after, chosen, selected)
    body = (x, y, outer, inner, Branch(outer, (inside,), (), (chosen,)), after, selected)
    plan = Schedule(graph, 2, (zero,), (), body)
    for column in ([1.0, 2.0], [-1.0, -2.0], [1.0, -1.0]):
        pixels = np.array([column, [3.0, -3.0]], np.float32).T
        assert same_bits(run(plan, pixels), walk(plan, pixels))


def test_selects_of_a_branch_take_constants_and_conditions():
    graph = Graph(dtype=np.float64)
    x = graph.input(0)
    one, zero = graph.number(1.0), graph.number(0.0)
    positive, large = graph.apply("gt", x, zero), graph.apply("gt", x, one)
    heavy = graph.apply("exp", x)
    selects = [
        graph.apply("select", positive, *sides)
        for sides in ([heavy, zero], [large, one], [one, x], [x, x], [one, zero])
    ]
    graph.outputs = tuple(selects)
    body = (x, positive, large, Branch(positive, (heavy,), (), tuple(selects)))
    plan = Schedule(graph, 1, (one, zero), (), body)
    for column in ([2.0, 0.5], [-1.0, -0.0], [2.0, -1.0, np.nan]):
        pixels = np.array([column]).T
        assert same_bits(run(plan, pixels), walk(plan, pixels))


@pytest.mark.parametrize("env", [{}, {"litX": 2.0}])
def test_a_condition_of_the_whole_run(env, monkeypatch, rounded_once):
    calls = counted(monkeypatch, "sin", "exp")
    plan = plan_of("env(litX) if { in[0] sin exp sqrt add } else { in[0] add } out[0]")
    pixels = np.array([[0.1, 0.2], [0.7, np.nan]], np.float32)
    assert same_bits(run(plan, pixels, env), walk(plan, pixels, env))
    assert bool(calls) == bool(env)


# Tiles, memory, threads --------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [0, 1, 2, TILE - 1, TILE, TILE + 1, 2 * TILE + 3])
def test_any_number_of_pixels(size, rounded_once):
    plan = plan_of(NESTED)
    pixels = np.random.default_rng(size).uniform(-1, 2, (size, 2)).astype(np.float32)
    expected = walk(plan, pixels) if size else np.empty((0, 1))
    found = run(plan, pixels)
    assert found.shape == (size, 1)
    assert same_bits(found, expected)


def test_one_kernel_runs_again_with_other_arguments():
    plan = plan_of("in[0] env(litX) pop mul out[0]")
    kernel = compile_numpy(plan)
    pixels = np.ones((5, 2), np.float32)
    for light in (2.0, -3.0):
        out = np.empty((5, 1), np.float32)
        kernel.run(pixels, out, uniform_values(plan, {"litX": light}))
        assert (out == light).all()


def test_memory_of_any_layout_and_type():
    plan = plan_of("in[0] in[1] sub out[0] in[1] out[1]", outputs=2)
    whole = np.arange(40.0).reshape(10, 4)
    for pixels in (
        whole[::2, 1:3],
        whole.astype(np.float32)[:, ::2],
        np.asfortranarray(whole)[:, 2:],
        whole.astype(int)[:, :2],
    ):
        large = np.full((2 * len(pixels), 5), -1.0, np.float32)
        compile_numpy(plan).run(pixels, large[::2, 1:4:2], ())
        assert (large[::2, 1] == pixels[:, 0] - pixels[:, 1]).all()
        assert (large[::2, 3] == pixels[:, 1]).all()
        assert (large[1::2] == -1).all()
        assert (large[:, [0, 2, 4]] == -1).all()


def test_outputs_without_computation():
    graph = Graph(dtype=np.float32)
    defined = graph.add("defined", detail="litX")
    test = graph.apply("lt", graph.input(1), graph.number(0.0))
    variable = graph.add("variable", detail="litX")
    graph.outputs = (graph.number(0.25), graph.input(1), variable, defined, test, test)
    plan = schedule(graph, 2)
    pixels = np.array([[1, 2], [3, -4]], np.float32)
    expected = np.float32([[0.25, 2, 0.5, 1, 0, 0], [0.25, -4, 0.5, 1, 1, 1]])
    assert (run(plan, pixels, {"litX": 0.5}) == expected).all()


def test_threads_share_a_kernel():
    plan = plan_of(NESTED)
    kernel = compile_numpy(plan)
    pixels = np.random.default_rng(4).uniform(-1, 2, (20 * 3000, 2)).astype(np.float32)
    out = np.empty((len(pixels), 1), np.float32)
    alone = run(plan, pixels)

    def part(start):
        kernel.run(pixels[start : start + 3000], out[start : start + 3000], ())

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(part, range(0, len(pixels), 3000)))
    assert same_bits(out, alone)


def test_runs_do_not_warn():
    with np.errstate(all="raise"):
        assert (run(plan_of("in[0] ln in[1] div out[0]"), np.zeros((3, 2), np.float32)) == -np.inf).all()


# Buffers -----------------------------------------------------------------------------------------------


def test_a_chain_needs_one_buffer():
    code = Code(np.float32)
    value = code.number(1.0)
    for _ in range(5):
        value = code.do(np.sqrt, value)
    assert allocate(code.steps).numbers == 1


@pytest.mark.parametrize(
    ("text", "outputs", "buffers", "steps"),
    [
        ("in(0) out(0)", 1, 0, 1),
        ("in(1,2) out(0,2) in(0) out(2)", 3, 0, 3),
        ("in(0) 3 mul out(0)", 1, 0, 1),
        ("2 in(0) sub out(0)", 1, 0, 1),
        ("env(litX) pop 1 add in(0) mul out(0)", 1, 0, 1),
        # More than one function, more than one reader, or more than one channel.
        ("in(0) 3 mul 1 add out(0)", 1, 1, 4),
        ("in(0) copy mul out(0)", 1, 1, 3),
        ("in(0) 3 mul copy out(0,2)", 2, 1, 4),
        ("in(0) 3 mul out(0) in(0) out(1)", 2, 2, 4),
        ("in(0) in(1) mul out(0)", 1, 2, 4),
        ("in(0) 1 gt out(0)", 1, 1, 4),
    ],
)
def test_channels_that_go_straight_through_take_no_buffer(text, outputs, buffers, steps):
    element = calculator(parse(text), 3, outputs)
    plan = scheduled(element)
    code = lower(plan)
    assert (allocate(code).numbers, len(code)) == (buffers, steps)
    pixels, env = hard_pixels(500, 3), {"litX": 0.75}
    assert same_bits(run(plan, pixels, env), interpreted(element, pixels, env))


def test_buffers_are_not_given_away_while_they_are_needed():
    code = Code(np.float32)
    first = code.do(np.sqrt, code.number(1.0))
    second = code.do(np.exp, first)
    mask = code.test(np.less, first, second)
    third = code.do(np.add, second, second)
    last = code.do(np.subtract, first, third)
    code.do(numpy_functions.copy, mask)
    allocation = allocate(code.steps)
    places = allocation.buffer
    assert places[first.register] != places[second.register]
    assert places[third.register] == places[second.register]
    assert places[last.register] in (places[first.register], places[third.register])
    assert (allocation.numbers, allocation.masks) == (2, 1)


def test_programs_of_many_buffers_run_on_small_tiles():
    graph = Graph(dtype=np.float32)
    x = graph.input(0)
    roots = [graph.apply("mul", x, graph.number(i)) for i in range(3000)]
    total = roots[0]
    for root in reversed(roots[1:]):
        total = graph.apply("add", total, root)
    graph.outputs = (total, *roots)
    kernel = compile_numpy(schedule(graph, 1))
    assert kernel.registers >= 3000
    assert kernel.registers * kernel.tile <= 1 << 24
    out = np.empty((2, 3001), np.float32)
    kernel.run(np.ones((2, 1), np.float32), out, ())
    assert (out[:, 0] == 2999 * 1500).all()


# Elements ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_elements(dtype):
    rng = np.random.default_rng(3)
    curves = [SampledCurve(0.0, 1.0, 1, rng.random(5).astype(np.float32)) for _ in range(2)]
    element = calculator(
        parse("in[0,2] curv(0) clut(1) in[2] tint(2) in[0,2] in[0,2] solv(1,1) out[0,6]"),
        3,
        7,
        [
            CurveSet(tuple(curves)),
            Clut(rng.random((3, 4, 2)).astype(np.float32)),
            TintArray.of(rng.random((5, 2)).astype(np.float32)),
        ],
    )
    pixels = hard_pixels(300, 3, dtype)
    plan = scheduled(element, dtype)
    assert same_bits(run(plan, pixels), interpreted(element, pixels))


@pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")
def test_conformance_cases(rounded_once):
    for name, data in conformance_profiles():
        profile = Profile.from_bytes(data, name)
        (element,) = profile["A2M0"].elements
        pixels = hard_pixels(100, element.inputs)
        for env in ENVIRONMENTS:
            assert same_bits(run(scheduled(element), pixels, env), interpreted(element, pixels, env)), name
