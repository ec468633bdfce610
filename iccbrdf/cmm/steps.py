"""The steps of a linked chain.  Each maps planar channels to planar channels and is plain data.

A channel is a NumPy array (one tile of pixels) or a scalar (uniform over the tile).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np

from iccbrdf.calc.elements import SIGNATURES
from iccbrdf.calc.elements import apply as apply_element
from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.lift import lift_element
from iccbrdf.calc.verify import MAX_WORK, Checked, verify_element
from iccbrdf.calc.work import element_work
from iccbrdf.cmm.environment import RESERVED
from iccbrdf.errors import LimitError, ProfileError, UnsupportedError, nearest
from iccbrdf.icc import MultiProcess

Channel = Any
"""A 1-D array over the tile, or a scalar."""


Resolve: TypeAlias = Callable[[Any, str], Any]
"""From an element and its place, for messages, to the element that runs in its stead."""


class Step(Protocol):
    """What a transform runs: `apply` is the definition, `lift` the same as nodes of a graph."""

    def apply(self, channels: Sequence[Channel], env: Mapping[str, float], dtype: Any) -> list[Channel]: ...

    def lift(self, graph: Graph, channels: Sequence[Node], *, finite_inputs: bool) -> list[Node]: ...


@dataclass(frozen=True)
class Process:
    """The elements of one multiProcessElements tag, in order; `origin` names its place for messages."""

    origin: str
    elements: tuple[Any, ...]
    variables: tuple[str, ...]
    """Run-time variables that the calculators among them read."""

    registers: int
    """An upper bound of the values that a pixel needs at a time."""

    executed: int
    """Operators on the longest path of its programs."""

    work: int
    """Operators on single numbers that a pixel takes, those of other elements included (calc/work.py)."""

    @classmethod
    def checked(cls, process: MultiProcess, origin: str, resolve: Resolve | None = None) -> Process:
        """After the checks that make it safe to run: elements that are known here, sound programs.

        `resolve` gives the element to run instead of one of the tag's.  Raises ProfileError, LimitError,
        LinkError or UnsupportedError.
        """
        variables: set[str] = set()
        registers = process.inputs
        executed = work = 0
        elements = []
        known: dict[int, tuple[Checked, ...]] = {}
        for i, element in enumerate(process.elements):
            place = f"{origin}: element {i}"
            # A tag may hold one element many times.
            if id(element) not in known:
                known[id(element)] = verify_element(element, where=f"{place} ({element.signature})")
            programs = known[id(element)]
            elements.append(resolve(element, f"{place} ({element.signature})") if resolve else element)
            _check_runnable(elements[-1], place)
            variables.update(*(p.environment for p in programs))
            registers = max(registers, element.outputs, *(p.max_depth + p.temporaries for p in programs))
            executed += sum(p.executed for p in programs)
            work += element_work(elements[-1], [p.work for p in programs])
            if work > MAX_WORK:
                raise LimitError(f"{place}: a pixel takes operations on more than {MAX_WORK} numbers")
        return cls(
            origin, tuple(elements), tuple(sorted(variables.difference(RESERVED))), registers, executed, work
        )

    def apply(self, channels: Sequence[Channel], env: Mapping[str, float], dtype: Any) -> list[Channel]:
        for element in self.elements:
            channels = apply_element(element, channels, env=env, dtype=dtype)
        return list(channels)

    def lift(self, graph: Graph, channels: Sequence[Node], *, finite_inputs: bool) -> list[Node]:
        for element in self.elements:
            channels = lift_element(graph, element, channels, finite_inputs=finite_inputs)
        return list(channels)


def _check_runnable(element: Any, place: str) -> None:
    """Is every element known here, those inside of calculators too, and does it have channels?"""
    place = f"{place} ({element.signature})"
    if element.signature not in SIGNATURES:
        raise UnsupportedError(f"{place} cannot run: {nearest(element.signature, SIGNATURES)}")
    if not element.inputs or not element.outputs:
        raise ProfileError(
            f"{place} has {element.inputs} channels in and {element.outputs} out, expected at least one"
        )
    for i, inner in enumerate(getattr(element, "elements", ())):
        _check_runnable(inner, f"{place}, sub-element {i}")


@dataclass(frozen=True)
class Route:
    """Picks channels by position; where `sources` has None, the default of that place stands instead."""

    sources: tuple[int | None, ...]
    defaults: tuple[float, ...]

    def apply(self, channels: Sequence[Channel], env: Mapping[str, float], dtype: Any) -> list[Channel]:
        return [
            dtype(default) if source is None else channels[source]
            for source, default in zip(self.sources, self.defaults, strict=True)
        ]

    def lift(self, graph: Graph, channels: Sequence[Node], *, finite_inputs: bool) -> list[Node]:
        return [
            graph.number(default) if source is None else channels[source]
            for source, default in zip(self.sources, self.defaults, strict=True)
        ]


@dataclass(frozen=True)
class Scale:
    """One factor a channel: the change between media-relative and absolute XYZ."""

    factors: tuple[float, ...]

    def apply(self, channels: Sequence[Channel], env: Mapping[str, float], dtype: Any) -> list[Channel]:
        return [channel * dtype(factor) for channel, factor in zip(channels, self.factors, strict=True)]

    def lift(self, graph: Graph, channels: Sequence[Node], *, finite_inputs: bool) -> list[Node]:
        factors = map(graph.number, self.factors)
        return [graph.add("mul", pair) for pair in zip(channels, factors, strict=True)]


# CIE 15:2018, 8.2.1: the cube root gives way to a line below (6/29)^3.
_EPSILON = (6 / 29) ** 3
_SLOPE = (29 / 6) ** 2 / 3


@dataclass(frozen=True)
class XYZToLab:
    """XYZ (Y = 1 for the white) -> CIELAB relative to `white`."""

    white: tuple[float, float, float]

    def apply(self, channels: Sequence[Channel], env: Mapping[str, float], dtype: Any) -> list[Channel]:
        ratios = [np.asarray(c, dtype) / dtype(w) for c, w in zip(channels, self.white, strict=True)]
        x, y, z = (np.where(t > _EPSILON, np.cbrt(t), t * dtype(_SLOPE) + dtype(4 / 29)) for t in ratios)
        return [dtype(116) * y - dtype(16), dtype(500) * (x - y), dtype(200) * (y - z)]

    def lift(self, graph: Graph, channels: Sequence[Node], *, finite_inputs: bool) -> list[Node]:
        op, number = graph.apply, graph.number

        def f(channel: Node, white: float) -> Node:
            t = op("div", channel, number(white))
            line = op("add", op("mul", t, number(_SLOPE)), number(4 / 29))
            return op("select", op("gt", t, number(_EPSILON)), op("cbrt", t), line)

        x, y, z = (f(channel, white) for channel, white in zip(channels, self.white, strict=True))
        return [
            op("sub", op("mul", number(116), y), number(16)),
            op("mul", number(500), op("sub", x, y)),
            op("mul", number(200), op("sub", y, z)),
        ]


@dataclass(frozen=True)
class LabToXYZ:
    """CIELAB relative to `white` -> XYZ (Y = 1 for the white), 0 where no light is that dark or colourful."""

    white: tuple[float, float, float]

    def apply(self, channels: Sequence[Channel], env: Mapping[str, float], dtype: Any) -> list[Channel]:
        lightness, a, b = (np.asarray(c, dtype) for c in channels)
        y = (lightness + dtype(16)) / dtype(116)
        roots = (y + a / dtype(500), y, y - b / dtype(200))

        def inverse(f: Channel, white: float) -> Channel:
            dark = np.where(f < 4 / 29, dtype(0), (f - dtype(4 / 29)) / dtype(_SLOPE))
            return dtype(white) * np.where(f > 6 / 29, f * f * f, dark)

        return [inverse(f, white) for f, white in zip(roots, self.white, strict=True)]

    def lift(self, graph: Graph, channels: Sequence[Node], *, finite_inputs: bool) -> list[Node]:
        op, number = graph.apply, graph.number
        lightness, a, b = channels
        y = op("div", op("add", lightness, number(16)), number(116))

        def inverse(f: Node, white: float) -> Node:
            cube = op("mul", op("mul", f, f), f)
            line = op("div", op("sub", f, number(4 / 29)), number(_SLOPE))
            dark = op("select", op("lt", f, number(4 / 29)), number(0), line)
            ratio = op("select", op("gt", f, number(6 / 29)), cube, dark)
            return op("mul", number(white), ratio)

        x = op("add", y, op("div", a, number(500)))
        z = op("sub", y, op("div", b, number(200)))
        return [inverse(f, white) for f, white in zip((x, y, z), self.white, strict=True)]
