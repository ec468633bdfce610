"""The names of run-time variables that callers know, and those that come close to one."""

from __future__ import annotations

from collections.abc import Mapping

VARIABLES = ("litX", "litY", "litZ", "vueX", "vueY", "vueZ", "litI", "ambI")
"""Light, view, irradiance and ambient light: what the programs of this library read."""

FIXED: Mapping[str, str] = {
    "true": "it is always 1, and no caller can set it",
    "ndef": "it is never defined, and no caller can set it",
}
"""Signatures that ICC.2 itself defines."""


def nearest_variable(name: str) -> str | None:
    """The known variable that `name` differs from by case, by one character, or by two that are swapped.

    None for a known one and for one that resembles none.

    >>> nearest_variable("litx"), nearest_variable("liXt"), nearest_variable("gain")
    ('litX', 'litX', None)
    """
    if name in VARIABLES:
        return None
    for known in VARIABLES:
        if name.casefold() == known.casefold():
            return known
    return next((known for known in VARIABLES if _one_slip(name.casefold(), known.casefold())), None)


def _one_slip(a: str, b: str) -> bool:
    """Is one character changed, lost or added, or are two neighbours swapped?"""
    if len(a) != len(b):
        long, short = sorted((a, b), key=len, reverse=True)
        return any(long[:i] + long[i + 1 :] == short for i in range(len(long)))
    differing = [i for i, (p, q) in enumerate(zip(a, b, strict=True)) if p != q]
    if len(differing) == 1:
        return True
    if len(differing) != 2 or differing[1] - differing[0] != 1:
        return False
    i, j = differing
    return a[i] == b[j] and a[j] == b[i]
