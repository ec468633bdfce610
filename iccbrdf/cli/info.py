"""iccbrdf info: which back end runs, and why."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import click

from iccbrdf.calc.backends import availability
from iccbrdf.cli.options import backend_option, emit, json_option
from iccbrdf.cmm import link
from iccbrdf.cmm.execution import Compiled
from iccbrdf.cmm.steps import Process

EPILOG = """
\b
Examples:
  What is installed:
    iccbrdf info
  What runs a chain of profiles, and what the compiler made of it:
    iccbrdf info -p mid.icc -p mvis.icc
"""

_PACKAGES = ("iccbrdf", "numpy", "llvmlite", "dask", "OpenEXR", "tifffile", "imagecodecs")


@click.command("info", epilog=EPILOG)
@click.option("-p", "--profile", "profiles", multiple=True, type=click.Path(path_type=Path),
              help="A profile of a chain, in order: tells what would run it.")  # fmt: skip
@backend_option
@click.option("--double", is_flag=True, help="Compute in float64.")
@json_option
def command(profiles: tuple[Path, ...], backend: str, double: bool, as_json: bool) -> None:
    """Show what is installed, the back ends, and which of them would run a chain of profiles."""
    packages = {name: _version(name) for name in _PACKAGES}
    result: dict[str, Any] = {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "packages": packages,
        "backends": {"interpreter": "there", **availability()},
    }
    text = [
        f"Python {result['python']} on {result['machine']}",
        ", ".join(f"{name} {found or 'not installed'}" for name, found in packages.items()),
        *(f"back end {name}: {state}" for name, state in result["backends"].items()),
    ]
    if profiles:
        chain = _chain(profiles, backend, "float64" if double else "float32")
        result["chain"] = chain
        text += ["", f"{' + '.join(map(str, profiles))}: {chain['backend']} ({chain['reason']})"]
        text += [f"  {name.replace('_', ' ')}: {value}" for name, value in chain["counts"].items()]
        text += [f"  pass {line}" for line in chain["passes"]]
    emit(as_json, "iccbrdf.info/1", result, "\n".join(text))


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _chain(profiles: Sequence[Path], backend: str, dtype: str) -> dict[str, Any]:
    transform = link(profiles, backend=backend, dtype=dtype)
    execution = transform.execution
    counts = {
        "operators_on_the_longest_path": sum(
            step.executed for step in transform.steps if isinstance(step, Process)
        ),
    }
    passes: list[str] = []
    if isinstance(execution, Compiled):
        counts |= execution.counts()
        passes += map(str, execution.reports)
    return {
        "profiles": [str(path) for path in profiles],
        "channels_in": list(transform.channels_in),
        "channels_out": list(transform.channels_out),
        "variables": list(transform.variables),
        "backend": execution.backend,
        "reason": execution.reason,
        "counts": counts,
        "passes": passes,
    }
