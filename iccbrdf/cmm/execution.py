"""What runs a linked chain: a compiled back end on its graph, or the interpreter step by step."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from iccbrdf.calc.backends import COMPILERS, Kernel
from iccbrdf.calc.exact_passes import EXACT_PASSES
from iccbrdf.calc.graph import Graph
from iccbrdf.calc.passes import Report, optimise
from iccbrdf.calc.schedule import Schedule, computed, schedule, uniform_values
from iccbrdf.cmm.steps import Process, Step
from iccbrdf.errors import UnsupportedError

BACKENDS = ("auto", "interpreter", *COMPILERS)

TILE = 16384
"""Pixels a tile: the registers of a Cook-Torrance program on float32 tiles of this size stay within L2."""
LEAST_PIECE = 1 << 19
"""Pixels of a thread's piece, where there are enough: handing over a small one takes longer than it may even
out."""
MAX_VALUES = 1 << 24
"""Values of a tile at a time: programs may ask for so many registers that fewer pixels must do."""

Array: TypeAlias = npt.NDArray[Any]
Tally: TypeAlias = "Counter[str]"
"""Pixels by the kind of tile that they ran in (`FULL`, `NOT_FINITE`, or a kind of cmm/adaptive.py)."""
FULL = "full"
NOT_FINITE = "not finite"

Run: TypeAlias = Callable[[Array, Array], Tally]
"""Computes `out` (n, outputs) from `pixels` (n, inputs)."""
TileRun: TypeAlias = Callable[[Array, Array], None]
"""The same of a tile: contiguous, in the type of the chain."""


class Execution(Protocol):
    """A chain made ready to run."""

    @property
    def backend(self) -> str:
        """The name of the back end."""

    @property
    def reason(self) -> str:
        """Why it is this one."""

    def bind(self, env: Mapping[str, float]) -> Run:
        """The function that maps pixels under these run-time variables; threads may share it."""


@lru_cache(maxsize=16)
def execution(steps: tuple[Step, ...], channels: int, dtype: np.dtype[Any], wanted: str) -> Execution:
    """
    The execution of a chain of `channels` input channels by the back end `wanted`.

    `auto` takes the quickest that can run the chain.

    Raises
    ------
    UnsupportedError
        The back end that is asked for is not installed, or cannot run the chain.
    """
    if wanted == "interpreter":
        return Interpreted(steps, dtype, "it was asked for")
    names = list(COMPILERS) if wanted == "auto" else [wanted]
    refused: list[str] = []
    for name in names:
        try:
            why = "it was asked for" if wanted == name else "; ".join(["the quickest that can run", *refused])
            return Compiled(steps, channels, dtype, name, why)
        except UnsupportedError as error:
            refused.append(f"{name}: {error}")
    if wanted != "auto":
        raise UnsupportedError(f"back end {'; '.join(refused)}")
    return Interpreted(steps, dtype, "; ".join(refused))


class Interpreted:
    """Step by step in the interpreter, which defines what a chain computes."""

    backend = "interpreter"

    def __init__(self, steps: tuple[Step, ...], dtype: np.dtype[Any], reason: str) -> None:
        self.reason = reason
        self._steps = steps
        self._dtype = dtype
        registers = max((step.registers for step in steps if isinstance(step, Process)), default=1)
        self.tile = max(1, min(TILE, MAX_VALUES // registers))

    def bind(self, env: Mapping[str, float]) -> Run:
        def run(pixels: Array, out: Array) -> Tally:
            for start in range(0, len(pixels), self.tile):
                end = start + self.tile
                channels: list[Any] = list(np.ascontiguousarray(pixels[start:end].T, self._dtype))
                for step in self._steps:
                    channels = step.apply(channels, env, self._dtype.type)
                for i, channel in enumerate(channels):
                    out[start:end, i] = channel
            return Counter({FULL: len(pixels)})

        return run


class Compiled:
    """The chain as one graph, compiled.

    `schedule` and `reports` (of the passes) tell what runs.  In NumPy, matrices leave out what is multiplied
    by 0, which is right for finite numbers; where some did, a tile with a number that is not finite runs in a
    kernel that leaves nothing out, made when it is first met.  In LLVM a product takes less than such a look.
    """

    def __init__(
        self,
        steps: tuple[Step, ...],
        channels: int,
        dtype: np.dtype[Any],
        backend: str,
        reason: str,
    ) -> None:
        self.backend = backend
        self.reason = reason
        self._steps = steps
        self._channels = channels
        self._dtype = dtype
        self.schedule, self.reports, self._looks = self._lifted(finite_inputs=backend == "numpy")
        self._finite = COMPILERS[backend](self.schedule)
        self._last: tuple[tuple[tuple[str, str], ...] | None, Sequence[np.generic]] = (None, ())

    def _lifted(self, *, finite_inputs: bool) -> tuple[Schedule, tuple[Report, ...], bool]:
        """What runs, how it was made, and whether it holds for finite numbers alone."""
        graph = Graph(dtype=self._dtype.type)
        nodes = [graph.input(i) for i in range(self._channels)]
        for step in self._steps:
            nodes = step.lift(graph, nodes, finite_inputs=finite_inputs)
        graph.outputs = tuple(nodes)
        optimised, reports = optimise(graph, EXACT_PASSES)
        return schedule(optimised, self._channels), reports, graph.assumes_finite

    @cached_property
    def _any(self) -> tuple[Schedule, Kernel]:
        """What runs where an input is not finite."""
        if not self._looks:
            return self.schedule, self._finite
        plan, _, _ = self._lifted(finite_inputs=False)
        return plan, COMPILERS[self.backend](plan)

    def counts(self) -> dict[str, int]:
        """Nodes of the graph, and how many of them are computed once a run and for every pixel."""
        plan = self.schedule
        once = sum(node.op != "const" for node in plan.uniform)
        every = sum(1 for node in computed(plan.body) if node.op not in ("input", "pick"))
        return {"nodes": len(plan.graph.nodes), "nodes_once_a_run": once, "nodes_for_every_pixel": every}

    def runs(self, env: Mapping[str, float]) -> tuple[TileRun, TileRun]:
        """What maps tiles of finite numbers under these run-time variables, and what maps any."""
        arguments = self._arguments(env)

        def finite(tile: Array, out: Array) -> None:
            self._finite.run(tile, out, arguments)

        def anything(tile: Array, out: Array) -> None:
            plan, kernel = self._any
            kernel.run(tile, out, uniform_values(plan, env))

        return finite, anything

    def _arguments(self, env: Mapping[str, float]) -> Sequence[np.generic]:
        """The values of the schedule's arguments; those of the last variables are kept."""
        # 0 and -0 are equal, but are not the same light.
        key = tuple((name, float(value).hex()) for name, value in env.items())
        # Threads share this object: another one may put its own variables there at any time.
        last, arguments = self._last
        if last != key:
            arguments = uniform_values(self.schedule, env)
            self._last = key, arguments
        return arguments

    def bind(self, env: Mapping[str, float]) -> Run:
        finite, anything = self.runs(env)

        def run(pixels: Array, out: Array) -> Tally:
            if not self._looks:
                finite(pixels, out)
                return Counter({FULL: len(pixels)})
            tally: Tally = Counter()
            for start in range(0, len(pixels), TILE):
                tile = np.ascontiguousarray(pixels[start : start + TILE], self._dtype)
                if all_finite(tile):
                    finite(tile, out[start : start + TILE])
                    tally[FULL] += len(tile)
                else:
                    anything(tile, out[start : start + TILE])
                    tally[NOT_FINITE] += len(tile)
            return tally

        return run


def all_finite(tile: Array) -> bool:
    """Whether all numbers are; squares that overflow are taken for one that is not, which does no harm."""
    numbers = tile.reshape(-1)
    # The quickest way to touch each number once.
    return math.isfinite(np.dot(numbers, numbers))


def parts(count: int, threads: int) -> Sequence[slice]:
    """`count` pixels in pieces of whole tiles: as many as there are threads, or more that are large."""
    least = -(-count // threads)
    size = max(min(least, LEAST_PIECE), -(-count // (4 * threads)), 1)
    size = -(-size // TILE) * TILE
    return [slice(start, min(start + size, count)) for start in range(0, count, size)]
