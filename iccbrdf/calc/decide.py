"""What is decided in a graph for values in a box, and the graph without it.

`Decider` goes over a graph of `specialise.hold` with intervals, for the channels and run-time variables of
one box: products with 0, sums with what is 0, the least of two whose ranges do not meet, conditions.  `fold`
leaves them out.  This is quicker than the analysis of ranges.py, and knows less.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import TypeAlias

import numpy as np

from iccbrdf.calc.exact_passes import EXACT_PASSES
from iccbrdf.calc.graph import LOGIC, TRUTHS, Graph, Node, is_truth
from iccbrdf.calc.intervals import ANYTHING, EITHER, FALSE, TRUE, Arithmetic, Interval, square
from iccbrdf.calc.passes import Report, optimise, uniform
from iccbrdf.calc.program import signature
from iccbrdf.calc.specialise import SIGNATURE_LENGTH, Question, is_product_with, variable_of
from iccbrdf.calc.table_ranges import curve_range, table_range

MAX_BEHIND = 300
"""A value that is computed from more others is taken to be anything: looking at them would not pay."""

Decisions: TypeAlias = "Mapping[Node, Node | float]"
"""By node, the operand or the number that it is equal to."""


class Decider:
    """Finds what is decided in a graph of `hold`, from where the channels and the run-time variables are."""

    def __init__(self, graph: Graph, yes: Collection[Question]) -> None:
        self._zeros_held = any(question.zero for question in yes)
        self._arithmetic = Arithmetic(graph.dtype)
        self._live = graph.live()
        self._near = set(_near(self._live))
        self._varying: set[Node] = set()
        for node in self._live:
            if node.op == "input" or not self._varying.isdisjoint(node.arguments):
                self._varying.add(node)

    def decide(
        self, low: Sequence[float], high: Sequence[float], env: Mapping[str, float]
    ) -> Decisions | None:
        """
        What holds for all pixels whose channels are within `low` and `high`, under these variables.

        None where a constant channel may be 0 and it matters which zero: tiles are not asked for its sign.
        """
        with np.errstate(all="ignore"):
            values = self._values(low, high, env)
            signed = self._signed(values)
            if any(self._is_held(node) and values[node].holds(0.0) for node in signed):
                return None
            found: dict[Node, Node | float] = {}
            zeros = {node for node in self._live if uniform(node) == 0}
            for node in self._live:
                if node not in self._varying or node not in self._near or node in signed:
                    continue
                choice = _choice(node, values, zeros)
                if choice is not None:
                    found[node] = choice
                if choice in zeros or (choice == 0 and not is_truth(node)):
                    zeros.add(node)
            return found

    def _is_held(self, node: Node) -> bool:
        """Whether it is a constant channel, or a number that may stand for one."""
        if node.op == "variable":
            return len(node.detail) > SIGNATURE_LENGTH
        return self._zeros_held and node.op == "const"

    def _values(
        self, low: Sequence[float], high: Sequence[float], env: Mapping[str, float]
    ) -> dict[Node, Interval]:
        known = {signature(name): value for name, value in env.items()}
        channels = {variable_of(i): i for i in range(len(low))}
        values: dict[Node, Interval] = {}
        for node in self._live:
            if node.op == "input":
                value = Interval(low[node.detail], high[node.detail])
            elif node.op == "variable" and node.detail in channels:
                channel = channels[node.detail]
                value = Interval(low[channel], high[channel])
            elif node.op == "variable":
                value = Interval.point(self._arithmetic.round(known.get(signature(node.detail), 0.0)))
            elif node.op == "defined":
                value = TRUE if signature(node.detail) in known else FALSE
            elif node.op == "const":
                value = Interval.point(node.detail[0])
            elif node in self._near and node.op not in _SEVERAL:
                value = self._value(node, values)
            else:
                value = EITHER if is_truth(node) else ANYTHING
            values[node] = value
        return values

    def _value(self, node: Node, values: Mapping[Node, Interval]) -> Interval:
        a = self._arithmetic
        operands = [values[argument] for argument in node.arguments]
        if node.op == "select":
            condition, yes, no = operands
            return yes if condition == TRUE else no if condition == FALSE else yes.join(no)
        if node.op == "pick":
            (source,) = node.arguments
            if source.op == "solve":
                return EITHER if node.detail == source.width - 1 else ANYTHING
            position = [values[argument] for argument in source.arguments]
            return table_range(a, source.detail.table, position, node.detail)
        if node.op == "curve":
            return curve_range(a, node.detail, operands[0])
        if node.op == "mul" and node.arguments[0] is node.arguments[1]:
            return square(a, operands[0])
        return a.apply(node.op, *operands)

    def _signed(self, values: Mapping[Node, Interval]) -> set[Node]:
        """The nodes that may be 0 where it matters which zero: 1 / 0 and 1 / -0 are far apart."""
        signed: set[Node] = set()
        for node in reversed(self._live):
            first, last = node.arguments[:1], node.arguments[-1:]
            if node.op in ("div", "pow"):
                asks = last if node.op == "div" else first
            elif node.op in _SIGN_MATTERS:
                asks = node.arguments
            else:
                asks = ()
            signed.update(argument for argument in asks if values[argument].holds(0.0))
            if node in signed and not _forgets_sign(node):
                signed.update(node.arguments)
        return signed


_SEVERAL = ("clut", "tint", "solve")
_SIGN_MATTERS = ("atn2", "curve", "solve")
"""Operators for which it may matter which zero an operand is; beside quotients and powers."""
_SIGNLESS = TRUTHS | {"abs", "exp", "cos", "log", "ln"}
"""Operators that give the same for both zeros."""


def _forgets_sign(node: Node) -> bool:
    return node.op in _SIGNLESS or (node.op == "mul" and node.arguments[0] is node.arguments[1])


def _near(live: Sequence[Node]) -> Iterator[Node]:
    """The nodes that no more than `MAX_BEHIND` others are computed from."""
    behind: dict[Node, int] = {}
    for position, node in enumerate(live):
        if not all(argument in behind for argument in node.arguments):
            continue
        bits = reduce(or_, (behind[argument] for argument in node.arguments), 0)
        if bits.bit_count() <= MAX_BEHIND:
            behind[node] = bits | 1 << position
            yield node


def _choice(node: Node, values: Mapping[Node, Interval], zeros: Collection[Node]) -> Node | float | None:
    """What a node is equal to; None if that is not decided.

    Only `zeros` count as 0: what run-time variables make 0 is so for one light alone.
    """
    value = values[node]
    first, last = node.arguments[:1], node.arguments[-1:]
    if is_truth(node):
        return value.low if value in (TRUE, FALSE) else None
    if is_product_with(zeros, node.op, node.arguments):
        return 0.0 if value == Interval(0.0, 0.0) else None
    if node.op in ("add", "sub") and last[0] in zeros:
        return first[0]
    if node.op == "add" and first[0] in zeros:
        return last[0]
    if node.op == "select" and values[first[0]] in (TRUE, FALSE):
        return node.arguments[1 if values[first[0]] == TRUE else 2]
    if node.op in ("vmin", "vmax"):
        return _extreme(node, values)
    return None


def _extreme(node: Node, values: Mapping[Node, Interval]) -> Node | None:
    """The least, or the greatest, of two whose ranges do not meet."""
    one, other = node.arguments
    x, y = values[one], values[other]
    if x.nan or y.nan or not (x.high < y.low or y.high < x.low):
        return None
    return one if (x.high < y.low) == (node.op == "vmin") else other


def fold(graph: Graph, decisions: Decisions) -> tuple[Graph, tuple[Report, ...]]:
    """The graph of `hold` less what is decided."""
    result = Graph(dtype=graph.dtype)
    replaced: dict[Node, Node] = {}
    changes: Counter[str] = Counter()
    for node in graph.live():
        choice = decisions.get(node)
        if isinstance(choice, Node):
            replaced[node] = replaced[choice]
        elif choice is not None:
            replaced[node] = result.const(choice)
        else:
            arguments = [replaced[argument] for argument in node.arguments]
            replaced[node] = result.again(node, arguments)
            continue
        changes[_description(node)] += 1
    result.outputs = tuple(replaced[output] for output in graph.outputs)
    report = Report("fold what is decided", len(replaced), len(result.live()), tuple(changes.most_common()))
    result, reports = optimise(result, EXACT_PASSES)
    return result, (report, *reports)


def _description(node: Node) -> str:
    if is_truth(node):
        return "logic" if node.op in LOGIC else "condition"
    return _DESCRIPTIONS.get(node.op, "value that is 0")


_DESCRIPTIONS = {
    "vmin": "least",
    "vmax": "greatest",
    "add": "sum with 0",
    "sub": "sum with 0",
    "mul": "product with 0",
    "div": "quotient of 0",
    "select": "selection",
}
