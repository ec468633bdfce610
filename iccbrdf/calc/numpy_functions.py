"""Each operator of the graph as steps of NumPy ufuncs that write to buffers.

Arithmetic and comparisons are the ufuncs themselves, in the working type.  Where meanings.py chooses
with `np.where`, which costs as much as ten additions, bits are masked: all of a number's bits or none.
The float32 functions of NumPy that have no vector form on this machine are computed here, from
polynomials and iterations; operands that those are not made for are left to NumPy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from iccbrdf.calc.buffers import Code, Function, Kind, Operand, Place, View
from iccbrdf.calc.meanings import INT_MIN

NUMBERS: Mapping[str, Function] = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative,
    "abs": np.absolute, "sqrt": np.sqrt, "flor": np.floor, "ceil": np.ceil, "exp": np.exp, "log": np.log10,
    "ln": np.log, "sin": np.sin, "cos": np.cos, "tan": np.tan,
}  # fmt: skip
"""Operators on numbers that one ufunc computes."""

TESTS: Mapping[str, Function] = {
    "lt": np.less, "le": np.less_equal, "eq": np.equal, "neq": np.not_equal, "ge": np.greater_equal,
    "gt": np.greater, "rnum": np.isfinite,
}  # fmt: skip
"""Conditions on numbers."""

LOGIC: Mapping[str, Function] = {
    "not": np.logical_not, "vand": np.logical_and, "vor": np.logical_or, "vxor": np.logical_xor,
}  # fmt: skip
"""Conditions on conditions."""


def copy(value: Any, out: Any) -> None:
    np.copyto(out, value, casting="same_kind")


def _least(a: Any, b: Any, out: Any) -> None:
    # NumPy wants this one's `out` by name.
    np.minimum(a, b, out=out)


def _greatest(a: Any, b: Any, out: Any) -> None:
    np.maximum(a, b, out=out)


# Choosing ----------------------------------------------------------------------------------------------


def widened(code: Code, mask: Operand) -> Operand:
    """A condition as all bits set, or none."""
    if isinstance(mask, Place):
        return code.do_bits(np.negative, Place(mask.register, View.BYTE))
    return code.constant_bits(-int(mask))


def select(code: Code, wide: Operand, yes: Operand, no: Operand) -> Place:
    """`yes` where all bits of `wide` are set, else `no`."""
    yes, no = code.bits(yes), code.bits(no)
    if _is_zero(no):
        return _number(code.do_bits(np.bitwise_and, yes, wide))
    differing = no if _is_zero(yes) else code.do_bits(np.bitwise_xor, yes, no)
    return _number(code.do_bits(np.bitwise_xor, code.do_bits(np.bitwise_and, differing, wide), no))


def _number(bits: Place) -> Place:
    """The number that has these bits."""
    return Place(bits.register, View.NUMBER)


def _is_zero(bits: Operand) -> bool:
    return not isinstance(bits, Place) and bits == 0


def _chosen(code: Code, test: Function, a: Operand, b: Operand, yes: Operand, no: Operand) -> Place:
    return select(code, widened(code, code.test(test, a, b)), yes, no)


def _extreme(test: Function, keeps: Function, passes: Function) -> Callable[..., Operand]:
    """The first of two numbers where the test holds, else the second: NaN and signed zeros included.

    A quicker function gives the same where one of them is a constant: if the second is a number, NaN in the
    first is to give it; if the first is, NaN in the second is to stay.
    """

    def function(code: Code, a: Operand, b: Operand) -> Operand:
        if not isinstance(b, Place) and b != 0 and b == b:
            return code.do(keeps, a, b)
        if not isinstance(a, Place) and a != 0 and a == a:
            return code.do(passes, a, b)
        return _chosen(code, test, a, b, a, b)

    return function


# Whole numbers -----------------------------------------------------------------------------------------


def _sign(code: Code, a: Operand) -> Operand:
    zero = code.number(0)
    above, below = (code.do(copy, code.test(test, a, zero)) for test in (np.greater, np.less))
    return code.do(np.subtract, above, below)


def _in_32_bits(code: Code, whole: Operand) -> Operand:
    """A whole number without -0; -2^31 where it is NaN or leaves 32 bits."""
    limit = code.number(-INT_MIN)
    positive = code.do(np.add, whole, code.number(0))
    return _chosen(code, np.less, code.do(np.absolute, whole), limit, positive, code.number(INT_MIN))


def _truncate(code: Code, a: Operand) -> Operand:
    return _in_32_bits(code, code.do(np.trunc, a))


def _round(code: Code, a: Operand) -> Operand:
    if code.dtype is np.float64:
        # Half is added in float64, which rounds: so does the definition.
        half = _chosen(code, np.less, a, code.number(0), code.number(-0.5), code.number(0.5))
        return _truncate(code, code.do(np.add, a, half))
    whole = code.do(np.trunc, a)
    part = code.do(np.subtract, a, whole)
    carried = code.do(np.trunc, code.do(np.add, part, part))
    return _in_32_bits(code, code.do(np.add, whole, carried))


def _modulo(code: Code, a: Operand, b: Operand) -> Operand:
    remainder = code.do(np.fmod, a, b)
    if not isinstance(b, Place) and b != 0:
        return remainder
    return _chosen(code, np.equal, b, code.number(0), a, remainder)


# Powers ------------------------------------------------------------------------------------------------

_POWERS = range(3, 8)
"""Exponents for which repeated squaring in float32 stays within 4 ulp: tried for every mantissa."""


def _power(code: Code, a: Operand, b: Operand) -> Operand:
    if isinstance(b, Place) or code.dtype is not np.float32 or b not in _POWERS:
        if b == 0.5 or (isinstance(b, Place) and b.register.kind is Kind.ARGUMENT):
            # NumPy takes a root for the one exponent 0.5, which is -0 for -0, but not for a plane of them.
            b = code.do(np.positive, b)
        return code.do(np.power, a, b)
    exponent = int(b)
    result = None
    while exponent:
        if exponent & 1:
            result = a if result is None else code.do(np.multiply, result, a)
        exponent >>= 1
        if exponent:
            a = code.do(np.multiply, a, a)
    return result if result is not None else code.number(1)


# Functions that not every machine has as vectors -------------------------------------------------------


@cache
def has_vectors(name: str) -> bool:
    """Whether NumPy computes this function of float32 with vector instructions on this machine."""
    found = np.lib.introspect.opt_func_info(func_name=f"^{name}$", signature="float32")
    targets = [info["current"] for info in found.get(name, {}).values()]
    return bool(targets) and not any(target.startswith("baseline") for target in targets)


def _vectors_or(name: str, made: Callable[..., Operand]) -> Callable[..., Operand]:
    """NumPy's function, or in float32 the one that is made of others where that is quicker."""
    function = getattr(np, name)

    def choose(code: Code, *operands: Operand) -> Operand:
        if code.dtype is np.float64 or has_vectors(name):
            return code.do(function, *operands)
        return made(code, *operands)

    return choose


