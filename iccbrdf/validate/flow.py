"""What every path through a sound program writes and reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from iccbrdf.calc.operators import OPERATORS, Element, Operand, stack_effect
from iccbrdf.calc.program import Block, Program, Step, nest, signature_name

Slots = int
"""A set of channels or temporaries, one bit each: sets of Python are too slow for hostile programs."""


def indices(slots: Slots) -> list[int]:
    """The members of a set, in order."""
    return [i for i in range(slots.bit_length()) if slots >> i & 1]


@dataclass(frozen=True)
class State:
    """At a point of the program: what has been written on every path to it, and the greatest stack depth."""

    outputs: Slots = 0
    temporaries: Slots = 0
    depth: int = 0


class Flow:
    """One pass over a program that the verifier has found sound.

    Attributes
    ----------
    inputs : Slots
        Channels that are read.
    outputs : Slots
        Channels that some path writes.
    too_early : Slots
        Temporaries that are read where a path has not written them; `early_reads` lists the operations.
    variables : dict of str to int
        Run-time variables, each with the first operation that reads it.
    elements : set of int
        Sub-elements that are applied.
    blocks : list of Block
        All blocks, the whole program among them.
    end : State
        Behind the last operation.
    """

    def __init__(self, program: Program, elements: Sequence[Element]) -> None:
        self._elements = elements
        self.inputs: Slots = 0
        self.outputs: Slots = 0
        self.too_early: Slots = 0
        self.early_reads: list[int] = []
        self.variables: dict[str, int] = {}
        self.elements: set[int] = set()
        self.blocks: list[Block] = []
        self.end = self._block(nest(program), State())

    def _block(self, block: Block, state: State) -> State:
        self.blocks.append(block)
        for step in block:
            state = self._step(step, state)
        return state

    def _step(self, step: Step, state: State) -> State:
        op = step.op
        operator = OPERATORS[op.name]
        pops, pushes = stack_effect(operator, op.s, op.t, self._elements)
        outputs, temporaries = state.outputs, state.temporaries
        if operator.operand is Operand.RANGE:
            slots = ((1 << op.t + 1) - 1) << op.s
            if op.name == "in":
                self.inputs |= slots
            elif op.name == "out":
                self.outputs |= slots
                outputs |= slots
            elif op.name == "tget":
                if slots & ~temporaries:
                    self.too_early |= slots & ~temporaries
                    self.early_reads.append(step.position)
            else:
                temporaries |= slots
        elif operator.operand is Operand.SIGNATURE:
            self.variables.setdefault(signature_name(op.operand), step.position)
        elif operator.operand is Operand.ELEMENT:
            self.elements.add(op.s)
        state = State(outputs, temporaries, state.depth + pushes - pops)
        if not step.branches:
            return state
        ends = [self._block(block, state) for block in (*step.branches, step.otherwise or ())]
        outputs, temporaries = ends[0].outputs, ends[0].temporaries
        for end in ends[1:]:
            outputs &= end.outputs
            temporaries &= end.temporaries
        return State(outputs, temporaries, max(end.depth for end in ends))
