"""Logarithms and powers: float64 vectors inside, for float32 results and for curves.

A power's exponent multiplies the error of the logarithm, so float32 would not do.  Relative errors are some
1e-15 for logarithms, and up to 1e-13 for powers whose results are float32 numbers.  Where the working type
is float64 the C library is called instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from iccbrdf.calc.llvm.assembler import Value
from iccbrdf.calc.llvm.functions import nearest

_LOG2_E = 1 / math.log(2)
# ln((1 + s) / (1 - s)) = 2 s (1 + s^2 / 3 + s^4 / 5 + ...), |s| <= 0.1716
_ATANH = tuple(2 / (2 * k + 1) for k in range(11))
# e^r, |r| <= ln 2 / 2
_EXP = tuple(1 / math.factorial(k) for k in range(14))

_MANTISSA = (1 << 52) - 1
_EXPONENT_OF_1, _EXPONENT_OF_2_52 = 1023 << 52, 1075 << 52
_MOST_MULTIPLIED = 32
"""Whole exponents up to this size are multiplications."""


# float64 vectors ---------------------------------------------------------------------------------------


def wide_log2(x: Value) -> Value:
    """log2 of a float64 vector; -inf for 0, NaN for negative numbers."""
    code = x.code
    tiny = x < 2.0**-1022
    bits = code.bits(code.select(tiny, x * 2.0**54, x))
    exponent = code.from_bits(bits.drop(52) | _EXPONENT_OF_2_52, x) - 2.0**52
    exponent = exponent - code.select(tiny, 1023.0 + 54.0, 1023.0, x.type)
    m = code.from_bits((bits & _MANTISSA) | _EXPONENT_OF_1, x)
    upper = m > math.sqrt(2)
    m = code.select(upper, m * 0.5, m)
    exponent = exponent + code.select(upper, 1.0, 0.0, x.type)
    f = m - 1.0
    s = f / (f + 2.0)
    log = s * code.polynomial(s * s, _ATANH)
    result = code.muladd(log, _LOG2_E, exponent)
    result = code.select(x < math.inf, result, x)
    return code.select(x > 0.0, result, code.select(x.equals(0.0), -math.inf, math.nan, x.type))


def wide_exp2(x: Value) -> Value:
    """2^x of a float64 vector."""
    code = x.code
    x = code.select(x > 1025.0, 1025.0, x)
    x = code.select(x < -1080.0, -1080.0, x)
    whole, n = nearest(x, 1.5 * 2**52)
    result = code.polynomial((x - whole) * math.log(2), _EXP)
    # In two steps: 2^n alone may be too large or too small for a number.
    _, half = nearest(whole * 0.5, 1.5 * 2**52)
    for part in (half, n - half):
        result = result * code.from_bits((part + 1023) << 52, x)
    return result


def wide_exp(x: Value) -> Value:
    if x.code.real == "double":
        return x.code.each_lane("exp", x)
    return wide_exp2(x * _LOG2_E)


def wide_log(x: Value) -> Value:
    if x.code.real == "double":
        return x.code.each_lane("log", x)
    return wide_log2(x) * math.log(2)


def wide_log10(x: Value) -> Value:
    if x.code.real == "double":
        return x.code.each_lane("log10", x)
    return wide_log2(x) * math.log10(2)


def wide_power(x: Value, y: Value | float) -> Value:
    """x^y as C's pow; a known exponent is a number."""
    code = x.code
    if code.real == "double":
        return code.each_lane("pow", x, y if isinstance(y, Value) else code.constant(y, x.type))
    if isinstance(y, Value):
        return _power(x, y)
    if abs(y) <= _MOST_MULTIPLIED and y == int(y):
        return _whole_power(x, int(y))
    return _known_power(x, y)


def _whole_power(x: Value, n: int) -> Value:
    result = x.code.constant(1.0, x.type)
    square = x
    for bit in reversed(f"{abs(n):b}"):
        if bit == "1":
            result = result * square
        square = square * square
    return 1.0 / result if n < 0 else result


def _known_power(x: Value, y: float) -> Value:
    if math.isinf(y) or math.isnan(y) or y == int(y):
        return _power(x, x.code.constant(y, x.type))
    code = x.code
    result = wide_exp2(wide_log2(abs(x)) * y)
    return code.select((x < 0.0) & (x > -math.inf), math.nan, result)


def _power(x: Value, y: Value) -> Value:
    code = x.code
    size = abs(x)
    result = wide_exp2(y * wide_log2(size))
    half = y * 0.5
    whole = code.intrinsic("floor", y).equals(y)
    odd = whole & code.intrinsic("floor", half).differs(half)
    result = code.select((code.bits(x) < 0) & odd, -result, result)
    result = code.select((x < 0.0) & (x > -math.inf) & ~whole, math.nan, result)
    unit = size.equals(1.0) & abs(y).equals(math.inf)
    return code.select(x.equals(1.0) | y.equals(0.0) | unit, 1.0, result)


# Vectors of the working type ---------------------------------------------------------------------------


def _rounded(function: Callable[[Value], Value]) -> Callable[[Value], Value]:
    return lambda x: x.code.narrow(function(x.code.widen(x)), x.type)


ln, log10 = map(_rounded, (wide_log, wide_log10))


def power(x: Value, y: Value | float) -> Value:
    """x^y; a known exponent is a number."""
    code = x.code
    exponent = code.widen(y) if isinstance(y, Value) else y
    return code.narrow(wide_power(code.widen(x), exponent), x.type)
