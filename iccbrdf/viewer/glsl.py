"""The body of a schedule as GLSL ES 3.00, for one pixel: a back end of the graph.

What GLSL leaves to the driver is not relied upon: NaN is told by its bits (drivers fold comparisons), powers
and logarithms have their special cases written out, and sines and angles, of which drivers give few digits,
are computed here.  Within the accuracy of the driver's exp, log2 and exp2 the results are those of the
interpreter for all finite numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from iccbrdf.calc.graph import Node, is_truth
from iccbrdf.calc.schedule import Schedule, computed
from iccbrdf.viewer.straight import Language, Writer


def literal(value: float) -> str:
    """A float32 number, to the bit."""
    number = np.float32(value)
    if not np.isfinite(number):
        return f"uintBitsToFloat({number.view(np.uint32):#010x}u)"
    text = np.format_float_scientific(number, unique=True, trim="0")
    return f"({text})" if math.copysign(1, value) < 0 else text


GLSL = Language(
    name="GLSL",
    patterns={
        "neg": "-{0}", "abs": "abs({0})", "sqrt": "sqrt({0})", "cbrt": "cubeRoot({0})",
        "flor": "floor({0})", "ceil": "ceil({0})", "trnc": "truncated({0})",
        "rond": "rounded({0})", "sign": "sign({0})",
        "exp": "exp({0})", "log": "0.434294482 * logarithm({0})", "ln": "logarithm({0})",
        "sin": "sine({0})", "cos": "cosine({0})", "tan": "(sine({0}) / cosine({0}))",
        "asin": "angle(sqrt((1.0 - {0}) * (1.0 + {0})), {0})",
        "acos": "angle({0}, sqrt((1.0 - {0}) * (1.0 + {0})))",
        "atan": "angle(1.0, {0})", "atn2": "angle({0}, {1})",
        "add": "{0} + {1}", "sub": "{0} - {1}", "mul": "{0} * {1}", "div": "{0} / {1}",
        "mod": "remainder({0}, {1})", "pow": "power({0}, {1})",
        "vmin": "({0} < {1} ? {0} : {1})", "vmax": "({0} > {1} ? {0} : {1})",
        "lt": "{0} < {1}", "le": "{0} <= {1}", "gt": "{0} > {1}", "ge": "{0} >= {1}",
        "eq": "same({0}, {1})", "neq": "!same({0}, {1})", "rnum": "isFinite({0})",
        "not": "!{0}", "vand": "{0} && {1}", "vor": "{0} || {1}", "vxor": "{0} != {1}",
        "select": "({0} ? {1} : {2})",
    },
    literal=literal,
    declare="{type} {name} = {value};",
    number="float",
    truth="bool",
    from_truth="float({0})",
)  # fmt: skip

FUNCTIONS = {
    "isFinite": "bool isFinite(float a) { return (floatBitsToUint(a) & 0x7f800000u) != 0x7f800000u; }",
    "isNaN": "bool isNaN(float a) { return (floatBitsToUint(a) & 0x7fffffffu) > 0x7f800000u; }",
    "same": "bool same(float a, float b) { return a == b || (isNaN(a) && isNaN(b)); }",
    # log2 of 0 is a large number with some drivers.
    "logarithm": """float logarithm(float a) {
  if (a > 0.0) return log2(a) * 0.693147181;
  return uintBitsToFloat(a == 0.0 ? 0xff800000u : 0x7fc00000u);
}""",
    "power": """float power(float a, float b) {
  if (b == 0.0) return 1.0;
  if (a > 0.0) return exp2(b * log2(a));
  if (a == 0.0) return b > 0.0 ? 0.0 : uintBitsToFloat(0x7f800000u);
  if (b != floor(b)) return uintBitsToFloat(0x7fc00000u);
  return exp2(b * log2(-a)) * (b == 2.0 * floor(b * 0.5) ? 1.0 : -1.0);
}""",
    # A step of Newton's makes the driver's power a root of full precision.
    "cubeRoot": """float cubeRoot(float a) {
  if (a == 0.0 || !isFinite(a)) return a;
  float b = sign(a) * exp2(log2(abs(a)) * 0.333333333);
  return b - (b * b * b - a) / (3.0 * b * b);
}""",
    # As C's cast, which gives the least integer for what does not fit.
    "truncated": """float truncated(float a) {
  return abs(a) < 2147483648.0 ? trunc(a) : -2147483648.0;
}""",
    "rounded": """float rounded(float a) {
  return abs(a) < 2147483648.0 ? sign(a) * floor(abs(a) + 0.5) : -2147483648.0;
}""",
    "remainder": """float remainder(float a, float b) {
  if (b == 0.0) return a;
  float rest = abs(a) - abs(b) * floor(abs(a) / abs(b));
  rest = rest < 0.0 ? rest + abs(b) : rest >= abs(b) ? rest - abs(b) : rest;
  return a < 0.0 ? -rest : rest;
}""",
    # Taylor series, to the last bit within an eighth of a turn; the quarters are taken off in parts that are
    # exact (W. Cody, W. Waite: Software manual for the elementary functions, 1980).
    "wave": """float wave(float a, int shift) {
  float turns = floor(a * 0.636619772 + 0.5);
  float r = ((a - turns * 1.5703125) - turns * 4.83751297e-4) - turns * 7.54978995e-8;
  int quarter = (int(turns) + shift) & 3;
  float s = r * r;
  float odd = r * (1.0 + s * (-0.166666667 + s * (8.33333333e-3 + s * (-1.98412698e-4 + s * 2.75573192e-6))));
  float even = 1.0 + s * (-0.5 + s * (0.0416666667 + s * (-1.38888889e-3 + s * 2.48015873e-5)));
  float value = (quarter & 1) == 0 ? odd : even;
  return quarter < 2 ? value : -value;
}""",
    "sine": "float sine(float a) { return wave(a, 0); }",
    "cosine": "float cosine(float a) { return wave(a, 1); }",
    # Taylor series of the arc tangent of at most tan(pi / 16), after two halvings of the angle.
    "angle": """float angle(float x, float y) {
  float a = abs(x), b = abs(y);
  float ratio = max(a, b) == 0.0 ? 0.0 : min(a, b) / max(a, b);
  float half1 = ratio / (1.0 + sqrt(1.0 + ratio * ratio));
  float t = half1 / (1.0 + sqrt(1.0 + half1 * half1));
  float s = t * t;
  float value = 4.0 * t * (1.0 + s * (-0.333333333 + s * (0.2 + s * (-0.142857143 + s * 0.111111111))));
  value = b > a ? 1.57079633 - value : value;
  value = x < 0.0 ? 3.14159265 - value : value;
  return y < 0.0 ? -value : value;
}""",
}
"""What patterns call, each after what it calls itself."""


def function_body(
    plan: Schedule, results: Sequence[str], arguments: str, gaps: Collection[int] = ()
) -> str:
    """The statements that assign the outputs of a schedule; 0 to those that are no number.

    They read `channel(k, at)` and, of the channels in `gaps`, `isGap(k, at)`.

    Parameters
    ----------
    results
        What the outputs are assigned to, in order.
    arguments
        The name of the array of floats that holds the values of the schedule's arguments.
    gaps
        The channels that may hold NaN.  What depends on them is accompanied by whether it is a NaN.

    Raises
    ------
    UnsupportedError
        A node that GLSL has no counterpart for: a table, a curve or `solv`.
    """
    nodes = list(computed(plan.body))
    writer = Writer(
        GLSL,
        {
            node: f"({arguments}[{k}] > 0.5)" if is_truth(node) else f"{arguments}[{k}]"
            for k, node in enumerate(plan.arguments)
        },
    )
    missing = _Missing(writer, {})
    lines: list[str] = []
    for node in nodes:
        if node.op == "input":
            lines.append(writer.declaration(node, f"channel({node.detail}, at)"))
            if node.detail in gaps:
                lines.append(missing.flagged(node, f"isGap({node.detail}, at)"))
        else:
            lines += missing.lines(node)
    for result, node in zip(results, plan.graph.outputs, strict=True):
        guard = f"{missing.flags[node]} ? 0.0 : " if node in missing.flags else ""
        lines.append(f"{result} = {guard}{writer.number(node)};")
    return "\n".join(f"  {line}" for line in lines)


@dataclass(frozen=True)
class _Missing:
    """Which nodes are NaN because a channel is, told by conditions of their own.

    It follows what the interpreter does with NaN: comparisons are false, `vmin` and `vmax` then give their
    second argument, and a select the side that it takes.
    """

    writer: Writer
    flags: dict[Node, str]
    """The names of the conditions."""

    def flagged(self, node: Node, condition: str) -> str:
        """The line that declares a node's condition."""
        self.flags[node] = f"n{node.index}"
        return f"bool {self.flags[node]} = {condition};"

    def lines(self, node: Node) -> list[str]:
        """The declarations of a node and of its condition."""
        writer, flags = self.writer, [self.flags.get(argument) for argument in node.arguments]
        known = [flag for flag in flags if flag]
        if not known:
            return [writer.declaration(node)]
        some, texts = " || ".join(known), writer.arguments(node)
        if node.op in ("eq", "neq"):
            # A NaN equals a NaN.
            alike = f"{flags[0] or 'false'} == {flags[1] or 'false'}"
            equal = f"(({some}) ? {alike} : same({texts[0]}, {texts[1]}))"
            return [writer.declaration(node, equal if node.op == "eq" else f"!{equal}")]
        own = writer.expression(node)
        if is_truth(node):
            return [writer.declaration(node, f"!({some}) && {own}")]
        if node.op in _OF_NAN:
            return [writer.declaration(node, f"({some} ? {literal(_OF_NAN[node.op])} : {own})")]
        if node.op in ("vmin", "vmax"):
            # One condition: drivers make branches of conditions in conditions, and take long over them.
            sign = "<" if node.op == "vmin" else ">"
            least = f"(!({some}) && {texts[0]} {sign} {texts[1]} ? {texts[0]} : {texts[1]})"
            line = writer.declaration(node, least)
            return [line, self.flagged(node, flags[1])] if flags[1] else [line]
        if node.op == "select":
            some = f"{texts[0]} ? {flags[1] or 'false'} : {flags[2] or 'false'}"
        elif node.op == "pow":
            base, exponent = (flag or "false" for flag in flags)
            some = f"({base} && {texts[1]} != 0.0) || ({exponent} && ({base} || {texts[0]} != 1.0))"
        return [writer.declaration(node), self.flagged(node, some)]


_OF_NAN = {"sign": 0.0, "rond": -(2.0**31), "trnc": -(2.0**31)}
"""What operators give that make a number of NaN."""


def functions_for(text: str) -> str:
    """The functions of `FUNCTIONS` that `text` calls, and those that they call."""
    needed: list[str] = []
    for name, definition in reversed(FUNCTIONS.items()):
        if any(re.search(rf"\b{name}\(", place) for place in (text, *needed)):
            needed.insert(0, definition)
    return "\n".join(needed)
