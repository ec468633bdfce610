"""Which effects a scene calls for: one pass over its image, with the bounds of `iccbrdf.build.bounds`.

A scene is an image, lights (directions, or all those between two) and a view.  A way to the pixel leaves
out some of relief, slope and interpolation, from which the reflection is computed; on each way the other
effects of the MVIS are judged.  Tiles are judged by the least and greatest of their channels, those that
fail in smaller parts, and these pixel by pixel.  An effect that fails at a pixel is called for, and is not
looked at again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import Array
from iccbrdf.build.bounds import (
    GROUP,
    Change,
    Parameters,
    Reflection,
    Terms,
    change_of_ways,
    changes_of_effects,
    geometry,
)
from iccbrdf.build.cells import FULL, LEVELS, Block, Index, Pixels, Way
from iccbrdf.build.effects import EFFECTS, MVIS, model_effects
from iccbrdf.build.spans import Directions, Span

CHUNK = 1 << 13
"""Cells that are judged at a time: their intermediate results stay in the processor's cache."""

FEWEST = 16
"""Cells of a block that are worth judging; blocks with fewer tiles start with smaller ones."""

REFINE = 0.25
"""The part of the tolerance from which on a cell is looked at more closely, under few lights."""

FEW_LIGHTS = 4

EFFORT = 2
"""Cells that are looked at, for each pixel of a block, before what is in doubt still counts as called for."""

RELIEF: Way = frozenset({"relief"})
WAYS: Way = frozenset({"relief", "slope", "interpolation"})

_TO_Z = Span.of([[0.0], [0.0], [1.0]])
_NO_OFFSET = Span.of(np.zeros((3, 1)))

Samples = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Decoder:
    """From the samples of an image to multiplex channels `names`, (height, width, n), in float64."""

    names: tuple[str, ...]
    decode: Callable[[Samples], Samples]


@dataclass(frozen=True)
class Finding:
    """What an effect matters to a scene.

    called_for: whether without it the tolerance is exceeded, or cannot be shown not to be.
    bound: of CIEDE2000 without it, at most, at `place` where there is one; infinite where nothing bounds it.
    exact: whether without it the result is the same but for float32 rounding.
    place: row and column of the pixel that calls for it; None where the others use up the tolerance.
    light: the direction, or range of directions, under which it does.
    """

    effect: str
    called_for: bool
    bound: float
    exact: bool
    place: tuple[int, int] | None
    light: str | None


@dataclass(frozen=True)
class Decision:
    """What may be left out together, with the bound of CIEDE2000 for all of it.

    exact: whether the result is the same but for float32 rounding.
    """

    without: tuple[str, ...]
    bound: float
    exact: bool


@dataclass
class _Question:
    """Whether an effect may be left out on a way, or (no effect) whether that way may be gone."""

    way: Way
    effect: str | None
    bound: float = 0.0
    exact: bool = True
    open: bool = True
    place: tuple[int, int] | None = None
    light: str | None = None

    @property
    def finest(self) -> int:
        """The last level that it is judged at: pixels do not matter where nothing is to be gained."""
        return len(LEVELS) - (1 if self.effect is None or EFFECTS[self.effect].spares else 2)

    def note(self, change: Change, where: NDArray[np.bool_]) -> None:
        """Changes that are small enough, where they are."""
        self.bound = max(self.bound, float(np.max(change.dE, where=where, initial=0.0)))
        self.exact = self.exact and bool(np.all(change.exact | ~where))


