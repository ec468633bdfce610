"""Every command of the README runs, in its order, as it stands there."""

import re
import shlex
import shutil

import numpy as np
import pytest
import tifffile
from conftest import ROOT, SHARED
from make_repomap import repomap
from PIL import Image

from iccbrdf import demo

README = (ROOT / "README.md").read_text(encoding="utf-8")
PRINTER = SHARED / "data" / "icc" / "ISOcoated_v2_300_bas.icc"
"""A printer's profile from elsewhere, in the place of the README's FOGRA39.icc."""


def blocks(language):
    """The fenced blocks of the README in a language."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    return [text for name, text in found if name == language]


def commands():
    """The lines of the README's blocks that start with the program's name, continued ones joined."""
    lines = "\n".join(blocks("")).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.startswith("iccbrdf ")]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with what the README's commands find: the demo, the profiles, a job and its relief.

    The demo's print is made of larger pixels, as it is the commands that are tried.
    """
    monkeypatch.setattr(demo, "PIXEL_PITCH", 0.8)
    (tmp_path / "profiles").symlink_to(ROOT / "profiles")
    rng = np.random.default_rng(0)
    tifffile.imwrite(
        tmp_path / "job.tif", rng.integers(0, 200, (40, 50, 4), np.uint8), photometric="separated"
    )
    Image.fromarray(rng.integers(0, 255, (40, 50), np.uint8)).save(tmp_path / "relief.png")
    if PRINTER.exists():
        shutil.copy(PRINTER, tmp_path / "FOGRA39.icc")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_commands_run(place, run):
    assert run("demo", "-o", "demo").code == 0
    ran = []
    for line in commands():
        line = line.partition(" #")[0]
        words = shlex.split(line.partition("||")[0])[1:]
        if words[0] == "cost":
            # Of a piece of the image, so that it takes seconds.
            words += ["--pixels", "20000", "--runs", "1"]
        needs_printer = "FOGRA39.icc" in words or "proofs" in words
        if needs_printer and not PRINTER.exists():
            continue
        if "-o" in words:
            target = place / words[words.index("-o") + 1]
            assert not target.exists(), line
        result = run(*words)
        assert result.code == (1 if "||" in line else 0), (line, result.err)
        ran.append(words[0])
    assert {"build", "apply", "view", "plan", "cost", "validate", "xml", "icc", "info", "fit"} <= set(ran)


def test_python_runs(place, run):
    (block,) = blocks("python")
    assert run("build", "profiles/fogra39_gloss/primaries.json", "-o", "out").code == 0
    names = {"brdf_image": np.full((2, 3, 10), 0.5, np.float32)}
    exec(block, names)
    assert names["XYZ"].shape == names["relit"](names["brdf_image"]).shape == (2, 3, 3)
    assert names["transform"].channels_in[0] == "kd.X"


def test_files_that_it_names_are_there():
    for name in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / name).exists(), name
    for name in re.findall(r"`(tools/\w+\.py)`", README):
        assert (ROOT / name).exists(), name


def test_map_of_the_repository_is_current():
    assert (ROOT / "docs" / "repomap.md").read_text(encoding="utf-8") == repomap()
