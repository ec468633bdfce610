"""Make the figures of the documentation from a run of the demo.

    make demo && python tools/make_figures.py
"""

from __future__ import annotations

import argparse
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
SIDES = ("left", "top", "right", "mirror")
EDGE = 440
"""Width of one picture, pixels."""


def contact_sheet(demo: Path) -> Image.Image:
    """The demo's proofs in a row of two by two."""
    pictures = [Image.open(demo / f"proof_{side}.png").convert("RGB") for side in SIDES]
    height = round(pictures[0].height * EDGE / pictures[0].width)
    sheet = Image.new("RGB", (2 * EDGE, 2 * height))
    for i, picture in enumerate(pictures):
        small = picture.resize((EDGE, height), Image.Resampling.LANCZOS)
        sheet.paste(small, (i % 2 * EDGE, i // 2 * height))
    return sheet


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--demo", type=Path, default=ROOT / "demo")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs")
    arguments = parser.parse_args()
    arguments.output.mkdir(exist_ok=True)
    contact_sheet(arguments.demo).save(arguments.output / "demo.jpg", quality=85)


if __name__ == "__main__":
    main()
