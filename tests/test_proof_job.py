"""The settings of a job: one table for TOML and command line; lights, views and sweeps."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import iccbrdf.cli.proof
from iccbrdf.brdf.geometry import direction
from iccbrdf.errors import InputError, UsageError
from iccbrdf.proof.job import SETTINGS, Job, make_job, read_job
from iccbrdf.proof.scenes import scenes, sweep

NEEDED = {"image": "a.tif", "primaries": "p.json"}
SAMPLES = {
    "output": ("out", Path("out")),
    "printer": ("p.icc", Path("p.icc")),
    "slopes": ("s.json", Path("s.json")),
    "interpolation": ("published", "published"),
    "height": ("h.png", Path("h.png")),
    "relief": ("200um", 0.2),
    "pixel-pitch": ("0.004in", 0.1016),
    "normals": ("n.png", Path("n.png")),
    "green": ("down", "down"),
    "fit-relief": (True, True),
    "light": (["60,180", "top=60,90"], ("60,180", "top=60,90")),
    "view": (["0,0", "20,0"], ("0,0", "20,0")),
    "env": (["ambI=0.5"], ("ambI=0.5",)),
    "reference-white": ("flat", "flat"),
    "display": ("display-p3", "display-p3"),
    "exposure": (0.5, 0.5),
    "highlights": ("roll-off", "roll-off"),
    "gamut-warning": (True, True),
    "format": ("tiff", "tiff"),
    "depth": (16, "16"),
    "max-clipped": (0.25, 0.25),
    "sheet": (True, True),
    "sheet-size": (100, 100),
    "sweep": ("60,0:60,90", "60,0:60,90"),
    "frames": (5, 5),
    "sweep-format": ("webp", "webp"),
    "sweep-size": (64, 64),
    "keep": (["flat", "xyz"], ("flat", "xyz")),
    "keep-as": ("exr", "exr"),
}
"""Each setting as a TOML file has it, and what is meant."""
WITH = {"height": {"pixel-pitch": "0.1mm"}}
"""What a setting needs beside it."""


def test_every_setting_has_a_sample():
    assert set(SAMPLES) | set(NEEDED) == set(SETTINGS)
    assert len(SETTINGS) == len(fields(Job))


@pytest.mark.parametrize("name", SAMPLES)
def test_a_setting_means_the_same_in_a_file_and_as_an_option(run, tmp_path, monkeypatch, name):
    value, meant = SAMPLES[name]
    jobs = []

    def made(job, *_):
        jobs.append(job)
        return {"status": "done", "job": {"output": str(job.output)}}

    monkeypatch.setattr(iccbrdf.cli.proof, "_made", made)
    monkeypatch.chdir(tmp_path)
    stated = NEEDED | WITH.get(name, {}) | {name: value}
    lines = [f"{key} = {json.dumps(item)}" for key, item in stated.items()]
    Path("job.toml").write_text("\n".join(lines))
    arguments = ["a.tif"]
    for key, item in stated.items():
        if key == "image":
            continue
        for one in item if isinstance(item, list) else [item]:
            arguments += [f"--{key}"] + ([] if one is True else [one])
    assert run("proof", "job.toml").code == 0
    assert run("proof", *arguments).code == 0
    assert jobs[0] == jobs[1]
    found = getattr(jobs[0], name.replace("-", "_"))
    assert found == (pytest.approx(meant) if isinstance(meant, float) else meant)
    default = {field.name: field.default for field in fields(Job)}[name.replace("-", "_")]
    assert meant != default, "the sample shows nothing"


def test_paths_start_from_the_folder_of_the_file(tmp_path):
    (tmp_path / "job.toml").write_text(
        'image = "a.tif"\nprimaries = "../p.json"\nprinter = "/icc/p.icc"\n'
        'display = "mine.icc"\noutput = "x"\n'
    )
    job = read_job(tmp_path / "job.toml", {"slopes": "s.json", "exposure": "2"})
    assert job.image == tmp_path / "a.tif"
    assert job.primaries == tmp_path / "../p.json"
    assert job.printer == Path("/icc/p.icc")
    assert job.display == str(tmp_path / "mine.icc")
    assert job.output == tmp_path / "x"
    assert (job.slopes, job.exposure) == (Path("s.json"), 2.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('pixelpitch = "1mm"', "pixelpitch is unknown: did you mean 'pixel-pitch'"),
        ('pixel-pitch = "1 furlong"', "expected a length such as 0.1mm, in um, µm, mm, cm, in"),
        ('pixel-pitch = "-1mm"', "expected a number above 0"),
        ("pixel-pitch = true", "pixel-pitch: found True"),
        ('highlights = "rolloff"', "did you mean 'roll-off'"),
        ("frames = 2.5", "expected a whole number of at least 1"),
        ("frames = 0", "frames: found 0"),
        ('sheet = "yes"', "expected true or false"),
        ("light = 45", "expected a text or a list of texts"),
        ("light = [45, 180]", "expected a text"),
        ("light = []", "expected a text or a list"),
        ("exposure = nan", "expected a number above 0"),
        ("max-clipped = 1.5", "expected a share from 0 to 1"),
        ('keep = ["flat", "XYZ"]', "did you mean 'xyz'"),
        ("depth = 12", "expected 8 or 16"),
        ('printer = ""', "expected a text"),
        ("[display]", "expected a text"),
        ('height = "h.png"', "needs .*pixel-pitch"),
        ('height = "h.png"\npixel-pitch = 1\nnormals = "n.png"', "two ways to say one thing"),
        ("exposure = ", "is not TOML"),
    ],
)
def test_what_is_no_job(tmp_path, text, message):
    path = tmp_path / "job.toml"
    path.write_text(f'image = "a.tif"\nprimaries = "p.json"\n{text}\n')
    with pytest.raises(InputError, match=message) as caught:
        read_job(path)
    assert str(caught.value).startswith(str(path))


def test_needed_settings_and_files(tmp_path):
    (tmp_path / "job.toml").write_text('image = "a.tif"')
    with pytest.raises(InputError, match="primaries is missing"):
        read_job(tmp_path / "job.toml")
    with pytest.raises(InputError, match="cannot be read"):
        read_job(tmp_path / "no.toml")
    with pytest.raises(UsageError, match="--primaries is missing"):
        make_job({"image": "a.tif"})
    with pytest.raises(UsageError, match="--exposure: found 'x'"):
        make_job({**NEEDED, "exposure": "x"})


def job(**settings):
    return make_job({**NEEDED, **{name.replace("_", "-"): value for name, value in settings.items()}})


def test_every_light_is_seen_from_every_view():
    found = scenes(job(light=["a=60,180", "1,0,1"], view=["0,0", "b=20,90"], env=["litI=2"]), np.pi)
    assert [(s.light, s.view) for s in found] == [("a", "0,0"), ("a", "b"), ("1,0,1", "0,0"), ("1,0,1", "b")]
    env = found[3].env
    np.testing.assert_allclose([env[name] for name in ("litX", "litY", "litZ")], [0.5**0.5, 0, 0.5**0.5])
    np.testing.assert_allclose(
        [env[name] for name in ("vueX", "vueY", "vueZ")], direction(20, 90), atol=1e-15
    )
    assert env["litI"] == 2


@pytest.mark.parametrize("zenith", [0, 45, 80])
def test_a_flat_white_has_its_own_xyz(zenith):
    for intensity in (np.pi, 1.0):
        (scene,) = scenes(job(light=f"{zenith},10", reference_white="flat"), intensity)
        assert scene.env["litI"] * scene.env["litZ"] == pytest.approx(intensity)
    (scene,) = scenes(job(light=f"{zenith},10"), np.pi)
    assert "litI" not in scene.env


def test_lights_that_are_none():
    for settings, message in (
        ({"light": "90,0", "reference_white": "flat"}, "hardly shines on a flat white"),
        ({"light": "95,0"}, "expected -90 to 90"),
        ({"light": ["a=1,0", "a=2,0"]}, "'a' comes twice"),
        ({"light": "../a=1,0"}, "cannot be part of a file's name"),
        ({"view": "0,0,0"}, "length 0"),
        ({"env": "litI"}, "expected NAME=VALUE"),
    ):
        with pytest.raises(UsageError, match=message):
            scenes(job(**settings), np.pi)


def test_a_sweep_goes_from_one_light_to_the_other():
    assert sweep(job(), np.pi) == []
    found = sweep(job(sweep="10,0:70,90", frames=4, view=["v=5,0", "0,0"]), np.pi)
    assert [scene.light for scene in found] == ["10,0", "30,30", "50,60", "70,90"]
    assert {scene.view for scene in found} == {"v"}
    turn = sweep(job(sweep="60,0:60,360", frames=4), np.pi)
    assert [scene.light for scene in turn] == ["60,0", "60,90", "60,180", "60,270"]
    for text, message in (
        ("60,0", "expected FROM:TO"),
        ("1,0,1:60,0", "not a vector"),
        ("a,0:b,0", "finite number"),
    ):
        with pytest.raises(UsageError, match=message):
            sweep(job(sweep=text), np.pi)
