"""Where operands lie, as far as that is seen without knowing the inputs, and what can be left out for it.

An elementary function spends a third of its instructions on operands that most programs never give it: sines
of what is within half a turn, exponentials that do not underflow and cube roots of what is well above 0 do
without them.  And what is multiplied by a condition and added to a sum is added where the condition holds.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from iccbrdf.calc.graph import Node, is_truth
from iccbrdf.calc.intervals import ANYTHING, EITHER, INF, Arithmetic, Interval, square
from iccbrdf.calc.schedule import Schedule, computed

_DEPTH = 30
"""Operators that are looked back."""
_FOLLOWED = frozenset(("neg", "abs", "sqrt", "add", "sub", "mul", "div", "vmin", "vmax", "exp"))
"""Operators that are looked at; the value of any other may be anything."""


class Masked(NamedTuple):
    """`total + value * factor` where a condition holds, else `total`."""

    condition: Node
    total: Node | None
    """None: 0, of a product that is no part of a sum."""
    value: Node | None
    factor: Node | None
    """None: 1; of both."""

    @property
    def reads(self) -> tuple[Node, ...]:
        return tuple(node for node in self if node is not None)


class Operands:
    """What is known of the values of a schedule."""

    def __init__(self, schedule: Schedule) -> None:
        self._arithmetic = Arithmetic(schedule.graph.dtype)
        self._ranges: dict[Node, Interval] = {}
        self._positive: dict[Node, bool] = {}
        self._readers: dict[Node, set[Node | None]] = {node: {None} for node in schedule.graph.outputs}
        for node in computed(schedule.body):
            for argument in node.arguments:
                self._readers.setdefault(argument, set()).add(node)

    def within(self, function: Node, range: Interval) -> bool:
        """Whether the operand of a function of one number lies in a range wherever the result is read."""
        (operand,) = function.arguments
        found = self._where_read(function, operand) or self._known(operand)
        return range.low <= found.low and found.high <= range.high and not found.nan

    def masked(self, node: Node) -> Masked | None:
        """
        A sum with, or product of, a condition and a value as what a condition decides.

        All of it is finite, and neither negative nor -0: there, and only there, adding 0 changes nothing.
        """
        if node.op == "add":
            for total, part in (node.arguments, node.arguments[::-1]):
                found = self._product(part)
                if found is not None and self._counts(total):
                    return found._replace(total=total)
        return self._product(node) if node.op == "mul" else None

    def _product(self, node: Node) -> Masked | None:
        """A condition, or one times a value, or that times a number."""
        if is_truth(node):
            return Masked(node, None, None, None)
        factor = None
        if node.op == "mul" and node.arguments[1].op == "const" and self._counts(node.arguments[1]):
            node, factor = node.arguments
        if node.op == "mul":
            for condition, value in (node.arguments, node.arguments[::-1]):
                if is_truth(condition) and self._counts(value):
                    return Masked(condition, None, value, factor)
        return None

    def _where_read(self, function: Node, operand: Node) -> Interval | None:
        """Where the operand lies if the result is read by `select(operand > number, result, ...)` alone."""
        reader, *others = self._readers[function]
        if others or reader is None or reader.op != "select" or reader.arguments[1:].count(function) != 1:
            return None
        condition, chosen, _ = reader.arguments
        if chosen is not function or condition.op != "gt" or condition.arguments[0] is not operand:
            return None
        least = condition.arguments[1]
        return Interval(least.detail[0], INF) if least.op == "const" else None

    def _known(self, node: Node, depth: int = _DEPTH) -> Interval:
        if node.op == "const":
            return Interval.point(node.detail[0])
        if is_truth(node):
            return EITHER
        if node.op not in _FOLLOWED or depth == 0:
            return ANYTHING
        if node not in self._ranges:
            arguments = [self._known(argument, depth - 1) for argument in node.arguments]
            with np.errstate(all="ignore"):
                if node.op == "mul" and node.arguments[0] is node.arguments[1]:
                    self._ranges[node] = square(self._arithmetic, arguments[0])
                else:
                    self._ranges[node] = self._arithmetic.apply(node.op, *arguments)
        return self._ranges[node]

    def _counts(self, node: Node) -> bool:
        """Whether a value is finite, and neither negative nor -0."""
        return self._known(node).finite and self._is_positive(node)

    def _is_positive(self, node: Node, depth: int = _DEPTH) -> bool:
        """Whether a value that is finite is not negative, nor -0."""
        if node.op == "const":
            return math.copysign(1.0, node.detail[0]) > 0
        if is_truth(node) or self._known(node).low > 0:
            return True
        if node.op not in ("add", "mul") or depth == 0:
            return False
        if node not in self._positive:
            self._positive[node] = all(self._is_positive(part, depth - 1) for part in node.arguments)
        return self._positive[node]
