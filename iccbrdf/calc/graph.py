"""The graph between sources and targets: what a program computes, without saying how.

A node is a vector of 1..n numbers, computed once from other nodes (static single assignment).  Equal nodes
are one node: the graph finds a node by operator, arguments and detail before it makes a new one, so
whatever is written twice is shared.  Operators on vectors work element by element; the planes of an ICC
vector operator are the nodes' components.

Beside the calculator's own operators of the kinds EACH and REDUCE (calc/operators.py) there are

| op     | detail          | value                                                                |
|--------|-----------------|----------------------------------------------------------------------|
| const  | the numbers     | constants, float64 until a target rounds them                        |
| input  | first channel   | `width` input channels                                               |
| env    | name, default   | a run-time variable, or the default where it is undefined            |
| pack   |                 | all the arguments' components in one vector                          |
| pick   | first component | `width` components of the argument                                   |
| splat  |                 | a scalar repeated                                                    |
| rotl   | k               | the components rotated: component k comes first                      |
| select |                 | condition, yes, no: only the chosen one need be computed             |

An operator that gives several vectors (`tLab`: 3) has them one after the other in one node.

Graphs that are lifted from programs to be run (calc/lift.py) are plainer: every node is one number of the
working type, operators that others can express are expressed by them, and there are further kinds.

| op       | detail        | value                                                              |
|----------|---------------|--------------------------------------------------------------------|
| variable | name          | a run-time variable, 0 where it is undefined                       |
| defined  | name          | whether it is defined                                              |
| curve    | the curve     | one curve of a curve set                                           |
| clut     | the element   | a look-up table's outputs, read by `pick`                          |
| tint     | the element   | a tint array's outputs, read by `pick`                             |
| solve    | rows, columns | the unknowns and the flag of `solv`, read by `pick`                |

There the operators of TRUTHS take and give conditions, and a select's condition is one; `eq` and `neq` are
those of IEEE.  A condition that stands where a number is wanted is 1 or 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from iccbrdf.calc.meanings import compare
from iccbrdf.calc.operators import OPERATORS, Kind
from iccbrdf.errors import IccBrdfError

COMPARISONS = frozenset(("lt", "le", "eq", "neq", "ge", "gt"))
LOGIC = frozenset(("not", "vand", "vor", "vxor"))
TRUTHS = COMPARISONS | LOGIC | {"rnum", "defined"}
"""Operators whose value is a condition: 1 or 0 where a number is wanted."""


_LARGE = 1e38
"""Numbers below it are numbers in every type, and need no watch for overflow."""


class GraphError(IccBrdfError):
    """A graph breaks its own rules: a fault of the compiler, never of its input."""


@dataclass(eq=False, slots=True)
class Node:
    """One value; compared by identity, which in one graph is equality."""

    # Final, and not a frozen dataclass: those take three times as long to make.
    index: Final[int]
    op: Final[str]
    arguments: Final[tuple[Node, ...]]
    detail: Final[Any]
    width: Final[int]

    def __repr__(self) -> str:
        shown = [f"%{argument.index}" for argument in self.arguments]
        if self.detail is not None:
            shown.append(repr(self.detail))
        return f"%{self.index}[{self.width}] = {self.op}({', '.join(shown)})"


@dataclass
class Graph:
    """Nodes in an order in which each follows its arguments, and the ones that are the program's outputs."""

    nodes: list[Node] = field(default_factory=list)
    outputs: tuple[Node, ...] = ()
    dtype: type[np.floating[Any]] = np.float64
    """The type that constants are exact in, and are folded in."""
    shared: int = 0
    """How often an operator was asked for that was there already."""
    moves: int = 0
    """Values that programs moved while they were lifted into this graph."""
    assumes_finite: bool = False
    """Whether something was left out that matters where an input is not finite."""
    names: dict[Node, str] = field(default_factory=dict, repr=False)
    """What sources call nodes, for people; of several names for one value the first."""
    _known: dict[tuple[Any, ...], Node] = field(default_factory=dict, repr=False)

    def add(self, op: str, arguments: Sequence[Node] = (), detail: Any = None, width: int = 0) -> Node:
        """The node of this operator and these arguments; `width` matters where they leave it open."""
        return self._node(op, tuple(arguments), detail, width, None)

    def again(self, node: Node, arguments: Sequence[Node]) -> Node:
        """A node of another graph on arguments that stand for its own: `check` tells if widths differ."""
        return self._node(node.op, tuple(arguments), node.detail, node.width, node.width)

    def _node(self, op: str, arguments: tuple[Node, ...], detail: Any, asked: int, width: int | None) -> Node:
        # What is known already has a width: all that it hangs on is in the key.
        exact = None if detail is None else _exact(op, detail)
        key = (op, arguments, exact, asked if op in _OPEN else 0)
        node = self._known.get(key)
        if node is None:
            if width is None:
                width = _width(op, arguments, detail, asked)
            node = Node(len(self.nodes), op, arguments, detail, width)
            self.nodes.append(node)
            self._known[key] = node
        elif arguments:
            self.shared += 1
        return node

    def const(self, *values: float) -> Node:
        return self.add("const", detail=tuple(map(float, values)))

    def number(self, value: float) -> Node:
        """A constant, rounded to the graph's type."""
        if abs(value) < _LARGE:
            return self.const(float(self.dtype(value)))
        with np.errstate(over="ignore"):
            return self.const(float(self.dtype(value)))

    def apply(self, op: str, *arguments: Node) -> Node:
        """An operator that has nothing but arguments."""
        return self.add(op, arguments)

    def input(self, first: int, width: int = 1) -> Node:
        return self.add("input", detail=first, width=width)

    def env(self, name: str, default: float) -> Node:
        return self.add("env", detail=(name, default))

    def pack(self, parts: Sequence[Node]) -> Node:
        return self.add("pack", parts)

    def pick(self, vector: Node, first: int, width: int = 1) -> Node:
        return self.add("pick", [vector], first, width)

    def splat(self, scalar: Node, width: int) -> Node:
        return self.add("splat", [scalar], width=width)

    def rotl(self, vector: Node, k: int) -> Node:
        return self.add("rotl", [vector], k)

    def require(self, node: Node) -> None:
        """GraphError for a node of another graph."""
        if node.index >= len(self.nodes) or self.nodes[node.index] is not node:
            raise GraphError(f"{node} is of another graph")

    def live(self) -> list[Node]:
        """The nodes that the outputs need, in order."""
        needed = bytearray(len(self.nodes))
        for output in self.outputs:
            needed[output.index] = True
        # Each follows its arguments.
        for node in reversed(self.nodes):
            if needed[node.index]:
                for argument in node.arguments:
                    needed[argument.index] = True
        return [node for node in self.nodes if needed[node.index]]


