"""The one table of calculator operators.

A row says how an operator is stored, what it takes from and leaves on the stack, what it means and, in a
line of text, what it is for.  Parser, listing, verifier, interpreter and documentation all read it.

Vector operators are planar: for n repetitions the stack holds all first operands, then all second ones.
Source: ICC.2, calculatorElement; edge cases as the ICC's reference implementation computes them, except
that temporaries and outputs start at 0, that `rnum` is 0 for every NaN, and that `solv` solves every shape of
matrix.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np

from iccbrdf.calc import meanings as m
from iccbrdf.calc.meanings import Value

Count: TypeAlias = Callable[[int, int], int]
"""A number of stack entries, from the operand's two u16, S and T."""


class Operand(enum.Enum):
    """What the four operand bytes hold; S is the first u16, T the second."""

    NONE = "none"
    FLOAT = "float32"
    RANGE = "S = first index, T = count - 1"
    COUNT = "S = n - 1"
    COUNT_FROM_TWO = "S = n - 2"
    PAIR = "S = n - 1, T = t - 1"
    ELEMENT = "S = sub-element"
    LENGTH = "u32 length of the block"
    SIGNATURE = "u32 signature"


class Kind(enum.Enum):
    """How an operator's function is called."""

    CONSTANT = "function(operand) -> float"
    EACH = "function(a, b, ...) -> value or tuple, repeated n times over planes"
    SCALAR = "function(a, scalar) -> value, repeated n times; the scalar is on top"
    REDUCE = "function(values) -> value"
    WHOLE = "function(values, s, t) -> values"
    MACHINE = "function(machine, values, s, t) -> values: reads or writes more than the stack"
    CONTROL = "no function: the block structure says what runs"


class Element(Protocol):
    """What every processing element of a profile has; the rest depends on its signature."""

    @property
    def signature(self) -> str: ...
    @property
    def inputs(self) -> int: ...
    @property
    def outputs(self) -> int: ...


class Machine(Protocol):
    """What operators see of the machine that runs them.  Lists hold references; values are never changed."""

    dtype: type[np.floating[Any]]
    channels: Sequence[Value]
    stack: list[Value]
    outputs: list[Value]
    temporaries: dict[int, Value]

    def depth(self) -> Value:
        """The number of entries on the stack."""

    def variable(self, signature: int) -> float | None:
        """The run-time (CMM environment) variable, None where undefined."""

    def element(self, index: int, values: Sequence[Value]) -> list[Value]:
        """The outputs of sub-element `index` for these inputs."""


@dataclass(frozen=True)
class Operator:
    """One row of the table.

    `pops` and `pushes` take S and T; those of operators that apply a sub-element are the element's
    inputs and outputs, and None here.  `accepts` lists the element signatures such an operator takes; empty
    means any.
    """

    name: str
    operand: Operand
    kind: Kind
    pops: Count | None
    pushes: Count | None
    function: Callable[..., Any] | None
    text: str
    accepts: tuple[str, ...] = ()


def stack_effect(operator: Operator, s: int, t: int, elements: Sequence[Element]) -> tuple[int, int]:
    """How many entries the operation pops and pushes, where `elements` are the calculator's sub-elements."""
    if operator.pops is None or operator.pushes is None:
        return elements[s].inputs, elements[s].outputs
    return operator.pops(s, t), operator.pushes(s, t)


