"""From graph to operators: what the programs compute, and how well they are written."""

import itertools
import re

import numpy as np
import pytest

from iccbrdf.calc.compiler import compile_template
from iccbrdf.calc.emit import emit, number, operator
from iccbrdf.calc.graph import Graph
from iccbrdf.calc.interpreter import run
from iccbrdf.calc.program import Op, listing, nest, parse
from iccbrdf.calc.verify import verify
from iccbrdf.errors import LimitError


def program(body):
    return compile_template(f"model test\n{body}\n", filename="t.calc").program


def written(body):
    return " ".join(listing(program(body)).split())


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        # Vector operators; neighbouring channels in one `in`.
        ("input a[3] = a b c\ninput d\noutput X = dot(a, a)", "in(0,3) sq(3) sum(3) out(0)"),
        ("input a[2] = a b\ninput d[2] = d e\noutput X Y = a * d", "in(0,4) mul(2) out(0,2)"),
        ("input a[3] = a b c\noutput X = norm(a * 2)", "in(0,3) 2 smul(3) sq(3) sum(3) sqrt out(0)"),
        ("input a[3] = a b c\noutput X Y Z = 2 + a", "in(0,3) 2 sadd(3) out(0,3)"),
        ("input a[3] = a b c\noutput X Y Z = a^0.3", "in(0,3) 0.3 gama(3) out(0,3)"),
        ("input a[3] = a b c\noutput X Y Z = 2 - a", "2 copy(1,2) in(0,3) sub(3) out(0,3)"),
        ("input a[3] = a b c\noutput X Y Z = max(a, 0)", "in(0,3) 0 copy(1,2) vmax(3) out(0,3)"),
        # What the same operator computes side by side is computed at once.
        ("input a\ninput b\noutput X Y = (sin(a), sin(b))", "in(0,2) sin(2) out(0,2)"),
        ("input a\ninput b\noutput X = sqrt(exp(a)) - sqrt(exp(b))", "in(0,2) exp(2) sqrt(2) sub out(0)"),
        ("input a\ninput b\noutput X = if a > 0 and b > 0 { 1 } else { 2 }",
         "in(0,2) 0 0 gt(2) vand if { 1 } else { 2 } out(0)"),
        # A value that is used again at once is copied, one that is used later is saved.
        ("input a[3] = a b c\noutput X Y Z = sin(a) / norm(sin(a))",
         "in(0,3) sin(3) copy(3) sq(3) sum(3) sqrt sdiv(3) out(0,3)"),
        ("input a\nlet b = sin(a)\noutput X Y = (b, exp(a) * b)",
         "in(0) sin tsav(0) in(0) exp tget(0) mul out(0,2)"),
        ("input a\nlet b = sin(a)\noutput X Y Z = (b, b, b)", "in(0) sin copy(1,2) out(0,3)"),
        # So are three constants or more, and a value that is used several times in a row is copied.
        ("input a\nlet c = (1, 2, 3)\noutput X Y Z = exp(c * a) - c",
         "1 2 3 tsav(0,3) in(0) smul(3) exp(3) tget(0,3) sub(3) out(0,3)"),
        ("input a\nlet c = (1, 2)\noutput X Y = exp(c * a) - c",
         "1 2 in(0) smul(2) exp(2) 1 2 sub(2) out(0,2)"),
        ("input a\nlet b = sin(a)\nlet c = exp(a)\noutput X Y Z V W = (b, c, b, b, b)",
         "in(0) sin tsav(0) in(0) exp tget(0) copy(1,2) out(0,5)"),
        # Values that are read one after the other are neighbours, though they were computed apart.
        ("input a\nlet s = sin(a)\nlet t = cos(a) + s\noutput X Y Z = (t, exp(a), s * t)",
         "in(0) cos in(0) sin tsav(0) add tsav(1) in(0) exp tget(0,2) mul out(0,3)"),
        ("input a[3] = a b c\nlet s = sin(a)\noutput X Y = (s.x * s.z, s.y)",
         "in(0,3) sin(3) tput(0,3) tget(0) tget(2) mul tget(1) out(0,2)"),
        # Run-time variables: a default of 0 needs no test.
        ("runtime litI = 0\noutput X = litI", "env(litI) pop out(0)"),
        ("runtime I = 2\noutput X = I", "env(I) not if { pop 2 } out(0)"),
        ("output X = pi", "pi out(0)"),
        ("output X Y Z = (1, 2, 2)", "1 2 2 out(0,3)"),
        ("output X Y Z = 2", "2 copy(1,2) out(0,3)"),
    ],
)  # fmt: skip
def test_programs_are_minimal(body, expected):
    assert written(body) == expected


def test_operators_are_those_of_the_text_form():
    written_ops = "sum(3) copy(2,3) in(1,2) rotl(3,1) flip(3) add(2) env(ab) if { 1 2 }"
    built = (operator("sum", 3), operator("copy", 2, 3), operator("in", 1, 2), operator("rotl", 3, 1),
             operator("flip", 3), operator("add", 2), operator("env", 0x61622020), operator("if", 2),
             number(1), number(2))  # fmt: skip
    assert parse("{ " + written_ops + " }") == built