def needed_by(nodes: Iterable[Node], skip: Callable[[Node], bool] = lambda node: False) -> list[Node]:
    """`nodes` and all that they are computed from, in order of index, less what is behind `skip`."""
    found: set[Node] = set()
    pending = list(nodes)
    while pending:
        node = pending.pop()
        if node not in found and not skip(node):
            found.add(node)
            pending.extend(node.arguments)
    return sorted(found, key=lambda node: node.index)


# Rules -------------------------------------------------------------------------------------------------


def _exact(op: str, detail: Any) -> Any:
    """What tells details apart."""
    if op == "const":
        return tuple(map(float.hex, detail))  # -0 and 0 are equal, but not equal constants
    if op in ("clut", "curve", "tint"):
        return id(detail)  # to compare tables would take as long as to read them
    return detail


def is_truth(node: Node) -> bool:
    """Whether the node is a condition."""
    return node.op in TRUTHS


def is_elementwise(op: str) -> bool:
    """Whether the op works on each component alone and gives one vector."""
    row = OPERATORS.get(op)
    return row is not None and row.kind is Kind.EACH and gives(op) == 1


def meaning(op: str) -> Callable[..., Any] | None:
    """
    What computes an operator of the graph, None where nothing does.

    As the calculator's, but that NaN equals nothing: lifting makes the calculator's `eq` of this one.
    """
    if op in _IEEE:
        return _IEEE[op]
    row = OPERATORS.get(op)
    return row.function if row else None


_IEEE = {"eq": compare(np.equal), "neq": compare(np.not_equal)}


def takes(op: str) -> int:
    """The number of arguments of an operator of the kind EACH."""
    pops = OPERATORS[op].pops
    return pops(0, 0) if pops else 0


def gives(op: str) -> int:
    """The number of vectors that an operator of the kind EACH gives."""
    pushes = OPERATORS[op].pushes
    return pushes(0, 0) if pushes else 0


def _require(holds: bool, op: str, arguments: Sequence[Node], rule: str) -> None:
    if not holds:
        raise GraphError(f"{op} of widths {[argument.width for argument in arguments]}: {rule}")


_SINGLE = {op: takes(op) for op in OPERATORS if is_elementwise(op)}
"""How many arguments of equal width the operators take that give one such vector."""
_COUNTS = {
    "const": 0, "input": 0, "env": 0, "variable": 0, "defined": 0,
    "pick": 1, "splat": 1, "rotl": 1, "curve": 1, "tint": 1, "select": 3,
}  # fmt: skip
"""How many arguments the kinds of nodes take that are no calculator operators."""
_OPEN = frozenset(("input", "pick", "splat"))
"""Kinds of nodes whose width is asked for."""


