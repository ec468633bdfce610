"""The static check of numbers: can any program divide by zero, leave a domain or overflow?

Every transform is examined in float32, in which CMMs compute, for all inputs that its space declares:

    device                      0 to 1
    connection space XYZ        0 to 65535 / 32768, as u1.15 holds
    connection space Lab        0 to 100, -128 to 127
    multiplex, with a MID       what the MID's transform gives, or the default where it has no such channel
    multiplex without           -4 to 4: four times what normals and unit parameters take; and the default
    run-time variables          -1000 to 1000, or undefined

Transforms without a finding give finite numbers for all of these, whatever computes them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.hazards import Hazard, Kind, expression
from iccbrdf.calc.lift import Origin, lift_element
from iccbrdf.calc.program import signature_name, written
from iccbrdf.calc.ranges import Range, analyse
from iccbrdf.calc.verify import verify_element
from iccbrdf.errors import LimitError, ProfileError, UnsupportedError
from iccbrdf.icc import Calculator, MultiProcess, NumberArray, TagArray
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.subject import Subject, Tag, open_subject
from iccbrdf.validate.variables import FIXED

DEVICE: Range = (0.0, 1.0)
MULTIPLEX: Range = (-4.0, 4.0)
CONNECTION: Mapping[str, tuple[Range, ...]] = {
    "XYZ ": ((0.0, 65535 / 32768),) * 3,
    "Lab ": ((0.0, 100.0), (-128.0, 127.0), (-128.0, 127.0)),
}
"""What the channels of a connection space take."""

_RULES: Mapping[Kind, tuple[str, str]] = {
    "division": ("NUM-001", "divide by 0"),
    "domain": ("NUM-002", "have no result"),
    "overflow": ("NUM-003", "overflow"),
    "output": ("NUM-004", "give an output that is not finite"),
}
"""Rule, and what an operation may do that breaks it."""


def check_numeric(
    subject: Subject, ranges: Mapping[str, Range] | None = None, *, mid: Subject | None = None
) -> Iterator[Finding]:
    """
    Operations that can fail, each once.

    Parameters
    ----------
    subject
        The file.
    ranges
        Of multiplex channels and run-time variables, by name, instead of those that are declared; a
        variable that is named is defined.
    mid
        What an MVIS is used with; ignored for any other file.
    """
    ranges = ranges or {}
    if subject.header is None or subject.header.device_class != "mvis":
        mid = None
    given = {**(multiplex_ranges(mid) if mid is not None else {}), **ranges}
    for tag in subject.distinct:
        if isinstance(tag.value, MultiProcess) and tag.value.elements:
            yield from _check(subject, tag, given, ranges, mid is None)


def only_mid(contents: Iterable[tuple[bytes, str]]) -> Subject | None:
    """Of some files, each its bytes and its source, the one that is a MID; None if there are more or none."""
    subjects = (open_subject(*content) for content in contents)
    found = [subject for subject in subjects if subject.header and subject.header.device_class == "mid "]
    return found[0] if len(found) == 1 else None


def channels_and_variables(contents: Iterable[tuple[bytes, str]]) -> set[str]:
    """What ranges can be given for: the multiplex channels of some files, and what their programs read."""
    found: set[str] = set()
    for content in contents:
        subject = open_subject(*content)
        found |= {*_names(subject)}
        for element in subject.elements():
            if isinstance(element.record, Calculator):
                names = (signature_name(op.operand) for op in element.record.program if op.name == "env")
                found |= {name for name in names if name not in FIXED}
    return found


def multiplex_ranges(mid: Subject) -> dict[str, Range]:
    """By channel what a MID's transform gives for all device values, as far as that is finite."""
    process = mid.value("A2M0", MultiProcess)
    names = _names(mid)
    if process is None or len(names) != process.outputs:
        return {}
    try:
        graph, _ = _lifted(process)
    except (UnsupportedError, ProfileError, LimitError):
        return {}
    found = analyse(graph, [DEVICE] * process.inputs).ranges
    values = ((name, found[output]) for name, output in zip(names, graph.outputs, strict=True))
    return {name: (value.low, value.high) for name, value in values if value.finite}


