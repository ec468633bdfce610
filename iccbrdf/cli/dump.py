"""iccbrdf dump: what a profile holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import click

from iccbrdf.calc import Program, listing
from iccbrdf.cli.options import emit, json_option
from iccbrdf.icc import Profile, describe, read_profile, to_dict
from iccbrdf.icc.layout import shown
from iccbrdf.icc.source_tag import Source, readable_source
from iccbrdf.icc.text import printable

SCHEMA = "iccbrdf.dump/1"

EPILOG = """
\b
Example:
  iccbrdf dump profiles/fogra39_gloss/mvis.icc
"""


@click.command("dump", epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@json_option
def command(file: Path, as_json: bool) -> None:
    """Show the header, the tags with their place in FILE, and the programs of its calculators.

    What profiles of `iccbrdf build` are compiled from comes last, with all its comments and settings; in the
    programs, a comment names the values that are stored.
    """
    profile = read_profile(file)
    source = readable_source(profile, profile.source)
    named = _listing(profile, source)
    if as_json:
        emit(True, SCHEMA, {**to_dict(profile, listing=named), "made_from": source.plain()}, "")
    else:
        emit(False, SCHEMA, {}, describe(profile, listing=named) + "".join(_lines(source)))


def _listing(profile: Profile, source: Source) -> Callable[[Program], str]:
    """What lists the programs of a profile, with the names that its source has."""
    temporaries = {id(element.program): one.temporaries for element, one in source.found_in(profile)}
    return lambda program: listing(program, temporaries.get(id(program), ()))


def _lines(source: Source) -> Iterator[str]:
    """The source of each calculator."""
    for calculator in source.calculators:
        place = f"tag {shown(calculator.tag)}, element {calculator.element}"
        yield f"\nsource of {printable(place)}\n"
        for line in calculator.lines():
            yield f"  {printable(line)}".rstrip() + "\n"
