"""A profile as data for JSON, and as text to read.  Both follow from the fields of the records."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from iccbrdf.calc.program import Op, Program
from iccbrdf.errors import IccBrdfError, LimitError
from iccbrdf.icc.profile import Profile
from iccbrdf.icc.sequence import EmbeddedProfile

Listing: TypeAlias = Callable[[Program], str]
"""Gives the text of a calculator program."""

MAX_PROFILES = 16
"""Profiles inside tags that are shown, those inside of them counted too."""
MAX_CHARACTERS = 1 << 24
"""Of all that is shown of a profile, about: parts that are shared are shown wherever they stand."""

_VALUE = 16
"""Characters of a value that is no text."""


def to_dict(profile: Profile, *, listing: Listing | None = None, longest: int = 64) -> dict[str, Any]:
    """Header and tags as dicts, lists, texts and numbers that `json` takes as they are.

    Arrays and bytes with more than `longest` entries are summarised by shape, extremes and their beginning.
    Programs appear as the lines of `listing`, else as their number of operations.  A tag that cannot
    be decoded has an `error`, as has a profile inside a tag, of which the first `MAX_PROFILES` are shown,
    and a tag with which more than `MAX_CHARACTERS` would be shown.
    What no JSON number can be is text: "NaN", "Infinity", "-Infinity".
    """
    return _Plain(listing, longest).profile(profile)


def describe(profile: Profile, *, listing: Listing | None = None, longest: int = 16) -> str:
    """The same to read: one line a field, with byte offsets and sizes of the tags."""
    return "\n".join(_lines(to_dict(profile, listing=listing, longest=longest), "")) + "\n"


class _Plain:
    """Turns records and their values into plain data."""

    def __init__(self, listing: Listing | None, longest: int) -> None:
        self.listing = listing
        self.longest = longest
        self._profiles_left = MAX_PROFILES
        self._left = MAX_CHARACTERS

    def spend(self, characters: int) -> None:
        """Count what is shown; LimitError where it gets too much."""
        self._left -= characters
        if self._left < 0:
            self._left = 0
            raise LimitError(f"not shown: with it there are more than {MAX_CHARACTERS} characters")

    def profile(self, profile: Profile) -> dict[str, Any]:
        return {
            "source": profile.source,
            "header": self.record(profile.header),
            "tags": {signature: self.tag(profile, signature) for signature in profile},
        }

    def embedded(self, record: EmbeddedProfile) -> dict[str, Any]:
        if not self._profiles_left:
            return {}
        self._profiles_left -= 1
        try:
            return {"profile": self.profile(record.profile)}
        except IccBrdfError as error:
            return {"profile": {"error": str(error)}}

    def tag(self, profile: Profile, signature: str) -> dict[str, Any]:
        where = {"offset": profile.tag_offset(signature), "size": profile.tag_size(signature)}
        try:
            return where | self.record(profile[signature])
        except IccBrdfError as error:
            return where | {"error": str(error)}

    def record(self, record: Any) -> dict[str, Any]:
        head = {"signature": record.signature} if hasattr(record, "signature") else {}
        names = [f.name for f in fields(record) if f.name != "signature"]
        # Channel counts that follow from a table are worth a line, before the fields that are stored.
        names = [n for n in ("inputs", "outputs") if hasattr(record, n) and n not in names] + names
        inside = self.embedded(record) if isinstance(record, EmbeddedProfile) else {}
        return head | {name: self.value(getattr(record, name)) for name in names} | inside

    def value(self, value: Any) -> Any:
        self.spend(len(value) if isinstance(value, str) else _VALUE)
        if isinstance(value, np.ndarray):
            return self.array(value)
        if isinstance(value, bytes):
            return value.hex() if len(value) <= self.longest else {
                "bytes": len(value), "first": value[: self.longest].hex()
            }  # fmt: skip
        if isinstance(value, float):
            return _number(value)
        if isinstance(value, tuple):
            if value and all(isinstance(v, Op) for v in value):
                return self.program(value)
            return [self.value(v) for v in value]
        if is_dataclass(value):
            return self.record(value)
        return value

    def program(self, program: Program) -> Any:
        if self.listing is None:
            return {"operations": len(program)}
        text = self.listing(program)
        self.spend(len(text))
        return text.splitlines()

    def array(self, array: npt.NDArray[Any]) -> Any:
        if array.size <= self.longest:
            return _numbers(array)
        return {
            "shape": list(array.shape),
            "minimum": _number(array.min()),
            "maximum": _number(array.max()),
            "first": _numbers(array.reshape(-1)[: self.longest]),
        }


def _numbers(array: npt.NDArray[Any]) -> Any:
    return [_numbers(row) for row in array] if array.ndim else _number(array[()])


def _number(value: Any) -> Any:
    """The shortest decimal that gives `value` back, in single precision if it has no more."""
    if isinstance(value, np.integer):
        return int(value)
    if math.isfinite(value):
        exact = float(value)
        if abs(exact) < 1e38 and np.float32(exact) == exact:
            # Not str: its digits are a setting of the process, which other packages change.
            return float(np.format_float_scientific(np.float32(exact)))
        return exact
    return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"


def _lines(data: dict[str, Any], indent: str) -> Iterator[str]:
    for key, value in data.items():
        name = printable(key)
        if isinstance(value, dict):
            yield f"{indent}{name}"
            yield from _lines(value, indent + "  ")
        elif isinstance(value, list) and any(isinstance(v, (dict, str)) for v in value):
            yield f"{indent}{name}"
            for index, item in enumerate(value):
                if isinstance(item, dict):
                    yield f"{indent}  [{index}]"
                    yield from _lines(item, indent + "    ")
                else:
                    yield f"{indent}  {printable(item)}"
        else:
            yield f"{indent}{name:<18}{printable(value)}"


def printable(value: Any) -> str:
    """`value` as text that keeps to its line and moves no terminal, whatever a profile holds."""
    text = str(value)
    return text if text.isprintable() else repr(text)
