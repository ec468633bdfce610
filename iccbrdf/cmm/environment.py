"""Run-time (CMM environment) variables: do a caller's names and values fit those that a chain reads?"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from iccbrdf.errors import VariableError, nearest

RESERVED = ("true", "ndef")
"""Signatures that ICC.2 itself defines: always 1, never defined."""

_LARGEST = float(np.finfo(np.float32).max)


def checked_environment(env: Mapping[str, float], variables: Iterable[str]) -> dict[str, float]:
    """`env` with float values; VariableError for a name that no profile reads, or for what is no number."""
    if not isinstance(env, Mapping):
        raise VariableError(f"env is {env!r}, expected a mapping from names to numbers")
    variables = tuple(variables)
    checked = {}
    for name, value in env.items():
        if name not in variables:
            raise VariableError(
                f"run-time variable {name!r} is read by none of the profiles: {nearest(str(name), variables)}"
            )
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = np.nan
        # An integer that may be too long to be shown.
        except OverflowError:
            value = number = np.inf
        if not abs(number) <= _LARGEST:
            raise VariableError(
                f"run-time variable {name!r}: found {value!r}, expected a finite number (float32)"
            )
        checked[name] = number
    return checked