def _width(op: str, arguments: Sequence[Node], detail: Any, asked: int) -> int:
    """The width of a node, or GraphError where its parts do not fit."""
    widths = [argument.width for argument in arguments]
    if _SINGLE.get(op) == len(widths) and widths.count(widths[0]) == len(widths):
        return widths[0]
    if op in _COUNTS:
        _require(len(arguments) == _COUNTS[op], op, arguments, f"takes {_COUNTS[op]} argument(s)")
    if op == "const":
        _require(len(detail) > 0, op, arguments, "needs a number")
        return len(detail)
    if op in ("env", "variable", "defined", "curve"):
        return 1
    if op in ("clut", "tint"):
        _require(widths == [1] * detail.inputs, op, arguments, f"takes {detail.inputs} numbers")
        return int(detail.outputs)
    if op == "solve":
        rows, columns = detail
        _require(widths == [1] * (rows * (columns + 1)), op, arguments, f"is of {rows} x {columns}")
        return int(columns) + 1
    if op == "input":
        _require(asked > 0 and detail >= 0, op, arguments, "needs channels")
        return asked
    if op == "pack":
        _require(len(arguments) > 1, op, arguments, "takes two arguments or more")
        return sum(widths)
    if op == "pick":
        end = detail + asked
        _require(0 <= detail < end <= widths[0], op, arguments, f"has no components {detail} to {end - 1}")
        return asked
    if op == "splat":
        _require(widths == [1] and asked > 0, op, arguments, "repeats a scalar")
        return asked
    if op == "rotl":
        _require(0 < detail < widths[0], op, arguments, f"cannot be rotated by {detail}")
        return widths[0]
    if op == "select":
        _require(widths[0] == 1 and widths[1] == widths[2], op, arguments, "condition is 1, sides are equal")
        return widths[1]
    row = OPERATORS.get(op)
    if row is not None and row.kind is Kind.REDUCE:
        _require(len(widths) == 1 and widths[0] > 1, op, arguments, "takes one vector of two or more")
        return 1
    if row is not None and row.kind is Kind.EACH:
        alike = len(widths) == takes(op) and len(set(widths)) == 1
        _require(alike, op, arguments, f"takes {takes(op)} of equal width")
        return widths[0] * gives(op)
    raise GraphError(f"{op!r} is no operator of the graph")


def check(graph: Graph) -> None:
    """
    Verify a graph: every node follows its arguments, all widths fit, no two nodes are equal.

    Raises
    ------
    GraphError
        With the node that breaks a rule.
    """
    seen = set()
    for position, node in enumerate(graph.nodes):
        if node.index != position:
            raise GraphError(f"{node} stands at {position}")
        for argument in node.arguments:
            if argument.index >= position or graph.nodes[argument.index] is not argument:
                raise GraphError(f"{node} uses %{argument.index}, which does not come before it")
        if _width(node.op, node.arguments, node.detail, node.width) != node.width:
            raise GraphError(f"{node} has a wrong width")
        key = (node.op, node.arguments, _exact(node.op, node.detail), node.width)
        if key in seen:
            raise GraphError(f"{node} is there twice")
        seen.add(key)
    for output in graph.outputs:
        graph.require(output)


# Constants ---------------------------------------------------------------------------------------------


def evaluate(
    op: str,
    arguments: Sequence[Sequence[float]],
    detail: Any,
    width: int,
    dtype: type[np.floating[Any]] = np.float64,
) -> tuple[float, ...] | None:
    """The value in `dtype` of a node whose arguments are these numbers; None for what only a run knows."""
    if op == "pack":
        return tuple(value for argument in arguments for value in argument)
    if op == "pick":
        return tuple(arguments[0][detail : detail + width])
    if op == "splat":
        return tuple(arguments[0]) * width
    if op == "rotl":
        return (*arguments[0][detail:], *arguments[0][:detail])
    if op == "select":
        return tuple(arguments[1] if arguments[0][0] >= 0.5 else arguments[2])
    row, function = OPERATORS.get(op), meaning(op)
    if row is None or function is None or row.kind is Kind.MACHINE:
        return None
    planes = [[dtype(value) for value in argument] for argument in arguments]
    with np.errstate(all="ignore"):
        if row.kind is Kind.REDUCE:
            return (float(function(planes[0])),)
        results = [function(*values) for values in zip(*planes, strict=True)]
    if gives(op) > 1:
        return tuple(float(value) for plane in zip(*results, strict=True) for value in plane)
    return tuple(map(float, results))
