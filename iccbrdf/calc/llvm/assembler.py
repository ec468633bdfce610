"""LLVM assembly of a function on vectors, written as arithmetic on Python objects.

A `Value` is a vector of one number (or condition) a pixel; `a * b + 1.0` on values appends the instructions
to the function that they belong to and gives the value of the last.  Nothing is contracted, reordered or
taken to be finite: instructions carry no fast-math flags.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np

from iccbrdf.calc.llvm.target import Target
from iccbrdf.errors import UnsupportedError


class Type(NamedTuple):
    """A vector type."""

    element: str
    lanes: int

    def __str__(self) -> str:
        return f"<{self.lanes} x {self.element}>"

    def of(self, element: str) -> Type:
        """The type of as many lanes of another element."""
        return Type(element, self.lanes)

    @property
    def is_real(self) -> bool:
        return self.element in ("float", "double")

    @property
    def size(self) -> int:
        """Bytes of a number."""
        return 4 if self.element in ("float", "i32") else 8

    @property
    def suffix(self) -> str:
        """As in the names of overloaded intrinsics."""
        return f"v{self.lanes}{_SUFFIXES.get(self.element, self.element)}"


_SUFFIXES = {"float": "f32", "double": "f64", "ptr": "p0"}
_INTEGER = {"float": "i32", "double": "i64"}

Operand: TypeAlias = "Value | float | int"


class Value:
    """A vector in a function.  Operators take values of the same type, or numbers for all lanes."""

    __slots__ = ("code", "name", "type")

    def __init__(self, code: Assembler, type: Type, name: str) -> None:
        self.code = code
        self.type = type
        self.name = name

    def _op(self, real: str, integer: str, left: Operand, right: Operand) -> Value:
        name = real if self.type.is_real else integer
        a, b = self.code.operand(left, self.type), self.code.operand(right, self.type)
        return self.code.append(self.type, f"{name} {self.type} {a}, {b}")

    def _test(self, predicate: str, other: Operand) -> Value:
        name = "fcmp" if self.type.is_real else "icmp"
        right = self.code.operand(other, self.type)
        return self.code.append(self.type.of("i1"), f"{name} {predicate} {self.type} {self.name}, {right}")

    def __add__(self, other: Operand) -> Value:
        return self._op("fadd", "add", self, other)

    def __radd__(self, other: Operand) -> Value:
        return self._op("fadd", "add", other, self)

    def __sub__(self, other: Operand) -> Value:
        return self._op("fsub", "sub", self, other)

    def __rsub__(self, other: Operand) -> Value:
        return self._op("fsub", "sub", other, self)

    def __mul__(self, other: Operand) -> Value:
        return self._op("fmul", "mul", self, other)

    def __rmul__(self, other: Operand) -> Value:
        return self._op("fmul", "mul", other, self)

    def __truediv__(self, other: Operand) -> Value:
        return self._op("fdiv", "sdiv", self, other)

    def __rtruediv__(self, other: Operand) -> Value:
        return self._op("fdiv", "sdiv", other, self)

    def __neg__(self) -> Value:
        return self.code.append(self.type, f"fneg {self.type} {self.name}")

    def __abs__(self) -> Value:
        return self.code.intrinsic("fabs", self)

    def __and__(self, other: Operand) -> Value:
        return self._op("and", "and", self, other)

    def __or__(self, other: Operand) -> Value:
        return self._op("or", "or", self, other)

    def __xor__(self, other: Operand) -> Value:
        return self._op("xor", "xor", self, other)

    def __invert__(self) -> Value:
        return self ^ -1

    def __lshift__(self, other: int) -> Value:
        return self._op("shl", "shl", self, other)

    def __rshift__(self, other: int) -> Value:
        """Keeps the sign."""
        return self._op("ashr", "ashr", self, other)

    def drop(self, count: int) -> Value:
        """The bits moved down, zeros for the sign."""
        return self._op("lshr", "lshr", self, count)

    # Comparisons with NaN are false, but for `differs`.

    def __lt__(self, other: Operand) -> Value:
        return self._test("olt" if self.type.is_real else "slt", other)

    def __le__(self, other: Operand) -> Value:
        return self._test("ole" if self.type.is_real else "sle", other)

    def __gt__(self, other: Operand) -> Value:
        return self._test("ogt" if self.type.is_real else "sgt", other)

    def __ge__(self, other: Operand) -> Value:
        return self._test("oge" if self.type.is_real else "sge", other)

    def equals(self, other: Operand) -> Value:
        return self._test("oeq" if self.type.is_real else "eq", other)

    def differs(self, other: Operand) -> Value:
        return self._test("une" if self.type.is_real else "ne", other)


MAX_INSTRUCTIONS = 30_000
"""Of a function: LLVM takes seconds for so many; curves of a thousand segments need a hundred thousand."""


@dataclass
class Assembler:
    """A function that is being written: its instructions, the block that they go to, and what they need."""

    target: Target
    real: str
    """The working type of the program, float or double."""
    inline: bool = True
    """Whether functions are written out where they are used, and not called."""
    lines: list[str] = field(default_factory=list)
    block: str = "entry"
    needed: dict[str, str] = field(default_factory=dict)
    """Declarations and functions beside this one, by name."""
    buffers: list[str] = field(default_factory=list)
    """Instructions that make room on the stack, for the start of the function."""
    _count: int = 0

    def fresh(self, stem: str = "") -> str:
        """A new name.  UnsupportedError where the function gets too long."""
        self._count += 1
        if self._count > MAX_INSTRUCTIONS:
            raise UnsupportedError(f"the program takes more than {MAX_INSTRUCTIONS} instructions of LLVM")
        return f"{stem}{self._count}"

    def append(self, type: Type, instruction: str) -> Value:
        """Append an instruction; its result."""
        return Value(self, type, self.scalar(instruction))

    def scalar(self, instruction: str) -> str:
        """Append an instruction whose result is no vector; the name of the result."""
        name = self.fresh("%v")
        self.lines.append(f"  {name} = {instruction}")
        return name

    def do(self, instruction: str) -> None:
        """Append an instruction without a result."""
        self.lines.append(f"  {instruction}")

    def label(self, name: str) -> None:
        """Begin a block."""
        self.lines.append(f"{name}:")
        self.block = name

    # Constants -----------------------------------------------------------------------------------------

    def operand(self, value: Operand, type: Type) -> str:
        """The text of an operand: a value's name, or a number in all lanes."""
        if isinstance(value, Value):
            return value.name
        return f"splat ({type.element} {literal(value, type.element)})"

    def constant(self, value: float, type: Type) -> Value:
        return Value(self, type, self.operand(value, type))

    # Instructions --------------------------------------------------------------------------------------

    def intrinsic(self, name: str, *values: Value) -> Value:
        """An intrinsic function whose arguments and result have one type."""
        type = values[0].type
        full = f"@llvm.{name}.{type.suffix}"
        self.needed[full] = f"declare {type} {full}({', '.join([str(type)] * len(values))})"
        return self.append(type, f"call {type} {full}({', '.join(f'{type} {v.name}' for v in values)})")

    def muladd(self, a: Value, b: Operand, c: Operand) -> Value:
        """a b + c, rounded once where the processor can, else twice: for approximations alone."""
        if self.target.fma:
            factors = (x if isinstance(x, Value) else self.constant(x, a.type) for x in (b, c))
            return self.intrinsic("fma", a, *factors)
        return a * b + c

    def polynomial(self, x: Value, coefficients: Sequence[float]) -> Value:
        """By Horner's rule; the constant term comes first."""
        result = self.constant(coefficients[-1], x.type)
        for coefficient in reversed(coefficients[:-1]):
            result = self.muladd(result, x, coefficient)
        return result

    def select(self, mask: Value, yes: Operand, no: Operand, type: Type | None = None) -> Value:
        """`yes` where the mask holds; `type` must be told where neither is a value."""
        for side in (yes, no):
            if isinstance(side, Value):
                type = side.type
        if type is None:
            raise TypeError("a select between two numbers needs a type")
        a, b = self.operand(yes, type), self.operand(no, type)
        return self.append(type, f"select {mask.type} {mask.name}, {type} {a}, {type} {b}")

    def bits(self, x: Value) -> Value:
        """A number's bits as integers of the same size."""
        return self.cast("bitcast", x, x.type.of(_INTEGER[x.type.element]))

    def from_bits(self, x: Value, like: Value) -> Value:
        return self.cast("bitcast", x, like.type)

    def cast(self, instruction: str, x: Value, type: Type) -> Value:
        if x.type == type:
            return x
        return self.append(type, f"{instruction} {x.type} {x.name} to {type}")

    def widen(self, x: Value) -> Value:
        """As float64."""
        return self.cast("fpext", x, x.type.of("double"))

    def narrow(self, x: Value, type: Type) -> Value:
        """Rounded from float64 to a type."""
        return self.cast("fptrunc", x, type)

    def shuffle(self, a: Value, b: Value | None, lanes: Sequence[int]) -> Value:
        """Lanes of `a`, then of `b`, by number."""
        second = "poison" if b is None else b.name
        mask = ", ".join(f"i32 {lane}" for lane in lanes)
        return self.append(
            Type(a.type.element, len(lanes)),
            f"shufflevector {a.type} {a.name}, {a.type} {second}, <{len(lanes)} x i32> <{mask}>",
        )

    # Memory --------------------------------------------------------------------------------------------

    def address(self, base: str, element: str, offset: int | str) -> str:
        """The address of an element by its number, a constant or the name of an i64."""
        return self.scalar(f"getelementptr inbounds {element}, ptr {base}, i64 {offset}")

    def load(self, base: str, type: Type, offset: int | str) -> Value:
        where = self.address(base, type.element, offset)
        return self.append(type, f"load {type}, ptr {where}, align {type.size}")

    def store(self, value: Value, base: str, offset: int | str) -> None:
        where = self.address(base, value.type.element, offset)
        self.do(f"store {value.type} {value.name}, ptr {where}, align {value.type.size}")

    def buffer(self, element: str, count: int) -> str:
        """Room for so many numbers."""
        name = self.fresh("%buffer")
        self.buffers.append(f"  {name} = alloca [{count} x {element}], align 64")
        return name

    def load_broadcast(self, base: str, type: Type, offset: int | str) -> Value:
        """One number from memory in all lanes."""
        where = self.address(base, type.element, offset)
        number = self.scalar(f"load {type.element}, ptr {where}, align {type.size}")
        first = self.append(type, f"insertelement {type} poison, {type.element} {number}, i64 0")
        return self.shuffle(first, None, [0] * type.lanes)

    def gather(self, base: str, index: Value, type: Type) -> Value:
        """The elements at i32 indices, which are not negative and lie inside."""
        pointers = type.of("ptr")
        masks = type.of("i1")
        where = self.append(
            pointers, f"getelementptr inbounds {type.element}, ptr {base}, {index.type} {index.name}"
        )
        name = f"@llvm.masked.gather.{type.suffix}.{pointers.suffix}"
        self.needed[name] = f"declare {type} {name}({pointers}, i32, {masks}, {type})"
        every = f"{masks} splat (i1 true)"
        return self.append(
            type, f"call {type} {name}({pointers} {where.name}, i32 {type.size}, {every}, {type} poison)"
        )

    # Control -------------------------------------------------------------------------------------------

    def where_any(self, mask: Value, compute: Callable[[], Sequence[Value]]) -> list[Value]:
        """The values that `compute` gives where some lane of the mask holds; else they are anything."""
        then, join = self.fresh("then"), self.fresh("join")
        lanes = mask.type.lanes
        word = self.scalar(f"bitcast {mask.type} {mask.name} to i{lanes}")
        some = self.scalar(f"icmp ne i{lanes} {word}, 0")
        before = self.block
        self.do(f"br i1 {some}, label %{then}, label %{join}")
        self.label(then)
        values = compute()
        end = self.block
        self.do(f"br label %{join}")
        self.label(join)
        return [
            self.append(value.type, f"phi {value.type} [ {value.name}, %{end} ], [ poison, %{before} ]")
            for value in values
        ]

    def loop(self, count: int, write: Callable[[str], None]) -> None:
        """What `write` writes, for each number from 0 to `count` - 1 in turn; it is given its name."""
        start, end = self.fresh("repeat"), self.fresh("done")
        number, following, before = self.fresh("%n"), self.fresh("%n"), self.block
        self.do(f"br label %{start}")
        self.label(start)
        place = len(self.lines)
        write(number)
        self.lines.insert(place, f"  {number} = phi i64 [ 0, %{before} ], [ {following}, %{self.block} ]")
        self.do(f"{following} = add nuw nsw i64 {number}, 1")
        more = self.scalar(f"icmp ult i64 {following}, {count}")
        self.do(f"br i1 {more}, label %{start}, label %{end}")
        self.label(end)

    def apply(self, name: str, write: Callable[..., Value], *values: Value) -> Value:
        """What `write` makes of values of one type: in place, or in a function that is called."""
        if self.inline:
            return write(*values)
        type = values[0].type
        full = f"@{name}.{type.suffix}"
        if full not in self.needed:
            inner = Assembler(self.target, self.real, True, needed=self.needed)
            parameters = [Value(inner, type, f"%a{i}") for i in range(len(values))]
            result = write(*parameters)
            head = ", ".join(f"{type} {value.name}" for value in parameters)
            self.needed[full] = "\n".join(
                [
                    f"define internal fastcc {type} {full}({head}) noinline {{",
                    "entry:",
                    *inner.lines,
                    f"  ret {type} {result.name}",
                    "}",
                ]
            )
        arguments = ", ".join(f"{type} {value.name}" for value in values)
        return self.append(type, f"call fastcc {type} {full}({arguments})")

    def each_lane(self, function: str, *values: Value) -> Value:
        """A function of the C library, called with float64 numbers lane by lane."""
        lanes = values[0].type.lanes
        name = f"@each.{function}.v{lanes}"
        if name not in self.needed:
            arguments = ", ".join(["double"] * len(values))
            self.needed[f"@{function}"] = f"declare double @{function}({arguments}) memory(none)"
            self.needed[name] = _each_lane(name, function, Type("double", lanes), len(values))
        wide = [self.widen(value) for value in values]
        type = wide[0].type
        result = self.append(type, f"call {type} {name}({', '.join(f'{type} {v.name}' for v in wide)})")
        return self.narrow(result, values[0].type)


