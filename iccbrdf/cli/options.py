"""Options that several commands share, and the reading of their values."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any, TypeVar

import click

from iccbrdf.scene import environment as environment

F = TypeVar("F", bound=Callable[..., Any])

CHECK_FAILED = 1
"""Exit code: a check that was asked for failed."""


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

BACKENDS = ("auto", "interpreter", "llvm", "numpy")
"""As iccbrdf.cmm has them, which would take longer to import than this file to read."""

backend_option = click.option(
    "--backend",
    type=click.Choice(BACKENDS),
    default="auto",
    show_default=True,
    help="What computes; auto: the quickest that can run the profiles (see iccbrdf info).",
)

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


def plan_options(command: F) -> F:
    """--lights, --tolerance, --samples and --channels."""
    for option in (
        click.option("--channels", metavar="NAMES",
                     help="Names of the image's channels, separated by commas, where it does not say them."),
        click.option("--samples", type=click.Choice(("device", "real")),
                     help="What a float image holds, where it does not say so itself."),
        click.option("--tolerance", type=FiniteRange(min=0), default=0.0, show_default=True, metavar="DE",
                     help="CIEDE2000 that may be lost; 0: none, but for float32 rounding."),
        click.option("--lights", multiple=True, metavar="DIRECTION[:DIRECTION]",
                     help="Instead of --light: each light of an animation, or all directions between two in "
                     "zenith and azimuth; repeatable."),
    ):  # fmt: skip
        command = option(command)
    return command


def name_list(text: str) -> list[str]:
    """Names separated by commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def emit(as_json: bool, schema: str, result: dict[str, Any], text: str) -> None:
    """A command's result on stdout: one JSON object under its schema version, or the text."""
    click.echo(json.dumps({"schema": schema, **result}, indent=2) if as_json else text)