def _where(function: Function) -> Function:
    """A function that overwrites, where its last operand says so."""

    def overwrite(*operands: Any) -> None:
        *arguments, mask, out = operands
        function(*arguments, out=out, where=mask)

    return overwrite


_ARCTAN2, _CBRT = _where(np.arctan2), _where(np.cbrt)

_ATAN = (
    -0.3333317041397095, 0.1999422013759613, -0.14214828610420227, 0.10681237280368805,
    -0.07585246860980988, 0.04360654950141907, -0.01661272533237934, 0.002982254372909665,
)  # fmt: skip
"""(atan(t)/t - 1)/t^2 for t in 0..1 as a polynomial of t^2, fitted for the least relative error of atan."""


def arctan2(code: Code, y: Operand, x: Operand) -> Operand:
    """The angle of x, y in float32: atan in the first half of the first quadrant, then mirrored."""
    number, do = code.number, code.do
    abs_y, abs_x = do(np.absolute, y), do(np.absolute, x)
    t = do(np.divide, do(_least, abs_y, abs_x), do(_greatest, abs_y, abs_x))
    t2 = do(np.multiply, t, t)
    series: Operand = number(_ATAN[-1])
    for coefficient in reversed(_ATAN[:-1]):
        series = do(np.add, do(np.multiply, series, t2), number(coefficient))
    angle = do(np.add, t, do(np.multiply, t, do(np.multiply, t2, series)))
    steep = do(np.subtract, number(math.pi / 2), angle)
    upper = _chosen(code, np.greater, abs_y, abs_x, steep, angle)
    left = code.do_bits(np.right_shift, code.bits(x), code.constant_bits(31))
    upper = select(code, left, do(np.subtract, number(math.pi), upper), upper)
    angle = _with_sign(code, upper, y)
    # Two zeros, two infinities or NaN.
    return _overwritten(code, angle, _ARCTAN2, y, x, code.test(np.isnan, t))


