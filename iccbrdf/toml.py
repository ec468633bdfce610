"""TOML of strangers: the reader of the Python version, whose every failure is a ValueError."""

from __future__ import annotations

import re
import sys
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_DEEP_KEY = re.compile(r"(?:[\w\"'-]{1,100}[ \t]*\.[ \t]*){100}")
"""Keys of many parts, which take the square of their number."""


def parse_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises ValueError where it is not TOML, nests too deep, has a key of 100 parts, or holds a number that is
    too long to be shown in a message (hexadecimal ones may be of any length).  The time may grow with the
    square of the text: give it a limit.
    """
    if _DEEP_KEY.search(text):
        raise ValueError("found a key of 100 parts or more, expected fewer")
    try:
        values: dict[str, Any] = tomllib.loads(text)
        repr(values)
    except RecursionError as error:
        raise ValueError(str(error)) from error
    return values