def literal(value: float, element: str) -> str:
    """A number in LLVM assembly."""
    if element in ("float", "double"):
        number = np.float32(value) if element == "float" else np.float64(value)
        return f"0x{struct.pack('>d', float(number)).hex().upper()}"
    return str(int(value))


def _each_lane(name: str, function: str, type: Type, count: int) -> str:
    """A function on vectors that calls one on numbers in a loop."""
    names = [f"%a{i}" for i in range(count)]
    extracted = [f"  %s{i} = extractelement {type} %a{i}, i64 %lane" for i in range(count)]
    return "\n".join(
        [
            f"define internal {type} {name}({', '.join(f'{type} {n}' for n in names)}) noinline {{",
            "entry:",
            "  br label %loop",
            "loop:",
            "  %lane = phi i64 [ 0, %entry ], [ %next, %loop ]",
            f"  %sum = phi {type} [ poison, %entry ], [ %more, %loop ]",
            *extracted,
            f"  %r = call double @{function}({', '.join(f'double %s{i}' for i in range(count))})",
            f"  %more = insertelement {type} %sum, double %r, i64 %lane",
            "  %next = add i64 %lane, 1",
            f"  %done = icmp eq i64 %next, {type.lanes}",
            "  br i1 %done, label %end, label %loop",
            "end:",
            f"  ret {type} %more",
            "}",
        ]
    )
