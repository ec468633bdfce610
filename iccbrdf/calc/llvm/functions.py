"""Elementary functions of float32 vectors, as instructions.

Each reduces its argument to a small range, exactly or in two parts, and takes a polynomial there; the
coefficients are minimax ones for the relative error (Remez exchange), rounded to float32.  Results are
within 3 units in the last place of the rounded true value, with C's special values.
"""

from __future__ import annotations

import math

import numpy as np

from iccbrdf.calc.llvm.assembler import Value

_LOG2_E = 1 / math.log(2)
# Few enough bits that multiples are exact.
_LN2_HIGH = 0.693359375
_LN2_LOW = math.log(2) - _LN2_HIGH
# pi / 2 in parts of 24 bits, and of 33 and 53.  All are positive: then -0 stays -0.
_HALF_PI = tuple(map(float.fromhex, ("0x1.921fb4p+0", "0x1.4442d0p-24", "0x1.846988p-48")))
_HALF_PI_HIGH = float.fromhex("0x1.921fb544p+0")
_HALF_PI_LOW = float.fromhex("0x1.0b4611a626331p-34")

_EXP_LARGEST = float.fromhex("0x1.62e42ep6")
"""The largest float32 number whose exponential is one."""

# (e^r - 1 - r) / r^2 for |r| <= ln 2 / 2
_EXP = (0.49999994, 0.16666517, 0.041668102, 0.0083691655, 0.0013838324)
# (sin r / r - 1) / z and (cos r - 1 + z / 2) / z^2 in z = r^2, for |r| <= pi / 4
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
    within = code.select(x < -104.0, -104.0, x)
    whole, n = nearest(within * _LOG2_E, 1.5 * 2**23)
    r = code.muladd(whole, -_LN2_HIGH, within)
    r = code.muladd(whole, -_LN2_LOW, r)
    power = code.muladd(r * r, code.polynomial(r, _EXP), r) + 1.0
    return code.select(x <= _EXP_LARGEST, scaled(power, n), x + math.inf)


def scaled(x: Value, n: Value) -> Value:
    """2^n x for x near 1, n from -1000 up to what a float32 number holds; NaN may give anything.

    Processors take a hundred times as long to multiply where the product is subnormal: normal products are
    made by an addition to the exponent, others in float64.
    """
    code = x.code
    normal = code.from_bits(code.bits(x) + (n << 23), x)
    small = n < -125

    def subnormal() -> list[Value]:
        factor = code.cast("sext", n + 1023, n.type.of("i64")) << 52
        wide = code.widen(x)
        return [code.narrow(wide * code.from_bits(factor, wide), x.type)]

    (other,) = code.where_any(small, subnormal)
    return code.select(small, other, normal)


def cbrt(x: Value) -> Value:
    """The cube root: y near |x|^(-1/3), made better by Householder's iteration, then x y^2, corrected."""
    code = x.code
    size = abs(x)
    tiny = size < 2.0**-120
    a = code.select(tiny, size * 2.0**24, size)
    # The bits of a number are near its logarithm.
    third = code.cast("sitofp", code.bits(a), x.type) * (1 / 3)
    y = code.from_bits(0x54A21D2A - code.cast("fptosi", third, x.type.of("i32")), x)
    for _ in range(2):
        error = 1.0 - (a * y) * (y * y)
        y = code.muladd(y * error, code.muladd(error, 2 / 9, 1 / 3), y)
    square = y * y
    root = a * square
    # Over 8, lest the cube overflow.
    excess = (root * root) * (root * 0.125) - a * 0.125
    root = root - excess * (square * (8 / 3))
    root = code.select(tiny, root * 2.0**-8, root)
    return code.intrinsic("copysign", code.select(size < math.inf, root, size), x)


# Angles ------------------------------------------------------------------------------------------------

_TINY = 2.0**-30
_MOST_TURNED = 2.0**13
"""Up to this size of an argument the number of quarter turns is right, and their sum exact enough."""


def _turned_back(x: Value) -> tuple[Value, Value]:
    """x less n quarter turns, of size up to pi / 4, and n as i32."""
    code = x.code
    whole, turns = nearest(x * (2 / math.pi), 1.5 * 2**23)
    if code.target.fma:
        for part in _HALF_PI:
            x = code.muladd(whole, -part, x)
        return x, turns
    number = code.widen(whole)
    rest = code.widen(x) - number * _HALF_PI_HIGH - number * _HALF_PI_LOW
    return code.narrow(rest, x.type), turns


def _quarter(x: Value) -> tuple[Value, Value, Value]:
    """Sine and cosine of x less n quarter turns, and n as i32."""
    code = x.code
    # Nor does a subnormal argument do harm when it is 0.
    r, turns = _turned_back(code.select(abs(x) < _TINY, 0.0, x))
    z = r * r
    # r (1 + ...) keeps the sign of a zero.
    sine = r * code.muladd(z, code.polynomial(z, _SIN), 1.0)
    cosine = code.muladd(z * z, code.polynomial(z, _COS), code.muladd(z, -0.5, 1.0))
    return sine, cosine, turns


def _unless_large(x: Value, result: Value, function: str) -> Value:
    """`result`, or the C library's where |x| is too large for our reduction."""
    code = x.code
    size = abs(x)
    large = (size > _MOST_TURNED) & (size < math.inf)
    (other,) = code.where_any(large, lambda: [code.each_lane(function, x)])
    return code.select(large, other, result)


def _unless_tiny(x: Value, result: Value) -> Value:
    """`result`, or x where it is so small that it is its own sine and tangent."""
    return x.code.select(abs(x) < _TINY, x, result)


def _with_sign(x: Value, turns: Value) -> Value:
    """-x where bit 1 of `turns` is set."""
    code = x.code
    return code.from_bits(code.bits(x) ^ ((turns & 2) << 30), x)


def sin(x: Value) -> Value:
    sine, cosine, turns = _quarter(x)
    chosen = x.code.select((turns & 1).differs(0), cosine, sine)
    return _unless_tiny(x, _unless_large(x, _with_sign(chosen, turns), "sin"))


def cos(x: Value) -> Value:
    sine, cosine, turns = _quarter(x)
    chosen = x.code.select((turns & 1).differs(0), sine, cosine)
    return _unless_large(x, _with_sign(chosen, turns + 1), "cos")


def tan(x: Value) -> Value:
    code = x.code
    sine, cosine, turns = _quarter(x)
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
