"""Every operator of the NumPy back end against the operator table, on ordinary and on special numbers."""

import itertools

import numpy as np
import pytest
from graph_examples import same_bits

from iccbrdf.calc import numpy_functions
from iccbrdf.calc.graph import LOGIC, Graph, is_truth, meaning
from iccbrdf.calc.numpy_backend import compile_numpy
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.schedule import schedule

EXACT = (
    "neg", "abs", "sqrt", "flor", "ceil", "trnc", "rond", "sign", "rnum", "add", "sub", "mul", "div", "mod",
    "vmin", "vmax", "lt", "le", "eq", "neq", "ge", "gt",
)  # fmt: skip
ROUNDED = ("cbrt", "exp", "log", "ln", "sin", "cos", "tan", "asin", "acos", "atan", "pow", "atn2")
MADE_WITHOUT_VECTORS = ("cbrt", "asin", "acos", "atan", "atn2")
ULPS = 4

SPECIALS = [
    0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 0.49999997, 0.49999999999999994, 1.5, 2.5, -2.5, 3.0, 7.0, -3.0, 2.0,
    1e-45, -1e-45, 5e-324, 1.1754942e-38, 2.2e-308, 1e-40, -1e-40, 1e-20, 8388607.5, 16777217.0, 2.0**31,
    -(2.0**31), 2147483520.0, 2147483647.0, -2147483648.5, 1e10, 88.7, 88.8, -87.5, -103.9, -104.1, 709.8,
    1e30, -1e30, 3.4e38, -3.4e38, 1.7e308, np.inf, -np.inf, np.nan, np.pi, np.pi / 2, -np.pi, 0.70710678,
]  # fmt: skip


def special_numbers(dtype):
    with np.errstate(over="ignore"):
        return np.unique(np.array(SPECIALS, dtype).view(f"u{np.dtype(dtype).itemsize}")).view(dtype)


def numbers(dtype, count=4000):
    """Special numbers, ordinary ones, and any bits."""
    rng = np.random.default_rng(7)
    size = np.dtype(dtype).itemsize
    bits = np.frombuffer(rng.bytes(count * size), f"u{size}").view(dtype)
    ordinary = [rng.uniform(-1, 1, count), rng.normal(0, 10, count), rng.integers(-9, 9, count) / 2]
    return np.concatenate([special_numbers(dtype), bits, *(part.astype(dtype) for part in ordinary)])


def operands(op, dtype):
    """As many arrays as the operator takes; of two, all pairs of special numbers are among them."""
    row = OPERATORS[op]
    first = numbers(dtype)
    if row.pops(0, 0) == 1:
        return [first]
    special = special_numbers(dtype)
    pairs = np.array(list(itertools.product(special, special)), dtype).T
    shuffled = np.random.default_rng(8).permutation(first)
    return [np.concatenate([pairs[0], first]), np.concatenate([pairs[1], shuffled])]


def computed(op, columns, dtype):
    """The NumPy back end's result; numbers among the columns become constants of the graph."""
    graph = Graph(dtype=dtype)
    arrays = [column for column in columns if np.ndim(column)]
    inputs = iter(range(len(arrays)))
    nodes = [graph.input(next(inputs)) if np.ndim(column) else graph.const(column) for column in columns]
    node = graph.apply(op, *nodes)
    graph.outputs = (node,)
    out = np.empty((len(arrays[0]), 1), dtype)
    compile_numpy(schedule(graph, len(arrays))).run(np.stack(arrays, axis=1), out, ())
    return out[:, 0]


def wanted(op, columns, dtype):
    with np.errstate(all="ignore"):
        return np.asarray(meaning(op)(*(np.asarray(column, dtype)[()] for column in columns)))


def ordered(values):
    """Integers in the order of the numbers, neighbours 1 apart."""
    bits = values.view(f"i{values.itemsize}")
    return np.where(bits < 0, np.iinfo(bits.dtype).min - bits, bits).astype(object)


def assert_close(found, expected):
    """Within 4 units in the last place; NaN, infinities and the signs of zeros alike."""
    assert found.dtype == expected.dtype
    nan = np.isnan(expected)
    assert np.array_equal(np.isnan(found), nan)
    special = ~nan & (np.isinf(expected) | (expected == 0))
    assert same_bits(found[special], expected[special])
    rest = ~nan & ~special
    apart = np.abs(ordered(found[rest]) - ordered(expected[rest]))
    assert max(apart, default=0) <= ULPS, (found[rest][apart.argmax()], expected[rest][apart.argmax()])


@pytest.fixture(params=["vectors", "made"])
def functions(request, monkeypatch):
    """Both forms of the functions that not every machine has as vectors."""
    monkeypatch.setattr(numpy_functions, "has_vectors", lambda name: request.param == "vectors")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("op", EXACT)
