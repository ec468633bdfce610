"""iccbrdf validate: is a profile sound?

A file that cannot be read from disk ends the command with exit code 3, as everywhere, since nothing can be
said about it.  A file that was read and is malformed, even one that is no profile at all, is an answer:
a finding of severity error, and exit code 1.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path

import click

from iccbrdf.cli.options import CHECK_FAILED, emit, json_option
from iccbrdf.errors import nearest
from iccbrdf.files import read_whole
from iccbrdf.icc.profile import MAX_BYTES
from iccbrdf.validate import (
    CHECKS,
    RULES,
    SEVERITIES,
    channels_and_variables,
    check_numeric,
    only_mid,
    validate,
    validate_pair,
)

EPILOG = """
\b
Examples:
  iccbrdf validate out/mid.icc out/mvis.icc
  iccbrdf validate --numeric --range litZ=0:1 out/mid.icc out/mvis.icc
  iccbrdf validate --list-rules
"""


def _ranges(
    ctx: click.Context, param: click.Parameter, values: tuple[str, ...]
) -> dict[str, tuple[float, float]]:
    """NAME=LOW:HIGH, by name."""
    found = {}
    for value in values:
        name, _, ends = value.rpartition("=")
        try:
            low, high = map(float, ends.split(":"))
        except ValueError:
            low, high = math.nan, math.nan
        if not (name and -math.inf < low <= high < math.inf):
            raise click.BadParameter(f"found {value!r}, expected as m=0.05:1, finite numbers", ctx, param)
        found[name] = (low, high)
    return found


def _check_names(ranges: Iterable[str], known: Collection[str]) -> None:
    for name in ranges:
        if name not in known:
            what = "is no multiplex channel or run-time variable of the files"
            raise click.UsageError(f"--range: {name!r} {what}: {nearest(name, sorted(known))}")


@click.command("validate", epilog=EPILOG)
@click.argument("files", nargs=-1, metavar="FILE...", type=click.Path(path_type=Path))
@click.option("--list-rules", is_flag=True, help="Show all rules, and check nothing.")
@click.option("--numeric", is_flag=True, help="Prove that no program divides by 0, overflows and the like.")
@click.option(
    "--range",
    "ranges",
    callback=_ranges,
    multiple=True,
    metavar="NAME=LOW:HIGH",
    help="With --numeric: where a multiplex channel or a run-time variable lies; repeatable.",
)
@json_option
@click.pass_context
def command(
    ctx: click.Context,
    files: tuple[Path, ...],
    list_rules: bool,
    numeric: bool,
    ranges: dict[str, tuple[float, float]],
    as_json: bool,
) -> None:
    """Check each profile FILE: header, tags, texts, channels, elements, programs, viewing conditions.

    A finding has the id of a rule, its severity (error, warning or note), the place with its byte offset,
    and the clause or fact behind the rule.  Two files that are a MID and an MVIS are checked as a pair too.
    Exit code 1: there is an error, be it that a file is no profile.

    --numeric: for all device values in 0..1, connection spaces as they are encoded, run-time variables within
    1000, and multiplex channels as the one MID among the files gives them, or within 4 without one.
    """
    if list_rules:
        lines = (f"{r.id}  {r.severity:<7}  {r.text}  [{r.basis}]" for r in RULES.values())
        emit(as_json, "iccbrdf.rules/1", {"rules": [asdict(r) for r in RULES.values()]}, "\n".join(lines))
        return
    if not files:
        raise click.UsageError("no FILE to check", ctx)
    contents = [(read_whole(path, MAX_BYTES), str(path)) for path in files]
    checks = CHECKS
    if ranges:
        _check_names(ranges, channels_and_variables(contents))
    if numeric:
        checks = (*CHECKS, partial(check_numeric, ranges=ranges, mid=only_mid(contents)))
    elif ranges:
        raise click.UsageError("--range is for --numeric", ctx)
    reports = [validate(data, source, checks=checks) for data, source in contents]
    pair = validate_pair(*contents) if len(contents) == 2 else None
    everything = [*reports, pair] if pair else reports
    passed = all(report.passed for report in everything)
    result = {
        "passed": passed,
        **{f"{severity}s": sum(r.count(severity) for r in everything) for severity in SEVERITIES},
        "files": [report.to_dict() for report in reports],
        "pair": pair and pair.to_dict(),
    }
    emit(as_json, "iccbrdf.validate/1", result, "\n".join(line for r in everything for line in r.lines()))
    ctx.exit(0 if passed else CHECK_FAILED)
