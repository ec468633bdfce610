"""Light and view as people write them -> run-time variables."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping

import numpy as np

from iccbrdf.brdf.geometry import direction
from iccbrdf.errors import UsageError

LIGHT = ("litX", "litY", "litZ")
VIEW = ("vueX", "vueY", "vueZ")

_ROUNDING = 1e-6
"""How far below the horizon a direction on it may come to lie, of a longest component of 1."""


def environment(light: str | None, view: str | None, env: Iterable[str]) -> dict[str, float]:
    """Run-time variables that a light, a view and items `NAME=VALUE` set; the items have the last word."""
    values: dict[str, float] = {}
    for option, text, names in (("--light", light, LIGHT), ("--view", view, VIEW)):
        if text is not None:
            values.update(zip(names, parse_direction(option, text), strict=True))
    for item in env:
        name, equals, value = item.partition("=")
        if not equals or not name:
            raise UsageError(f"--env {item!r}: expected NAME=VALUE")
        values[name] = parse_number("--env " + name, value)
    return values


def that_are_read(values: Mapping[str, float], variables: Collection[str]) -> dict[str, float]:
    """Light and view, less the one that makes no difference to profiles that read the other.

    `variables` are those that the profiles read: without gloss, a view changes nothing.
    """
    reflects = any(name in variables for name in LIGHT + VIEW)
    return {name: value for name, value in values.items() if name in variables or not reflects}


def parse_direction(option: str, text: str) -> tuple[float, float, float]:
    """A unit vector from `ZENITH,AZIMUTH` in degrees or from a vector `X,Y,Z` of any length."""
    parts = text.split(",")
    if len(parts) not in (2, 3):
        raise UsageError(f"{option} {text!r}: expected ZENITH,AZIMUTH in degrees or a vector X,Y,Z")
    numbers = [parse_number(option, part) for part in parts]
    if len(numbers) == 2:
        if abs(numbers[0]) > 90:
            raise UsageError(f"{option} {text!r}: the zenith angle is {numbers[0]:g}, expected -90 to 90")
        vector = direction(*numbers)
    else:
        # Scaled first, so that no square overflows or vanishes.
        vector = np.array(numbers) / (max(map(abs, numbers)) or 1)
        if vector[2] < -_ROUNDING:
            raise UsageError(f"{option} {text!r}: z is {numbers[2]:g}, behind the print; expected 0 or more")
    length = np.linalg.norm(vector)
    if length == 0:
        raise UsageError(f"{option} {text!r}: a vector of length 0 has no direction")
    x, y, z = (vector / length).tolist()
    return x, y, z


def parse_number(option: str, text: str) -> float:
    """A finite number; `option` names the place in the message of the UsageError."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise UsageError(f"{option}: found {text!r}, expected a finite number")
    return number
