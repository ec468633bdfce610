"""Expressions to nodes of a graph: names, widths, functions, tables.

Functions of the language, element by element unless said, scalars going with vectors of any length:
`abs sign sqrt cbrt exp log log10 floor ceil trunc round sin cos tan asin acos atan` of one value;
`pow mod min max atan2(y, x)` of two, `clamp(x, low, high)`; of one vector to a scalar `sum product min max`
and `norm`; `dot(a, b)`, `cross(a, b)`, `normalize(v)` (a vector of no length becomes 0) and
`rotl(v, k)` (the components rotated, component k first).  `polar(x, y)` is all radii and then all angles, in
degrees from 0 to 360; `lab(x, y, z)` all L*, then all a*, then all b*, of XYZ divided by the white's.  Other
angles are in radians, `log` is natural, conditions are 1 and 0, and `pi` is a name that is always there.

Of a normal, light and view of any lengths: `cosines(n, i, v, exact)`, `half_vector(i, v, exact)`, and both as
`cosines_and_half_vector(n, i, v, exact)`; where `exact` is 1 and not 0, float32 keeps their digits down to
the horizon (library.calc).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, reduce
from pathlib import Path
from typing import TypeAlias

from iccbrdf.calc.graph import Graph, Node, evaluate
from iccbrdf.calc.source import (
    Block,
    Call,
    Component,
    Conditional,
    Def,
    Element,
    Expression,
    Let,
    Name,
    Number,
    Place,
    Slice,
    Total,
    Vector,
    parse,
)
from iccbrdf.errors import LimitError, nearest

TINY = 1e-37
"""What `normalize` adds to a squared length, so that a vector of no length becomes 0 and not NaN.

