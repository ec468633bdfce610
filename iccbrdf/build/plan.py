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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.models import NORMAL
from iccbrdf.build.bounds import (
    GROUP,
    Change,
    Columns,
    Reflection,
    Terms,
    change_of_ways,
    changes_of_effects,
    columns,
    differences,
    geometry,
    parameters,
)
from iccbrdf.build.effects import EFFECTS, MVIS, model_effects
from iccbrdf.build.spans import ONE, ZERO, Directions, Span, Vector

LEVELS = (64, 8, 2, 1)
"""Pixels along the sides of the cells that are judged at once: tiles, parts of those that fail, pixels."""

CHUNK = 1 << 13
"""Cells that are judged at a time: their intermediate results stay in the processor's cache."""

FEWEST = 16
"""Cells of a block that are worth judging; blocks with fewer tiles start with smaller ones."""

REFINE = 0.25
"""The part of the tolerance from which on a cell is looked at more closely, under few lights."""

FEW_LIGHTS = 4

EFFORT = 2
"""Cells that are looked at, for each pixel of a block, before what is in doubt still counts as called for."""

Way = frozenset[str]
"""The effects among relief, slope and interpolation that a way to the pixel leaves out."""

FULL: Way = frozenset()
RELIEF: Way = frozenset({"relief"})
WAYS: Way = frozenset({"relief", "slope", "interpolation"})

TINY = 1e-37
"""What the templates add to a squared length, so that no length is 0."""

_SHORTEST = 1e-30
"""Squared length of normals from which on they are of unit length once normalised."""

_TO_Z: Vector = (ZERO, ZERO, ONE)

Samples = NDArray[np.floating[Any]]
Index = NDArray[np.intp]


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


@dataclass(frozen=True)
class _Pixels:
    """A block's parameters, and the components of its unit normals.

    Arrays (height, width), or of no axis where all pixels have one value.
    """

    columns: Columns
    normal: tuple[Array, Array, Array]


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
        pixels = {way: self._pixels(self._decoders[way], data) for way in ways}
        decoded = time.perf_counter()
        block = _Block(y0, x0, data.shape[:2], pixels)
        self._spent = 0
        level = next(level for level, side in enumerate(LEVELS) if side == 1 or block.count(level) >= FEWEST)
        lights, cells = np.divmod(np.arange(len(self._lights) * block.count(level)), block.count(level))
        with np.errstate(all="ignore"):
            self._search(block, level, lights, cells, open_now)
        self.seconds["decoding"] += decoded - begun
        self.seconds["bounding"] += time.perf_counter() - decoded

    def _pixels(self, decoder: Decoder, data: Samples) -> _Pixels:
        values = np.ascontiguousarray(np.moveaxis(decoder.decode(data), -1, 0), np.float64)
        channels = {name: np.array(value) for name, value in self._defaults.items()}
        channels |= dict(zip(decoder.names, values, strict=True))
        x, y, z = (channels[name] for name in NORMAL)
        squares = x * x + y * y + z * z
        with np.errstate(all="ignore"):
            # As the templates do it.  What they make of vectors next to nothing is not bounded here.
            length = np.where((squares > 0) & (squares < _SHORTEST), np.nan, np.sqrt(squares + TINY))
            normal = (x / length, y / length, z / length)
        return _Pixels(columns(self._reflection, channels), normal)

    def _search(
        self, block: _Block, level: int, lights: Index, cells: Index, questions: list[_Question]
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
        self, question: _Question, change: Change, block: _Block, level: int, lights: Index, cells: Index
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
        self, block: _Block, level: int, lights: Index, cells: Index, questions: list[_Question]
    ) -> Iterator[tuple[_Question, Change]]:
        """The change of each question that is open, by cell under its light."""
        light, view = _taken(self._lights.vector, lights), self._view.vector
        x, y, z = block.normal(level, cells)
        terms: dict[Way, Terms] = {}

        def reduce(values: Array) -> Span:
            return block.spans(values, level, cells)

        def on(way: Way) -> Terms:
            if way not in terms:
                under = geometry(_TO_Z if way >= RELIEF else (x, y, z), light, view)
                given = parameters(block.pixels[way - RELIEF].columns, reduce)
                terms[way] = Terms(self._reflection, given, under)
            return terms[way]

        for way in dict.fromkeys(question.way for question in questions):
            asked = {
                question.effect: question for question in questions if question.way == way and question.open
            }
            found: dict[str | None, Change] = {}
            if None in asked:
                off = parameters(block.off(way - RELIEF), reduce)
                n_off = (x, y, z - ONE) if way >= RELIEF else (ZERO, ZERO, ZERO)
                found[None] = change_of_ways(on(FULL), on(way), off, n_off, light)
            effects = [effect for effect in asked if effect is not None]
            if effects:
                found.update(changes_of_effects(on(way), effects))
            for effect, change in found.items():
                if asked[effect].open:
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


