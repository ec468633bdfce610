"""What the shape of an expression says about its value, beyond the ranges of its operands.

Intervals know nothing of operands that depend on each other: x / sqrt(x^2 + y^2) could be anything to them.
`Shapes` finds such expressions; `consequences` goes the other way, from a value to the operands.
All rules hold for rounded numbers: rounding to nearest is monotone, and x is itself when rounded, so that
x + y with y >= 0, in whatever precision, is at least x.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from iccbrdf.calc.graph import COMPARISONS, Node
from iccbrdf.calc.intervals import (
    EITHER,
    FALSE,
    INF,
    TRUE,
    Arithmetic,
    Interval,
    opposite,
)

MAX_TERMS = 64
"""Operands of a sum, or of a least or greatest, that are looked at."""
_MAX_STEPS = 200
"""Pairs of nodes that are compared for one question."""

Known: TypeAlias = Callable[[Node], Interval]
"""What is known of a node's value."""
_Factors: TypeAlias = tuple[Node, ...]
Fact: TypeAlias = tuple[Node, Interval]
"""A node and where its value is."""


def chain(node: Node, op: str) -> list[Node]:
    """The operands of nested operations of one kind, as a + b + c is; the node itself if it is another."""
    found: list[Node] = []
    pending = [node]
    while pending:
        part = pending.pop()
        if part.op == op and len(found) + len(pending) < MAX_TERMS:
            pending += reversed(part.arguments)
        else:
            found.append(part)
    return found


# From operands to the value ----------------------------------------------------------------------------


