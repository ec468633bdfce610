"""Refuse a broken program before any pixel is touched, and measure a sound one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

from iccbrdf.calc.appearance import check_conditions
from iccbrdf.calc.operators import OPERATORS, Element, Operand, stack_effect
from iccbrdf.calc.program import MAX_NESTING, Block, Program, Step, nest, signature_name, written
from iccbrdf.calc.work import branch_work, element_work, operation_work
from iccbrdf.errors import LimitError, ProfileError, nearest

MAX_DEPTH = 65535
"""Stack entries (ICC.2)."""
MAX_TEMPORARIES = 65536
"""Temporary channels (ICC.2)."""
MAX_CALCULATORS = 32
"""Calculators inside calculators."""
MAX_EXECUTED = 1 << 24
"""Operations for one pixel: calculators that apply others twice could ask for 2^32 from a small file."""
MAX_WORK = 1 << 25
"""The same of numbers: one operation may add up 65,535."""
MAX_SAMPLES = 1 << 20
"""Samples of a calculator curve, whose stored size may be anything."""
MAX_SAMPLING = 1 << 28
"""Work of a calculator curve's program for all its samples."""


@dataclass(frozen=True)
class Checked:
    """What a sound program needs; the calculators among its sub-elements included.

    operations: 8-byte operations stored.
    executed: operations on the longest path.  Each one stepped on counts: `if` with its `else`, `sel`
        with all its `case` and `dflt`, and those of an applied calculator besides the one that applies it.
    work: the same, where an operation counts once for each number, and elements by theirs (calc/work.py).
    max_depth: entries of the deepest stack.  temporaries: highest temporary slot used, plus 1.
    environment: names of the run-time variables that are read.
    nesting: blocks and calculators inside each other.
    """

    operations: int
    executed: int
    work: int
    max_depth: int
    temporaries: int
    environment: frozenset[str]
    nesting: int


def verify(
    program: Program,
    n_in: int,
    n_out: int,
    elements: Sequence[Element] = (),
    *,
    where: str = "calculator",
) -> Checked:
    """Check a program with n_in input and n_out output channels, and all calculators in its sub-elements.

    Refused are unknown operators; stack underflow on any path, and more than 65535 entries; channels,
    temporaries and sub-elements out of range or of the wrong kind; broken blocks; an empty program.
    `where` names the program's place for messages.

    Raises ProfileError (operation, what was found, what was expected), and LimitError for nesting, running
    time and curve samples beyond MAX_NESTING, MAX_CALCULATORS, MAX_EXECUTED, MAX_WORK, MAX_SAMPLES and
    MAX_SAMPLING.
    """
    return _verify(program, n_in, n_out, elements, where, 0, {})


def verify_element(element: Element, *, where: str = "element") -> tuple[Checked, ...]:
    """Check the calculators that a processing element is or holds; the results, none for most elements.

    Viewing conditions of the appearance model are checked too.
    """
    return _verify_element(element, where, 0, {}).programs


@dataclass(frozen=True)
class _Inner:
    """What is known of an element: its calculators one by one, and what applying it comes to."""

    programs: tuple[Checked, ...]
    executed: int
    work: int
    nesting: int


# Elements that are checked already, by id: a file may share one a thousand times.
_Known: TypeAlias = dict[int, _Inner]


def _verify_element(element: Element, where: str, level: int, known: _Known) -> _Inner:
    if id(element) not in known:
        if element.signature in ("XtoJ", "JtoX"):
            check_conditions(element, where)
        programs = tuple(
            _verify(c.program, c.inputs, c.outputs, c.elements, where, level, known)
            for c in _calculators(element, where)
        )
        _check_sampling(element, programs, where)
        known[id(element)] = _Inner(
            programs,
            executed=sum(checked.executed for checked in programs),
            work=element_work(element, [checked.work for checked in programs]),
            nesting=max((checked.nesting for checked in programs), default=-1),
        )
    return known[id(element)]


def _check_sampling(element: Any, programs: Sequence[Checked], where: str) -> None:
    if element.signature == "calc":
        return
    for curve, checked in zip(_calculator_curves(element), programs, strict=True):
        if curve.size * checked.work > MAX_SAMPLING:
            raise LimitError(
                f"{where}: {curve.size} samples of a curve by a program of {checked.work} operations, "
                f"expected at most {MAX_SAMPLING} in all"
            )


def _calculator_curves(element: Any) -> list[Any]:
    if element.signature not in ("cvst", "tmap"):
        return []
    held = element.curves if element.signature == "cvst" else [element.luminance]
    return [curve for curve in held if curve.signature == "clcf"]


def _calculators(element: Any, where: str) -> list[Any]:
    """The calculators that an element is or holds."""
    if element.signature == "calc":
        return [element]
    curves = _calculator_curves(element)
    for curve in curves:
        if curve.size > MAX_SAMPLES:
            raise LimitError(f"{where}: {curve.size} samples of a curve, expected at most {MAX_SAMPLES}")
    return [curve.calculator for curve in curves]


