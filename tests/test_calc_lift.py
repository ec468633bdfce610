"""Lifting, exact passes and schedules against the interpreter, to the bit."""

import numpy as np
import pytest
from calc_programs import INPUTS, OUTPUTS, random_program
from graph_examples import (
    calculator,
    hard_pixels,
    interpreted,
    lifted,
    same_bits,
    scheduled,
    walk,
)

from iccbrdf import read_profile
from iccbrdf.calc.backends import COMPILERS
from iccbrdf.calc.exact_passes import EXACT_PASSES
from iccbrdf.calc.graph import Graph, check
from iccbrdf.calc.passes import optimise
from iccbrdf.calc.program import parse
from iccbrdf.calc.schedule import Branch, computed, schedule, uniform_values
from iccbrdf.errors import UnsupportedError
from iccbrdf.icc import Clut, CurveSet, Matrix, SampledCalculatorCurve, TintArray
from iccbrdf.resources import folder

ENVIRONMENTS = ({}, {"litX": 0.75}, {"litX": -0.0, "a": float("nan")})
MODELS = ("fogra39_gloss/mvis", "fogra39_gloss/colour-mid", "landscape/mvis", "ward_painting/mvis")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("first", range(0, 200, 20))
def test_random_programs(first, dtype):
    for seed in range(first, first + 20):
        element = calculator(random_program(seed, 40), INPUTS, OUTPUTS)
        for passes in ((), None):
            options = {} if passes is None else {"passes": passes}
            plan = scheduled(element, dtype, **options)
            check(plan.graph)
            pixels = hard_pixels(64, INPUTS, dtype, seed)
            env = ENVIRONMENTS[seed % 3]
            with np.errstate(all="ignore"):
                assert same_bits(walk(plan, pixels, env), interpreted(element, pixels, env)), seed


def profile_elements(name):
    profile = read_profile(folder("profiles") / f"{name}.icc")
    return profile["A2M0" if "A2M0" in profile else "M2B0"].elements


@pytest.mark.parametrize("name", MODELS)
def test_shipped_programs(name):
    element = profile_elements(name)[-1]
    plan = scheduled(element)
    rng = np.random.default_rng(1)
    pixels = rng.uniform(-0.1, 1.1, (500, element.inputs)).astype(np.float32)
    pixels[:40] = hard_pixels(40, element.inputs)
    assert same_bits(walk(plan, pixels), interpreted(element, pixels))
    env = {"litX": 0.3, "litZ": 0.1, "vueX": -0.4}
    assert same_bits(walk(plan, pixels, env), interpreted(element, pixels, env))


def test_light_and_view_are_computed_once_a_run():
    (element,) = profile_elements("fogra39_gloss/mvis")
    plan = scheduled(element)
    assert not any(node.op in ("variable", "defined") for node in computed(plan.body))
    # Two unit vectors, their half vector and what is made of them.
    assert len(plan.uniform) > 30
    assert len(plan.arguments) < 15


def test_a_dark_tile_skips_the_model():
    (element,) = profile_elements("fogra39_gloss/mvis")
    plan = scheduled(element)
    branches = [item for item in plan.body if isinstance(item, Branch)]
    inside = {node for branch in branches for side in (branch.yes, branch.no) for node in computed(side)}
    assert len(inside) > len(list(computed(plan.body))) / 2


def matrix_outputs(finite_inputs, pixels, rows, offset=None):
    element = Matrix.of(rows, offset)
    return walk(scheduled(element, finite_inputs=finite_inputs), pixels), len(
        lifted(element, finite_inputs=finite_inputs).live()
    )


def test_matrix_of_finite_inputs_leaves_out_zeros():
    rows, offset = [[1.0, 0, 0], [0, 0, 0], [0.5, 0, -2]], [0.0, -1.0, 0.25]
    pixels = np.array([[1, 2, 3], [-0.0, -0.0, -0.0], [0.0, -0.0, 1e38]], np.float32)
    exact, many = matrix_outputs(False, pixels, rows, offset)
    quick, few = matrix_outputs(True, pixels, rows, offset)
    assert same_bits(exact, quick)
    assert few < many
    # Only for inputs that are not finite is there a difference: 0 times infinity is NaN.
    exact, _ = matrix_outputs(False, np.array([[1, np.inf, 3]], np.float32), rows, offset)
    assert np.isnan(exact).all()


def test_matrix_keeps_zeros_before_an_offset_of_minus_zero():
    pixels = np.array([[0.0, -0.0]], np.float32)
    rows, offset = [[-1.0, 0.0]], [-0.0]
    assert same_bits(
        matrix_outputs(True, pixels, rows, offset)[0], matrix_outputs(False, pixels, rows, offset)[0]
    )


