"""Operations that can fail: division by zero, operands without a result, numbers beyond the type."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from iccbrdf.calc.graph import Node
from iccbrdf.calc.intervals import Arithmetic, Interval, fits_integer

Kind: TypeAlias = Literal["division", "domain", "overflow", "output"]
"""division by zero; an operand that the operator has no result for; a result beyond the type, or the 32 bits
of an integer; an output that is not finite by no fault of one operation."""


@dataclass(frozen=True)
class Hazard:
    """`operand` of `node`, x in the smallest `guard`, lies in `range`; where none is known, that is empty."""

    kind: Kind
    node: Node
    operand: Node
    range: Interval
    guard: str = ""


def hazard_of(a: Arithmetic, node: Node, arguments: Sequence[Interval], result: Interval) -> Hazard | None:
    """
    What can go wrong in `node` for operands in `arguments`.

    None for operands that are not finite: what has failed before is told of there.
    """
    if not all(argument.finite and not argument.empty for argument in arguments):
        return None
    op = node.op
    if op == "div" and arguments[1].holds(0.0):
        return _hazard("division", node, arguments, 1, _away_from_zero(a, *arguments))
    if op == "pow" and arguments[0].holds(0.0) and arguments[1].low < 0:
        least = max(a.largest ** (1 / min(arguments[1].low, -1.0)), a.smallest_normal)
        return _hazard("division", node, arguments, 0, f"max(x, {_up(least)})")
    if op in ("log", "ln") and arguments[0].low <= 0:
        return _hazard("domain", node, arguments, 0, f"max(x, {_up(a.smallest_normal)})")
    if result.nan:
        return _hazard("domain", node, arguments, 0, _DOMAINS.get(op, ""))
    if op in ("trnc", "rond") and not fits_integer(arguments[0]):
        return _hazard("overflow", node, arguments, 0, _held(arguments[0], 2147483520.0))
    if math.isinf(result.magnitude):
        return _hazard("overflow", node, arguments, *_in_range(a, node, arguments))
    return None


def _hazard(kind: Kind, node: Node, arguments: Sequence[Interval], index: int, guard: str) -> Hazard:
    if node.op == "pick":
        node = node.arguments[0]
    return Hazard(kind, node, node.arguments[index], arguments[index], guard)


# Guards ------------------------------------------------------------------------------------------------

_DOMAINS: Mapping[str, str] = {
    "sqrt": "max(x, 0)",
    "pow": "max(x, 0)",
    "asin": "min(max(x, -1), 1)",
    "acos": "min(max(x, -1), 1)",
}


def _up(value: float) -> str:
    """Not less than `value`, in one digit."""
    exponent = math.floor(math.log10(value))
    return _literal(math.ceil(value / 10.0**exponent * (1 - 1e-12)), exponent)


def _down(value: float) -> str:
    """Not more than `value`, in two digits."""
    exponent = math.floor(math.log10(value)) - 1
    return _literal(math.floor(value / 10.0**exponent * (1 + 1e-12)), exponent)


def _literal(digits: int, exponent: int) -> str:
    mantissa, _, power = f"{digits * 10.0**exponent:.2g}".partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa


def _away_from_zero(a: Arithmetic, dividend: Interval, divisor: Interval) -> str:
    # A quotient by less would not be finite.
    least = _up(max(dividend.magnitude / a.largest * 1.01, a.smallest_normal))
    if divisor.low >= 0:
        return f"max(x, {least})"
    if divisor.high <= 0:
        return f"min(x, -{least})"
    return f"divide only where abs(x) > {least}"


def _held(x: Interval, limit: float) -> str:
    """Keep x within a limit, on the sides where it leaves it."""
    if not limit > 0:
        return ""
    text = _down(limit)
    if x.low >= -limit:
        return f"min(x, {text})"
    if x.high <= limit:
        return f"max(x, -{text})"
    return f"min(max(x, -{text}), {text})"


def _in_range(a: Arithmetic, node: Node, arguments: Sequence[Interval]) -> tuple[int, str]:
    """The operand to keep from overflowing, and how."""
    sizes = [argument.magnitude for argument in arguments]
    largest = a.largest * 0.99
    if node.op == "exp":
        return 0, f"min(x, {_down(math.log(largest))})"
    if node.op == "mul" and node.arguments[0] is node.arguments[1]:
        return 0, _held(arguments[0], math.sqrt(largest))
    if node.op == "mul":
        index = _larger(node, sizes)
        return index, _held(arguments[index], largest / sizes[1 - index])
    if node.op in ("add", "sub"):
        index = _larger(node, sizes)
        return index, _held(arguments[index], largest / 2 if sizes[1 - index] < largest / 2 else 0)
    if node.op == "div" and sizes[0] * arguments[1].mignitude > 1 and node.arguments[0].op != "const":
        return 0, _held(arguments[0], largest * arguments[1].mignitude)
    if node.op == "div":
        return 1, _away_from_zero(a, *arguments)
    if node.op == "pow" and arguments[1].high > 0:
        return 0, _held(arguments[0], largest ** (1 / max(arguments[1].high, 1.0)))
    return 0, ""


def _larger(node: Node, sizes: Sequence[float]) -> int:
    """The operand that reaches farther; not a constant."""
    constants = [operand.op == "const" for operand in node.arguments]
    return constants.index(False) if any(constants) and not all(constants) else sizes.index(max(sizes))


# Expressions -------------------------------------------------------------------------------------------

_INFIX = {
    "add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==",
    "neq": "!=", "vand": "and", "vor": "or", "vxor": "xor",
}  # fmt: skip
_NAMES = {"vmin": "min", "vmax": "max", "flor": "floor", "rond": "round", "trnc": "trunc", "atn2": "atan2"}


def expression(node: Node, names: Sequence[str] = (), depth: int = 3) -> str:
    """A node as a formula of its operands and theirs, `depth` levels deep; `names` are those of inputs."""
    if node.op == "const":
        return f"{node.detail[0]:.6g}"
    if node.op == "input":
        return names[node.detail] if node.detail < len(names) else f"in[{node.detail}]"
    if node.op in ("variable", "defined"):
        return node.detail if node.op == "variable" else f"defined({node.detail})"
    if node.op == "pick":
        return f"{expression(node.arguments[0], names, depth)}[{node.detail}]"
    if depth == 0:
        return "..."
    parts = [expression(argument, names, depth - 1) for argument in node.arguments[:4]]
    if len(node.arguments) > 4:
        parts.append("...")
    if node.op in _INFIX:
        return f"({parts[0]} {_INFIX[node.op]} {parts[1]})"
    return f"{_NAMES.get(node.op, node.op)}({', '.join(parts)})"
