"""What differs between two profiles, structure by structure."""

from __future__ import annotations

import difflib
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Literal

import numpy as np

from iccbrdf.calc.program import Op, Program
from iccbrdf.errors import IccBrdfError, LimitError
from iccbrdf.icc.layout import shown
from iccbrdf.icc.packed import CompressedUtf8
from iccbrdf.icc.profile import Profile
from iccbrdf.icc.text import Listing

MAX_LINES = 5000
"""Programs and texts of more lines are not compared by these: a line diff takes quadratic time."""
MAX_TEXT = 1 << 17
"""Bytes of a compressed text; longer ones are compared as they are."""
MAX_WORK = 1 << 28
"""Of a comparison, in numbers of arrays: parts that are shared are compared wherever they are."""

_VALUE = 256
"""What a value takes that is no array."""
_ITEM: Mapping[type, int] = {tuple: 64, str: 4, bytes: 1}
"""What each item takes of one that has several: an operation of a program is listed."""

_COMPUTED = ("size", "profile_id")
"""Header fields that follow from the rest of the file."""
_LONGEST = 60
"""Characters of a value that a message shows."""


@dataclass(frozen=True)
class Difference:
    """`message` says it in a line, `data` is for JSON, `lines` are a unified diff of programs or texts."""

    place: str
    change: Literal["added", "removed", "changed"]
    message: str
    data: Mapping[str, Any] = field(default_factory=dict)
    lines: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        data = {"place": self.place, "change": self.change, "message": self.message, **self.data}
        return data | {"lines": list(self.lines)} if self.lines else data


def compare(a: Profile, b: Profile, *, listing: Listing) -> list[Difference]:
    """What must change for `a` to become `b`: header fields, tags, and what is inside of tags.

    Size and profile ID, which follow from the rest, the order of the tags and the bytes between them do
    not count.  Programs are compared by the lines of `listing`, compressed texts by keys where they are JSON
    (as the source of a profile is) and else by lines.  A tag that cannot be decoded on either side is
    compared by its bytes.  Raises LimitError where that would take more than MAX_WORK.
    """
    return list(_Comparison(listing).profiles(a, b))


