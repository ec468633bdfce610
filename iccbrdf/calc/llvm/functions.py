"""Elementary functions of float32 vectors, as instructions.

Each reduces its argument to a small range, exactly or in two parts, and takes a polynomial there; the
coefficients are minimax ones for the relative error (Remez exchange), rounded to float32.  Results are
within 3 units in the last place of the rounded true value, with C's special values.
"""

from __future__ import annotations

import math

import numpy as np

from iccbrdf.calc.intervals import Interval
from iccbrdf.calc.llvm.assembler import Value

_LOG2_E = 1 / math.log(2)
# Few enough bits that multiples are exact.
_LN2_HIGH = 0.693359375
_LN2_LOW = math.log(2) - _LN2_HIGH
# pi / 2 in parts of 24 bits, and of 33 and 53.  All are positive: then -0 stays -0.
_HALF_PI = tuple(map(float.fromhex, ("0x1.921fb4p+0", "0x1.4442d0p-24", "0x1.846988p-48")))
_HALF_PI_HIGH = float.fromhex("0x1.921fb544p+0")
_HALF_PI_LOW = float.fromhex("0x1.0b4611a626331p-34")

EXP_PLAIN = Interval(-87.0, 88.0)
CBRT_PLAIN = Interval(2.0**-100, math.inf)
SIN_PLAIN = Interval(-1.5707, 1.5707)
"""Where `exp_plain` and so on, which are shorter, do."""

_EXP_LARGEST = float.fromhex("0x1.62e42ep6")
"""The largest float32 number whose exponential is one."""

# (e^r - 1 - r) / r^2 for |r| <= ln 2 / 2
_EXP = (0.49999994, 0.16666517, 0.041668102, 0.0083691655, 0.0013838324)
# ((1 - e)^(-1/3) - 1) / e for |e| <= 0.104
_CBRT = (0.3346972, 0.22289944)
# (sin r / r - 1) / z in z = r^2, for |r| <= pi / 2
_SINE = (-0.1666666, 0.008333066, -0.0001980954, 2.6056311e-06)
# The same and (cos r - 1 + z / 2) / z^2, for |r| <= pi / 4
_SIN = (-0.16666655, 0.008332188, -0.00019518095)
_COS = (0.041666646, -0.001388731, 2.4432327e-05)
# (atan t / t - 1) / z in z = t^2, for |t| <= 1
_ATAN = (
    -0.333333, 0.1999853, -0.14264016, 0.10950881, -0.083993085,
    0.05788101, -0.03109554, 0.010866951, -0.001782136,
)  # fmt: skip


def nearest(x: Value, shift: float) -> tuple[Value, Value]:
    """The nearest whole number as a number and, in the low bits, as an integer.

    `shift` is 1.5 times the first power of two from which on the type has whole numbers only; |x| is well
    below it.  NaN gives NaN and some integer.
    """
    code = x.code
    shifted = x + shift
    return shifted - shift, code.bits(shifted) - code.bits(code.constant(shift, x.type))


def exp(x: Value) -> Value:
    """e^x."""
    code = x.code
    power, n = _power_of_e(code.select(x < -104.0, -104.0, x))
    return code.select(x <= _EXP_LARGEST, scaled(power, n), x + math.inf)


def exp_plain(x: Value) -> Value:
    """e^x for x in EXP_PLAIN."""
    power, n = _power_of_e(x)
    return _scaled_plainly(power, n)


def _power_of_e(x: Value) -> tuple[Value, Value]:
    """e^x / 2^n, near 1, and n."""
    code = x.code
    whole, n = nearest(x * _LOG2_E, 1.5 * 2**23)
    r = code.muladd(whole, -_LN2_HIGH, x)
    r = code.muladd(whole, -_LN2_LOW, r)
    return code.polynomial(r, (1.0, 1.0, *_EXP)), n


def scaled(x: Value, n: Value) -> Value:
    """2^n x for x near 1, n from -1000 up to what a float32 number holds; NaN may give anything.

    Processors take a hundred times as long to multiply where the product is subnormal: normal products are
    made by an addition to the exponent, others in float64.
    """
    code = x.code
    small = n < -125

    def subnormal() -> list[Value]:
        factor = code.cast("sext", n + 1023, n.type.of("i64")) << 52
        wide = code.widen(x)
        return [code.narrow(wide * code.from_bits(factor, wide), x.type)]

    (other,) = code.where_any(small, subnormal)
    return code.select(small, other, _scaled_plainly(x, n))


def _scaled_plainly(x: Value, n: Value) -> Value:
    return x.code.from_bits(x.code.bits(x) + (n << 23), x)


def cbrt(x: Value) -> Value:
    """The cube root."""
    code = x.code
    size = abs(x)
    tiny = size < CBRT_PLAIN.low
    root = cbrt_plain(code.select(tiny, size * 2.0**24, size))
    return code.intrinsic("copysign", code.select(tiny, root * 2.0**-8, root), x)


def cbrt_plain(x: Value) -> Value:
    """The cube root of x in CBRT_PLAIN: y near x^(-1/3), better by a series, then x y^2, by Newton's step."""
    code = x.code
    # The bits of a number are near its logarithm.
    guess = code.muladd(code.cast("sitofp", code.bits(x), x.type), -1 / 3, 0x54A2143F)
    y = code.from_bits(code.cast("fptosi", guess, x.type.of("i32")), x)
    error = code.muladd(-(x * y), y * y, 1.0)
    y = code.muladd(y * error, code.polynomial(error, _CBRT), y)
    square = y * y
    root = x * square
    # Lest the cube overflow where it is rounded.
    part = 1.0 if code.target.fma else 0.125
    excess = code.muladd(root * root, root * part, x * -part)
    root = code.muladd(excess * square, -1 / (3 * part), root)
    return code.select(x < math.inf, root, x)


