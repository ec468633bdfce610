"""iccbrdf evaluate: the papers' experiments on measurements."""

import subprocess
import sys

import pytest
from report_examples import simulated, small, write

from iccbrdf.report import evaluate_print

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("print")
    write(small(simulated()), folder)
    return folder


def test_text_and_plots(run, folder, tmp_path):
    result = run("evaluate", folder, "--plots", tmp_path / "plots")
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith("source         Simulated, not measured")
    for title in ("2020, Table 1", "2020, Table 2", "Table I:", "Table II:", "Table III:", "Table IV:"):
        assert title in result.out
    assert "holds  diffuse mean: CD < RMSE" in result.out
    pictures = sorted((tmp_path / "plots").iterdir())
    models = [f"2020-{m}-{what}" for m in ("cook_torrance_2020", "ward")
              for what in ("chromaticity", "median", "primary-worst", "worst")]  # fmt: skip
    assert [file.stem for file in pictures] == [*models, "2023-histogram", "2023-median", "2023-worst"]
    for file in pictures:
        assert file.read_bytes().startswith(PNG)
        assert str(file) in result.out


def test_json(run, folder):
    result = run("evaluate", folder, "--json", "--interpolation", "published")
    assert (result.code, result.err) == (0, "")
    found = result.json
    assert found["schema"] == "iccbrdf.evaluate/1"
    assert (found["interpolation"], found["slope_method"], found["as_published"]) == (
        "published", "affine", False,
    )  # fmt: skip
    assert [table["title"][:4] for table in found["tables"]] == ["2020"] * 5 + ["2023"] * 4
    assert found["wilcoxon"]["pairs"] == 8
    assert found["tables"][-1]["rows"][0]["paper"] == [4.39, 4.46, 18.97]
    assert {"name", "lower", "upper", "holds"} == set(found["orderings"][0])
    assert found["files"] == []


def test_options_reach_the_evaluation(run, folder, monkeypatch):
    asked = []

    def spy(data, **options):
        asked.append(options)
        return evaluate_print(data)

    monkeypatch.setattr("iccbrdf.cli.evaluate.evaluate_print", spy)
    shown = run(
        "evaluate", folder, "--as-published", "--interpolation", "published", "--slope-method", "published"
    )
    assert asked == [{"as_published": True, "interpolation": "published", "slope_method": "published"}]
    assert "I as published\ninterpolation  published; slope adjustment published\n" in shown.out


def test_existing_plots_are_refused_before_any_work(run, tmp_path):
    (tmp_path / "2023-worst.png").write_bytes(b"mine")
    result = run("evaluate", tmp_path / "not read", "--plots", tmp_path)
    assert result.code == 2
    assert "2023-worst.png" in result.err
    assert (tmp_path / "2023-worst.png").read_bytes() == b"mine"


def test_errors(run, folder, tmp_path):
    assert run("evaluate", tmp_path / "none").code == 3
    missing = run("evaluate", tmp_path)
    assert missing.code == 3
    assert "primaries.csv" in missing.err
    assert run("evaluate", folder, "--force").code == 2


def test_pictures_are_drawn_only_when_asked_for():
    code = "import sys, iccbrdf.cli.evaluate; print('matplotlib' in sys.modules, 'colour' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]