class _Comparison:
    """Walks two structures in step."""

    def __init__(self, listing: Listing) -> None:
        self.listing = listing
        self._left = MAX_WORK

    def spend(self, work: int, place: str) -> None:
        """Count what is done; LimitError where it gets too much."""
        self._left -= work
        if self._left < 0:
            raise LimitError(f"{place}: to compare it and what is before it takes more than the limit")

    def profiles(self, a: Profile, b: Profile) -> Iterator[Difference]:
        for name in (f.name for f in fields(a.header) if f.name not in _COMPUTED):
            yield from self.values(getattr(a.header, name), getattr(b.header, name), f"header, {name}")
        for signature in dict.fromkeys([*a, *b]):
            place = f"tag {shown(signature)}"
            if signature not in b:
                yield Difference(place, "removed", f"{a.tag_size(signature)} bytes")
            elif signature not in a:
                yield Difference(place, "added", f"{b.tag_size(signature)} bytes")
            else:
                # Tags may share what they hold.
                self.spend(a.tag_size(signature) + b.tag_size(signature), place)
                if a.tag_data(signature) != b.tag_data(signature):
                    yield from self.tags(a, b, signature, place)

    def tags(self, a: Profile, b: Profile, signature: str, place: str) -> Iterator[Difference]:
        try:
            first, second = a[signature], b[signature]
        except IccBrdfError:
            yield from self.values(a.tag_data(signature), b.tag_data(signature), place)
        else:
            yield from self.values(first, second, place)

    def values(self, a: Any, b: Any, place: str) -> Iterator[Difference]:
        self.spend(_work(a) + _work(b), place)
        if type(a) is not type(b):
            yield Difference(place, "changed", f"{_kind(a)} -> {_kind(b)}")
        elif isinstance(a, np.ndarray):
            yield from _arrays(a, b, place)
        elif isinstance(a, tuple):
            yield from self.tuples(a, b, place)
        elif isinstance(a, bytes):
            yield from _bytes(a, b, place)
        elif isinstance(a, CompressedUtf8):
            yield from self.texts(a, b, place)
        elif is_dataclass(a):
            for name in (f.name for f in fields(a)):
                yield from self.values(getattr(a, name), getattr(b, name), f"{place}, {name}")
        elif a != b and not (a != a and b != b):  # a NaN equals itself here
            data = {"a": a, "b": b} if isinstance(a, (str, int)) else {}
            yield Difference(place, "changed", f"{_short(a)} -> {_short(b)}", data)

    def tuples(self, a: tuple[Any, ...], b: tuple[Any, ...], place: str) -> Iterator[Difference]:
        if any(isinstance(v, Op) for v in (*a[:1], *b[:1])):
            if a != b:
                yield self.programs(a, b, place)
            return
        if all(isinstance(v, (int, float)) for v in a + b):
            if len(a) == len(b):
                yield from _arrays(np.array(a), np.array(b), place, text=f"{_short(a)} -> {_short(b)}, ")
            else:
                yield Difference(place, "changed", f"{len(a)} numbers -> {len(b)}")
            return
        for index in range(max(len(a), len(b))):
            here = f"{place}[{index}]"
            if index >= len(b):
                yield Difference(f"{here}{_named(a[index])}", "removed", _short(a[index]))
            elif index >= len(a):
                yield Difference(f"{here}{_named(b[index])}", "added", _short(b[index]))
            else:
                yield from self.values(a[index], b[index], f"{here}{_named(a[index])}")

    def texts(self, a: CompressedUtf8, b: CompressedUtf8, place: str) -> Iterator[Difference]:
        """What the texts say, however they are compressed."""
        try:
            first, second = a.unpacked(MAX_TEXT), b.unpacked(MAX_TEXT)
        except IccBrdfError:
            yield from _bytes(a.data, b.data, place)
            return
        try:
            found = list(self.plain(json.loads(first), json.loads(second), place))
        except (ValueError, RecursionError):
            found = list(_texts(first.splitlines(), second.splitlines(), place))
        yield from found

    def plain(self, a: Any, b: Any, place: str) -> Iterator[Difference]:
        """Values of JSON."""
        before, after = _parts(a), _parts(b)
        if before and after:
            for part in dict.fromkeys([*before, *after]):
                if part not in after:
                    yield Difference(place + part, "removed", _short(before[part]))
                elif part not in before:
                    yield Difference(place + part, "added", _short(after[part]))
                else:
                    yield from self.plain(before[part], after[part], place + part)
        elif not (isinstance(a, list) and isinstance(b, list)):
            yield from self.values(a, b, place)
        elif a != b:
            yield from _lists(a, b, place)

    def programs(self, a: Program, b: Program, place: str) -> Difference:
        before, after = (Counter(op.name for op in program) for program in (a, b))
        changed = {name: [before[name], after[name]] for name in sorted(before | after)}
        counts = {name: pair for name, pair in changed.items() if pair[0] != pair[1]}
        message = f"{len(a)} -> {len(b)} operations"
        if counts:
            message += "; " + ", ".join(f"{name} {old} -> {new}" for name, (old, new) in counts.items())
        data = {"operations": [len(a), len(b)], "operators": counts}
        return Difference(place, "changed", message, data, self.diff(a, b))

    def diff(self, a: Program, b: Program) -> tuple[str, ...]:
        """A unified diff of the listings; nothing where one of them cannot be listed or is too long."""
        try:
            return _diff(*(self.listing(program).splitlines() for program in (a, b)))
        except IccBrdfError:
            return ()


def _work(value: Any) -> int:
    """What a value takes, without the values in it."""
    if isinstance(value, np.ndarray):
        return _VALUE + int(value.size)
    return _VALUE + (_ITEM[type(value)] * len(value) if type(value) in _ITEM else 0)


