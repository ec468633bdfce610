"""Graphs as JavaScript: what holds for a whole frame, and single pixels for the read-out.

JavaScript computes in float64, so its results differ from those of a float32 run by rounding alone.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping

from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.schedule import Schedule
from iccbrdf.viewer.straight import Language, Writer, statements


def literal(value: float) -> str:
    """A number; those that are not finite by name."""
    if math.isfinite(value):
        return repr(value) if not math.copysign(1, value) < 0 else f"({value!r})"
    return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "(-Infinity)"


_CAST = "(Math.abs({{0}}) < 2147483648 ? {} : -2147483648)"
"""As C's cast to an integer gives the least one for what does not fit."""

JAVASCRIPT = Language(
    name="JavaScript",
    patterns={
        "neg": "-{0}", "abs": "Math.abs({0})", "sqrt": "Math.sqrt({0})", "cbrt": "Math.cbrt({0})",
        "flor": "Math.floor({0})", "ceil": "Math.ceil({0})", "trnc": _CAST.format("Math.trunc({0})"),
        "rond": _CAST.format("Math.sign({0}) * Math.floor(Math.abs({0}) + 0.5)"),
        "sign": "(({0} > 0) - ({0} < 0))",
        "exp": "Math.exp({0})", "log": "Math.log10({0})", "ln": "Math.log({0})",
        "sin": "Math.sin({0})", "cos": "Math.cos({0})", "tan": "Math.tan({0})",
        "asin": "Math.asin({0})", "acos": "Math.acos({0})", "atan": "Math.atan({0})",
        "add": "{0} + {1}", "sub": "{0} - {1}", "mul": "{0} * {1}", "div": "{0} / {1}",
        "mod": "({1} === 0 ? {0} : {0} % {1})", "pow": "Math.pow({0}, {1})", "atn2": "Math.atan2({1}, {0})",
        "vmin": "({0} < {1} ? {0} : {1})", "vmax": "({0} > {1} ? {0} : {1})",
        "lt": "{0} < {1}", "le": "{0} <= {1}", "gt": "{0} > {1}", "ge": "{0} >= {1}",
        "eq": "({0} === {1} || ({0} !== {0} && {1} !== {1}))",
        "neq": "!({0} === {1} || ({0} !== {0} && {1} !== {1}))",
        "rnum": "Number.isFinite({0})",
        "not": "!{0}", "vand": "{0} && {1}", "vor": "{0} || {1}", "vxor": "{0} !== {1}",
        "select": "({0} ? {1} : {2})",
    },
    literal=literal,
    declare="const {name} = {value};",
    number="number",
    truth="boolean",
    from_truth="Number({0})",
)  # fmt: skip


def uniforms_function(plan: Schedule) -> str:
    """A function from the run-time variables, an object by name, to the arguments of the body."""
    known = _variables(plan.graph)
    lines = statements(JAVASCRIPT, plan.uniform, known)
    return _function("env", lines, _numbers(plan.arguments, known))


def pixel_function(graph: Graph) -> str:
    """A function from the run-time variables and the channels of a pixel to all outputs of `graph`."""
    live = graph.live()
    known = _variables(graph) | {node: f"x[{node.detail}]" for node in live if node.op == "input"}
    return _function("env, x", statements(JAVASCRIPT, live, known), _numbers(graph.outputs, known))


def _numbers(nodes: Iterable[Node], known: Mapping[Node, str]) -> list[str]:
    writer = Writer(JAVASCRIPT, known)
    return [writer.number(node) for node in nodes]


def _variables(graph: Graph) -> dict[Node, str]:
    live = graph.live()
    known = {node: f"(env[{json.dumps(node.detail)}] ?? 0)" for node in live if node.op == "variable"}
    return known | {node: f"({json.dumps(node.detail)} in env)" for node in live if node.op == "defined"}


def _function(parameters: str, lines: list[str], results: list[str]) -> str:
    body = "\n".join([*lines, f"return [{', '.join(results)}];"])
    return f"({parameters}) => {{\n{body}\n}}"
