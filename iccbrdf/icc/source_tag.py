"""The private tag `bsrc`: what the calculators of a profile were compiled from, and the names in it.

Calculator programs hold numbers alone.  This tag keeps the readable side beside them: a utf8Type of JSON,

    {"schema": "iccbrdf.source/1",
     "calculators": [{"tag": "M2B0", "element": 0,
                      "inputs": ["kd.X", ...], "outputs": ["X", "Y", "Z"],
                      "temporaries": [["half", 0, 3], ...],
                      "filename": "cook_torrance.calc", "source": ["line", ...]}]}

A calculator is named by the tag that holds it and its place among the elements of that tag.  A temporary
is a name, its first slot and how many slots it takes.  Everything but `tag` may be missing.  Nothing in
a profile's meaning depends on this tag: programs without it run alike.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from iccbrdf.errors import ProfileError, UsageError
from iccbrdf.icc.tags import Utf8

SIGNATURE = "bsrc"
SCHEMA = "iccbrdf.source/1"
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


@dataclass(frozen=True)
class CalculatorSource:
    """What one calculator was made from.

    tag, element: the signature of the tag that holds it, and its index among the tag's elements.
    inputs, outputs: names of the channels, in order.  temporaries: named slots, none under two names.
    filename, source: the text that it was compiled from, and where that stood.
    """

    tag: str
    element: int = 0
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    temporaries: tuple[Temporary, ...] = ()
    filename: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        for one, next_one in pairwise(sorted(self.temporaries, key=lambda t: t.slot)):
            if one.slot + one.size > next_one.slot:
                raise UsageError(
                    f"temporaries {one.name!r} and {next_one.name!r}: found both in slot {next_one.slot}, "
                    "expected every slot in one"
                )


def source_tag(*calculators: CalculatorSource) -> Utf8:
    """The tag, to be put in a profile under `SIGNATURE`."""
    data = {"schema": SCHEMA, "calculators": [_plain(c) for c in calculators]}
    return Utf8(json.dumps(data, ensure_ascii=False, indent=1) + "\n")


def _plain(calculator: CalculatorSource) -> dict[str, Any]:
    values = {
        "tag": calculator.tag,
        "element": calculator.element,
        "inputs": list(calculator.inputs),
        "outputs": list(calculator.outputs),
        "temporaries": [[t.name, t.slot, t.size] for t in calculator.temporaries],
        "filename": calculator.filename,
        "source": calculator.source.split("\n") if calculator.source else [],
    }
    return {key: value for key, value in values.items() if value or key in ("tag", "element")}


def read_sources(profile: Mapping[str, Any]) -> tuple[CalculatorSource, ...]:
    """What the tag of a profile holds; nothing where it has none.

    Raises ProfileError where the tag is not as this module writes it.
    """
    if SIGNATURE not in profile:
        return ()
    tag = profile[SIGNATURE]
    try:
        if not isinstance(tag, Utf8):
            raise ValueError(f"found type {tag.signature!r}, expected 'utf8'")
        data = json.loads(tag.text)
        if not isinstance(data, dict) or data.get("schema") != SCHEMA:
            raise ValueError(f"expected a JSON object with the schema {SCHEMA!r}")
        return tuple(_calculator(item) for item in _list(data, "calculators", dict))
    except (ValueError, RecursionError, UsageError) as error:
        raise ProfileError(f"tag {SIGNATURE}: {error}") from None


def _calculator(item: dict[str, Any]) -> CalculatorSource:
    return CalculatorSource(
        tag=_value(item, "tag", ""),
        element=_value(item, "element", 0),
        inputs=tuple(_list(item, "inputs", str)),
        outputs=tuple(_list(item, "outputs", str)),
        temporaries=tuple(_temporary(entry) for entry in _list(item, "temporaries", list)),
        filename=_value(item, "filename", ""),
        source="\n".join(_list(item, "source", str)),
    )


def _temporary(entry: list[Any]) -> Temporary:
    if len(entry) != 3 or not isinstance(entry[0], str):
        raise ValueError(f"temporaries: found {entry!r}, expected [name, slot, size]")
    return Temporary(*entry)


def _value(item: Mapping[str, Any], key: str, default: Any) -> Any:
    value = item.get(key, default)
    if type(value) is not type(default):
        raise ValueError(f"{key}: found {value!r}, expected {'text' if default == '' else 'an integer'}")
    return value


def _list(item: Mapping[str, Any], key: str, kind: type) -> list[Any]:
    values = item.get(key, [])
    if not isinstance(values, list) or not all(type(v) is kind for v in values):
        raise ValueError(f"{key}: found {values!r:.80}, expected a list of {kind.__name__}")
    return values
