"""Processing elements with their place in the file, whether or not the transform around them is sound."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from iccbrdf.errors import LimitError, ProfileError
from iccbrdf.icc import ELEMENTS, Calculator, CurveSet, MultiProcess, SampledCalculatorCurve
from iccbrdf.icc.fields import read_spans
from iccbrdf.icc.layout import shown
from iccbrdf.icc.reader import Budget, Reader
from iccbrdf.validate.findings import Finding, Place, finding, of_message

_POSITIONS = {"mpet": 16, "calc": 16, "cvst": 12}
"""Where the position table of a structure begins."""
_CALCULATOR_OF_CURVE = 24
"""Where the calculator of a sampled calculator curve begins."""
_OPERATIONS = 12
"""Where the operations of a calculator's function begin; eight bytes each."""


@dataclass(frozen=True)
class Located:
    """A processing element that is sound in itself, and its bytes in the file.

    `record` has at least a signature, `inputs` and `outputs`.
    """

    record: Any
    data: memoryview
    place: Place

    def operation(self, index: int) -> Place:
        """The place of an operation of a calculator."""
        function, _ = _span(self.data, "calc", 0)
        start = (self.place.offset or 0) + function + _OPERATIONS
        return self.place.at(start + 8 * index)


def _span(data: memoryview, structure: str, index: int) -> tuple[int, int]:
    """Offset and size at `index` of a structure's position table."""
    offset, size = struct.unpack_from(">II", data, _POSITIONS[structure] + 8 * index)
    return offset, size


class _Parts:
    """Goes through what is inside of elements, and gives an object that several positions share once."""

    def __init__(self) -> None:
        self.seen: set[int] = set()

    def at(
        self, data: memoryview, structure: str, index: int, place: Place, name: str, record: Any
    ) -> Iterator[Located]:
        """What `structure`, stored in `data`, has at `index` of its position table, and all inside it."""
        offset, size = _span(data, structure, index)
        here = place.inner(f"{name} ({shown(record.signature)})", (place.offset or 0) + offset)
        inside = data[offset : offset + size]
        if isinstance(record, SampledCalculatorCurve):
            inside, here = inside[_CALCULATOR_OF_CURVE:], here.at((here.offset or 0) + _CALCULATOR_OF_CURVE)
            record = record.calculator
        if id(record) in self.seen:
            return
        self.seen.add(id(record))
        yield Located(record, inside, here)
        if isinstance(record, Calculator):
            for i, element in enumerate(record.elements):
                # The first position is that of the main function.
                yield from self.at(inside, "calc", i + 1, here, f"sub-element {i}", element)
        elif isinstance(record, CurveSet):
            for i, curve in enumerate(record.curves):
                if isinstance(curve, SampledCalculatorCurve):
                    yield from self.at(inside, "cvst", i, here, f"curve {i}", curve)


def located(process: MultiProcess, data: bytes, place: Place) -> tuple[Located, ...]:
    """The elements of a sound transform, stored in `data`, each followed by those inside it."""
    parts, view = _Parts(), memoryview(data)
    return tuple(
        found
        for index, element in enumerate(process.elements)
        for found in parts.at(view, "mpet", index, place, f"element {index}", element)
    )


def read_leniently(
    data: bytes, place: Place, source: str, budget: Budget
) -> tuple[tuple[Located, ...], list[Finding]]:
    """The elements that can be read of a transform that cannot be read as a whole, and what hinders the rest.

    Nothing of either for other types of tags.  `budget` is that of the profile.
    """
    if data[:4] != b"mpet":
        return (), []
    reader = Reader(data, source, place.text, start=place.offset or 0, budget=Budget(budget))
    findings: list[Finding] = []

    def read(window: Reader, index: int) -> Any:
        channels = struct.unpack(">HH", window.peek(8, 4, "channels"))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # heard when the tag was read
                record = ELEMENTS.read(window)
        except (ProfileError, LimitError) as error:
            rule = "TAG-002" if isinstance(error, LimitError) else "MPE-003"
            findings.append(of_message(rule, error, place, source))
            record = None
        return channels, record

    try:
        inputs, outputs, count = struct.unpack(">HHI", reader.peek(8, 8, "channels and element count"))
        reader.take(_POSITIONS["mpet"], "head")
        spans = read_spans(reader, count, "element")
        read_ones = reader.parts(spans, lambda index: f"element {index}", read)
    except (ProfileError, LimitError) as error:
        return (), [*findings, of_message("TAG-001", error, place, source)]
    parts, view = _Parts(), memoryview(data)
    elements: list[Located] = []
    channels = inputs
    for index, ((takes, gives), record) in enumerate(read_ones):
        name = f"element {index}"
        if takes != channels:
            here = place.inner(name, (place.offset or 0) + spans[index][0])
            findings.append(finding("MPE-002", here, f"found {takes} inputs, expected {channels}"))
        channels = gives
        if record is not None:
            elements += parts.at(view, "mpet", index, place, name, record)
    if channels != outputs:
        message = f"found {channels} channels after the last element, expected {outputs}"
        findings.append(finding("MPE-002", place, message))
    return tuple(elements), findings
