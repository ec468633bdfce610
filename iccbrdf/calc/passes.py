"""Passes from graph to a graph that computes the same with less.

A rule looks at one node and returns the node to take in its place, or None.  Every rule gives the same
numbers for all finite inputs (-0 counts as 0); what would change them in the last bit, such as another
order of a sum, or would hide an overflow, such as 0 x = 0, is not here.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from iccbrdf.calc.graph import Graph, Node, check, evaluate

MAX_VISITS = 1 << 16
"""Nodes that `optimise` looks at, each as often as it is looked at; programs of ours need a thousandth."""

Rule: TypeAlias = Callable[[Graph, Node], Node | None]


@dataclass(frozen=True)
class Report:
    """What a pass did: numbers of live nodes, and how often each rule was used."""

    name: str
    before: int
    after: int
    changes: tuple[tuple[str, int], ...]

    def __str__(self) -> str:
        changes = ", ".join(f"{name} {count}" for name, count in self.changes) or "no change"
        return f"{self.name}: {self.before} -> {self.after} nodes ({changes})"


def known(node: Node) -> tuple[float, ...] | None:
    """The numbers of a constant, None for any other node."""
    if node.op == "const":
        return tuple(node.detail)
    if node.op == "splat" and node.arguments[0].op == "const":
        return tuple(node.arguments[0].detail) * node.width
    return None


def uniform(node: Node) -> float | None:
    """The number that all components of a constant are; None for any other node."""
    values = known(node)
    return values[0] if values and len(set(values)) == 1 else None


# Constants ---------------------------------------------------------------------------------------------


def constant(graph: Graph, node: Node) -> Node | None:
    """An operator on constants is a constant, in the graph's type; one that repeats a number is a splat."""
    if node.op == "splat" or not node.arguments:
        return None
    numbers: list[tuple[float, ...]] = []
    for argument in node.arguments:
        number = known(argument)
        if number is None:
            return None
        numbers.append(number)
    values = evaluate(node.op, numbers, node.detail, node.width, graph.dtype)
    if values is None:
        return None
    if len(values) > 1 and len(set(values)) == 1:
        return graph.splat(graph.const(values[0]), len(values))
    return graph.const(*values)


def known_condition(graph: Graph, node: Node) -> Node | None:
    """A select by a constant, or between equal sides, is one of them."""
    if node.op != "select":
        return None
    condition, yes, no = node.arguments
    if yes is no:
        return yes
    value = uniform(condition)
    return None if value is None else yes if value >= 0.5 else no


# Wiring ------------------------------------------------------------------------------------------------


def whole(graph: Graph, node: Node) -> Node | None:
    """A pick of everything, or a splat to one component, is its argument."""
    if node.op in ("pick", "splat") and node.width == node.arguments[0].width:
        return node.arguments[0]
    return None


def flat_pack(graph: Graph, node: Node) -> Node | None:
    """A pack in a pack is one pack; neighbouring picks of one vector are one pick."""
    if node.op != "pack":
        return None
    parts: list[Node] = []
    for argument in node.arguments:
        for part in argument.arguments if argument.op == "pack" else [argument]:
            joined = _joined(graph, parts[-1], part) if parts else None
            if joined is None:
                parts.append(part)
            else:
                parts[-1] = joined
    if tuple(parts) == node.arguments:
        return None
    return parts[0] if len(parts) == 1 else graph.pack(parts)


def _joined(graph: Graph, left: Node, right: Node) -> Node | None:
    """One node for what two neighbours in a pack read, where they read neighbours."""
    if left.op != right.op or left.op not in ("pick", "input") or left.arguments != right.arguments:
        return None
    if left.detail + left.width != right.detail:
        return None
    return graph.add(left.op, left.arguments, left.detail, left.width + right.width)


def direct_pick(graph: Graph, node: Node) -> Node | None:
    """A pick looks through picks, packs, splats, rotations and inputs."""
    if node.op != "pick":
        return None
    source, first = node.arguments[0], node.detail
    if source.op == "pick":
        return graph.pick(source.arguments[0], source.detail + first, node.width)
    if source.op == "input":
        return graph.input(source.detail + first, node.width)
    if source.op == "splat":
        return graph.splat(source.arguments[0], node.width)
    if source.op == "rotl" and node.width == 1:
        return graph.pick(source.arguments[0], (first + source.detail) % source.width)
    if source.op == "pack":
        return _pick_of_pack(graph, source.arguments, first, first + node.width)
    return None


def _pick_of_pack(graph: Graph, parts: Sequence[Node], first: int, end: int) -> Node:
    """Components `first` up to `end` of what `parts` would be as one vector."""
    picked = []
    start = 0
    for part in parts:
        low, high = max(first, start), min(end, start + part.width)
        if low < high:
            picked.append(graph.pick(part, low - start, high - low))
        start += part.width
    return picked[0] if len(picked) == 1 else graph.pack(picked)


