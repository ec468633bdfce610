"""What a program asks of whoever runs it: the work for one pixel, known before any pixel is touched.

The unit is an operator on one number.  An operator on n numbers counts n times, an element by the numbers it
reads, and what is done once a tile is spread over its pixels.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from iccbrdf.calc.program import Op

TILE = 1 << 14
"""Pixels that share what is done once a tile."""
_BRANCH = 16
"""Values that an interpreter carries into and out of a branch with the effort of one operator."""
_APPEARANCE = 100
"""Operators of the appearance model's transforms, about."""


def operation_work(op: Op, pops: int, pushes: int) -> int:
    """Of one operation that takes and gives so many numbers; not that of an element that it applies."""
    if op.name == "solv":
        return pops * (1 + min(op.s, op.t))
    return max(1, pushes, pops // 2)


def branch_work(branches: int, carried: int) -> int:
    """Of choosing among so many blocks, each of which may change `carried` values."""
    return branches * (carried // _BRANCH)


def element_work(element: Any, programs: Iterable[int]) -> int:
    """Of a processing element; `programs` is the work of the calculators that it is or holds, in order."""
    kind = element.signature
    if kind == "calc":
        return sum(programs)
    if kind in ("cvst", "tmap"):
        curves = element.curves if kind == "cvst" else [element.luminance]
        inner = iter(programs)
        return int(4 * element.outputs + sum(_curve_work(curve, inner) for curve in curves))
    if kind in ("XtoJ", "JtoX"):
        return _APPEARANCE
    if hasattr(element, "table") and kind != "tint":
        # One weight a corner of the cell; 16 inputs have 65,536.
        return int(2**element.inputs * (element.inputs + element.outputs))
    return int((element.inputs + 1) * element.outputs)


def _curve_work(curve: Any, programs: Iterator[int]) -> int:
    if curve.signature == "curf":
        return 8 * len(curve.segments) + sum(len(getattr(s, "values", ())) for s in curve.segments) // TILE
    if curve.signature == "clcf":
        # The interpreter samples it anew for each tile.
        return 1 + int(curve.size) * next(programs) // TILE
    return 1 + len(curve.values) // TILE if curve.signature == "sngf" else 1
