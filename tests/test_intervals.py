"""Interval analysis: every value is where it is said to be, and what is sound is seen to be sound."""

import numpy as np
import pytest
from calc_programs import INPUTS, OUTPUTS, random_program
from graph_examples import calculator, lifted

from iccbrdf.calc import elements
from iccbrdf.calc.meanings import solve
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.ranges import analyse

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
        return OPERATORS[node.op].function(*arguments)

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
@pytest.mark.parametrize("first", range(0, 200, 40))
def test_random_programs_are_contained(first, dtype):
    for seed in range(first, first + 40):
        rng = np.random.default_rng(seed)
        ranges = [RANGES[k] for k in rng.integers(len(RANGES), size=INPUTS)]
        element = calculator(random_program(seed, 40), INPUTS, OUTPUTS)
        for graph in (lifted(element, dtype, passes=()), lifted(element, dtype)):
            analysis = analyse(graph, ranges)
            pixels = samples(ranges, 200, seed, dtype)
            assert_contained(graph, analysis, pixels, ENVIRONMENTS[seed % 3], f"program {seed}")
