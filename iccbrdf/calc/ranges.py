"""Interval analysis of lifted graphs: where every value is, and which operations can fail.

A value is computed as an interval from those of its operands, in the *context* in which it is wanted: inside
of a select's sides it is known whether the condition holds, and what follows from that (`x > eps` cuts x).
Expressions whose operands depend on each other are recognised by their shape (range_rules.py).  Where an
operation still might fail, the analysis looks for a proof by cases: a condition holds or not, a least is
one of its operands, or a value in between lies in one of several pieces.  What fails in no case is safe.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import TypeAlias

import numpy as np

from iccbrdf.calc.graph import Graph, Node, is_truth
from iccbrdf.calc.hazards import Hazard, hazard_of
from iccbrdf.calc.intervals import (
    ANYTHING,
    EITHER,
    EMPTY,
    FALSE,
    INF,
    TRUE,
    Arithmetic,
    Interval,
    square,
)
from iccbrdf.calc.range_rules import Fact, Shapes, chain, consequences, two_sided
from iccbrdf.calc.table_ranges import curve_range, table_range

Range: TypeAlias = tuple[float, float]
"""Least and greatest value; finite numbers."""

VARIABLE_RANGE: Range = (-1000.0, 1000.0)
"""Where a run-time variable is taken to be, if nothing else is said."""

MAX_CONTEXTUAL = 10_000
"""Nodes of a graph up to which contexts are used; selects of larger ones may be either side, always."""
MAX_EVALUATIONS = 100_000
"""Values computed in contexts, after which no new contexts are made."""
MAX_TRIALS = 50_000
"""Values computed in proofs by cases, after which none is tried."""
_MAX_TRIALS_EACH = 20_000
"""The same for one operation."""
_MAX_PIECES = 32
"""Pieces that a range is cut into."""
_MAX_CONSEQUENCES = 200
"""Facts that are drawn from an assumption."""
_FEW = 4
"""Conditions and chains that cases are made of, for one operation."""
_NUMBERS = 12
"""Values in between that cases are made of, for one operation."""


@dataclass(frozen=True)
class Analysis:
    """What is known of the values of a graph.

    Attributes
    ----------
    ranges : mapping of Node to Interval
        By node of width 1, where its value is for every pixel that needs it: a node that only one side
        of a select needs, where the condition says so.  Nodes that no output needs are missing.
    hazards : tuple of Hazard
        Operations that may fail, in the order of their nodes.  Empty: all outputs are finite.
    """

    ranges: Mapping[Node, Interval]
    hazards: tuple[Hazard, ...]


def analyse(
    graph: Graph,
    inputs: Sequence[Range],
    variables: Mapping[str, Range] | None = None,
    *,
    others: Range | None = VARIABLE_RANGE,
) -> Analysis:
    """
    Find where the values of a graph are.

    Parameters
    ----------
    graph
        As lifted (calc/lift.py), optimised or not.
    inputs
        The range of each input channel.
    variables
        The ranges of run-time variables that are defined.
    others
        The range of any other variable, which may be defined or not; None: they are undefined.

    Notes
    -----
    Ranges hold for numbers computed in the graph's type by the interpreter and by any back end.
    """
    with np.errstate(all="ignore"):
        analyser = _Analyser(graph, inputs, variables or {}, others)
        return analyser.analysis()


@dataclass(eq=False)
class _Context:
    """What is known besides the ranges of inputs and variables."""

    parent: _Context | None = None
    trial: bool = False
    """Whether this is one of the cases of a proof."""
    facts: dict[Node, Interval] = field(default_factory=dict)
    mask: int = 0
    """A bit for each node of the facts."""
    outer: int = 0
    """The bits of all contexts around this one."""
    alike: dict[Node, Node] = field(default_factory=dict)
    """Least or greatest values, by the operand that they are equal to."""
    values: dict[Node, Interval] = field(default_factory=dict)
    """Of the nodes that the facts matter to."""
    unsafe: set[Node] = field(default_factory=set)
    """In a trial, nodes that may fail here, or are given what has failed."""
    sides: dict[tuple[Node, Interval], _Context | None] = field(default_factory=dict)


_Request: TypeAlias = tuple[Node, _Context]
_Wanted: TypeAlias = Generator[_Request, Interval, Interval]
"""An evaluation: it asks for other values, is sent them, and returns its own.  So it needs no recursion."""
_Attempt: TypeAlias = Generator[_Request, Interval, "Interval | None"]
_Case: TypeAlias = "tuple[list[Fact], dict[Node, Node]]"
"""Facts, and least or greatest values with the operand that they are equal to."""


@dataclass(frozen=True)
class _Claim:
    """That a node does not fail, for which its `operand` may be to blame, or that it is not 0."""

    node: Node
    operand: Node | None = None
    not_zero: bool = False

    def badness(self, value: Interval) -> float:
        """How near the claim is to being false."""
        if value.empty:
            return -INF
        return -value.mignitude if self.not_zero else value.magnitude


class _Analyser:
    def __init__(
        self, graph: Graph, inputs: Sequence[Range], variables: Mapping[str, Range], others: Range | None
    ) -> None:
        self.graph = graph
        self.inputs, self.variables, self.others = inputs, variables, others
        self.arithmetic = Arithmetic(graph.dtype)
        self.live = graph.live()
        self.users: dict[Node, list[Node]] = {node: [] for node in self.live}
        self.bit: dict[Node, int] = {}
        self.behind: dict[Node, int] = {}
        self.contextual = len(self.live) <= MAX_CONTEXTUAL
        self.root = _Context()
        self.ranges: dict[Node, Interval] = {}
        self.hazards: dict[Node, Hazard] = {}
        self.tables: dict[tuple[Node, tuple[Interval, ...]], Interval] = {}
        self.given_up: set[tuple[_Claim, _Context]] = set()
        self.evaluations = self.trials = self.allowed = 0
        for position, node in enumerate(self.live):
            self.bit[node] = 1 << position if self.contextual else 0
            self.behind[node] = 0
            for argument in node.arguments:
                self.users[argument].append(node)
                self.behind[node] |= self.behind[argument] | self.bit[argument]

    def analysis(self) -> Analysis:
        for output in self.graph.outputs:
            value = self.value(output, self.root)
            if not (value.finite or self.hazards):
                self.hazards[output] = Hazard("output", output, output, value)
        hazards = sorted(self.hazards.values(), key=lambda hazard: hazard.node.index)
        return Analysis(self.ranges, tuple(hazards))

    # Values --------------------------------------------------------------------------------------------

    def value(self, node: Node, context: _Context) -> Interval:
        """The range of a node, by way of those that it asks for."""
        stack = [self.evaluate(node, context)]
        answer: Interval | None = None
        while stack:
            try:
                wanted, where = stack[-1].send(answer)  # type: ignore[arg-type]
            except StopIteration as done:
                answer = done.value
                stack.pop()
                continue
            where = self.home(wanted, where)
            answer = where.values.get(wanted)
            if answer is None:
                stack.append(self.evaluate(wanted, where))
        return answer or EMPTY

    def home(self, node: Node, context: _Context) -> _Context:
        """The outermost context that knows all about a node that this one does."""
        reach = self.behind[node] | self.bit[node]
        while context.parent is not None and not reach & context.mask:
            context = context.parent
        return context

    def known(self, node: Node, context: _Context | None) -> Interval:
        """What is known of a node without computing anything."""
        found = EITHER if is_truth(node) else ANYTHING
        if node.op == "const":
            return Interval.point(node.detail[0])
        while context is not None:
            if node in context.values:
                return found.meet(context.values[node])
            if node in context.facts:
                found = found.meet(context.facts[node])
            context = context.parent
        return found

    def evaluate(self, node: Node, context: _Context) -> _Wanted:
        """The range of a node in a context that matters to it."""
        self.evaluations += 1
        self.trials += context.trial
        if context.parent is not None and not self.behind[node] & context.mask:
            value = yield node, context.parent
        else:
            value = yield from self.compute(node, context)
        value = value.meet(context.facts.get(node, ANYTHING))
        if context.parent is not None:
            value = value.meet(self.known(node, context.parent))
        context.values[node] = value
        if not context.trial and not value.empty:
            self.ranges[node] = value.join(self.ranges.get(node, value))
        return value

    def compute(self, node: Node, context: _Context) -> _Wanted:
        if node.op == "const":
            return Interval.point(node.detail[0])
        if node.op == "input":
            return self.rounded(self.inputs[node.detail])
        if node.op in ("variable", "defined"):
            return self.variable(node)
        if node.op == "select":
            return (yield from self.select(node, context))
        arguments = []
        # Nodes of several results are looked at one by one.
        for argument in (node.arguments[0] if node.op == "pick" else node).arguments:
            arguments.append((yield argument, context))
        value = self.apply(node, arguments, context)
        hazard = hazard_of(self.arithmetic, node, arguments, value)
        if context.trial:
            # What is given something that is not finite proves nothing.
            if hazard is not None or not all(argument.finite or argument.empty for argument in arguments):
                context.unsafe.add(node)
            return value
        return value if hazard is None else (yield from self.examine(node, arguments, context, hazard))

    def rounded(self, limits: Range) -> Interval:
        low, high = (self.arithmetic.round(limit) for limit in limits)
        return Interval(low, high)

    def variable(self, node: Node) -> Interval:
        """A variable is 0 where it is undefined."""
        limits = self.variables.get(node.detail, self.others)
        certain = node.detail in self.variables
        if node.op == "defined":
            return TRUE if certain else EITHER if limits else FALSE
        value = self.rounded(limits) if limits else Interval.point(0.0)
        return value if certain else value.join(Interval.point(0.0))

    def select(self, node: Node, context: _Context) -> _Wanted:
        condition, *sides = node.arguments
        holds = yield condition, context
        value = EMPTY
        for case, side in zip((TRUE, FALSE), sides, strict=True):
            if holds.meet(case).empty:
                continue
            inside = context if holds == case else self.side(condition, case, context)
            if inside is not None:
                value = value.join((yield side, inside))
        return value

    def apply(self, node: Node, arguments: Sequence[Interval], context: _Context) -> Interval:
        a = self.arithmetic
        if any(argument.empty for argument in arguments):
            return EMPTY
        if node.op in ("pick", "curve"):
            return self.looked_up(node, tuple(arguments))
        if node.op == "mul" and node.arguments[0] is node.arguments[1]:
            return square(a, arguments[0])
        shapes = Shapes(
            a, lambda other: self.known(other, context), lambda other: context.alike.get(other, other)
        )
        return shapes.narrowed(node, a.apply(node.op, *arguments))

    def looked_up(self, node: Node, arguments: tuple[Interval, ...]) -> Interval:
        """The values of a curve or of one result of a node of several; tables are large, so only once."""
        key = node, arguments
        if key not in self.tables:
            if node.op == "curve":
                self.tables[key] = curve_range(self.arithmetic, node.detail, arguments[0])
            else:
                self.tables[key] = _component(self.arithmetic, node, arguments)
        return self.tables[key]

    # Contexts ------------------------------------------------------------------------------------------

    def side(self, condition: Node, case: Interval, context: _Context) -> _Context | None:
        """The context of a side of a select; None where no pixel comes there."""
        if not self.contextual or self.evaluations > MAX_EVALUATIONS:
            return context
        key = condition, case
        if key not in context.sides:
            context.sides[key] = self.assume([(condition, case)], context)
        return context.sides[key]

    def assume(
        self,
        facts: Iterable[Fact],
        context: _Context,
        *,
        trial: bool = False,
        alike: Mapping[Node, Node] = {},
    ) -> _Context | None:
        """A context in which `facts` hold, and what follows from them; None where they contradict it."""
        inside = _Context(context, trial or context.trial, alike={**context.alike, **alike})

        def known(node: Node) -> Interval:
            return self.known(node, inside)

        inside.outer = context.outer | context.mask
        pending = [(node, value, True) for node, value in facts]
        for _ in range(_MAX_CONSEQUENCES):
            if not pending:
                break
            node, value, certain = pending.pop()
            before = known(node)
            value = before.meet(value)
            if is_truth(node):
                value = Interval(math.ceil(value.low), math.floor(value.high)) if not value.empty else EMPTY
            if value.empty:
                return None
            if value != before or (certain and node not in inside.facts):
                inside.facts[node] = value
                inside.mask |= self.bit[node]
                # What is known of its users may now say more of their operands.
                users = [user for user in self.users[node] if self.bit[user] & (inside.outer | inside.mask)]
                for other in (node, *users):
                    found = consequences(self.arithmetic, other, known(other), known)
                    pending += ((operand, where, two_sided(other)) for operand, where in found)
        return inside

    # Proofs by cases -----------------------------------------------------------------------------------

    def examine(self, node: Node, arguments: list[Interval], context: _Context, hazard: Hazard) -> _Wanted:
        """The range of a node that may fail, after a search for a proof that it does not."""
        self.allowed = min(self.trials + _MAX_TRIALS_EACH, MAX_TRIALS)
        if hazard.kind == "division" and node.op == "div":
            divisor = hazard.operand
            where = self.home(divisor, context)
            better = yield from self.by_cases(_Claim(divisor, not_zero=True), where)
            if better is not None:
                arguments[1] = where.values[divisor] = arguments[1].meet(better)
        value = self.apply(node, arguments, context)
        remaining = hazard_of(self.arithmetic, node, arguments, value)
        if remaining is not None:
            better = yield from self.by_cases(_Claim(node, remaining.operand), context)
            if better is not None:
                return better
            self.hazards[node] = remaining
        return value

    def by_cases(self, claim: _Claim, context: _Context, *, nested: bool = False) -> _Attempt:
        """The range of the claim's node if it is true in all of some cases; None where that is not seen."""
        if not self.contextual or (claim, context) in self.given_up or self.trials > self.allowed:
            return None
        # The search itself takes time, too.
        self.trials += self.behind[claim.node].bit_count() // 16
        for cases in self.enumerated(claim.node, context, nested):
            value = yield from self.by_list(claim, cases, context, nested)
            if value is not None:
                return value
        if not nested:
            for node in self.numbers(claim, context):
                value = yield from self.by_pieces(claim, node, context)
                if value is not None:
                    return value
        self.given_up.add((claim, context))
        return None

    def by_list(self, claim: _Claim, cases: Iterable[_Case], context: _Context, nested: bool) -> _Attempt:
        value = EMPTY
        for facts, alike in cases:
            inside = self.assume(facts, context, trial=True, alike=alike)
            one = yield from self.case(claim, inside)
            if one is None and not nested and inside is not None:
                one = yield from self.by_cases(claim, inside, nested=True)
            if one is None:
                return None
            value = value.join(one)
        return value

    def case(self, claim: _Claim, inside: _Context | None) -> _Attempt:
        """The range of the claim's node in one case; None where the claim may be false."""
        if inside is None:
            return EMPTY
        if self.trials > self.allowed:
            return None
        value = yield claim.node, inside
        unsafe = claim.node in self.home(claim.node, inside).unsafe
        return None if (value.holds(0.0) if claim.not_zero else unsafe) else value

    def by_pieces(self, claim: _Claim, node: Node, context: _Context) -> _Attempt:
        """Cases by where `node` is: pieces are halved until the claim is true in all, and then the worst."""
        waiting = [self.known(node, context)]
        done: list[tuple[Interval, Interval]] = []
        for _ in range(_MAX_PIECES):
            if not waiting:
                done.sort(key=lambda pair: claim.badness(pair[0]))
                waiting = _halves(self.arithmetic, done[-1][1])
                if not waiting:
                    break
                done.pop()
            piece = waiting.pop()
            value = yield from self.case(claim, self.assume([(node, piece)], context, trial=True))
            if value is not None:
                done.append((value, piece))
                continue
            halves = _halves(self.arithmetic, piece)
            if not halves:
                return None
            waiting += halves
        for piece in waiting:
            value = yield from self.case(claim, self.assume([(node, piece)], context, trial=True))
            if value is None:
                return None
            done.append((value, piece))
        return reduce(Interval.join, (value for value, _ in done))

    # What cases are made of ----------------------------------------------------------------------------

    def before(self, node: Node) -> Iterator[Node]:
        """The nodes that a node is computed from, the nearest first."""
        bits = self.behind[node]
        while bits:
            position = bits.bit_length() - 1
            bits ^= 1 << position
            yield self.live[position]

    def uses(self, node: Node, target: Node) -> list[Node]:
        """The users of a node on the way to the target."""
        reach = self.behind[target] | self.bit[target]
        return [user for user in self.users[node] if self.bit[user] & reach]

    def enumerated(self, target: Node, context: _Context, nested: bool) -> Iterator[list[_Case]]:
        """Conditions, which hold or not, and chains of `vmin` or `vmax`, which are equal to an operand."""
        conditions: list[tuple[int, int, Node]] = []
        chains: list[tuple[int, Node]] = []
        for node in self.before(target):
            uses = self.uses(node, target)
            if is_truth(node):
                if node.op != "defined" and self.known(node, context) == EITHER:
                    decided = sum(user.op == "select" for user in uses)
                    conditions.append((decided, len(uses), node))
            elif node.op in ("vmin", "vmax") and all(user.op != node.op for user in uses):
                chains.append((len(chain(node, node.op)), node))
        # The most promising: what decides most selects, what has most operands, and of equals the nearest.
        conditions.sort(key=lambda ranked: ranked[:2], reverse=True)
        chains.sort(key=lambda ranked: ranked[0], reverse=True)
        if not nested:
            for *_, condition in conditions[:_FEW]:
                yield [([(condition, TRUE)], {}), ([(condition, FALSE)], {})]
        for _, top in chains[:_FEW]:
            value = self.known(top, context)
            yield [([(top, value), (part, value)], {top: part}) for part in chain(top, top.op)]

    def numbers(self, claim: _Claim, context: _Context) -> list[Node]:
        """Values that the claim's node depends on in more than one way; its operand, if around 0."""
        found = []
        for node in self.before(claim.node):
            value = self.known(node, context)
            divisible = not is_truth(node) and value.finite and value.low < value.high
            around = node is claim.operand and value.low < 0 < value.high
            if divisible and (around or len(self.uses(node, claim.node)) > 1):
                found.append(node)
            if len(found) == _NUMBERS:
                break
        return found


def _component(a: Arithmetic, node: Node, arguments: Sequence[Interval]) -> Interval:
    """One result of a node that has several."""
    source, index = node.arguments[0], node.detail
    if source.op == "solve":
        return EITHER if index == source.width - 1 else ANYTHING
    return table_range(a, source.detail.table, arguments, index)


def _halves(a: Arithmetic, x: Interval) -> list[Interval]:
    """Two pieces, divided at 0, in the middle, or between far-off magnitudes; none of what is one number."""
    if x.low < 0 < x.high:
        middle = 0.0
    else:
        least, most = x.mignitude, x.magnitude
        middle = (least + most) / 2
        if least < most / 4:
            middle = math.sqrt(max(least, most * 2.0**-40)) * math.sqrt(most)
        middle = a.round(math.copysign(middle, x.low + x.high))
    return [Interval(x.low, middle), Interval(middle, x.high)] if x.low < middle < x.high else []
