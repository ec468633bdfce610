"""Options that several commands share, and the reading of their values."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any, TypeVar

import click
import numpy as np

from iccbrdf.brdf.geometry import direction
from iccbrdf.errors import UsageError

F = TypeVar("F", bound=Callable[..., Any])


class FiniteRange(click.FloatRange):
    """A finite number within bounds: click's own range lets nan pass, which is beyond no bound."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number.", param, ctx)
        return number


json_option = click.option(
    "--json", "as_json", is_flag=True, help="One JSON object on stdout instead of text."
)
force_option = click.option("--force", is_flag=True, help="Overwrite existing files.")

_LIGHT_HELP = (
    "Direction to the light: ZENITH,AZIMUTH in degrees (azimuth counter-clockwise from the image's right) "
    "or a vector X,Y,Z (x right, y up the image, z out of the print).  Default of the profiles: 45,180."
)
_VIEW_HELP = "Direction to the viewer, like --light.  Default of the profiles: 0,0."


def scene_options(command: F) -> F:
    """--light, --view and --env."""
    for option in (
        click.option(
            "--env", "env", multiple=True, metavar="NAME=VALUE", help="A run-time variable; repeatable."
        ),
        click.option("--view", metavar="DIRECTION", help=_VIEW_HELP),
        click.option("--light", metavar="DIRECTION", help=_LIGHT_HELP),
    ):
        command = option(command)
    return command


def environment(light: str | None, view: str | None, env: tuple[str, ...]) -> dict[str, float]:
    """Run-time variables that the scene options set; --env has the last word."""
    values: dict[str, float] = {}
    for option, text, names in (
        ("--light", light, ("litX", "litY", "litZ")),
        ("--view", view, ("vueX", "vueY", "vueZ")),
    ):
        if text is not None:
            values.update(zip(names, parse_direction(option, text), strict=True))
    for item in env:
        name, equals, value = item.partition("=")
        if not equals or not name:
            raise UsageError(f"--env {item!r}: expected NAME=VALUE")
        values[name] = _number("--env " + name, value)
    return values


def parse_direction(option: str, text: str) -> tuple[float, float, float]:
    """A unit vector from `ZENITH,AZIMUTH` in degrees or from a vector `X,Y,Z` of any length."""
    numbers = [_number(option, part) for part in text.split(",")]
    if len(numbers) == 2:
        if abs(numbers[0]) > 90:
            raise UsageError(f"{option} {text!r}: the zenith angle is {numbers[0]:g}, expected -90 to 90")
        vector = direction(*numbers)
    elif len(numbers) == 3:
        # Scaled first, so that no square overflows or vanishes.
        vector = np.array(numbers) / (max(map(abs, numbers)) or 1)
    else:
        raise UsageError(f"{option} {text!r}: expected ZENITH,AZIMUTH in degrees or a vector X,Y,Z")
    length = np.linalg.norm(vector)
    if length == 0:
        raise UsageError(f"{option} {text!r}: a vector of length 0 has no direction")
    x, y, z = (vector / length).tolist()
    return x, y, z


def name_list(text: str) -> list[str]:
    """Names separated by commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def _number(option: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise UsageError(f"{option}: found {text!r}, expected a finite number")
    return number


def emit(as_json: bool, schema: str, result: dict[str, Any], text: str) -> None:
    """A command's result on stdout: one JSON object under its schema version, or the text."""
    click.echo(json.dumps({"schema": schema, **result}, indent=2) if as_json else text)