def _arctan(code: Code, a: Operand) -> Operand:
    return arctan2(code, a, code.number(1))


def _arcsin(code: Code, a: Operand) -> Operand:
    return arctan2(code, a, _other_leg(code, a))


def _arccos(code: Code, a: Operand) -> Operand:
    return arctan2(code, _other_leg(code, a), a)


def _other_leg(code: Code, a: Operand) -> Operand:
    """sqrt(1 - a^2), without loss near 1."""
    one = code.number(1)
    factors = code.do(np.subtract, one, a), code.do(np.add, one, a)
    return code.do(np.sqrt, code.do(np.multiply, *factors))


_CBRT_MAGIC = 0x2A5119F2
"""The bits of a cube root are near a third of the number's bits and this: within 3.3 %."""
_CBRT_LEAST, _CBRT_GREATEST = 2.0**-64, 2.0**124
"""Between them nothing on the way overflows or becomes subnormal, which costs many times as much."""


def cbrt(code: Code, x: Operand) -> Operand:
    """The cube root in float32: two steps of Halley's iteration, which is of third order."""
    number, do = code.number, code.do
    size = do(np.absolute, x)
    bounded = do(_least, do(_greatest, size, number(_CBRT_LEAST)), number(_CBRT_GREATEST))
    third = code.do_bits(np.floor_divide, code.bits(bounded), code.constant_bits(3))
    root = _number(code.do_bits(np.add, third, code.constant_bits(_CBRT_MAGIC)))
    for _ in range(2):
        cube = do(np.multiply, do(np.multiply, root, root), root)
        error = do(np.subtract, cube, bounded)
        slope = do(np.add, do(np.add, cube, cube), bounded)
        root = do(np.subtract, root, do(np.multiply, root, do(np.divide, error, slope)))
    nonzero = code.test(np.not_equal, size, number(0))
    root = _with_sign(code, select(code, widened(code, nonzero), root, number(0)), x)
    outside = code.test(np.logical_and, nonzero, code.test(np.not_equal, bounded, size))
    return _overwritten(code, root, _CBRT, x, outside)


def _with_sign(code: Code, size: Operand, of: Operand) -> Place:
    """A number that is not negative, with the sign of another."""
    sign = code.do_bits(np.bitwise_and, code.bits(of), code.constant_bits(np.iinfo(code.integer).min))
    return _number(code.do_bits(np.bitwise_or, code.bits(size), sign))


def _overwritten(code: Code, value: Place, function: Function, *reads: Operand) -> Place:
    """`value`, with other results written to the pixels that the last operand masks."""
    code.put(value, function, *reads)
    return value


MADE: Mapping[str, Callable[..., Operand]] = {
    "vmin": _extreme(np.less, np.fmin, _least),
    "vmax": _extreme(np.greater, np.fmax, _greatest),
    "sign": _sign,
    "trnc": _truncate,
    "rond": _round,
    "mod": _modulo,
    "pow": _power,
    "atn2": lambda code, x, y: _vectors_or("arctan2", arctan2)(code, y, x),
    "atan": _vectors_or("arctan", _arctan),
    "asin": _vectors_or("arcsin", _arcsin),
    "acos": _vectors_or("arccos", _arccos),
    "cbrt": _vectors_or("cbrt", cbrt),
}
"""Operators on numbers that take several steps: functions of the code and the operands."""
