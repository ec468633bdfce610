"""From a lifted graph to an order of work: once a run, for every pixel, or only where a condition holds.

What depends on constants and run-time variables alone is computed once a run, by the operator table.  The
rest is a block of nodes in order; selects by one condition are gathered in a branch with what only one
of their sides needs, so that a tile on which all pixels agree need not compute the other side.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from iccbrdf.calc import elements
from iccbrdf.calc.graph import Graph, Node, is_truth, meaning, needed_by
from iccbrdf.calc.meanings import solve
from iccbrdf.calc.program import signature

Block: TypeAlias = "tuple[Node | Branch, ...]"
"""In order of computation: whatever something reads comes before it."""


@dataclass(frozen=True)
class Branch:
    """Selects by one condition, and what only their sides need."""

    condition: Node
    yes: Block
    """What is needed only where the condition holds."""
    no: Block
    """What is needed only where it does not."""
    selects: tuple[Node, ...]
    """The select nodes, to be computed after the two blocks."""


@dataclass(frozen=True)
class Schedule:
    """What a back end runs; the outputs are those of the graph."""

    graph: Graph
    channels: int
    """The number of input channels."""
    uniform: tuple[Node, ...]
    """What the arguments are computed from: nodes that depend on constants and run-time variables alone."""
    arguments: tuple[Node, ...]
    """Nodes of this kind that the body or the outputs read, but for constants."""
    body: Block
    """What differs from pixel to pixel."""


LEAST_WORK = 16
"""Cost of the sides from which a branch is worth its test."""
MAX_ARRANGED = 3_000
"""Nodes up to which branches are looked for: the bits that say what is behind what grow with the square."""

_COST = {
    "div": 4, "sqrt": 4, "mod": 8, "exp": 8, "log": 8, "ln": 8, "cbrt": 8, "sin": 10, "cos": 10, "tan": 12,
    "asin": 10, "acos": 10, "atan": 10, "atn2": 12, "pow": 16, "curve": 40, "tint": 30, "clut": 60,
    "solve": 200, "pick": 0,
}  # fmt: skip
"""Rough times in units of an addition, for the choice of branches alone."""


def cost(node: Node) -> int:
    """About how long a node takes, in units of an addition."""
    return _COST.get(node.op, 1)


def schedule(graph: Graph, channels: int) -> Schedule:
    """Arrange a lifted graph of `channels` input channels for running."""
    live = graph.live()
    uniform: set[Node] = set()
    for node in live:
        if node.op != "input" and all(argument in uniform for argument in node.arguments):
            uniform.add(node)
    varying = [node for node in live if node not in uniform]
    read = dict.fromkeys(argument for node in varying for argument in node.arguments)
    read |= dict.fromkeys(graph.outputs)
    arguments = sorted((n for n in read if n in uniform and n.op != "const"), key=lambda node: node.index)
    return Schedule(
        graph=graph,
        channels=channels,
        uniform=tuple(needed_by(arguments)),
        arguments=tuple(arguments),
        body=_arrange(varying, [output for output in graph.outputs if output not in uniform]),
    )


def computed(block: Block) -> Iterator[Node]:
    """All nodes of a block and of the branches in it, in order."""
    for item in block:
        if isinstance(item, Branch):
            yield from computed(item.yes)
            yield from computed(item.no)
            yield from item.selects
        else:
            yield item


# Once a run --------------------------------------------------------------------------------------------


def uniform_values(plan: Schedule, env: Mapping[str, float]) -> list[np.generic]:
    """The values of `plan.arguments` for these run-time variables: numbers of the graph's type, or bools."""
    dtype = plan.graph.dtype
    known = {signature(name): value for name, value in env.items()}
    values: dict[Node, Any] = {}
    with np.errstate(all="ignore"):
        for node in plan.uniform:
            arguments = [values[argument] for argument in node.arguments]
            values[node] = _uniform(node, arguments, known, env, dtype)
    return [np.bool_(values[node]) if is_truth(node) else dtype(values[node]) for node in plan.arguments]


def _uniform(
    node: Node, values: Sequence[Any], known: Mapping[int, float], env: Mapping[str, float], dtype: Any
) -> Any:
    if node.op == "const":
        return dtype(node.detail[0])
    if node.op == "variable":
        return dtype(known.get(signature(node.detail), 0.0))
    if node.op == "defined":
        return dtype(signature(node.detail) in known)
    if node.op == "select":
        return values[1] if values[0] >= 0.5 else values[2]
    if node.op == "pick":
        return values[0][node.detail]
    if node.op == "curve":
        return elements.apply_curve(node.detail, values[0], env)
    if node.op in ("clut", "tint"):
        return elements.apply(node.detail, values, dtype=dtype)
    if node.op == "solve":
        rows, columns = node.detail
        return solve(values, rows - 1, columns - 1)
    function = meaning(node.op)
    if function is None:
        raise TypeError(f"{node.op} has no meaning of its own")
    return function(*values)


# For every pixel ---------------------------------------------------------------------------------------


@dataclass(eq=False)
class _Group:
    """Selects by one condition that can be computed at one place."""

    condition: Node
    selects: list[Node]
    behind: int
    """A bit for each node that the selects are computed from, as far as known when they were added."""


_Unit: TypeAlias = "Node | _Group"
_Path: TypeAlias = "tuple[tuple[_Group, int], ...]"
"""The way to a block: (group, side) from the outside, side 1 for yes and 2 for no."""


