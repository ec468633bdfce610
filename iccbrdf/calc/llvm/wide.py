"""Logarithms and powers: float64 vectors inside, for float32 results and for curves.

A power's exponent multiplies the error of the logarithm, so float32 would not do.  The functions whose name
begins with `wide` take and give float64, as curves need it: to 1e-15 for logarithms and, in the range of
float32 numbers, 1e-13 for powers.  Where the working type is float64 they call the C library instead.
"""

from __future__ import annotations

import math

from iccbrdf.calc.llvm.assembler import Value
from iccbrdf.calc.llvm.functions import nearest, scaled

_LOG2_E = 1 / math.log(2)
# ln((1 + s) / (1 - s)) = 2 s (1 + s^2 / 3 + s^4 / 5 + ...), |s| <= 0.1716
_ATANH = tuple(2 / (2 * k + 1) for k in range(11))
_FEW = 7
"""Terms of it that do for powers in float32: a relative error of 2^-39."""
# e^r, |r| <= ln 2 / 2
_EXP = tuple(1 / math.factorial(k) for k in range(14))
# (2^r - 1) / r, |r| <= 1 / 2, in float32
_EXP2 = (0.6931472, 0.24022594, 0.055503663, 0.009625445, 0.0013388315, 0.00013323483)

_MANTISSA = (1 << 52) - 1
_EXPONENT_OF_1, _EXPONENT_OF_2_52 = 1023 << 52, 1075 << 52
_MOST_MULTIPLIED = 32
"""Whole exponents up to this size are multiplications."""


# Logarithms --------------------------------------------------------------------------------------------


def _log2(x: Value, terms: int) -> Value:
    """log2 of a float64 vector without subnormal numbers; -inf for 0, NaN for negative numbers."""
    code = x.code
    bits = code.bits(x)
    exponent = code.from_bits(bits.drop(52) | _EXPONENT_OF_2_52, x) - (2.0**52 + 1023.0)
    m = code.from_bits((bits & _MANTISSA) | _EXPONENT_OF_1, x)
    upper = m > math.sqrt(2)
    m = code.select(upper, m * 0.5, m)
    exponent = exponent + code.select(upper, 1.0, 0.0, x.type)
    s = (m - 1.0) / (m + 1.0)
    log = s * code.polynomial(s * s, _ATANH[:terms])
    result = code.muladd(log, _LOG2_E, exponent)
    result = code.select(x < math.inf, result, x)
    return code.select(x > 0.0, result, code.select(x.equals(0.0), -math.inf, math.nan, x.type))


def _wide_log2(x: Value) -> Value:
    code = x.code
    tiny = x < 2.0**-1022
    log = _log2(code.select(tiny, x * 2.0**54, x), len(_ATANH))
    return log - code.select(tiny, 54.0, 0.0, x.type)


def wide_log(x: Value) -> Value:
    if x.code.real == "double":
        return x.code.each_lane("log", x)
    return _wide_log2(x) * math.log(2)


def wide_log10(x: Value) -> Value:
    if x.code.real == "double":
        return x.code.each_lane("log10", x)
    return _wide_log2(x) * math.log10(2)


def ln(x: Value) -> Value:
    """Of float32, as `log10`."""
    code = x.code
    return code.narrow(_log2(code.widen(x), _FEW) * math.log(2), x.type)


def log10(x: Value) -> Value:
    code = x.code
    return code.narrow(_log2(code.widen(x), _FEW) * math.log10(2), x.type)


# Exponentials ------------------------------------------------------------------------------------------


def _wide_exp2(x: Value) -> Value:
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
    return _wide_exp2(x * _LOG2_E)


def _exp2(x: Value) -> Value:
    """2^x in float32 of a float64 vector."""
    code = x.code
    x = code.select(x > 129.0, 129.0, x)
    x = code.select(x < -151.0, -151.0, x)
    whole, turns = nearest(x, 1.5 * 2**52)
    n = code.cast("trunc", turns, x.type.of("i32"))
    r = code.narrow(x - whole, x.type.of("float"))
    power = code.muladd(r, code.polynomial(r, _EXP2), 1.0)
    return code.select(x < 128.0, scaled(power, n), r + math.inf)


# Powers ------------------------------------------------------------------------------------------------


def wide_power(x: Value, y: Value | float) -> Value:
    """x^y as C's pow; a known exponent is a number."""
    code = x.code
    if not isinstance(y, Value):
        if abs(y) <= _MOST_MULTIPLIED and y == int(y) and code.real == "float":
            return _whole_power(x, int(y))
        y = code.constant(y, x.type)
    if code.real == "double":
        return code.each_lane("pow", x, y)
    return _as_pow(_wide_exp2(y * _wide_log2(abs(x))), x, y)


def power(x: Value, y: Value) -> Value:
    """x^y of float32."""
    code = x.code
    return _as_pow(_exp2(code.widen(y) * _log2(code.widen(abs(x)), _FEW)), x, y)


def known_power(x: Value, y: float) -> Value:
    """x^y of float32 for an exponent that is known."""
    code = x.code
    if abs(y) == 0.5:
        root = code.intrinsic("sqrt", abs(x))
        return _of_positive(root if y > 0 else 1.0 / root, x)
    if abs(y) <= _MOST_MULTIPLIED and y == int(y):
        return code.narrow(_whole_power(code.widen(x), int(y)), x.type)
    exponent = code.constant(y, x.type)
    if math.isfinite(y) and y != int(y):
        return code.apply("power.of.positive", _broken_power, x, exponent)
    return code.apply("pow", power, x, exponent)


def _whole_power(x: Value, n: int) -> Value:
    result = x.code.constant(1.0, x.type)
    square = x
    for bit in reversed(f"{abs(n):b}"):
        if bit == "1":
            result = result * square
        square = square * square
    return 1.0 / result if n < 0 else result


def _broken_power(x: Value, y: Value) -> Value:
    code = x.code
    return _of_positive(_exp2(code.widen(y) * _log2(code.widen(abs(x)), _FEW)), x)


def _of_positive(result: Value, x: Value) -> Value:
    """`result`, a power that is no whole number, but NaN for negative x."""
    return x.code.select((x < 0.0) & (x > -math.inf), math.nan, result)


def _as_pow(result: Value, x: Value, y: Value) -> Value:
    """|x|^y with the sign and the special values of C's pow."""
    code = x.code
    half = y * 0.5
    whole = code.intrinsic("floor", y).equals(y)
    odd = whole & code.intrinsic("floor", half).differs(half)
    result = code.select((code.bits(x) < 0) & odd, -result, result)
    result = code.select((x < 0.0) & (x > -math.inf) & ~whole, math.nan, result)
    unit = abs(x).equals(1.0) & abs(y).equals(math.inf)
    return code.select(x.equals(1.0) | y.equals(0.0) | unit, 1.0, result)
