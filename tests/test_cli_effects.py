"""iccbrdf apply: effects, back ends, and OpenEXR files."""

import numpy as np
import pytest
import tifffile

import iccbrdf
from iccbrdf.resources import folder

MID, MVIS = (folder("profiles") / "fogra39_gloss" / name for name in ("mid.icc", "mvis.icc"))
PAIR = ["-p", MID, "-p", MVIS]
HEIGHT, WIDTH = 64, 1024
CORNER = (slice(None), slice(0, 512))


def device_values() -> np.ndarray:
    """A glossy relief, whose left half is flat and matte."""
    device = np.random.default_rng(5).uniform(0.1, 0.9, (HEIGHT, WIDTH, 10)).astype(np.float32)
    device[..., 7:9] = 0.4 + 0.2 * device[..., 7:9]
    device[..., 9] = 0.95
    device[CORNER] = [*device[0, 0, :3], 0, 0, 0, 0.3, 0.5, 0.5, 1]
    return device


def expected(**options) -> np.ndarray:
    return iccbrdf.link([MID, MVIS], **options)(device_values())


@pytest.fixture
def image(tmp_path):
    path = tmp_path / "image.tif"
    tifffile.imwrite(
        path, device_values(), photometric="minisblack", planarconfig="contig", rowsperstrip=HEIGHT
    )
    return path


def test_auto_gives_the_same_with_less(run, tmp_path, image):
    options = ["--backend", "numpy", "--effects", "auto", "--workers", "1"]
    result = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", *options, "--json")
    assert (result.code, result.err) == (0, "")
    assert result.json["kinds"] == {"n constant, ks 0": HEIGHT * 512, "full": HEIGHT * 512}
    assert (result.json["backend"], result.json["backend_reason"]) == ("numpy", "it was asked for")
    assert (result.json["effects"], result.json["without"]) == ("auto", [])
    np.testing.assert_array_equal(tifffile.imread(tmp_path / "xyz.tif"), expected(backend="numpy"))
    result = run("apply", image, *PAIR, "-o", tmp_path / "again.tif", *options)
    assert "  tiles: 50% n constant, ks 0, 50% full" in result.out


def test_full_is_the_default(run, tmp_path, image):
    result = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", "--json")
    assert result.json["effects"] == "full"
    assert result.json["kinds"] == {}


@pytest.mark.parametrize(
    ("options", "left_out"),
    [
        (["--without", "relief,specular"], ["relief", "specular"]),
        (["--effects", "relief"], ["specular", "chromatic-specular"]),
        (["--effects", "specular,chromatic_specular"], ["relief"]),
    ],
)
def test_effects_are_left_out(run, tmp_path, image, options, left_out):
    result = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", *options)
    assert (result.code, result.err) == (0, "")
    found = tifffile.imread(tmp_path / "xyz.tif")
    np.testing.assert_allclose(found, expected(without=left_out), rtol=2e-6)
    assert not np.allclose(found, expected(), rtol=1e-3)


def test_effects_of_programs_are_left_out_by_compiling_their_source_anew(run, tmp_path, image):
    build = ("build", MVIS.with_name("primaries.json"), "-o", tmp_path, "--without", "fresnel,shadowing")
    assert run(*build).code == 0
    result = run("apply", image, *PAIR, "-o", tmp_path / "a.tif", "--without", "fresnel,shadowing", "--json")
    assert (result.code, result.err) == (0, "")
    assert result.json["without"] == ["fresnel", "shadowing"]
    found = tifffile.imread(tmp_path / "a.tif")
    reduced = ["-p", tmp_path / "mid.icc", "-p", tmp_path / "mvis.icc"]
    for name, options in (("b.tif", []), ("c.tif", ["--effects", "full", "--without", "fresnel"])):
        assert run("apply", image, *reduced, "-o", tmp_path / name, *options).code == 0
        np.testing.assert_array_equal(tifffile.imread(tmp_path / name), found)
    # And put back.
    every = "relief,specular,chromatic-specular,fresnel,shadowing"
    assert run("apply", image, *reduced, "-o", tmp_path / "d.tif", "--effects", every).code == 0
    np.testing.assert_allclose(tifffile.imread(tmp_path / "d.tif"), expected(), rtol=2e-6)
    assert not np.allclose(found, expected(), rtol=1e-3)


def test_effects_of_programs_without_a_source_are_refused(run, tmp_path, image):
    build = ("build", MVIS.with_name("primaries.json"), "-o", tmp_path, "--no-source")
    assert run(*build).code == 0
    pair = ["-p", tmp_path / "mid.icc", "-p", tmp_path / "mvis.icc"]
    result = run("apply", image, *pair, "-o", tmp_path / "a.tif", "--without", "fresnel")
    assert result.code == 2
    assert "iccbrdf build --without fresnel" in result.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--without", "slope"], "iccbrdf build --without slope"),
        (["--without", "gloss"], "there is no effect 'gloss'"),
        (["--backend", "nunpy"], "'nunpy' is not one of"),
    ],
)
def test_what_cannot_be_switched_is_refused(run, tmp_path, image, options, message):
    result = run("apply", image, *PAIR, "-o", tmp_path / "xyz.tif", *options)
    assert result.code == 2
    assert message in result.err
    assert not (tmp_path / "xyz.tif").exists()


def test_openexr_in_and_out(run, tmp_path, image):
    exr = pytest.importorskip("iccbrdf.images.exr")
    pytest.importorskip("OpenEXR")
    from iccbrdf.images import Block

    names = ["kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m", "n.x", "n.y", "n.z"]
    with exr.create_exr(tmp_path / "image.exr", HEIGHT, WIDTH, names, samples="device") as sink:
        sink.write(Block(0, 0, device_values()))
    result = run(
        "apply", tmp_path / "image.exr", *PAIR, "-o", tmp_path / "xyz.exr", "-o", tmp_path / "xyz.tif"
    )
    assert (result.code, result.err) == (0, "")
    with exr.open_exr(tmp_path / "xyz.exr") as source:
        assert (tuple(source.names), source.samples) == (("X", "Y", "Z"), "real")
        data = np.concatenate([source.read(place).data for place in source.places()])
    np.testing.assert_array_equal(data, expected())
    np.testing.assert_array_equal(tifffile.imread(tmp_path / "xyz.tif"), expected())


def test_a_cluster_takes_and_gives_tiffs(run, tmp_path, image):
    exr = tmp_path / "image.exr"
    result = run("apply", exr, *PAIR, "-o", tmp_path / "xyz.tif", "--cluster", "local:1")
    assert (result.code, "a cluster reads TIFFs" in result.err) == (2, True)
    result = run("apply", image, *PAIR, "-o", tmp_path / "xyz.exr", "--cluster", "local:1")
    assert (result.code, "a cluster writes one TIFF" in result.err) == (2, True)
