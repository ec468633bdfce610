"""Graphs made of guards, norms, means and the like, at random: whatever the analysis makes of them holds."""

import random

import numpy as np
import pytest
from test_intervals import assert_contained, samples

from iccbrdf.calc.graph import Graph
from iccbrdf.calc.ranges import analyse

RANGES = [(-1, 1), (0, 1), (0.25, 4), (-2, 3)]
COMPARISONS = ("lt", "le", "eq", "neq", "ge", "gt")
CONSTANTS = (0.0, 1.0, -1.0, 0.5, 1e-3, 1e-20, 2.0, 0.25)


class RandomGraph:
    """Nodes by name of the operator, from a pool that grows."""

    def __init__(self, seed, dtype):
        self.draw = random.Random(seed)
        self.graph = Graph(dtype=dtype)
        self.numbers = [self.graph.input(k) for k in range(len(RANGES))]
        self.numbers.append(self.op("variable", detail="litX"))
        self.truths = [self.op("defined", detail="litX")]

    def op(self, op, *arguments, detail=None):
        return self.graph.add(op, arguments, detail)

    def number(self):
        if self.draw.random() < 0.2:
            return self.graph.number(self.draw.choice(CONSTANTS))
        return self.draw.choice(self.numbers[-12:] if self.draw.random() < 0.7 else self.numbers)

    def square(self, node):
        return self.op("mul", node, node)

    def total(self, nodes):
        result, *others = nodes
        for node in others:
            result = self.op("add", result, node)
        return result

    def condition(self):
        kind = self.draw.random()
        if kind < 0.2:
            return self.draw.choice(self.truths)
        if kind < 0.4:
            logic = self.draw.choice(("vand", "vor", "vxor"))
            return self.op(logic, self.draw.choice(self.truths), self.draw.choice(self.truths))
        if kind < 0.5:
            return self.op("not", self.draw.choice(self.truths))
        return self.op(self.draw.choice(COMPARISONS), self.number(), self.number())

    def grow(self):
        x, y, z = (self.number() for _ in range(3))
        shape = self.draw.choice(SHAPES)
        self.numbers.append(shape(self, x, y, z))
        self.truths.append(self.condition())

    def chain(self, op, nodes):
        result, *others = nodes
        for node in others:
            result = self.op(op, node, result)
        return result

    def guarded(self, x, y, z):
        """The usual way of writing a division that may not be done."""
        test = self.op(
            self.draw.choice(("gt", "ge", "neq")), y, self.graph.number(self.draw.choice(CONSTANTS))
        )
        if self.draw.random() < 0.3:
            test = self.op("gt", self.op("abs", y), self.graph.number(1e-6))
        yes = self.op("div", x, y)
        if self.draw.random() < 0.5:
            return self.op("select", self.op("not", test), z, yes)
        return self.op("select", test, yes, z)

    def norm(self, x, y, z):
        squares = [self.square(node) for node in self.draw.sample([x, y, z], 3)]
        tiny = self.graph.number(self.draw.choice((1e-37, 1e-6, 1.0, 0.0)))
        return self.op("sqrt", self.total([*squares, tiny]))

    def mean(self, x, y, z):
        weights = [self.op("abs", node) for node in (x, y, z)]
        if self.draw.random() < 0.5:
            weights = [self.op("vmax", weight, self.graph.number(1e-3)) for weight in weights]
        below = self.total(weights)
        factors = [self.graph.number(self.draw.uniform(-2, 2)) for _ in weights]
        if self.draw.random() < 0.6:
            products = [self.op("mul", w, c) for w, c in zip(weights, factors, strict=True)]
            return self.draw.choice((self.quotient, self.by_reciprocal))(self.total(products), below)
        shares = [self.op("div", weight, below) for weight in weights]
        return self.total([self.op("mul", c, w) for w, c in zip(shares, factors, strict=True)])

    def quotient(self, x, y):
        return self.op("div", x, y)

    def by_reciprocal(self, x, y):
        return self.op("mul", x, self.op("div", self.graph.number(1.0), y))

    def cosine(self, x, y, z):
        one, other = self.norm(x, y, z), self.norm(y, z, x)
        return self.total(
            [
                self.op("mul", self.op("div", a, one), self.op("div", b, other))
                for a, b in ((x, y), (y, z), (z, x))
            ]
        )

    def existence(self, x, y, z):
        """One over how many of three are the least of them, which is never one over none."""
        least = self.chain("vmin", [x, y, z])
        count = self.total([self.op("le", node, least) for node in (x, y, z)])
        return self.op("div", self.graph.number(1.0), count)


