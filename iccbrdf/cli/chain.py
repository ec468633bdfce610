"""Options of chains of profiles, which need the intents that `link` has."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from iccbrdf.cli.options import name_list
from iccbrdf.cmm import INTENTS
from iccbrdf.errors import UsageError, nearest

F = TypeVar("F", bound=Callable[..., Any])


def chain_options(command: F) -> F:
    """--intent, as `link` takes it, and --conditions, profiles by their position from 0."""
    for option in (
        click.option("--conditions", multiple=True, metavar="PLACE=PROFILE", callback=_conditions,
                     help="A profile whose viewing conditions stand in for those of the one at this place of "
                     "the chain, from 1; repeatable."),
        click.option("--intent", metavar="NAMES", default="relative", show_default=True, callback=_intents,
                     help=f"{', '.join(INTENTS)}; or one for each profile, separated by commas."),
    ):  # fmt: skip
        command = option(command)
    return command


def _intents(_context: click.Context, _option: click.Parameter, text: str) -> str | list[str]:
    names = name_list(text)
    for name in names:
        if name not in INTENTS:
            raise click.BadParameter(f"{name!r} is unknown: {nearest(name, INTENTS)}")
    return names[0] if len(names) == 1 else names


def _conditions(_context: click.Context, _option: click.Parameter, items: tuple[str, ...]) -> dict[int, Path]:
    found = {}
    for item in items:
        place, equals, path = item.partition("=")
        if not equals or not place.isdecimal() or int(place) == 0:
            raise UsageError(f"--conditions {item!r}: expected PLACE=PROFILE, such as 2=d65.icc")
        found[int(place) - 1] = Path(path)
    return found
