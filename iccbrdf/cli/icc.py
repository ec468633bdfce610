"""iccbrdf icc: a profile from XML."""

from __future__ import annotations

from pathlib import Path

import click

from iccbrdf.cli.options import emit, force_option, json_option
from iccbrdf.files import check_target
from iccbrdf.icc import write_profile

EPILOG = """
\b
Example:
  iccbrdf icc mvis.xml -o mvis.icc
"""


@click.command("icc", epilog=EPILOG)
@click.argument("file", metavar="XML", type=click.Path(path_type=Path))
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="The profile to write.")
@click.option("--folder", type=click.Path(path_type=Path, file_okay=False),
              help="Holds all files that XML names.  Default: the folder of XML.")  # fmt: skip
@click.option("--strict", is_flag=True, help="Refuse what is otherwise ignored with a warning.")
@force_option
@json_option
def command(file: Path, output: Path, folder: Path | None, strict: bool, force: bool, as_json: bool) -> None:
    """Make a profile of the XML file XML, as `iccbrdf xml` or the ICC's iccToXml writes it."""
    from iccbrdf.icc.xml import read_xml

    check_target(output, overwrite=force)
    profile = read_xml(file, folder=folder, strict=strict)
    write_profile(profile, output, overwrite=force)
    size = len(profile.to_bytes())
    result = {"source": str(file), "output": str(output), "bytes": size, "tags": list(profile)}
    emit(as_json, "iccbrdf.icc/1", result, f"{file} -> {output}: {len(profile)} tags, {size} bytes")