def apply(operator: Operator, machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    """What `operator` pushes when it has popped `values` (deepest first)."""
    function = operator.function
    if function is None:
        raise TypeError(f"{operator.name} is a control operator: it has no meaning of its own")
    kind = operator.kind
    if kind is Kind.CONSTANT:
        return [machine.dtype(function((s << 16) | t))]
    if kind is Kind.EACH:
        n = s + 1
        results = [function(*values[i::n]) for i in range(n)]
        if isinstance(results[0], tuple):
            return [value for plane in zip(*results, strict=True) for value in plane]
        return results
    if kind is Kind.SCALAR:
        return [function(value, values[-1]) for value in values[:-1]]
    if kind is Kind.REDUCE:
        return [function(values)]
    if kind is Kind.WHOLE:
        return list(function(values, s, t))
    return list(function(machine, values, s, t))


# Rows of the same shape --------------------------------------------------------------------------------


def _none(s: int, t: int) -> int:
    return 0


def _one(s: int, t: int) -> int:
    return 1


def _n(s: int, t: int) -> int:
    return s + 1


def _span(s: int, t: int) -> int:
    return t + 1


def _from_two(s: int, t: int) -> int:
    return s + 2


def _area(s: int, t: int) -> int:
    return (s + 1) * (t + 1)


def _constant(name: str, value: float, text: str) -> Operator:
    return Operator(name, Operand.NONE, Kind.CONSTANT, _none, _one, lambda operand: value, text)


def _each(name: str, takes: int, gives: int, function: Callable[..., Any], text: str) -> Operator:
    def pops(s: int, t: int) -> int:
        return takes * (s + 1)

    def pushes(s: int, t: int) -> int:
        return gives * (s + 1)

    return Operator(name, Operand.COUNT, Kind.EACH, pops, pushes, function, text)


def _scalar(name: str, function: Callable[..., Any], text: str) -> Operator:
    return Operator(name, Operand.COUNT, Kind.SCALAR, _from_two, _n, function, text)


def _reduce(name: str, function: Callable[..., Any], text: str) -> Operator:
    return Operator(name, Operand.COUNT_FROM_TWO, Kind.REDUCE, _from_two, _one, function, text)


def _memory(name: str, pops: Count, pushes: Count, function: Callable[..., Any], text: str) -> Operator:
    return Operator(name, Operand.RANGE, Kind.MACHINE, pops, pushes, function, text)


def _pair(name: str, pops: Count, pushes: Count, function: Callable[..., Any], text: str) -> Operator:
    return Operator(name, Operand.PAIR, Kind.WHOLE, pops, pushes, function, text)


def _element(name: str, accepts: tuple[str, ...], text: str) -> Operator:
    return Operator(name, Operand.ELEMENT, Kind.MACHINE, None, None, _apply_element, text, accepts)


def _control(name: str, operand: Operand, pops: Count, text: str) -> Operator:
    return Operator(name, operand, Kind.CONTROL, pops, _none, None, text)


# Operators that touch more than the stack --------------------------------------------------------------


def _input(machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    return machine.channels[s : s + t + 1]


def _output(machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    machine.outputs[s : s + t + 1] = values
    return ()


def _get(machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    return [machine.temporaries.get(slot, machine.dtype(0)) for slot in range(s, s + t + 1)]


def _put(machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    machine.temporaries.update(enumerate(values, start=s))
    return ()


def _save(machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    _put(machine, values, s, t)
    return values


def _environment(machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    value = machine.variable((s << 16) | t)
    return [machine.dtype(0.0 if value is None else value), machine.dtype(value is not None)]


def _apply_element(machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    return machine.element(s, values)


def _depth(machine: Machine, values: Sequence[Value], s: int, t: int) -> Sequence[Value]:
    return [machine.depth()]


def _float_of(operand: int) -> float:
    return float(np.array(operand, dtype=np.uint32).view(np.float32))


_WIDE = m.in_double

_ROWS = (
    Operator("data", Operand.FLOAT, Kind.CONSTANT, _none, _one, _float_of, "a number"),
    _constant("pi", math.pi, "the number pi"),
    _constant("+INF", math.inf, "plus infinity"),
    _constant("-INF", -math.inf, "minus infinity"),
    _constant("NaN", math.nan, "not a number"),
    # Channels, memory and run-time variables
    _memory("in", _none, _span, _input, "push input channels, ascending"),
    _memory("out", _span, _none, _output, "pop to output channels, the top to the last"),
    _memory("tget", _none, _span, _get, "push temporaries; 0 where never written"),
    _memory("tput", _span, _none, _put, "pop to temporaries, the top to the last"),
    _memory("tsav", _span, _span, _save, "as tput, and leave the values on the stack"),
    Operator("env", Operand.SIGNATURE, Kind.MACHINE, _none, lambda s, t: 2, _environment,
             "push a run-time variable and 1, or 0 and 0 if undefined; `true` is 1 1, `ndef` 0 0"),
    # Sub-elements
    _element("curv", ("cvst",), "apply a curve set"),
    _element("mtx", ("matf",), "apply a matrix"),
    _element("clut", ("clut", "xclt"), "apply a colour look-up table"),
    _element("tint", ("tint",), "apply a tint array"),
    _element("tJab", ("XtoJ",), "apply XYZ to CIECAM02 Jab"),
    _element("fJab", ("JtoX",), "apply CIECAM02 Jab to XYZ"),
    _element("calc", ("calc",), "apply a calculator, which has a stack and temporaries of its own"),
    _element("elem", (), "apply any element"),
    # The stack
    _pair("copy", _n, lambda s, t: (s + 1) * (t + 2), m.copy, "append t copies of the top n"),
    _pair("rotl", _n, _n, m.rotate_left, "rotate the top n by t, the deepest to the top"),
    _pair("rotr", _n, _n, m.rotate_right, "rotate the top n by t, the top to the deepest"),
    _pair("posd", _n, lambda s, t: s + t + 2, m.duplicate, "push the entry n from the top (1 = top) t times"),
    Operator("flip", Operand.COUNT_FROM_TWO, Kind.WHOLE, _from_two, _from_two, m.flip, "reverse the top n"),
    Operator("pop", Operand.COUNT, Kind.WHOLE, _n, _none, m.discard, "discard the top n"),
    Operator("scnt", Operand.NONE, Kind.MACHINE, _none, _one, _depth, "push the number of stack entries"),
    Operator("noop", Operand.NONE, Kind.WHOLE, _none, _none, m.discard, "nothing"),
    # Matrices
    _pair("solv", lambda s, t: (s + 1) * (t + 2), lambda s, t: t + 2, m.solve,
          "M (n rows, t columns, row by row), then y: x of M x = y and 1, or zeros and 0 if M is singular"),
    _pair("tran", _area, _area, m.transpose, "transpose a matrix of n rows and t columns"),
    # n values to one
    _reduce("sum", m.total, "sum, left to right"),
    _reduce("prod", m.product, "product, left to right"),
    _reduce("min", m.least, "least; of two, NaN in the second place stays; of more, in the first"),
    _reduce("max", m.greatest, "greatest; NaN as min"),
    _reduce("and", m.all_true, "0 if any value is below 0.5, else 1 (NaN counts as true)"),
    _reduce("or", m.any_true, "1 if any value is 0.5 or more, else 0"),
    # One operand
    _each("neg", 1, 1, np.negative, "-a"),
    _each("sq", 1, 1, m.square, "a^2"),
    _each("sqrt", 1, 1, _WIDE(np.sqrt), "square root"),
    _each("cb", 1, 1, m.cube, "a^3"),
    _each("cbrt", 1, 1, _WIDE(np.cbrt), "cube root; of negative numbers too"),
    _each("abs", 1, 1, np.abs, "|a|"),
    _each("sign", 1, 1, m.sign, "-1, 0 or 1; 0 for NaN"),
    _each("flor", 1, 1, np.floor, "greatest integer not above a"),
    _each("ceil", 1, 1, np.ceil, "least integer not below a"),
    _each("trnc", 1, 1, m.to_int32, "toward zero; -2^31 where a is NaN or leaves 32 bits"),
    _each("rond", 1, 1, m.round_half_away, "nearest, halves away from zero; -2^31 as trnc"),
    _each("exp", 1, 1, _WIDE(np.exp), "e^a"),
    _each("log", 1, 1, _WIDE(np.log10), "logarithm to base 10"),
    _each("ln", 1, 1, _WIDE(np.log), "natural logarithm"),
    _each("sin", 1, 1, _WIDE(np.sin), "sine; radians"),
    _each("cos", 1, 1, _WIDE(np.cos), "cosine; radians"),
    _each("tan", 1, 1, _WIDE(np.tan), "tangent; radians"),
    _each("asin", 1, 1, _WIDE(np.arcsin), "arc sine; radians"),
    _each("acos", 1, 1, _WIDE(np.arccos), "arc cosine; radians"),
    _each("atan", 1, 1, _WIDE(np.arctan), "arc tangent; radians"),
    _each("rnum", 1, 1, m.is_real, "1 if a is a finite number, else 0"),
    _each("not", 1, 1, m.logical_not, "0 if a is 0.5 or more, else 1"),
    # Two operands
    _each("add", 2, 1, np.add, "a + b"),
    _each("sub", 2, 1, np.subtract, "a - b"),
    _each("mul", 2, 1, np.multiply, "a b"),
    _each("div", 2, 1, np.divide, "a / b"),
    _each("mod", 2, 1, m.modulo, "remainder of a / b with the sign of a; a where b is 0"),
    _each("pow", 2, 1, m.power, "a^b as C's pow"),
    _each("atn2", 2, 1, m.angle, "angle of the point x, y, in this order; radians"),
    _each("ctop", 2, 2, m.cartesian_to_polar, "x, y to radius and angle in degrees, 0 to 360"),
    _each("ptoc", 2, 2, m.polar_to_cartesian, "radius, angle in degrees to x, y"),
    _each("lt", 2, 1, m.compare(np.less), "1 if a < b, else 0"),
    _each("le", 2, 1, m.compare(np.less_equal), "1 if a <= b, else 0"),
    _each("eq", 2, 1, m.equal, "1 if a = b or both are NaN, else 0"),
    _each("neq", 2, 1, m.differs, "0 if a = b or both are NaN, else 1"),
    _each("ge", 2, 1, m.compare(np.greater_equal), "1 if a >= b, else 0"),
    _each("gt", 2, 1, m.compare(np.greater), "1 if a > b, else 0"),
    _each("near", 2, 1, m.near, "1 if |a - b| < 1e-5, else 0"),
    _each("vmin", 2, 1, m.minimum, "a if a < b, else b"),
    _each("vmax", 2, 1, m.maximum, "a if a > b, else b"),
    _each("vand", 2, 1, m.logical(np.logical_and), "1 if both are 0.5 or more, else 0"),
    _each("vor", 2, 1, m.logical(np.logical_or), "1 if one is 0.5 or more, else 0"),
    _each("vxor", 2, 1, m.logical(np.logical_xor), "1 if exactly one is 0.5 or more, else 0"),
    # n values and one on top of them
    _scalar("gama", m.power, "a^g for each a"),
    _scalar("sadd", np.add, "a + g for each a"),
    _scalar("ssub", np.subtract, "a - g for each a"),
    _scalar("smul", np.multiply, "a g for each a"),
    _scalar("sdiv", np.divide, "a / g for each a"),
    # Three operands
    _each("tLab", 3, 3, m.xyz_to_lab, "X, Y, Z over the white to L*, a*, b*"),
    _each("tXYZ", 3, 3, m.lab_to_xyz, "L*, a*, b* to X, Y, Z over the white, never negative"),
    # Control
    _control("if", Operand.LENGTH, _one, "run the block if the top is 0.5 or more"),
    _control("else", Operand.LENGTH, _none, "the block to run otherwise"),
    _control("sel", Operand.NONE, _one, "run the case whose number, from 0, is the top rounded as rond"),
    _control("case", Operand.LENGTH, _none, "one block of a sel"),
    _control("dflt", Operand.LENGTH, _none, "the block to run if the number has no case"),
)

OPERATORS: Mapping[str, Operator] = {row.name: row for row in _ROWS}
"""Operator by name (the signature without its padding blanks)."""


def markdown() -> str:
    """The table as Markdown, for the documentation; n stands for the count, t for the second argument."""
    lines = ["| operator | operand | meaning |", "|---|---|---|"]
    for row in _ROWS:
        text = row.text.replace("|", "\\|")
        lines.append(f"| `{row.name}` | {row.operand.value} | {text} |")
    return "\n".join(lines) + "\n"
