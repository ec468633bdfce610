"""Syntax tree to graph: what templates declare, and the statements that the build's switches choose.

Several templates make one graph, as a chain: an input reads what an earlier template has written to the
channel of that name, or else the program's own input of that name, which all templates share.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.calc.expressions import Expressions, Named, Rows, bind
from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.source import (
    Choice,
    Constant,
    Def,
    Effect,
    Input,
    Let,
    Model,
    Output,
    Runtime,
    Statement,
    Table,
    Template,
    Variable,
    When,
)
from iccbrdf.errors import InputError, nearest

RESERVED_VARIABLES = ("true", "ndef")
"""Names of run-time variables that ICC.2 gives a fixed meaning."""


Setting: TypeAlias = tuple[float, ...] | tuple[tuple[float, ...], ...] | str
"""Numbers of a constant, rows of a table, or the name that a choice has."""


@dataclass
class Lowered:
    """Templates as a graph, and what they declare; `outputs` are the last one's."""

    models: list[str] = field(default_factory=list)
    graph: Graph = field(default_factory=Graph)
    inputs: list[str] = field(default_factory=list)
    defaults: list[float] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)
    variables: dict[str, float] = field(default_factory=dict)
    constants: dict[str, Setting] = field(default_factory=dict)
    effects: dict[str, bool] = field(default_factory=dict)
    channels: dict[str, Node] = field(default_factory=dict)
    """What each channel holds after the last template."""


@dataclass(frozen=True)
class Settings:
    """What the build sets.

    constants: values that replace the defaults of constants (numbers, one or as many as the default has), the
        numbers of tables, and the names of choices.
    effects: switches that differ from the template's own settings.
    variables: values of run-time variables where they are undefined, which replace the defaults.
    """

    constants: Mapping[str, ArrayLike] = field(default_factory=dict)
    effects: Mapping[str, bool] = field(default_factory=dict)
    variables: Mapping[str, float] = field(default_factory=dict)


def lower(templates: Sequence[Template], settings: Settings) -> Lowered:
    """
    Return the graph of a chain of templates.

    Raises
    ------
    InputError
        Settings that no template declares, names that are not declared, widths that do not fit, at their
        place in the template.
    """
    _check_settings(templates, settings)
    result = Lowered()
    for template in templates:
        _Lowering(template, settings, result).run()
    return result


def _check_settings(templates: Sequence[Template], settings: Settings) -> None:
    """Settings may name what an inactive `when` declares, so look at all statements."""
    statements = [statement for template in templates for statement in template.all_statements()]
    constants = [s.name for s in statements if isinstance(s, Constant | Table | Choice)]
    effects = [s.name for s in statements if isinstance(s, Effect)]
    variables = [v.name for s in statements if isinstance(s, Runtime) for v in s.variables]
    given: tuple[tuple[str, Mapping[str, Any], list[str]], ...] = (
        ("constant", settings.constants, constants),
        ("effect", settings.effects, effects),
        ("run-time variable", settings.variables, variables),
    )
    for what, names, declared in given:
        for name in names:
            if name not in declared:
                where = ", ".join(template.filename for template in templates)
                raise InputError(f"{where}: no {what} {name!r} is declared; {nearest(name, declared)}")


def _numbers(given: ArrayLike, dimensions: int) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """A setting as numbers that float32 can hold, 0 dimensions taken for 1; None if it is anything else."""
    try:
        values = np.asarray(given).astype(np.float64, casting="safe")
    except (TypeError, ValueError):
        return None
    if values.ndim == 0:
        values = values[np.newaxis]
    fits = values.ndim == dimensions and values.size and np.all(np.abs(values) <= np.finfo(np.float32).max)
    return values if fits else None


