"""iccbrdf diff: what differs between two profiles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import click

from iccbrdf.calc import listing
from iccbrdf.cli.options import CHECK_FAILED, emit, json_option
from iccbrdf.icc import read_profile
from iccbrdf.icc.compare import Difference, compare

EPILOG = """
\b
Example:
  iccbrdf diff old/mvis.icc new/mvis.icc --samples 10000
"""


@click.command("diff", epilog=EPILOG)
@click.argument("a", type=click.Path(path_type=Path))
@click.argument("b", type=click.Path(path_type=Path))
@click.option(
    "--samples", type=click.IntRange(1, 10_000_000), metavar="N",
    help="Also run both on N random inputs and show the greatest differences.",
)  # fmt: skip
@json_option
@click.pass_context
def command(ctx: click.Context, a: Path, b: Path, samples: int | None, as_json: bool) -> None:
    """Show what must change for profile A to become B: header, tags, elements, numbers, programs, texts.

    Exit code 0: they hold the same; 1: they differ.  Size, profile ID, order of the tags and padding do
    not count.
    """
    first, second = read_profile(a), read_profile(b)
    found = compare(first, second, listing=listing)
    agreed = None
    if samples is not None:
        from iccbrdf.cmm.agreement import agreement

        agreed = agreement(first, second, samples)
    result = {
        "a": str(a),
        "b": str(b),
        "equal": not found,
        "same_bytes": first == second,
        "differences": [difference.to_dict() for difference in found],
        "samples": agreed and asdict(agreed),
    }
    lines = [line for difference in found for line in _lines(difference)]
    if not found:
        lines.append(
            f"{a} and {b} hold the same" + ("" if result["same_bytes"] else ", laid out differently")
        )
    if agreed is not None:
        colour = "" if agreed.delta_E is None else f", CIEDE2000 at most {agreed.delta_E:.4g}"
        lines.append(
            f"{agreed.samples} random inputs: outputs differ by at most {agreed.largest:.4g}{colour}"
        )
        if agreed.not_finite:
            lines.append(f"  {agreed.not_finite} of them have outputs that are not finite, and are left out")
    emit(as_json, "iccbrdf.diff/1", result, "\n".join(lines))
    ctx.exit(CHECK_FAILED if found else 0)


def _lines(difference: Difference) -> Iterator[str]:
    mark = {"added": "+", "removed": "-", "changed": "~"}[difference.change]
    yield f"{mark} {difference.place}: {difference.message}"
    for line in difference.lines:
        yield f"    {line}"
