"""The text language of calculators in XML: macros, and names of channels, variables and sub-elements.

A macro is called as `call{name}` or `#name` and stands for its text.  Channels are `in{name}`, `out{name}`,
`in{name[first],count}`; variables `tget{name}`, `tput{name[index]}`, `tsav{name[first,count]}`, members of
variables `tget{name.member}`, and a macro's own variables `tget{@name}`; sub-elements `mtx{name}`,
`elem{name}` and so on.  Each of these stands between blanks.  What they stand for is the language of
`iccbrdf.calc.program`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from iccbrdf.calc.operators import OPERATORS, Operand
from iccbrdf.calc.program import SLOTS
from iccbrdf.errors import IccBrdfError, LimitError, ProfileError, nearest
from iccbrdf.icc.source_tag import CalculatorSource
from iccbrdf.icc.xml.node import Node
from iccbrdf.icc.xml.values import Codec

MAX_MAIN_WORDS = 1 << 20
"""Words of the main functions of a document, several for each of the operations that a tag may have."""
MAX_WORDS = 1 << 16
"""Words that the macros of a document stand for in all: small files could stand for endless ones."""
MAX_CALLS = 64
"""Macros that call one another."""

_NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_TOKEN = re.compile(r"(?P<blank>\s+)|(?P<comment>[%;/][^\n\r]*)|(?P<word>[^\s%;/]+)")
_CALL = re.compile(rf"call\{{({_NAME})\}}|#({_NAME})")
_REFERENCE = re.compile(r"(?P<operator>[a-zA-Z]+)\{(?P<name>[^{}]*)\}")
_CHANNEL = re.compile(rf"(?P<name>{_NAME})(?:\[(?P<first>\d{{1,5}})\])?(?:,(?P<count>\d{{1,5}}))?")
_VARIABLE = re.compile(
    rf"(?P<name>@?{_NAME}(?:\.{_NAME})?)(?:[\[(](?P<first>\d{{1,5}})(?:,(?P<count>\d{{1,5}}))?[\])])?"
)
_SIZED = re.compile(rf"({_NAME})(?:[\[(](\d{{1,5}})[\])])?")

_BARE = re.compile(r"(?<![^\s{}])(in|out|tget|tput|tsav)(?=\s*\}|\s+[^\s(\[{]|\s*$)")
"""What has no argument, which then is 0."""
_NEGATIVE_NAN = re.compile(r"(?<![^\s{}])-nan(?![^\s{}])")
_LOST = re.compile(r"(?<![^\s{}])rot[lr](?=\s*\}|\s+[^\s(\[]|\s*$)")

_MEMORY = ("tget", "tput", "tsav")
_APPLY = tuple(name for name, row in OPERATORS.items() if row.operand is Operand.ELEMENT)
_REFERRING = re.compile(rf"({'|'.join(('call', 'in', 'out', *_MEMORY, *_APPLY))})\{{|#")

T = TypeVar("T")


def is_name(text: str) -> bool:
    """Whether the dialect takes `text` for a name."""
    return re.fullmatch(_NAME, text) is not None


@dataclass(frozen=True)
class Span:
    """Neighbouring channels or slots; a variable has members."""

    first: int
    size: int
    members: Mapping[str, Span] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.first} to {self.first + self.size - 1}"


def _sized_names(text: str) -> dict[str, Span]:
    spans: dict[str, Span] = {}
    first = 0
    for word in text.split():
        match = _SIZED.fullmatch(word)
        if match is None or int(match[2] or 1) < 1:
            raise ValueError(f"found {word!r:.40}, expected a name of letters, digits and _, or name[count]")
        if match[1] in spans:
            raise ValueError(f"found {match[1]!r} twice, expected every name once")
        spans[match[1]] = Span(first, int(match[2] or 1))
        first += spans[match[1]].size
    return spans


SIZED_NAMES = Codec(_sized_names, " ".join)
"""`a b[2] c` as spans one after the other."""


@dataclass(frozen=True)
class Macro:
    """A macro as its element says it, with its own variables."""

    node: Node
    text: str
    locals: Mapping[str, Span]

    @property
    def size(self) -> int:
        """Slots of its own variables."""
        return sum(span.size for span in self.locals.values())


@dataclass
class Declarations:
    """What the elements around a main function declare.

    variables: `first` below 0 where the position is found at the first use.  named: sub-elements with a
    name; elements: those that have an index, to which the named ones are added at their first use.
    """

    inputs: Mapping[str, Span]
    outputs: Mapping[str, Span]
    channels: Mapping[str, int]
    """Numbers of input and output channels, under `in` and `out`."""
    variables: dict[str, Span] = field(default_factory=dict)
    macros: dict[str, Macro] = field(default_factory=dict)
    named: dict[str, Any] = field(default_factory=dict)
    elements: list[Any] = field(default_factory=list)


@dataclass(frozen=True)
class _Local:
    """A use of a macro's own variable, whose place is known when all other variables have one."""

    operator: str
    first: int
    size: int


