"""Checks of the private tag that says what programs are compiled from: it must not have become stale."""

from __future__ import annotations

from collections.abc import Iterator

from iccbrdf.calc.program import Program
from iccbrdf.errors import IccBrdfError, LimitError, ProfileError
from iccbrdf.icc.layout import shown
from iccbrdf.icc.source_tag import SIGNATURE, CalculatorSource, read_source
from iccbrdf.validate.findings import Finding, finding
from iccbrdf.validate.subject import Subject


def check_source(subject: Subject) -> Iterator[Finding]:
    """Compile each program anew and compare."""
    values = {tag.signature: tag.value for tag in subject.tags.values() if tag.value is not None}
    if SIGNATURE not in values:
        return
    place = subject.place(SIGNATURE)
    try:
        source = read_source(values)
    except (ProfileError, LimitError) as error:
        yield finding("SRC-001", place, str(error))
        return
    elements = {id(one): element for element, one in source.found_in(values)}
    for calculator in source.calculators:
        element = elements.get(id(calculator))
        where = f"tag {shown(calculator.tag)}, element {calculator.element}"
        if element is None:
            message = "found no calculator there with as many channels as the source has names"
        else:
            message = _difference(calculator, element.program) if calculator.templates else ""
        if message:
            yield finding("SRC-002", place, f"{where}: {message}")


def _difference(calculator: CalculatorSource, program: Program) -> str:
    """How what the source compiles to differs from the program; empty where it does not."""
    # The compiler has a grammar to load, which few profiles need.
    from iccbrdf.build.source import recompiled

    try:
        compiled = recompiled(calculator)
    except IccBrdfError as error:
        return f"the source does not compile: {error}"
    if compiled.program != program:
        return (
            f"the source compiles to another program, of {len(compiled.program)} operations, found "
            f"{len(program)}: one of them was changed, or another version of this library made it"
        )
    for what in ("inputs", "outputs", "temporaries"):
        if getattr(calculator, what) != getattr(compiled, what):
            return f"the names of its {what} are not those of the source"
    return ""
