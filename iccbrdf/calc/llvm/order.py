"""The order in which the nodes of a block are written, so that a processor need not wait for results.

A schedule follows each value to its end before it begins another one.  There an instruction mostly waits for
the one before it, for four cycles and more, while a processor that could begin two in each looks for others
among a few hundred at most.  So the next node is the first one in the schedule's order whose arguments are
there, if each instruction takes its turn.  Further apart than that, values would leave the registers.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from typing import TypeAlias

from iccbrdf.calc.graph import Node, is_truth
from iccbrdf.calc.schedule import Block, Branch, computed

Reads: TypeAlias = Callable[[Node], Iterable[Node]]
"""What is read where a node is computed."""

_INSTRUCTIONS = {
    "exp": 30, "log": 80, "ln": 80, "pow": 120, "cbrt": 30, "sin": 30, "cos": 30, "tan": 50, "asin": 50,
    "acos": 50, "atan": 50, "atn2": 50, "mod": 40, "sign": 4, "curve": 300, "clut": 300, "tint": 100,
    "pick": 0, "input": 0,
}  # fmt: skip
"""About how many a node takes, where it is not one."""
_WAIT = {
    "div": 34, "sqrt": 40, "exp": 120, "log": 200, "ln": 200, "pow": 300, "cbrt": 180, "sin": 140, "cos": 140,
    "tan": 180, "asin": 240, "acos": 240, "atan": 180, "atn2": 180, "mod": 160,
}  # fmt: skip
"""Half cycles from a node's end to its result, where they are not those of a sum."""
_SUM = 8


def in_turn(block: Block, reads: Reads) -> Block:
    """The items of a block, and of the branches in it, in the order in which they are to be written."""
    items = [_inside(item, reads) for item in block]
    read = [tuple(_read(item, reads)) for item in items]
    place = {node: position for position, item in enumerate(items) for node in computed((item,))}
    turn = _turns(read)
    waits_for = [
        {place[node] for node in nodes if place.get(node, position) != position}
        for position, nodes in enumerate(read)
    ]
    readers: list[list[int]] = [[] for _ in items]
    for position, sources in enumerate(waits_for):
        for source in sources:
            readers[source].append(position)
    missing = [len(sources) for sources in waits_for]
    ready = [(turn[position], position) for position, count in enumerate(missing) if count == 0]
    heapq.heapify(ready)
    arriving: list[tuple[int, int]] = []
    there = [0] * len(items)
    order = []
    now = 0
    while ready or arriving:
        if not ready:
            now = max(now, arriving[0][0])
        while arriving and arriving[0][0] <= now:
            position = heapq.heappop(arriving)[1]
            heapq.heappush(ready, (turn[position], position))
        _, position = heapq.heappop(ready)
        order.append(position)
        now += _instructions(items[position])
        for reader in readers[position]:
            there[reader] = max(there[reader], now + _wait(items[position]))
            missing[reader] -= 1
            if missing[reader] == 0:
                heapq.heappush(arriving, (there[reader], reader))
    return tuple(_conditions_late([items[position] for position in order], reads))


def _turns(read: Sequence[Sequence[Node]]) -> list[int]:
    """The turn of each item: its place, or that of the first item that reads one of its conditions.

    So all that a condition decides is written together.
    """
    first: dict[Node, int] = {}
    turns = []
    for position, nodes in enumerate(read):
        decided = (first.setdefault(node, position) for node in nodes if is_truth(node))
        turns.append(min(decided, default=position))
    return turns


def _conditions_late(order: Sequence[Node | Branch], reads: Reads) -> Iterator[Node | Branch]:
    """The items in their order, but conditions where they are first read: few registers hold them."""
    waiting: dict[Node, int] = {}
    for position, item in enumerate(order):
        if isinstance(item, Node) and is_truth(item):
            waiting[item] = position
            continue
        for node in sorted(_behind(item, waiting, reads), key=waiting.__getitem__):
            del waiting[node]
            yield node
        yield item
    yield from waiting


def _behind(item: Node | Branch, conditions: Container[Node], reads: Reads) -> set[Node]:
    """Those of some conditions that an item is decided by, directly or by way of others of them."""
    found: set[Node] = set()
    pending: list[Node | Branch] = [item]
    while pending:
        fresh = {node for node in _read(pending.pop(), reads) if node in conditions} - found
        found |= fresh
        pending += fresh
    return found


def _inside(item: Node | Branch, reads: Reads) -> Node | Branch:
    if isinstance(item, Node):
        return item
    return Branch(item.condition, in_turn(item.yes, reads), in_turn(item.no, reads), item.selects)


def _read(item: Node | Branch, reads: Reads) -> Iterator[Node]:
    for node in computed((item,)):
        yield from reads(node)
    if isinstance(item, Branch):
        yield item.condition


def _instructions(item: Node | Branch) -> int:
    return sum(_INSTRUCTIONS.get(node.op, 1) for node in computed((item,)))


def _wait(item: Node | Branch) -> int:
    return _WAIT.get(item.op, _SUM) if isinstance(item, Node) else _SUM
