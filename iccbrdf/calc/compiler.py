"""From the text of a template to a verified calculator program: source, lower, passes, emit, verify."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from iccbrdf.calc.emit import emit
from iccbrdf.calc.graph import Graph
from iccbrdf.calc.lower import Setting, Settings, lower
from iccbrdf.calc.passes import Report, optimise
from iccbrdf.calc.program import Program, Temporary
from iccbrdf.calc.source import parse
from iccbrdf.calc.verify import verify
from iccbrdf.errors import InputError, LimitError

MAX_TEMPLATES = 16
"""In a chain."""

MAX_NODES = 1 << 14
"""Values that a program computes; the time that they take to compile grows with their square."""


@dataclass(frozen=True)
class Compiled:
    """
    A compiled template, or a chain of them.

    model: its name, or their names.  documentation: the comment at the head.
    program: the operators; none but those that every implementation of ICC.2 has.
    inputs, outputs: channel names in order.  defaults: one number for each input, what a print that lacks
        the channel has.
    variables: run-time (CMM environment) variables and the value of each where it is undefined.
    constants: compile-time constants (tuples of numbers, tables of rows as tuples of them) and choices
        (names) as they were used.
    effects: all switches of the template, on or off.
    templates: text and filename of each; with constants, effects and variables they give the same program.
    temporaries: the names that the templates give to values which the program stores.
    executed: operators on the longest path for one pixel, every 8-byte operator counted.
    graph: what the program computes.  report: what each pass did.
    """

    model: str
    documentation: str
    program: Program
    inputs: tuple[str, ...]
    defaults: tuple[float, ...]
    outputs: tuple[str, ...]
    variables: Mapping[str, float]
    constants: Mapping[str, Setting]
    effects: Mapping[str, bool]
    templates: tuple[tuple[str, str], ...]
    temporaries: tuple[Temporary, ...]
    executed: int
    graph: Graph
    report: tuple[Report, ...]


def compile_template(
    text: str,
    *,
    filename: str,
    constants: Mapping[str, ArrayLike] | None = None,
    effects: Mapping[str, bool] | None = None,
    variables: Mapping[str, float] | None = None,
) -> Compiled:
    """
    Compile a template.

    Parameters
    ----------
    text
        The template; the language is described in iccbrdf.calc.source and iccbrdf.calc.expressions.
    filename
        For messages.
    constants
        Constants (a number, or as many as the default has) and choices (a name) that differ from the
        template's defaults, and all its tables (numbers of shape (rows,) or (rows, columns)).  Folded in
        float64, rounded to float32 once, where they are written.
    effects
        Switches that differ from the template's defaults.
    variables
        Values of run-time variables where the environment does not define them, instead of the
        template's defaults.

    Raises
    ------
    InputError
        An error in the template at file:line:column, a table that is not given, or a constant, choice,
        effect or run-time variable that it does not declare, with the nearest that it does.
    LimitError
        It asks for more values than a program of ours could need.
    """
    return compile_chain([(text, filename)], constants=constants, effects=effects, variables=variables)


def compile_chain(
    templates: Sequence[tuple[str, str]],
    *,
    constants: Mapping[str, ArrayLike] | None = None,
    effects: Mapping[str, bool] | None = None,
    variables: Mapping[str, float] | None = None,
) -> Compiled:
    """
    Compile templates that work one after the other into one program.

    An input of a template is what an earlier template has written to the channel of that name, or else the
    program's input of that name; what no earlier template reads or writes thus passes by it.  The program
    gives the outputs of the last template.

    Parameters
    ----------
    templates
        Text and filename of each.
    constants, effects, variables
        As of `compile_template`; each goes to all templates that declare it.

    Raises
    ------
    InputError
        As `compile_template`, or no template.
    LimitError
        More than MAX_TEMPLATES templates, or more values than a program of ours could need.
    """
    if not templates:
        raise InputError("found no template to compile, expected one or more")
    if len(templates) > MAX_TEMPLATES:
        raise LimitError(f"found a chain of {len(templates)} templates, expected {MAX_TEMPLATES} at most")
    filenames = ", ".join(filename for _, filename in templates)
    try:
        parsed = [parse(text, filename) for text, filename in templates]
        lowered = lower(parsed, Settings(constants or {}, effects or {}, variables or {}))
        graph, report = optimise(lowered.graph)
        if len(graph.nodes) > MAX_NODES:
            raise LimitError(f"{filenames}: found {len(graph.nodes)} values, expected {MAX_NODES} at most")
        program, temporaries = emit(graph)
    except RecursionError:
        raise InputError(f"{filenames}: expressions are nested too deeply; use `let` for parts") from None
    checked = verify(program, len(lowered.inputs), len(lowered.outputs), where=filenames)
    return Compiled(
        model=" ".join(lowered.models),
        documentation="\n\n".join(template.documentation for template in parsed),
        program=program,
        inputs=tuple(lowered.inputs),
        defaults=tuple(lowered.defaults),
        outputs=tuple(lowered.outputs),
        variables=lowered.variables,
        constants=lowered.constants,
        effects=lowered.effects,
        templates=tuple(templates),
        temporaries=temporaries,
        executed=checked.executed,
        graph=graph,
        report=report,
    )
