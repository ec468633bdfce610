"""From stack programs and processing elements to the graph.

The program is run once with nodes in the place of numbers: stack, temporaries and outputs hold nodes, what
only moves values leaves no trace, and where branches meet, each value that differs becomes a `select`.
What is computed, and in which order it is rounded, is what the interpreter computes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any, TypeAlias

from iccbrdf.calc.elements import calculator_samples
from iccbrdf.calc.graph import LOGIC, Graph, Node, is_truth
from iccbrdf.calc.meanings import EPSILON, KNEE, NEAR, OFFSET, SLOPE
from iccbrdf.calc.operators import OPERATORS, Element, Kind, stack_effect
from iccbrdf.calc.operators import apply as apply_operator
from iccbrdf.calc.program import Block, Step, nest, signature_name
from iccbrdf.calc.verify import verify_element
from iccbrdf.errors import UnsupportedError

CONSTANTS = {"true": 1.0, "ndef": 0.0}
"""Run-time variables that are none: `env` gives each of them twice."""

MAX_NODES = 20_000
"""Nodes of a graph: a program that needs more is left to the interpreter, as it would compile for minutes."""
MAX_MOVES = 1 << 19
"""Values moved while lifting: short programs can shuffle a deep stack for hours."""
MOVES_A_TERM = 16
"""A term of a matrix takes the time of so many moves, even where its nodes are there already."""
SAMPLED_AT_A_TIME = 512
"""Operations of a calculator curve's samples that take the time of a move."""


Origin: TypeAlias = "tuple[Any, int | None]"
"""A processing element; of a calculator with the number of an operation."""


def lift_element(
    graph: Graph,
    element: Any,
    channels: Sequence[Node],
    *,
    finite_inputs: bool = False,
    origins: dict[Node, Origin] | None = None,
) -> list[Node]:
    """
    The nodes of a processing element's outputs.

    Parameters
    ----------
    graph
        Where they are added; its dtype is the type that the program is run in.
    element
        As of a profile reader, with `signature`, `inputs`, `outputs`; programs in it are verified.
    channels
        A node for each input.
    finite_inputs
        Whether the graph's `input` channels may be taken to be finite: 0 times one of them is 0 then.  The
        graph notes where that makes a difference (`assumes_finite`).
    origins
        Takes for every new node what first asked for it.

    Raises
    ------
    UnsupportedError
        The element is of a kind that only the interpreter runs, or its graph would be too large.
    """
    lift = _Lift(graph, finite_inputs, origins)
    first = len(graph.nodes)
    results = lift.element(element, channels)
    lift.mark(first, element, None)
    return results


@dataclass
class _Lift:
    """What all programs of one lift share."""

    graph: Graph
    finite_inputs: bool
    origins: dict[Node, Origin] | None
    sampled: dict[int, SampledCurve] = field(default_factory=dict)
    """The calculator curves met so far, by id, as their samples."""

    def element(self, element: Any, channels: Sequence[Node]) -> list[Node]:
        function = _ELEMENTS.get(element.signature)
        if function is None:
            raise UnsupportedError(f"{element.signature!r} elements run in the interpreter alone")
        return function(self, element, channels)

    def number(self, value: float) -> Node:
        return self.graph.number(value)

    def op(self, op: str, *arguments: Node) -> Node:
        return self.graph.apply(op, *arguments)

    def truth(self, value: Node) -> Node:
        """A value as a condition: 0.5 and above; NaN is false."""
        return value if is_truth(value) else self.op("ge", value, self.number(0.5))

    def select(self, condition: Node, yes: Node, no: Node) -> Node:
        return yes if yes is no else self.op("select", condition, yes, no)

    def results(self, op: str, arguments: Sequence[Node], detail: Any) -> list[Node]:
        """All components of a node that gives several."""
        node = self.graph.add(op, arguments, detail)
        return [self.graph.pick(node, i) for i in range(node.width)]

    def mark(self, first: int, element: Any, position: int | None) -> None:
        """Note where the nodes from number `first` on come from, unless that is known more closely."""
        if self.origins is not None:
            for node in self.graph.nodes[first:]:
                self.origins.setdefault(node, (element, position))

    def count(self, moved: int) -> None:
        """Account for values moved and nodes made."""
        self.graph.moves += moved + 1
        if self.graph.moves > MAX_MOVES or len(self.graph.nodes) > MAX_NODES:
            raise UnsupportedError(f"its graph has more than {MAX_NODES} nodes, or takes too long to make")


