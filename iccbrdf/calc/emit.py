"""Graph to ICC operators.

The emitter walks the graph from the outputs and leaves values on the stack in the order in which an
operator takes them.  What is used more than once goes to a temporary at its first use (`tsav`) and comes
back with `tget`; what only one side of a `select` uses is computed inside that side, what both sides or
later code use, before it.  Neighbouring values that the same operator computes are computed by one vector
operator.

The code has temporaries without numbers first.  When all their uses are known, those that are read one
after the other get neighbouring slots, so that one `tget` reads both.  No slot is used twice, so that what a
value is called is the name of its slots.

Only operators that all implementations have are written, and no empty `else` (implementations differ).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TypeAlias

import numpy as np

from iccbrdf.calc.graph import Graph, Node, is_elementwise, needed_by, takes
from iccbrdf.calc.operators import OPERATORS, Kind, Operand
from iccbrdf.calc.program import MAX_NESTING, Op, Program, Temporary
from iccbrdf.errors import LimitError

_BY_SCALAR = {"add": "sadd", "sub": "ssub", "mul": "smul", "div": "sdiv", "pow": "gama"}
"""Operators of a vector and one scalar, by the operator whose second operand would repeat it."""

_VIEWS = ("pack", "pick", "splat")
"""What needs no temporary: it is a part of something that has one, or made of such."""

_LEAST_CONSTANTS = 3
"""Constants pushed twice are worth a temporary from this number of them, with one operator for each."""


@dataclass(eq=False)
class _Block:
    """Neighbouring temporaries that are written together."""

    width: int
    names: tuple[tuple[str, int, int], ...] = ()
    """Those of the values in it, each with its offset and its width."""
    slot: int = 0


@dataclass(frozen=True)
class _Store:
    name: str
    block: _Block


@dataclass(frozen=True)
class _Load:
    block: _Block
    offset: int
    width: int

    @property
    def whole(self) -> bool:
        return self.width == self.block.width


@dataclass
class _If:
    then: list[_Item] = field(default_factory=list)
    otherwise: list[_Item] = field(default_factory=list)


_Item: TypeAlias = Op | _Store | _Load | _If


def emit(graph: Graph) -> tuple[Program, tuple[Temporary, ...]]:
    """Return the operators that compute the graph's outputs, the first of them to output channel 0.

    With them come the names that the graph has for values which the operators store.
    """
    emitter = _Emitter(graph)
    _perform(emitter.push(graph.outputs))
    code = _with_copies(emitter.code)
    blocks = _assign_slots(code)
    program = (*_flatten(code), operator("out", 0, sum(node.width for node in graph.outputs)))
    named = (
        Temporary(name, block.slot + offset, width) for block in blocks for name, offset, width in block.names
    )
    return program, tuple(sorted(named, key=lambda temporary: temporary.slot))


def operator(name: str, *operands: int) -> Op:
    """An operator of the table with the operands of its text form, `operator("sum", 3)` for `sum(3)`."""
    kind = OPERATORS[name].operand
    first, second = (*operands, 0, 0)[:2]
    if kind is Operand.COUNT:
        s, t = first - 1, 0
    elif kind is Operand.COUNT_FROM_TWO:
        s, t = first - 2, 0
    elif kind is Operand.PAIR:
        s, t = first - 1, second - 1
    elif kind is Operand.RANGE:
        s, t = first, second - 1
    else:
        return Op(name, first)
    if not (0 <= s <= 0xFFFF and 0 <= t <= 0xFFFF):
        raise LimitError(f"{name}{operands}: a program has no room for vectors or temporaries of this size")
    return Op(name, s << 16 | t)


def number(value: float) -> Op:
    """The operator that pushes a constant, rounded to float32 here and nowhere else."""
    if value == math.pi:
        return Op("pi")
    with np.errstate(over="ignore"):
        rounded = np.float32(value)
    if np.isnan(rounded):
        return Op("NaN")
    if np.isinf(rounded):
        return Op("+INF" if rounded > 0 else "-INF")
    return Op("data", int(rounded.view(np.uint32)))


# Walking the graph -------------------------------------------------------------------------------------


_Task: TypeAlias = Iterator["_Task"]
"""A step of the walk that yields the steps to be done before it goes on."""


def _perform(task: _Task) -> None:
    """Do a step: a recursion with a stack of its own, as graphs are deeper than Python calls may be."""
    stack = [task]
    while stack:
        for inner in stack[-1]:
            stack.append(inner)
            break
        else:
            stack.pop()


class _Emitter:
    """The walk.  Its methods that may go deeper are tasks for `_perform`."""

    def __init__(self, graph: Graph) -> None:
        live = graph.live()
        self.code: list[_Item] = []
        self._stored: dict[Node, tuple[_Block, int]] = {}
        self._shared = _shared(graph, live)
        self._home = _homes(graph, live)
        self._behind = _reachable(live)
        self._names = graph.names

    def push(self, values: Sequence[Node]) -> _Task:
        """Leave values on the stack in order, and save the shared ones."""
        waiting = list(_unpacked(values))
        fresh: list[Node] = []
        while waiting:
            group = self._group(waiting)
            if fresh and not (self._is_new(group[0]) and self._independent(group, fresh)):
                self._store("tsav", fresh)
                fresh = []
                # What was just saved is read now, and may change what can be computed together.
                group = self._group(waiting)
            saved = self._is_new(group[0])
            yield self._compute(group)
            if saved:
                fresh.extend(group)
            del waiting[: len(group)]
        self._store("tsav", fresh)

    def _is_new(self, node: Node) -> bool:
        """Whether the node has to be saved when it is computed."""
        return node in self._shared and node not in self._stored

    def _independent(self, nodes: Sequence[Node], others: Sequence[Node]) -> bool:
        return not any(self._behind[node] >> other.index & 1 for node in nodes for other in others)

    def _group(self, waiting: Sequence[Node]) -> list[Node]:
        """The first of the values and those after it that one operator computes together with it."""
        first = waiting[0]
        group = [first]
        if first in self._stored or not is_elementwise(first.op) or _scalar_form(first):
            return group
        for node in waiting[1:]:
            alike = node.op == first.op and self._is_new(node) == self._is_new(first)
            if not alike or node in self._stored or _scalar_form(node):
                break
            if not self._independent([node], group):
                break
            group.append(node)
        return group

    def _store(self, name: str, nodes: Sequence[Node]) -> None:
        if not nodes:
            return
        offsets = (0, *accumulate(node.width for node in nodes))
        names = (
            (self._names[node], offset, node.width)
            for node, offset in zip(nodes, offsets, strict=False)
            if node in self._names
        )
        block = _Block(offsets[-1], tuple(names))
        self._stored.update((node, (block, offset)) for node, offset in zip(nodes, offsets, strict=False))
        self.code.append(_Store(name, block))

    def _compute(self, group: Sequence[Node]) -> _Task:
        node = group[0]
        if node in self._stored:
            block, offset = self._stored[node]
            self._load(block, offset, node.width)
        elif node.op == "const":
            self.code.extend(map(number, node.detail))
        elif node.op == "input":
            self.code.append(operator("in", node.detail, node.width))
        elif node.op == "env":
            self._variable(*node.detail)
        elif node.op == "pack":
            yield self.push(node.arguments)
        elif node.op == "pick":
            yield self._part(node)
        elif node.op == "splat":
            yield self.push(node.arguments)
            self.code.append(operator("copy", 1, node.width - 1))
        elif node.op == "rotl":
            yield self.push(node.arguments)
            self.code.append(operator("rotl", node.width, node.detail))
        elif node.op == "select":
            yield self._select(node)
        elif OPERATORS[node.op].kind is Kind.REDUCE:
            yield self.push(node.arguments)
            self.code.append(operator(node.op, node.arguments[0].width))
        else:
            yield self._apply(group)

    def _apply(self, group: Sequence[Node]) -> _Task:
        """One vector operator for all of the group: first operands of all, then second operands of all."""
        node = group[0]
        by_scalar = _scalar_form(node)
        if by_scalar:
            vector, scalar = by_scalar
            yield self.push([vector, scalar])
            self.code.append(operator(_BY_SCALAR[node.op], node.width))
            return
        yield self.push([member.arguments[k] for k in range(takes(node.op)) for member in group])
        self.code.append(operator(node.op, sum(member.arguments[0].width for member in group)))

    def _load(self, block: _Block, offset: int, width: int) -> None:
        last = self.code[-1] if self.code else None
        if isinstance(last, _Load) and last.block is block and last.offset + last.width == offset:
            self.code[-1] = _Load(block, last.offset, last.width + width)
        else:
            self.code.append(_Load(block, offset, width))

    def _variable(self, name: str, default: float) -> None:
        """An undefined variable gives 0 and a flag of 0, so that a default of 0 needs no test."""
        self.code.append(Op("env", int.from_bytes(name.ljust(4).encode("ascii"), "big")))
        if default == 0:
            self.code.append(operator("pop", 1))
        else:
            self.code += [operator("not", 1), _If(then=[operator("pop", 1), number(default)])]

    def _part(self, node: Node) -> _Task:
        vector = node.arguments[0]
        if vector not in self._stored:
            yield self._materialise(vector)
        block, offset = self._stored[vector]
        self._load(block, offset + node.detail, node.width)

    def _materialise(self, node: Node) -> _Task:
        """Compute a value to a temporary, with nothing left on the stack."""
        yield self._compute([node])
        self._store("tput", [node])

    def _select(self, node: Node) -> _Task:
        condition, yes, no = node.arguments
        yield self.push([condition])
        here = self._home[node]
        for needed in needed_by([yes, no], skip=self._stored.__contains__):
            inside = len(self._home[needed]) > len(here)
            if not inside and self._is_new(needed):
                yield self._materialise(needed)
        branch = _If()
        outer, known = self.code, self._stored.copy()
        for side, value in ((branch.then, yes), (branch.otherwise, no)):
            self.code = side
            yield self.push([value])
            self._stored = known.copy()
        self.code = outer
        self.code.append(branch)


def _scalar_form(node: Node) -> tuple[Node, Node] | None:
    """Vector and scalar, where a node is an operator of a vector and a repeated scalar."""
    if node.op not in _BY_SCALAR or node.width < 2:
        return None
    left, right = node.arguments
    if right.op == "splat":
        return left, right.arguments[0]
    if left.op == "splat" and node.op in ("add", "mul"):
        return right, left.arguments[0]
    return None


def _unpacked(values: Sequence[Node]) -> Iterator[Node]:
    for value in values:
        if value.op == "pack":
            yield from _unpacked(value.arguments)
        else:
            yield value


def _shared(graph: Graph, live: Sequence[Node]) -> set[Node]:
    """The nodes that need a temporary: they are pushed more than once, or in parts."""
    pushes: Counter[Node] = Counter(graph.outputs)
    in_parts = set()
    for node in reversed(live):
        # A view is not saved, so each push of it is one of what it shows.
        each = pushes[node] if node.op in _VIEWS else 1
        for argument in node.arguments:
            pushes[argument] += each
        if node.op == "pick":
            in_parts.add(node.arguments[0])
    return {node for node in live if _worth_saving(node) and (pushes[node] > 1 or node in in_parts)}


def _worth_saving(node: Node) -> bool:
    if node.op == "const":
        return node.width >= _LEAST_CONSTANTS
    return node.op not in ("input", *_VIEWS)


_Path: TypeAlias = tuple[tuple[int, int], ...]
"""A side of a select as the (select, side) on the way to it from the outside."""


def _homes(graph: Graph, live: Sequence[Node]) -> dict[Node, _Path]:
    """The innermost side of a select that contains all uses of a node."""
    homes: dict[Node, _Path] = dict.fromkeys(graph.outputs, ())
    for node in reversed(live):
        if len(homes[node]) > MAX_NESTING:
            raise LimitError(f"conditions are nested more than {MAX_NESTING} deep")
        for position, argument in enumerate(node.arguments):
            home = homes[node]
            if node.op == "select" and position > 0:
                home = (*home, (node.index, position))
            homes[argument] = _common(homes.get(argument, home), home)
    return homes


def _common(one: _Path, other: _Path) -> _Path:
    """The path to the innermost side that contains both."""
    length = 0
    while length < min(len(one), len(other)) and one[length] == other[length]:
        length += 1
    return one[:length]


def _reachable(live: Sequence[Node]) -> dict[Node, int]:
    """For each node a bit for itself and for every node that it is computed from."""
    bits: dict[Node, int] = {}
    for node in live:
        bits[node] = 1 << node.index
        for argument in node.arguments:
            bits[node] |= bits[argument]
    return bits


# Temporaries -------------------------------------------------------------------------------------------


def _sequences(code: list[_Item]) -> Iterator[list[_Item]]:
    """The code and all blocks in it."""
    yield code
    for item in code:
        if isinstance(item, _If):
            yield from _sequences(item.then)
            yield from _sequences(item.otherwise)


def _with_copies(code: list[_Item]) -> list[_Item]:
    """The code with `copy` where a value is read back just where it was saved, or several times in a row."""
    loads = Counter(
        item.block for sequence in _sequences(code) for item in sequence if isinstance(item, _Load)
    )

    def rewritten(sequence: list[_Item]) -> list[_Item]:
        result: list[_Item] = []
        position = 0
        while position < len(sequence):
            item = sequence[position]
            position += 1
            if isinstance(item, _If):
                result.append(_If(rewritten(item.then), rewritten(item.otherwise)))
                continue
            if isinstance(item, _Load):
                result.append(item)
                again = _run(item, sequence, position)
                if again > 1:
                    result.append(operator("copy", item.width, again))
                    position += again
                continue
            if not isinstance(item, _Store):
                result.append(item)
                continue
            repeats = 0
            while position < len(sequence) and _reads(sequence[position], item.block):
                repeats += 1
                position += 1
            saved = item.name == "tsav"
            if repeats == 0 or loads[item.block] > repeats:
                result.append(_Store("tsav" if repeats else item.name, item.block))
            copies = repeats if saved else repeats - 1
            if copies > 0:
                result.append(operator("copy", item.block.width, copies))
        return result

    return rewritten(code)


def _run(item: _Item, sequence: Sequence[_Item], position: int) -> int:
    """How many items from `position` on are `item`."""
    end = position
    while end < len(sequence) and sequence[end] == item:
        end += 1
    return end - position


def _reads(item: _Item, block: _Block) -> bool:
    return isinstance(item, _Load) and item.block is block and item.whole


def _assign_slots(code: list[_Item]) -> list[_Block]:
    """Number the temporaries, which are returned: those that are read one after the other are neighbours."""
    blocks: list[_Block] = []
    wishes: Counter[tuple[_Block, _Block]] = Counter()
    for sequence in _sequences(code):
        for left, right in zip([None, *sequence], sequence, strict=False):
            if isinstance(right, _Store):
                blocks.append(right.block)
            elif (
                isinstance(left, _Load)
                and isinstance(right, _Load)
                and left.offset + left.width == left.block.width
                and right.offset == 0
            ):
                wishes[left.block, right.block] += 1
    chain_of = {block: [block] for block in blocks}
    for (left_block, right_block), _ in wishes.most_common():
        before, after = chain_of[left_block], chain_of[right_block]
        if before is not after and before[-1] is left_block and after[0] is right_block:
            before.extend(after)
            chain_of.update(dict.fromkeys(after, before))
    slot = 0
    for block in blocks:
        for member in chain_of.pop(block, []):
            chain_of.pop(member, None)
            member.slot = slot
            slot += member.width
    return blocks


def _flatten(code: Sequence[_Item]) -> Program:
    """Operators of a sequence; neighbouring reads of neighbouring places become one."""
    program: list[Op] = []
    last: Op | None = None
    for item in code:
        if isinstance(item, _If):
            then, otherwise = _flatten(item.then), _flatten(item.otherwise)
            program.append(operator("if", len(then)))
            if otherwise:
                program.append(operator("else", len(otherwise)))
            program.extend((*then, *otherwise))
            last = None
            continue
        op = _numbered(item)
        if last and last.name == op.name and op.name in ("in", "tget") and last.s + last.t + 1 == op.s:
            op = operator(op.name, last.s, last.t + 1 + op.t + 1)
            program.pop()
        program.append(op)
        last = op
    return tuple(program)


def _numbered(item: Op | _Store | _Load) -> Op:
    if isinstance(item, _Store):
        return operator(item.name, item.block.slot, item.block.width)
    if isinstance(item, _Load):
        return operator("tget", item.block.slot + item.offset, item.width)
    return item
