"""Whole proofs on the command line: colours as they were, the scenes of `link`, resume, batches, failures."""

from __future__ import annotations

import hashlib
import json

import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image
from proof_examples import (
    PRIMARIES,
    SLOPES,
    bump,
    lut_display,
    nodes,
    primaries_for_d65_10,
    write_height,
    write_lab,
)

import iccbrdf
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import build_colour_mid, build_pair
from iccbrdf.icc import read_profile
from iccbrdf.images import Block, create_tiff, height_to_normals, open_tiff, xyz_to_srgb
from iccbrdf.images.little_cms import from_XYZ
from iccbrdf.images.showing import display_p3
from iccbrdf.proof.reduced import Reduction

HEIGHT, WIDTH = 40, 50
MEASURED = ("--light", "45,180", "--view", "0,0", "--reference-white", "flat")
"""The geometry that the XYZ of the primaries were measured in."""


@pytest.fixture
def image(tmp_path):
    """A job in L*a*b* of smooth colours, and their XYZ."""
    y, x = np.mgrid[:HEIGHT, :WIDTH][..., None] / np.array([HEIGHT, WIDTH])[:, None, None, None]
    XYZ = np.array([0.6, 0.6, 0.4]) * (0.3 + 0.6 * x) + np.array([0.0, 0.05, 0.1]) * y
    return write_lab(tmp_path / "job.tif", XYZ), XYZ


def png(path):
    return imagecodecs.png_decode(path.read_bytes())


def levels(XYZ):
    return np.rint(xyz_to_srgb(np.asarray(XYZ, np.float32)).clip(0, 1) * 255)


def exr_or_tiff(path):
    if path.suffix == ".tif":
        with open_tiff(path) as source:
            (block,) = source.blocks()
            return tuple(source.names), block.data
    exr = pytest.importorskip("iccbrdf.images.exr")
    with exr.open_exr(path) as source:
        return tuple(source.names), np.concatenate([source.read(place).data for place in source.places()])


def test_a_flat_proof_has_the_colours_of_the_print(run, tmp_path):
    path = write_lab(tmp_path / "job.tif", nodes())
    result = run("proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "out", *MEASURED)
    assert (result.code, result.err) == (0, "")
    assert np.abs(png(tmp_path / "out" / "proof.png") - levels(nodes())).max() <= 1
    # By the default light the print is darker by the cosine of 45 degrees, and the gloss is not.
    run("proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "dark")
    darker = png(tmp_path / "dark" / "proof.png")
    assert np.abs(darker - levels(nodes() * 0.5**0.5)).max() <= 1


def test_primaries_under_other_conditions_give_the_same_picture(run, tmp_path):
    path = write_lab(tmp_path / "job.tif", nodes())
    primaries = primaries_for_d65_10(tmp_path / "primaries.json")
    result = run("proof", path, "--primaries", primaries, "-o", tmp_path / "out", *MEASURED, "--json")
    assert result.code == 0
    assert "the primaries for the CIE 1964 10 Degree" in result.err
    (log,) = result.json["jobs"]
    assert log["warnings"]
    assert log["colours"]["adaptation"].startswith("Bradford")
    assert np.abs(png(tmp_path / "out" / "proof.png") - levels(nodes())).max() <= 1


def test_cmyk_on_a_relief(run, tmp_path, shared_data):
    profile = shared_data / "icc" / "ISOcoated_v2_300_bas.icc"
    CMYK = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH, 4), np.uint8)
    tifffile.imwrite(tmp_path / "job.tif", CMYK, photometric="separated", tile=(16, 16), compression="lzw")
    relief = write_height(tmp_path / "relief.png", bump(HEIGHT, WIDTH)) / 10
    result = run(
        "proof", tmp_path / "job.tif", "--printer", profile, "--height", tmp_path / "relief.png",
        "--relief", f"{relief}mm", "--pixel-pitch", "0.1mm", "--primaries", PRIMARIES, "-o", tmp_path / "out",
        "--light", "60,0", "--keep", "xyz", "--keep", "flat", "--depth", "16", "--display", "display-p3",
    )  # fmt: skip
    assert (result.code, result.err) == (0, "")
    names, flat = exr_or_tiff(tmp_path / "out" / "flat.tif")
    assert names == ("X", "Y", "Z", "n.x", "n.y", "n.z")
    XYZ = imagecodecs.cms_transform(
        CMYK, profile.read_bytes(), imagecodecs.cms_profile("xyz"), colorspace="cmyk", outcolorspace="xyz",
        outdtype=np.float32, intent=imagecodecs.CMS.INTENT.ABSOLUTE_COLORIMETRIC,
    )  # fmt: skip
    np.testing.assert_allclose(flat[..., :3], XYZ, atol=2e-4)
    stored = np.rint((bump(HEIGHT, WIDTH) - bump(HEIGHT, WIDTH).min()) / np.ptp(bump(HEIGHT, WIDTH)) * 65535)
    np.testing.assert_allclose(flat[..., 3:], height_to_normals(stored / 65535 * relief, 0.1), atol=1e-5)
    # The profiles that are written give the same by themselves.
    chain = [tmp_path / "out" / "colour-mid.icc", tmp_path / "out" / "mvis.icc"]
    env = {"litX": 3**0.5 / 2, "litY": 0, "litZ": 0.5}
    expected = iccbrdf.link(chain, env=env, samples="real", channels=names)(flat)
    _, lit = exr_or_tiff(tmp_path / "out" / "xyz.tif")
    np.testing.assert_allclose(lit, expected, rtol=1e-5, atol=1e-6)
    picture = png(tmp_path / "out" / "proof.png")
    assert picture.dtype == np.uint16
    assert np.abs(picture - np.rint(from_XYZ(lit, display_p3()).clip(0, 1) * 65535)).max() <= 1
    assert lit[:, -8:, 1].mean() > lit[:, :8, 1].mean()


