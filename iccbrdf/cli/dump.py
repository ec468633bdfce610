"""iccbrdf dump: what a profile holds."""

from __future__ import annotations

from pathlib import Path

import click

from iccbrdf.calc import listing
from iccbrdf.cli.options import emit, json_option
from iccbrdf.icc import describe, read_profile, to_dict

EPILOG = """
\b
Example:
  iccbrdf dump profiles/fogra39_gloss/mvis.icc
"""


@click.command("dump", epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@json_option
def command(file: Path, as_json: bool) -> None:
    """Show the header, the tags with their place in FILE, and the programs of its calculators."""
    profile = read_profile(file)
    emit(as_json, "iccbrdf.dump/1", to_dict(profile, listing=listing), describe(profile, listing=listing))