def _verify(
    program: Program,
    n_in: int,
    n_out: int,
    elements: Sequence[Element],
    where: str,
    level: int,
    known: _Known,
) -> Checked:
    if level > MAX_CALCULATORS:
        raise LimitError(f"{where}: calculators are nested more than {MAX_CALCULATORS} deep")
    if not program:
        raise ProfileError(f"{where}: the program is empty, expected at least one operation")
    inner = [
        _verify_element(element, f"{where}, sub-element {index}", level + 1, known)
        for index, element in enumerate(elements)
    ]
    walk = _Walk(where, n_in, n_out, elements, inner)
    path = walk.block(nest(program, where), _Path(), 0)
    nested = [checked for result in inner for checked in result.programs]
    return Checked(
        operations=len(program) + sum(checked.operations for checked in nested),
        executed=path.executed,
        work=path.work,
        max_depth=max([walk.max_depth, *(checked.max_depth for checked in nested)]),
        temporaries=max([walk.temporaries, *(checked.temporaries for checked in nested)]),
        environment=frozenset(walk.environment).union(*(checked.environment for checked in nested)),
        nesting=walk.nesting,
    )


class _Path(NamedTuple):
    """The paths to a point of the program: least and greatest depth of the stack, most operations, work."""

    least: int = 0
    greatest: int = 0
    executed: int = 0
    work: int = 0


class _Walk:
    """One pass over the blocks of a program, with what it has found so far."""

    def __init__(
        self,
        where: str,
        n_in: int,
        n_out: int,
        elements: Sequence[Element],
        inner: Sequence[_Inner],
    ) -> None:
        self.where = where
        self.elements = elements
        self.inner = inner
        # What a range of indices may reach, and what it is a range of.
        channels = {"in": (n_in, "input channels"), "out": (n_out, "output channels")}
        temporaries = (MAX_TEMPORARIES, "temporaries")
        self.ranges = channels | dict.fromkeys(("tget", "tput", "tsav"), temporaries)
        self.max_depth = 0
        self.temporaries = 0
        self.environment: set[str] = set()
        self.nesting = 0

    def error(self, step: Step, message: str) -> ProfileError:
        return ProfileError(f"{self.where}: op {step.position} ({written(step.op)}): {message}")

    def block(self, block: Block, path: _Path, level: int) -> _Path:
        self.nest(level)
        for step in block:
            path = self.step(step, path, level)
            if path.executed > MAX_EXECUTED:
                raise LimitError(
                    f"{self.where}: a pixel may execute more than {MAX_EXECUTED} operations"
                    f" by op {step.position}"
                )
            if path.work > MAX_WORK:
                raise LimitError(
                    f"{self.where}: a pixel may take operations on more than {MAX_WORK} numbers"
                    f" by op {step.position}"
                )
        return path

    def step(self, step: Step, path: _Path, level: int) -> _Path:
        op = step.op
        operator = OPERATORS.get(op.name)
        if operator is None:
            hint = nearest(op.name, OPERATORS)
            raise ProfileError(f"{self.where}: op {step.position}: no operator {op.name!r}: {hint}")
        executed, work = path.executed + step.heads, path.work + step.heads - 1
        if operator.operand is Operand.RANGE:
            self.range(step)
        elif operator.operand is Operand.SIGNATURE:
            self.environment.add(signature_name(op.operand))
        elif operator.operand is Operand.ELEMENT:
            inner = self.element(step, operator.accepts, level)
            executed, work = executed + inner.executed, work + inner.work
        pops, pushes = stack_effect(operator, op.s, op.t, self.elements)
        if pops > path.least:
            raise self.error(step, f"stack underflow: found {path.least} entries, expected {pops}")
        change = pushes - pops
        work += operation_work(op, pops, pushes)
        path = _Path(path.least + change, path.greatest + change, executed, work)
        if path.greatest > MAX_DEPTH:
            found = f"found {path.greatest} entries, expected at most {MAX_DEPTH}"
            raise self.error(step, f"stack overflow: {found}")
        self.max_depth = max(self.max_depth, path.greatest)
        if not step.branches:
            return path
        blocks = [*step.branches, step.otherwise or ()]
        carried = path.greatest + self.temporaries + self.ranges["out"][0]
        path = path._replace(work=path.work + branch_work(len(blocks), carried))
        ends = [self.block(block, path, level + 1) for block in blocks]
        return _Path(
            min(end.least for end in ends),
            max(end.greatest for end in ends),
            max(end.executed for end in ends),
            max(end.work for end in ends),
        )

    def range(self, step: Step) -> None:
        size, what = self.ranges[step.op.name]
        end = step.op.s + step.op.t + 1
        if end > size:
            raise self.error(step, f"reaches {what} up to {end - 1}, expected less than {size}")
        if what == "temporaries":
            self.temporaries = max(self.temporaries, end)

    def element(self, step: Step, accepts: tuple[str, ...], level: int) -> _Inner:
        """Check an operation that applies a sub-element, and give what is known of it."""
        index = step.op.s
        if index >= len(self.elements):
            raise self.error(step, f"sub-element {index}, expected less than {len(self.elements)}")
        found = self.elements[index].signature
        if accepts and found not in accepts:
            raise self.error(step, f"sub-element {index} is {found!r}, expected {' or '.join(accepts)}")
        self.nest(level + 1 + self.inner[index].nesting)
        return self.inner[index]

    def nest(self, level: int) -> None:
        self.nesting = max(self.nesting, level)
        if level > MAX_NESTING:
            raise LimitError(f"{self.where}: blocks and calculators are nested more than {MAX_NESTING} deep")
