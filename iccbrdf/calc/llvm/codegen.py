"""From a schedule to a function in LLVM assembly.

The function takes whole blocks of as many pixels as a vector has lanes: it loads their channels, computes
every node of the body as one vector, and stores the outputs.  A branch tests its condition and jumps over
a side that no pixel of the block needs.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iccbrdf.calc.graph import Node, is_truth
from iccbrdf.calc.intervals import Interval
from iccbrdf.calc.llvm import functions, lookup, wide
from iccbrdf.calc.llvm.assembler import Assembler, Type, Value
from iccbrdf.calc.llvm.operands import Masked, Operands
from iccbrdf.calc.llvm.order import in_turn
from iccbrdf.calc.llvm.rows import load_channels, store_channels
from iccbrdf.calc.llvm.target import Target
from iccbrdf.calc.schedule import Block, Branch, Schedule, computed
from iccbrdf.errors import UnsupportedError

ENTRY = "kernel"
"""The function: (pixels, out, number of blocks, arguments, tables)."""
MOST_INLINE = 48
"""Elementary functions up to which each is written out where it is used.  Beyond, calls take half the time to
compile, and code that is called stays in the processor's caches."""


@dataclass(frozen=True)
class Assembly:
    """A program as text, and what it is called with."""

    text: str
    lanes: int
    """Pixels of a block."""
    tables: tuple[NDArray[Any], ...]


def assemble(schedule: Schedule, target: Target) -> Assembly:
    """
    Write a schedule as LLVM assembly.  Equal schedules give equal text; tables are not part of it.

    Raises
    ------
    UnsupportedError
        For a node that this back end cannot run.
    """
    body = _Body(schedule, target)
    return Assembly(body.write(), body.type.lanes, tuple(body.tables.arrays))


