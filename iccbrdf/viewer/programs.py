"""What a page runs for each choice of effects, as text, and what it costs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import chain as joined
from itertools import combinations

from iccbrdf.calc.schedule import computed, schedule
from iccbrdf.viewer.chain import EFFECTS, Chain, graphs
from iccbrdf.viewer.glsl import function_body
from iccbrdf.viewer.javascript import pixel_function, uniforms_function

ARGUMENTS = "u"
RESULTS = ("xyz.x", "xyz.y", "xyz.z")
"""What a program's body reads and sets (shader.glsl)."""

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
    """The programs of a page; `of` gives the index of one for each choice of effects left out."""

    effects: tuple[str, ...]
    programs: tuple[Program, ...]
    of: Mapping[tuple[str, ...], int]

    @property
    def whole(self) -> Program:
        """The one with all effects."""
        return self.programs[self.of[()]]


def make_programs(chain: Chain, gaps: Collection[int] = ()) -> Programs:
    """The programs for all choices of the effects that the chain has.

    `gaps` are the channels, by position, with samples that are not finite.  Raises UnsupportedError where a
    graph holds what GLSL or JavaScript cannot say.
    """
    whole = _program(chain, gaps, ())
    single = {effect: _program(chain, gaps, (effect,)) for effect in EFFECTS}
    effects = tuple(effect for effect, program in single.items() if program.body != whole.body)
    programs = [whole]
    of: dict[tuple[str, ...], int] = {(): 0}
    for without in joined.from_iterable(combinations(effects, n) for n in range(1, len(effects) + 1)):
        program = single[without[0]] if len(without) == 1 else _program(chain, gaps, without)
        if program not in programs:
            programs.append(program)
        of[without] = programs.index(program)
    return Programs(effects, tuple(programs), of)


def _program(chain: Chain, gaps: Collection[int], without: tuple[str, ...]) -> Program:
    display, pixel = graphs(chain, without)
    plan = schedule(display, len(chain.channels))
    return Program(
        body=function_body(plan, RESULTS, ARGUMENTS, gaps),
        uniforms=uniforms_function(plan),
        arguments=len(plan.arguments),
        pixel=pixel_function(pixel),
        nodes=Counter(node.op for node in computed(plan.body)),
    )
