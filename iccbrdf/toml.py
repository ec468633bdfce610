"""TOML of strangers: the reader of the Python version, whose every failure is a ValueError."""

from __future__ import annotations

import sys
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def parse_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises ValueError where it is not TOML, nests too deep, or holds a number that is too long to be shown in
    a message (hexadecimal ones may be of any length).  The time may grow with the square of the text: give it
    a limit.
    """
    try:
        values: dict[str, Any] = tomllib.loads(text)
        repr(values)
    except RecursionError as error:
        raise ValueError(str(error)) from error
    return values
