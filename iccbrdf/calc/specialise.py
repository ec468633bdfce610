"""Graphs for pixels that have something in common: channels that are constant, or that stand for 0.

A tile of an image is asked a few questions (`questions`): is the normal the same everywhere, is there no
gloss?  The answers make its kind.  A kind's graph comes from the graph for all pixels in two steps: `hold`
puts a run-time variable in the place of a constant channel, so that what depends on such channels alone is
computed once a tile, and 0 in the place of one that decodes to 0; `fold` (calc/decide.py) leaves out what is
decided then.

Every number that the reduced graph computes is the one that the whole graph computes, but for the sign of a
zero, where no division can see it.  What is computed once a tile comes from the operator table, in the whole
graph from its back end: for + - * / and roots both are equal to the bit, for other functions they may differ
by the few units in the last place that back ends are allowed.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from iccbrdf.calc.exact_passes import EXACT_PASSES
from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.passes import Report, optimise, uniform
from iccbrdf.calc.schedule import cost

MAX_QUESTIONS = 3
"""Each doubles the number of kinds, and each kind is compiled."""
_LEAST_GAIN = 0.1
"""Part of the work that a further question has to spare."""
_AFFINE = ("mul", "add", "sub", "div", "neg")


# Questions ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Question:
    """Whether each of these channels has one value all over a tile; with `zero`, one that decodes to 0."""

    name: str
    channels: tuple[int, ...]
    zero: bool

    def __str__(self) -> str:
        return f"{self.name} {'0' if self.zero else 'constant'}"


def questions(graph: Graph, names: Sequence[str]) -> tuple[Question, ...]:
    """
    What to ask of a tile: the questions that spare most work, at most `MAX_QUESTIONS`.

    names: of the input channels.  Those that only differ behind their dot are asked for together.
    """
    read = {node.detail for node in graph.live() if node.op == "input"}
    candidates = list(_candidates({i: name for i, name in enumerate(names) if i in read}))
    whole = work(graph, ())
    chosen: list[Question] = []
    kinds = {frozenset[Question](): whole}
    while whole and len(chosen) < MAX_QUESTIONS:
        asked = [question.channels for question in chosen]
        mean = statistics.mean(kinds.values())
        options = []
        for question in (each for each in candidates if each.channels not in asked):
            more = {kind | {question}: work(graph, kind | {question}) for kind in kinds}
            options.append((mean - statistics.mean(more.values()), question, more))
        # Channels that are 0 are rarer than constant ones.
        gain, best, more = max(
            options, key=lambda option: option[0] / (2 if option[1].zero else 1), default=(0.0, None, {})
        )
        if best is None or gain < _LEAST_GAIN * whole:
            break
        chosen.append(best)
        kinds |= more
    return tuple(chosen)


def _candidates(names: Mapping[int, str]) -> Iterator[Question]:
    families: dict[str, list[int]] = {}
    plain = [i for i, name in names.items() if "." not in name]
    for i, name in names.items():
        families.setdefault(name.rpartition(".")[0] or name, []).append(i)
    for family, channels in families.items():
        for zero in (False, True):
            yield Question(family, tuple(channels), zero)
    if len(plain) > 1:
        yield Question(", ".join(names[i] for i in plain), tuple(plain), False)


def work(graph: Graph, yes: Collection[Question]) -> int:
    """About how long a pixel takes where these are answered by yes, in units of an addition.

    Products with 0 count as left out.
    """
    constant, zero_ends = _held(graph, yes)
    once: set[Node] = set()
    zeros: set[Node] = set()
    instead: dict[Node, Node] = {}
    for node in graph.live():
        arguments = [instead[argument] for argument in node.arguments]
        instead[node] = node
        if node in zero_ends or uniform(node) == 0 or is_product_with(zeros, node.op, arguments):
            zeros.add(node)
            once.add(node)
        elif node.op == "input":
            once |= {node} if node.detail in constant else set()
        elif all(argument in once for argument in arguments):
            once.add(node)
        elif node.op in ("add", "sub") and arguments[1] in zeros:
            instead[node] = arguments[0]
        elif node.op == "add" and arguments[0] in zeros:
            instead[node] = arguments[1]
    needed: set[Node] = set()
    pending = [instead[output] for output in graph.outputs]
    while pending:
        node = pending.pop()
        if node not in needed and node not in once:
            needed.add(node)
            pending.extend(instead[argument] for argument in node.arguments)
    return sum(map(cost, needed))


def work_of_all(graph: Graph) -> int:
    """About how long a pixel takes in the graph as it is, in units of an addition."""
    varying: set[Node] = set()
    for node in graph.live():
        if node.op == "input" or not varying.isdisjoint(node.arguments):
            varying.add(node)
    return sum(map(cost, varying))


def is_product_with(zeros: Collection[Node], op: str, arguments: Sequence[Node]) -> bool:
    return (op == "mul" and any(argument in zeros for argument in arguments)) or (
        op == "div" and arguments[0] in zeros
    )


def _held(graph: Graph, yes: Collection[Question]) -> tuple[set[int], set[Node]]:
    """The channels that are constant, and the decoded values that are 0."""
    chains = decodings(graph) if any(question.zero for question in yes) else {}
    constant: set[int] = set()
    zero: set[Node] = set()
    for question in yes:
        constant.update(question.channels)
        if question.zero:
            zero.update(chains[i][-1] for i in question.channels if i in chains)
    return constant, zero


# Decoding ----------------------------------------------------------------------------------------------


def decodings(graph: Graph) -> dict[int, tuple[Node, ...]]:
    """By channel, its node and those that do nothing but scale and shift it, as a matrix decodes it."""
    users: dict[Node, list[Node]] = {}
    live = graph.live()
    for node in live:
        for argument in node.arguments:
            users.setdefault(argument, []).append(node)
    found = {}
    for node in live:
        if node.op != "input":
            continue
        chain = [node]
        while len(users.get(chain[-1], ())) == 1 and chain[-1] not in graph.outputs:
            (user,) = users[chain[-1]]
            others = [argument for argument in user.arguments if argument is not chain[-1]]
            if user.op not in _AFFINE or any(other.op != "const" for other in others):
                break
            if user.op == "div" and user.arguments[1] is chain[-1]:
                break
            chain.append(user)
        found[node.detail] = tuple(chain)
    return found


def decoded(chain: Sequence[Node], values: Any) -> Any:
    """What values of a channel, of the graph's type, are after these nodes of `decodings`."""
    for before, node in pairwise(chain):
        function = OPERATORS[node.op].function
        operands = [
            values if argument is before else values.dtype.type(argument.detail[0])
            for argument in node.arguments
        ]
        values = function(*operands) if function is not None else values
    return values


# Constant channels -------------------------------------------------------------------------------------


SIGNATURE_LENGTH = 4


def variable_of(channel: int) -> str:
    """The run-time variable for a constant channel; programs know no variables with names so long."""
    return f"channel {channel}"


def hold(graph: Graph, yes: Collection[Question]) -> tuple[Graph, tuple[Report, ...]]:
    """The graph for tiles of which these are answered by yes, with variables of `variable_of`."""
    constant, zero = _held(graph, yes)
    result = Graph(dtype=graph.dtype)
    replaced: dict[Node, Node] = {}
    changes: Counter[str] = Counter()
    for node in graph.live():
        if node in zero:
            replaced[node] = result.const(0.0)
            changes["channel that is 0"] += 1
        elif node.op == "input" and node.detail in constant:
            replaced[node] = result.add("variable", detail=variable_of(node.detail))
            changes["constant channel"] += 1
        else:
            arguments = [replaced[argument] for argument in node.arguments]
            replaced[node] = result.again(node, arguments)
    result.outputs = tuple(replaced[output] for output in graph.outputs)
    report = Report("hold channels", len(replaced), len(result.nodes), tuple(changes.most_common()))
    result, reports = optimise(result, EXACT_PASSES)
    return result, (report, *reports)