@dataclass(frozen=True)
class _Place:
    """Where a word stands: in the main function, or in a macro whose own variables begin at `locals_at`."""

    node: Node
    line: int
    macro: Macro | None = None
    locals_at: int = 0

    def error(self, message: str, kind: type[IccBrdfError] = ProfileError) -> IccBrdfError:
        return self.node.error(message, line=self.line, kind=kind)

    def look_up(self, what: str, name: str, known: Mapping[str, T]) -> T:
        """What `name` stands for."""
        if name not in known:
            raise self.error(f"no {what} {name!r}: {nearest(name, known)}")
        return known[name]


def expand(main: Node, declared: Declarations) -> str:
    """The main function with numbers for all names and no macros, its lines where they are in the file.

    Raises ProfileError where something is not declared, and LimitError where the text gets too long.
    """
    return _Expansion(declared).text(main)


class _Expansion:
    """One main function on its way to numbers."""

    def __init__(self, declared: Declarations) -> None:
        self.declared = declared
        self.variables = declared.variables
        self.indices: dict[str, int] = {}
        self.next_slot = max((v.first + v.size for v in self.variables.values() if v.first >= 0), default=0)

    def text(self, main: Node) -> str:
        place = _Place(main, main.line)
        pieces = list(self._pieces(main.text, place, ()))
        words = (
            self._slots(p.operator, self.next_slot + p.first, p.size, place) if isinstance(p, _Local) else p
            for p in pieces
        )
        # As many line ends as there are lines before it in the file, so that errors name the file's lines.
        text = _BARE.sub(r"\1(0)", "".join(words))
        if lost := _LOST.search(text):
            place = replace(place, line=place.line + text.count("\n", 0, lost.start()))
            main.document.warn(place.error(f"{lost[0]} has no arguments: the ICC's iccToXml leaves them out"))
        return "\n" * (main.line - 1) + _NEGATIVE_NAN.sub("data(ffc00000)", text)

    def _pieces(self, text: str, place: _Place, calls: tuple[str, ...]) -> Iterator[str | _Local]:
        for token in _TOKEN.finditer(text):
            if token["blank"]:
                # A macro's lines are none of the main function's.
                yield " " if place.macro else token["blank"]
                place = replace(place, line=place.line + token["blank"].count("\n"))
                continue
            if token["comment"]:
                continue
            document = place.node.document
            if place.macro is None:
                document.main_words += 1
            else:
                document.words += 1
            if document.main_words > MAX_MAIN_WORDS:
                raise place.error(f"main functions have more than {MAX_MAIN_WORDS} words", LimitError)
            if document.words > MAX_WORDS:
                raise place.error(f"macros stand for more than {MAX_WORDS} words", LimitError)
            word = token["word"]
            if call := _CALL.fullmatch(word):
                yield from self._macro(call[1] or call[2], place, calls)
            elif _REFERRING.match(word):
                yield self._reference(word, place)
            else:
                yield word

    def _macro(self, name: str, place: _Place, calls: tuple[str, ...]) -> Iterator[str | _Local]:
        macro = place.look_up("macro", name, self.declared.macros)
        if name in calls:
            raise place.error(f"macro {name!r} calls itself, by way of {' '.join(calls)}")
        if len(calls) == MAX_CALLS:
            raise place.error(f"more than {MAX_CALLS} macros that call one another", LimitError)
        locals_at = place.locals_at + (place.macro.size if place.macro else 0)
        inner = _Place(macro.node, macro.node.line, macro, locals_at)
        return self._pieces(macro.text, inner, (*calls, name))

    def _reference(self, word: str, place: _Place) -> str | _Local:
        match = _REFERENCE.fullmatch(word)
        if match is None:
            raise place.error(f"found {word!r:.40}, expected operator{{name}} between blanks")
        operator, name = match["operator"], match["name"]
        if operator in ("in", "out"):
            return self._channels(operator, name, place)
        if operator in _MEMORY:
            return self._memory(operator, name, place)
        return f"{operator}({self._element(name, place)})"

    def _channels(self, operator: str, name: str, place: _Place) -> str:
        match = _CHANNEL.fullmatch(name)
        if match is None:
            raise place.error(
                f"found {operator}{{{name:.40}}}, expected name, name[first] or name[first],count"
            )
        kind = f"{operator}put"
        spans = self.declared.inputs if operator == "in" else self.declared.outputs
        span = place.look_up(f"{kind} channel", match["name"], spans)
        first = span.first + int(match["first"] or 0)
        size = int(match["count"] or 1) if match["first"] or match["count"] else span.size
        limit = self.declared.channels[operator]
        if size < 1 or first + size > limit:
            span = Span(first, size)
            raise place.error(f"{operator}{{{name}}}: found {kind}s {span}, expected up to {limit - 1}")
        return f"{operator}({first},{size})" if size > 1 else f"{operator}({first})"

    def _memory(self, operator: str, name: str, place: _Place) -> str | _Local:
        match = _VARIABLE.match(name)
        rest = name[match.end() :] if match else name
        if match is None or rest.strip("[]()"):
            raise place.error(
                f"found {operator}{{{name:.40}}}, expected name, name[index] or name[first,count]"
            )
        if rest:
            place.node.document.warn(place.error(f"{rest!r} after {operator}{{{match[0]} is ignored"))
        whole = match["name"]
        local = whole.startswith("@")
        if local and place.macro is None:
            raise place.error(f"found {operator}{{{name}}}, expected a macro around it")
        if local and place.macro:
            span = place.look_up("variable of the macro", whole[1:], place.macro.locals)
        else:
            span = self._variable(whole, place)
        first = int(match["first"] or 0)
        size = int(match["count"] or 1) if match["first"] else span.size
        if size < 1 or first + size > span.size:
            part = Span(first, size)
            raise place.error(f"{operator}{{{name}}}: found {part}, expected up to {span.size - 1}")
        if local:
            return _Local(operator, place.locals_at + span.first + first, size)
        return self._slots(operator, span.first + first, size, place)

    def _variable(self, name: str, place: _Place) -> Span:
        root, _, member = name.partition(".")
        span = place.look_up("variable", root, self.variables)
        if span.first < 0:
            span = replace(span, first=self.next_slot)
            self.variables[root] = span
            self.next_slot += span.size
        if not member:
            return span
        part = place.look_up(f"member of {root!r}", member, span.members)
        return Span(span.first + part.first, part.size)

    @staticmethod
    def _slots(operator: str, first: int, size: int, place: _Place) -> str:
        if first + size > SLOTS:
            raise place.error(f"variables take {first + size} slots, expected up to {SLOTS}")
        return f"{operator}({first},{size})" if size > 1 else f"{operator}({first})"

    def _element(self, name: str, place: _Place) -> int:
        if name not in self.indices:
            element = place.look_up("sub-element", name, self.declared.named)
            self.indices[name] = len(self.declared.elements)
            self.declared.elements.append(element)
        return self.indices[name]


