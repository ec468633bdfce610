"""Files in bad times: a kill, a full disk, a closed folder, inputs that shrink, results in the way.

Whatever happens, no half file stands under a name that was asked for, and what stood there before still does.
"""

import os
import resource
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import tifffile
from cmm_examples import device_profile, matrix
from fuzz import seeds

import iccbrdf
from iccbrdf.icc import read_profile, write_profile
from iccbrdf.icc.xml import profile_to_xml
from iccbrdf.images.tiff_storage import TiffStorage
from iccbrdf.report.plots import PICTURES
from iccbrdf.resources import folder

HERE = folder("profiles") / "fogra39_gloss"
MID, MVIS, PRIMARIES = HERE / "mid.icc", HERE / "mvis.icc", HERE / "primaries.json"
PAIR = ["-p", MID, "-p", MVIS]


def an_image(path, height, width, seed=1, **options):
    """Device values of a BRDF image."""
    data = np.random.default_rng(seed).integers(100, 200, (height, width, 10), np.uint8)
    tifffile.imwrite(path, data, photometric="minisblack", planarconfig="contig", **options)
    return path


def visible(path):
    return sorted(name for name in os.listdir(path) if not name.startswith("."))


# A kill --------------------------------------------------------------------------------------------------


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no SIGKILL here")
def test_killed_in_the_middle_and_run_again(tmp_path):
    image = an_image(tmp_path / "image.tif", 1500, 1000)
    xyz, png = tmp_path / "xyz.tif", tmp_path / "proof.png"
    arguments = ["apply", image, *PAIR, "-o", xyz, "-o", png, "--workers", "1"]
    command = [sys.executable, "-c", "from iccbrdf.cli import main; main()", *map(str, arguments)]
    process = subprocess.Popen([*command, "--backend", "interpreter"], stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    # The picture's bytes come as its rows are done: some are there, and the most is not.
    while not any(part.stat().st_size > 0 for part in tmp_path.glob(".*.part")):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    assert visible(tmp_path) == ["image.tif"]
    again = subprocess.run(command, capture_output=True, text=True)
    assert again.returncode == 0, again.stderr
    assert visible(tmp_path) == ["image.tif", "proof.png", "xyz.tif"]
    found = tifffile.imread(xyz)[::100, ::100]
    expected = iccbrdf.link([MID, MVIS])(tifffile.imread(image)[::100, ::100] / np.float32(255))
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6)


# A full disk ---------------------------------------------------------------------------------------------