@dataclass
class Shapes:
    """Expressions whose operands depend on each other, where `known` holds; `same` stands for a node."""

    arithmetic: Arithmetic
    known: Known
    same: Callable[[Node], Node]

    def narrowed(self, node: Node, value: Interval) -> Interval:
        """The value of `node`, which is within `value`."""
        rule = _RULES.get(node.op)
        return value if rule is None or value.empty else rule(self, node, value)

    def ordered(self, low: Node, high: Node) -> bool:
        """Whether `low` is at most `high` for every pixel: False where that is not seen."""
        return _Order(self).at_most(low, high)

    def not_negative(self, node: Node) -> bool:
        value = self.known(node)
        return value.low >= 0 and not value.nan

    def quotient(self, node: Node, value: Interval) -> Interval:
        above, below = node.arguments
        x, y = self.known(above), self.known(below)
        if not (y.low > 0 and y.finite and x.finite):
            return value
        if (x.low >= 0 and self.ordered(above, below)) or self._at_most_norm(above, below):
            value = value.meet(Interval(-1.0, 1.0))
        elif x.low > 0 and self.ordered(below, above):
            value = value.meet(Interval(1.0, INF))
        return self._mean(_terms(above), below, value)

    def product(self, node: Node, value: Interval) -> Interval:
        """x (1 / y) is x / y, rounded twice."""
        for above, inverse in (node.arguments, node.arguments[::-1]):
            if inverse.op != "div" or self.known(inverse.arguments[0]) != Interval(1.0, 1.0):
                continue
            below = inverse.arguments[1]
            x, y = self.known(above), self.known(below)
            if y.low > 0 and y.finite and x.finite:
                if self._at_most_norm(above, below):
                    slack = 4 * self.arithmetic.epsilon
                    value = value.meet(Interval(-1 - slack, 1 + slack))
                value = self._mean(_terms(above), below, value)
        return value

    def _at_most_norm(self, x: Node, norm: Node) -> bool:
        """Whether `norm` is a root of a sum of squares, x^2 among them, or more than that."""
        if self.known(norm).low < math.sqrt(self.arithmetic.smallest_normal):
            return False  # x^2 might be rounded to 0
        parts = chain(norm, "add") if norm.op == "add" else chain(norm, "vmax")
        if norm.op == "add" and not all(map(self.not_negative, parts)):
            return False
        roots = (part for part in parts if part.op == "sqrt" and not self.known(part).nan)
        return any(self._holds_square(root.arguments[0], x) for root in roots)

    def _holds_square(self, total: Node, x: Node) -> bool:
        parts = chain(total, "add") if total.op == "add" else chain(total, "vmax")
        squares = (part.op == "mul" and part.arguments == (x, x) for part in parts)
        return any(squares) and (total.op != "add" or all(map(self.not_negative, parts)))

    def total(self, node: Node, value: Interval) -> Interval:
        if not _divisors(node.arguments[1]):
            return value
        parts = chain(node, "add")
        products = [part.arguments for part in parts if part.op == "mul"]
        if len(products) == len(parts):
            lengths = [_quotients(side) for side in zip(*products, strict=True)]
            if all(found and self._is_unit(*found) for found in lengths):
                slack = 16 * len(parts) * self.arithmetic.epsilon
                value = value.meet(Interval(-1 - slack, 1 + slack))
        divisors = set().union(*map(_divisors, parts))
        if len(divisors) == 1:
            (below,) = divisors
            value = self._mean(_terms(node, below), below, value)
        return value

    def _is_unit(self, numerators: tuple[Node, ...], norm: Node) -> bool:
        """Whether these, divided by `norm`, make a vector that is no longer than 1."""
        if norm.op != "sqrt" or self.known(norm).low < math.sqrt(self.arithmetic.smallest_normal):
            return False
        return all(self._holds_square(norm.arguments[0], x) for x in numerators)

    def _mean(self, terms: Mapping[_Factors, float] | None, below: Node, value: Interval) -> Interval:
        """sum c_i k_i / sum d_i k_i, no k_i below 0, lies between the least and the greatest c_i / d_i."""
        weights = _terms(below)
        divisor = self.known(below)
        if terms is None or weights is None or len(weights) < 2 or not divisor.low > 0 or not divisor.finite:
            return value
        if not terms.keys() <= weights.keys() or min(weights.values()) <= 0:
            return value
        factors = {factor for factors in weights for factor in factors}
        if not all(map(self.not_negative, factors)):
            return value
        ratios = [terms.get(key, 0.0) / weight for key, weight in weights.items()]
        size = max(map(abs, ratios))
        slack = size * self.arithmetic.epsilon * (4 * len(weights) + 16)
        # Products may be rounded to 0.
        slack += 8 * len(weights) * (1 + size) * self.arithmetic.smallest / min(divisor.low, 1.0)
        return value.meet(self.arithmetic.rounded(min(ratios) - slack, max(ratios) + slack))

    def difference(self, node: Node, value: Interval) -> Interval:
        left, right = node.arguments
        if value.nan or not value.low < 0 < value.high:
            return value
        if self.ordered(right, left):
            return value.meet(Interval(0.0, INF))
        return value.meet(Interval(-INF, 0.0)) if self.ordered(left, right) else value

    def comparison(self, node: Node, value: Interval) -> Interval:
        if value != EITHER:
            return value
        left, right = node.arguments
        if left is right:
            holds = node.op in ("eq", "le", "ge")
            return value if self.known(left).nan else TRUE if holds else FALSE
        if node.op in ("le", "gt") and self.ordered(left, right):
            return TRUE if node.op == "le" else FALSE
        if node.op in ("ge", "lt") and self.ordered(right, left):
            return TRUE if node.op == "ge" else FALSE
        return value


_RULES: Mapping[str, Callable[[Shapes, Node, Interval], Interval]] = {
    "div": Shapes.quotient,
    "mul": Shapes.product,
    "add": Shapes.total,
    "sub": Shapes.difference,
    **dict.fromkeys(COMPARISONS, Shapes.comparison),
}