def test_elements_inside_a_calculator():
    rng = np.random.default_rng(3)
    table = rng.random((3, 4, 2)).astype(np.float32)
    inner = calculator(parse("in[0] env(litX) pop[1] mul out[0]"), 1, 1)
    element = calculator(
        parse("in[0,2] copy[2] mtx(0) tput[0,2] clut(1) in[2] tint(2) in[2] calc(3) out[0,4]"),
        3,
        5,
        [
            Matrix.of(rng.random((2, 2)).astype(np.float32)),
            Clut(table),
            TintArray.of(rng.random((5, 2)).astype(np.float32)),
            inner,
        ],
    )
    pixels = hard_pixels(200, 3)
    env = {"litX": 0.5}
    assert same_bits(walk(scheduled(element), pixels, env), interpreted(element, pixels, env))


def test_calculator_curves_become_samples():
    def curve(text):
        return CurveSet((SampledCalculatorCurve(9, -1.0, 1.0, 1, calculator(parse(text), 1, 1)),))

    element = calculator(parse("in[0] curv(0) out[0]"), 1, 1, [curve("in[0] sq out[0]")])
    pixels = np.linspace(-2, 2, 101, dtype=np.float32)[:, None]
    assert same_bits(walk(scheduled(element), pixels), interpreted(element, pixels))
    with pytest.raises(UnsupportedError, match="run-time variables"):
        lifted(calculator(parse("in[0] curv(0) out[0]"), 1, 1, [curve("in[0] env(litX) pop mul out[0]")]))


def test_programs_that_would_explode_are_left_to_the_interpreter():
    # Each calculator applies the one before twice.
    element = calculator(parse("in[0] sin out[0]"), 1, 1)
    for _ in range(18):
        element = calculator(parse("in[0] calc(0) calc(0) out[0]"), 1, 1, [element])
    with pytest.raises(UnsupportedError, match="more than 20000 nodes"):
        lifted(element)


def test_passes_report_what_they_did():
    graph = Graph(dtype=np.float32)
    x = graph.input(0)
    graph.outputs = (graph.add("div", [graph.add("neg", [graph.add("neg", [x])]), graph.const(4.0)]),)
    result, reports = optimise(graph, EXACT_PASSES)
    assert [(node.op, node.detail) for node in result.live()] == [
        ("input", 0),
        ("const", (0.25,)),
        ("mul", None),
    ]
    assert "simplify arithmetic: 5 -> 3 nodes" in "\n".join(map(str, reports))


@pytest.mark.parametrize(("constant", "products"), [(0.75, 3), (-1.0, 3), (1.5, 4)])
def test_products_with_a_condition_share_the_condition_times_the_value(constant, products):
    """t (x c) = (t x) c but where x c is infinite and x is not."""
    graph = Graph(dtype=np.float32)
    x, taken = graph.input(0), graph.apply("lt", graph.input(1), graph.input(0))
    scaled = [graph.apply("mul", x, graph.number(c)) for c in (constant, 0.5)]
    graph.outputs = tuple(graph.apply("mul", taken, value) for value in scaled)
    result, _ = optimise(graph, EXACT_PASSES)
    assert sum(node.op == "mul" for node in result.live()) == products
    ends = np.float32([[3e38, 3.1e38], [-3e38, -3.1e38], [1e-45, 0]])
    pixels = np.concatenate([hard_pixels(2000, 2), ends])
    assert same_bits(walk(schedule(result, 2), pixels), walk(schedule(graph, 2), pixels))


@pytest.mark.parametrize(
    ("op", "constant"), [("add", 0.0), ("sub", -0.0), ("mul", 0.0), ("div", 3.0), ("pow", 0.5)]
)
def test_what_is_nearly_the_same_is_not_simplified(op, constant):
    graph = Graph(dtype=np.float32)
    graph.outputs = (graph.add(op, [graph.input(0), graph.const(constant)]),)
    assert optimise(graph, EXACT_PASSES)[0].outputs[0].op == op


@pytest.mark.parametrize("env", [{"litX": float("nan"), "a": 0.5}, {"litX": 1.0, "a": 2.0}])
def test_equality_and_powers_with_run_time_variables(env):
    """NaN equals NaN in `eq`; C's pow gives 0 and infinity for -0 and -infinity to the power 0.5."""
    text = "in(0) env(litX) pop eq out(0) in(0) env(litX) pop neq out(1) in(0) env(a) pop pow out(2)"
    text += " in(0) 0.5 pow out(3)"
    element = calculator(parse(text), 1, 4)
    pixels = np.array([[np.nan], [1], [-0.0], [-np.inf], [4]], np.float32)
    expected = interpreted(element, pixels, env)
    assert same_bits(expected[2:, 3], np.float32([0, np.inf, 2]))
    assert expected[0, 0] == np.isnan(env["litX"])
    plan = scheduled(element)
    assert same_bits(walk(plan, pixels, env), expected)
    for compiler in COMPILERS.values():
        out = np.empty_like(expected)
        compiler(plan).run(pixels, out, uniform_values(plan, env))
        assert same_bits(out, expected)
