"""What a page runs for each choice of effects, as text, and what it costs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import chain as joined
from itertools import combinations

from iccbrdf.calc.graph import Node, needed_by
from iccbrdf.calc.schedule import Schedule, computed, schedule
from iccbrdf.viewer.chain import EFFECTS, Chain, display_graph, pixel_graph
from iccbrdf.viewer.glsl import function_body
from iccbrdf.viewer.javascript import pixel_function, uniforms_function

ARGUMENTS = "u"
"""The array of a program's arguments in GLSL."""

_WEIGHT = {
    "div": 4, "sqrt": 4, "exp": 5, "ln": 6, "log": 6, "cbrt": 16, "pow": 12, "mod": 12, "sin": 16, "cos": 16,
    "tan": 36, "asin": 36, "acos": 36, "atan": 32, "atn2": 32, "input": 2, "pick": 0,
}  # fmt: skip
"""Operations of a node, in additions: GPUs give special functions at a quarter of the rate."""


@dataclass(frozen=True)
class Program:
    """The chain with some effects left out.

    Attributes
    ----------
    body
        GLSL statements that set XYZ under D50 at a pixel.
    uniforms
        A JavaScript function from run-time variables to the arguments of the body.
    arguments
        How many those are.
    pixel
        A JavaScript function from variables and channels to XYZ of the MVIS and the multiplex channels.
    nodes
        How often each operator of the graph is computed for a pixel.
    """

    body: str
    uniforms: str
    arguments: int
    pixel: str
    nodes: Mapping[str, int]

    @property
    def operations(self) -> int:
        """Arithmetic for a pixel, in additions."""
        return sum(_WEIGHT.get(op, 1) * count for op, count in self.nodes.items())


@dataclass(frozen=True)
class Programs:
    """The programs of a page; `of` gives for each choice of effects left out, sorted, the index of its own."""

    effects: tuple[str, ...]
    programs: tuple[Program, ...]
    of: Mapping[tuple[str, ...], int]

    @property
    def whole(self) -> Program:
        """The one with all effects."""
        return self.programs[self.of[()]]


def make_programs(chain: Chain, gaps: Collection[int] = ()) -> Programs:
    """The programs for all choices of the effects that the chain has.

    `gaps` are the channels, by position, with samples that are not finite.  Raises UnsupportedError where a graph holds what GLSL or JavaScript cannot say.
    """
    whole = _program(chain, gaps, ())
    effects = tuple(e for e in EFFECTS if _program(chain, gaps, (e,)).body != whole.body)
    programs: list[Program] = []
    of: dict[tuple[str, ...], int] = {}
    for without in joined.from_iterable(combinations(effects, n) for n in range(len(effects) + 1)):
        program = _program(chain, gaps, without)
        if program not in programs:
            programs.append(program)
        of[without] = programs.index(program)
    return Programs(effects, tuple(programs), of)


def _program(chain: Chain, gaps: Collection[int], without: tuple[str, ...]) -> Program:
    plan = schedule(display_graph(chain, without), len(chain.channels))
    return Program(
        body=_body(plan, gaps),
        uniforms=uniforms_function(plan),
        arguments=len(plan.arguments),
        pixel=pixel_function(pixel_graph(chain, without)),
        nodes=Counter(node.op for node in computed(plan.body)),
    )


def _body(plan: Schedule, gaps: Collection[int]) -> str:
    results = ["xyz.x", "xyz.y", "xyz.z"]
    inputs = {k: f"channel({k}, at)" for k in range(plan.channels)}
    body = function_body(plan, inputs, results, ARGUMENTS)
    for result, node in zip(results, plan.graph.outputs, strict=True):
        read = sorted(_inputs_of(node).intersection(gaps))
        if read:
            missing = " || ".join(f"isGap({k}, at)" for k in read)
            body += f"\n  if ({missing}) {result} = 0.0;"
    return body


def _inputs_of(output: Node) -> set[int]:
    return {node.detail for node in needed_by([output]) if node.op == "input"}
