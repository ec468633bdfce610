"""Checks of calculator programs: soundness first, then what is legal and yet likely a mistake."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from iccbrdf.calc import verify
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.program import Block, Step, written
from iccbrdf.errors import LimitError, ProfileError
from iccbrdf.icc import Calculator, CurveSet, SampledCalculatorCurve
from iccbrdf.validate.elements import Located
from iccbrdf.validate.findings import Finding, finding
from iccbrdf.validate.flow import Flow, Slots, indices
from iccbrdf.validate.subject import Subject
from iccbrdf.validate.variables import FIXED, nearest_variable

_SHOWN = 8
"""Channels and places that a message lists."""
_LATER = ("noop", "scnt", "vxor")
"""Operators that ICC.2:2023 has added."""
# How the verifier names the operation in its messages.
_OPERATION = re.compile(r"\bop (\d+)\b")

# The literals that an operation must not meet: how many of the last entries it looks at for n repetitions,
# and which values are at fault.
_FAULTS: Mapping[str, tuple[Callable[[int], int], Callable[[float], bool]]] = {
    **dict.fromkeys(("div", "mod"), (lambda n: n, lambda v: v == 0)),
    "sdiv": (lambda n: 1, lambda v: v == 0),
    "sqrt": (lambda n: n, lambda v: v < 0),
    **dict.fromkeys(("log", "ln"), (lambda n: n, lambda v: v <= 0)),
    **dict.fromkeys(("asin", "acos"), (lambda n: n, lambda v: abs(v) > 1)),
}


def check_programs(subject: Subject) -> Iterator[Finding]:
    """Every calculator, those inside of others by themselves."""
    unsound: set[int] = set()
    # The innermost come first: what holds an unsound program cannot be checked as a whole.
    for element in reversed([e for e in subject.elements() if isinstance(e.record, Calculator)]):
        calculator = element.record
        if any(id(inner) in unsound for inner in _calculators(calculator)):
            unsound.add(id(calculator))
            continue
        try:
            verify(
                calculator.program, calculator.inputs, calculator.outputs, calculator.elements,
                where=element.place.text,
            )  # fmt: skip
        except (ProfileError, LimitError) as error:
            unsound.add(id(calculator))
            yield _refused(element, error)
        else:
            flow = Flow(calculator.program, calculator.elements)
            yield from _use(element, flow)
            yield from _variables(element, flow)
            for block in flow.blocks:
                yield from _literals(element, block)
                yield from _portable(element, block)


def _calculators(calculator: Calculator) -> Iterator[Any]:
    """The calculators directly inside one."""
    for element in calculator.elements:
        if isinstance(element, CurveSet):
            yield from (c.calculator for c in element.curves if isinstance(c, SampledCalculatorCurve))
        else:
            yield element


def _refused(element: Located, error: Exception) -> Finding:
    message = str(error).removeprefix(f"{element.place.text}: ")
    operation = _OPERATION.search(message)
    place = element.operation(int(operation[1])) if operation else element.place
    return finding("TAG-002" if isinstance(error, LimitError) else "PRG-001", place, message)


def _use(element: Located, flow: Flow) -> Iterator[Finding]:
    """Channels, temporaries and sub-elements that are not used, or not on every path."""
    calculator = element.record
    unread = ~flow.inputs & _all(calculator.inputs)
    if unread:
        yield finding("PRG-006", element.place, f"input channels {_listed(unread)} are never read")
    unwritten = ~flow.end.outputs & _all(calculator.outputs)
    never = unwritten & ~flow.outputs
    if never:
        message = f"output channels {_listed(never)} are never written, and stay 0 here"
        yield finding("PRG-007", element.place, message)
    if unwritten & flow.outputs:
        channels = _listed(unwritten & flow.outputs)
        message = f"output channels {channels} are not written on every path, and stay 0 here"
        yield finding("PRG-007", element.place, message)
    if flow.early_reads:
        first = min(flow.early_reads)
        message = (
            f"op {first} ({written(calculator.program[first])}), the first of {len(flow.early_reads)}: "
            f"temporaries {_listed(flow.too_early)} are read where a path has not written them; 0 here"
        )
        yield finding("PRG-008", element.operation(first), message)
    if flow.end.depth:
        yield finding("PRG-010", element.place, f"found up to {flow.end.depth} values left, expected none")
    unused = ((1 << len(calculator.elements)) - 1) & ~sum(1 << i for i in flow.elements)
    if unused:
        yield finding("PRG-011", element.place, f"sub-elements {_listed(unused)} are never applied")


def _all(count: int) -> Slots:
    return (1 << count) - 1


def _listed(slots: Slots) -> str:
    found = indices(slots)
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return ", ".join(map(str, found[:_SHOWN])) + more


def _variables(element: Located, flow: Flow) -> Iterator[Finding]:
    for name, position in flow.variables.items():
        place = element.operation(position)
        said = f"op {position} (env({name})): "
        if name in FIXED:
            yield finding("PRG-003", place, f"{said}{FIXED[name]}")
        elif not (name.isascii() and name.isprintable() and name):
            message = f"op {position}: found the name {name!r}, expected printable ASCII"
            yield finding("PRG-005", place, message)
        else:
            known = nearest_variable(name)
            if known is not None:
                yield finding("PRG-004", place, f"{said}did you mean {known!r}?")


def _literals(element: Located, block: Block) -> Iterator[Finding]:
    """Operations that follow directly after the literals that make them fail."""
    literals: list[Step] = []
    for step in block:
        op = step.op
        if op.name == "data":
            literals.append(step)
            continue
        if op.name in _FAULTS and literals:
            count, wrong = _FAULTS[op.name]
            bad = [one for one in literals[-count(op.s + 1) :] if wrong(one.op.value)]
            if bad:
                message = f"op {step.position} ({written(op)}): takes the literal {written(bad[0].op)}"
                yield finding("PRG-009", element.operation(step.position), message)
        literals = []


def _portable(element: Located, block: Block) -> Iterator[Finding]:
    """What the reference implementation refuses or computes in another way."""
    for step in block:
        op, place = step.op, element.operation(step.position)
        if op.name in _LATER:
            message = f"op {step.position}: found {op.name}: {OPERATORS[op.name].text}"
            yield finding("REF-001", place, message)
        elif op.name == "solv" and (op.s, op.t) != (2, 2):
            message = f"op {step.position}: found {written(op)}, expected solv(3,3)"
            yield finding("REF-002", place, message)
    if not block or not block[-1].branches:
        return
    last = block[-1]
    # The empty block of an `if` without `else` is harmless.
    final = last.branches[-1] if last.otherwise is None and last.op.name == "sel" else last.otherwise
    if final is not None and not final:
        place = element.operation(last.position)
        yield finding("REF-003", place, f"op {last.position}: the last block of {last.op.name!r} is empty")