# Writing -----------------------------------------------------------------------------------------------


def identifiers(names: Sequence[str]) -> list[str]:
    """The names as the dialect takes them: other characters become `_`, and equal ones get a number."""
    result: dict[str, None] = {}
    counts: dict[str, int] = {}
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
        unique = plain = plain if is_name(plain) else f"_{plain}"
        while unique in result:
            counts[plain] = counts.get(plain, 1) + 1
            unique = f"{plain}_{counts[plain]}"
        result[unique] = None
    return list(result)


_STORED = re.compile(r"\b(in|out|tget|tput|tsav)\((\d+)(?:,(\d+))?\)")
_BITS = re.compile(r"\bdata\(([0-9a-f]{8})\)")
_BITS_TEXT = {"7f800000": "1e999", "ff800000": "-1e999", "ffc00000": "-nan"}
"""Constants that the ICC's tools read from these texts; any other NaN stays in our own notation."""


def named(text: str, names: CalculatorSource | None, inputs: int) -> str:
    """A program's text with names of channels and temporaries where `names` has them.

    `inputs` is the number of input channels, which the ICC's tools hold the outputs against as well.
    """
    text = _BITS.sub(lambda match: _BITS_TEXT.get(match[1], match[0]), text)
    if names is None:
        return text
    channels = {"in": identifiers(names.inputs), "out": identifiers(names.outputs)}
    labels = identifiers([t.name for t in names.temporaries])
    variables = {
        slot: (temporary, label)
        for temporary, label in zip(names.temporaries, labels, strict=True)
        for slot in range(temporary.slot, temporary.slot + temporary.size)
    }

    def name(match: re.Match[str]) -> str:
        operator, first, size = match[1], int(match[2]), int(match[3] or 1)
        if operator in channels:
            if first + size > len(channels[operator]) or (size > 1 and first + size > inputs):
                return match[0]
            count = f",{size}" if size > 1 else ""
            return f"{operator}{{{channels[operator][first]}{count}}}"
        if first not in variables:
            return match[0]
        temporary, label = variables[first]
        offset = first - temporary.slot
        if offset + size > temporary.size:
            return match[0]
        part = "" if size == temporary.size else f"[{offset},{size}]" if size > 1 else f"[{offset}]"
        return f"{operator}{{{label}{part}}}"

    return _STORED.sub(name, text)
