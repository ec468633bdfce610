"""Make the figures of the documentation from a run of the demo.

    make demo && python tools/make_figures.py
"""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests"))

from viewer_examples import headless_browser, open_page  # noqa: E402  (which lies in tests)

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


def page(demo: Path) -> Image.Image:
    """The page of the demo's print, in Chromium."""
    chain = [f"-p{demo / name}" for name in ("mid.icc", "mvis.icc")]
    with tempfile.TemporaryDirectory() as folder, headless_browser() as browser:
        path = Path(folder) / "relief.html"
        command = Path(sys.executable).with_name("iccbrdf")
        subprocess.run([command, "view", demo / "relief.tif", *chain, "-o", path], check=True)
        opened = open_page(browser, path, viewport={"width": 1280, "height": 800})
        # Software draws in steps, and the last one is fine.
        opened.tab.wait_for_timeout(1000)
        picture = Image.open(io.BytesIO(opened.tab.screenshot())).convert("RGB")
    return picture.resize((960, 600), Image.Resampling.LANCZOS)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--demo", type=Path, default=ROOT / "demo")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs")
    arguments = parser.parse_args()
    arguments.output.mkdir(exist_ok=True)
    for name, picture in (("demo.jpg", contact_sheet(arguments.demo)), ("viewer.jpg", page(arguments.demo))):
        picture.save(arguments.output / name, quality=85)


if __name__ == "__main__":
    main()
