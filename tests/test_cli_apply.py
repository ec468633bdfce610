"""iccbrdf apply: an image through profiles into files."""

import os
import pty
import shutil
import subprocess
import sys
from dataclasses import replace

import imagecodecs
import numpy as np
import pytest
import tifffile

import iccbrdf
from iccbrdf.brdf.geometry import direction
from iccbrdf.icc import Header, Matrix, Mluc, MultiProcess, Profile, TagArray, write_profile
from iccbrdf.images import Block, create_tiff, open_tiff, xyz_to_srgb
from iccbrdf.resources import folder

MID, MVIS = (folder("profiles") / "fogra39_gloss" / name for name in ("mid.icc", "mvis.icc"))
PAIR = ["-p", MID, "-p", MVIS]
NAMES = ["kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m", "n.x", "n.y", "n.z"]
HEIGHT, WIDTH = 40, 50


def device_values() -> np.ndarray:
    """A BRDF image in 0..1; normals lean up to 45 degrees."""
    device = np.random.default_rng(5).random((HEIGHT, WIDTH, 10), np.float32)
    device[..., 7:9] = 0.3 + 0.4 * device[..., 7:9]
    device[..., 9] = 0.9
    return device


def write(path, data, **options):
    options = {"photometric": "minisblack", "planarconfig": "contig"} | options
    tifffile.imwrite(path, data, **options)
    return path


def read(path) -> np.ndarray:
    return tifffile.imread(path)


def expected(device=None, **options) -> np.ndarray:
    return iccbrdf.link([MID, MVIS], **options)(device_values() if device is None else device)


@pytest.fixture
def image(tmp_path):
    return write(tmp_path / "image.tif", device_values())


def left_beside(tmp_path) -> list[str]:
    """What a command left in the folder besides its input."""
    return sorted(set(os.listdir(tmp_path)) - {"image.tif"})


def test_tiff_and_png_at_once(run, tmp_path, image):
    tiff, png = tmp_path / "xyz.tif", tmp_path / "proof.png"
    result = run("apply", image, *PAIR, "-o", tiff, "-o", png)
    assert (result.code, result.err) == (0, "")
    assert f"{image}: 50 x 40 pixels, 10 channels (device samples)" in result.out
    assert str(tiff) in result.out
    assert str(png) in result.out
    XYZ = expected()
    assert read(tiff).dtype == np.float32
    assert np.array_equal(read(tiff), XYZ)
    with open_tiff(tiff) as written:
        assert (written.names, written.samples, written.profile) == (("X", "Y", "Z"), "real", None)
    levels = np.rint(xyz_to_srgb(XYZ).clip(0, 1) * 255)
    assert np.array_equal(imagecodecs.imread(png), levels)


def test_json(run, tmp_path, image):
    outputs = [tmp_path / "xyz.tif", tmp_path / "proof.png"]
    result = run("apply", image, *PAIR, "-o", outputs[0], "-o", outputs[1], "--env", "litI=30", "--json")
    assert (result.code, result.err) == (0, "")
    done = result.json
    assert done["schema"] == "iccbrdf.apply/1"
    assert (done["width"], done["height"], done["samples"]) == (WIDTH, HEIGHT, "device")
    assert (done["channels_in"], done["channels_out"]) == (NAMES, ["X", "Y", "Z"])
    assert done["env"] == {"litI": 30.0}
    assert [output["path"] for output in done["outputs"]] == list(map(str, outputs))
    Y = expected(env={"litI": 30.0})[..., 1]
    assert done["outputs"][1]["above_white"] == (Y > 1.0045).sum() > 100
    assert done["not_finite_in"] == done["not_finite_out"] == 0


def test_uint16_is_u1_15_with_clipped_samples_counted(run, tmp_path, image):
    tiff = tmp_path / "xyz.tif"
    done = run("apply", image, *PAIR, "-o", tiff, "--dtype", "uint16", "--env", "litI=12", "--json").json
    levels = np.rint(expected(env={"litI": 12.0}) * np.float32(32768))
    assert np.array_equal(read(tiff), levels.clip(0, 65535).astype(np.uint16))
    assert done["outputs"][0]["clipped"] == (levels > 65535).sum() > 100


