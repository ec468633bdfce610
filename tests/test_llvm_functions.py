"""The LLVM back end's operators, for vectors of every width, against float64 functions rounded once."""

import numpy as np
import pytest
from graph_examples import same_bits
from llvm_examples import POSSIBLE, computed, numbers, pairs, run, special_numbers, ulps_apart

from iccbrdf.calc.graph import Graph
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.schedule import schedule

EXACT = (
    "neg", "abs", "sqrt", "flor", "ceil", "trnc", "rond", "sign", "rnum",
    "add", "sub", "mul", "div", "mod", "vmin", "vmax", "lt", "le", "eq", "neq", "ge", "gt",
)  # fmt: skip
RANGES = {
    "exp": (-105, 90), "ln": (0, 4), "log": (0, 1e4), "cbrt": (-3, 3), "sin": (-30, 30), "cos": (-30, 30),
    "tan": (-30, 30), "asin": (-1, 1), "acos": (-1, 1), "atan": (-10, 10),
}  # fmt: skip
ULPS = 4

widths = pytest.mark.parametrize("width", POSSIBLE)


IEEE = {"eq": np.equal, "neq": np.not_equal}
"""In graphs no NaN equals another; lifting adds what the operators have beyond that."""


def wanted(op, columns):
    """An exponent is an array: for a number, NumPy has roots that differ from C's pow for -0 and -inf."""
    dtype = columns[0].dtype
    arrays = [np.broadcast_to(np.asarray(column, dtype), len(columns[0])).copy() for column in columns]
    with np.errstate(all="ignore"):
        return IEEE.get(op, OPERATORS[op].function)(*arrays).astype(dtype)


def assert_close(op, columns, width=None, ulps=ULPS):
    found, expected = computed(op, columns, width), wanted(op, columns)
    apart = ulps_apart(found, expected)
    worst = int(np.argmax(apart))
    case = [column if np.ndim(column) == 0 else column[worst] for column in columns]
    assert apart[worst] <= ulps, f"{op}{case}: {found[worst]}, expected {expected[worst]}"


@widths
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("op", EXACT)
def test_exact_operators(op, dtype, width):
    columns = pairs(3000, dtype)[: OPERATORS[op].pops(0, 0)]
    assert same_bits(computed(op, columns, width), wanted(op, columns))


@widths
@pytest.mark.parametrize("op", RANGES)
def test_functions_of_one_number(op, width):
    low, high = RANGES[op]
    dense = np.linspace(low, high, 200_001).astype(np.float32)
    assert_close(op, [np.concatenate([numbers(50_000), dense])], width)


@widths
@pytest.mark.parametrize(("op", "low", "high"), [
    ("exp", -87, 88), ("exp", -87.1, 88), ("exp", -87, 89), ("sin", -1.5, 1.5), ("sin", -1.6, 1.5),
    ("cbrt", 2.0**-100, np.inf), ("cbrt", 2.0**-110, np.inf), ("cbrt", -1, 1),
])  # fmt: skip
def test_functions_of_numbers_known_to_lie_within_bounds(op, low, high, width):
    graph = Graph(dtype=np.float32)
    bounded = graph.apply("vmax", graph.input(0), graph.number(low))
    if np.isfinite(high):
        bounded = graph.apply("vmin", bounded, graph.number(high))
    graph.outputs = (graph.apply(op, bounded),)
    values = np.concatenate([numbers(20_000), np.linspace(-100, 100, 50_001).astype(np.float32)])
    # NaN becomes the first bound.
    inside = np.where(values > np.float32(low), values, np.float32(low))
    expected = wanted(op, [np.minimum(inside, np.float32(high))])
    found = run(schedule(graph, 1), values[:, None], width=width)[:, 0]
    assert ulps_apart(found, expected).max() <= ULPS


@widths
@pytest.mark.parametrize("op", ["atn2", "pow"])
def test_functions_of_two_numbers(op, width):
    first, second = pairs(30_000)
    rng = np.random.default_rng(3)
    base = rng.uniform(0, 3, 60_000).astype(np.float32)
    exponent = rng.uniform(-20, 20, 60_000).astype(np.float32)
    assert_close(op, [np.concatenate([first, base]), np.concatenate([second, exponent])], width)


@widths
@pytest.mark.parametrize("exponent", [
    0.0, -0.0, 1.0, 2.0, 3.0, 7.0, 32.0, 33.0, -1.0, -2.0, 0.5, -0.5, 1 / 3, 2.4, -1.5, 1e-20, 1e9, np.inf,
    -np.inf, np.nan,
])  # fmt: skip
def test_powers_of_a_known_exponent(exponent, width):
    values = np.concatenate([numbers(5000), np.linspace(0, 4, 20_001).astype(np.float32)])
    assert_close("pow", [values, exponent], width)


@pytest.mark.parametrize("op", ["pow", "atn2", "mod", "div"])
def test_a_constant_on_either_side(op):
    values = numbers(300)
    for constant in special_numbers()[::3]:
        assert_close(op, [values, constant])
        columns = [np.full_like(values, constant), values]
        apart = ulps_apart(computed(op, [float(constant), values]), wanted(op, columns))
        assert apart.max() <= ULPS, (op, constant)


@pytest.mark.parametrize("op", ["sin", "cos", "tan"])
@pytest.mark.parametrize("power", range(0, 128, 9))
def test_angles_of_any_size(op, power):
    values = np.random.default_rng(power).uniform(1, 2, 2000).astype(np.float32) * np.float32(2.0**power)
    assert_close(op, [np.concatenate([values, -values])])


def test_angles_near_multiples_of_quarter_turns():
    whole = (np.arange(1, 5000) * (np.pi / 2)).astype(np.float32)
    near = np.concatenate([whole, np.nextafter(whole, np.float32(0)), np.nextafter(whole, np.float32(1e9))])
    for op in ("sin", "cos", "tan"):
        assert_close(op, [near])


def test_a_result_does_not_depend_on_the_neighbours():
    """A large angle beside an ordinary one takes another way; so does a subnormal result."""
    ordinary = np.random.default_rng(1).uniform(-80, 80, 1600).astype(np.float32)
    for op, special in (("sin", 1e30), ("tan", -1e9), ("exp", -90.0)):
        mixed = ordinary.copy()
        mixed[::3] = special
        kept = np.arange(len(mixed)) % 3 != 0
        assert same_bits(computed(op, [mixed])[kept], computed(op, [ordinary])[kept])


@pytest.mark.parametrize("exponent", [3.0, 7.0])
def test_whole_powers_are_rounded_once(exponent):
    values = np.arange(0x3F800000, 0x40000000, 37, dtype=np.uint32).view(np.float32)
    found = computed("pow", [values, exponent])
    assert np.mean(found == wanted("pow", [values, exponent])) > 0.99999


@pytest.mark.parametrize("op", [*RANGES, "atn2", "pow"])
def test_functions_of_float64(op):
    columns = pairs(3000, np.float64)[: OPERATORS[op].pops(0, 0)]
    assert_close(op, columns)