class Planner:
    """Looks at the blocks of an image, one after the other, and then says what they call for.

    Parameters
    ----------
    reflection
        The MVIS.
    decoders
        By the way, which leaves out some of `slope` and `interpolation`: what gives the parameters.  That of
        `FULL` is the proof that is not to change.  The others give the same channels.
    defaults
        What holds for multiplex channels that the image has not.
    lights, view
        Directions; one of view for all lights.
    tolerance
        CIEDE2000 that may be lost; 0: none but float32 rounding.
    """

    def __init__(
        self,
        reflection: Reflection,
        decoders: Mapping[Way, Decoder],
        defaults: Mapping[str, float],
        lights: Directions,
        view: Directions,
        tolerance: float = 0.0,
    ) -> None:
        self._reflection, self._decoders, self._defaults = reflection, dict(decoders), dict(defaults)
        self._lights, self._view, self._tolerance = lights, view, tolerance
        self._refine = REFINE if len(lights) <= FEW_LIGHTS else 1.0
        self._spent = 0
        self.seconds = {"decoding": 0.0, "bounding": 0.0}
        effects = [name for name in model_effects(reflection.model) if EFFECTS[name].program == MVIS]
        effects.remove("relief")
        ways = [way | relief for way in decoders for relief in (FULL, RELIEF)]
        self._questions = [
            _Question(way, effect)
            for way in sorted(ways, key=lambda way: (len(way), sorted(way)))
            for effect in (None, *effects)
            if way or effect
        ]

    # Looking ---------------------------------------------------------------------------------------------

    def look(self, y0: int, x0: int, data: Samples) -> None:
        """Take a block (height, width, channels) of the image into account, whose corner lies there."""
        begun = time.perf_counter()
        open_now = [question for question in self._questions if question.open]
        ways = {FULL} | {question.way - RELIEF for question in open_now}
        pixels = {way: self._pixels(way, data) for way in ways}
        decoded = time.perf_counter()
        block = Block(y0, x0, data.shape[:2], pixels)
        self._spent = 0
        level = next(level for level, side in enumerate(LEVELS) if side == 1 or block.count(level) >= FEWEST)
        lights, cells = np.divmod(np.arange(len(self._lights) * block.count(level)), block.count(level))
        with np.errstate(all="ignore"):
            self._search(block, level, lights, cells, open_now)
        self.seconds["decoding"] += decoded - begun
        self.seconds["bounding"] += time.perf_counter() - decoded

    def _pixels(self, way: Way, data: Samples) -> Pixels:
        decoder = self._decoders[way]
        decoded = np.asarray(decoder.decode(data), np.float64)
        return Pixels.of(self._reflection, decoder.names, decoded, self._defaults)

    def _search(
        self, block: Block, level: int, lights: Index, cells: Index, questions: list[_Question]
    ) -> None:
        """Judge `cells` of a level, each under one of `lights`; those that fail are searched more finely."""
        for start in range(0, len(cells), CHUNK):
            here = slice(start, start + CHUNK)
            if not any(question.open for question in questions):
                return
            self._spent += len(cells[here])
            failed = np.zeros(len(cells[here]), np.bool_)
            unsure: list[tuple[_Question, Change]] = []
            for question, change in self._changes(block, level, lights[here], cells[here], questions):
                last = level >= question.finest
                worse = self._worse(change, self._tolerance * (1 if last else self._refine))
                if self._tolerance:
                    question.note(change, ~worse)
                if last and worse.any():
                    self._call(question, change, block, level, lights[here], cells[here])
                elif worse.any():
                    failed |= worse
                    unsure.append((question, change))
            if not unsure:
                continue
            if self._spent <= EFFORT * block.count(len(LEVELS) - 1):
                finer, parents = block.finer(level, cells[here][failed])
                asked = [question for question, _ in unsure]
                self._search(block, level + 1, lights[here][failed][parents], finer, asked)
            else:
                for question, change in unsure:
                    self._call(question, change, block, level, lights[here], cells[here])

    def _worse(self, change: Change, limit: float) -> NDArray[np.bool_]:
        return change.dE > limit if self._tolerance else ~change.exact

    def _call(
        self, question: _Question, change: Change, block: Block, level: int, lights: Index, cells: Index
    ) -> None:
        """The answer is no.  A way that is gone takes its questions with it."""
        worst = int(np.argmax(np.where(change.exact, -1, change.dE)))
        question.open, question.exact, question.bound = False, False, float(change.dE[worst])
        question.place = block.place(level, int(cells[worst]))
        question.light = self._lights.texts[lights[worst]]
        if question.effect is None:
            for other in self._questions:
                other.open = other.open and other.way != question.way

    def _changes(
        self, block: Block, level: int, lights: Index, cells: Index, questions: list[_Question]
    ) -> Iterator[tuple[_Question, Change]]:
        """The change of each question that is open, by cell under its light."""
        light, view = self._lights.vector, self._view.vector
        if len(self._lights) > 1:
            light = light[:, lights]

        def reduce(values: Array) -> Span:
            return block.spans(values, level, cells)

        @cache
        def given(way: Way) -> Parameters:
            return Parameters(block.pixels[way].columns, reduce)

        @cache
        def on(way: Way) -> Terms:
            under = geometry(_TO_Z if way >= RELIEF else normal, light, view)
            return Terms(self._reflection, given(way - RELIEF), under)

        normal = reduce(block.pixels[FULL].normal)
        for way in dict.fromkeys(question.way for question in questions):
            asked = {q.effect: q for q in questions if q.way == way and q.open}
            if None in asked:
                n_off = normal - _TO_Z if way >= RELIEF else _NO_OFFSET
                off = Parameters(block.off(way - RELIEF), reduce)
                change = change_of_ways(on(FULL), on(way), off, n_off, light)
                yield asked[None], change.broadcast(cells.shape)
            # The way may be gone by now, and its questions with it.
            effects = [effect for effect, question in asked.items() if effect is not None and question.open]
            if effects:
                for effect, change in changes_of_effects(on(way), effects).items():
                    yield asked[effect], change.broadcast(cells.shape)

    # Deciding --------------------------------------------------------------------------------------------

    def decide(self, executed: Callable[[Collection[str]], int]) -> Decision:
        """What to leave out: of all that may be, what makes the shortest programs.

        `executed` tells how many operators programs without some effects take for a pixel.
        """
        options = [
            option for way in dict.fromkeys(q.way for q in self._questions) for option in self._options(way)
        ]
        best = [a for a in options if not any(set(a.without) < set(b.without) for b in options)]
        return min(best, key=lambda option: executed(option.without)) if len(best) > 1 else best[0]

    def _options(self, way: Way) -> Iterator[Decision]:
        here = {q.effect: q for q in self._questions if q.way == way}
        base = here.pop(None, _Question(FULL, None))
        if not base.open:
            return
        free = {effect: q for effect, q in here.items() if effect and q.open and EFFECTS[effect].spares}
        taken = way | ({"below-horizon"} & free.keys())
        if "specular" in free and base.bound + free["specular"].bound <= self._tolerance:
            gloss = free["specular"]
            parts = {effect for effect in here if effect in GROUP}
            yield _decision(
                taken | parts | {"specular"}, base.bound + gloss.bound, base.exact and gloss.exact
            )
        bound, exact = base.bound, base.exact
        for effect in sorted(free.keys() & set(GROUP), key=lambda effect: (free[effect].bound, effect)):
            if bound + free[effect].bound <= self._tolerance:
                taken |= {effect}
                bound, exact = bound + free[effect].bound, exact and free[effect].exact
        yield _decision(taken, bound, exact)

    def findings(self, decision: Decision) -> tuple[Finding, ...]:
        """What the image has shown of each effect, in the order of `EFFECTS`."""
        left_out = frozenset(decision.without)
        asked = {(q.way, q.effect): q for q in self._questions}
        found = []
        for name in EFFECTS:
            if EFFECTS[name].program == MVIS and name != "relief":
                way = left_out & WAYS if name in left_out else FULL
                question = asked.get((way, name))
                if question and name in GROUP and "specular" in left_out:
                    question = asked[way, "specular"]
            else:
                question = asked.get((Way({name}), None))
            if question is not None:
                called_for = name not in left_out and (EFFECTS[name].spares or not question.open)
                found.append(
                    Finding(name, called_for, question.bound, question.exact, question.place, question.light)
                )
        return tuple(found)


def _decision(without: Way, bound: float, exact: bool) -> Decision:
    return Decision(tuple(name for name in EFFECTS if name in without), bound, exact)
