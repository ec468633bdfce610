"""Memory of `iccbrdf apply`: it does not grow with the image."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import tifffile

from iccbrdf.resources import folder

pytest.importorskip("resource", reason="no resource usage on this system")

TOOL = Path(__file__).parent.parent / "tools" / "measure_memory.py"
PROFILES = folder("profiles") / "fogra39_gloss"
SIDES = (768, 1536)


def peak(image: Path) -> float:
    """MB that `iccbrdf apply` held at most while it made a TIFF and a PNG of an image."""
    outputs = ["-o", image.with_name("xyz.tif"), "-o", image.with_name("proof.png"), "--force"]
    done = subprocess.run(
        [sys.executable, TOOL, image, "-p", PROFILES / "mid.icc", "-p", PROFILES / "mvis.icc", *outputs],
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)["peak_MB"]


def write(path: Path, side: int, **layout) -> Path:
    """A BRDF image of side x side pixels, 40 bytes a pixel, from one strip or tile repeated."""
    height, width = layout.get("tile", (64, side))
    piece = np.random.default_rng(0).random((height, width, 10), np.float32)
    pieces = (piece for _ in range(side // height * (side // width)))
    tifffile.imwrite(path, pieces, shape=(side, side, 10), dtype=np.float32, photometric="minisblack",
                     planarconfig="contig", **layout)  # fmt: skip
    return path


@pytest.mark.parametrize(
    "layout",
    [{"rowsperstrip": 64}, {"tile": (64, 64), "compression": "zlib", "compressionargs": {"level": 1}}],
    ids=["strips", "compressed tiles"],
)
def test_peak_does_not_grow_with_the_image(tmp_path, layout):
    small, large = (peak(write(tmp_path / "image.tif", side, **layout)) for side in SIDES)
    # The larger image takes 71 MB more, its result 21 MB more.
    assert large < small + 20
    assert large < 400