def _arrange(varying: Sequence[Node], outputs: Sequence[Node]) -> Block:
    inside = set(varying)
    group_of = _groups(varying, inside) if len(varying) <= MAX_ARRANGED else {}
    units = _in_order([group_of.get(output, output) for output in outputs], group_of, inside)
    units = _soon(units, group_of, inside)
    paths = _paths(units, outputs, group_of, inside)
    kept = _worthwhile(units, paths)
    blocks: dict[_Path, list[Node | Branch]] = {}
    for unit in units:
        path = tuple(step for step in paths[unit] if step[0] in kept)
        target = blocks.setdefault(path, [])
        if isinstance(unit, Node):
            target.append(unit)
        elif unit not in kept:
            target.extend(unit.selects)
        else:
            yes, no = (tuple(blocks.get((*path, (unit, side)), ())) for side in (1, 2))
            target.append(Branch(unit.condition, yes, no, tuple(unit.selects)))
    return tuple(blocks.get((), ()))


def _groups(varying: Sequence[Node], inside: set[Node]) -> dict[Node, _Group]:
    """Each select's group.  No group is computed from itself by way of others."""
    behind: dict[Node, int] = {}
    open_groups: dict[Node, _Group] = {}
    groups: list[_Group] = []
    group_of: dict[Node, _Group] = {}
    for node in varying:
        bits = 0
        for argument in node.arguments:
            if argument in inside:
                bits |= behind[argument] | 1 << argument.index
        behind[node] = bits
        if node.op != "select":
            continue
        group = open_groups.get(node.arguments[0])
        if group is None or _closure(bits, groups) & _members(group):
            group = _Group(node.arguments[0], [], 0)
            groups.append(group)
            open_groups[node.arguments[0]] = group
        group.selects.append(node)
        group.behind |= bits
        group_of[node] = group
    return group_of


def _members(group: _Group) -> int:
    return sum(1 << select.index for select in group.selects)


def _closure(bits: int, groups: Sequence[_Group]) -> int:
    """`bits` with all that the groups met on the way are computed from."""
    pending = [group for group in groups if bits & group.behind != group.behind]
    changed = True
    while changed:
        changed = False
        for group in pending:
            if bits & _members(group) and bits | group.behind != bits:
                bits |= group.behind
                changed = True
    return bits


def _sources(unit: _Unit, group_of: Mapping[Node, _Group], inside: set[Node]) -> Iterator[tuple[_Unit, int]]:
    """What a unit is computed from, each with the side (1, 2; 0: always) that reads it."""
    for node in [unit] if isinstance(unit, Node) else unit.selects:
        for position, argument in enumerate(node.arguments):
            if argument in inside:
                yield group_of.get(argument, argument), position if node.op == "select" else 0


def _in_order(
    roots: Iterable[_Unit], group_of: Mapping[Node, _Group], inside: set[Node]
) -> list[_Unit]:
    """All units, each after those that it is computed from, depth first: values are used soon after."""
    order: dict[_Unit, None] = {}
    for root in roots:
        stack: list[tuple[_Unit, Iterator[tuple[_Unit, int]]]] = [(root, _sources(root, group_of, inside))]
        while stack:
            following = next((source for source, _ in stack[-1][1] if source not in order), None)
            if following is None:
                order.setdefault(stack.pop()[0])
            else:
                stack.append((following, _sources(following, group_of, inside)))
    return list(order)


def _soon(units: Sequence[_Unit], group_of: Mapping[Node, _Group], inside: set[Node]) -> list[_Unit]:
    """The same order, but what is the last to read something comes as soon as it can: less has to be kept."""
    sources = {unit: {source for source, _ in _sources(unit, group_of, inside)} for unit in units}
    # By unit, what has yet to read it; a dict, as the order counts.
    waiting: dict[_Unit, dict[_Unit, None]] = {unit: {} for unit in units}
    for unit, read in sources.items():
        for source in read:
            waiting[source][unit] = None
    missing = {unit: len(read) for unit, read in sources.items()}
    order: dict[_Unit, None] = {}
    for first in units:
        stack = [first]
        while stack:
            unit = stack.pop()
            if unit in order:
                continue
            order[unit] = None
            near = list(waiting[unit])
            for reader in near:
                missing[reader] -= 1
            for source in sources[unit]:
                del waiting[source][unit]
                if len(waiting[source]) == 1:
                    near += waiting[source]
            stack += [
                reader
                for reader in near
                if not missing[reader] and any(len(waiting[source]) == 1 for source in sources[reader])
            ]
    return list(order)


def _paths(
    units: Sequence[_Unit], outputs: Sequence[Node], group_of: Mapping[Node, _Group], inside: set[Node]
) -> dict[_Unit, _Path]:
    """The innermost block that contains all uses of each unit."""
    paths: dict[_Unit, _Path] = {group_of.get(output, output): () for output in outputs}
    for unit in reversed(units):
        for source, side in _sources(unit, group_of, inside):
            path = paths[unit]
            if side and isinstance(unit, _Group):
                path = (*path, (unit, side))
            paths[source] = _common(paths.get(source, path), path)
    return paths


def _common(one: _Path, other: _Path) -> _Path:
    length = 0
    while length < min(len(one), len(other)) and one[length] == other[length]:
        length += 1
    return one[:length]


def _worthwhile(units: Sequence[_Unit], paths: Mapping[_Unit, _Path]) -> set[_Group]:
    """The groups whose sides hold enough work to be branches."""
    work: dict[_Group, int] = {}
    for unit in units:
        units_cost = cost(unit) if isinstance(unit, Node) else len(unit.selects)
        for group, _ in paths[unit]:
            work[group] = work.get(group, 0) + units_cost
    return {group for group, total in work.items() if total >= LEAST_WORK}
