"""Straight-line code over planar buffers: what the NumPy back end makes of a graph, and where it puts it.

A step is a function and its operands, `function(*reads, *writes)`: most are NumPy ufuncs that write a whole
tile to a buffer.  While code is made every value has a register of its own; `allocate` then finds the
few buffers that these can share, from when each is needed for the last time.
"""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

Function: TypeAlias = Callable[..., Any]


class Kind(enum.Enum):
    """Where a register lies."""

    NUMBER = "a buffer of numbers of the working type"
    MASK = "a buffer of bools"
    INPUT = "a channel of the pixels that come in"
    OUTPUT = "a channel of the pixels that go out"
    ARGUMENT = "a number given to the run"


class View(enum.Enum):
    """As what a register is read or written."""

    NUMBER = "a number of the working type"
    BITS = "the bits of a number, as an integer of the same size"
    MASK = "a bool"
    BYTE = "a bool, as an integer of one byte"
    WIDE = "a bool, as an integer of the size of a number: all bits set, or none"


@dataclass(frozen=True, eq=False)
class Register:
    """A place for one value a pixel; `index` numbers those that lie outside of the buffers."""

    kind: Kind
    index: int = -1


@dataclass(frozen=True)
class Place:
    """A register and how to look at it."""

    register: Register
    view: View


Operand: TypeAlias = "Place | np.generic"
"""What a step reads: a place, or a constant."""


@dataclass(frozen=True)
class Step:
    """`function(*reads, *writes)`; a function may write where it reads, but not before it has read all."""

    function: Function
    reads: tuple[Operand, ...]
    writes: tuple[Place, ...]


@dataclass(frozen=True)
class Fork:
    """Code that depends on whether a condition holds on the whole tile, nowhere on it, or on a part.

    yes, only_yes run where it holds everywhere, no, only_no where nowhere, and yes, no, both otherwise.
    """

    condition: Operand
    yes: Steps
    no: Steps
    only_yes: Steps
    only_no: Steps
    both: Steps


Steps: TypeAlias = "Sequence[Step | Fork]"


class Code:
    """Steps in the making; `steps` is the block that is being written."""

    def __init__(self, dtype: type[np.floating[Any]]) -> None:
        self.dtype = dtype
        self.integer = np.dtype(f"i{np.dtype(dtype).itemsize}").type
        self.steps: list[Step | Fork] = []

    def number(self, value: float) -> np.generic:
        """A constant of the working type."""
        constant: np.generic = self.dtype(value)
        return constant

    def put(self, place: Place, function: Function, *reads: Operand) -> None:
        self.steps.append(Step(function, reads, (place,)))

    def do(self, function: Function, *reads: Operand) -> Place:
        """A new number that the function computes."""
        return self._new(Kind.NUMBER, View.NUMBER, function, reads)

    def do_bits(self, function: Function, *reads: Operand) -> Place:
        """A new number whose bits, an integer, the function computes."""
        return self._new(Kind.NUMBER, View.BITS, function, reads)

    def test(self, function: Function, *reads: Operand) -> Place:
        """A new condition that the function computes."""
        return self._new(Kind.MASK, View.MASK, function, reads)

    def _new(self, kind: Kind, view: View, function: Function, reads: tuple[Operand, ...]) -> Place:
        place = Place(Register(kind), view)
        self.put(place, function, *reads)
        return place

    def bits(self, operand: Operand) -> Operand:
        """The bits of a number."""
        if isinstance(operand, Place):
            return Place(operand.register, View.BITS)
        bits: np.generic = operand.view(self.integer)
        return bits

    def constant_bits(self, value: int) -> np.generic:
        """An integer constant of the size of a number."""
        constant: np.generic = self.integer(value)
        return constant

    def block(self, write: Callable[[], None]) -> Steps:
        """The steps that `write` adds, as a block of their own."""
        outer, self.steps = self.steps, []
        write()
        block, self.steps = self.steps, outer
        return block


def direct(steps: Steps) -> Steps:
    """
    The same code, but for channels that go out after one function at most: these take no buffer on the way.

    Channels are not contiguous, and functions slower on them: copying to a buffer and back takes longer than
    that for one function, but not for two.
    """
    reads = Counter(register for read, _ in _uses(steps) for register in read)
    sources = {
        step.writes[0]: step
        for step in steps
        if isinstance(step, Step) and len(step.writes) == 1 and reads[step.writes[0].register] == 1
    }

    def source(step: Step) -> Step | None:
        """What makes the only thing that a step reads from a buffer, and that nothing else reads."""
        read = [operand for operand in step.reads if isinstance(operand, Place) and operand in sources]
        return sources[read[0]] if len(read) == len(_buffered(step.reads)) == 1 else None

    shorter: dict[int, Step] = {}
    spared: set[int] = set()
    for last in steps:
        if not isinstance(last, Step) or last.writes[0].register.kind is not Kind.OUTPUT:
            continue
        path = [last]
        while len(path) < 3 and (before := source(path[-1])) is not None:
            path.append(before)
        if len(path) == 1:
            continue
        channel, *others = path[-1].reads
        if others or not isinstance(channel, Place) or channel.register.kind is not Kind.INPUT:
            continue
        function = path[-2]
        through = tuple(channel if operand in sources else operand for operand in function.reads)
        shorter[id(last)] = Step(function.function, through, last.writes)
        spared.update(map(id, path[1:]))
    return [shorter.get(id(step), step) for step in steps if id(step) not in spared]


# Sharing buffers ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Allocation:
    """Which buffer each register shares, and how many there are of each kind."""

    buffer: dict[Register, int]
    numbers: int
    masks: int


def allocate(steps: Steps) -> Allocation:
    """
    Give every register a buffer that no other uses while it is needed.

    The blocks of a fork are taken as if all of them ran, one after the other.  A step's result may take the
    place of what it reads for the last time.
    """
    uses = list(_uses(steps))
    last = {register: at for at, (reads, writes) in enumerate(uses) for register in (*reads, *writes)}
    buffer: dict[Register, int] = {}
    free: dict[Kind, list[int]] = {Kind.NUMBER: [], Kind.MASK: []}
    made = {Kind.NUMBER: 0, Kind.MASK: 0}
    for at, (reads, writes) in enumerate(uses):
        done = [register for register in dict.fromkeys(reads) if last[register] == at]
        free_now = [register for register in done if register not in writes]
        for register in free_now:
            free[register.kind].append(buffer[register])
        for register in writes:
            if register in buffer:
                continue
            available = free[register.kind]
            if available:
                buffer[register] = available.pop()
            else:
                buffer[register] = made[register.kind]
                made[register.kind] += 1
        for register in dict.fromkeys(writes):
            if last[register] == at:
                free[register.kind].append(buffer[register])
    return Allocation(buffer, made[Kind.NUMBER], made[Kind.MASK])


def _uses(steps: Steps) -> Iterator[tuple[list[Register], list[Register]]]:
    """The registers with buffers that are read and written, in order."""
    for step in steps:
        if isinstance(step, Fork):
            yield _buffered([step.condition]), []
            for block in (step.yes, step.no, step.only_yes, step.only_no, step.both):
                yield from _uses(block)
        else:
            yield _buffered(step.reads), _buffered(step.writes)


def _buffered(operands: Sequence[Operand]) -> list[Register]:
    return [
        operand.register
        for operand in operands
        if isinstance(operand, Place) and operand.register.kind in (Kind.NUMBER, Kind.MASK)
    ]
