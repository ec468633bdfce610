"""The curve set element, its curves, and the segments that they are made of (ICC.2, 11.2.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from iccbrdf.icc.elements import ELEMENTS, Calculator
from iccbrdf.icc.fields import (
    F32,
    U16,
    U32,
    Embedded,
    FloatArray,
    Floats,
    Positioned,
    Repeat,
    Reserved,
    Sequential,
    encodable,
    tag_layout,
)
from iccbrdf.icc.layout import Field, Record, Registry
from iccbrdf.icc.tags import TAGS

CURVES = Registry("curve")
SEGMENTS = Registry("curve segment")

PARAMETERS = {0: 4, 1: 5, 2: 5, 3: 5, 4: 5, 5: 6, 6: 7, 7: 6}
"""How many parameters the formula of each type has."""


@SEGMENTS.add("parf")
@dataclass(frozen=True, eq=False)
class FormulaSegment(Record):
    """A segment given by a formula; its parameters stand in the order of the file (gamma first, if any).

    Types, with X the input: 0 (aX+b)^g + c; 1 a log10(b X^g + c) + d; 2 a b^(cX+d) + e; 3 a (bX+c)^g + d, the
    base not below 0; 4 to 7 the later formulas for high dynamic range.
    """

    type: int
    parameters: tuple[float, ...]

    signature = "parf"
    layout = tag_layout(
        signature,
        Field("type", U16, valid=PARAMETERS),
        Reserved(2),
        Field("parameters", Repeat(F32, lambda seen: PARAMETERS[seen["type"]])),
    )

    def check(self) -> None:
        if len(self.parameters) != PARAMETERS[self.type]:
            raise ValueError(
                f"parameters: found {len(self.parameters)}, "
                f"expected {PARAMETERS[self.type]} for type {self.type}"
            )


@SEGMENTS.add("samf")
@dataclass(frozen=True, eq=False)
class SampledSegment(Record):
    """A segment given by samples at equal distances, the last one at its end.

    The sample at its start is not stored: it is the value of the segment before at that point.
    """

    values: FloatArray

    signature = "samf"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.values)),
        Field("values", Floats(lambda seen: (seen["count"],))),
    )

    def check(self) -> None:
        if self.values.ndim != 1 or not self.values.size:
            raise ValueError(f"values: found shape {self.values.shape}, expected at least one in a row")


@TAGS.add("curf")
@CURVES.add("curf")
@dataclass(frozen=True, eq=False)
class SegmentedCurve(Record):
    """Segments between break points: the first from minus infinity, the last to infinity.

    As a tag, segmentedCurveType.  A break point belongs to the segment on its left.  `breakpoints` are
    finite and increase strictly, one fewer than the `segments`; the first and the last segment are formulas.
    """

    breakpoints: tuple[float, ...]
    segments: tuple[FormulaSegment | SampledSegment, ...]

    signature = "curf"
    layout = tag_layout(
        signature,
        Field("count", U16, derived=lambda r: len(r.segments), valid=range(1, 65536)),
        Reserved(2),
        Field("breakpoints", Repeat(F32, lambda seen: seen["count"] - 1)),
        Field("segments", Sequential(SEGMENTS, lambda seen: int(seen["count"]))),
        exact=True,
    )

    def check(self) -> None:
        points = self.breakpoints
        if len(self.segments) != len(points) + 1:
            raise ValueError(f"found {len(self.segments)} segments, expected {len(points) + 1}")
        increasing = all(a < b for a, b in pairwise(points))
        if not increasing or not all(map(math.isfinite, points)):
            raise ValueError(f"breakpoints: found {points}, expected finite ones that increase strictly")
        if isinstance(self.segments[0], SampledSegment) or isinstance(self.segments[-1], SampledSegment):
            raise ValueError("segments: found a sampled one first or last, where the range is infinite")


@CURVES.add("sngf")
@dataclass(frozen=True, eq=False)
class SampledCurve(Record):
    """Samples at equal distances from `first` to `last`, two or more.

    `extension` 0: inputs outside take the value of the nearest end; 1: the outermost interval is extended.
    `encoding`: how the values are stored, 0 float32, 1 float16, 2 uInt16, 3 uInt8 (2 and 3 stand for 0..1).
    """

    first: float
    last: float
    extension: int
    values: FloatArray
    encoding: int = 0

    signature = "sngf"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.values)),
        Field("first", F32),
        Field("last", F32),
        Field("extension", U16, valid=(0, 1)),
        Field("encoding", U16, valid=range(4)),
        Field("values", Floats(lambda seen: (seen["count"],))),
    )

    def check(self) -> None:
        _check_range(self.first, self.last)
        if self.values.ndim != 1 or len(self.values) < 2:
            raise ValueError(f"values: found shape {self.values.shape}, expected two or more in a row")
        object.__setattr__(self, "values", encodable(self.values, self.encoding))


@CURVES.add("clcf")
@dataclass(frozen=True, eq=False)
class SampledCalculatorCurve(Record):
    """A curve that a calculator of one channel gives, sampled at `size` places from `first` to `last`."""

    size: int
    first: float
    last: float
    extension: int
    calculator: Calculator

    signature = "clcf"
    layout = tag_layout(
        signature,
        Field("size", U32),
        Field("first", F32),
        Field("last", F32),
        Field("extension", U16, valid=(0, 1)),
        Reserved(2),
        Field("calculator", Embedded(ELEMENTS)),
    )

    def check(self) -> None:
        _check_range(self.first, self.last)
        if self.size < 2:
            raise ValueError(f"size: found {self.size}, expected 2 or more")
        calculator: Any = self.calculator
        if not isinstance(calculator, Calculator) or (calculator.inputs, calculator.outputs) != (1, 1):
            raise ValueError(
                f"calculator: found {calculator.signature!r} from {calculator.inputs} to "
                f"{calculator.outputs} channels, expected 'calc' from 1 to 1"
            )


@ELEMENTS.add("cvst")
@dataclass(frozen=True, eq=False)
class CurveSet(Record):
    """One curve for each channel."""

    curves: tuple[SegmentedCurve | SampledCurve | SampledCalculatorCurve, ...]

    signature = "cvst"
    layout = tag_layout(
        signature,
        Field("inputs", U16, derived=lambda r: r.inputs),
        Field("outputs", U16, derived=lambda r: r.outputs),
        Field("curves", Positioned(CURVES, "curve", lambda seen: int(seen["inputs"]))),
    )

    @property
    def inputs(self) -> int:
        return len(self.curves)

    @property
    def outputs(self) -> int:
        return len(self.curves)


def _check_range(first: float, last: float) -> None:
    if not (np.isfinite(first) and np.isfinite(last) and first < last):
        raise ValueError(f"found entries from {first} to {last}, expected finite ones that increase")
