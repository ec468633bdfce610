"""iccbrdf xml: a profile as XML."""

from __future__ import annotations

from pathlib import Path

import click

from iccbrdf.cli.options import emit, force_option, json_option
from iccbrdf.files import atomic_output, check_target
from iccbrdf.icc import read_profile

EPILOG = """
\b
Example:
  iccbrdf xml profiles/fogra39_gloss/mvis.icc -o mvis.xml
"""


@click.command("xml", epilog=EPILOG)
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="The XML file to write.")
@force_option
@json_option
def command(file: Path, output: Path, force: bool, as_json: bool) -> None:
    """Write the profile FILE in the ICC's XML dialect.

    `iccbrdf icc` makes the same profile of it again.  Programs are written with the names of channels and
    temporaries where the profile has them.
    """
    from iccbrdf.icc.xml import profile_to_xml

    check_target(output, overwrite=force)
    profile = read_profile(file)
    data = profile_to_xml(profile)
    with atomic_output(output, overwrite=force) as temporary:
        temporary.write_bytes(data)
    result = {"source": str(file), "output": str(output), "bytes": len(data), "tags": list(profile)}
    emit(as_json, "iccbrdf.xml/1", result, f"{file} -> {output}: {len(profile)} tags, {len(data)} bytes")