Above the smallest normal float32, and far below the square of any length that a direction has.
"""

MAX_WORK = 1 << 17
"""Components that the expressions of a template have in all: a short text could ask for endless ones.
Templates of ours need a quarter."""

_NAMES_FOR_ONE = 16
"""Names that a block sees take as much work as one component."""

_COMPONENTS = {"x": 0, "y": 1, "z": 2, "X": 0, "Y": 1, "Z": 2}

_EACH = {
    "neg": "neg", "not": "not", "abs": "abs", "sign": "sign", "sqrt": "sqrt", "cbrt": "cbrt", "exp": "exp",
    "log": "ln", "log10": "log", "floor": "flor", "ceil": "ceil", "trunc": "trnc", "round": "rond",
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan",
    "+": "add", "-": "sub", "*": "mul", "/": "div", "^": "pow", "pow": "pow", "mod": "mod",
    "<": "lt", "<=": "le", "==": "eq", "!=": "neq", ">=": "ge", ">": "gt", "and": "vand", "or": "vor",
}  # fmt: skip
"""Functions and operators of the language that are one operator of the calculator."""


@dataclass(frozen=True)
class Rows:
    """A table of constants by rows."""

    rows: tuple[tuple[float, ...], ...]


Named: TypeAlias = Node | Rows
"""What a name stands for."""


@dataclass(frozen=True)
class _Function:
    """A function of the template, with the names it saw when it was defined."""

    definition: Def
    names: Mapping[str, Named]


class Expressions:
    """The expressions of one template, as nodes of `graph`."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._functions: dict[str, _Function] = {}
        self._expanding: list[str] = []
        self._numbers: dict[Node, tuple[float, ...] | None] = {}
        self._work = 0
        for definition in _library():
            self.define(definition, {})

    def define(self, definition: Def, names: Mapping[str, Named]) -> None:
        """Make a function known that sees these names."""
        if definition.name in self._functions or definition.name in FUNCTIONS or definition.name in _EACH:
            raise definition.place.error(f"a function {definition.name!r} is there already")
        self._functions[definition.name] = _Function(definition, self._seen(names, definition.place))

    def value(self, expression: Expression, names: Mapping[str, Named]) -> Node:
        """The value of an expression in which `names` stand for what they do."""
        value = self._value(expression, names)
        self._spend(value.width, expression.place)
        return value

    def _spend(self, work: int, place: Place) -> None:
        self._work += work
        if self._work > MAX_WORK:
            message = f"the template asks for more than {MAX_WORK} values up to here"
            raise LimitError(str(place.error(message)))

    def _seen(self, names: Mapping[str, Named], place: Place) -> dict[str, Named]:
        """What a block sees of the names around it, to which it adds its own."""
        self._spend(len(names) // _NAMES_FOR_ONE, place)
        return dict(names)

    def _value(self, expression: Expression, names: Mapping[str, Named]) -> Node:
        if isinstance(expression, Number):
            return self._graph.const(expression.value)
        if isinstance(expression, Name):
            return self._name(expression, names)
        if isinstance(expression, Vector):
            return self._graph.pack([self.value(part, names) for part in expression.parts])
        if isinstance(expression, Component):
            return self._component(expression, names)
        if isinstance(expression, Element):
            return self._element(expression, names)
        if isinstance(expression, Slice):
            return self._slice(expression, names)
        if isinstance(expression, Block):
            inner = self._seen(names, expression.place)
            for let in expression.lets:
                self.let(let, inner)
            return self.value(expression.value, inner)
        if isinstance(expression, Conditional):
            return self._conditional(expression, names)
        if isinstance(expression, Total):
            return self._total(expression, names)
        return self._call(expression, names)

    def let(self, let: Let, names: dict[str, Named]) -> None:
        """Let a name stand for the value of an expression."""
        value = self.value(let.value, names)
        self._graph.names.setdefault(value, let.name)
        bind(names, let.place, let.name, value)

    def known(self, expression: Expression, names: Mapping[str, Named], what: str) -> tuple[float, ...]:
        """The numbers of an expression that the build already knows."""
        numbers = self._folded(self.value(expression, names))
        if numbers is None:
            raise expression.place.error(f"{what} depends on what only a run knows; expected constants")
        return numbers

    def widen(self, value: Node, width: int, place: Place) -> Node:
        """The value, repeated where it is a scalar."""
        if value.width == width:
            return value
        if value.width != 1:
            raise place.error(f"found {value.width} components, expected {width}")
        return self._graph.splat(value, width)

    # Constants -----------------------------------------------------------------------------------------

    def _folded(self, node: Node) -> tuple[float, ...] | None:
        """The numbers of a node that is computed from constants alone."""
        if node.op == "const":
            return tuple(node.detail)
        if node not in self._numbers:
            arguments = [self._folded(argument) for argument in node.arguments]
            numbers = [values for values in arguments if values is not None]
            known = len(numbers) == len(arguments) > 0
            self._numbers[node] = evaluate(node.op, numbers, node.detail, node.width) if known else None
        return self._numbers[node]

    def _whole(self, expression: Expression, names: Mapping[str, Named], what: str) -> int:
        numbers = self.known(expression, names, what)
        if len(numbers) != 1 or not float(numbers[0]).is_integer():
            found = ", ".join(f"{number:g}" for number in numbers)
            raise expression.place.error(f"{what} is {found}, expected a whole number")
        return int(numbers[0])

    # Names and parts -----------------------------------------------------------------------------------

    def _name(self, expression: Name, names: Mapping[str, Named]) -> Node:
        name = expression.name
        if name not in names:
            raise expression.place.error(f"nothing is named {name!r}; {nearest(name, names)}")
        value = names[name]
        if isinstance(value, Rows):
            raise expression.place.error(
                f"{name} is a table of rows; expected a column ({name}.X), a row ({name}[0]) or w @ {name}"
            )
        return value

    def _component(self, component: Component, names: Mapping[str, Named]) -> Node:
        if component.name not in _COMPONENTS:
            hint = nearest(component.name, _COMPONENTS)
            raise component.place.error(f"no component is named {component.name!r}; {hint}")
        index = _COMPONENTS[component.name]
        table = _table(component.vector, names)
        if table is not None:
            if index >= len(table.rows[0]):
                found = f"found column {component.name} of a table of {len(table.rows[0])} column(s)"
                raise component.place.error(found)
            return self._graph.const(*(row[index] for row in table.rows))
        vector = self.value(component.vector, names)
        if index >= vector.width:
            raise component.place.error(
                f"found component {component.name} of a value of {vector.width} component(s)"
            )
        return self._graph.pick(vector, index)

    def _element(self, element: Element, names: Mapping[str, Named]) -> Node:
        index = self._whole(element.index, names, "the index")
        table = _table(element.vector, names)
        if table is not None:
            if not 0 <= index < len(table.rows):
                raise element.place.error(f"found row {index} of a table of {len(table.rows)} row(s)")
            return self._graph.const(*table.rows[index])
        vector = self.value(element.vector, names)
        if not 0 <= index < vector.width:
            raise element.place.error(f"found component {index} of a value of {vector.width} component(s)")
        return self._graph.pick(vector, index)

    def _slice(self, part: Slice, names: Mapping[str, Named]) -> Node:
        vector = self.value(part.vector, names)
        first = self._whole(part.first, names, "the first component")
        end = self._whole(part.end, names, "the end")
        if not 0 <= first < end <= vector.width:
            raise part.place.error(
                f"found components {first} up to {end} of a value of {vector.width} component(s)"
            )
        return self._graph.pick(vector, first, end - first)

    # Control -------------------------------------------------------------------------------------------

    def _conditional(self, conditional: Conditional, names: Mapping[str, Named]) -> Node:
        condition = self.value(conditional.condition, names)
        if condition.width != 1:
            raise conditional.condition.place.error(
                f"the condition has {condition.width} components, expected 1"
            )
        known = self._folded(condition)
        if known is not None:
            return self.value(conditional.then if known[0] >= 0.5 else conditional.otherwise, names)
        sides = [self.value(conditional.then, names), self.value(conditional.otherwise, names)]
        return self._graph.add("select", [condition, *self._alike(sides, conditional.place, "if")])

    def _total(self, total: Total, names: Mapping[str, Named]) -> Node:
        first = self._whole(total.first, names, "the first value")
        last = self._whole(total.last, names, "the last value")
        if first > last:
            raise total.place.error(f"a total from {first} to {last} has nothing to add up")
        values = []
        for index in range(first, last + 1):
            inner = self._seen(names, total.place)
            bind(inner, total.place, total.name, self._graph.const(index))
            values.append(self.value(total.body, inner))
        return reduce(
            lambda left, right: self._graph.add("add", self._alike([left, right], total.place, "total")),
            values,
        )

    # Functions and operators ---------------------------------------------------------------------------

    def _call(self, call: Call, names: Mapping[str, Named]) -> Node:
        name = call.function
        if name == "@":
            return self._combination(call, names)
        arguments = [self.value(argument, names) for argument in call.arguments]
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
        known = [f for f in (*_EACH, *FUNCTIONS, *self._functions) if f.isidentifier() and f[0] != "_"]
        raise call.place.error(f"no function is named {name!r}; {nearest(name, known)}")

    def _combination(self, call: Call, names: Mapping[str, Named]) -> Node:
        """A vector times a table: one scalar product for each column."""
        weights = self.value(call.arguments[0], names)
        table = _table(call.arguments[1], names)
        if table is None:
            raise call.place.error("found '@' before something else than the name of a table of rows")
        if weights.width != len(table.rows):
            raise call.place.error(
                f"found {weights.width} component(s) before '@', expected {len(table.rows)}, one for each row"
            )
        self._spend(len(table.rows) * len(table.rows[0]), call.place)
        columns = [self._graph.const(*column) for column in zip(*table.rows, strict=True)]
        products = [self._reduce("sum", self._graph.add("mul", [weights, column])) for column in columns]
        return products[0] if len(products) == 1 else self._graph.pack(products)

    def _expanded(self, function: _Function, call: Call, arguments: Sequence[Node]) -> Node:
        definition = function.definition
        self._expect_arguments(call, (len(definition.parameters),))
        if definition.name in self._expanding:
            raise call.place.error(f"{definition.name} calls itself; there is no recursion")
        names = self._seen(function.names, call.place)
        names |= zip(definition.parameters, arguments, strict=True)
        self._expanding.append(definition.name)
        value = self.value(definition.body, names)
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
        return [self.widen(value, width, place) for value in values]

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

    def _polar(self, call: Call, arguments: Sequence[Node]) -> Node:
        return self._graph.add("ctop", self._alike(arguments, call.place, call.function))

    def _lab(self, call: Call, arguments: Sequence[Node]) -> Node:
        return self._graph.add("tLab", self._alike(arguments, call.place, call.function))


def _table(expression: Expression, names: Mapping[str, Named]) -> Rows | None:
    """The table that an expression is the name of."""
    value = names.get(expression.name) if isinstance(expression, Name) else None
    return value if isinstance(value, Rows) else None


def bind(names: dict[str, Named], place: Place, name: str, value: Named) -> None:
    """Let a name stand for a value, for which it may stand once."""
    if name in names:
        raise place.error(f"{name!r} has a value already; a name stands for one value")
    names[name] = value


@cache
def _library() -> tuple[Def, ...]:
    """The functions of the language that are written in it."""
    path = Path(__file__).parent / "library.calc"
    statements = parse(path.read_text(encoding="utf-8"), path.name).statements
    return tuple(statement for statement in statements if isinstance(statement, Def))


_UNARY = frozenset(name for name in _EACH if name.isidentifier()) - {"pow", "mod", "and", "or"}

_Build = Callable[[Expressions, Call, Sequence[Node]], Node]

FUNCTIONS: Mapping[str, tuple[tuple[int, ...], _Build]] = {
    "min": ((1, 2), Expressions._least_or_greatest),
    "max": ((1, 2), Expressions._least_or_greatest),
    "sum": ((1,), Expressions._sum),
    "product": ((1,), Expressions._product),
    "atan2": ((2,), Expressions._atan2),
    "clamp": ((3,), Expressions._clamp),
    "dot": ((2,), Expressions._dot),
    "norm": ((1,), Expressions._norm),
    "normalize": ((1,), Expressions._normalize),
    "cross": ((2,), Expressions._cross),
    "rotl": ((2,), Expressions._rotl),
    "polar": ((2,), Expressions._polar),
    "lab": ((3,), Expressions._lab),
}
"""Functions made of several operators: possible numbers of arguments, and how they are built."""
