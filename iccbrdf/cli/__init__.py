"""The command line: one file a command, loaded when it is asked for."""

from __future__ import annotations

import importlib
import json
import sys
import traceback
import warnings
from typing import Any

import click

from iccbrdf.errors import IccBrdfError, ProfileWarning

COMMANDS = {
    "build": "Make a MID and an MVIS profile from a primaries file.",
    "apply": "Map an image through profiles: XYZ TIFFs and PNG softproofs.",
    "dump": "Show what a profile holds.",
    "demo": "Softproof a relief print of a real landscape.",
}
_INTERNAL_ERROR = 5


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
            from iccbrdf.errors import nearest

            ctx.fail(f"no command {args[0]!r}: {nearest(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="iccbrdf")
def cli() -> None:
    """Directional appearance in ICC.2 profiles.

    \b
    Exit codes: 0 done; 1 a check that was asked for failed; 2 usage;
    3 input unreadable or malformed; 4 refused by a limit; 5 internal error.
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and leave with its exit code."""
    warnings.showwarning = _show_warning
    as_json = "--json" in (sys.argv[1:] if arguments is None else arguments)
    try:
        code = cli.main(args=arguments, prog_name="iccbrdf", standalone_mode=False)
    except click.exceptions.Exit as e:
        code = e.exit_code
    except click.Abort:
        _fail("interrupted", 1, as_json)
    except click.ClickException as e:
        usage = e.ctx.get_usage() + "\n" if isinstance(e, click.UsageError) and e.ctx else ""
        click.echo(usage, err=True, nl=False)
        _fail(e.format_message(), 2, as_json)
    except IccBrdfError as e:
        _fail(str(e), e.exit_code, as_json)
    except BrokenPipeError:
        code = 0  # the reader of stdout had enough
    except Exception as e:
        traceback.print_exc()
        _fail(f"internal error, please report it with the lines above: {e}", _INTERNAL_ERROR, as_json)
    sys.exit(code if isinstance(code, int) else 0)


def _fail(message: str, code: int, as_json: bool) -> None:
    click.echo(f"iccbrdf: {message}", err=True)
    if as_json:
        click.echo(json.dumps({"schema": "iccbrdf.error/1", "error": message, "exit_code": code}))
    sys.exit(code)


def _show_warning(message: Any, category: type[Warning], *args: Any, **kwargs: Any) -> None:
    if issubclass(category, ProfileWarning):
        click.echo(f"iccbrdf: warning: {message}", err=True)