def test_embedded_profile_is_the_last_one(run, tmp_path, image):
    assert run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "--embed").code == 0
    with open_tiff(tmp_path / "xyz.tif") as written:
        assert written.profile == MVIS.read_bytes()


def test_png_of_16_bits_and_exposure(run, tmp_path, image):
    png = tmp_path / "proof.png"
    assert run("apply", image, *PAIR, "-o", png, "--depth", "16", "--exposure", "0.5").code == 0
    levels = np.rint(xyz_to_srgb(expected() * np.float32(0.5)).clip(0, 1) * 65535)
    assert np.array_equal(imagecodecs.imread(png), levels)


@pytest.mark.parametrize(
    "light", ["60,90", "60,450", "-60,270", "0,1.7320508075688772,1", "0,1e300,5.773502691896257e299"]
)
def test_light_as_angles_and_as_vector(run, tmp_path, image, light):
    assert run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "--light", light).code == 0
    env = dict(zip(("litX", "litY", "litZ"), direction(60, 90), strict=True))
    assert read(tmp_path / "xyz.tif") == pytest.approx(expected(env=env), rel=1e-5)


def test_view_and_the_last_word_of_env(run, tmp_path, image):
    scene = ["--light", "0,0", "--view", "30,0", "--env", "litX=0.5"]
    done = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", *scene, "--json").json
    env = {"litX": 0.5, "litY": 0, "litZ": 1, "vueX": 0.5, "vueY": 0, "vueZ": np.sqrt(0.75)}
    assert done["env"] == pytest.approx(env)
    assert read(tmp_path / "xyz.tif") == pytest.approx(expected(env=env), rel=1e-5)


def test_double_and_workers(run, tmp_path):
    image = write(tmp_path / "image.tif", np.tile(device_values(), (1, 20, 1)))
    for name, options in (("one", []), ("three", ["--workers", "3"]), ("double", ["--double"])):
        assert run("apply", image, *PAIR, "-o", tmp_path / f"{name}.tif", *options).code == 0
    assert (tmp_path / "one.tif").read_bytes() == (tmp_path / "three.tif").read_bytes()
    double = expected(dtype="float64")
    assert np.array_equal(read(tmp_path / "double.tif")[:, :WIDTH], double.astype(np.float32))
    assert not np.array_equal(read(tmp_path / "one.tif"), read(tmp_path / "double.tif"))


def test_channels_in_another_order_and_fewer(run, tmp_path):
    device = device_values()
    image = write(tmp_path / "image.tif", device[..., [6, 2, 1, 0, 5, 4, 3]])
    names = "m, kd.Z, kd.Y, kd.X, ks.Z, ks.Y, ks.X"
    done = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "--channels", names, "--json").json
    assert done["channels_in"] == names.split(", ")
    device[..., 7:] = 0.5, 0.5, 1  # a flat print
    assert read(tmp_path / "xyz.tif") == pytest.approx(expected(device), rel=1e-5)


def test_channel_names_of_the_file(run, tmp_path):
    image = tmp_path / "image.tif"
    with create_tiff(image, HEIGHT, WIDTH, NAMES[::-1], samples="device") as sink:
        sink.write(Block(0, 0, device_values()[..., ::-1]))
    assert run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif").code == 0
    assert np.array_equal(read(tmp_path / "xyz.tif"), expected())


def test_real_samples(run, tmp_path):
    real = device_values()
    real[..., 7:] = 2 * real[..., 7:] - 1
    image = write(tmp_path / "image.tif", real)
    refused = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif")
    assert (refused.code, refused.out) == (3, "")
    assert "row 0, column" in refused.err
    assert "--samples real" in refused.err
    assert left_beside(tmp_path) == []
    assert run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "--samples", "real").code == 0
    assert read(tmp_path / "xyz.tif") == pytest.approx(expected(), rel=1e-4, abs=1e-6)


def test_multiplex_channels_out_and_in_again(run, tmp_path, image):
    assert run("apply", image, "-p", MID, "-o", tmp_path / "mcs.tif").code == 0
    with open_tiff(tmp_path / "mcs.tif") as written:
        assert (list(written.names), written.samples) == (NAMES, "real")
    assert read(tmp_path / "mcs.tif")[..., 7:] == pytest.approx(2 * device_values()[..., 7:] - 1, abs=1e-6)
    assert run("apply", tmp_path / "mcs.tif", "-p", MVIS, "-o", tmp_path / "xyz.tif").code == 0
    assert np.array_equal(read(tmp_path / "xyz.tif"), expected())