@contextmanager
def files_up_to(size):
    """As on a disk that has no more room: no file grows beyond `size` bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(
    "options",
    [["xyz.tif"], ["proof.png"], ["xyz.tif", "proof.png"], ["xyz.tif", "--compression", "zstd"], ["xyz.exr"]],
)
def test_apply_on_a_full_disk(run, tmp_path, options):
    if "xyz.exr" in options:
        pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    image = an_image(tmp_path / "image.tif", 200, 300)
    outputs = [part for name in options if "." in name for part in ("-o", tmp_path / name)]
    more = [option for option in options if "." not in option]
    with files_up_to(30_000):
        result = run("apply", image, *PAIR, *outputs, *more)
    assert result.code == 4
    assert "cannot be written: File too large" in result.err
    assert os.listdir(tmp_path) == ["image.tif"]


def simulated(tmp_path):
    data = tmp_path / "primaries.csv"
    rows = [f"p,{i},{r},{0.3 + i / 900},0.3,0.2" for i in (0, 20, 45) for r in (-60, -45, -20, 0, 30, 60)]
    head = '# schema = "iccbrdf-measurements"\n# version = 1\n# angles = "degree"\n# view_angles = "lamp"\n'
    view = '# quantity = "reflectance"\n# scale = 1\n# illuminant = "D50"\n'
    observer = '# observer = "CIE 1931 2 Degree Standard Observer"\n'
    data.write_text(head + view + observer + "\n".join(["patch,theta_i,theta_r,X,Y,Z", *rows]) + "\n")
    return data


def results_of(tmp_path):
    """Commands, each with one of the files that it writes."""
    xml = tmp_path / "in.xml"
    xml.write_bytes(profile_to_xml(read_profile(MVIS)))
    image = an_image(tmp_path / "in.tif", 8, 9)
    job = tmp_path / "job.tif"
    job.write_bytes(seeds.print_jobs()[0])
    out = tmp_path / "out"
    return {
        "build": (["build", PRIMARIES, "-o", out], "mvis.icc"),
        "apply": (["apply", image, *PAIR, "-o", out / "a.tif"], "a.tif"),
        "xml": (["xml", MVIS, "-o", out / "a.xml"], "a.xml"),
        "icc": (["icc", xml, "-o", out / "a.icc"], "a.icc"),
        "fit": (["fit", simulated(tmp_path), "-o", out / "p.json"], "p.json"),
        "simulate": (["simulate", "-o", out], "primaries.csv"),
        "demo": (["demo", "-o", out], "relief.tif"),
        "view": (["view", image, *PAIR, "-o", out / "a.html"], "a.html"),
        "proof": (["proof", job, "--primaries", PRIMARIES, "-o", out, "--keep", "xyz"], "xyz.tif"),
        "cost": (["cost", image, "--primaries", PRIMARIES, "-o", out, "--runs", "1"], "cost.png"),
        "evaluate": (["evaluate", tmp_path, "--plots", out], next(iter(PICTURES))),
    }


COMMANDS = (
    "build", "apply", "xml", "icc", "fit", "simulate", "demo", "view", "proof", "cost", "evaluate"
)  # fmt: skip
"""That write files: those of `results_of`."""


@pytest.mark.parametrize("name", ["build", "xml", "icc", "fit", "simulate", "view", "proof"])
def test_commands_on_a_full_disk(run, tmp_path, name):
    arguments, _ = results_of(tmp_path)[name]
    (tmp_path / "out").mkdir()
    with files_up_to(100):
        result = run(*arguments)
    assert result.code == 4, result.err
    assert "cannot be written: File too large" in result.err
    assert os.listdir(tmp_path / "out") == []


# Results in the way --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", COMMANDS)
def test_nothing_is_overwritten_unless_asked(run, tmp_path, name):
    arguments, file = results_of(tmp_path)[name]
    out = tmp_path / "out"
    out.mkdir()
    (out / file).write_bytes(b"mine")
    result = run(*arguments)
    assert result.code == 2, result.err
    assert f"{file}: exists already" in result.err
    assert (out / file).read_bytes() == b"mine"
    assert os.listdir(out) == [file]


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder that nobody can write to")
@pytest.mark.parametrize("name", ["build", "apply", "xml", "icc", "fit", "simulate", "view", "proof"])
def test_a_folder_that_cannot_be_written(run, tmp_path, name):
    arguments, _ = results_of(tmp_path)[name]
    nowhere = [Path(str(a).replace(str(tmp_path / "out"), "/proc/self")) for a in arguments]
    result = run(*nowhere)
    assert result.code == 2, result.err
    assert "cannot be written" in result.err


@pytest.mark.parametrize("name", COMMANDS)
def test_a_folder_that_cannot_be_made(run, tmp_path, name):
    """A file is in its way, which stays as it is."""
    arguments, _ = results_of(tmp_path)[name]
    out = tmp_path / "out"
    out.write_bytes(b"mine")
    result = run(*arguments)
    assert result.code == 2, result.err
    assert str(out) in result.err
    assert out.read_bytes() == b"mine"


# Inputs that shrink --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options", [{}, {"compression": "deflate", "rowsperstrip": 20}, {"planarconfig": "separate"}]
)
def test_an_image_that_shrinks_while_it_is_read(run, tmp_path, monkeypatch, options):
    data = np.random.default_rng(1).integers(100, 200, (900, 1000, 10), np.uint8)
    options = {"photometric": "minisblack", "planarconfig": "contig"} | options
    if options["planarconfig"] == "separate":
        data = np.moveaxis(data, 2, 0)
    image = tmp_path / "image.tif"
    tifffile.imwrite(image, data, **options)
    read, calls = TiffStorage.read, []

    def shrinking(self, *place):
        calls.append(place)
        if len(calls) == 2:
            os.truncate(image, os.path.getsize(image) // 3)
        return read(self, *place)

    monkeypatch.setattr(TiffStorage, "read", shrinking)
    result = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "--workers", "1")
    assert result.code == 3
    assert f"{image}: truncated: no" in result.err
    assert os.listdir(tmp_path) == ["image.tif"]


def test_a_profile_that_is_cut_off(run, tmp_path):
    data = MVIS.read_bytes()
    short = tmp_path / "short.icc"
    for size in (0, 1, 127, 128, 131, 200, len(data) - 1):
        short.write_bytes(data[:size])
        assert run("dump", short).code == 3


# Pixels that are not finite ------------------------------------------------------------------------------


@pytest.fixture
def flawed(tmp_path):
    """An image in which four samples of three pixels are not finite, the first in row 3, column 7."""
    device = np.random.default_rng(5).uniform(0.4, 0.6, (20, 30, 10)).astype(np.float32)
    device[3, 7, 2], device[3, 7, 9] = np.nan, np.inf
    device[3, 8, 0] = -np.inf
    device[19, 29, 5] = np.nan
    path = tmp_path / "flawed.tif"
    tifffile.imwrite(path, device, photometric="minisblack", planarconfig="contig")
    return path


def apply(run, tmp_path, image, *options):
    result = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "--json", *options)
    return result, tifffile.imread(tmp_path / "xyz.tif") if result.code == 0 else None


def test_not_finite_is_kept_by_default(run, tmp_path):
    """A matrix passes it on; so do our models, whose MVIS then shows black."""
    scanner = tmp_path / "scanner.icc"
    write_profile(device_profile("scnr", A2B0=matrix(np.eye(3))), scanner)
    image = tmp_path / "rgb.tif"
    rgb = np.full((4, 5, 3), 0.5, np.float32)
    rgb[1, 2, 0], rgb[3, 3] = np.nan, np.inf
    tifffile.imwrite(image, rgb, photometric="rgb")
    arguments = ["apply", image, "-p", scanner, "--samples", "device", "--json", "-o", tmp_path / "xyz.tif"]
    result = run(*arguments)
    assert (result.json["nonfinite"], result.json["not_finite_in"]) == ("keep", 4)
    assert result.json["not_finite_out"] > 0
    assert np.isnan(tifffile.imread(tmp_path / "xyz.tif")[1, 2, 0])
    result = run(*arguments, "--nonfinite", "zero", "--force")
    assert (result.json["not_finite_in"], result.json["not_finite_out"]) == (4, 0)
    assert not tifffile.imread(tmp_path / "xyz.tif")[[1, 3], [2, 3]].any()


def test_not_finite_is_an_error(run, tmp_path, flawed):
    result, _ = apply(run, tmp_path, flawed, "--nonfinite", "error")
    assert result.code == 3
    assert "flawed.tif: row 3, column 7, channel 2: found nan, expected a finite number" in result.err
    assert os.listdir(tmp_path) == ["flawed.tif"]


@pytest.mark.parametrize("more", [[], ["--backend", "interpreter"], ["--effects", "auto"]])
def test_not_finite_is_zero(run, tmp_path, flawed, more):
    """All samples of such a pixel are taken for 0, as if the image held them, and no other changes."""
    result, xyz = apply(run, tmp_path, flawed, "--nonfinite", "zero", *more)
    assert (result.json["not_finite_in"], result.json["not_finite_out"]) == (4, 0)
    assert "4 samples of the image are not finite numbers; their pixels are taken for 0" in result.err
    device = tifffile.imread(flawed)
    device[[3, 3, 19], [7, 8, 29]] = 0
    expected = iccbrdf.link([MID, MVIS], backend=more[1] if "--backend" in more else "auto")(device)
    np.testing.assert_allclose(xyz, expected, rtol=1e-5, atol=1e-7)
    assert not xyz[[3, 3, 19], [7, 8, 29]].any()


@pytest.mark.parametrize("treatment", ["keep", "zero", "error"])
def test_finite_images_are_all_the_same(run, tmp_path, treatment):
    image = an_image(tmp_path / "a.tif", 10, 10)
    result, xyz = apply(run, tmp_path, image, "--nonfinite", treatment)
    assert result.json["not_finite_in"] == 0
    np.testing.assert_array_equal(xyz, iccbrdf.link([MID, MVIS])(tifffile.imread(image) / np.float32(255)))