class _Lowering:
    """One template of the chain, whose graph and declarations go to `result`."""

    def __init__(self, template: Template, settings: Settings, result: Lowered) -> None:
        self._template = template
        self._constants = settings.constants
        self._effects = settings.effects
        self._variables = settings.variables
        self._result = result
        self._graph = result.graph
        self._expressions = Expressions(result.graph)
        self._globals: dict[str, Named] = {"pi": self._graph.const(math.pi)}
        self._read: set[str] = set()
        self._written: dict[str, Node] = {}
        self._declared_variables: set[str] = set()
        self._sizes: dict[str, tuple[int, str]] = {}

    def run(self) -> None:
        models = len(self._result.models)
        outputs: list[Node] = []
        for statement in self._chosen(self._template.statements):
            if isinstance(statement, Output):
                outputs.append(self._output(statement))
            else:
                self._declare(statement)
        if not outputs:
            raise InputError(f"{self._template.filename}: no output; expected `output X Y Z = ...`")
        if len(self._result.models) == models:
            raise InputError(f"{self._template.filename}: no name; expected `model NAME`")
        self._result.channels |= self._written
        self._result.outputs = list(self._written)
        self._graph.outputs = tuple(outputs)

    # What the build sets -------------------------------------------------------------------------------

    def _chosen(self, statements: Sequence[Statement]) -> list[Statement]:
        """Declares switches and choices on the way and replaces each `when` by the side it chooses."""
        chosen: list[Statement] = []
        for statement in statements:
            if isinstance(statement, Effect):
                on = bool(self._effects.get(statement.name, statement.on))
                self._result.effects[statement.name] = on
            elif isinstance(statement, Choice):
                self._result.constants[statement.name] = self._choice(statement)
            elif isinstance(statement, When):
                side = statement.then if self._holds(statement) else statement.otherwise
                chosen.extend(self._chosen(side))
            else:
                chosen.append(statement)
        return chosen

    def _choice(self, choice: Choice) -> str:
        value = self._constants.get(choice.name, choice.values[0])
        if value not in choice.values:
            raise choice.place.error(f"{choice.name} is {value!r}; {nearest(str(value), choice.values)}")
        return str(value)

    def _holds(self, when: When) -> bool:
        if when.value is None:
            effects = self._result.effects
            if when.name not in effects:
                raise when.place.error(f"no effect {when.name!r} is declared; {nearest(when.name, effects)}")
            return effects[when.name]
        choices = {s.name: s.values for s in self._template.all_statements() if isinstance(s, Choice)}
        if when.name not in self._result.constants or when.name not in choices:
            raise when.place.error(f"no choice {when.name!r} is declared; {nearest(when.name, choices)}")
        if when.value not in choices[when.name]:
            hint = nearest(when.value, choices[when.name])
            raise when.place.error(f"{when.name} is never {when.value!r}; {hint}")
        return self._result.constants[when.name] == when.value

    # Statements ----------------------------------------------------------------------------------------

    def _declare(self, statement: Statement) -> None:
        if isinstance(statement, Model):
            self._result.models.append(statement.name)
        elif isinstance(statement, Input):
            bind(self._globals, statement.place, statement.name, self._input(statement))
        elif isinstance(statement, Runtime):
            variables = [self._variable(variable) for variable in statement.variables]
            value = variables[0] if len(variables) == 1 else self._graph.pack(variables)
            bind(self._globals, statement.place, statement.name, value)
        elif isinstance(statement, Constant):
            bind(self._globals, statement.place, statement.name, self._constant(statement))
        elif isinstance(statement, Table):
            bind(self._globals, statement.place, statement.name, self._table(statement))
        elif isinstance(statement, Let):
            self._expressions.let(statement, self._globals)
        elif isinstance(statement, Def):
            self._expressions.define(statement, self._globals)

    def _input(self, declared: Input) -> Node:
        default = (0.0,) * declared.width
        if declared.default is not None:
            default = self._expressions.known(
                declared.default, self._globals, f"the default of {declared.name}"
            )
        if len(default) not in (1, declared.width):
            found = f"the default of {declared.name} has {len(default)} components"
            raise declared.place.error(f"{found}, expected 1 or {declared.width}")
        if _numbers(default, 1) is None:
            raise declared.place.error(
                f"the default of {declared.name} is {default}; expected finite numbers (float32)"
            )
        for channel in declared.channels:
            if channel in self._read:
                raise declared.place.error(f"channel {channel!r} is read by an input already")
        self._read.update(declared.channels)
        parts = []
        for channel, value in zip(declared.channels, default * (declared.width // len(default)), strict=True):
            if channel not in self._result.channels:
                self._result.channels[channel] = self._graph.input(len(self._result.inputs))
                self._result.inputs.append(channel)
                self._result.defaults.append(value)
            parts.append(self._result.channels[channel])
        return parts[0] if len(parts) == 1 else self._graph.pack(parts)

    def _variable(self, declared: Variable) -> Node:
        name = declared.name
        if len(name) > 4 or name in RESERVED_VARIABLES:
            raise declared.place.error(
                f"{name!r} cannot be a run-time variable; expected at most 4 characters and none of "
                + ", ".join(RESERVED_VARIABLES)
            )
        if name in self._declared_variables:
            raise declared.place.error(f"run-time variable {name!r} is declared already")
        self._declared_variables.add(name)
        default = self._expressions.known(declared.default, self._globals, f"the default of {name}")
        if len(default) != 1:
            raise declared.place.error(f"the default of {name} has {len(default)} components, expected 1")
        found = self._variables.get(name, default[0])
        given = _numbers(found, 1)
        if given is None or len(given) != 1:
            raise declared.place.error(f"{name} is {found!r}; expected 1 finite number (float32)")
        self._result.variables[name] = float(given[0])
        return self._called(name, self._graph.env(name, float(given[0])))

    def _constant(self, declared: Constant) -> Node:
        name = declared.name
        values = self._expressions.known(declared.default, self._globals, f"the constant {name}")
        if name in self._constants:
            given = _numbers(self._constants[name], 1)
            if given is None or len(given) != len(values):
                found = self._constants[name]
                expected = f"{len(values)} finite number(s) (float32)"
                raise declared.place.error(f"{name} is {found!r}; expected {expected}")
            values = tuple(given.tolist())
        self._result.constants[name] = values
        return self._called(name, self._graph.const(*values))

    def _table(self, declared: Table) -> Named:
        name, dimensions = declared.name, len(declared.sizes)
        shape = ", ".join(declared.sizes)
        if name not in self._constants:
            raise declared.place.error(f"{name} is not given; expected finite numbers of shape ({shape})")
        values = _numbers(self._constants[name], dimensions)
        if values is None:
            found = self._constants[name]
            raise declared.place.error(f"{name} is {found!r}; expected finite numbers of shape ({shape})")
        for size, length in zip(declared.sizes, values.shape, strict=True):
            self._check_size(declared, size, length)
        if dimensions == 1:
            self._result.constants[name] = tuple(values.tolist())
            return self._called(name, self._graph.const(*values))
        rows = tuple(map(tuple, values.tolist()))
        self._result.constants[name] = rows
        return Rows(rows)

    def _called(self, name: str, node: Node) -> Node:
        """The node, whose name is known from here on."""
        self._graph.names.setdefault(node, name)
        return node

    def _check_size(self, table: Table, size: str, length: int) -> None:
        """Bind the name of a size to the first length that has it."""
        if size.isdigit():
            expected, reason = int(size), ""
        elif size in self._sizes:
            expected, other = self._sizes[size]
            reason = f", as {other} has"
        else:
            bind(self._globals, table.place, size, self._graph.const(length))
            self._sizes[size] = length, table.name
            return
        if length != expected:
            what = "rows" if size == table.sizes[0] else "columns"
            raise table.place.error(f"{table.name} has {length} {what}, expected {expected}{reason}")

    def _output(self, output: Output) -> Node:
        for index, channel in enumerate(output.channels):
            if channel in self._written or channel in output.channels[:index]:
                raise output.place.error(f"channel {channel!r} is written by an output already")
        value = self._expressions.value(output.value, self._globals)
        value = self._expressions.widen(value, len(output.channels), output.place)
        for index, channel in enumerate(output.channels):
            self._written[channel] = self._graph.pick(value, index)
        return value
