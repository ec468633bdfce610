"""Passes for graphs that are lifted from programs: the same result for every input, to the bit.

NaN, infinities and signed zeros count; only which NaN it is does not.  So there is no x + 0 = x here (-0 + 0
is 0), and no 0 x = 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from iccbrdf.calc.graph import Graph, Node, is_truth
from iccbrdf.calc.passes import Passes, Rule, constant, known_condition, uniform


def same_bits(value: float | None, wanted: float) -> bool:
    """Whether a constant is `wanted`, -0 and 0 told apart."""
    return value is not None and value == wanted and math.copysign(1, value) == math.copysign(1, wanted)


_NEUTRAL = {"add": -0.0, "sub": 0.0, "mul": 1.0, "div": 1.0, "pow": 1.0}
"""x op neutral = x; for + it is -0."""


def neutral(graph: Graph, node: Node) -> Node | None:
    """x + -0, x - 0, x 1, x / 1 and x^1 are x."""
    if node.op not in _NEUTRAL:
        return None
    left, right = node.arguments
    if same_bits(uniform(right), _NEUTRAL[node.op]):
        return left
    if node.op in ("add", "mul") and same_bits(uniform(left), _NEUTRAL[node.op]):
        return right
    return None


_SIGNED = frozenset(("add", "sub", "mul", "div", "neg", "abs"))


def sign(graph: Graph, node: Node) -> Node | None:
    """x + -y = x - y, x - -y = x + y, -x + y = y - x, --x = x, (-x)(-y) = x y (/ too), |-x| = |x|."""
    if node.op not in _SIGNED:
        return None
    negated = [argument.op == "neg" for argument in node.arguments]
    if node.op in ("add", "sub") and negated[1]:
        other = {"add": "sub", "sub": "add"}[node.op]
        return graph.add(other, [node.arguments[0], node.arguments[1].arguments[0]])
    if node.op == "add" and negated[0]:
        return graph.add("sub", [node.arguments[1], node.arguments[0].arguments[0]])
    if node.op in ("mul", "div") and all(negated):
        return graph.add(node.op, [argument.arguments[0] for argument in node.arguments])
    if node.op == "neg" and negated[0]:
        return node.arguments[0].arguments[0]
    if node.op == "abs" and node.arguments[0].op in ("neg", "abs"):
        return graph.add("abs", node.arguments[0].arguments)
    return None


def reciprocal(graph: Graph, node: Node) -> Node | None:
    """A division by a power of two is the multiplication by its reciprocal: both round the same number."""
    if node.op != "div":
        return None
    divisor = uniform(node.arguments[1])
    if divisor is None or not math.isfinite(divisor) or abs(math.frexp(divisor)[0]) != 0.5:
        return None
    limits = np.finfo(graph.dtype)
    if not float(limits.tiny) <= abs(1 / divisor) <= float(limits.max):
        return None
    return graph.add("mul", [node.arguments[0], graph.const(1 / divisor)])


def power(graph: Graph, node: Node) -> Node | None:
    """x^0 is 1; x^2 in float32 is x x: a float64 holds the exact product, and both round it once."""
    exponent = uniform(node.arguments[1]) if node.op == "pow" else None
    if exponent == 0:
        return graph.const(1.0)
    if exponent == 2 and graph.dtype is np.float32:
        return graph.add("mul", [node.arguments[0], node.arguments[0]])
    return None


def condition_first(graph: Graph, node: Node) -> Node | None:
    """t (x c) = (t x) c for a condition t and |c| <= 1, so that products of x with several c share t x.

    Where t is 0 both are a zero of the same sign, or NaN: x c is infinite only if x is.
    """
    if node.op != "mul":
        return None
    for condition, product in (node.arguments, node.arguments[::-1]):
        if not is_truth(condition) or product.op != "mul":
            continue
        for factor, number in (product.arguments, product.arguments[::-1]):
            value = uniform(number)
            if value is not None and abs(value) <= 1:
                return graph.add("mul", [graph.add("mul", [condition, factor]), number])
    return None


# Conditions --------------------------------------------------------------------------------------------


def condition_of_numbers(graph: Graph, node: Node) -> Node | None:
    """A select between 1 and 0 is its condition, between 0 and 1 the opposite one."""
    if node.op != "select":
        return None
    yes, no = (uniform(side) for side in node.arguments[1:])
    if same_bits(yes, 1.0) and same_bits(no, 0.0):
        return node.arguments[0]
    if same_bits(yes, 0.0) and same_bits(no, 1.0):
        return graph.add("not", node.arguments[:1])
    return None


def truth_as_number(graph: Graph, node: Node) -> Node | None:
    """A condition that was taken for a number and is asked for again: t >= 0.5 is t, t < 0.5 its opposite."""
    if node.op not in ("ge", "lt") or not is_truth(node.arguments[0]) or uniform(node.arguments[1]) != 0.5:
        return None
    condition = node.arguments[0]
    return condition if node.op == "ge" else graph.add("not", [condition])


def opposite(graph: Graph, node: Node) -> Node | None:
    """A double `not` is nothing; a select by a `not` has its sides exchanged."""
    if node.op not in ("not", "select") or node.arguments[0].op != "not":
        return None
    condition = node.arguments[0].arguments[0]
    if node.op == "not":
        return condition
    return graph.add("select", [condition, node.arguments[2], node.arguments[1]])


def known_truth(graph: Graph, node: Node) -> Node | None:
    """`vand`, `vor`, `vxor` with a constant, or of twice the same, are the other argument or a constant."""
    rule = _LOGIC.get(node.op)
    if rule is None:
        return None
    left, right = node.arguments
    if left is right:
        return graph.const(0.0) if node.op == "vxor" else left
    for fixed, other in ((left, right), (right, left)):
        value = uniform(fixed)
        if value is not None:
            return rule(graph, other, value >= 0.5)
    return None


_LOGIC: Mapping[str, Callable[[Graph, Node, bool], Node]] = {
    "vand": lambda graph, other, value: other if value else graph.const(0.0),
    "vor": lambda graph, other, value: graph.const(1.0) if value else other,
    "vxor": lambda graph, other, value: graph.add("not", [other]) if value else other,
}


def repeated_condition(graph: Graph, node: Node) -> Node | None:
    """Inside of a select's side, a select by the same condition is decided."""
    if node.op != "select":
        return None
    condition, yes, no = node.arguments
    inner_yes = yes.arguments[1] if yes.op == "select" and yes.arguments[0] is condition else yes
    inner_no = no.arguments[2] if no.op == "select" and no.arguments[0] is condition else no
    if inner_yes is yes and inner_no is no:
        return None
    return graph.add("select", [condition, inner_yes, inner_no])


def fix_variables(values: Mapping[str, float]) -> Rule:
    """A rule that takes run-time variables for constants: those of `values`, all others being undefined."""

    def variable(graph: Graph, node: Node) -> Node | None:
        if node.op == "variable":
            return graph.const(float(graph.dtype(values.get(node.detail, 0.0))))
        if node.op == "defined":
            return graph.const(float(node.detail in values))
        return None

    return variable


EXACT_PASSES: Passes = (
    ("fold constants", (constant, known_condition, known_truth)),
    ("simplify arithmetic", (neutral, sign, reciprocal, power, condition_first)),
    ("simplify conditions", (truth_as_number, condition_of_numbers, opposite, repeated_condition)),
)
"""The passes in their order; `optimise` runs them until none finds anything to do."""