def two_channel(device_class: str, tag: str, gains, **header) -> Profile:
    """A profile that multiplies two channels into as many as `gains` has rows."""
    matrix = np.array(gains, np.float32)
    element = Matrix(inputs=2, matrix=matrix, offset=np.zeros(len(matrix)))
    names = {"mcta": TagArray.of_texts(["a", "b"])} if "mcs" in header else {}
    return Profile(
        Header(device_class=device_class, **header),
        {
            "desc": Mluc.of("test"),
            "cprt": Mluc.of("test"),
            **names,
            tag: MultiProcess(2, len(matrix), (element,)),
        },
    )


@pytest.fixture
def two_channels(tmp_path):
    data = np.linspace(0, 1, 12, dtype=np.float32).reshape(2, 3, 2)
    write_profile(
        two_channel("mid ", "A2M0", [[1, 0], [0, 1]], colour_space="nc0002", mcs="mc0002"),
        tmp_path / "mid.icc",
    )
    return write(tmp_path / "image.tif", data), ["-p", tmp_path / "mid.icc"], data


def test_lab_out(run, tmp_path, two_channels):
    image, chain, data = two_channels
    mvis = two_channel("mvis", "M2B0", [[100, 0], [0, 0], [0, 0]], pcs="Lab ", mcs="mc0002")
    write_profile(mvis, tmp_path / "mvis.icc")
    chain += ["-p", tmp_path / "mvis.icc"]
    result = run("apply", image, *chain, "-o", tmp_path / "lab.tif", "-o", tmp_path / "grey.png")
    assert result.code == 0
    with open_tiff(tmp_path / "lab.tif") as written:
        assert written.names == ("L*", "a*", "b*")
    assert read(tmp_path / "lab.tif")[..., 0] == pytest.approx(100 * data[..., 0])
    Y = ((100 * data[..., 0].astype(float) + 16) / 116) ** 3
    Y = np.where(data[..., 0] > 0.08, Y, 100 * data[..., 0] / 903.3)
    sRGB = np.where(Y > 0.0031308, 1.055 * Y ** (1 / 2.4) - 0.055, 12.92 * Y)
    grey = imagecodecs.imread(tmp_path / "grey.png").astype(float)
    assert np.abs(grey - 255 * sRGB[..., None]).max() <= 1

    refused = run("apply", image, *chain, "-o", tmp_path / "lab16.tif", "--dtype", "uint16")
    assert refused.code == 2
    assert "write float32" in refused.err
    assert not (tmp_path / "lab16.tif").exists()


def test_device_values_out_are_recorded_as_such(run, tmp_path, two_channels):
    image, _, data = two_channels
    link = two_channel("link", "A2B0", [[0.5, 0], [0, 1]], colour_space="nc0002", pcs="nc0002")
    write_profile(link, tmp_path / "link.icc")
    out = tmp_path / "out.tif"
    assert run("apply", image, "-p", tmp_path / "link.icc", "-o", out, "--dtype", "uint16").code == 0
    with open_tiff(out) as written:
        assert written.samples == "device"
    assert read(out)[..., 1] == pytest.approx(np.rint(data[..., 1] * 65535))
    refused = run("apply", image, "-p", tmp_path / "link.icc", "-o", tmp_path / "out.png")
    assert refused.code == 2
    assert "a PNG needs profiles that end on XYZ or Lab" in refused.err


def test_pixels_that_are_no_numbers(run, tmp_path):
    device = device_values()
    device[3, 4, :3] = np.nan
    device[5, 6, 2] = np.inf
    image = write(tmp_path / "image.tif", device)
    result = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "-o", tmp_path / "p.png", "--json")
    assert result.code == 0
    # The MID's matrix spreads them over the pixel, and what has no normal is black (as in other CMMs).
    assert (result.json["not_finite_in"], result.json["not_finite_out"]) == (4, 0)
    assert "warning: 4 samples of the image are not finite numbers" in result.err
    XYZ = read(tmp_path / "xyz.tif")
    assert XYZ[3, 4].tolist() == XYZ[5, 6].tolist() == [0, 0, 0]
    assert (XYZ == 0).all(axis=2).sum() == 2
    assert imagecodecs.imread(tmp_path / "p.png")[3, 4].tolist() == [0, 0, 0]


