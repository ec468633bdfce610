"""The calculator as a plain stack machine that runs a program on a tile of pixels.

This loop and the operator table are the definition of what a program computes; every faster way of
running programs is compared with them.  A value that is the same for all pixels stays one number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from iccbrdf.calc import elements as processing
from iccbrdf.calc.meanings import Value, is_true, round_half_away, where
from iccbrdf.calc.operators import OPERATORS, Element, Kind, apply, stack_effect
from iccbrdf.calc.program import Block, Program, Step, nest, signature


def run(
    program: Program,
    channels: Sequence[ArrayLike],
    n_out: int,
    *,
    elements: Sequence[Element] = (),
    env: Mapping[str, float] | None = None,
    dtype: DTypeLike = np.float32,
) -> list[Value]:
    """Run a verified program on a tile.

    channels: one 1-D array of pixels, or one number for all pixels, an input channel; they are not clipped.
    elements: the calculator's sub-elements.  env: run-time variables by name of at most four characters.
    dtype: float32, as a CMM computes, or float64.

    Returns n_out values of `dtype`, arrays or (where no pixel makes a difference) scalars; 0 where the
    program writes none.  They may be the very arrays of `channels`: do not change them in place.
    What verify() refuses is not checked again.
    """
    number: Any = np.dtype(dtype).type
    machine = _Machine(
        dtype=number,
        channels=[np.asarray(channel, number)[()] for channel in channels],
        elements=elements,
        env=env or {},
        stack=[],
        outputs=[number(0)] * n_out,
        temporaries={},
        buried=number(0),
    )
    with np.errstate(all="ignore"):
        _execute(_nested(program), machine)
    return machine.outputs


@lru_cache(maxsize=64)
def _nested(program: Program) -> Block:
    """A program is nested into blocks once, not once a tile."""
    return nest(program)


@dataclass
class _Machine:
    """The state of a run.  Its lists hold references to values that are never changed in place.

    `buried` counts the stack entries that a merge of branches has cut off at the bottom.
    """

    dtype: type[np.floating[Any]]
    channels: Sequence[Value]
    elements: Sequence[Element]
    env: Mapping[str, float]
    stack: list[Value]
    outputs: list[Value]
    temporaries: dict[int, Value]
    buried: Value

    def depth(self) -> Value:
        depth: Value = self.buried + self.dtype(len(self.stack))
        return depth

    def variable(self, wanted: int) -> float | None:
        if wanted == signature("true"):
            return 1.0
        if wanted == signature("ndef"):
            return None
        return next((value for name, value in self.env.items() if signature(name) == wanted), None)

    def element(self, index: int, values: Sequence[Value]) -> list[Value]:
        return processing.apply(self.elements[index], values, env=self.env, dtype=self.dtype)

    def fork(self) -> _Machine:
        return replace(
            self, stack=list(self.stack), outputs=list(self.outputs), temporaries=dict(self.temporaries)
        )

    def bury(self, count: int) -> None:
        if count:
            del self.stack[:count]
            self.buried = self.buried + self.dtype(count)


def _execute(block: Block, machine: _Machine) -> None:
    stack = machine.stack
    for step in block:
        op = step.op
        operator = OPERATORS[op.name]
        if operator.kind is Kind.CONTROL:
            _choose(step, machine)
            continue
        pops, _ = stack_effect(operator, op.s, op.t, machine.elements)
        kept = len(stack) - pops
        values = stack[kept:]
        del stack[kept:]
        stack += apply(operator, machine, values, op.s, op.t)


def _choose(step: Step, machine: _Machine) -> None:
    """Run an `if` or `sel`: the one block that the whole tile takes, or all taken ones and merge."""
    blocks = [*step.branches, step.otherwise or ()]
    last = len(step.branches)
    value = machine.stack.pop()
    if step.op.name == "if":
        chosen = where(is_true(value), np.intp(0), np.intp(1))
    else:
        number = round_half_away(value)
        chosen = where((number >= 0) & (number < last), number, value.dtype.type(last)).astype(np.intp)
    # A tile of no pixels takes no block; any will do then.
    taken = np.flatnonzero(np.bincount(np.ravel(chosen))).tolist() or [last]
    *others, final = taken
    before = machine.fork() if others else machine
    _execute(blocks[final], machine)
    for number in others:
        side = before.fork()
        _execute(blocks[number], side)
        _merge(chosen == number, side, machine)


def _merge(mask: Value, side: _Machine, machine: _Machine) -> None:
    """Take into `machine` the state of `side` where `mask` holds.

    Later operations reach only down to the smaller depth, counted from the top (the verifier sees to
    it), so what lies deeper on the one stack is dropped.
    """

    def pick(yes: Value, no: Value) -> Value:
        return no if yes is no else where(mask, yes, no)

    depth = min(len(side.stack), len(machine.stack))
    for part in (side, machine):
        part.bury(len(part.stack) - depth)
    machine.buried = pick(side.buried, machine.buried)
    machine.stack[:] = map(pick, side.stack, machine.stack)
    machine.outputs[:] = map(pick, side.outputs, machine.outputs)
    zero = machine.dtype(0)
    for slot in side.temporaries.keys() | machine.temporaries.keys():
        yes, no = (part.temporaries.get(slot, zero) for part in (side, machine))
        machine.temporaries[slot] = pick(yes, no)