# Elements ----------------------------------------------------------------------------------------------


def _matrix(lift: _Lift, element: Any, channels: Sequence[Node]) -> list[Node]:
    if element.matrix is None:
        return [lift.number(constant) for constant in element.offset]
    return [
        _row(lift, row, channels, constant)
        for row, constant in zip(element.matrix, element.offset, strict=True)
    ]


def _row(lift: _Lift, row: Sequence[float], channels: Sequence[Node], offset: float) -> Node:
    # A sum is the same without a term of 0 but for the sign of a zero, which adding an offset settles, +0
    # included: x + 0 is never -0.  Only 0 times infinity or NaN is more than that.
    droppable = lift.finite_inputs and not (offset == 0 and math.copysign(1.0, offset) < 0)
    lift.count(MOVES_A_TERM * len(row))
    terms = [
        lift.op("mul", lift.number(factor), channel)
        for factor, channel in zip(row, channels, strict=True)
        if not (droppable and factor == 0 and channel.op == "input")
    ]
    lift.graph.assumes_finite |= len(terms) < len(row)
    constant = lift.number(offset)
    if not terms:
        return constant
    return lift.op("add", reduce(lambda left, right: lift.op("add", left, right), terms), constant)


@dataclass(frozen=True, eq=False)
class SampledCurve:
    """The samples of a calculator curve, as a sampled curve's."""

    first: float
    last: float
    extension: int
    values: Any

    signature = "sngf"


def _curve_set(lift: _Lift, element: Any, channels: Sequence[Node]) -> list[Node]:
    pairs = zip(element.curves, channels, strict=True)
    lift.count(len(element.curves))
    return [lift.graph.add("curve", [channel], _without_calculator(lift, curve)) for curve, channel in pairs]