# Angles ------------------------------------------------------------------------------------------------

_TINY = 2.0**-30
_MOST_TURNED = 2.0**13
"""Up to this size of an argument the number of quarter turns is right, and their sum exact enough."""


def _turned_back(x: Value, quarters: Value) -> Value:
    """x less that many quarter turns."""
    code = x.code
    if code.target.fma:
        for part in _HALF_PI:
            x = code.muladd(quarters, -part, x)
        return x
    number = code.widen(quarters)
    rest = code.widen(x) - number * _HALF_PI_HIGH - number * _HALF_PI_LOW
    return code.narrow(rest, x.type)


def _unless_large(x: Value, result: Value, function: str) -> Value:
    """`result`, or the C library's where |x| is too large for our reduction."""
    code = x.code
    size = abs(x)
    large = (size > _MOST_TURNED) & (size < math.inf)
    (other,) = code.where_any(large, lambda: [code.each_lane(function, x)])
    return code.select(large, other, result)


def _or_zero(x: Value) -> Value:
    """x, or 0 where it is so small that it is its own sine and tangent: subnormal numbers take long."""
    return x.code.select(abs(x) < _TINY, 0.0, x)


def _unless_tiny(x: Value, result: Value) -> Value:
    """`result`, or x where `_or_zero` has put 0 in its place."""
    return x.code.select(abs(x) < _TINY, x, result)


def _sine(r: Value) -> Value:
    """The sine of r, of size up to pi / 2; of a zero, a zero of any sign."""
    z = r * r
    return r.code.muladd(r * z, r.code.polynomial(z, _SINE), r)


def _with_sign(x: Value, turns: Value) -> Value:
    """-x where `turns` is odd."""
    return x.code.from_bits(x.code.bits(x) ^ (turns << 31), x)


def sin(x: Value) -> Value:
    whole, turns = nearest(_or_zero(x) * (1 / math.pi), 1.5 * 2**23)
    sine = _with_sign(_sine(_turned_back(_or_zero(x), whole + whole)), turns)
    return _unless_tiny(x, _unless_large(x, sine, "sin"))


def sin_plain(x: Value) -> Value:
    """The sine of x in SIN_PLAIN."""
    return _unless_tiny(x, _sine(_or_zero(x)))


def cos(x: Value) -> Value:
    """As the sine of what is left of x and a quarter turn."""
    whole, turns = nearest(_or_zero(x) * (1 / math.pi) - 0.5, 1.5 * 2**23)
    sine = _sine(_turned_back(_or_zero(x), whole + whole + 1.0))
    return _unless_large(x, _with_sign(sine, turns + 1), "cos")


def tan(x: Value) -> Value:
    code = x.code
    whole, turns = nearest(_or_zero(x) * (2 / math.pi), 1.5 * 2**23)
    r = _turned_back(_or_zero(x), whole)
    z = r * r
    sine = code.muladd(r * z, code.polynomial(z, _SIN), r)
    cosine = code.muladd(z * z, code.polynomial(z, _COS), code.muladd(z, -0.5, 1.0))
    odd = (turns & 1).differs(0)
    result = code.select(odd, -cosine, sine) / code.select(odd, sine, cosine)
    return _unless_tiny(x, _unless_large(x, result, "tan"))


def angle(x: Value, y: Value) -> Value:
    """The angle of the point x, y, as C's atan2(y, x)."""
    code = x.code
    width, height = abs(x), abs(y)
    steep = height > width
    small, large = code.select(steep, width, height), code.select(steep, height, width)
    # 0 / 0 is 0 here, infinity / infinity 1.
    diagonal = code.select(small > 0.0, 1.0, 0.0, x.type)
    t = code.select(small.equals(large), diagonal, small / large)
    z = t * t
    result = code.muladd(t * z, code.polynomial(z, _ATAN), t)
    result = code.select(steep, _less(math.pi / 2, result), result)
    left = code.bits(x) < 0
    result = code.select(left, _less(math.pi, result), result)
    return code.intrinsic("copysign", result, y)


def _less(whole: float, part: Value) -> Value:
    """whole - part, where `whole` is no float32 number."""
    high = float(np.float32(whole))
    return high - (part - (whole - high))


def atan(x: Value) -> Value:
    return angle(x.code.constant(1.0, x.type), x)


def asin(x: Value) -> Value:
    return angle(_other_leg(x), x)


def acos(x: Value) -> Value:
    return angle(x, _other_leg(x))


def _other_leg(x: Value) -> Value:
    """The other leg of a right triangle with hypotenuse 1; NaN where |x| > 1."""
    return x.code.intrinsic("sqrt", (1.0 - x) * (1.0 + x))


# Remainder ---------------------------------------------------------------------------------------------


def modulo(a: Value, b: Value) -> Value:
    """The remainder of a / b with the sign of a, exact; a where b is 0."""
    code = a.code
    x, y = code.widen(a), code.widen(b)
    quotient = code.intrinsic("trunc", x / y)
    # Up to 2^24 the quotient, its product with y, and what is left are exact.
    rest = code.narrow(x - quotient * y, a.type)
    rest = code.select((abs(b).equals(math.inf)) & (abs(a) < math.inf), a, rest)
    size = abs(quotient)
    large = (size >= 2.0**24) & (size < math.inf)
    (other,) = code.where_any(large, lambda: [code.each_lane("fmod", a, b)])
    result = code.intrinsic("copysign", code.select(large, other, rest), a)
    return code.select(b.equals(0.0), a, result)
