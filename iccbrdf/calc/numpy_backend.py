"""The NumPy back end: a schedule as steps of ufuncs on tiles of pixels.

A kernel's code is a list of (function, which operands), made once from the graph: no text is generated,
and none evaluated.  A tile's channels are copied into planes, every step writes a whole plane, and the
outputs are copied from planes to pixels.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from iccbrdf.calc.buffers import Allocation, Fork, Kind, Operand, Place, Steps, View, allocate
from iccbrdf.calc.numpy_lowering import lower
from iccbrdf.calc.schedule import Schedule

TILE = 1 << 14
"""Pixels: with fewer, calling the ufuncs costs more than they do; with more, the buffers leave the cache."""
MAX_VALUES = 1 << 24
"""Numbers in the buffers together: programs may ask for so many buffers that fewer pixels must do."""

Frame: TypeAlias = list[Any]
"""All that steps read and write while a tile is computed, by position."""
Bound: TypeAlias = "list[tuple[Callable[..., Any], Callable[[Frame], tuple[Any, ...]]]]"
"""Functions, each with what takes its operands from a frame."""


def compile_numpy(plan: Schedule) -> NumpyKernel:
    """The kernel that runs a schedule."""
    return NumpyKernel(plan, lower(plan))


class NumpyKernel:
    """A compiled schedule.  It may be run by several threads at once: each run has buffers of its own."""

    def __init__(self, plan: Schedule, steps: Steps) -> None:
        self._dtype = np.dtype(plan.graph.dtype)
        self._layout = _Layout(plan, allocate(steps))
        self._code = _bound(steps, self._layout)
        self.tile = min(TILE, max(1, MAX_VALUES // max(1, self.registers)))
        self._idle: list[_Planes] = []
        self._last: tuple[Sequence[np.generic], Frame] = ([], [])

    @property
    def registers(self) -> int:
        """The number of buffers of numbers."""
        return self._layout.allocation.numbers

    def run(self, pixels: NDArray[Any], out: NDArray[Any], arguments: Sequence[np.generic]) -> None:
        """
        Compute pixels.

        Parameters
        ----------
        pixels
            (n, channels), of any strides and any type that NumPy casts to the graph's.
        out
            (n, outputs) of the graph's type, of any strides; not the same memory as `pixels`.
        arguments
            The values of the schedule's arguments (calc/schedule.py, uniform_values); not changed afterwards.
        """
        try:
            # Lists give and take single items atomically.
            planes = self._idle.pop()
        except IndexError:
            planes = _Planes(self._layout, self._dtype, self.tile)
        uniform = self._uniform(arguments)
        pixels = pixels.astype(self._dtype, copy=False)
        with np.errstate(all="ignore"):
            for start in range(0, len(pixels), self.tile):
                part = slice(start, start + self.tile)
                ins, outs = pixels[part].T, out[part].T
                _execute(self._code, [*ins, *outs, *planes.views(ins.shape[1]), *uniform])
        self._idle.append(planes)

    def _uniform(self, arguments: Sequence[np.generic]) -> Frame:
        """The part of a frame that comes from the arguments; those of the last run are kept."""
        last, frame = self._last
        if last is not arguments:
            with np.errstate(all="ignore"):
                frame = self._layout.uniform(arguments, self._dtype)
            self._last = arguments, frame
        return frame


def _execute(code: Bound, frame: Frame) -> None:
    for function, operands in code:
        function(*operands(frame))


class _Planes:
    """The buffers of one run."""

    def __init__(self, layout: _Layout, dtype: np.dtype[Any], tile: int) -> None:
        self._numbers = np.empty((layout.allocation.numbers, tile), dtype)
        self._masks = np.empty((layout.allocation.masks, tile), np.bool_)
        self._size = 0
        self._views: Frame = []

    def views(self, size: int) -> Frame:
        """The buffers for a tile of `size` pixels, as the layout has them."""
        if size != self._size:
            numbers, masks = self._numbers[:, :size], self._masks[:, :size]
            self._views = [*numbers, *numbers.view(f"i{numbers.itemsize}"), *masks, *masks.view(np.int8)]
            self._size = size
        return self._views


class _Layout:
    """Where in a frame things stand: channels in and out, buffers as their views, constants, arguments."""

    def __init__(self, plan: Schedule, allocation: Allocation) -> None:
        self.allocation = allocation
        inputs, outputs = plan.channels, len(plan.graph.outputs)
        numbers, masks = allocation.numbers, allocation.masks
        buffers = inputs + outputs
        self._start = {
            (Kind.INPUT, View.NUMBER): 0,
            (Kind.OUTPUT, View.NUMBER): inputs,
            (Kind.NUMBER, View.NUMBER): buffers,
            (Kind.NUMBER, View.BITS): buffers + numbers,
            (Kind.MASK, View.MASK): buffers + 2 * numbers,
            (Kind.MASK, View.BYTE): buffers + 2 * numbers + masks,
        }
        arguments, count = buffers + 2 * numbers + 2 * masks, len(plan.arguments)
        views = (View.NUMBER, View.BITS, View.MASK, View.WIDE)
        self._start |= {(Kind.ARGUMENT, view): arguments + i * count for i, view in enumerate(views)}
        self._constants: list[NDArray[Any]] = []
        self._end = arguments + len(views) * count

    def at(self, operand: Operand) -> int:
        """The position of an operand; a constant is given one."""
        if not isinstance(operand, Place):
            # NumPy takes arrays without dimensions more quickly than numbers.
            self._constants.append(np.asarray(operand))
            return self._end + len(self._constants) - 1
        register = operand.register
        index = self.allocation.buffer.get(register, register.index)
        return self._start[register.kind, operand.view] + index

    def uniform(self, arguments: Sequence[np.generic], dtype: np.dtype[Any]) -> Frame:
        """The part of a frame that holds for all tiles of a run."""
        numbers = np.array(arguments, dtype)
        masks = numbers >= 0.5
        integer = np.dtype(f"i{dtype.itemsize}")
        views = numbers, numbers.view(integer), masks, -masks.astype(integer)
        return [*(np.asarray(value) for view in views for value in view), *self._constants]


def _bound(steps: Steps, layout: _Layout) -> Bound:
    code: Bound = []
    for step in steps:
        if isinstance(step, Fork):
            code.append((_Choice(step, layout), _whole_frame))
        else:
            code.append((step.function, itemgetter(*map(layout.at, (*step.reads, *step.writes)))))
    return code


def _whole_frame(frame: Frame) -> tuple[Frame]:
    return (frame,)


class _Choice:
    """A fork that is ready to run."""

    def __init__(self, fork: Fork, layout: _Layout) -> None:
        self._condition = layout.at(fork.condition)
        self._yes, self._no = _bound(fork.yes, layout), _bound(fork.no, layout)
        self._only_yes, self._only_no = _bound(fork.only_yes, layout), _bound(fork.only_no, layout)
        self._both = _bound(fork.both, layout)

    def __call__(self, frame: Frame) -> None:
        mask = frame[self._condition]
        held = np.count_nonzero(mask)
        if held:
            _execute(self._yes, frame)
        if held < mask.size:
            _execute(self._no, frame)
        _execute(self._only_no if not held else self._only_yes if held == mask.size else self._both, frame)