def test_exact_operators(op, dtype):
    columns = operands(op, dtype)
    assert same_bits(computed(op, columns, dtype), wanted(op, columns, dtype))


@pytest.mark.parametrize("op", ROUNDED)
def test_rounded_operators(op, functions):
    columns = operands(op, np.float32)
    assert_close(computed(op, columns, np.float32), wanted(op, columns, np.float32))


@pytest.mark.parametrize("op", ROUNDED)
def test_float64_is_bit_equal(op, functions):
    columns = operands(op, np.float64)
    assert same_bits(computed(op, columns, np.float64), wanted(op, columns, np.float64))


@pytest.mark.parametrize("op", ["add", "div", "mod", "vmin", "vmax", "lt", "ge"])
def test_exact_operators_with_a_constant(op):
    values = numbers(np.float32, 100)
    for constant in special_numbers(np.float32):
        for columns in ([values, constant], [constant, values]):
            assert same_bits(computed(op, columns, np.float32), wanted(op, columns, np.float32)), columns


@pytest.mark.parametrize("op", ["pow", "atn2"])
def test_rounded_operators_with_a_constant(op, functions):
    values = numbers(np.float32, 100)
    for constant in special_numbers(np.float32):
        for columns in ([values, constant], [constant, values]):
            assert_close(computed(op, columns, np.float32), wanted(op, columns, np.float32))


@pytest.mark.parametrize("exponent", [3, 4, 5, 6, 7, 8])
def test_whole_powers_for_every_mantissa(exponent):
    values = np.arange(0x3F800000, 0x40000000, dtype=np.uint32).view(np.float32)
    found = computed("pow", [values, exponent], np.float32)
    product = values.astype(np.float64) ** exponent
    apart = np.abs(found.view(np.int32) - product.astype(np.float32).view(np.int32))
    assert apart.max() <= ULPS


def test_powers_beyond_are_not_multiplied_out():
    for exponent in (8.0, 2.5, -3.0, 0.5):
        columns = [np.array([1.7, 0.3, 100.0], np.float32), exponent]
        assert_close(computed("pow", columns, np.float32), wanted("pow", columns, np.float32))


@pytest.mark.parametrize("op", MADE_WITHOUT_VECTORS)
def test_made_functions_are_close_everywhere(op, monkeypatch):
    monkeypatch.setattr(numpy_functions, "has_vectors", lambda name: False)
    least, greatest = (0x00800000, 0x7F000000) if op == "cbrt" else (0x30000000, 0x3F800000)
    values = np.arange(least, greatest, 8191, dtype=np.uint32).view(np.float32)
    values = np.concatenate([values, -values])
    columns = [values]
    if op == "atn2":
        columns = [values, np.random.default_rng(3).permutation(values)]
    assert_close(computed(op, columns, np.float32), wanted(op, columns, np.float32))


def test_conditions_on_conditions():
    columns = operands("vand", np.float32)
    for op in sorted(LOGIC):
        graph = Graph(dtype=np.float32)
        half = graph.const(0.5)
        truths = [graph.apply("ge", graph.input(i), half) for i in range(1 if op == "not" else 2)]
        node = graph.apply(op, *truths)
        assert is_truth(node)
        graph.outputs = (node,)
        out = np.empty((len(columns[0]), 1), np.float32)
        compile_numpy(schedule(graph, 2)).run(np.stack(columns, axis=1), out, ())
        assert same_bits(out[:, 0], wanted(op, columns[: len(truths)], np.float32)), op


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_select_moves_bits(dtype):
    yes, no = operands("add", dtype)
    for sides in ([yes, no], [yes, 0.0], [0.0, no], [yes, -0.0], [-0.0, no], [2.0, -3.0], [np.nan, 0.0]):
        condition = np.resize([1.0, 0.0, 0.0], len(yes)).astype(dtype)
        graph = Graph(dtype=dtype)
        arrays = [condition, *(side for side in sides if np.ndim(side))]
        inputs = iter(range(1, 3))
        nodes = [graph.input(next(inputs)) if np.ndim(side) else graph.const(side) for side in sides]
        test = graph.apply("ge", graph.input(0), graph.const(0.5))
        graph.outputs = (graph.apply("select", test, *nodes),)
        out = np.empty((len(yes), 1), dtype)
        compile_numpy(schedule(graph, len(arrays))).run(np.stack(arrays, axis=1), out, ())
        assert same_bits(out[:, 0], np.where(condition >= 0.5, *sides).astype(dtype))


def test_vector_functions_are_known():
    found = {name: numpy_functions.has_vectors(name) for name in ("arctan2", "cbrt", "no such function")}
    assert found["no such function"] is False
    assert found["arctan2"] in (True, False)
