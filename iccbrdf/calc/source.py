"""The template language: text to syntax tree.

A template (`calc_templates/*.calc`) is the readable form of a model.  The leading comment is its
documentation, `#` starts a comment, a newline ends a statement except inside parentheses.

    model NAME
    input kd[3] = kd.X kd.Y kd.Z default white   channels by MCS name; what a profile without them assumes
    input m default 0.3                          a scalar whose channel has its own name
    runtime litI = pi                            a CMM environment variable and its default
    runtime view = (vueX: 0, vueY: 0, vueZ: 1)   several as one vector
    constant refractive_index = 1.5              set when the profile is built
    constant angles[s]                           a table of any length: s numbers, and s stands for the length
    constant colours[s, 3]                       s rows of 3; tables that name a size alike have it in common
    choice fresnel_angle = theta_i | alpha       the same for one of several names; the first is the default
    effect fresnel = on                          a switch of the build
    when fresnel { ... } else { ... }            statements chosen by a switch
    when fresnel_angle is alpha { ... }          or by a choice
    let h = light + view                         a value; scalars go with vectors of any length
    def pow5(x) = x^5                            a function, expanded where it is called
    output X Y Z = if cos_i > 0 { ... } else { 0 }

Operators by precedence: `or`, `and`, `not`, comparisons, `+ -`, `* / @`, sign, `^`.  `(a, b, c)` is a vector,
`v.x`, `v.Y` and `v[2]` are components, `v[a:b]` those from a up to, but without b.  `if` is an expression
whose blocks are `let` statements and a value; one that is decided when the profile is built is no more than
the side that it takes.  `total k = 1 to 3 { ... }` adds up the block's values for each k.  Of a table of
rows, `colours.X` is a column, `colours[0]` a row, and `w @ colours` the sum of its rows, each times its
component of w.  Indices and the bounds of `total` are known when the profile is built.  The functions are
listed in expressions.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any, TypeAlias

from lark import Lark, Token, Transformer, UnexpectedCharacters, UnexpectedToken, v_args
from lark.exceptions import VisitError

from iccbrdf.errors import InputError, nearest


@dataclass(frozen=True)
class Place:
    """Where something stands in a template; lines and columns from 1."""

    filename: str
    line: int
    column: int

    def error(self, message: str) -> InputError:
        """The error that `message` is about what stands here."""
        return InputError(f"{self.filename}:{self.line}:{self.column}: {message}")


# Expressions -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Number:
    place: Place
    value: float


@dataclass(frozen=True)
class Name:
    place: Place
    name: str


@dataclass(frozen=True)
class Call:
    """A function, or an operator under its sign; negation is `neg`."""

    place: Place
    function: str
    arguments: tuple[Expression, ...]


@dataclass(frozen=True)
class Vector:
    place: Place
    parts: tuple[Expression, ...]


@dataclass(frozen=True)
class Component:
    place: Place
    vector: Expression
    name: str
    """A letter."""


@dataclass(frozen=True)
class Element:
    place: Place
    vector: Expression
    index: Expression


@dataclass(frozen=True)
class Slice:
    place: Place
    vector: Expression
    first: Expression
    end: Expression
    """The component after the last."""


@dataclass(frozen=True)
class Block:
    place: Place
    lets: tuple[Let, ...]
    value: Expression


@dataclass(frozen=True)
class Conditional:
    place: Place
    condition: Expression
    then: Block
    otherwise: Expression


@dataclass(frozen=True)
class Total:
    place: Place
    name: str
    first: Expression
    last: Expression
    body: Block


Expression: TypeAlias = (
    Number | Name | Call | Vector | Component | Element | Slice | Block | Conditional | Total
)

# Statements --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Model:
    place: Place
    name: str


@dataclass(frozen=True)
class Input:
    place: Place
    name: str
    width: int
    channels: tuple[str, ...]
    default: Expression | None


@dataclass(frozen=True)
class Output:
    place: Place
    channels: tuple[str, ...]
    value: Expression


@dataclass(frozen=True)
class Variable:
    place: Place
    name: str
    default: Expression


@dataclass(frozen=True)
class Runtime:
    place: Place
    name: str
    variables: tuple[Variable, ...]


@dataclass(frozen=True)
class Constant:
    place: Place
    name: str
    default: Expression


@dataclass(frozen=True)
class Table:
    """A constant without a default, whose size the build decides."""

    place: Place
    name: str
    sizes: tuple[str, ...]
    """Number of rows, and of columns where there are any: names, or the digits of a number."""


@dataclass(frozen=True)
class Choice:
    place: Place
    name: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Effect:
    place: Place
    name: str
    on: bool


@dataclass(frozen=True)
class When:
    place: Place
    name: str
    value: str | None
    """The value of a choice; None for an effect."""
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...]


@dataclass(frozen=True)
class Let:
    place: Place
    name: str
    value: Expression


@dataclass(frozen=True)
class Def:
    place: Place
    name: str
    parameters: tuple[str, ...]
    body: Expression


Statement: TypeAlias = (
    Model | Input | Output | Runtime | Constant | Table | Choice | Effect | When | Let | Def
)


@dataclass(frozen=True)
class Template:
    """A parsed template."""

    filename: str
    documentation: str
    statements: tuple[Statement, ...]

    def all_statements(self) -> Iterator[Statement]:
        """Every statement, those of both sides of every `when` included."""
        pending = list(reversed(self.statements))
        while pending:
            statement = pending.pop()
            yield statement
            if isinstance(statement, When):
                pending.extend(reversed(statement.then + statement.otherwise))


@lru_cache(maxsize=16)
def parse(text: str, filename: str) -> Template:
    """
    Return the syntax tree of a template; the last ones are kept, since builds take the same ones.

    Raises
    ------
    InputError
        With file, line and column, what was found there and what was expected.
    """
    try:
        tree = _parser().parse(text + "\n")
        statements = _Builder(filename).transform(tree)
    except UnexpectedCharacters as error:
        place = Place(filename, error.line, error.column)
        raise place.error(f"found {error.char!r}, which no part of the language begins with") from None
    except UnexpectedToken as error:
        raise _syntax_error(error, filename) from None
    except VisitError as error:
        raise error.orig_exc from None
    return Template(filename, _leading_comment(text), statements)


def _leading_comment(text: str) -> str:
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line[1:].removeprefix(" ").rstrip())
    return "\n".join(lines)


# Parsing -----------------------------------------------------------------------------------------------


class _Newlines:
    """Drops the newlines inside parentheses and brackets."""

    always_accept = ("_NL",)

    def process(self, tokens: Iterator[Token]) -> Iterator[Token]:
        nesting: list[str] = []
        for token in tokens:
            if token in ("(", "[", "{"):
                nesting.append(token)
            elif token in (")", "]", "}") and nesting:
                nesting.pop()
            if token.type != "_NL" or not nesting or nesting[-1] == "{":
                yield token


@cache
def _parser() -> Lark:
    return Lark.open(
        "template.lark", rel_to=__file__, parser="lalr", lexer="basic", postlex=_Newlines(),
        propagate_positions=True, maybe_placeholders=True,
    )  # fmt: skip


_OPERATORS = ("OR", "AND", "COMPARE", "PLUS", "MINUS", "TIMES", "DIVIDE", "COMBINE", "POWER")
_DESCRIPTIONS = {
    "NAME": "a name",
    "NUMBER": "a number",
    "_NL": "the end of the line",
    **dict.fromkeys(_OPERATORS, "an operator"),
}


def _syntax_error(error: UnexpectedToken, filename: str) -> InputError:
    token = error.token
    found = "the end of the line" if token.type == "_NL" else f"{str(token)!r}"
    if token.type == "$END":
        found = "the end of the template"
    expected = {name: _describe(name) for name in error.accepts or error.expected if name != "$END"}
    message = f"found {found}, expected {_one_of(sorted(set(expected.values())))}"
    keywords = [text.strip("'") for name, text in expected.items() if text.strip("'").isalpha()]
    if token.type == "NAME" and "NAME" not in expected and keywords:
        message += f"; {nearest(str(token), keywords)}"
    return Place(filename, error.line, error.column).error(message)


def _describe(terminal: str) -> str:
    if terminal in _DESCRIPTIONS:
        return _DESCRIPTIONS[terminal]
    return f"{_parser().get_terminal(terminal).pattern.value.replace(chr(92), '')!r}"


def _one_of(descriptions: list[str]) -> str:
    return descriptions[0] if len(descriptions) == 1 else "one of " + " ".join(descriptions)


@v_args(inline=True, meta=True)
class _Builder(Transformer[Token, Any]):
    """Lark's tree to ours, rule by rule."""

    def __init__(self, filename: str) -> None:
        super().__init__()
        self._filename = filename

    def _place(self, meta: Any) -> Place:
        """The place of a token, or of what Lark's `meta` describes."""
        return Place(self._filename, meta.line, meta.column)

    def start(self, meta: Any, *statements: Statement) -> tuple[Statement, ...]:
        return statements

    def statements(self, meta: Any, *statements: Statement | None) -> tuple[Statement, ...]:
        return tuple(statement for statement in statements if statement is not None)

    def model(self, meta: Any, name: Token) -> Model:
        return Model(self._place(meta), str(name))

    def input(
        self, meta: Any, name: Token, width: Token | None, channels: tuple[str, ...] | None,
        default: Expression | None,
    ) -> Input:  # fmt: skip
        place = self._place(meta)
        names = (str(name),) if channels is None else channels
        stated = 1 if width is None else self._index(width)
        if stated != len(names):
            raise place.error(f"input {name} has {stated} component(s) but {len(names)} channel(s)")
        return Input(place, str(name), stated, names, default)

    def output(self, meta: Any, channels: tuple[str, ...], value: Expression) -> Output:
        return Output(self._place(meta), channels, value)

    def channels(self, meta: Any, *channels: str) -> tuple[str, ...]:
        return channels

    def channel(self, meta: Any, name: Token, component: Token | None) -> str:
        return str(name) if component is None else f"{name}.{component}"

    def runtime(self, meta: Any, name: Token, *values: Expression | Variable) -> Runtime:
        place = self._place(meta)
        variables = [v if isinstance(v, Variable) else Variable(place, str(name), v) for v in values]
        return Runtime(place, str(name), tuple(variables))

    def variable(self, meta: Any, name: Token, default: Expression) -> Variable:
        return Variable(self._place(meta), str(name), default)

    def constant(self, meta: Any, name: Token, default: Expression) -> Constant:
        return Constant(self._place(meta), str(name), default)

    def table(self, meta: Any, name: Token, rows: Token, columns: Token | None) -> Table:
        sizes = [rows] if columns is None else [rows, columns]
        for size in sizes:
            if size.type == "NUMBER":
                self._index(size)
        return Table(self._place(meta), str(name), tuple(map(str, sizes)))

    def choice(self, meta: Any, name: Token, *values: Token) -> Choice:
        return Choice(self._place(meta), str(name), tuple(map(str, values)))

    def effect(self, meta: Any, name: Token, switch: Token) -> Effect:
        return Effect(self._place(meta), str(name), switch == "on")

    def when(
        self, meta: Any, name: Token, value: Token | None, then: tuple[Statement, ...],
        otherwise: tuple[Statement, ...] | None,
    ) -> When:  # fmt: skip
        return When(self._place(meta), str(name), value and str(value), then, otherwise or ())

    def let(self, meta: Any, name: Token, value: Expression) -> Let:
        return Let(self._place(meta), str(name), value)

    def definition(self, meta: Any, name: Token, *rest: Any) -> Def:
        *parameters, body = rest
        return Def(self._place(meta), str(name), tuple(map(str, parameters)), body)

    def block(self, meta: Any, *parts: Any) -> Block:
        *lets, value = parts
        return Block(self._place(meta), tuple(lets), value)

    def conditional(
        self, meta: Any, condition: Expression, then: Block, otherwise: Expression
    ) -> Conditional:
        return Conditional(self._place(meta), condition, then, otherwise)

    def summation(self, meta: Any, name: Token, first: Expression, last: Expression, body: Block) -> Total:
        return Total(self._place(meta), str(name), first, last, body)

    def operation(self, meta: Any, first: Expression, *rest: Any) -> Expression:
        """`a - b + c`, grouped from the left."""
        value = first
        for sign, operand in zip(rest[::2], rest[1::2], strict=True):
            value = Call(self._place(sign), str(sign), (value, operand))
        return value

    def prefix(self, meta: Any, sign: Token, operand: Expression) -> Expression:
        function = "not" if sign == "not" else "neg"
        return Call(self._place(meta), function, (operand,))

    def component(self, meta: Any, vector: Expression, name: Token) -> Component:
        return Component(self._place(meta), vector, str(name))

    def element(self, meta: Any, vector: Expression, index: Expression) -> Element:
        return Element(self._place(meta), vector, index)

    def slice(self, meta: Any, vector: Expression, first: Expression, end: Expression) -> Slice:
        return Slice(self._place(meta), vector, first, end)

    def number(self, meta: Any, digits: Token) -> Number:
        return Number(self._place(meta), float(digits))

    def name(self, meta: Any, name: Token) -> Name:
        return Name(self._place(meta), str(name))

    def call(self, meta: Any, function: Token, *arguments: Expression) -> Call:
        return Call(self._place(meta), str(function), arguments)

    def vector(self, meta: Any, *parts: Expression) -> Vector:
        return Vector(self._place(meta), parts)

    def _index(self, token: Token) -> int:
        if not token.isdigit():
            raise self._place(token).error(f"found {str(token)!r}, expected a whole number")
        return int(token)