def test_deviating_profile_is_warned_about(run, tmp_path, image):
    odd = iccbrdf.read_profile(MVIS)
    tags = {("M2B2" if tag == "M2B0" else tag): odd[tag] for tag in odd}
    write_profile(Profile(replace(odd.header), tags), tmp_path / "mvis.icc")
    result = run("apply", image, "-p", MID, "-p", tmp_path / "mvis.icc", "-o", tmp_path / "xyz.tif", "--json")
    assert (result.code, result.json["schema"]) == (0, "iccbrdf.apply/1")
    assert result.err.startswith("iccbrdf: warning: ")
    assert "M2B2" in result.err


def test_images_that_do_not_go_with_the_first_profile(run, tmp_path, image):
    out = ["-o", tmp_path / "out.tif"]
    alone = run("apply", image, "-p", MVIS, *out)
    assert (alone.code, "begin with the MID" in alone.err) == (2, True)
    with create_tiff(tmp_path / "named.tif", 1, 1, ["X", "Y", "Z"], samples="real") as sink:
        sink.write(Block(0, 0, np.ones((1, 1, 3), np.float32)))
    named = run("apply", tmp_path / "named.tif", "-p", MID, "-p", MVIS, *out)
    assert (named.code, "the image holds X, Y, Z, the first profile takes kd.X, " in named.err) == (3, True)


def test_XYZ_on_another_scale(run, tmp_path):
    data = np.tile(np.float32([0.8, 0.9, 0.7, 0, 0, 1]), (4, 5, 1))
    names = ",".join(["X", "Y", "Z", *NAMES[-3:]])
    for scale, code in ((1, 0), (100, 3)):
        data[..., :3] *= scale
        path = write(tmp_path / f"{scale}.tif", data)
        chain = ["-p", MID.with_name("colour-mid.icc"), "-p", MVIS, "-o", tmp_path / f"out{scale}.tif"]
        result = run("apply", path, *chain, "--samples", "real", "--channels", names)
        assert result.code == code
    assert "the mean of Y is 90, expected XYZ with Y = 1 for white" in result.err


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (["--env", "litQ=3"], 2, "'litQ' is read by none of the profiles: did you mean 'litZ'?"),
        (["--env", "litx=3"], 2, "did you mean 'litX'?"),
        (["--env", "litX"], 2, "--env 'litX': expected NAME=VALUE"),
        (["--env", "litX=red"], 2, "--env litX: found 'red', expected a finite number"),
        (["--env", "litX=nan"], 2, "expected a finite number"),
        (["--light", "60"], 2, "--light '60': expected ZENITH,AZIMUTH in degrees or a vector X,Y,Z"),
        (["--light", "95,0"], 2, "zenith angle is 95, expected -90 to 90"),
        (["--light", "0,1,-1"], 2, "--light '0,1,-1': z is -1, behind the print"),
        (["--view", "0,0,0"], 2, "a vector of length 0 has no direction"),
        (["--view", "up"], 2, "--view 'up': expected ZENITH,AZIMUTH"),
        (["--channels", "kd.X,kd.Y"], 2, "--channels names 2 channels, the image has 10"),
        (["--channels", ",".join([*NAMES[:9], "n.Z"])], 2, "'n.Z' is not in the first profile: did you mean"),
        (["--channels", ",".join([*NAMES[:9], "n.y"])], 2, "'n.y' comes twice"),
        (["--samples", "reel"], 2, "'reel' is not one of 'device', 'real'"),
        (["--exposure", "inf", "-o", "x.png"], 2, "exposure"),
        (["-o", "x.jpg"], 2, "x.jpg: found suffix '.jpg', expected .tif, .tiff, .png"),
        (["-o", "missing/x.tif"], 2, "missing does not exist"),
        (["-o", "out.tif"], 2, "out.tif: is to be written twice"),
        (["-p", "missing.icc"], 3, "missing.icc: cannot be read"),
        (["-p", "image.tif"], 3, "image.tif: header"),
        (["-p", str(MID)], 3, "starts from device space nc000a"),
    ],
)
def test_errors_write_nothing(run, tmp_path, image, monkeypatch, options, code, message):
    monkeypatch.chdir(tmp_path)
    result = run("apply", image, *PAIR, "-o", tmp_path / "out.tif", *options, "--json")
    assert result.code == code
    assert result.json["schema"] == "iccbrdf.error/1"
    assert result.json["exit_code"] == code
    assert message in result.json["error"]
    assert message in result.err
    assert "Traceback" not in result.err
    assert left_beside(tmp_path) == []


