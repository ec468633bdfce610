"""From a schedule to steps: which ufuncs run on which values, in which order.

Conditions are held as bools.  Where they choose, all bits or none are made of them, and where they are
wanted as numbers, 1 or 0: each once, in the block where it is first wanted.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from iccbrdf.calc import elements
from iccbrdf.calc.buffers import Code, Fork, Kind, Operand, Place, Register, Step, Steps, View, direct
from iccbrdf.calc.graph import Node, is_truth
from iccbrdf.calc.meanings import solve
from iccbrdf.calc.numpy_functions import LOGIC, MADE, NUMBERS, TESTS, copy, select, widened
from iccbrdf.calc.schedule import Block, Branch, Schedule

_Form: TypeAlias = "View | int"
"""What of a node is known: its value in some view, or a component of it."""
_Known: TypeAlias = "ChainMap[tuple[Node, _Form], Operand]"


def lower(plan: Schedule) -> Steps:
    """The steps that compute a schedule's outputs."""
    lowering = _Lowering(plan)
    lowering.block(plan.body)
    lowering.outputs(plan.graph.outputs)
    return direct(lowering.code.steps)


class _Lowering:
    """What is known of nodes while code is made.

    What a fork's block computes is known in that block alone, since it may not have run.
    """

    def __init__(self, plan: Schedule) -> None:
        self.code = Code(plan.graph.dtype)
        self._known: _Known = ChainMap()
        for index, node in enumerate(plan.arguments):
            register = Register(Kind.ARGUMENT, index)
            for view in (View.NUMBER, View.MASK, View.WIDE):
                self._known[node, view] = Place(register, view)

    def outputs(self, nodes: Sequence[Node]) -> None:
        for index, node in enumerate(nodes):
            self._copy(self._number(node), Place(Register(Kind.OUTPUT, index), View.NUMBER))

    def block(self, block: Block) -> None:
        for item in block:
            if isinstance(item, Branch):
                self._branch(item)
            elif item.op == "select" and _is_uniform(self._mask(item.arguments[0])):
                self._branch(Branch(item.arguments[0], (), (), (item,)))
            else:
                self._node(item)

    # Values

    def _number(self, node: Node) -> Operand:
        if node.op == "const":
            return self.code.number(node.detail[0])
        if is_truth(node):
            return self._form(node, View.NUMBER, lambda node: self.code.do(copy, self._mask(node)))
        return self._known[node, View.NUMBER]

    def _mask(self, node: Node) -> Operand:
        if node.op == "const":
            return np.bool_(node.detail[0] >= 0.5)
        if is_truth(node):
            return self._known[node, View.MASK]
        half = self.code.number(0.5)
        test = self.code.test
        return self._form(node, View.MASK, lambda node: test(np.greater_equal, self._number(node), half))

    def _wide(self, node: Node) -> Operand:
        return self._form(node, View.WIDE, lambda node: widened(self.code, self._mask(node)))

    def _form(self, node: Node, view: View, make: Callable[[Node], Operand]) -> Operand:
        key = (node, view)
        if key not in self._known:
            self._known[key] = make(node)
        return self._known[key]

    # Nodes

    def _node(self, node: Node) -> None:
        op = node.op
        if op in TESTS:
            operands = map(self._number, node.arguments)
            self._known[node, View.MASK] = self.code.test(TESTS[op], *operands)
        elif op in LOGIC:
            masks = map(self._mask, node.arguments)
            self._known[node, View.MASK] = self.code.test(LOGIC[op], *masks)
        elif op in _ELEMENTS:
            self._element(node)
        else:
            self._known[node, View.NUMBER] = self._value(node)

    def _value(self, node: Node) -> Operand:
        op, code = node.op, self.code
        if op == "input":
            return code.do(copy, Place(Register(Kind.INPUT, node.detail), View.NUMBER))
        if op == "pick":
            return self._known[node.arguments[0], node.detail]
        if op == "select":
            return self._select(node)[1]
        operands = map(self._number, node.arguments)
        if op in NUMBERS:
            return code.do(NUMBERS[op], *operands)
        return MADE[op](code, *operands)

    def _element(self, node: Node) -> None:
        places = [_new_place() for _ in range(node.width)]
        reads = tuple(map(self._number, node.arguments))
        function = _copying(_ELEMENTS[node.op](node.detail), len(reads))
        self.code.steps.append(Step(function, reads, tuple(places)))
        for component, place in enumerate(places):
            self._known[node, component] = place
        # A curve is read itself, the others through picks.
        self._known[node, View.NUMBER] = places[0]

    # Branches

    def _branch(self, branch: Branch) -> None:
        condition = self._mask(branch.condition)
        outer = self._known
        yes_known, no_known = outer.new_child(), outer.new_child()
        yes = self._within(yes_known, lambda: self.block(branch.yes))
        no = self._within(no_known, lambda: self.block(branch.no))
        results: dict[Node, Place] = {}
        both: Steps = ()
        if _is_uniform(condition):
            results = {chosen: _new_place() for chosen in branch.selects}
        else:
            known = ChainMap({}, yes_known.maps[0], no_known.maps[0], *outer.maps)
            both = self._within(known, lambda: results.update(map(self._select, branch.selects)))
        only_yes = self._within(yes_known, lambda: self._take(1, results))
        only_no = self._within(no_known, lambda: self._take(2, results))
        self.code.steps.append(Fork(condition, yes, no, only_yes, only_no, both))
        for chosen, place in results.items():
            outer[chosen, View.NUMBER] = place

    def _within(self, known: _Known, write: Callable[[], None]) -> Steps:
        """A block of its own that starts with what is known there."""
        outer, self._known = self._known, known
        block = self.code.block(write)
        self._known = outer
        return block

    def _select(self, node: Node) -> tuple[Node, Place]:
        condition, yes, no = node.arguments
        sides = self._number(yes), self._number(no)
        place = select(self.code, self._wide(condition), *sides)
        self._known[node, View.NUMBER] = place
        return node, place

    def _take(self, side: int, results: Mapping[Node, Place]) -> None:
        """Copy one side of each select to where its result goes."""
        for chosen, place in results.items():
            self._copy(self._number(chosen.arguments[side]), place)
            self._known[chosen, View.NUMBER] = place

    def _copy(self, value: Operand, place: Place) -> None:
        self.code.put(place, copy, value)


def _new_place() -> Place:
    return Place(Register(Kind.NUMBER), View.NUMBER)


def _is_uniform(operand: Operand) -> bool:
    return not isinstance(operand, Place) or operand.register.kind is Kind.ARGUMENT


def _copying(function: Callable[[Sequence[Any]], Sequence[Any]], inputs: int) -> Callable[..., None]:
    """A function of arrays in and out, of one that gives new arrays or numbers."""

    def copying(*operands: Any) -> None:
        for value, out in zip(function(operands[:inputs]), operands[inputs:], strict=True):
            np.copyto(out, value)

    return copying


def _table(element: Any) -> Callable[[Sequence[Any]], Sequence[Any]]:
    return lambda values: elements.apply(element, values, dtype=values[0].dtype)


_ELEMENTS: dict[str, Callable[[Any], Callable[[Sequence[Any]], Sequence[Any]]]] = {
    "curve": lambda curve: lambda values: [elements.apply_curve(curve, values[0], {})],
    "clut": _table,
    "tint": _table,
    "solve": lambda shape: lambda values: solve(values, shape[0] - 1, shape[1] - 1),
}
"""Nodes with several results or a function of their own: from their detail to a function of the values."""
