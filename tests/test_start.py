"""What starts quickly imports little: which packages are loaded, not how long it takes."""

import json
import subprocess
import sys

import numpy as np
import pytest
import tifffile

from iccbrdf.resources import folder

PROFILES = folder("profiles") / "fogra39_gloss"

PROGRAM = """
import json, sys
{}
print(json.dumps(sorted(name.partition(".")[0] for name in sys.modules)), file=sys.stderr)
"""


def loaded(code: str, *arguments) -> set[str]:
    """The packages that a fresh interpreter holds after `code`."""
    command = [sys.executable, "-c", PROGRAM.format(code), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(json.loads(done.stderr))


RUN = """
from iccbrdf.cli import main
try:
    main()
except SystemExit as leaving:
    assert not leaving.code
"""


@pytest.mark.parametrize(("code", "arguments"), [("import iccbrdf", []), (RUN, ["--help"])], ids=str)
def test_without_numpy(code, arguments):
    assert not {"numpy", "lxml", "rich", "lark"} & loaded(code, *arguments)


def test_apply_from_tiff_to_tiff(tmp_path):
    image = tmp_path / "image.tif"
    data = np.full((4, 5, 10), 0.5, np.float32)
    tifffile.imwrite(image, data, photometric="minisblack", planarconfig="contig")
    chain = ["-p", PROFILES / "mid.icc", "-p", PROFILES / "mvis.icc"]
    found = loaded(RUN, "apply", image, *chain, "-o", tmp_path / "out.tif")
    assert not {"scipy", "matplotlib", "colour", "lxml", "lark", "rich", "dask", "zarr"} & found
    assert "numpy" in found
