"""Lifted graphs as straight-line text: what GLSL and JavaScript have in common, by a table of operators.

Both languages are written from one `Language`: how a number is spelt, and for each operator of the graph a
pattern.  Every node becomes one constant; conditions are booleans, and a select takes one of its sides by
`?:`, so that no NaN of the other one gets through.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from iccbrdf.calc.graph import LOGIC, Node, is_truth
from iccbrdf.errors import UnsupportedError


@dataclass(frozen=True)
class Language:
    """A target of `statements`.

    Attributes
    ----------
    name
        For messages.
    patterns
        Text by operator, with {0}, {1}, ... for the arguments.
    literal
        The text of a number.
    declare
        A pattern of {type}, {name}, {value}: a constant and its value.
    number, truth
        Names of the two types; `from_truth` is the pattern that makes a number of a condition.
    """

    name: str
    patterns: Mapping[str, str]
    literal: Callable[[float], str]
    declare: str
    number: str
    truth: str
    from_truth: str


def name_of(node: Node) -> str:
    """The constant that holds a node."""
    return f"v{node.index}"


def statements(language: Language, nodes: Iterable[Node], known: Mapping[Node, str]) -> list[str]:
    """A line of text for each of `nodes`, which come after what they read.

    Parameters
    ----------
    known
        Texts of the nodes that are computed elsewhere: inputs, run-time variables, arguments.

    Raises
    ------
    UnsupportedError
        The language has no pattern for a node.
    """
    writer = Writer(language, known)
    return [writer.declaration(node) for node in nodes if writer.declares(node)]


@dataclass(frozen=True)
class Writer:
    """Texts of nodes in a language; `known` as of `statements`."""

    language: Language
    known: Mapping[Node, str]

    def declares(self, node: Node) -> bool:
        """Whether the node has a constant of its own."""
        return node not in self.known and node.op != "const"

    def declaration(self, node: Node, value: str | None = None) -> str:
        """The line that holds a node; `value` in the place of its own expression."""
        kind = self.language.truth if is_truth(node) else self.language.number
        value = self.expression(node) if value is None else value
        return self.language.declare.format(type=kind, name=name_of(node), value=value)

    def expression(self, node: Node) -> str:
        """A node computed from its arguments' constants."""
        if node.op not in self.language.patterns:
            raise UnsupportedError(f"{node.op!r} cannot be written in {self.language.name}")
        return self.language.patterns[node.op].format(*self.arguments(node))

    def arguments(self, node: Node) -> list[str]:
        """The texts of a node's arguments, as conditions where it takes such."""
        conditions = {"select": 1}.get(node.op, len(node.arguments) if node.op in LOGIC else 0)
        return [
            self.condition(argument) if k < conditions else self.number(argument)
            for k, argument in enumerate(node.arguments)
        ]

    def number(self, node: Node) -> str:
        """A node as a number."""
        text = self._text(node)
        return self.language.from_truth.format(text) if is_truth(node) else text

    def condition(self, node: Node) -> str:
        """A node as a condition."""
        text = self._text(node)
        return text if is_truth(node) else f"({text} >= 0.5)"

    def _text(self, node: Node) -> str:
        if node.op == "const":
            return self.language.literal(node.detail[0])
        return self.known.get(node) or name_of(node)
