"""iccbrdf proof: from print jobs to pictures of the relief print."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar

import click

from iccbrdf.cli.options import CHECK_FAILED, emit, force_option, json_option
from iccbrdf.cli.progress import progress
from iccbrdf.errors import IccBrdfError, UsageError
from iccbrdf.proof import values
from iccbrdf.proof.job import SETTINGS, Job, make_job, read_job

F = TypeVar("F", bound=Callable[..., Any])

JOB_SUFFIX = ".toml"

EPILOG = """
\b
Examples:
  A CMYK job on a relief, lit from the left:
    iccbrdf proof job.tif --printer FOGRA39.icc --height relief.png \\
      --pixel-pitch 0.1mm --primaries primaries.json -o out
  Raking light from four sides, a contact sheet, and the light going round:
    iccbrdf proof job.tif --primaries primaries.json -o out --sheet --sweep 60,0:60,360 \\
      --light left=75,180 --light right=75,0 --light top=75,90 --light bottom=75,270
  Everything in a file, of which each key is an option's name; many of them:
    iccbrdf proof job.toml
    iccbrdf proof monday/*.toml --json

A job that was done before from the same inputs is skipped; --force does it again.
"""


def setting_options(command: F) -> F:
    """An option for each setting of a job, but for the image, which is the argument."""
    defaults = {field.name.replace("_", "-"): field.default for field in fields(Job)}
    for name, setting in reversed(SETTINGS.items()):
        if name == "image":
            continue
        letters = ["-o"] if name == "output" else []
        declared: dict[str, Any] = {"default": None, "help": setting.help + _default_text(defaults[name])}
        if setting.read is values.flag:
            option = click.option(*letters, f"--{name}", name.replace("-", "_"), is_flag=True, **declared)
        else:
            declared |= {"metavar": setting.metavar, "multiple": setting.many, "type": str}
            option = click.option(*letters, f"--{name}", name.replace("-", "_"), **declared)
        command = option(command)
    return command


def _default_text(default: Any) -> str:
    if default in (None, (), False, MISSING):
        return ""
    shown = ", ".join(default) if isinstance(default, tuple) else default
    return f"  [default: {shown}]"


@click.command("proof", epilog=EPILOG)
@click.argument("sources", metavar="JOB...", nargs=-1, required=True, type=click.Path(path_type=Path))
@setting_options
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Threads that compute.")
@force_option
@json_option
def command(sources: tuple[Path, ...], workers: int, force: bool, as_json: bool, **given: Any) -> None:
    """Proof each JOB: a TIFF with the options below, or a TOML file with the same names as keys.

    Options replace what a TOML file says.  Of several TIFFs each gets a folder of its own in --output.
    """
    set_by_option = {
        name.replace("_", "-"): value for name, value in given.items() if value not in (None, (), False)
    }
    jobs = [_job(source, set_by_option, alone=len(sources) == 1) for source in sources]
    _check_folders(jobs)
    logs, code = [], 0
    for source, job in zip(sources, jobs, strict=True):
        try:
            log = _made(job, workers, force)
        except IccBrdfError as error:
            if len(jobs) == 1:
                raise
            # One job that fails hinders no other.
            click.echo(f"iccbrdf: {source}: {error}", err=True)
            log = {"status": "failed", "job": {"output": str(job.output)}, "error": str(error)}
            code = max(code, error.exit_code)
        too_clipped = [s["picture"] for s in log.get("scenes", ()) if s["clipped"] > _allowed(job)]
        if too_clipped:
            click.echo(
                f"iccbrdf: {source}: more than {job.max_clipped:g} clipped in {', '.join(too_clipped)}",
                err=True,
            )
            code = max(code, CHECK_FAILED)
        logs.append(log)
    text = "\n".join(line for source, log in zip(sources, logs, strict=True) for line in _lines(source, log))
    emit(as_json, "iccbrdf.proofs/1", {"jobs": logs}, text)
    click.get_current_context().exit(code)


def _job(source: Path, given: dict[str, Any], *, alone: bool) -> Job:
    if source.suffix.lower() == JOB_SUFFIX:
        if not alone and "output" in given:
            given = {**given, "output": str(Path(given["output"]) / source.stem)}
        return read_job(source, given)
    settings = {**given, "image": str(source)}
    if not alone:
        settings["output"] = str(Path(given.get("output", "proof")) / source.stem)
    return make_job(settings)


def _check_folders(jobs: list[Job]) -> None:
    seen: set[Path] = set()
    for job in jobs:
        folder = job.output.resolve()
        if folder in seen:
            raise UsageError(f"two jobs would be written to {job.output}: give each an output of its own")
        seen.add(folder)


def _allowed(job: Job) -> float:
    return 1.0 if job.max_clipped is None else job.max_clipped


def _made(job: Job, workers: int, force: bool) -> dict[str, Any]:
    from iccbrdf.proof.make import make_proof

    with progress(job.image.name) as advance:
        return make_proof(job, overwrite=force, workers=workers, advance=advance)


def _lines(source: Path, log: dict[str, Any]) -> Iterator[str]:
    yield f"{source}: {log['status']}, {log['job']['output']}"
    for scene in log.get("scenes", ()):
        clipped = f", {scene['clipped']:.2%} clipped" if scene["clipped"] else ""
        yield f"  light {scene['light']}, view {scene['view']}: {scene['picture']}{clipped}"
    named = {scene["picture"] for scene in log.get("scenes", ())}
    others = [output["file"] for output in log.get("outputs", ()) if output["file"] not in named]
    if others:
        yield f"  also {', '.join(others)}"
