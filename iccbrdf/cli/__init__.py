"""The command line: one file a command, loaded when it is asked for."""

from __future__ import annotations

import importlib
import io
import json
import sys
import traceback
import warnings
from typing import Any

import click

from iccbrdf.errors import IccBrdfError, IccBrdfWarning, InputError, UsageError, nearest

COMMANDS = {
    "simulate": "Simulate goniometric measurements of a print.",
    "fit": "Fit a reflection model to goniometric measurements.",
    "evaluate": "Run the papers' experiments on measurements.",
    "build": "Make a MID and an MVIS profile from a primaries file.",
    "plan": "Say which effects an image calls for, by bounds.",
    "apply": "Map an image through profiles: XYZ TIFFs and PNG softproofs.",
    "proof": "Proof print jobs on a relief, under several lights.",
    "view": "Make a page in which a proof is relit in a browser.",
    "cost": "Show what accuracy costs in time on an image of yours.",
    "dump": "Show what a profile holds.",
    "colours": "Show named colours, and what a chain of profiles makes of them.",
    "validate": "Check whether profiles are sound.",
    "diff": "Show what differs between two profiles.",
    "xml": "Write a profile as XML.",
    "icc": "Make a profile of XML.",
    "demo": "Softproof a relief print of a real landscape.",
    "info": "Show the back ends, and what would run a chain of profiles.",
}
_INTERNAL_ERROR = IccBrdfError.exit_code
_INTERRUPTED = 130
"""As shells report it: 128 and the number of the signal."""


class Commands(click.Group):
    """Imports a command's module only when the command runs, so that help and errors come at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        module = importlib.import_module(f"iccbrdf.cli.{name}")
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"no command {args[0]!r}: {nearest(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)


@click.group(
    cls=Commands, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]}
)
@click.version_option(package_name="iccbrdf")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Directional appearance in ICC.2 profiles.

    \b
    Exit codes: 0 done; 1 a check that was asked for failed; 2 usage;
    3 input unreadable or malformed; 4 refused by a limit; 5 internal error;
    130 interrupted.
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help(), err=True)
        ctx.exit(UsageError.exit_code)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and leave with its exit code."""
    as_json = "--json" in (sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # file names may hold what is no text
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        sys.exit(_run(arguments, as_json))


def _run(arguments: list[str] | None, as_json: bool) -> int:
    try:
        return cli.main(args=arguments, prog_name="iccbrdf", standalone_mode=False) or 0
    except SystemExit:
        return 0  # so click ends when the reader of a pipe had enough
    except click.Abort:
        return _failed("interrupted", _INTERRUPTED, as_json)
    except click.UsageError as e:
        hint = f"\nTry '{e.ctx.command_path} --help'." if e.ctx else ""
        return _failed(e.format_message() + hint, UsageError.exit_code, as_json)
    except IccBrdfError as e:
        return _failed(str(e), e.exit_code, as_json)
    except OSError as e:
        # What no layer below could name better: a device that fails in mid-file, a folder that vanishes.
        return _failed(f"{e.filename or 'input or output'}: {e.strerror}", InputError.exit_code, as_json)
    except Exception as e:
        traceback.print_exc()
        return _failed(
            f"internal error, please report it with the lines above: {e}", _INTERNAL_ERROR, as_json
        )


def _failed(message: str, code: int, as_json: bool) -> int:
    click.echo(f"iccbrdf: {message}", err=True)
    if as_json:
        click.echo(json.dumps({"schema": "iccbrdf.error/1", "error": message, "exit_code": code}))
    return code


def _show_warning(message: Any, category: type[Warning], *args: Any, **kwargs: Any) -> None:
    if issubclass(category, IccBrdfWarning):
        click.echo(f"iccbrdf: warning: {message}", err=True)