class _Body:
    """A function in the making."""

    def __init__(self, schedule: Schedule, target: Target) -> None:
        self.schedule = schedule
        single = schedule.graph.dtype is np.float32
        self.type = Type("float", target.lanes) if single else Type("double", max(4, target.lanes // 2))
        called = sum(node.op in _SINGLE for node in computed(schedule.body)) > MOST_INLINE
        self.code = Assembler(target, self.type.element, inline=not called, block="loop")
        self.tables = lookup.Tables(self.code)
        self.values: dict[Node, Value] = {}
        self.several: dict[Node, list[Value]] = {}
        self.operands = Operands(schedule)
        found = ((node, self.operands.masked(node)) for node in computed(schedule.body))
        self.masked = {node: masked for node, masked in found if masked is not None}
        self.body = in_turn(_part(schedule.body, self._needed()), self._reads)
        self.as_numbers = frozenset(self._conditions_as_numbers())
        self.numbers: dict[Node, Value] = {}
        """Conditions as 1 and 0: made at once, as a processor has registers for few conditions."""

    def write(self) -> str:
        code, schedule, real = self.code, self.schedule, self.type.element
        read = code.scalar(f"mul i64 %i, {schedule.channels * self.type.lanes}")
        written = code.scalar(f"mul i64 %i, {len(schedule.graph.outputs) * self.type.lanes}")
        source, sink = code.address("%pixels", real, read), code.address("%out", real, written)
        self._inputs(source)
        self._arguments()
        self._block(self.body)
        store_channels(code, sink, [self.number(output) for output in schedule.graph.outputs])
        lines = [
            *code.needed.values(),
            f"define void @{ENTRY}(ptr noalias readonly %pixels, ptr noalias writeonly %out, i64 %blocks, "
            "ptr noalias readonly %arguments, ptr noalias readonly %tables) alignstack(64) {",
            "entry:",
            *code.buffers,
            *self.tables.prologue(),
            "  br label %loop",
            "loop:",
            f"  %i = phi i64 [ 0, %entry ], [ %next, %{code.block} ]",
            *code.lines,
            "  %next = add nuw nsw i64 %i, 1",
            "  %more = icmp ult i64 %next, %blocks",
            "  br i1 %more, label %loop, label %end",
            "end:",
            "  ret void",
            "}",
        ]
        return "\n".join(lines)

    def _inputs(self, source: str) -> None:
        schedule = self.schedule
        nodes = {n.detail: n for n in (*computed(schedule.body), *schedule.graph.outputs) if n.op == "input"}
        channels = load_channels(self.code, source, self.type, schedule.channels, nodes)
        self.values.update((node, channels[channel]) for channel, node in nodes.items())

    def _arguments(self) -> None:
        code = self.code
        for position, node in enumerate(self.schedule.arguments):
            value = code.load_broadcast("%arguments", self.type, position)
            self.values[node] = value.differs(0.0) if is_truth(node) else value

    def _block(self, block: Block) -> None:
        for item in block:
            if isinstance(item, Branch):
                self._branch(item)
            elif item.op != "input":
                self._node(item)

    def _branch(self, branch: Branch) -> None:
        condition = self.truth(branch.condition)
        self._side(condition, branch.yes, [select.arguments[1] for select in branch.selects])
        self._side(~condition, branch.no, [select.arguments[2] for select in branch.selects])
        for select in branch.selects:
            self._node(select)

    def _side(self, mask: Value, block: Block, wanted: Sequence[Node]) -> None:
        """Compute a block where any pixel needs it; what the selects read of it is known afterwards."""
        inside = set(computed(block))
        results = [node for node in dict.fromkeys(wanted) if node in inside and node.op != "input"]
        if not results:
            return

        def compute() -> list[Value]:
            self._block(block)
            return [self.values[node] for node in results]

        for node, value in zip(results, self.code.where_any(mask, compute), strict=True):
            self.values[node] = value
            self.numbers.pop(node, None)

    def _node(self, node: Node) -> None:
        if node.op in _SEVERAL:
            self.several[node] = _SEVERAL[node.op](self.tables, node.detail, self._numbers(node))
        elif node.op == "pick":
            self.values[node] = self.several[node.arguments[0]][node.detail]
        elif node.op == "select":
            condition, yes, no = node.arguments
            self.values[node] = self.code.select(self.truth(condition), self.number(yes), self.number(no))
        elif node.op == "curve":
            self.values[node] = lookup.curve(self.tables, node.detail, self.number(node.arguments[0]))
        elif node.op == "pow" and self.type.element == "float" and node.arguments[1].op == "const":
            self.values[node] = wide.known_power(self.number(node.arguments[0]), node.arguments[1].detail[0])
        elif node in self.masked:
            self.values[node] = self._masked(self.masked[node])
        elif node.op in _LOGIC:
            self.values[node] = _LOGIC[node.op](*map(self.truth, node.arguments))
        else:
            self.values[node] = self._function(node, self._numbers(node))
        if node in self.as_numbers:
            self.numbers[node] = self.number(node)

    def _function(self, node: Node, values: Sequence[Value]) -> Value:
        op = node.op
        if op in _OPERATORS:
            return _OPERATORS[op](*values)
        single = self.type.element == "float"
        if single and op in _PLAIN and self.operands.within(node, _PLAIN[op][0]):
            return self.code.apply(f"{op}.plain", _PLAIN[op][1], *values)
        special = _SINGLE if single else _DOUBLE
        if op not in special:
            raise UnsupportedError(f"{op} nodes cannot be run by LLVM")
        return self.code.apply(op, special[op], *values)

    def _masked(self, masked: Masked) -> Value:
        condition = self.truth(masked.condition)
        value = self.code.constant(1.0, self.type) if masked.value is None else self.number(masked.value)
        if masked.factor is not None:
            value = value * self.number(masked.factor)
        if masked.total is None:
            return self.code.select(condition, value, 0.0)
        total = self.number(masked.total)
        return self.code.select(condition, total + value, total)

    def _reads(self, node: Node) -> tuple[Node, ...]:
        """What is read where a node is computed."""
        return self.masked[node].reads if node in self.masked else node.arguments

    def _needed(self) -> set[Node]:
        """The nodes that are read, and those that they read."""
        needed: set[Node] = set()
        pending = list(self.schedule.graph.outputs)
        while pending:
            node = pending.pop()
            if node not in needed:
                needed.add(node)
                pending += self._reads(node)
        return needed

    def _conditions_as_numbers(self) -> Iterator[Node]:
        """The conditions that are read as numbers."""
        for node in computed(self.body):
            asked = {node.arguments[0]} if node.op == "select" else set()
            if node in self.masked:
                asked = {self.masked[node].condition}
            if node.op not in _LOGIC:
                yield from (read for read in self._reads(node) if is_truth(read) and read not in asked)

    def _numbers(self, node: Node) -> list[Value]:
        return [self.number(argument) for argument in node.arguments]

    def number(self, node: Node) -> Value:
        """A node's value as a number."""
        if node.op == "const":
            return self.code.constant(node.detail[0], self.type)
        if node in self.numbers:
            return self.numbers[node]
        value = self.values[node]
        return self.code.select(value, 1.0, 0.0, self.type) if is_truth(node) else value

    def truth(self, node: Node) -> Value:
        """A node's value as a condition."""
        return self.values[node] if is_truth(node) else self.number(node) >= 0.5


def _part(block: Block, nodes: Collection[Node]) -> Block:
    """A block with these nodes alone."""
    return tuple(
        Branch(item.condition, _part(item.yes, nodes), _part(item.no, nodes), item.selects)
        if isinstance(item, Branch)
        else item
        for item in block
        if isinstance(item, Branch) or item in nodes
    )


# What operators are ------------------------------------------------------------------------------------


def _intrinsic(name: str) -> Callable[..., Value]:
    return lambda *values: values[0].code.intrinsic(name, *values)


def _library(name: str) -> Callable[..., Value]:
    return lambda *values: values[0].code.each_lane(name, *values)


def _sign(a: Value) -> Value:
    code = a.code
    return code.select(a > 0.0, 1.0, code.select(a < 0.0, -1.0, 0.0, a.type))


def _to_int32(a: Value) -> Value:
    """C's cast to a 32-bit int as x86 does it; see meanings.to_int32."""
    code = a.code
    return code.select(abs(a) < 2.0**31, code.intrinsic("trunc", a) + 0.0, -(2.0**31))


def _round(a: Value) -> Value:
    code = a.code
    x = code.widen(a)
    return code.narrow(_to_int32(code.select(x < 0.0, x - 0.5, x + 0.5)), a.type)


def _choice(test: Callable[[Value, Value], Value]) -> Callable[[Value, Value], Value]:
    return lambda a, b: a.code.select(test(a, b), a, b)


def _modulo(a: Value, b: Value) -> Value:
    return a.code.select(b.equals(0.0), a, a.code.each_lane("fmod", a, b))


_OPERATORS: Mapping[str, Callable[..., Value]] = {
    "neg": lambda a: -a,
    "abs": abs,
    "sqrt": _intrinsic("sqrt"),
    "flor": _intrinsic("floor"),
    "ceil": _intrinsic("ceil"),
    "trnc": _to_int32,
    "rond": _round,
    "sign": _sign,
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "vmin": _choice(lambda a, b: a < b),
    "vmax": _choice(lambda a, b: a > b),
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "eq": lambda a, b: a.equals(b),
    "neq": lambda a, b: a.differs(b),
    "ge": lambda a, b: a >= b,
    "gt": lambda a, b: a > b,
    "rnum": lambda a: abs(a) < np.inf,
}

_SINGLE: Mapping[str, Callable[..., Value]] = {
    "exp": functions.exp,
    "log": wide.log10,
    "ln": wide.ln,
    "pow": wide.power,
    "cbrt": functions.cbrt,
    "sin": functions.sin,
    "cos": functions.cos,
    "tan": functions.tan,
    "asin": functions.asin,
    "acos": functions.acos,
    "atan": functions.atan,
    "atn2": functions.angle,
    "mod": functions.modulo,
}

_PLAIN: Mapping[str, tuple[Interval, Callable[[Value], Value]]] = {
    "exp": (functions.EXP_PLAIN, functions.exp_plain),
    "cbrt": (functions.CBRT_PLAIN, functions.cbrt_plain),
    "sin": (functions.SIN_PLAIN, functions.sin_plain),
}
"""The same for operands that lie in a range."""

_DOUBLE: Mapping[str, Callable[..., Value]] = {
    "exp": _library("exp"),
    "log": _library("log10"),
    "ln": _library("log"),
    "pow": _library("pow"),
    "cbrt": _library("cbrt"),
    "sin": _library("sin"),
    "cos": _library("cos"),
    "tan": _library("tan"),
    "asin": _library("asin"),
    "acos": _library("acos"),
    "atan": _library("atan"),
    "atn2": lambda x, y: x.code.each_lane("atan2", y, x),
    "mod": _modulo,
}

_LOGIC: Mapping[str, Callable[..., Value]] = {
    "not": lambda a: ~a,
    "vand": lambda a, b: a & b,
    "vor": lambda a, b: a | b,
    "vxor": lambda a, b: a ^ b,
}

_SEVERAL: Mapping[str, Callable[[lookup.Tables, Any, Sequence[Value]], list[Value]]] = {
    "clut": lookup.look_up,
    "tint": lookup.tint,
}
