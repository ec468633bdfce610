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
    Array,
    Compiled,
    Execution,
    Run,
    Tally,
    all_finite,
    execution,
)
from iccbrdf.cmm.steps import Step

TILE = 1 << 16
"""Pixels that are looked at together: with fewer, looking takes longer than computing."""
PIECE = 256
"""Pixels that are of one kind together: a part of an image's row."""
_LEAST_PIECES = 8
"""Of a kind and with the same constants in a tile; fewer are not worth a call."""
_SAMPLES = 4
"""Pixels of a piece that are looked at first."""
_SIDE, _WIDE = 64, 256
"""Pixels that are compared with others at a time, in pieces and in what is one piece."""
_BLOCK = 1 << 14
"""Pixels that stay in the processor's cache from looking for the least values to the greatest."""
_LOOKING = {"llvm": 300, "numpy": 20}
"""What it takes by back end to look at a pixel, in units of its additions: a kind has to spare more."""
_MAX_KERNELS = 3
"""Kernels of one kind, made for what more and more boxes have in common."""
_MAX_KEPT = 1024
"""Boxes and constants that kernels and arguments are kept for."""
_MAX_BOUND = 16
"""Run-time variables that they are kept for."""
_NOT_FINITE = -1


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
        if pieces == 1 and n > _BLOCK:
            blocks = [cls.of(tile[start : start + _BLOCK], 1) for start in range(0, n, _BLOCK)]
            lows, highs = zip(*blocks, strict=True)
            return cls(np.minimum.reduce(lows), np.maximum.reduce(highs))
        # Rows of many pixels, so that what runs innermost is long, and then those pixels one by one.
        side = math.gcd(n // pieces, _SIDE if pieces > 1 else _WIDE)
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
        self._bound: dict[frozenset[tuple[str, float]], _Bound] = {}
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
        """As `Execution.bind`; what is found for tiles is kept for others under the same variables."""
        key = frozenset(env.items())
        bound = self._bound.get(key)
        if bound is None:
            if len(self._bound) >= _MAX_BOUND:
                self._bound.clear()
            bound = self._bound[key] = _Bound(self, dict(env))
        return bound

    def answers(self, found: _Statistics) -> Array:
        """By piece, the number of its kind, whether there is such a kind or not; or _NOT_FINITE."""
        low, high = found
        yes = ~((low != high) @ self._asked)
        for i, question in enumerate(self.questions):
            if question.zero and yes[:, i].any():
                for channel in question.channels:
                    yes[:, i] &= decoded(self._chains[channel], low[:, channel]) == 0
        answers: Array = yes @ self._digits
        finite = np.isfinite(low + high)
        if not finite.all():
            answers[~finite.all(axis=1)] = _NOT_FINITE
        return answers


_Key: TypeAlias = "tuple[int, bytes]"
"""The number of a kind, and the values of the channels that are constant in it."""


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
            self._tile(_Tile(np.ascontiguousarray(pixels[part], dtype), out[part], pieces), tally)
        return tally

    def _tile(self, tile: _Tile, tally: Tally) -> None:
        """Run pieces that look alike together, if they are, and the others in the whole chain."""
        least = min(_LEAST_PIECES, tile.pieces)
        waiting = list(self._together(_Statistics.sampled(tile.pixels, tile.pieces)).items())
        rest = set(range(tile.pieces))
        while waiting:
            key, pieces = waiting.pop()
            if len(pieces) < least:
                continue
            pixels = tile.gathered(pieces)
            found = _Statistics.of(pixels, 1)
            if key in self._together(found):
                special = self._special(key, found)
                if special is not None:
                    arguments = self._values(special, key)
                    tile.run(partial(special.kernel.run, arguments=arguments), pieces, pixels)
                    tally[self._chain.kinds[key[0]].name] += len(pixels)
                    rest.difference_update(pieces)
            elif len(pieces) > 1:
                alike = self._together(_Statistics.of(pixels, len(pieces))).get(key, [])
                waiting.append((key, [pieces[i] for i in alike]))
        if rest:
            pixels = tile.gathered(sorted(rest))
            finite = all_finite(pixels)
            tile.run(self._finite if finite else self._anything, sorted(rest), pixels)
            tally[FULL if finite else NOT_FINITE] += len(pixels)

    def _together(self, found: _Statistics) -> dict[_Key, list[int]]:
        """The rows of each kind and with equal constants; those that run in the whole chain are left out."""
        answers = self._chain.answers(found)
        together: dict[_Key, list[int]] = {}
        for number in self._chain.kinds.keys() & set(answers.tolist()):
            rows = np.flatnonzero(answers == number)
            constants = found.low[rows][:, self._chain.kinds[number].constant]
            if (constants == constants[0]).all():
                together[number, _bytes(constants[0])] = rows.tolist()
                continue
            for row, values in zip(rows.tolist(), constants, strict=True):
                together.setdefault((number, _bytes(values)), []).append(row)
        return together

    def _special(self, key: _Key, found: _Statistics) -> _Special | None:
        number, _ = key
        box = tuple(-_up(-value) for value in found.low[0].tolist()), tuple(map(_up, found.high[0].tolist()))
        where = (number, *box)
        if where not in self._specials:
            if len(self._specials) >= _MAX_KEPT:
                self._specials.clear()
            self._specials[where] = self._chain.kinds[number].special(*box, self._env)
        return self._specials[where]

    def _values(self, special: _Special, key: _Key) -> list[np.generic]:
        number, constants = key
        where = id(special.plan), constants
        if where not in self._arguments:
            if len(self._arguments) >= _MAX_KEPT:
                self._arguments.clear()
            names = map(variable_of, self._chain.kinds[number].constant)
            values = np.frombuffer(constants, special.plan.graph.dtype).tolist()
            channels = dict(zip(names, values, strict=True))
            self._arguments[where] = uniform_values(special.plan, {**self._env, **channels})
        return self._arguments[where]


class _Tile(NamedTuple):
    """A tile's pixels and where the results go, in so many pieces of equal size."""

    pixels: Array
    out: Array
    pieces: int

    def gathered(self, pieces: Sequence[int]) -> Array:
        """The pixels of some pieces, one after the other."""
        if len(pieces) == self.pieces:
            return self.pixels
        channels = self.pixels.shape[1]
        return self.pixels.reshape(self.pieces, -1, channels)[pieces].reshape(-1, channels)

    def run(self, kernel: Callable[[Array, Array], None], pieces: Sequence[int], pixels: Array) -> None:
        """Compute the results of the pieces that were gathered."""
        if len(pieces) == self.pieces:
            kernel(pixels, self.out)
            return
        results = np.empty((len(pixels), self.out.shape[1]), pixels.dtype)
        kernel(pixels, results)
        size = len(pixels) // len(pieces)
        for i, piece in enumerate(pieces):
            self.out[piece * size : (piece + 1) * size] = results[i * size : (i + 1) * size]


def _tiles(count: int) -> Iterator[tuple[slice, int]]:
    """`count` pixels in tiles, with the number of pieces in each; the last is what makes no whole piece."""
    whole = count // PIECE * PIECE
    for start in range(0, whole, TILE):
        end = min(start + TILE, whole)
        yield slice(start, end), (end - start) // PIECE
    if whole < count:
        yield slice(whole, count), 1


def _bytes(values: Array) -> bytes:
    """Numbers as a key; both zeros are one."""
    return bytes((values + 0.0).tobytes())


def _up(value: float) -> float:
    """The next eighth, or power of two beyond 1: there are few boxes with such sides."""
    if abs(value) <= 1:
        return math.ceil(value * 8) / 8
    mantissa, exponent = math.frexp(value)
    return math.ldexp(-0.5 if value < 0 else 0.5 if mantissa == 0.5 else 1.0, exponent)