@dataclass
class _Order:
    """The search for a reason why one node is at most another."""

    shapes: Shapes
    steps: int = 0

    def at_most(self, low: Node, high: Node) -> bool:
        low, high = self.shapes.same(low), self.shapes.same(high)
        x, y = self.shapes.known(low), self.shapes.known(high)
        self.steps += 1
        if x.nan or y.nan or self.steps > _MAX_STEPS:
            return False
        if low is high or x.high <= y.low:
            return True
        return self._below(low, high) or self._above(low, high)

    def _above(self, low: Node, high: Node) -> bool:
        """Is `high` something and more?"""
        if high.op == "vmax":
            return any(self.at_most(low, part) for part in high.arguments)
        if high.op == "add":
            left, right = high.arguments
            return (self.shapes.not_negative(right) and self.at_most(low, left)) or (
                self.shapes.not_negative(left) and self.at_most(low, right)
            )
        return False

    def _below(self, low: Node, high: Node) -> bool:
        """Is `low` something and less?"""
        if low.op == "vmin":
            return any(self.at_most(part, high) for part in low.arguments)
        if low.op == "sub":
            return self.shapes.not_negative(low.arguments[1]) and self.at_most(low.arguments[0], high)
        if low.op == "mul" and all(map(self.shapes.not_negative, low.arguments)):
            left, right = low.arguments
            return (self.shapes.known(right).high <= 1 and self.at_most(left, high)) or (
                self.shapes.known(left).high <= 1 and self.at_most(right, high)
            )
        return False


def _terms(node: Node, divisor: Node | None = None) -> dict[_Factors, float] | None:
    """A sum as constant factor by the other factors of each term, each divided by `divisor`; None if not."""
    terms: dict[_Factors, float] = {}
    for part in chain(node, "add"):
        factor, divided = 1.0, divisor is None
        others: list[Node] = []
        for each in chain(part, "mul"):
            if each.op == "const":
                factor *= each.detail[0]
            elif not divided and each.op == "div" and each.arguments[1] is divisor:
                divided = True
                others += chain(each.arguments[0], "mul")
            else:
                others.append(each)
        if not divided or not others or not math.isfinite(factor):
            return None
        factors = tuple(sorted(others, key=lambda node: node.index))
        terms[factors] = terms.get(factors, 0.0) + factor
    return terms


def _divisors(product: Node) -> set[Node]:
    """What the factors of a product are divided by."""
    return {factor.arguments[1] for factor in chain(product, "mul") if factor.op == "div"}


def _quotients(nodes: tuple[Node, ...]) -> tuple[tuple[Node, ...], Node] | None:
    """The numerators of quotients and the divisor that they have in common; None if not."""
    if not all(node.op == "div" and node.arguments[1] is nodes[0].arguments[1] for node in nodes):
        return None
    return tuple(node.arguments[0] for node in nodes), nodes[0].arguments[1]


# From the value to the operands ------------------------------------------------------------------------


