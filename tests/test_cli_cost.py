"""iccbrdf cost, and build --budget."""

from __future__ import annotations

import json

import numpy as np
import pytest
from conftest import ROOT

import iccbrdf
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.demo import landscape
from iccbrdf.images import Block, create_tiff
from iccbrdf.report import cost as cost_module
from iccbrdf.report.cost_ways import PLAIN, REFERENCE, Way

PRINTER = ROOT / "profiles" / "fogra39_gloss"
PRIMARIES = PRINTER / "primaries.json"
FILES = ["cost.json", "cost.md", "cost.png", "cost_errors.png"]
TABLE = Way("table 9 trilinear", "tables", grid=9)
REDUCED = Way("effects within 2", "effects", tolerance=2.0)


@pytest.fixture(scope="module")
def image(tmp_path_factory):
    """A part of the demo's print as XYZ and normals."""
    xyz = landscape(read_primaries(ROOT / "profiles" / "landscape" / "primaries.json")).xyz
    path = tmp_path_factory.mktemp("cost") / "print.tif"
    part = np.ascontiguousarray(xyz.device[600:1000:10, 300:620:10])
    with create_tiff(path, *part.shape[:2], xyz.names, samples="device") as sink:
        sink.write(Block(0, 0, part))
    return path


@pytest.fixture
def few(monkeypatch):
    """Measure some ways only."""

    def choose(*chosen):
        monkeypatch.setattr(cost_module, "ways", lambda recipe, is_colour: chosen)

    choose(REFERENCE, PLAIN, TABLE)
    return choose


@pytest.mark.usefixtures("few")
def test_files_and_text(run, image, tmp_path):
    options = ("--primaries", PRIMARIES, "--light", "50,180", "--runs", 1)
    done = run("cost", image, *options, "-o", tmp_path / "out")
    assert (done.code, done.err) == (0, "")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
    assert "Exact is the float64 reference of what was asked for: brdf1, smooth interpolation\n" in done.out
    assert "within max CIEDE2000 1: " in done.out
    assert "iccbrdf build PRIMARIES -o DIR" in done.out
    for name in FILES:
        assert f"  -> {tmp_path / 'out' / name}" in done.out
    assert "table 9 trilinear" in (tmp_path / "out" / "cost.md").read_text()


@pytest.mark.usefixtures("few")
def test_json_is_that_of_the_file(run, image, tmp_path):
    options = ("--slopes", PRINTER / "slopes.json", "--by", "mean", "--time", 1e9, "--runs", 1, "--json")
    found = run("cost", image, "--primaries", PRIMARIES, "-o", tmp_path, *options).json
    assert found["schema"] == "iccbrdf.cost/1"
    assert json.loads((tmp_path / "cost.json").read_text()) == found
    assert found["exact"]["slope_method"] == "affine"
    assert found["limit"] == {"delta_E_CIE2000": None, "ns_per_pixel": 1e9, "statistic": "mean"}
    assert found["recommended"]["name"] == "float32"  # the most accurate that can be had, whatever it takes
    assert [way["name"] for way in found["ways"]] == ["float64 reference", "float32", "table 9 trilinear"]
    assert found["sample"]["whole"]


@pytest.mark.usefixtures("few")
def test_no_way_within_the_budget_is_exit_code_1(run, image, tmp_path):
    done = run("cost", image, "--primaries", PRIMARIES, "-o", tmp_path, "--budget", 0, "--runs", 1)
    assert done.code == 1
    assert "no way is within max CIEDE2000 0\n" in done.out
    assert (tmp_path / "cost_errors.png").exists()


@pytest.mark.usefixtures("few")
def test_mistakes(run, image, tmp_path):
    command = ("cost", image, "--primaries", PRIMARIES, "-o", tmp_path, "--runs", 1)
    both = run(*command, "--budget", 1, "--time", 50)
    assert both.code == 2
    assert "give one of them" in both.err
    shown = run(*command, "--show", "table 9 trilinera")
    assert shown.code == 2
    assert "did you mean 'table 9 trilinear'?" in shown.err
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "cost.md").write_text("mine")
    assert run("cost", tmp_path / "not read", "--primaries", PRIMARIES, "-o", tmp_path).code == 2
    assert (tmp_path / "cost.md").read_text() == "mine"
    assert run("cost", tmp_path / "none.tif", "--primaries", PRIMARIES, "-o", tmp_path / "new").code == 3
    assert not (tmp_path / "new").exists()


def test_build_within_a_budget_takes_the_way_that_is_recommended(run, image, tmp_path, few, monkeypatch):
    command = ("build", PRIMARIES, "--slopes", PRINTER / "slopes.json", "--for", image, "--light", "50,180")

    def taken(way, folder, *options):
        few(way)
        monkeypatch.setattr("iccbrdf.cli.cost.RUNS", 1)
        done = run(*command, "--budget", 1, "-o", folder, *options)
        assert done.code == 0
        return done

    table = taken(TABLE, tmp_path / "table", "--json").json
    assert table["measured"]["way"] == "table 9 trilinear"
    assert table["measured"]["max_delta_E_CIE2000"] < 1
    mid = iccbrdf.read_profile(tmp_path / "table" / "table-mid.icc")
    assert "slop" in mid  # it adjusts to slopes as the colour MID does
    assert len(mid["A2M0"].elements) == 3

    plain = taken(PLAIN, tmp_path / "plain")
    assert "within 1 for " in plain.out
    assert not (tmp_path / "plain" / "table-mid.icc").exists()
    full = iccbrdf.read_profile(tmp_path / "plain" / "mvis.icc")

    reduced = taken(REDUCED, tmp_path / "reduced", "--json").json
    assert reduced["plan"]["tolerance"] == 2
    assert reduced["plan"]["without"]
    description = iccbrdf.read_profile(tmp_path / "reduced" / "mvis.icc")["desc"]
    assert "reduced for a scene" in str(description)
    assert "reduced for a scene" not in str(full["desc"])


def test_budgets_that_cannot_be(run, image, tmp_path, few):
    assert run("build", PRIMARIES, "-o", tmp_path, "--budget", 1).code == 2
    lights = run("build", PRIMARIES, "-o", tmp_path, "--for", image, "--budget", 1, "--tolerance", 1)
    assert lights.code == 2
    assert "leave out --lights and --tolerance" in lights.err
    few(TABLE)
    nothing = run("build", PRIMARIES, "-o", tmp_path, "--for", image, "--budget", 0)
    assert nothing.code == 2
    assert "nearest is table 9 trilinear with" in nothing.err
    assert list(tmp_path.iterdir()) == []
