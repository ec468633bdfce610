"""iccbrdf colours: the named colours of a profile, and what a chain of profiles makes of them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from iccbrdf.cli.chain import chain_options
from iccbrdf.cli.options import emit, json_option
from iccbrdf.cmm import link
from iccbrdf.cmm.ramps import has_tints, named_colours
from iccbrdf.errors import UsageError, nearest
from iccbrdf.icc import read_profile
from iccbrdf.icc.text import printable

EPILOG = """
\b
Examples:
  The names:
    iccbrdf colours -p inks.icc
  One of them at full strength and at half of it, on a printer:
    iccbrdf colours -p inks.icc -p printer.icc "Warm Red" "Warm Red:0.5"
"""


@click.command("colours", epilog=EPILOG)
@click.argument("colours", nargs=-1, metavar="[NAME[:TINT]]...")
@click.option("-p", "--profile", "profiles", multiple=True, required=True, type=click.Path(path_type=Path),
              help="A profile of the chain, in order; the first one has the named colours.")  # fmt: skip
@chain_options
@click.option("--colorimetric", is_flag=True, help="Colours instead of spectra, where profiles have both.")
@json_option
def command(
    colours: tuple[str, ...],
    profiles: tuple[Path, ...],
    intent: str | list[str],
    conditions: dict[int, Path],
    colorimetric: bool,
    as_json: bool,
) -> None:
    """Show the named colours of a profile, or what a chain of profiles makes of some of them.

    TINT is 0 for the bare medium to 1, the default.
    """
    first = read_profile(profiles[0])
    names = named_colours(first)
    if not colours:
        emit(as_json, "iccbrdf.colours/1", {"names": list(names)}, "\n".join(map(printable, names)))
        return
    tinted = has_tints(first)
    wanted = [_colour(text, names, tinted) for text in colours]
    transform = link(
        [first, *profiles[1:]],
        intent=intent,
        conditions=conditions,
        spectral=not colorimetric,
    )
    rows = [[names.index(name), tint] if tinted else [names.index(name)] for name, tint in wanted]
    values = transform(rows)
    found: list[dict[str, Any]] = [
        {"name": name, "tint": tint, "values": [float(v) if math.isfinite(v) else None for v in row]}
        for (name, tint), row in zip(wanted, values, strict=True)
    ]
    text = ["\t".join(("colour", "tint", *transform.channels_out))]
    text += ["\t".join((printable(c["name"]), *(f"{v:.6g}" for v in (c["tint"], *row))))
             for c, row in zip(found, values.tolist(), strict=True)]  # fmt: skip
    result = {"channels": list(transform.channels_out), "colours": found}
    emit(as_json, "iccbrdf.colours/1", result, "\n".join(text))


def _colour(text: str, names: tuple[str, ...], tinted: bool) -> tuple[str, float]:
    """A name, which may hold a colon itself, and a tint."""
    if text in names:
        return text, 1.0
    name, _, number = text.rpartition(":")
    if name not in names:
        raise UsageError(f"no colour {text!r}: {nearest(name or text, names)}")
    if not tinted:
        raise UsageError(f"{text!r}: found a tint, but the profile tells full strength alone")
    try:
        tint = float(number)
    except ValueError:
        tint = math.nan
    if not 0 <= tint <= 1:
        raise UsageError(f"{text!r}: tint: found {number!r}, expected a number from 0 to 1")
    return name, tint
