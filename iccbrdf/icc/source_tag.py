"""The private tag `bsrc`: what a profile was made from, and the names in its calculators.

Calculator programs hold numbers alone.  This tag keeps the readable side beside them: compressed text
(utf8ZipType) of JSON,

    {"schema": "iccbrdf.source/1",
     "calculators": [{"tag": "M2B0", "element": 0,
                      "inputs": ["kd.X", ...], "outputs": ["X", "Y", "Z"],
                      "temporaries": [["half", 0, 3], ...],
                      "constants": {"white": [0.9642, 1.0, 0.8249], "fresnel_angle": "theta_i"},
                      "effects": {"fresnel": true, ...},
                      "variables": {"litI": 3.141592653589793, ...},
                      "templates": [{"filename": "cook_torrance.calc", "source": ["line", ...]}]}],
     "recipe": {...}}

A calculator is named by the tag that holds it and its place among the elements of that tag.  A temporary
is a name, its first slot and how many slots it takes.  Templates that are compiled as a chain with these
constants, effects and variables (`iccbrdf.calc.compile_chain`) give the program.  The recipe is what the
build was asked for (`iccbrdf.build.recipe`).  Everything but `tag` may be missing.  Nothing in a profile's
meaning depends on this tag: programs without it run alike.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NoReturn

from iccbrdf.calc.program import Temporary
from iccbrdf.errors import LimitError, ProfileError, ProfileWarning, UsageError
from iccbrdf.icc.elements import Calculator, MultiProcess
from iccbrdf.icc.packed import CompressedUtf8
from iccbrdf.icc.tags import Utf8
from iccbrdf.json_text import to_json

if TYPE_CHECKING:
    from iccbrdf.calc.lower import Setting

SIGNATURE = "bsrc"
SCHEMA = "iccbrdf.source/1"
MAX_TEXT = 1 << 17
"""Bytes of the tag's text, which takes seconds to compile; ours has a tenth."""
MAX_CALCULATORS = 4
"""Calculators that a tag tells about."""


@dataclass(frozen=True)
class CalculatorSource:
    """What one calculator was made from.

    tag, element: the signature of the tag that holds it, and its index among the tag's elements.
    inputs, outputs: names of the channels, in order.  temporaries: named slots, none under two names.
    templates: texts with their filenames, a chain.  constants, effects, variables: what they were compiled
    with, all of them.
    """

    tag: str
    element: int = 0
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    temporaries: tuple[Temporary, ...] = ()
    templates: tuple[tuple[str, str], ...] = ()
    constants: Mapping[str, Setting] = field(default_factory=dict)
    effects: Mapping[str, bool] = field(default_factory=dict)
    variables: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for one, next_one in pairwise(sorted(self.temporaries, key=lambda t: t.slot)):
            if one.slot + one.size > next_one.slot:
                raise UsageError(
                    f"temporaries {one.name!r} and {next_one.name!r}: found both in slot {next_one.slot}, "
                    "expected every slot in one"
                )

    def lines(self) -> Iterator[str]:
        """For people: what it was compiled with, and the templates."""
        yield f"inputs {' '.join(self.inputs)}"
        yield f"outputs {' '.join(self.outputs)}"
        for name, setting in self.constants.items():
            yield f"{name} = {setting_text(setting)}"
        for name, on in self.effects.items():
            yield f"{name} = {'on' if on else 'off'}"
        for name, value in self.variables.items():
            yield f"{name} = {value:g} where it is not set"
        for text, filename in self.templates:
            yield ""
            yield f"{filename}:"
            yield from text.rstrip("\n").split("\n")

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        values: dict[str, Any] = {
            "tag": self.tag,
            "element": self.element,
            "inputs": list(self.inputs),
            "outputs": list(self.outputs),
            "temporaries": [[t.name, t.slot, t.size] for t in self.temporaries],
            "constants": {name: _lists(value) for name, value in self.constants.items()},
            "effects": dict(self.effects),
            "variables": dict(self.variables),
            "templates": [
                {"filename": filename, "source": text.split("\n")} for text, filename in self.templates
            ],
        }
        return {key: value for key, value in values.items() if value or key in ("tag", "element")}


@dataclass(frozen=True)
class Source:
    """What a profile was made from: its calculators, and the recipe as plain data."""

    calculators: tuple[CalculatorSource, ...] = ()
    recipe: Mapping[str, Any] = field(default_factory=dict)

    def tag(self) -> CompressedUtf8:
        """The tag, to be put in a profile under `SIGNATURE`."""
        return CompressedUtf8.of(to_json({"schema": SCHEMA, **self.plain()}) + "\n")

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {"calculators": [c.plain() for c in self.calculators], "recipe": dict(self.recipe)}

    def found_in(self, profile: Mapping[str, Any]) -> Iterator[tuple[Calculator, CalculatorSource]]:
        """The calculators of a profile that there is a source of, with it."""
        for source in self.calculators:
            tag = profile.get(source.tag)
            if not isinstance(tag, MultiProcess) or not 0 <= source.element < len(tag.elements):
                continue
            element = tag.elements[source.element]
            if not isinstance(element, Calculator):
                continue
            if len(source.inputs) <= element.inputs and len(source.outputs) <= element.outputs:
                yield element, source