def _taken(vector: Vector, rows: Index) -> Vector:
    """Some elements of a vector of spans."""
    x, y, z = (_at(span, rows) for span in vector)
    return x, y, z


def _at(span: Span, rows: Index) -> Span:
    low = span.lo[rows]
    # One number stays one, which is told by the arrays being the same.
    return Span(low, low if span.hi is span.lo else span.hi[rows])


def _joined(function: np.ufunc, values: Array, times: int) -> Array:
    """So many neighbouring rows at a time as one by a function of two; the last ones may be fewer."""
    joined: Array = values[::times].copy()
    for first in range(1, times):
        rows = values[first::times]
        function(joined[: len(rows)], rows, out=joined[: len(rows)])
    return joined


class _Block:
    """A block of pixels, and the cells of each level that it is cut into, numbered row by row."""

    def __init__(self, y0: int, x0: int, shape: tuple[int, ...], pixels: Mapping[Way, _Pixels]) -> None:
        self.pixels = pixels
        self._corner = y0, x0
        self._shape = shape
        self._spans: dict[tuple[int, int], Span] = {}
        self._off: dict[Way, Columns] = {}

    def _size(self, level: int) -> tuple[int, int]:
        height, width = self._shape
        return -(-height // LEVELS[level]), -(-width // LEVELS[level])

    def count(self, level: int) -> int:
        """The number of cells."""
        rows, columns = self._size(level)
        return rows * columns

    def off(self, way: Way) -> Columns:
        """The parameters of the full way less those of another."""
        if way not in self._off:
            self._off[way] = differences(self.pixels[FULL].columns, self.pixels[way].columns)
        return self._off[way]

    def normal(self, level: int, cells: Index) -> Vector:
        """The spans of the normals' components."""
        x, y, z = (self.spans(component, level, cells) for component in self.pixels[FULL].normal)
        return x, y, z

    def spans(self, values: Array, level: int, cells: Index) -> Span:
        """The spans of values by pixel, (height, width), in some cells; `values` must be the block's own."""
        if values.ndim == 0:
            return Span.of(values)
        return _at(self._whole(values, level), cells)

    def _whole(self, values: Array, level: int) -> Span:
        """The spans of all cells, from those of the cells of the next level."""
        key = id(values), level
        if key not in self._spans:
            if level == len(LEVELS) - 1:
                self._spans[key] = Span.of(values.ravel())
            else:
                finer, size = self._whole(values, level + 1), self._size(level + 1)
                times = LEVELS[level] // LEVELS[level + 1]
                low, high = (
                    _joined(function, _joined(function, ends.reshape(size), times).T, times).T.ravel()
                    for function, ends in ((np.minimum, finer.lo), (np.maximum, finer.hi))
                )
                self._spans[key] = Span(low, high)
        return self._spans[key]

    def finer(self, level: int, cells: Index) -> tuple[Index, Index]:
        """The cells of the next level within `cells`, and which of these each of them lies in."""
        times = LEVELS[level] // LEVELS[level + 1]
        y, x = np.divmod(cells, self._size(level)[1])
        rows, columns = self._size(level + 1)
        steps = np.arange(times)
        children_y = (y[:, None, None] * times + steps[:, None]) + 0 * steps
        children_x = (x[:, None, None] * times + steps) + 0 * steps[:, None]
        inside = (children_y < rows) & (children_x < columns)
        parents = np.broadcast_to(np.arange(len(cells))[:, None, None], inside.shape)
        return (children_y * columns + children_x)[inside], parents[inside]

    def place(self, level: int, cell: int) -> tuple[int, int]:
        """Row and column in the image of a cell's first pixel."""
        y, x = divmod(cell, self._size(level)[1])
        return self._corner[0] + y * LEVELS[level], self._corner[1] + x * LEVELS[level]