@pytest.mark.parametrize(
    ("data", "code", "message"),
    [
        (np.zeros((4, 5, 3), np.uint8), 2, "has 3 channels without names, the first profile 10 (kd.X, kd.Y,"),
        (np.zeros((4, 5, 10), np.int32), 3, "supported are"),
        (b"", 3, "not a readable TIFF"),
        (b"\x89PNG\r\n\x1a\n", 3, "not a readable TIFF"),
    ],
)
def test_unfit_images(run, tmp_path, data, code, message):
    image = tmp_path / "image.tif"
    if isinstance(data, bytes):
        image.write_bytes(data)
    else:
        write(image, data)
    result = run("apply", image, *PAIR, "-o", tmp_path / "out.tif", "-o", tmp_path / "out.png")
    assert result.code == code
    assert message in result.err
    assert left_beside(tmp_path) == []


def test_missing_image(run, tmp_path):
    result = run("apply", tmp_path / "no.tif", *PAIR, "-o", tmp_path / "out.tif")
    assert (result.code, result.out) == (3, "")
    assert "no.tif: cannot be read: No such file or directory" in result.err
    assert left_beside(tmp_path) == []


def test_existing_outputs(run, tmp_path, image):
    first, second = tmp_path / "a.tif", tmp_path / "b.png"
    second.write_text("mine")
    result = run("apply", image, *PAIR, "-o", first, "-o", second)
    assert (result.code, result.out) == (2, "")
    assert "b.png: exists already" in result.err
    assert second.read_text() == "mine"
    assert left_beside(tmp_path) == ["b.png"]
    assert run("apply", image, *PAIR, "-o", first, "-o", second, "--force").code == 0
    assert imagecodecs.imread(second).shape == (HEIGHT, WIDTH, 3)


def test_failure_in_mid_image_leaves_the_old_files(run, tmp_path):
    device = np.tile(device_values(), (15, 10, 1))
    image = write(tmp_path / "image.tif", device, compression="zlib", rowsperstrip=100)
    with tifffile.TiffFile(image) as file:
        last = file.pages[0].dataoffsets[-1]
    with image.open("r+b") as stream:
        stream.seek(last)
        stream.write(bytes(100))
    (tmp_path / "old.png").write_text("old")
    outputs = [option for name in ("new.tif", "new.png", "old.png") for option in ("-o", tmp_path / name)]
    result = run("apply", image, *PAIR, *outputs, "--force")
    assert (result.code, result.out) == (3, "")
    assert "segment 5 cannot be decoded" in result.err
    assert left_beside(tmp_path) == ["old.png"]
    assert (tmp_path / "old.png").read_text() == "old"


def test_image_may_be_replaced_by_the_result(run, tmp_path, image):
    assert run("apply", image, *PAIR, "-o", image, "--force").code == 0
    assert np.array_equal(read(image), expected())


def test_progress_on_a_terminal_leaves_stdout_alone(tmp_path, image):
    image = shutil.copy(image, tmp_path / "[red]relief[x].tif")
    ours, theirs = pty.openpty()
    program = [sys.executable, "-c", "from iccbrdf.cli import main; main()"]
    done = subprocess.run(
        [*program, "apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "--json"],
        stdout=subprocess.PIPE,
        stderr=theirs,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    )
    os.close(theirs)
    shown = os.read(ours, 1 << 16).decode()
    os.close(ours)
    assert done.returncode == 0
    assert done.stdout.startswith(b"{")
    assert done.stdout.rstrip().endswith(b"}")
    assert "[red]relief[x].tif" in shown
    assert "100%" in shown
