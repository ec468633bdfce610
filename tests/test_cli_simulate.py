"""iccbrdf simulate: files of a synthetic print."""

import json
import os
import time

import numpy as np

from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.measure import read_measurements
from iccbrdf.measure.simulation import FILES, simulate


def test_files_that_need_no_declaration(run, tmp_path):
    folder = tmp_path / "new" / "print"
    start = time.perf_counter()
    result = run("simulate", "-o", folder, "--seed", 7)
    assert time.perf_counter() - start < 10
    assert (result.code, result.err) == (0, "")
    assert sorted(os.listdir(folder)) == sorted(FILES)
    assert result.out.startswith("simulated, not measured: seed 7, noise 0.01")

    expected = simulate(7)
    for name in ("primaries", "tests", "slopes"):
        table = read_measurements(folder / f"{name}.csv")
        simulated = getattr(expected, name)
        assert table.keys == simulated.keys
        assert np.array_equal(table.XYZ, simulated.XYZ)
        assert np.array_equal(table.spectra, simulated.spectra)
        assert table.source.startswith("Simulated, not measured")
    assert read_slopes(folder / "slopes.json") == expected.colours

    record = json.loads((folder / "simulation.json").read_text())
    assert record["schema"] == "iccbrdf-simulation"
    assert record["note"] == "A simulation: nothing in these files was measured."
    assert record["options"]["seed"] == 7
    assert record["truth"]["alpha"] == expected.behaviour.alpha.tolist()


def test_the_same_options_give_the_same_bytes(run, tmp_path):
    for name in ("a", "b"):
        run("simulate", "-o", tmp_path / name, "--seed", 1)
    for name in FILES:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_json_and_options(run, tmp_path):
    options = ["--lamp-exclusion", 20, "--noise", 0, "--scatter", 0, "--illuminant", "D65", "--observer", 10]
    result = run("simulate", "-o", tmp_path, "--json", *options).json
    assert (result["schema"], result["simulated"]) == ("iccbrdf.simulate/1", True)
    assert result["files"] == [str(tmp_path / name) for name in FILES]
    assert (len(result["primaries"]["patches"]), result["primaries"]["geometries"]) == (9, 76)
    assert result["options"] == {
        "seed": 0, "noise": 0, "aperture": 1, "scatter": 0, "lamp_exclusion": 20, "illuminant": "D65",
        "observer": "CIE 1964 10 Degree Standard Observer",
    }  # fmt: skip
    table = read_measurements(tmp_path / "tests.csv")
    assert (table.illuminant, table.observer) == ("D65", "CIE 1964 10 Degree Standard Observer")


def test_nothing_is_overwritten(run, tmp_path):
    (tmp_path / "slopes.json").write_text("mine")
    result = run("simulate", "-o", tmp_path)
    assert result.code == 2
    assert "slopes.json: exists already" in result.err
    assert os.listdir(tmp_path) == ["slopes.json"]
    assert run("simulate", "-o", tmp_path, "--force").code == 0
    assert read_slopes(tmp_path / "slopes.json").angles[-1] == 60


def test_options_out_of_range(run, tmp_path):
    for option, value in (
        ("--lamp-exclusion", 10), ("--noise", -1), ("--seed", -1), ("--observer", 5),
        ("--noise", "nan"), ("--aperture", "nan"), ("--scatter", "nan"),
    ):  # fmt: skip
        result = run("simulate", "-o", tmp_path, option, value)
        assert result.code == 2
        assert option in result.err