def test_numbers_are_rounded_once_and_the_special_ones_have_operators():
    assert number(0.1) == Op("data", 0x3DCCCCCD)
    assert number(-0.0) == Op("data", 0x80000000)
    assert [number(v).name for v in (np.pi, np.nan, 1e39, -np.inf)] == ["pi", "NaN", "+INF", "-INF"]


def blocks(ops):
    """Number of the operators before, in the two sides of, and after the only if/else of a program."""
    start = next(k for k, op in enumerate(ops) if op.name == "if")
    assert ops[start + 1].name == "else"
    then, otherwise = start + 2 + ops[start].operand, start + 2 + ops[start].operand + ops[start + 1].operand
    names = [op.name for op in ops]
    return names[:start], names[start + 2 : then], names[then:otherwise], names[otherwise:]


def test_what_one_side_uses_is_computed_in_it_and_what_both_use_before():
    ops = program(
        "input a\nlet both = exp(a)\nlet one = sin(a)\nlet other = cos(a)\nlet later = tan(a)\n"
        "output X = (if a > 0 { both * one + one + later } else { both + other^3 * other }) + later"
    )
    before, then, otherwise, after = blocks(ops)
    functions = ("exp", "sin", "cos", "tan")
    assert [n for n in before if n in functions] == ["exp", "tan"]
    assert [n for n in then if n in functions] == ["sin"]
    assert [n for n in otherwise if n in functions] == ["cos"]
    assert [n for n in after if n in functions] == []


def test_conditions_inside_conditions_keep_their_values_to_themselves():
    body = (
        "input a\ninput b\nlet s = sin(a)\nlet t = exp(b)\n"
        "output X = (if a > 0 { if b > 0 { s * t + t } else { s * s } } else { t - s }) + s * 0.5"
    )
    a, b = np.array([1.0, 1, -1, -1]), np.array([2.0, -2, 2, -2])
    s, t = np.sin(a), np.exp(b)
    expected = np.where(a > 0, np.where(b > 0, s * t + t, s * s), t - s) + s * 0.5
    (x,) = run(program(body), [a, b], 1, dtype=np.float64)
    np.testing.assert_allclose(x, expected, rtol=1e-15)


def test_more_temporaries_than_there_are_is_a_limit():
    graph = Graph()
    wide = graph.add("sin", [graph.input(0, 40000)])
    other = graph.add("cos", [graph.input(0, 40000)])
    graph.outputs = tuple(
        graph.add("sum", [graph.add(op, [wide, other])]) for op in ("add", "mul", "sub")
    )
    with pytest.raises(LimitError, match="no room for"):
        emit(graph)


# Random programs ---------------------------------------------------------------------------------------