@pytest.mark.parametrize("kind", ["tiff", "exr"])
def test_images_that_are_kept(run, tmp_path, image, kind):
    if kind == "exr":
        pytest.importorskip("OpenEXR", reason="the extra exr is not installed")
    path, _ = image
    suffix = {"tiff": "tif", "exr": "exr"}[kind]
    result = run(
        "proof", path, "--primaries", PRIMARIES, "--slopes", SLOPES, "-o", tmp_path / "out",
        "--keep-as", kind, "--keep", "flat", "--keep", "brdf", "--keep", "xyz",
        "--light", "a=45,0", "--light", "b=45,90",
    )  # fmt: skip
    assert (result.code, result.err) == (0, "")
    read = {
        name: exr_or_tiff(tmp_path / "out" / f"{name}.{suffix}")
        for name in ("flat", "brdf", "xyz_a", "xyz_b")
    }
    primaries = read_primaries(PRIMARIES)
    colour = build_colour_mid(primaries, slopes=read_slopes(SLOPES)).mid
    assert read_profile(tmp_path / "out" / "colour-mid.icc") == colour
    mvis = build_pair(primaries).mvis
    names, flat = read["flat"]
    brdf = iccbrdf.link([colour], samples="real", channels=names)(flat)
    assert read["brdf"][0][:4] == ("kd.X", "kd.Y", "kd.Z", "ks.X")
    np.testing.assert_allclose(read["brdf"][1], brdf, atol=1e-6)
    lit = iccbrdf.link([mvis], env={"litX": 1, "litY": 0, "litZ": 1}, channels=read["brdf"][0])(brdf)
    np.testing.assert_allclose(read["xyz_a"][1], lit, rtol=1e-5)


def test_formats_and_displays(run, tmp_path, image):
    path, _ = image
    display = tmp_path / "lut.icc"
    display.write_bytes(lut_display().to_bytes())
    result = run(
        "proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "out", "--format", "tiff", "--depth", "16",
        "--display", display, "--sheet", "--sweep", "60,0:60,360", "--frames", 3, "--sweep-format", "webp",
    )  # fmt: skip
    assert (result.code, result.err) == (0, "")
    with tifffile.TiffFile(tmp_path / "out" / "proof.tif") as file:
        assert file.pages[0].dtype == np.uint16
        assert file.pages[0].iccprofile == display.read_bytes()
    for name in ("sheet.png", "sweep.webp"):
        with Image.open(tmp_path / "out" / name) as picture:
            assert picture.info["icc_profile"] == display.read_bytes()


