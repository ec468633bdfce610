"""Decoding of device channels: each result is one channel, times a factor, plus an offset."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.lift import lift_element
from iccbrdf.calc.program import Program, parse
from iccbrdf.calc.verify import verify_element
from iccbrdf.errors import IccBrdfError

_OPERATORS = frozenset(("in", "data", "copy", "mul", "add", "out"))
"""Of programs that decode; one with others is not looked at."""


@dataclass(frozen=True)
class Decoding:
    """Results are `channels[source] * factor + offset`, in float32; no source comes twice.

    Channels that are no source go no further.
    """

    sources: tuple[int, ...]
    factors: tuple[float, ...]
    offsets: tuple[float, ...]

    def program(self) -> Program:
        """A calculator's program that does this."""
        return parse(" ".join([*self._runs(), f"out(0,{len(self.sources)})"]))

    def _runs(self) -> Iterator[str]:
        """Operators that leave the results on the stack, neighbours that are decoded alike together."""
        results = zip(self.sources, self.factors, self.offsets, strict=True)
        for _, group in groupby(enumerate(results), lambda item: (item[1][0] - item[0], *item[1][1:])):
            run = [result for _, result in group]
            (first, factor, offset), size = run[0], len(run)
            yield f"in({first},{size})"
            if factor != 1:
                yield f"{_repeated(factor, size)} mul({size})"
            if offset != 0:
                yield f"{_repeated(offset, size)} add({size})"


def _repeated(number: float, size: int) -> str:
    """Operators that leave a number so many times on the stack."""
    return f"{number!r} copy(1,{size - 1})" if size > 2 else " ".join([repr(number)] * size)


def decoding_of(element: Any) -> Decoding | None:
    """What a matrix or a calculator decodes; None for an element that does anything else."""
    if element.signature == "matf" and element.matrix is not None:
        return _of_matrix(element)
    if element.signature == "calc" and all(op.name in _OPERATORS for op in element.program):
        return _of_calculator(element)
    return None


def _of_matrix(element: Any) -> Decoding | None:
    used = [np.flatnonzero(row) for row in element.matrix]
    if any(len(columns) != 1 for columns in used):
        return None
    sources = [int(columns[0]) for columns in used]
    return _distinct(sources, element.matrix.sum(axis=1).tolist(), element.offset.tolist())


def _of_calculator(element: Any) -> Decoding | None:
    try:
        verify_element(element)
    except IccBrdfError:
        # Whoever is to run it says so.
        return None
    graph = Graph(dtype=np.float32)
    results = lift_element(graph, element, [graph.input(i) for i in range(element.inputs)])
    terms = [term for result in results if (term := _term(result)) is not None]
    if len(terms) < len(results):
        return None
    return _distinct(*zip(*terms, strict=True))


def _term(node: Node) -> tuple[int, float, float] | None:
    """An input, its factor and its offset."""
    node, offset = _parted(node, "add", 0.0)
    node, factor = _parted(node, "mul", 1.0)
    return (node.detail, factor, offset) if node.op == "input" else None


def _parted(node: Node, op: str, neutral: float) -> tuple[Node, float]:
    """`node` without the operator and the constant that it ends with."""
    if node.op == op and node.arguments[1].op == "const":
        return node.arguments[0], node.arguments[1].detail[0]
    return node, neutral


def _distinct(sources: Sequence[int], factors: Sequence[float], offsets: Sequence[float]) -> Decoding | None:
    if len(set(sources)) < len(sources):
        return None
    return Decoding(tuple(sources), tuple(factors), tuple(offsets))