def read_source(profile: Mapping[str, Any]) -> Source:
    """What the tag of a profile holds; nothing where it has none.

    Raises ProfileError where the tag is not as this module writes it, LimitError beyond the limits.
    """
    if SIGNATURE not in profile:
        return Source()
    try:
        data = json.loads(_text(profile[SIGNATURE]), parse_constant=_refuse)
        if not isinstance(data, dict) or data.get("schema") != SCHEMA:
            raise ValueError(f"expected a JSON object with the schema {SCHEMA!r}")
        items = _list(data, "calculators", dict)
        if len(items) > MAX_CALCULATORS:
            raise LimitError(f"found {len(items)} calculators, expected {MAX_CALCULATORS} at most")
        return Source(tuple(map(_calculator, items)), _dict(data, "recipe"))
    except (ValueError, RecursionError, UsageError, ProfileError) as error:
        raise ProfileError(f"tag {SIGNATURE}: {error}") from None
    except LimitError as error:
        raise LimitError(f"tag {SIGNATURE}: {error}") from None


def readable_source(profile: Mapping[str, Any], name: str) -> Source:
    """The same; a tag that cannot be read hinders nothing, but is warned of.  `name` is the profile's."""
    try:
        return read_source(profile)
    except (ProfileError, LimitError) as error:
        warnings.warn(f"{name}: {error}; programs are written without names", ProfileWarning, stacklevel=3)
        return Source()


def _lists(value: object) -> object:
    return [_lists(item) for item in value] if isinstance(value, tuple) else value


def setting_text(setting: Setting) -> str:
    """A constant for people, the rows of a table on one line."""
    if isinstance(setting, str):
        return setting
    rows = (row if isinstance(row, tuple) else (row,) for row in setting)
    separator = "; " if setting and isinstance(setting[0], tuple) else " "
    return separator.join(" ".join(f"{number:g}" for number in row) for row in rows)


def _text(tag: object) -> str:
    if isinstance(tag, CompressedUtf8):
        return tag.unpacked(MAX_TEXT)
    if not isinstance(tag, Utf8):
        raise ValueError(f"found type {getattr(tag, 'signature', '')!r}, expected 'zut8' or 'utf8'")
    if len(tag.text) > MAX_TEXT:
        raise LimitError(f"found more than {MAX_TEXT} characters")
    return tag.text


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"found {constant}, expected finite numbers")


def _calculator(item: dict[str, Any]) -> CalculatorSource:
    return CalculatorSource(
        tag=_value(item, "tag", ""),
        element=_value(item, "element", 0),
        inputs=tuple(_list(item, "inputs", str)),
        outputs=tuple(_list(item, "outputs", str)),
        temporaries=tuple(_temporary(entry) for entry in _list(item, "temporaries", list)),
        templates=tuple(_template(entry) for entry in _list(item, "templates", dict)),
        constants={key: _setting(key, value) for key, value in _dict(item, "constants").items()},
        effects={key: _switch(key, value) for key, value in _dict(item, "effects").items()},
        variables={key: _number(key, value) for key, value in _dict(item, "variables").items()},
    )


def _temporary(entry: list[Any]) -> Temporary:
    if len(entry) != 3 or not isinstance(entry[0], str):
        raise ValueError(f"temporaries: found {entry!r:.80}, expected [name, slot, size]")
    return Temporary(*entry)


def _template(entry: dict[str, Any]) -> tuple[str, str]:
    return "\n".join(_list(entry, "source", str)), _value(entry, "filename", "")


def _setting(key: str, value: object) -> Setting:
    if isinstance(value, str):
        return value
    if isinstance(value, list) and value and all(isinstance(row, list) for row in value):
        return tuple(tuple(_number(key, number) for number in row) for row in value)
    if isinstance(value, list):
        return tuple(_number(key, number) for number in value)
    raise ValueError(f"{key}: found {value!r:.80}, expected text, numbers or rows of numbers")


def _switch(key: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{key}: found {value!r:.80}, expected true or false")
    return value


def _number(key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{key}: found {value!r:.80}, expected a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{key}: found an integer that no float64 holds") from None


def _value(item: Mapping[str, Any], key: str, default: Any) -> Any:
    value = item.get(key, default)
    if type(value) is not type(default):
        raise ValueError(f"{key}: found {value!r:.80}, expected {'text' if default == '' else 'an integer'}")
    return value


def _list(item: Mapping[str, Any], key: str, kind: type) -> list[Any]:
    values = item.get(key, [])
    if not isinstance(values, list) or not all(type(v) is kind for v in values):
        raise ValueError(f"{key}: found {values!r:.80}, expected a list of {kind.__name__}")
    return values


def _dict(item: Mapping[str, Any], key: str) -> dict[str, Any]:
    values = item.get(key, {})
    if not isinstance(values, dict):
        raise ValueError(f"{key}: found {values!r:.80}, expected an object")
    return values