def _diff(a: Sequence[str], b: Sequence[str]) -> tuple[str, ...]:
    if max(len(a), len(b)) > MAX_LINES:
        return ()
    return tuple(difflib.unified_diff(a, b, "a", "b", lineterm="", n=2))


def _parts(value: Any) -> dict[str, Any]:
    """What an object of JSON or a list of objects consists of, by the place in it; nothing for others."""
    if isinstance(value, dict):
        return {f", {key}": item for key, item in value.items()}
    if isinstance(value, list) and all(isinstance(item, dict) for item in value):
        return {f"[{index}]": item for index, item in enumerate(value)}
    return {}


def _texts(a: Sequence[str], b: Sequence[str], place: str) -> Iterator[Difference]:
    if a != b:
        yield Difference(place, "changed", f"{len(a)} -> {len(b)} lines", lines=_diff(a, b))


def _lists(a: list[Any], b: list[Any], place: str) -> Iterator[Difference]:
    """Lists of JSON that differ: tables of numbers as such, short lists as they are, others by items."""
    first, second = _table(a), _table(b)
    both = f"{_short(a)} -> {_short(b)}"
    if first is not None and second is not None:
        yield from _arrays(first, second, place, text="" if first.ndim > 1 else f"{both}, ")
    elif max(len(repr(a)), len(repr(b))) <= _LONGEST:
        yield Difference(place, "changed", both, {"a": a, "b": b})
    else:
        yield from _texts(_lines(a), _lines(b), place)


def _lines(items: list[Any]) -> list[str]:
    return [item if isinstance(item, str) else repr(item) for item in items]


def _table(items: list[Any]) -> Any:
    """The array of a list of numbers, or of rows of as many numbers; None for any other."""
    try:
        array = np.array(items)
    except ValueError:  # rows of different lengths
        return None
    return array if array.dtype.kind in "if" else None


def _arrays(a: Any, b: Any, place: str, *, text: str = "") -> Iterator[Difference]:
    """Numbers: how many differ, and by how much at most, among those that are finite on both sides."""
    if a.shape != b.shape:
        yield Difference(place, "changed", f"shape {a.shape} -> {b.shape}")
        return
    first, second = a.astype(np.float64), b.astype(np.float64)
    different = ~((a == b) | (np.isnan(first) & np.isnan(second)))
    count = int(different.sum())
    if not count:
        return
    comparable = different & np.isfinite(first) & np.isfinite(second)
    apart = np.abs(first[comparable] - second[comparable])
    largest = float(apart.max()) if apart.size else None
    message = f"{text}{count} of {a.size} numbers differ"
    if largest is not None:
        message += f", by at most {largest:.6g}"
    if apart.size < count:
        message += f"; {count - apart.size} are not finite on one side"
    yield Difference(place, "changed", message, {"differing": count, "of": a.size, "largest": largest})


def _bytes(a: bytes, b: bytes, place: str) -> Iterator[Difference]:
    if a == b:
        return
    common = min(len(a), len(b))
    different = np.frombuffer(a, np.uint8)[:common] != np.frombuffer(b, np.uint8)[:common]
    same = int(different.argmax()) if different.any() else common
    yield Difference(
        place, "changed", f"{len(a)} -> {len(b)} bytes, alike up to byte {same}", {"first_difference": same}
    )


def _kind(value: Any) -> str:
    """What a value is, for one that has changed into something else."""
    return shown(value.signature) if hasattr(value, "signature") else _short(value)


def _named(value: Any) -> str:
    return f" ({shown(value.signature)})" if hasattr(value, "signature") else ""


def _short(value: Any) -> str:
    """A value as text of limited length."""
    if hasattr(value, "signature"):
        return f"{len(value.to_bytes())} bytes"
    if isinstance(value, np.ndarray):
        return f"shape {value.shape}"
    if is_dataclass(value):
        value = tuple(getattr(value, f.name) for f in fields(value))
    text = repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
