"""A chain that runs on each tile as little as the tile calls for.

Tiles are looked at in pieces.  What its channels have in common makes a piece's kind (calc/specialise.py),
and the pieces of a kind run together in that kind's kernel; all others in the kernel of the whole chain.
A tile whose samples have nothing in common costs no more than before.
"""

from __future__ import annotations

import math
import threading
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import lru_cache, partial, reduce
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from iccbrdf.calc.backends import COMPILERS, Kernel
from iccbrdf.calc.decide import Decider, Decisions, fold
from iccbrdf.calc.graph import Graph
from iccbrdf.calc.passes import Report
from iccbrdf.calc.schedule import Schedule, schedule, uniform_values
from iccbrdf.calc.specialise import (
    Question,
    decoded,
    decodings,
    hold,
    questions,
    variable_of,
    work,
    work_of_all,
)
from iccbrdf.cmm.execution import (
    FULL,
    NOT_FINITE,
    TILE,
    Array,
    Compiled,
    Execution,
    Run,
    Tally,
    all_finite,
    execution,
)
from iccbrdf.cmm.steps import Step

PIECE = 256
"""Pixels that are of one kind together: a part of an image's row."""
_LEAST_PIECES = 8
"""Of a kind and with the same constants in a tile; fewer are not worth a call."""
_SAMPLES = 4
"""Pixels of a piece that are looked at first."""
_SIDE = 64
"""Pixels that are compared with others at a time."""
_LOOKING = {"llvm": 150, "numpy": 20}
"""What it takes by back end to look at a pixel, in units of its additions: a kind has to spare more."""
_MAX_KERNELS = 3
"""Kernels of one kind, made for what more and more boxes have in common."""
_MAX_KEPT = 1024
"""Boxes and constants that kernels and arguments are kept for."""
_WHOLE, _NOT_FINITE = -2, -1


@lru_cache(maxsize=16)
def adaptive_execution(
    steps: tuple[Step, ...], names: tuple[str, ...], dtype: np.dtype[Any], wanted: str
) -> Execution:
    """
    As `execution` of a chain with these input channels, by what each tile calls for.

    Where it is not compiled, or there is nothing to spare, it is that execution.
    """
    plain = execution(steps, len(names), dtype, wanted)
    if not isinstance(plain, Compiled):
        return plain
    found = Adaptive(plain, names)
    return found if found.kinds else plain


_Ends: TypeAlias = "tuple[float, ...]"
"""One end of a box, by channel."""