# Arithmetic --------------------------------------------------------------------------------------------

_NEUTRAL = {"add": 0.0, "sub": 0.0, "mul": 1.0, "div": 1.0, "pow": 1.0}
"""x op neutral = x."""


def neutral(graph: Graph, node: Node) -> Node | None:
    """x + 0, x - 0, x 1, x / 1 and x^1 are x."""
    if node.op not in _NEUTRAL:
        return None
    left, right = node.arguments
    if uniform(right) == _NEUTRAL[node.op]:
        return left
    if node.op in ("add", "mul") and uniform(left) == _NEUTRAL[node.op]:
        return right
    return None


def square(graph: Graph, node: Node) -> Node | None:
    """x x and x^2 are sq(x)."""
    is_square = (node.op == "mul" and node.arguments[0] is node.arguments[1]) or (
        node.op == "pow" and uniform(node.arguments[1]) == 2
    )
    return graph.add("sq", node.arguments[:1]) if is_square else None


def sign(graph: Graph, node: Node) -> Node | None:
    """x + -y is x - y, x - -y is x + y, --x is x, (-x)^2 and |x|^2 are x^2."""
    if node.op in ("add", "sub") and node.arguments[1].op == "neg":
        other = {"add": "sub", "sub": "add"}[node.op]
        return graph.add(other, [node.arguments[0], node.arguments[1].arguments[0]])
    if node.op in ("neg", "sq", "abs") and node.arguments[0].op == "neg":
        inner = node.arguments[0].arguments[0]
        return inner if node.op == "neg" else graph.add(node.op, [inner])
    if node.op == "sq" and node.arguments[0].op == "abs":
        return graph.add("sq", node.arguments[0].arguments)
    return None


Passes: TypeAlias = tuple[tuple[str, tuple[Rule, ...]], ...]

PASSES: Passes = (
    ("fold constants", (constant, known_condition)),
    ("simplify", (whole, flat_pack, direct_pick, neutral, square, sign)),
)
"""The passes of templates in their order; each runs again until none finds anything to do."""


def rewrite(graph: Graph, rules: Sequence[Rule]) -> tuple[Graph, Counter[str]]:
    """
    Return a new graph in which the rules are applied to every live node once, and how often each was.

    Only what the outputs need is rebuilt, so that this also removes dead nodes and shares equal ones.  Where
    rules are given and none applies, the graph itself is returned.
    """
    changes: Counter[str] = Counter()
    live = graph.live()
    if rules and not any(rule(graph, node) for node in live for rule in rules):
        return graph, changes
    result = Graph(dtype=graph.dtype)
    replaced: dict[Node, Node] = {}
    for node in live:
        arguments = [replaced[argument] for argument in node.arguments]
        candidate = result.again(node, arguments)
        for rule in rules:
            better = rule(result, candidate)
            if better is not None:
                result.require(better)
                changes[rule.__name__.replace("_", " ")] += 1
                candidate = better
                break
        replaced[node] = candidate
        if node in graph.names:
            result.names.setdefault(candidate, graph.names[node])
    result.outputs = tuple(replaced[output] for output in graph.outputs)
    return result, changes


def optimise(graph: Graph, passes: Passes = PASSES) -> tuple[Graph, tuple[Report, ...]]:
    """Return the graph after all of `passes`, with no dead nodes, and one report for each pass.

    Passes end early where they have looked at MAX_VISITS nodes: a program may be made so that each of them
    finds one thing to do, as often as it has operators.
    """
    check(graph)
    total, live, repeated = len(graph.nodes), len(graph.live()), graph.shared
    reports = [
        Report("share", total + repeated, total, _counted("repeated", repeated)),
        Report("remove dead code", total, live, _counted("unused", total - live)),
    ]
    # Each pass runs until it and all others have found nothing to do since anything changed.
    idle = visits = 0
    for name, rules in itertools.cycle(passes):
        if idle == len(passes) or visits > MAX_VISITS:
            break
        visits += len(graph.nodes)
        rewritten, changes = rewrite(graph, rules)
        idle += 1
        if changes:
            idle = 0
            before, live = live, len(rewritten.live())
            reports.append(Report(name, before, live, tuple(changes.most_common())))
        graph = rewritten
    # Rules leave behind what they replaced; a rewriting without rules keeps what is live.
    graph, _ = rewrite(graph, ())
    check(graph)
    return graph, tuple(reports)


def _counted(what: str, count: int) -> tuple[tuple[str, int], ...]:
    return ((what, count),) if count else ()