SHAPES = (
    *(lambda g, x, y, z, op=op: g.op(op, x, y) for op in ("add", "sub", "mul", "vmin", "vmax", "div", "mod")),
    *(lambda g, x, y, z, op=op: g.op(op, x) for op in ("neg", "abs", "flor", "exp", "sin", "cbrt", "atan")),
    lambda g, x, y, z: g.op("select", g.condition(), x, y),
    lambda g, x, y, z: g.op("select", g.condition(), g.op("div", x, y), g.op("mul", y, z)),
    lambda g, x, y, z: g.op("mul", g.draw.choice(g.truths), x),
    lambda g, x, y, z: g.op("sqrt", g.op("vmax", x, g.graph.number(0.0))),
    lambda g, x, y, z: g.op("ln", x),
    lambda g, x, y, z: g.op("div", x, g.norm(x, y, z)),
    lambda g, x, y, z: g.by_reciprocal(x, g.norm(x, y, z)),
    lambda g, x, y, z: g.op("div", g.square(x), g.total([g.square(x), g.square(y), g.graph.number(0.5)])),
    lambda g, x, y, z: g.op("div", x, g.op("vmax", g.op("abs", x), g.op("abs", y))),
    lambda g, x, y, z: g.op("div", g.op("abs", x), g.chain("vmin", [g.op("abs", x), g.op("abs", y), z])),
    lambda g, x, y, z: g.op("mul", g.op("exp", g.op("neg", g.square(x))), g.square(x)),
    lambda g, x, y, z: g.op("sub", g.op("add", x, g.square(y)), x),
    lambda g, x, y, z: g.op("div", x, g.op("add", y, g.op("eq", y, g.graph.number(0.0)))),
    lambda g, x, y, z: g.op("pow", x, g.graph.number(g.draw.choice((2, 3, -1, 0.5)))),
    lambda g, x, y, z: g.op("atn2", x, y),
    RandomGraph.guarded,
    RandomGraph.guarded,
    RandomGraph.norm,
    RandomGraph.mean,
    RandomGraph.cosine,
    RandomGraph.existence,
)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("first", range(0, 30, 10))
def test_random_shapes_are_contained(first, dtype):
    for seed in range(first, first + 10):
        made = RandomGraph(seed, dtype)
        for _ in range(14):
            made.grow()
        made.graph.outputs = tuple(made.numbers[-4:])
        analysis = analyse(made.graph, RANGES)
        env = {"litX": made.draw.uniform(-1000, 1000)} if seed % 2 else {}
        pixels = samples(RANGES, 400, seed, dtype)
        assert_contained(made.graph, analysis, pixels, env, f"graph {seed}")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_products_with_reciprocals_are_seen_as_quotients(dtype):
    made = RandomGraph(0, dtype)
    x, y, z = made.numbers[:3]
    norm = made.op("sqrt", made.total([made.square(x), made.square(y), made.graph.number(1e-30)]))
    weights = [made.op("vmax", node, made.graph.number(1e-6)) for node in (x, y, z)]
    parts = [made.op("mul", made.graph.number(c), w) for c, w in zip((2.0, 5.0, 3.0), weights, strict=True)]
    unit, mean = made.by_reciprocal(x, norm), made.by_reciprocal(made.total(parts), made.total(weights))
    made.graph.outputs = (unit, mean)
    found = analyse(made.graph, RANGES)
    assert found.hazards == ()
    for node, low, high in ((unit, -1, 1), (mean, 2, 5)):
        assert low - 1e-4 < found.ranges[node].low <= low
        assert high <= found.ranges[node].high < high + 1e-4
    assert_contained(made.graph, found, samples(RANGES, 400, 1, dtype), {}, "reciprocals")