class _Statistics(NamedTuple):
    """The least and the greatest value by piece and channel."""

    low: Array
    high: Array

    @classmethod
    def of(cls, tile: Array, pieces: int) -> _Statistics:
        """Of pixels (n, channels) in a number of pieces that divides n; NaN where there is one."""
        n, channels = tile.shape
        # Rows of many pixels, so that what runs innermost is long, and then those pixels one by one.
        side = math.gcd(n // pieces, _SIDE)
        rows = tile.reshape(pieces, -1, side * channels)
        found = []
        for extreme in (np.minimum, np.maximum):
            pixels = extreme.reduce(rows, axis=1).reshape(pieces, side, channels)
            found.append(extreme.reduce(np.ascontiguousarray(pixels.swapaxes(0, 1)), axis=0))
        return cls(*found)

    @classmethod
    def sampled(cls, tile: Array, pieces: int) -> _Statistics:
        """Of some pixels of each piece."""
        size = len(tile) // pieces
        samples = [tile[start::size] for start in range(0, size, max(1, size // _SAMPLES))]
        return cls(reduce(np.minimum, samples), reduce(np.maximum, samples))


class _Special(NamedTuple):
    """A kernel, and what has to be decided for it."""

    decisions: Decisions
    plan: Schedule
    kernel: Kernel
    reports: tuple[Report, ...]


class Kind:
    """Tiles of which some questions are answered by yes, and the kernels for them, made when called for."""

    def __init__(self, graph: Graph, channels: int, yes: Collection[Question], backend: str) -> None:
        self.name = ", ".join(map(str, yes)) or "decided"
        self.constant = tuple(sorted({i for question in yes for i in question.channels}))
        self.specials: list[_Special] = []
        self._channels = channels
        self._backend = backend
        self._graph, self.reports = hold(graph, yes)
        self._decider = Decider(self._graph, yes)
        self._lock = threading.Lock()

    def special(self, low: _Ends, high: _Ends, env: Mapping[str, float]) -> _Special | None:
        """What runs tiles within this box; None if that is the whole chain."""
        decisions = self._decider.decide(low, high, env)
        if decisions is None:
            return None
        with self._lock:
            for special in self.specials:
                if special.decisions.items() <= decisions.items():
                    return special
            if len(self.specials) == _MAX_KERNELS:
                return None
            if self.specials:
                common = self.specials[-1].decisions.items() & decisions.items()
                decisions = dict(common) if len(self.specials) < _MAX_KERNELS - 1 else {}
            graph, reports = fold(self._graph, decisions)
            plan = schedule(graph, self._channels)
            self.specials.append(_Special(decisions, plan, COMPILERS[self._backend](plan), reports))
            return self.specials[-1]


class Adaptive:
    """A compiled chain with kernels for kinds of tiles."""

    def __init__(self, plain: Compiled, names: Sequence[str]) -> None:
        graph = plain.schedule.graph
        self.backend = plain.backend
        self.reason = plain.reason
        self.plain = plain
        self.questions = questions(graph, names)
        self._chains = decodings(graph)
        self._digits = 1 << np.arange(len(self.questions))
        self._asked = np.zeros((len(names), len(self.questions)), np.bool_)
        for i, question in enumerate(self.questions):
            self._asked[list(question.channels), i] = True
        self.kinds: dict[int, Kind] = {}
        """By the number whose binary digits are the answers, the first question's the lowest."""
        usual = work_of_all(graph)
        for answers in range(1 << len(self.questions)):
            yes = [question for i, question in enumerate(self.questions) if answers >> i & 1]
            if usual - work(graph, yes) > _LOOKING[plain.backend]:
                self.kinds[answers] = Kind(graph, len(names), yes, plain.backend)

    def bind(self, env: Mapping[str, float]) -> Run:
        return _Bound(self, env)

    def answers(self, found: _Statistics) -> Array:
        """By piece, the number of its kind, whether there is such a kind or not; or _NOT_FINITE."""
        low, high = found
        yes = ~((low != high) @ self._asked)
        for i, question in enumerate(self.questions):
            if question.zero:
                for channel in question.channels:
                    yes[:, i] &= decoded(self._chains[channel], low[:, channel]) == 0
        answers: Array = yes @ self._digits
        finite = np.isfinite(low + high)
        if not finite.all():
            answers[~finite.all(axis=1)] = _NOT_FINITE
        return answers


class _Group(NamedTuple):
    """Pieces of a tile that run together."""

    answers: int
    """The number of a kind, or _WHOLE or _NOT_FINITE."""
    pieces: Sequence[int]
    found: _Statistics | None
    """Of the kind's pieces, a row each or one for all of them."""


class _Bound:
    """An adaptive chain under some run-time variables; threads may share it."""

    def __init__(self, chain: Adaptive, env: Mapping[str, float]) -> None:
        self._chain = chain
        self._env = env
        self._finite, self._anything = chain.plain.runs(env)
        # What threads find at the same time is the same, so that they need not wait for each other.
        self._specials: dict[tuple[int, _Ends, _Ends], _Special | None] = {}
        self._arguments: dict[tuple[int, bytes], list[np.generic]] = {}

    def __call__(self, pixels: Array, out: Array) -> Tally:
        tally: Tally = Counter()
        dtype = self._chain.plain.schedule.graph.dtype
        for part, pieces in _tiles(len(pixels)):
            tile = np.ascontiguousarray(pixels[part], dtype)
            for group in self._groups(tile, pieces):
                size = len(tile) // pieces
                name = self._run(group, tile, out[part], size)
                tally[name] += size * len(group.pieces)
        return tally

    def _groups(self, tile: Array, pieces: int) -> list[_Group]:
        chain = self._chain
        sampled = chain.answers(_Statistics.sampled(tile, pieces))
        if chain.kinds.keys().isdisjoint(sampled.tolist()):
            return [_Group(_WHOLE if all_finite(tile) else _NOT_FINITE, range(pieces), None)]
        if pieces == 1 or (sampled == sampled[0]).all():
            found = _Statistics.of(tile, 1)
            answers = int(chain.answers(found)[0])
            if answers == sampled[0]:
                return [_Group(answers, range(pieces), found)]
        return self._sorted(_Statistics.of(tile, pieces))

    def _sorted(self, found: _Statistics) -> list[_Group]:
        """Pieces of a kind and with equal constants together; the few of rare ones with the others."""
        kinds = self._chain.kinds
        together: dict[tuple[int, bytes], list[int]] = {}
        for i, answers in enumerate(self._chain.answers(found).tolist()):
            if answers in kinds:
                key = answers, found.low[i, kinds[answers].constant].tobytes()
            else:
                key = _WHOLE if answers != _NOT_FINITE else _NOT_FINITE, b""
            together.setdefault(key, []).append(i)
        rest = together.pop((_WHOLE, b""), [])
        groups = []
        for (answers, _), pieces in together.items():
            if len(pieces) < min(_LEAST_PIECES, len(found.low)) and answers != _NOT_FINITE:
                rest += pieces
            else:
                rows = _Statistics(found.low[pieces], found.high[pieces])
                groups.append(_Group(answers, pieces, rows))
        return [*groups, _Group(_WHOLE, sorted(rest), None)] if rest else groups

    def _run(self, group: _Group, tile: Array, out: Array, size: int) -> str:
        """Compute the group's pixels; the name of their kind."""
        kind = self._chain.kinds.get(group.answers)
        special = None
        if kind is not None and group.found is not None:
            low, high = group.found.low.min(axis=0), group.found.high.max(axis=0)
            special = self._special(group.answers, kind, low, high)
        if kind is not None and special is not None:
            arguments = self._values(special, kind, low)
            _on_pieces(partial(special.kernel.run, arguments=arguments), group.pieces, tile, out, size)
            return kind.name
        whole = self._anything if group.answers == _NOT_FINITE else self._finite
        _on_pieces(whole, group.pieces, tile, out, size)
        return NOT_FINITE if group.answers == _NOT_FINITE else FULL

    def _special(self, answers: int, kind: Kind, low: Array, high: Array) -> _Special | None:
        box = tuple(-_up(-value) for value in low.tolist()), tuple(map(_up, high.tolist()))
        key = (answers, *box)
        if key not in self._specials:
            if len(self._specials) >= _MAX_KEPT:
                self._specials.clear()
            self._specials[key] = kind.special(*box, self._env)
        return self._specials[key]

    def _values(self, special: _Special, kind: Kind, values: Array) -> list[np.generic]:
        constants = values[list(kind.constant)]
        key = id(special.plan), constants.tobytes()
        if key not in self._arguments:
            if len(self._arguments) >= _MAX_KEPT:
                self._arguments.clear()
            channels = {variable_of(i): float(v) for i, v in zip(kind.constant, constants, strict=True)}
            self._arguments[key] = uniform_values(special.plan, {**self._env, **channels})
        return self._arguments[key]


def _tiles(count: int) -> Iterator[tuple[slice, int]]:
    """`count` pixels in tiles, with the number of pieces in each; the last is what makes no whole piece."""
    whole = count // PIECE * PIECE
    for start in range(0, whole, TILE):
        end = min(start + TILE, whole)
        yield slice(start, end), (end - start) // PIECE
    if whole < count:
        yield slice(whole, count), 1


def _up(value: float) -> float:
    """The next eighth, or power of two beyond 1: there are few boxes with such sides."""
    if abs(value) <= 1:
        return math.ceil(value * 8) / 8
    mantissa, exponent = math.frexp(value)
    return math.ldexp(-0.5 if value < 0 else 0.5 if mantissa == 0.5 else 1.0, exponent)


def _on_pieces(
    run: Callable[[Array, Array], object], pieces: Sequence[int], tile: Array, out: Array, size: int
) -> None:
    """Run on some pieces of a tile as if they were one."""
    if len(pieces) * size == len(tile):
        run(tile, out)
        return
    gathered = tile.reshape(-1, size, tile.shape[1])[list(pieces)].reshape(-1, tile.shape[1])
    results = np.empty((len(gathered), out.shape[1]), tile.dtype)
    run(gathered, results)
    for i, piece in enumerate(pieces):
        out[piece * size : (piece + 1) * size] = results[i * size : (i + 1) * size]