def test_contact_sheet_and_sweep(run, tmp_path, image):
    path, _ = image
    write_height(tmp_path / "relief.png", bump(HEIGHT, WIDTH))
    result = run(
        "proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "out", "--height", tmp_path / "relief.png",
        "--pixel-pitch", "1mm", "--relief", "10mm", "--light", "left=60,180", "--light", "right=60,0",
        "--view", "front=0,0", "--view", "side=40,90", "--sheet", "--sheet-size", 25,
        "--sweep", "60,180:60,0", "--frames", 5, "--sweep-size", 1000,
    )  # fmt: skip
    assert (result.code, result.err) == (0, "")
    out = tmp_path / "out"
    with Image.open(out / "sheet.png") as sheet:
        pixels = np.asarray(sheet).astype(float)
    # Each picture stands once on the sheet, at half its size.
    small = {
        name: png(out / f"proof_{name}.png")
        for name in ("left-front", "right-front", "left-side", "right-side")
    }
    for picture in small.values():
        averaged = picture.reshape(20, 2, 25, 2, 3).mean(axis=(1, 3))
        corners = np.argwhere((np.abs(pixels[:-19, :-24] - averaged[0, 0]) < 6).all(axis=2))
        patches = (pixels[y : y + 20, x : x + 25] for y, x in corners)
        assert sum(np.abs(patch - averaged).max() < 6 for patch in patches) == 1
    with Image.open(out / "sweep.png") as animation:
        assert (animation.n_frames, animation.size, animation.info["loop"]) == (5, (WIDTH, HEIGHT), 0)
        frames = []
        for k in range(5):
            animation.seek(k)
            frames.append(np.asarray(animation.convert("RGB")).astype(float))
    np.testing.assert_allclose(frames[0], small["left-front"], atol=1)
    np.testing.assert_allclose(frames[4], small["right-front"], atol=1)
    assert np.abs(frames[2] - frames[0]).mean() > 3


def test_reduction_is_the_average_of_what_falls_into_a_pixel():
    data = np.random.default_rng(0).random((60, 90, 3))
    data[0, 0] = np.nan
    for longest, expected in (
        (30, np.nan_to_num(data).reshape(20, 3, 30, 3, 3).mean(axis=(1, 3))),
        (500, np.nan_to_num(data)),
    ):
        reduction = Reduction(60, 90, longest)
        for y in range(0, 60, 17):
            for x in range(0, 90, 40):
                reduction.put(reduction.encode(Block(y, x, data[y : y + 17, x : x + 40])))
        np.testing.assert_allclose(reduction.XYZ, expected, atol=1e-12)