class Random:
    """Random expressions as template text, each with the value that NumPy gives it; (width, pixels).

    `exact` ones have no constants that the compiler can fold, and so nothing that it rounds to float32.
    """

    def __init__(self, seed, exact):
        self.rng = np.random.default_rng(seed)
        self.exact = exact
        self.pixels = 16
        self.known = []
        self.lines = []

    def pick(self, *options):
        return options[self.rng.integers(len(options))]

    def declare(self, name, width):
        channels = " ".join(f"{name}{k}" for k in range(width))
        self.lines.append(f"input {name}[{width}] = {channels}")
        values = self.rng.uniform(-2, 2, (width, self.pixels))
        self.known.append((name, width, values))
        return list(values)

    def leaf(self, width):
        fitting = [(name, value) for name, w, value in self.known if w == width]
        if self.exact or self.rng.random() < 0.85:
            return self.pick(*fitting)
        numbers = self.rng.integers(-16, 17, width) / 8
        text = "(" + ", ".join(map(str, numbers)) + ")" if width > 1 else str(numbers[0])
        return text, np.repeat(numbers[:, None], self.pixels, axis=1)

    def condition(self, depth):
        a, va = self.expression(1, depth)
        b, vb = self.expression(1, depth)
        sign, test = self.pick(("<", np.less), (">=", np.greater_equal), ("!=", np.not_equal))
        text, truth = f"{a} {sign} {b}", test(va, vb)
        if self.rng.random() < 0.3:
            other, more = self.condition(0)
            word, join = self.pick(("and", np.logical_and), ("or", np.logical_or))
            return f"({text}) {word} not ({other})", join(truth, ~more)
        return text, truth

    def expression(self, width, depth):
        if depth == 0:
            return self.leaf(width)
        kind = self.pick("one", "two", "two", "two", "scalar", "if", "pack", "special")
        if kind == "one":
            a, v = self.expression(width, depth - 1)
            return self.pick(
                (f"sin({a})", np.sin(v)), (f"exp(-abs({a}))", np.exp(-abs(v))), (f"-({a})", -v),
                (f"sqrt(({a})^2 + 0.25)", np.sqrt(v**2 + 0.25)), (f"cbrt({a})", np.cbrt(v)),
            )  # fmt: skip
        if kind in ("two", "scalar"):
            a, v = self.expression(width, depth - 1)
            b, w = self.expression(width if kind == "two" else 1, depth - 1)
            if self.rng.random() < 0.5:
                a, v, b, w = b, w, a, v
            return self.pick(
                (f"({a} + {b})", v + w), (f"({a} - {b})", v - w), (f"({a}) * ({b})", v * w),
                (f"({a}) / (1 + abs({b}))", v / (1 + abs(w))), (f"max({a}, {b})", np.maximum(v, w)),
                (f"atan2({a}, {b} + 3)", np.arctan2(v, w + 3)),
            )  # fmt: skip
        if kind == "if":
            condition, truth = self.condition(depth - 1)
            a, v = self.expression(width, depth - 1)
            b, w = self.expression(width, depth - 1)
            return f"(if {condition} {{ {a} }} else {{ {b} }})", np.where(truth, v, w)
        if kind == "pack" and width > 1:
            parts = [self.expression(1, depth - 1) for _ in range(width)]
            return "(" + ", ".join(t for t, _ in parts) + ")", np.concatenate([v for _, v in parts])
        if width == 3:
            a, v = self.expression(3, depth - 1)
            b, w = self.expression(3, depth - 1)
            return self.pick(
                (f"cross({a}, {b})", np.cross(v, w, axis=0)), (f"rotl({a}, 2)", np.roll(v, -2, axis=0))
            )
        inner = self.pick(2, 3)
        a, v = self.expression(inner, depth - 1)
        b, w = self.expression(inner, depth - 1)
        k = int(self.rng.integers(inner))
        scalar, value = self.pick(
            (f"dot({a}, {b})", (v * w).sum(0)), (f"norm({a})", np.sqrt((v * v).sum(0))),
            (f"({a})[{k}]", v[k]), (f"min({a})", v.min(0)), (f"sum({a})", v.sum(0)),
        )  # fmt: skip
        repeated = np.repeat(value[None], width, axis=0)
        return (scalar, repeated) if width == 1 else (f"({', '.join([scalar] * width)})", repeated)

    def template(self):
        channels = self.declare("a", 1) + self.declare("b", 2) + self.declare("c", 3)
        env = {}
        for name, default in (("one", 0.0), ("two", 1.5)):
            self.lines.append(f"runtime {name} = {default}")
            value = default
            if self.rng.random() < 0.5:
                value = env[name] = float(self.rng.integers(-8, 9)) / 4
            self.known.append((name, 1, np.full((1, self.pixels), value)))
        for k in range(self.rng.integers(2, 7)):
            width = self.pick(1, 2, 3)
            text, value = self.expression(width, 2)
            self.lines.append(f"let x{k} = sin({text})")
            self.known.append((f"x{k}", width, np.broadcast_to(np.sin(value), (width, self.pixels))))
        text, value = self.expression(3, 3)
        scalar, more = self.expression(1, 3)
        self.lines.append(f"output X Y Z = {text}")
        self.lines.append(f"output W = {scalar}")
        expected = np.concatenate([np.broadcast_to(value, (3, self.pixels)), more])
        return "\n".join(self.lines), channels, env, expected


@pytest.mark.parametrize("seed", range(250))
def test_random_programs_compute_what_numpy_does(seed):
    exact = seed % 2 == 0
    body, channels, env, expected = Random(seed, exact).template()
    result = compile_template(f"model random\n{body}\n", filename="t.calc")
    ops = result.program
    outputs = run(ops, channels, 4, env=env, dtype=np.float64)
    got = np.stack([np.broadcast_to(value, expected.shape[1]) for value in outputs])
    tolerance = 1e-12 if exact else 1e-5
    np.testing.assert_allclose(got, expected, rtol=tolerance, atol=tolerance, err_msg=body)

    assert verify(ops, 6, 4).executed <= len(ops)
    assert not {op.name for op in ops} & {"noop", "scnt", "vxor"}
    assert all(op.operand > 0 for op in ops if op.name in ("if", "else"))
    for block in sequences(nest(ops)):
        for left, right in itertools.pairwise(block):
            both_read = left.name == right.name and left.name in ("in", "tget")
            assert not both_read or left.s + left.t + 1 != right.s


def sequences(block):
    """The operators of a block and of all blocks in it."""
    yield [step.op for step in block]
    for step in block:
        for inner in (*step.branches, step.otherwise or ()):
            yield from sequences(inner)


def test_nothing_is_computed_twice_on_a_path():
    body = (
        "input a\ninput b\ndef f(x) = exp(sin(x) * a)\nlet p = f(b)\n"
        "output X = if a > b { f(b) + f(a) } else { f(b) * f(b) }\noutput Y = f(b) + sin(b)\n"
    )
    names = re.findall(r"[a-z]+", written(body))
    assert names.count("exp") == 2
    assert names.count("sin") == 2
