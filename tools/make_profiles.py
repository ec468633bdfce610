"""Make the example profiles of profiles/ anew from their primaries files.

python tools/make_profiles.py [-o profiles]
"""

from __future__ import annotations

import argparse
from pathlib import Path

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import build_colour_mid, build_pair, build_tables

GRID = 17
"""Of the example tables, which are to stay small."""

ROOT = Path(__file__).resolve().parent.parent


def files(primaries: Path) -> dict[str, bytes]:
    """What stands beside a primaries file: its profiles and their listings, by name.

    The colour MID and its tables are made where there is a slopes file to go with them.
    """
    source = read_primaries(primaries)
    slopes = primaries.with_name("slopes.json")
    if not slopes.exists():
        return build_pair(source).files
    return (
        build_pair(source).files
        | build_colour_mid(source, slopes=read_slopes(slopes)).files
        | build_tables(source, grid=GRID).files
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "profiles")
    arguments = parser.parse_args()
    for primaries in sorted(ROOT.glob("profiles/*/primaries.json")):
        folder = arguments.output / primaries.parent.name
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in files(primaries).items():
            (folder / name).write_bytes(data)


if __name__ == "__main__":
    main()
