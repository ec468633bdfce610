"""Readers of a job's settings: from what TOML or a command line gives to the value that is meant.

A reader takes the value and the folder that relative paths start from; its ValueError says what was expected.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from iccbrdf.errors import nearest
from iccbrdf.images.showing import DISPLAYS

Reader = Callable[[Any, Path], Any]

_MILLIMETRES = {"um": 1e-3, "µm": 1e-3, "mm": 1.0, "cm": 10.0, "in": 25.4}
_LENGTH = re.compile(r"([0-9.eE+-]+)\s*([a-zµ]*)")


def text(value: Any, base: Path) -> str:
    """A text that is not empty."""
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise ValueError("a text")
    return value


def texts(value: Any, base: Path) -> tuple[str, ...]:
    """A text, or a list of them."""
    items = [value] if isinstance(value, str) else value
    if not isinstance(items, list | tuple) or not items:
        raise ValueError("a text or a list of texts")
    return tuple(text(item, base) for item in items)


def path(value: Any, base: Path) -> Path:
    """A path, relative to `base` where it is not absolute."""
    return base / text(value, base)


def display(value: Any, base: Path) -> str:
    """The name of a display, or the path of a profile, whose name has a suffix."""
    name = text(value, base)
    if name in DISPLAYS:
        return name
    if not Path(name).suffix:
        raise ValueError(f"a profile's file, or {' or '.join(DISPLAYS)}; {nearest(name, DISPLAYS)}")
    return str(base / name)


def flag(value: Any, base: Path) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise ValueError("true or false")
    return value


def number(value: Any, base: Path) -> float:
    """A finite number above 0, or its text."""
    try:
        found = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        found = math.nan
    if not 0 < found < math.inf:
        raise ValueError("a number above 0")
    return found


def count(value: Any, base: Path) -> int:
    """A whole number of at least 1, or its text."""
    found = number(value, base)
    if found != int(found):
        raise ValueError("a whole number of at least 1")
    return int(found)


def share(value: Any, base: Path) -> float:
    """A number from 0 to 1, or its text."""
    try:
        found = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        found = math.nan
    if not 0 <= found <= 1:
        raise ValueError("a share from 0 to 1")
    return found


def length(value: Any, base: Path) -> float:
    """A length above 0 in mm, from "0.1mm", "100um", "0.004in", or a number of mm."""
    found = _LENGTH.fullmatch(value.strip() if isinstance(value, str) else repr(value))
    unit = found and (found[2] or "mm")
    if not found or unit not in _MILLIMETRES:
        raise ValueError(f"a length such as 0.1mm, in {', '.join(_MILLIMETRES)}")
    return number(found[1], base) * _MILLIMETRES[unit]


def one_of(*choices: str) -> Reader:
    """One of some texts; a number stands for its digits."""

    def read(value: Any, base: Path) -> str:
        name = str(value) if isinstance(value, int) and not isinstance(value, bool) else text(value, base)
        if name not in choices:
            raise ValueError(f"{' or '.join(choices)}; {nearest(name, choices)}")
        return name

    return read


def any_of(*choices: str) -> Reader:
    """Some of some texts."""
    one = one_of(*choices)

    def read(value: Any, base: Path) -> tuple[str, ...]:
        return tuple(one(item, base) for item in texts(value, base))

    return read