def test_log(run, tmp_path, image):
    path, _ = image
    (tmp_path / "job.toml").write_text(
        f'image = "job.tif"\nprimaries = "{PRIMARIES}"\noutput = "out"\nlight = ["45,180", "glare=70,0"]\n'
        'view = "70,180"\n'
    )
    result = run("proof", tmp_path / "job.toml", "--json", "--workers", 2)
    assert (result.code, result.err) == (0, "")
    assert result.json["schema"] == "iccbrdf.proofs/1"
    (log,) = result.json["jobs"]
    assert log == json.loads((tmp_path / "out" / "proof.json").read_text())
    assert (log["schema"], log["status"], log["size"]) == (
        "iccbrdf.proof/1",
        "done",
        {"width": WIDTH, "height": HEIGHT},
    )
    assert log["inputs"]["image"]["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert log["job"]["light"] == ["45,180", "glare=70,0"]
    assert log["versions"]["iccbrdf"] == iccbrdf.__version__
    assert log["times"]["seconds"] > 0
    assert log["limits"] == {"not_finite_in": 0, "not_finite_out": 0, "beyond_slopes": 0}
    dull, glare = log["scenes"]
    assert (dull["picture"], glare["picture"]) == ("proof_45-180.png", "proof_glare.png")
    assert dull["clipped"] == 0
    # The mirror direction of grazing light: all of it is above the display's white.
    assert glare["above_white"] == glare["clipped"] == 1
    assert {output["file"] for output in log["outputs"]} == {
        "colour-mid.icc", "mid.icc", "mvis.icc", "proof_45-180.png", "proof_glare.png",
    }  # fmt: skip


def test_what_is_beyond_the_measured_slopes_is_counted(run, tmp_path, image):
    path, _ = image
    normals = np.zeros((HEIGHT, WIDTH, 3))
    normals[...] = 0, 0, 1
    normals[:3, :5] = np.sin(np.radians(75)), 0, np.cos(np.radians(75))
    (tmp_path / "n.png").write_bytes(
        imagecodecs.png_encode(np.rint((normals + 1) / 2 * 65535).astype(np.uint16))
    )
    result = run(
        "proof", path, "--primaries", PRIMARIES, "--slopes", SLOPES, "--normals", tmp_path / "n.png",
        "-o", tmp_path / "out", "--json",
    )  # fmt: skip
    assert result.json["jobs"][0]["limits"]["beyond_slopes"] == 15
    assert "15 pixels are steeper" in result.err


def test_a_job_that_is_done_is_not_done_again(run, tmp_path, image):
    path, XYZ = image
    arguments = ("proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "out")
    assert "done" in run(*arguments).out
    picture = tmp_path / "out" / "proof.png"
    before = picture.stat().st_mtime_ns
    result = run(*arguments, "--json")
    assert result.json["jobs"][0]["status"] == "skipped"
    assert picture.stat().st_mtime_ns == before
    # The same contents under another name are the same job; other contents or settings are another one.
    other = path.rename(tmp_path / "renamed.tif")
    assert "skipped" in run("proof", other, "--primaries", PRIMARIES, "-o", tmp_path / "out").out
    for changed in (("--exposure", "2"), ("--light", "60,0")):
        result = run("proof", other, "--primaries", PRIMARIES, "-o", tmp_path / "out", *changed)
        assert result.code == 2
        assert "exists already" in result.err
    assert picture.stat().st_mtime_ns == before
    write_lab(other, XYZ * 0.9)
    assert run("proof", other, "--primaries", PRIMARIES, "-o", tmp_path / "out").code == 2
    assert run("proof", other, "--primaries", PRIMARIES, "-o", tmp_path / "out", "--force").code == 0
    assert picture.stat().st_mtime_ns > before


def test_a_batch_goes_on_after_a_failure(run, tmp_path, image):
    path, _ = image
    tifffile.imwrite(tmp_path / "spot.tif", np.zeros((6, 7, 5), np.uint8), photometric="separated")
    (tmp_path / "later.toml").write_text(f'image = "job.tif"\nprimaries = "{PRIMARIES}"\n')
    result = run(
        "proof", tmp_path / "spot.tif", path, tmp_path / "later.toml", "--primaries", PRIMARIES,
        "-o", tmp_path / "out", "--json",
    )  # fmt: skip
    assert result.code == 3
    assert "spot and alpha channels cannot be proofed" in result.err
    assert [log["status"] for log in result.json["jobs"]] == ["failed", "done", "done"]
    assert "spot" in result.json["jobs"][0]["error"]
    for name, there in (("spot", False), ("job", True), ("later", True)):
        assert (tmp_path / "out" / name / "proof.png").exists() == there
    again = run("proof", path, tmp_path / "later.toml", "--primaries", PRIMARIES, "-o", tmp_path / "out")
    assert again.code == 0
    assert again.out.count("skipped") == 2
    (tmp_path / "same.toml").write_text(f'image = "job.tif"\nprimaries = "{PRIMARIES}"\noutput = "proof"')
    (tmp_path / "later.toml").write_text(f'image = "job.tif"\nprimaries = "{PRIMARIES}"\noutput = "proof"')
    result = run("proof", tmp_path / "same.toml", tmp_path / "later.toml")
    assert (result.code, "two jobs would be written to" in result.err) == (2, True)


def test_a_clipped_picture_fails_the_check_that_was_asked_for(run, tmp_path, image):
    path, _ = image
    arguments = ("proof", path, "--primaries", PRIMARIES, "--light", "70,0", "--view", "70,180")
    result = run(*arguments, "-o", tmp_path / "a", "--max-clipped", "0.5")
    assert result.code == 1
    assert "more than 0.5 clipped in proof.png" in result.err
    assert (tmp_path / "a" / "proof.png").exists()
    assert run(*arguments, "-o", tmp_path / "b", "--max-clipped", "0.5", "--highlights", "roll-off").code == 0


@pytest.mark.parametrize("kind", ["height", "normals"])
def test_a_relief_of_another_size(run, tmp_path, image, kind):
    path, _ = image
    arguments = ["proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "out", "--keep", "flat"]
    slope = np.tile(np.linspace(0, 1, 25), (20, 1))
    if kind == "height":
        relief = write_height(tmp_path / "map.png", slope)
        arguments += ["--height", tmp_path / "map.png", "--relief", relief, "--pixel-pitch", "0.1mm"]
    else:
        n = np.array([-0.2, 0, 0.98]) / np.hypot(0.2, 0.98)
        stored = np.rint((np.tile(n, (20, 25, 1)) + 1) / 2 * 65535).astype(np.uint16)
        (tmp_path / "map.png").write_bytes(imagecodecs.png_encode(stored))
        arguments += ["--normals", tmp_path / "map.png"]
    result = run(*arguments)
    assert result.code == 3
    assert "the relief has 25 x 20 pixels" in result.err
    assert "has 50 x 40; --fit-relief resamples it" in result.err
    assert not (tmp_path / "out" / "proof.png").exists()
    result = run(*arguments, "--fit-relief")
    assert (result.code, result.err) == (0, "")
    _, flat = exr_or_tiff(tmp_path / "out" / "flat.tif")
    # One unit over 24 steps of what are now 0.2 mm.
    expected = np.array([-1 / 4.8, 0, 1]) / np.hypot(1 / 4.8, 1) if kind == "height" else n
    inner = flat[5:-5, 5:-5, 3:]
    np.testing.assert_allclose(inner.mean(axis=(0, 1)), expected, atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(flat[..., 3:], axis=2), 1, atol=1e-5)


def test_a_relief_of_another_shape_is_warned_about(run, tmp_path, image):
    path, _ = image
    write_height(tmp_path / "map.png", bump(40, 40))
    result = run(
        "proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "out", "--height", tmp_path / "map.png",
        "--pixel-pitch", "1mm", "--fit-relief",
    )  # fmt: skip
    assert result.code == 0
    assert "40 x 40 pixels, is stretched to 50 x 40" in result.err


def test_missing_inputs_and_impossible_jobs(run, tmp_path, image):
    path, _ = image
    given = ("-o", tmp_path / "out")
    for arguments, code, message in (
        ((path, *given), 2, "--primaries is missing"),
        ((tmp_path / "no.tif", *given, "--primaries", PRIMARIES), 3, "no.tif: cannot be read"),
        ((path, *given, "--primaries", tmp_path / "no.json"), 3, "no.json: cannot be read"),
        ((path, *given, "--primaries", PRIMARIES, "--printer", "no.icc"), 3, "no.icc: cannot be read"),
        ((path, *given, "--primaries", PRIMARIES, "--display", "sRBG"), 2, "did you mean 'srgb'"),
        ((path, *given, "--primaries", PRIMARIES, "--env", "liti=1"), 2, "did you mean 'litI'"),
        ((path, *given, "--primaries", PRIMARIES, "--light", "1,2,3,4"), 2, "expected ZENITH,AZIMUTH"),
        (
            (path, *given, "--primaries", PRIMARIES, "--light", "a b=1,0", "--light", "a  b=1,0"),
            2,
            "name them",
        ),
        ((tmp_path / "no.toml",), 3, "no.toml: cannot be read"),
        ((path, *given, "--primary", PRIMARIES), 2, "--primaries"),
    ):
        result = run("proof", *arguments)
        assert (result.code, result.out) == (code, ""), result.err
        assert message in result.err
    assert list((tmp_path / "out").glob("*")) == []


def test_animations_that_are_too_large(run, tmp_path, image):
    path, _ = image
    given = ("proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "out", "--sweep", "60,0:60,90")
    result = run(*given, "--frames", 1001)
    assert (result.code, "1001 pictures" in result.err) == (4, True)
    large = write_lab(tmp_path / "large.tif", np.broadcast_to(nodes()[0, :1], (300, 300, 3)))
    result = run("proof", large, *given[2:], "--frames", 1000, "--sweep-size", 300)
    assert (result.code, "90000000 pixels" in result.err) == (4, True)
    assert list((tmp_path / "out").glob("*")) == []


def test_normals_that_come_twice(run, tmp_path, image):
    path = tmp_path / "xyzn.tif"
    with create_tiff(path, 4, 5, ("X", "Y", "Z", "n.x", "n.y", "n.z"), samples="real") as sink:
        sink.write(Block(0, 0, np.full((4, 5, 6), 0.5, np.float32)))
    (tmp_path / "map.png").write_bytes(imagecodecs.png_encode(np.full((4, 5, 3), 200, np.uint8)))
    arguments = ("proof", path, "--primaries", PRIMARIES, "-o", tmp_path / "out")
    result = run(*arguments, "--normals", tmp_path / "map.png")
    assert (result.code, "has a channel 'n.x' itself" in result.err) == (2, True)
    assert run(*arguments).code == 0


def test_the_same_job_gives_the_same_bytes(run, tmp_path, image):
    path, _ = image
    for name, workers in (("a", 1), ("b", 2)):
        result = run(
            "proof", path, "--primaries", PRIMARIES, "-o", tmp_path / name, "--sheet",
            "--sweep", "60,0:60,90", "--frames", 2, "--keep", "xyz", "--workers", workers,
        )  # fmt: skip
        assert result.code == 0
    for file in (tmp_path / "a").iterdir():
        if file.name != "proof.json":
            assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes(), file.name
