"""iccbrdf validate: is a profile sound?

A file that cannot be read from disk ends the command with exit code 3, as everywhere, since nothing can be
said about it.  A file that was read and is malformed, even one that is no profile at all, is an answer:
a finding of severity error, and exit code 1.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from iccbrdf.cli.options import emit, json_option
from iccbrdf.icc.profile import read_bytes
from iccbrdf.validate import RULES, SEVERITIES, validate, validate_pair

EPILOG = """
\b
Examples:
  iccbrdf validate out/mid.icc out/mvis.icc
  iccbrdf validate --list-rules
"""


@click.command("validate", epilog=EPILOG)
@click.argument("files", nargs=-1, metavar="FILE...", type=click.Path(path_type=Path))
@click.option("--list-rules", is_flag=True, help="Show all rules, and check nothing.")
@json_option
@click.pass_context
def command(ctx: click.Context, files: tuple[Path, ...], list_rules: bool, as_json: bool) -> None:
    """Check each profile FILE: header, tags, texts, channels, elements, programs, viewing conditions.

    A finding has the id of a rule, its severity (error, warning or note), the place with its byte offset,
    and the clause or fact behind the rule.  Two files that are a MID and an MVIS are checked as a pair too.
    Exit code 1: there is an error, be it that a file is no profile.
    """
    if list_rules:
        lines = (f"{r.id}  {r.severity:<7}  {r.text}  [{r.basis}]" for r in RULES.values())
        emit(as_json, "iccbrdf.rules/1", {"rules": [asdict(r) for r in RULES.values()]}, "\n".join(lines))
        return
    if not files:
        raise click.UsageError("no FILE to check", ctx)
    contents = [(read_bytes(path), str(path)) for path in files]
    reports = [validate(data, source) for data, source in contents]
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
    ctx.exit(0 if passed else 1)
