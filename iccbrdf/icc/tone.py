"""The tone map element of profiles for high dynamic range (iccMAX 5.1), and its functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from iccbrdf.icc.curves import CURVES, SampledCalculatorCurve, SampledCurve, SegmentedCurve
from iccbrdf.icc.elements import ELEMENTS
from iccbrdf.icc.fields import F32, U16, Repeat, Reserved, read_spans, tag_layout, write_parts
from iccbrdf.icc.layout import Field, FieldType, Record, Registry, Seen
from iccbrdf.icc.reader import Reader

TONE_FUNCTIONS = Registry("tone function")


@TONE_FUNCTIONS.add("mapf")
@dataclass(frozen=True, eq=False)
class ToneFunction(Record):
    """y = gain * luminance * (x + offset) + black: `parameters` are gain, offset, black (type 0)."""

    parameters: tuple[float, float, float]
    type: int = 0

    signature = "mapf"
    layout = tag_layout(
        signature,
        Field("type", U16, valid=(0,)),
        Reserved(2),
        Field("parameters", Repeat(F32, 3)),
        exact=True,
    )


class _CurveAndFunctions(FieldType):
    """The position of the luminance curve, those of the functions, and what they point to."""

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[Any, ...]:
        spans = read_spans(reader, seen["outputs"] + 1, "tone map part")
        return tuple(reader.parts(spans, self._label, self._part))

    @staticmethod
    def _label(index: int) -> str:
        return f"function {index - 1}" if index else "luminance curve"

    @staticmethod
    def _part(reader: Reader, index: int) -> Any:
        return (TONE_FUNCTIONS if index else CURVES).read(reader)

    def write(self, out: bytearray, value: Sequence[Record], record: Any) -> None:
        write_parts(out, value)


@ELEMENTS.add("tmap")
@dataclass(frozen=True, eq=False)
class ToneMap(Record):
    """Scales channels by a curve of the luminance, which is the last input: one more than the outputs."""

    luminance: SegmentedCurve | SampledCurve | SampledCalculatorCurve
    functions: tuple[ToneFunction, ...]

    signature = "tmap"
    layout = tag_layout(
        signature,
        Field("inputs", U16, derived=lambda r: r.inputs),
        Field("outputs", U16, derived=lambda r: r.outputs, valid=range(1, 65535)),
        Field("parts", _CurveAndFunctions(), derived=lambda r: (r.luminance, *r.functions)),
    )

    @classmethod
    def build(cls, seen: Seen) -> ToneMap:
        luminance, *functions = seen["parts"]
        return cls(luminance, tuple(functions))

    @property
    def inputs(self) -> int:
        return len(self.functions) + 1

    @property
    def outputs(self) -> int:
        return len(self.functions)

    def check(self) -> None:
        CURVES.check(self.luminance)
        object.__setattr__(self, "functions", tuple(TONE_FUNCTIONS.check(f) for f in self.functions))
        if not self.functions:
            raise ValueError("functions: found none, expected one for each output")
