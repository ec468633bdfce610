"""Syntax tree to graph: names, widths, functions, and the statements that the build's switches choose.

Functions of the language, element by element unless said, scalars going with vectors of any length:
`abs sign sqrt cbrt exp log log10 floor ceil trunc round sin cos tan asin acos atan` of one value;
`pow mod min max atan2(y, x)` of two, `clamp(x, low, high)`; of one vector to a scalar `sum product min max`
and `norm`; `dot(a, b)`, `cross(a, b)`, `normalize(v)` (a vector of no length becomes 0) and
`rotl(v, k)` (the components rotated, component k first).  Angles are in radians, `log` is natural,
conditions are 1 and 0, and `pi` is a name that is always there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.passes import optimise
from iccbrdf.calc.source import (
    Block,
    Call,
    Choice,
    Component,
    Conditional,
    Constant,
    Def,
    Effect,
    Expression,
    Input,
    Let,
    Model,
    Name,
    Number,
    Output,
    Place,
    Runtime,
    Statement,
    Template,
    Variable,
    Vector,
    When,
)
from iccbrdf.errors import InputError, nearest

TINY = 1e-37
"""What `normalize` adds to a squared length, so that a vector of no length becomes 0 and not NaN.

Above the smallest normal float32, and far below the square of any length that a direction has.
"""

RESERVED_VARIABLES = ("true", "ndef")
"""Names of run-time variables that ICC.2 gives a fixed meaning."""

_COMPONENTS = {"x": 0, "y": 1, "z": 2, "X": 0, "Y": 1, "Z": 2}

_EACH = {
    "neg": "neg", "not": "not", "abs": "abs", "sign": "sign", "sqrt": "sqrt", "cbrt": "cbrt", "exp": "exp",
    "log": "ln", "log10": "log", "floor": "flor", "ceil": "ceil", "trunc": "trnc", "round": "rond",
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan",
    "+": "add", "-": "sub", "*": "mul", "/": "div", "^": "pow", "pow": "pow", "mod": "mod",
    "<": "lt", "<=": "le", "==": "eq", "!=": "neq", ">=": "ge", ">": "gt", "and": "vand", "or": "vor",
}  # fmt: skip
"""Functions and operators of the language that are one operator of the calculator."""


@dataclass
class Lowered:
    """A template as a graph, and what it declares."""

    model: str = ""
    graph: Graph = field(default_factory=Graph)
    inputs: list[str] = field(default_factory=list)
    defaults: list[float] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)
    variables: dict[str, float] = field(default_factory=dict)
    constants: dict[str, tuple[float, ...] | str] = field(default_factory=dict)
    effects: dict[str, bool] = field(default_factory=dict)


def lower(
    template: Template,
    constants: Mapping[str, float | Sequence[float] | str],
    effects: Mapping[str, bool],
    variables: Mapping[str, float],
) -> Lowered:
    """
    Return the graph of a template.

    Parameters
    ----------
    template
        The syntax tree.
    constants
        Values that replace the defaults of constants (numbers, one or as many as the default has) and of
        choices (names).
    effects
        Switches that differ from the template's own settings.
    variables
        Values of run-time variables where they are undefined, which replace the defaults.

    Raises
    ------
    InputError
        Names that are not declared, widths that do not fit, at their place in the template.
    """
    return _Lowering(template, constants, effects, variables).run()


@dataclass(frozen=True)
class _Function:
    """A function of the template, with the names it saw when it was defined."""

    definition: Def
    names: dict[str, Node]


def _numbers(given: float | Sequence[float] | str) -> tuple[float, ...] | None:
    """A setting as finite numbers; None if it is anything else."""
    try:
        values = np.atleast_1d(np.asarray(given)).astype(np.float64, casting="safe")
    except TypeError:
        return None
    return tuple(values.tolist()) if values.ndim == 1 and np.all(np.isfinite(values)) else None


class _Lowering:
    def __init__(
        self,
        template: Template,
        constants: Mapping[str, float | Sequence[float] | str],
        effects: Mapping[str, bool],
        variables: Mapping[str, float],
    ) -> None:
        self._template = template
        self._constants = constants
        self._effects = effects
        self._variables = variables
        self._result = Lowered()
        self._graph = self._result.graph
        self._globals: dict[str, Node] = {"pi": self._graph.const(math.pi)}
        self._functions: dict[str, _Function] = {}
        self._expanding: list[str] = []

    def run(self) -> Lowered:
        self._check_settings()
        outputs: list[Node] = []
        for statement in self._chosen(self._template.statements):
            if isinstance(statement, Output):
                outputs.append(self._output(statement))
            else:
                self._declare(statement)
        if not outputs:
            raise InputError(f"{self._template.filename}: no output; expected `output X Y Z = ...`")
        if not self._result.model:
            raise InputError(f"{self._template.filename}: no name; expected `model NAME`")
        self._graph.outputs = tuple(outputs)
        return self._result

    # What the build sets -------------------------------------------------------------------------------

    def _check_settings(self) -> None:
        """Settings may name what an inactive `when` declares, so look at all statements."""
        statements = list(self._template.all_statements())
        constants = [s.name for s in statements if isinstance(s, Constant | Choice)]
        effects = [s.name for s in statements if isinstance(s, Effect)]
        variables = [v.name for s in statements if isinstance(s, Runtime) for v in s.variables]
        settings = (
            ("constant", self._constants, constants),
            ("effect", self._effects, effects),
            ("run-time variable", self._variables, variables),
        )
        for what, given, declared in settings:
            for name in given:
                if name not in declared:
                    hint = nearest(name, declared)
                    raise InputError(f"{self._template.filename}: no {what} {name!r} is declared; {hint}")

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
            self._result.model = statement.name
        elif isinstance(statement, Input):
            self._bind(self._globals, statement.place, statement.name, self._input(statement))
        elif isinstance(statement, Runtime):
            variables = [self._variable(variable) for variable in statement.variables]
            value = variables[0] if len(variables) == 1 else self._graph.pack(variables)
            self._bind(self._globals, statement.place, statement.name, value)
        elif isinstance(statement, Constant):
            self._bind(self._globals, statement.place, statement.name, self._constant(statement))
        elif isinstance(statement, Let):
            value = self._value(statement.value, self._globals)
            self._bind(self._globals, statement.place, statement.name, value)
        elif isinstance(statement, Def):
            self._define(statement)

    def _bind(self, names: dict[str, Node], place: Place, name: str, value: Node) -> None:
        if name in names:
            raise place.error(f"{name!r} has a value already; a name stands for one value")
        names[name] = value

    def _input(self, declared: Input) -> Node:
        default = (0.0,) * declared.width
        if declared.default is not None:
            default = self._known(declared.default, f"the default of {declared.name}")
        if len(default) not in (1, declared.width):
            found = f"the default of {declared.name} has {len(default)} components"
            raise declared.place.error(f"{found}, expected 1 or {declared.width}")
        for channel in declared.channels:
            if channel in self._result.inputs:
                raise declared.place.error(f"channel {channel!r} is read by an input already")
        first = len(self._result.inputs)
        self._result.inputs.extend(declared.channels)
        self._result.defaults.extend(default * (declared.width // len(default)))
        return self._graph.input(first, declared.width)

    def _variable(self, declared: Variable) -> Node:
        name = declared.name
        if len(name) > 4 or name in RESERVED_VARIABLES:
            raise declared.place.error(
                f"{name!r} cannot be a run-time variable; expected at most 4 characters and none of "
                + ", ".join(RESERVED_VARIABLES)
            )
        if name in self._result.variables:
            raise declared.place.error(f"run-time variable {name!r} is declared already")
        default = self._known(declared.default, f"the default of {name}")
        if len(default) != 1:
            raise declared.place.error(f"the default of {name} has {len(default)} components, expected 1")
        given = _numbers(self._variables.get(name, default[0]))
        if given is None or len(given) != 1:
            raise declared.place.error(f"{name} is {self._variables[name]!r}; expected 1 finite number")
        self._result.variables[name] = given[0]
        return self._graph.env(name, given[0])

    def _constant(self, declared: Constant) -> Node:
        name = declared.name
        values = self._known(declared.default, f"the constant {name}")
        if name in self._constants:
            given = _numbers(self._constants[name])
            if given is None or len(given) != len(values):
                found = self._constants[name]
                raise declared.place.error(f"{name} is {found!r}; expected {len(values)} finite number(s)")
            values = given
        self._result.constants[name] = values
        return self._graph.const(*values)

    def _define(self, definition: Def) -> None:
        if definition.name in self._functions or definition.name in FUNCTIONS or definition.name in _EACH:
            raise definition.place.error(f"a function {definition.name!r} is there already")
        self._functions[definition.name] = _Function(definition, dict(self._globals))

    def _output(self, output: Output) -> Node:
        for channel in output.channels:
            if channel in self._result.outputs:
                raise output.place.error(f"channel {channel!r} is written by an output already")
        self._result.outputs.extend(output.channels)
        value = self._value(output.value, self._globals)
        return self._widen(value, len(output.channels), output.place)

    def _known(self, expression: Expression, what: str) -> tuple[float, ...]:
        """The numbers of an expression that the build already knows."""
        value = self._value(expression, self._globals)
        (folded,) = optimise(Graph(self._graph.nodes, (value,)))[0].outputs
        if folded.op != "const":
            raise expression.place.error(f"{what} depends on what only a run knows; expected constants")
        return tuple(folded.detail)

    # Expressions ---------------------------------------------------------------------------------------

    def _value(self, expression: Expression, names: dict[str, Node]) -> Node:
        if isinstance(expression, Number):
            return self._graph.const(expression.value)
        if isinstance(expression, Name):
            if expression.name not in names:
                hint = nearest(expression.name, names)
                raise expression.place.error(f"nothing is named {expression.name!r}; {hint}")
            return names[expression.name]
        if isinstance(expression, Vector):
            return self._graph.pack([self._value(part, names) for part in expression.parts])
        if isinstance(expression, Component):
            return self._component(expression, names)
        if isinstance(expression, Block):
            inner = dict(names)
            for let in expression.lets:
                self._bind(inner, let.place, let.name, self._value(let.value, inner))
            return self._value(expression.value, inner)
        if isinstance(expression, Conditional):
            return self._conditional(expression, names)
        return self._call(expression, names)

    def _component(self, component: Component, names: dict[str, Node]) -> Node:
        vector = self._value(component.vector, names)
        if component.name.isdigit():
            index = int(component.name)
        elif component.name in _COMPONENTS:
            index = _COMPONENTS[component.name]
        else:
            hint = nearest(component.name, _COMPONENTS)
            raise component.place.error(f"no component is named {component.name!r}; {hint}")
        if index >= vector.width:
            raise component.place.error(
                f"found component {component.name} of a value of {vector.width} component(s)"
            )
        return self._graph.pick(vector, index)

    def _conditional(self, conditional: Conditional, names: dict[str, Node]) -> Node:
        condition = self._value(conditional.condition, names)
        if condition.width != 1:
            raise conditional.condition.place.error(
                f"the condition has {condition.width} components, expected 1"
            )
        sides = [self._value(conditional.then, names), self._value(conditional.otherwise, names)]
        return self._graph.add("select", [condition, *self._alike(sides, conditional.place, "if")])

    def _call(self, call: Call, names: dict[str, Node]) -> Node:
        name = call.function
        arguments = [self._value(argument, names) for argument in call.arguments]
        if name in self._functions:
            return self._expanded(self._functions[name], call, arguments)
        if name in _EACH:
            count = 1 if name in _UNARY else 2
            self._expect_arguments(call, (count,))
            return self._graph.add(_EACH[name], self._alike(arguments, call.place, name))
        if name in FUNCTIONS:
            counts, build = FUNCTIONS[name]
            self._expect_arguments(call, counts)
            return build(self, call, arguments)
        known = [f for f in (*_EACH, *FUNCTIONS, *self._functions) if f.isidentifier()]
        raise call.place.error(f"no function is named {name!r}; {nearest(name, known)}")

    def _expanded(self, function: _Function, call: Call, arguments: Sequence[Node]) -> Node:
        definition = function.definition
        self._expect_arguments(call, (len(definition.parameters),))
        if definition.name in self._expanding:
            raise call.place.error(f"{definition.name} calls itself; there is no recursion")
        names = {**function.names, **dict(zip(definition.parameters, arguments, strict=True))}
        self._expanding.append(definition.name)
        value = self._value(definition.body, names)
        self._expanding.pop()
        return value

    def _expect_arguments(self, call: Call, counts: tuple[int, ...]) -> None:
        if len(call.arguments) not in counts:
            expected = " or ".join(map(str, counts))
            found = f"{call.function} has {len(call.arguments)} argument(s)"
            raise call.place.error(f"{found}, expected {expected}")

    def _alike(self, values: Sequence[Node], place: Place, what: str) -> list[Node]:
        """The values at one width: scalars repeated to the vectors' length."""
        width = max(value.width for value in values)
        if any(value.width not in (1, width) for value in values):
            widths = " and ".join(str(value.width) for value in values)
            raise place.error(f"{what!r} of vectors of {widths} components, expected equal lengths")
        return [self._widen(value, width, place) for value in values]

    def _widen(self, value: Node, width: int, place: Place) -> Node:
        if value.width == width:
            return value
        if value.width != 1:
            raise place.error(f"found {value.width} components, expected {width}")
        return self._graph.splat(value, width)

    # Functions made of several operators ---------------------------------------------------------------

    def _reduce(self, op: str, vector: Node) -> Node:
        return vector if vector.width == 1 else self._graph.add(op, [vector])

    def _least_or_greatest(self, call: Call, arguments: Sequence[Node]) -> Node:
        if len(arguments) == 1:
            return self._reduce(call.function, arguments[0])
        return self._graph.add(f"v{call.function}", self._alike(arguments, call.place, call.function))

    def _sum(self, call: Call, arguments: Sequence[Node]) -> Node:
        return self._reduce("sum", arguments[0])

    def _product(self, call: Call, arguments: Sequence[Node]) -> Node:
        return self._reduce("prod", arguments[0])

    def _atan2(self, call: Call, arguments: Sequence[Node]) -> Node:
        y, x = self._alike(arguments, call.place, call.function)
        return self._graph.add("atn2", [x, y])

    def _clamp(self, call: Call, arguments: Sequence[Node]) -> Node:
        value, low, high = self._alike(arguments, call.place, call.function)
        return self._graph.add("vmin", [self._graph.add("vmax", [value, low]), high])

    def _dot(self, call: Call, arguments: Sequence[Node]) -> Node:
        return self._reduce("sum", self._graph.add("mul", self._alike(arguments, call.place, call.function)))

    def _norm(self, call: Call, arguments: Sequence[Node]) -> Node:
        return self._graph.add("sqrt", [self._reduce("sum", self._graph.add("sq", arguments))])

    def _normalize(self, call: Call, arguments: Sequence[Node]) -> Node:
        graph, vector = self._graph, arguments[0]
        squares = graph.pack([graph.add("sq", [vector]), graph.const(TINY)])
        length = graph.add("sqrt", [graph.add("sum", [squares])])
        return graph.add("div", [vector, graph.splat(length, vector.width)])

    def _cross(self, call: Call, arguments: Sequence[Node]) -> Node:
        graph = self._graph
        a, b = arguments
        if a.width != 3 or b.width != 3:
            raise call.place.error(f"cross of {a.width} and {b.width} components, expected 3 and 3")
        # a x b rotated by one place is a rotl(b) - rotl(a) b, which vector operators do in few steps.
        ahead = graph.add("mul", [a, graph.rotl(b, 1)])
        behind = graph.add("mul", [graph.rotl(a, 1), b])
        return graph.rotl(graph.add("sub", [ahead, behind]), 1)

    def _rotl(self, call: Call, arguments: Sequence[Node]) -> Node:
        vector, places = arguments
        if places.op != "const" or places.width != 1 or places.detail[0] not in range(1, vector.width):
            raise call.place.error(f"rotl by something else than a number from 1 to {vector.width - 1}")
        return self._graph.rotl(vector, int(places.detail[0]))


_UNARY = frozenset(name for name in _EACH if name.isidentifier()) - {"pow", "mod", "and", "or"}

_Build = Callable[[_Lowering, Call, Sequence[Node]], Node]

FUNCTIONS: Mapping[str, tuple[tuple[int, ...], _Build]] = {
    "min": ((1, 2), _Lowering._least_or_greatest),
    "max": ((1, 2), _Lowering._least_or_greatest),
    "sum": ((1,), _Lowering._sum),
    "product": ((1,), _Lowering._product),
    "atan2": ((2,), _Lowering._atan2),
    "clamp": ((3,), _Lowering._clamp),
    "dot": ((2,), _Lowering._dot),
    "norm": ((1,), _Lowering._norm),
    "normalize": ((1,), _Lowering._normalize),
    "cross": ((2,), _Lowering._cross),
    "rotl": ((2,), _Lowering._rotl),
}
"""Functions made of several operators: possible numbers of arguments, and how they are built."""
