"""JSON files of measured figures, read with checks: every error names the file, the entry and the key."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from iccbrdf.errors import InputError, nearest
from iccbrdf.files import StrPath, as_text, read_whole

MAX_BYTES = 1 << 24
"""Of a JSON file, which takes up to thirty times its bytes in memory."""


@dataclass(frozen=True)
class Record:
    """One object of a JSON file and where it stands in it."""

    file: str
    place: str
    values: dict[str, Any]

    def error(self, message: str) -> InputError:
        """Return an error about this record, to be raised by the caller."""
        return InputError(": ".join(part for part in (self.file, self.place, message) if part))

    def check_keys(self, keys: Iterable[str]) -> None:
        """Refuse keys that nothing reads, which are misspelt ones."""
        keys = tuple(keys)
        for key in self.values:
            if key not in keys:
                raise self.error(f"unknown key {key!r}: {nearest(key, keys)}")

    def get(self, key: str, kind: type, expected: str) -> Any:
        """Return the value of a key that must be there and of a type."""
        if key not in self.values:
            raise self.error(f"the key {key!r} is missing, expected {expected}")
        value = self.values[key]
        if not isinstance(value, kind):
            raise self.error(f"{key} is {_shown(value)}, expected {expected}")
        return value

    def text(self, key: str) -> str:
        """Return a text that is not empty."""
        value: str = self.get(key, str, "a text")
        if not value.strip():
            raise self.error(f"{key} is empty, expected a text")
        # JSON may name half of a surrogate pair, which no file can hold.
        if as_text(value) != value:
            raise self.error(f"{key} is {value!r}, expected Unicode text")
        return value

    def choice(self, key: str, valid: Iterable[str]) -> str:
        """Return a text that is one of the valid ones."""
        valid = tuple(valid)
        value = self.text(key)
        if value not in valid:
            raise self.error(f"unknown {key} {value!r}: {nearest(value, valid)}")
        return value

    def number(self, key: str, low: float, high: float = math.inf) -> float:
        """Return a finite number within bounds."""
        expected = f"a number {_range(low, high)}"
        return self._checked(key, self.get(key, object, expected), low, high)

    def numbers(self, key: str, count: int, low: float, high: float = math.inf) -> tuple[float, ...]:
        """Return a list of so many finite numbers within bounds."""
        expected = f"a list of {count} numbers {_range(low, high)}"
        values = self.get(key, list, expected)
        if len(values) != count:
            raise self.error(f"{key} has {len(values)} numbers, expected {count}")
        return tuple(self._checked(f"{key}[{k}]", value, low, high) for k, value in enumerate(values))

    def record(self, key: str) -> Record:
        """Return an object as a record of its own."""
        return Record(self.file, _join(self.place, key), self.get(key, dict, "an object"))

    def records(self, key: str, singular: str) -> tuple[Record, ...]:
        """Return a list of objects, not empty; an object's place is its number, from 1, and its name."""
        values = self.get(key, list, "a list of objects")
        if not values:
            raise self.error(f"{key} is empty, expected at least one object")
        found = []
        for number, value in enumerate(values, start=1):
            place = _join(self.place, f"{singular} {number}")
            if not isinstance(value, dict):
                raise Record(self.file, place, {}).error(f"is {_shown(value)}, expected an object")
            if isinstance(value.get("name"), str):
                place += f" ({value['name']})"
            found.append(Record(self.file, place, value))
        return tuple(found)

    def _checked(self, where: str, value: Any, low: float, high: float) -> float:
        # True is an int to Python, and JSON brings NaN, Infinity and integers that no float holds.
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if is_number and low <= value <= min(high, sys.float_info.max):
            return float(value)
        raise self.error(f"{where} is {_shown(value)}, expected a number {_range(low, high)}")


def read_record(path: StrPath, schema: str, version: int) -> Record:
    """
    Read a JSON file whose outermost object says by `schema` and `version` what it is.

    Raises
    ------
    InputError
        The file cannot be read, is not JSON, states a key twice, or is of another schema or version.
    LimitError
        The file is larger than MAX_BYTES.
    """
    file = str(path)

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for key, value in pairs:
            if key in values:
                raise InputError(f"{file}: the key {key!r} stands twice in one object, expected once")
            values[key] = value
        return values

    data = read_whole(path, MAX_BYTES)
    try:
        values = json.loads(data, object_pairs_hook=once)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: is not a JSON file: {error}") from error
    if not isinstance(values, dict):
        raise InputError(f"{file}: holds {_shown(values)}, expected an object")
    record = Record(file, "", values)
    record.choice("schema", [schema])
    if record.number("version", 1) != version:
        raise record.error(f"version is {values['version']}, expected {version}")
    return record


def _join(place: str, name: str) -> str:
    return f"{place}, {name}" if place else name


def _range(low: float, high: float) -> str:
    return f"of at least {low:g}" if math.isinf(high) else f"from {low:g} to {high:g}"


def _shown(value: object) -> str:
    shown = json.dumps(value, ensure_ascii=False)
    return shown if len(shown) <= 40 else f"{shown[:37]}..."
