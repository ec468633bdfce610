"""Options of the commands that read tables of measurements."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from iccbrdf.measure import Measurements, parse_declarations, read_declarations, read_measurements

F = TypeVar("F", bound=Callable[..., Any])


def table_options(command: F) -> F:
    """--declare and --declarations."""
    for option in (
        click.option(
            "--declarations", "declarations", type=click.Path(path_type=Path),
            help="A TOML file that declares what the table's numbers are.",
        ),
        click.option(
            "--declare", "declare", multiple=True, metavar="KEY=VALUE",
            help="Declare one thing about the table; repeatable.  angles=degree|radian; "
            "view_angles=lamp|mirror|azimuth; quantity=brdf|reflectance|radiance; scale=1|100; "
            "illuminant=D50; observer=NAME; geometry=45:0; columns.theta_i=NAME, ...",
        ),
    ):  # fmt: skip
        command = option(command)
    return command


def read_table(path: Path, declare: tuple[str, ...], declarations: Path | None) -> Measurements:
    """Measurements of a table by what these options declare; --declare has the last word."""
    of_file = read_declarations(declarations) if declarations is not None else {}
    return read_measurements(path, **{**of_file, **parse_declarations(declare)})