def consequences(arithmetic: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    """What follows for the operands of `node` if its value is in `value`."""
    if node.op in COMPARISONS and value != EITHER:
        yield from _compared(arithmetic, node, value == TRUE, known)
    elif node.op in _CONSEQUENCES:
        yield from _CONSEQUENCES[node.op](arithmetic, node, value, known)


def two_sided(node: Node) -> bool:
    """Whether the value may say that an operand is not in the middle of its range, which is no interval."""
    return node.op in ("abs", "mul", "eq", "neq")


_INVERSE = {"lt": "ge", "le": "gt", "gt": "le", "ge": "lt", "eq": "neq", "neq": "eq"}
_MIRRORED = {"gt": "lt", "ge": "le"}


def _compared(a: Arithmetic, node: Node, holds: bool, known: Known) -> Iterator[Fact]:
    left, right = node.arguments
    x, y = known(left), known(right)
    op = node.op if holds else _INVERSE[node.op]
    if op in _MIRRORED:
        op, left, right, x, y = _MIRRORED[op], right, left, y, x
    # What is not less may be NaN, and what is not less than NaN may be anything.
    open_ = holds if node.op == "neq" else not holds
    for target, limit, cut in ((left, y, _upper_cut(a, op, y, x)), (right, x, _lower_cut(a, op, x, y))):
        if cut is not None and not (open_ and limit.nan):
            yield target, cut._replace(nan=open_)


def _upper_cut(a: Arithmetic, op: str, limit: Interval, value: Interval) -> Interval | None:
    """Where the left operand is if it is less than, at most, equal to or different from the right one."""
    if op in ("lt", "le"):
        return Interval(-INF, limit.high if op == "le" else a.below(limit.high))
    return _equality_cut(a, op, limit, value)


def _lower_cut(a: Arithmetic, op: str, limit: Interval, value: Interval) -> Interval | None:
    if op in ("lt", "le"):
        return Interval(limit.low if op == "le" else a.above(limit.low), INF)
    return _equality_cut(a, op, limit, value)


def _equality_cut(a: Arithmetic, op: str, limit: Interval, value: Interval) -> Interval | None:
    if op == "eq":
        return Interval(limit.low, limit.high)
    if limit.low != limit.high:
        return None
    low = a.above(limit.low) if value.low == limit.low else value.low
    high = a.below(limit.low) if value.high == limit.low else value.high
    return Interval(low, high)


def _of_not(a: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    yield node.arguments[0], opposite(value)


def _of_logic(a: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    """`vand` is true if both are, `vor` false if both are; otherwise one operand may tell of the other."""
    left, right = node.arguments
    both, neutral = (TRUE, TRUE) if node.op == "vand" else (FALSE, FALSE)
    if value == both:
        yield from ((left, both), (right, both))
    elif value != EITHER:
        for operand, other in ((left, right), (right, left)):
            if known(other) == neutral:
                yield operand, value


def _of_real(a: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    if value == TRUE:
        yield node.arguments[0], Interval(-a.largest, a.largest)


def _of_negative(a: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    yield node.arguments[0], Interval(-value.high, -value.low, value.nan)


def _of_absolute(a: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    """|x| is at most the greatest value; if x has one sign for certain, at least the least."""
    operand = node.arguments[0]
    x = known(operand)
    low, high = -value.high, value.high
    if value.low > 0:
        low = value.low if x.low > -value.low else low
        high = -value.low if x.high < value.low else high
    yield operand, Interval(low, high, value.nan)


def _of_square(a: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    if node.arguments[0] is not node.arguments[1]:
        return
    slack = 4 * a.epsilon
    least = math.sqrt(max(value.low - a.smallest, 0.0)) * (1 - slack)
    most = math.sqrt(value.high + a.smallest) * (1 + slack) if value.high >= 0 else 0.0
    yield from _of_absolute(a, node, a.rounded(least, most, value.nan, ulps=0), known)


def _of_extreme(a: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    """A least that is at least c has no operand below; the first operand is left out where it is NaN."""
    if value.nan:
        return
    bound = Interval(value.low, INF) if node.op == "vmin" else Interval(-INF, value.high)
    first, second = node.arguments
    yield first, bound._replace(nan=True)
    yield second, bound


def _of_select(a: Arithmetic, node: Node, value: Interval, known: Known) -> Iterator[Fact]:
    """A value that one side cannot have tells of the condition."""
    condition, yes, no = node.arguments
    if value.meet(known(yes)).empty:
        yield condition, FALSE
    if value.meet(known(no)).empty:
        yield condition, TRUE


_CONSEQUENCES: Mapping[str, Callable[[Arithmetic, Node, Interval, Known], Iterator[Fact]]] = {
    "not": _of_not,
    "vand": _of_logic,
    "vor": _of_logic,
    "rnum": _of_real,
    "neg": _of_negative,
    "abs": _of_absolute,
    "mul": _of_square,
    "vmin": _of_extreme,
    "vmax": _of_extreme,
    "select": _of_select,
}