def _without_calculator(lift: _Lift, curve: Any) -> Any:
    """A calculator curve as its samples, any other curve as it is."""
    if curve.signature != "clcf":
        return curve
    if id(curve) not in lift.sampled:
        (checked,) = verify_element(curve.calculator)
        if checked.environment - CONSTANTS.keys():
            raise UnsupportedError("calculator curves that read run-time variables run interpreted alone")
        lift.count(curve.size * checked.work // SAMPLED_AT_A_TIME)
        samples = calculator_samples(curve, {})
        lift.sampled[id(curve)] = SampledCurve(curve.first, curve.last, curve.extension, samples)
    return lift.sampled[id(curve)]


def _table(lift: _Lift, element: Any, channels: Sequence[Node]) -> list[Node]:
    lift.count(element.outputs)
    return lift.results("clut", channels, element)


def _tint(lift: _Lift, element: Any, channels: Sequence[Node]) -> list[Node]:
    lift.count(element.outputs)
    return lift.results("tint", channels, element)


def _calculator(lift: _Lift, element: Any, channels: Sequence[Node]) -> list[Node]:
    zero = lift.number(0.0)
    machine = _Machine(lift, element, channels, [], [zero] * element.outputs, {}, zero)
    _execute(nest(element.program), machine)
    return machine.outputs


_ELEMENTS: Mapping[str, Callable[[_Lift, Any, Sequence[Node]], list[Node]]] = {
    "matf": _matrix,
    "cvst": _curve_set,
    "clut": _table,
    "xclt": _table,
    "tint": _tint,
    "calc": _calculator,
}


# The stack machine, with nodes for numbers -------------------------------------------------------------


@dataclass
class _Machine:
    """As the interpreter's: what the operators that move values see of it is the same."""

    lift: _Lift
    calculator: Any
    channels: Sequence[Any]
    stack: list[Any]
    outputs: list[Any]
    temporaries: dict[int, Any]
    buried: Node

    def dtype(self, value: float) -> Node:
        return self.lift.number(value)

    def depth(self) -> Node:
        return self.lift.op("add", self.buried, self.lift.number(len(self.stack)))

    @property
    def elements(self) -> Sequence[Element]:
        found: Sequence[Element] = self.calculator.elements
        return found

    def element(self, index: int, values: Sequence[Node]) -> list[Node]:
        return self.lift.element(self.elements[index], values)

    def fork(self) -> _Machine:
        self.lift.count(len(self.stack) + len(self.outputs) + len(self.temporaries))
        return replace(
            self, stack=list(self.stack), outputs=list(self.outputs), temporaries=dict(self.temporaries)
        )

    def bury(self, count: int) -> None:
        if count:
            del self.stack[:count]
            self.buried = self.lift.op("add", self.buried, self.lift.number(count))


def _execute(block: Block, machine: _Machine) -> None:
    stack = machine.stack
    for step in block:
        op = step.op
        operator = OPERATORS[op.name]
        if operator.kind is Kind.CONTROL:
            _choose(step, machine)
            continue
        pops, pushes = stack_effect(operator, op.s, op.t, machine.elements)
        machine.lift.count(pops + pushes)
        kept = len(stack) - pops
        values = stack[kept:]
        del stack[kept:]
        first = len(machine.lift.graph.nodes)
        stack += _apply(step, values, machine)
        machine.lift.mark(first, machine.calculator, step.position)


def _apply(step: Step, values: Sequence[Node], machine: _Machine) -> Sequence[Node]:
    op, lift = step.op, machine.lift
    operator = OPERATORS[op.name]
    if op.name == "env":
        return _environment(lift, op.operand)
    if op.name == "solv":
        return lift.results("solve", values, (op.s + 1, op.t + 1))
    if operator.kind is Kind.EACH:
        n = op.s + 1
        function = _EACH.get(op.name)
        if function is None:
            return [lift.op(op.name, *values[i::n]) for i in range(n)]
        results = [function(lift, *values[i::n]) for i in range(n)]
        if isinstance(results[0], tuple):
            return [value for plane in zip(*results, strict=True) for value in plane]
        return results
    if operator.kind is Kind.SCALAR:
        return [lift.op(_SCALAR[op.name], value, values[-1]) for value in values[:-1]]
    if operator.kind is Kind.REDUCE:
        return [_REDUCE[op.name](lift, values)]
    # The rest moves values, and does not look at them.
    moves: Sequence[Any] = apply_operator(operator, machine, values, op.s, op.t)  # type: ignore[arg-type]
    return moves


def _environment(lift: _Lift, wanted: int) -> Sequence[Node]:
    name = signature_name(wanted)
    if name in CONSTANTS:
        return [lift.number(CONSTANTS[name])] * 2
    return [lift.graph.add("variable", detail=name), lift.graph.add("defined", detail=name)]


def _choose(step: Step, machine: _Machine) -> None:
    """Lift the blocks of an `if` or `sel`, and let a select choose every value in which they differ."""
    lift = machine.lift
    blocks = [*step.branches, step.otherwise or ()]
    value = machine.stack.pop()
    first = len(lift.graph.nodes)
    if step.op.name == "if":
        conditions = [lift.truth(value)]
    else:
        number = lift.op("rond", value)
        conditions = [lift.op("eq", number, lift.number(i)) for i in range(len(step.branches))]
    lift.mark(first, machine.calculator, step.position)
    before = machine.fork()
    _execute(blocks[-1], machine)
    for condition, block in zip(reversed(conditions), reversed(blocks[:-1]), strict=True):
        side = before.fork()
        _execute(block, side)
        _merge(condition, side, machine)


def _merge(condition: Node, side: _Machine, machine: _Machine) -> None:
    """Take into `machine` the state of `side` where the condition holds; see the interpreter."""
    lift = machine.lift

    def pick(yes: Node, no: Node) -> Node:
        return lift.select(condition, yes, no)

    depth = min(len(side.stack), len(machine.stack))
    for part in (side, machine):
        part.bury(len(part.stack) - depth)
    machine.buried = pick(side.buried, machine.buried)
    machine.stack[:] = map(pick, side.stack, machine.stack)
    machine.outputs[:] = map(pick, side.outputs, machine.outputs)
    zero = lift.number(0.0)
    for slot in sorted(side.temporaries.keys() | machine.temporaries.keys()):
        yes, no = (part.temporaries.get(slot, zero) for part in (side, machine))
        machine.temporaries[slot] = pick(yes, no)


# Operators that others can express; the order of operations is that of meanings.py ---------------------


def _near(lift: _Lift, a: Node, b: Node) -> Node:
    # |a - b| is compared with a float64, which mostly lies between two numbers of the working type.
    limit = lift.number(NEAR)
    test = "le" if limit.detail[0] < NEAR else "lt"
    return lift.op(test, lift.op("abs", lift.op("sub", a, b)), limit)


def _cartesian_to_polar(lift: _Lift, x: Node, y: Node) -> tuple[Node, Node]:
    op, number = lift.op, lift.number
    degrees = op("div", op("mul", op("atn2", x, y), number(180)), number(math.pi))
    turned = lift.select(op("lt", degrees, number(0)), op("add", degrees, number(360)), degrees)
    return op("sqrt", op("add", op("mul", x, x), op("mul", y, y))), turned


def _polar_to_cartesian(lift: _Lift, radius: Node, degrees: Node) -> tuple[Node, Node]:
    op, number = lift.op, lift.number
    radians = op("div", op("mul", degrees, number(math.pi)), number(180))
    return op("mul", radius, op("cos", radians)), op("mul", radius, op("sin", radians))


def _xyz_to_lab(lift: _Lift, *xyz: Node) -> tuple[Node, Node, Node]:
    op, number = lift.op, lift.number

    def f(v: Node) -> Node:
        line = op("add", op("mul", number(SLOPE), v), number(OFFSET))
        return lift.select(op("gt", v, number(EPSILON)), op("cbrt", v), line)

    fx, fy, fz = map(f, xyz)
    return (
        op("sub", op("mul", number(116), fy), number(16)),
        op("mul", number(500), op("sub", fx, fy)),
        op("mul", number(200), op("sub", fy, fz)),
    )


def _lab_to_xyz(lift: _Lift, lightness: Node, a: Node, b: Node) -> tuple[Node, Node, Node]:
    op, number = lift.op, lift.number

    def inverse(f: Node) -> Node:
        line = op("div", op("sub", f, number(OFFSET)), number(SLOPE))
        line = lift.select(op("gt", f, number(OFFSET)), line, number(0))
        return lift.select(op("gt", f, number(KNEE)), _cube(lift, f), line)

    fy = op("div", op("add", lightness, number(16)), number(116))
    fx = op("add", op("div", a, number(500)), fy)
    fz = op("sub", fy, op("div", b, number(200)))
    return inverse(fx), inverse(fy), inverse(fz)


def _equal(lift: _Lift, a: Node, b: Node) -> Node:
    """A NaN equals a NaN, which only matters where neither operand is a number for certain."""
    same = lift.op("eq", a, b)
    if any(node.op == "const" and not math.isnan(node.detail[0]) for node in (a, b)):
        return same
    return lift.op("vor", same, lift.op("vand", lift.op("neq", a, a), lift.op("neq", b, b)))


def _cube(lift: _Lift, a: Node) -> Node:
    return lift.op("mul", lift.op("mul", a, a), a)


def _logic(name: str) -> Callable[..., Node]:
    return lambda lift, *values: lift.op(name, *map(lift.truth, values))


_EACH: Mapping[str, Callable[..., Any]] = {
    "sq": lambda lift, a: lift.op("mul", a, a),
    "cb": _cube,
    "near": _near,
    "eq": _equal,
    "neq": lambda lift, a, b: lift.op("not", _equal(lift, a, b)),
    "ctop": _cartesian_to_polar,
    "ptoc": _polar_to_cartesian,
    "tLab": _xyz_to_lab,
    "tXYZ": _lab_to_xyz,
    **{name: _logic(name) for name in LOGIC},
}

_SCALAR: Mapping[str, str] = {"gama": "pow", "sadd": "add", "ssub": "sub", "smul": "mul", "sdiv": "div"}


def _all_true(lift: _Lift, values: Sequence[Node]) -> Node:
    """1 unless some value is below 0.5: NaN counts as true."""
    half = lift.number(0.5)
    return lift.op("not", _reduced("vor")(lift, [lift.op("lt", value, half) for value in values]))


def _reduced(name: str) -> Callable[[_Lift, Sequence[Node]], Node]:
    return lambda lift, values: reduce(lambda left, right: lift.op(name, left, right), values)


def _extreme(name: str) -> Callable[[_Lift, Sequence[Node]], Node]:
    """Of two values the first is compared with the second, of more each with the best before it."""

    def function(lift: _Lift, values: Sequence[Node]) -> Node:
        if len(values) == 2:
            return lift.op(name, *values)
        return reduce(lambda best, value: lift.op(name, value, best), values)

    return function


_REDUCE: Mapping[str, Callable[[_Lift, Sequence[Node]], Node]] = {
    "sum": _reduced("add"),
    "prod": _reduced("mul"),
    "min": _extreme("vmin"),
    "max": _extreme("vmax"),
    "and": _all_true,
    "or": lambda lift, values: _reduced("vor")(lift, [lift.truth(value) for value in values]),
}