def _check(
    subject: Subject,
    tag: Tag,
    given: Mapping[str, Range],
    variables: Mapping[str, Range],
    alone: bool,
) -> Iterator[Finding]:
    process = tag.value
    try:
        graph, origins = _lifted(process)
    except UnsupportedError as error:
        yield finding("NUM-005", tag.place, str(error))
        return
    except (ProfileError, LimitError):
        return  # a finding of other checks
    names, inputs = _inputs(subject, tag, given, alone)
    seen: set[Any] = set()
    for hazard in analyse(graph, inputs, variables).hazards:
        origin = origins.get(hazard.node, (None, None))
        key = (id(origin[0]), origin[1], hazard.kind)
        if key not in seen:
            seen.add(key)
            yield _told(tag, hazard, origin, names)


def _lifted(process: MultiProcess) -> tuple[Graph, dict[Node, Origin]]:
    """The graph of all elements of a transform."""
    graph = Graph(dtype=np.float32)
    origins: dict[Node, Origin] = {}
    channels = [graph.input(index) for index in range(process.inputs)]
    for element in process.elements:
        verify_element(element)
        channels = lift_element(graph, element, channels, origins=origins)
    graph.outputs = tuple(channels)
    return graph, origins


# Declared ranges ---------------------------------------------------------------------------------------


def _inputs(
    subject: Subject, tag: Tag, given: Mapping[str, Range], alone: bool
) -> tuple[tuple[str, ...], Sequence[Range]]:
    """The names of a transform's input channels, if they have any, and their ranges."""
    count = tag.value.inputs
    kind = tag.signature[:2]
    pcs = subject.header.pcs if subject.header else ""
    if tag.signature in ("c2sp", "s2cp"):
        pcs, kind = "XYZ ", "B2"
    if kind == "M2":
        names = _names(subject)
        if len(names) == count:
            return names, _multiplex(subject, names, given, alone)
        return (), [MULTIPLEX] * count
    space = pcs if kind == "B2" else subject.header.colour_space if subject.header else ""
    ranges = CONNECTION.get(space, ())
    return (), ranges if len(ranges) == count else [DEVICE] * count


def _names(subject: Subject) -> tuple[str, ...]:
    """The names of the multiplex channels; none where they cannot be told."""
    array = subject.value("mcta", TagArray)
    try:
        return array.texts() if array is not None else ()
    except ValueError:
        return ()


def _multiplex(
    subject: Subject, names: Sequence[str], given: Mapping[str, Range], alone: bool
) -> list[Range]:
    array = subject.value("mdv ", NumberArray)
    values = array.normalised() if array is not None else ()
    ranges = []
    for index, name in enumerate(names):
        default = float(values[index]) if index < len(values) else 0.0
        if not np.isfinite(default):
            default = 0.0  # a finding of its own
        around = (min(default, MULTIPLEX[0]), max(default, MULTIPLEX[1])) if alone else (default, default)
        ranges.append(given.get(name, around))
    return ranges


# Findings ----------------------------------------------------------------------------------------------


def _told(tag: Tag, hazard: Hazard, origin: Origin, names: Sequence[str]) -> Finding:
    rule, does = _RULES[hazard.kind]
    element, position = origin
    located = next((each for each in tag.elements if each.record is element), None)
    place: Place = located.place if located is not None else tag.place
    operation = hazard.node.op
    if located is not None and position is not None:
        place = located.operation(position)
        operation = f"op {position} ({written(element.program[position])})"
    message = f"{operation} may {does}: x = {expression(hazard.operand, names)} is within {hazard.range}"
    return finding(rule, place, f"{message}; smallest guard: {hazard.guard}" if hazard.guard else message)
