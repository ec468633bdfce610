"""A finding: which rule a profile breaks, where, and how."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

from iccbrdf.icc.layout import shown
from iccbrdf.validate.rules import RULES, Rule


@dataclass(frozen=True)
class Place:
    """`text` names the structure, as `tag M2B0, element 0 (calc)`; `offset` is a byte of the file."""

    text: str
    offset: int | None = None
    tag: str | None = None

    @classmethod
    def of_tag(cls, signature: str, offset: int | None = None) -> Place:
        return cls(f"tag {shown(signature)}", offset, signature)

    def inner(self, name: str, offset: int | None) -> Place:
        """A structure inside this one, at byte `offset` of the file."""
        return replace(self, text=f"{self.text}, {name}", offset=offset)

    def at(self, offset: int | None) -> Place:
        """The same structure, another byte."""
        return replace(self, offset=offset)


@dataclass(frozen=True)
class Finding:
    """`message`: what was found, what was expected."""

    rule: Rule
    place: Place
    message: str

    @property
    def text(self) -> str:
        """One line, without the name of the file."""
        where = self.place.text
        if self.place.offset is not None:
            where += f": byte offset {self.place.offset}"
        return f"{self.rule.severity} {self.rule.id}: {where}: {self.message}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "rule": self.rule.id,
            "severity": self.rule.severity,
            "tag": self.place.tag,
            "place": self.place.text,
            "offset": self.place.offset,
            "message": self.message,
            "basis": self.rule.basis,
        }


def finding(rule: str, place: Place, message: str) -> Finding:
    """A breach of the rule of this id."""
    return Finding(RULES[rule], place, message)


# How Reader.error and its like begin their messages, after the name of the file.
_PLACED = re.compile(r"(?P<place>.*?): byte offset (?P<offset>\d+): (?P<message>.*)", re.DOTALL)


def of_message(rule: str, error: object, place: Place, source: str = "") -> Finding:
    """The finding that an error or a warning of the reader tells of; `place` where it names none."""
    text = str(error).removeprefix(f"{source}: ")
    placed = _PLACED.fullmatch(text)
    if placed is None:
        return finding(rule, place, text)
    here = replace(place, text=placed["place"], offset=int(placed["offset"]))
    return finding(rule, here, placed["message"])
