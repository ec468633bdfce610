"""A calculator program in its four forms: operations, bytes, nested blocks and text."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from iccbrdf.calc.operators import OPERATORS, Operand
from iccbrdf.errors import LimitError, ProfileError, UsageError, nearest

MAX_NESTING = 64
"""Blocks inside blocks; no compiler needs more, and a hostile file would exhaust the call stack."""


class Op(NamedTuple):
    """One operation as stored: its signature without the padding blanks, and its four operand bytes as a u32.

    What the operand means (a float32, two u16, a count, a signature) is a column of the operator table,
    so that decode -> encode is lossless whatever stands in unused operands.
    """

    name: str
    operand: int = 0

    @property
    def s(self) -> int:
        """The first u16 of the operand."""
        return self.operand >> 16

    @property
    def t(self) -> int:
        """The second u16 of the operand."""
        return self.operand & 0xFFFF

    @property
    def value(self) -> float:
        """The operand read as a float32 (`data`)."""
        return float(struct.unpack(">f", struct.pack(">I", self.operand))[0])


Program: TypeAlias = tuple[Op, ...]

SLOTS = 65536
"""Temporary channels of a calculator (ICC.2)."""


@dataclass(frozen=True)
class Temporary:
    """A name for `size` neighbouring temporary channels from `slot` on."""

    name: str
    slot: int
    size: int = 1

    def __post_init__(self) -> None:
        numbers = isinstance(self.slot, int) and isinstance(self.size, int)
        if not numbers or not 0 <= self.slot < self.slot + self.size <= SLOTS:
            raise UsageError(
                f"temporary {self.name!r}: found slot {self.slot}, size {self.size}, "
                f"expected them within {SLOTS} slots"
            )


# Bytes -------------------------------------------------------------------------------------------------


def decode_ops(data: bytes, where: str) -> Program:
    """The operations in `data`, eight bytes each.

    `where` names the place for messages.  Unknown operators are kept: the verifier refuses them.
    Raises ProfileError if `data` is no whole number of operations.
    """
    if len(data) % 8:
        raise ProfileError(f"{where}: {len(data)} bytes of operations, expected a multiple of 8")
    return tuple(
        Op(name.decode("latin-1").rstrip(" "), operand) for name, operand in struct.iter_unpack(">4sI", data)
    )


def encode_ops(program: Program) -> bytes:
    """The operations as bytes, eight each; the inverse of `decode_ops`."""
    return b"".join(struct.pack(">4sI", op.name.encode("latin-1").ljust(4), op.operand) for op in program)


def signature(name: str) -> int:
    """The u32 of a name of at most four characters, padded with blanks (operand of `env`)."""
    return int.from_bytes(name.encode("latin-1").ljust(4), "big")


def signature_name(operand: int) -> str:
    """The inverse of `signature`, without the padding."""
    return operand.to_bytes(4, "big").decode("latin-1").rstrip(" ")


# Nested blocks -----------------------------------------------------------------------------------------


class Step(NamedTuple):
    """An operation in its block.

    `if` has one branch and `sel` one a case; `otherwise` is the block of `else` or `dflt`, None where
    there is none.  `heads` counts the operations that announce the blocks, this one included.
    """

    op: Op
    position: int
    branches: tuple[Block, ...] = ()
    otherwise: Block | None = None
    heads: int = 1


Block: TypeAlias = tuple[Step, ...]


def nest(program: Program, where: str = "calculator") -> Block:
    """The program as nested blocks; `where` names its place for messages.

    Raises ProfileError where a control operator is misplaced or a block leaves the one around it, and
    LimitError for more than MAX_NESTING levels.
    """
    return _nest(program, where, 0, len(program), 0)


def _nest(program: Program, where: str, start: int, end: int, level: int) -> Block:
    if level > MAX_NESTING:
        raise LimitError(f"{where}: op {start}: blocks are nested more than {MAX_NESTING} deep")
    steps = []
    position = start
    while position < end:
        op = program[position]
        if op.name in _AFTER:
            raise ProfileError(
                f"{where}: op {position}: found {op.name!r}, expected only directly after {_AFTER[op.name]}"
            )
        if op.name not in ("if", "sel"):
            steps.append(Step(op, position))
            position += 1
            continue
        heads = _heads(program, where, position, end)
        body = position + len(heads)
        blocks = []
        for head in heads if op.name == "if" else heads[1:]:
            if head.operand > end - body:
                raise ProfileError(
                    f"{where}: op {position}: the {head.name!r} block has {head.operand} operations,"
                    f" expected at most {end - body}, what is left of the block around it"
                )
            blocks.append(_nest(program, where, body, body + head.operand, level + 1))
            body += head.operand
        otherwise = blocks.pop() if heads[-1].name in ("else", "dflt") else None
        steps.append(Step(op, position, tuple(blocks), otherwise, len(heads)))
        position = body
    return tuple(steps)


_AFTER = {"else": "'if'", "case": "'sel' or 'case'", "dflt": "'case'"}
_FOLLOWERS = {"if": ("else",), "sel": ("case",), "case": ("case", "dflt")}


def _heads(program: Program, where: str, position: int, end: int) -> Program:
    """The operations that stand together before the blocks of the `if` or `sel` at `position`."""
    last = position
    while last + 1 < end and program[last + 1].name in _FOLLOWERS.get(program[last].name, ()):
        last += 1
    if program[last].name == "sel":
        raise ProfileError(f"{where}: op {position}: 'sel' without a case, expected 'case' directly after it")
    return program[position : last + 1]


# Text --------------------------------------------------------------------------------------------------

# Least value and default of the arguments that are stored in S and T, as what they exceed the least by.
_ARGUMENTS: Mapping[Operand, tuple[tuple[int, int | None], ...]] = {
    Operand.NONE: (),
    Operand.RANGE: ((0, None), (1, 1)),
    Operand.COUNT: ((1, 1),),
    Operand.COUNT_FROM_TWO: ((2, 2),),
    Operand.PAIR: ((1, 1), (1, 1)),
    Operand.ELEMENT: ((0, None),),
}
_ELEMENT_OPERATORS = [name for name, operator in OPERATORS.items() if operator.operand is Operand.ELEMENT]
_TOKEN = re.compile(
    rf"""(?P<skip>\s+|[%;/][^\n]*)
    | (?P<brace>[{{}}])
    | (?P<applied>{"|".join(_ELEMENT_OPERATORS)})\s*\{{\s*(?P<element>[A-Za-z_]\w*)\s*\}}
    | (?P<word>[^\s{{}}()\[\]%;/]+)(?:\s*[(\[](?P<argument>[^()\[\]{{}}]*)[)\]])?
    """,
    re.VERBOSE,
)
_NUMBER = re.compile(r"-?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_BITS = re.compile(r"[0-9a-fA-F]{8}")


def parse(text: str, names: Mapping[str, int] | None = None) -> Program:
    """The operations of a program written as text, with or without the braces around it.

    Operators take their operand in ( ) or [ ]: `in(0,3)`, `sum(4)`, `mtx(0)`; `if {...} else {...}` and
    `sel case {...} case {...} dflt {...}` take blocks; a comment runs from `%`, `;` or `/` to the end of
    its line.  `env` takes a name of one to four characters or eight hexadecimal digits; so does `data`
    where the number is no decimal one.  `names` maps the names of sub-elements, used as `mtx{name}`, to
    their indices.

    Raises ProfileError (line and column, what was found and expected) and LimitError for more than
    MAX_NESTING levels.
    """
    return tuple(_Parser(text, names or {}).program())


class _Parser:
    """Recursive descent over the tokens of one text."""

    def __init__(self, text: str, names: Mapping[str, int]) -> None:
        self.text = text
        self.names = names
        self.position = 0
        self.token = self._next()

    def program(self) -> list[Op]:
        if self._at("{"):
            ops = self._braced(0)
        else:
            ops = self._ops(0)
        if self.token is not None:
            raise self._error(f"found {self.token[0]!r}, expected the end of the program")
        return ops

    def _next(self) -> re.Match[str] | None:
        """Go to the next token, past blanks and comments."""
        while self.position < len(self.text):
            match = _TOKEN.match(self.text, self.position)
            if match is None:
                self.token = None
                raise self._error(f"found {self.text[self.position]!r}, expected an operator or a number")
            self.position = match.end()
            if match["skip"] is None:
                return match
        return None

    def _error(self, message: str) -> ProfileError:
        offset = self.token.start() if self.token is not None else self.position
        line = self.text.count("\n", 0, offset) + 1
        column = offset - self.text.rfind("\n", 0, offset)
        return ProfileError(f"program text, line {line}, column {column}: {message}")

    def _at(self, token: str) -> bool:
        return self.token is not None and self.token[0] == token

    def _advance(self) -> None:
        self.token = self._next()

    def _braced(self, level: int) -> list[Op]:
        """The operations between braces; `level` counts the braces around them."""
        if not self._at("{"):
            found = repr(self.token[0]) if self.token is not None else "the end of the text"
            raise self._error(f"found {found}, expected '{{'")
        if level > MAX_NESTING:
            raise LimitError(f"program text: blocks are nested more than {MAX_NESTING} deep")
        self._advance()
        ops = self._ops(level)
        if not self._at("}"):
            raise self._error("the text ends inside a block, expected '}'")
        self._advance()
        return ops

    def _ops(self, level: int) -> list[Op]:
        ops: list[Op] = []
        while self.token is not None and self.token["brace"] is None:
            if self._at("if") or self._at("sel"):
                ops += self._choice(level)
            else:
                ops.append(self._op(self.token))
                self._advance()
        if self._at("{"):
            raise self._error("found '{', expected an operator or a number")
        return ops

    def _choice(self, level: int) -> list[Op]:
        """`if` or `sel` with all that belongs to it: first what announces the blocks, then the blocks."""
        heads: list[Op] = []
        bodies: list[Op] = []

        def block(word: str) -> None:
            self._advance()
            body = self._braced(level + 1)
            heads.append(Op(word, len(body)))
            bodies.extend(body)

        if self._at("if"):
            block("if")
            if self._at("else"):
                block("else")
            return heads + bodies
        heads.append(Op("sel"))
        self._advance()
        if not self._at("case"):
            raise self._error("expected 'case' directly after 'sel'")
        while self._at("case"):
            block("case")
        if self._at("dflt"):
            block("dflt")
        return heads + bodies

    def _op(self, token: re.Match[str]) -> Op:
        if token["applied"]:
            if token["element"] not in self.names:
                hint = nearest(token["element"], self.names)
                raise self._error(f"no sub-element {token['element']!r}: {hint}")
            return Op(token["applied"], self.names[token["element"]] << 16)
        word, argument = token["word"], token["argument"]
        if word[0].isdigit() or word[0] == "." or (word[0] == "-" and word not in OPERATORS):
            if argument is not None or not _NUMBER.fullmatch(word):
                raise self._error(f"found {token[0]!r}, expected a number")
            return Op("data", self._bits(word))
        if word not in OPERATORS:
            raise self._error(f"no operator {word!r}: {nearest(word, OPERATORS)}")
        operand = OPERATORS[word].operand
        if operand is Operand.NONE and argument is not None:
            raise self._error(f"{word!r} takes no argument, found {argument!r}")
        if operand is Operand.LENGTH:
            raise self._error(
                f"found {token[0]!r} out of place; blocks are written if {{}} else {{}} or"
                " sel case {} dflt {}"
            )
        return Op(word, self._operand(word, operand, argument))

    def _bits(self, number: str) -> int:
        try:
            return int.from_bytes(struct.pack(">f", float(number)), "big")
        except OverflowError:
            raise self._error(f"found {number!r}, expected a number that float32 holds") from None

    def _operand(self, word: str, operand: Operand, argument: str | None) -> int:
        if operand in (Operand.FLOAT, Operand.SIGNATURE):
            if argument is not None and _BITS.fullmatch(argument):
                return int(argument, 16)
            if operand is Operand.SIGNATURE and argument is not None and 1 <= len(argument) <= 4:
                return signature(argument)
            expected = "1 to 4 characters or " if operand is Operand.SIGNATURE else ""
            raise self._error(f"{word!r} has the argument {argument}, expected {expected}8 hex digits")
        fields = _ARGUMENTS[operand]
        given = [] if argument is None else [part.strip() for part in argument.split(",")]
        if len(given) > len(fields):
            raise self._error(f"{word!r} has {len(given)} arguments, expected at most {len(fields)}")
        stored = [0, 0]
        for place, (least, default) in enumerate(fields):
            written = given[place] if place < len(given) else default
            if written is None:
                raise self._error(f"{word!r} has no argument, expected {word}(index)")
            if not (re.fullmatch(r"[0-9]{1,5}", str(written)) and least <= int(written) <= least + 0xFFFF):
                span = f"{least} to {least + 0xFFFF}"
                raise self._error(
                    f"{word!r} has the argument {written!r:.40}, expected an integer from {span}"
                )
            stored[place] = int(written) - least
        return stored[0] << 16 | stored[1]


def listing(program: Program, temporaries: Sequence[Temporary] = ()) -> str:
    """The program as text that `parse` turns into the same program: blocks indented, a line for each `out`.

    Where values are stored whose names `temporaries` tells, a comment names them.  Bits of an operand that
    its operator does not use are not shown.  Raises ProfileError for a program with an unknown operator or
    broken blocks.
    """
    names = {slot: t.name for t in temporaries for slot in range(t.slot, t.slot + t.size)}
    return "\n".join(_lines(nest(program), "", names)) + "\n"


def _lines(block: Block, indent: str, names: Mapping[int, str]) -> Iterator[str]:
    line: list[str] = []
    for step in block:
        line.append(written(step.op))
        for word, body in _named_blocks(step):
            if word is not None:
                line.append(word)
            lines = list(_lines(body, indent + "  ", names))
            if len(lines) < 2 and len("".join(lines)) < 50 and "%" not in "".join(lines):
                line += ["{", *(text.strip() for text in lines), "}"]
                continue
            yield indent + " ".join([*line, "{"])
            yield from lines
            line = ["}"]
        # A result is where a reader wants to pause, a long line where the eye must.
        stored = _stored_names(step.op, names)
        if stored or step.op.name in ("out", "tput", "tsav") or sum(map(len, line)) > 80:
            yield indent + " ".join(line) + (f"  % {' '.join(stored)}" if stored else "")
            line = []
    if line:
        yield indent + " ".join(line)


def _stored_names(op: Op, names: Mapping[int, str]) -> list[str]:
    """The names of what an operation stores, in order, as far as they keep to their line."""
    if op.name not in ("tput", "tsav"):
        return []
    found = (names.get(slot, "") for slot in range(op.s, op.s + op.t + 1))
    return [name for name in dict.fromkeys(found) if name and name.isprintable()]


def _named_blocks(step: Step) -> Iterator[tuple[str | None, Block]]:
    """The blocks of an `if` or `sel` with the words before them; that of `if` is its own name."""
    for body in step.branches:
        yield (None if step.op.name == "if" else "case"), body
    if step.otherwise is not None:
        yield ("else" if step.op.name == "if" else "dflt"), step.otherwise


def written(op: Op) -> str:
    """One operation as text; of a control operator the name alone.  Raises ProfileError if it is unknown."""
    if op.name not in OPERATORS:
        raise ProfileError(f"no operator {op.name!r}: {nearest(op.name, OPERATORS)}")
    operand = OPERATORS[op.name].operand
    if operand is Operand.FLOAT:
        return _number(op) if math.isfinite(op.value) else f"{op.name}({op.operand:08x})"
    if operand is Operand.SIGNATURE:
        name = signature_name(op.operand)
        plain = re.fullmatch(r"[A-Za-z0-9_]{1,4}", name) is not None
        return f"{op.name}({name})" if plain else f"{op.name}({op.operand:08x})"
    if operand is Operand.LENGTH:
        return op.name
    fields = _ARGUMENTS[operand]
    values = [stored + least for stored, (least, _) in zip((op.s, op.t), fields, strict=False)]
    while values and values[-1] == fields[len(values) - 1][1]:
        values.pop()
    return f"{op.name}({','.join(map(str, values))})" if values else op.name


def _number(op: Op) -> str:
    """The shortest decimal that gives the float32 back; nine digits always do."""
    texts = (f"{op.value:.{digits}g}" for digits in range(6, 10))
    return next(text for text in texts if struct.pack(">f", float(text)) == struct.pack(">f", op.value))
