"""Frame times of a page of `iccbrdf view` on Chromium's software rasteriser.

    python tools/time_viewer.py proof.html

needs Chromium (Debian's package `chromium`) and the package playwright.  A graphics processor is a hundred
times as quick; what it will need is estimated by `iccbrdf view --json`.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

SIZES = {"512 x 512": (512, 512), "1080p": (1920, 1080)}
PANEL = 304
"""Width of the controls beside the picture."""
FRAMES = 12
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def frame_times(page: Path, chromium: str) -> dict[str, list[float]]:
    """Milliseconds of frames in which the light moves, quickest first, by the picture's size."""
    found = {}
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        for name, (width, height) in SIZES.items():
            tab = browser.new_page(viewport={"width": width + PANEL, "height": height})
            tab.goto(page.resolve().as_uri())
            tab.evaluate("proof.ready.then(() => proof.settled())")
            # Every pixel of the window shows one of the print.
            tab.evaluate("proof.fill()")
            found[name] = sorted(tab.evaluate(f"proof.times({FRAMES})"))
            tab.close()
        browser.close()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("page", type=Path)
    parser.add_argument("--chromium", default=shutil.which("chromium"), help="path of the browser")
    arguments = parser.parse_args()
    if arguments.chromium is None:
        sys.exit("no chromium on the path: install it, or say where it is with --chromium")
    times = frame_times(arguments.page, arguments.chromium)
    summary = {
        name: {"median": round(found[len(found) // 2], 1), "least": round(found[0], 1)}
        for name, found in times.items()
    }
    print(json.dumps({"milliseconds_a_frame": summary}, indent=2))


if __name__ == "__main__":
    main()
