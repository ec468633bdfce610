"""iccbrdf apply with the relief in a file of its own: normal maps and height maps."""

from __future__ import annotations

import imagecodecs
import numpy as np
import pytest
from conftest import ROOT

import iccbrdf
from iccbrdf.images import Block, create_tiff, open_tiff

FOLDER = ROOT / "profiles" / "fogra39_gloss"
CHAIN = ("-p", FOLDER / "colour-mid.icc", "-p", FOLDER / "mvis.icc")
HEIGHT, WIDTH = 40, 50


@pytest.fixture
def colours(tmp_path):
    """An image of XYZ alone, in device values."""
    XYZ = np.random.default_rng(1).uniform(0.1, 0.3, (HEIGHT, WIDTH, 3)).astype(np.float32)
    path = tmp_path / "xyz.tif"
    with create_tiff(path, HEIGHT, WIDTH, "XYZ", samples="device") as sink:
        sink.write(Block(0, 0, XYZ))
    return path, XYZ


def bump() -> np.ndarray:
    """A paraboloid, its top in the middle, in the unit of the pixels."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return 10 - ((x - (WIDTH - 1) / 2) ** 2 + (y - (HEIGHT - 1) / 2) ** 2) / 100


def proof(XYZ, n, light):
    transform = iccbrdf.link([FOLDER / "colour-mid.icc", FOLDER / "mvis.icc"])
    env = dict(zip(("litX", "litY", "litZ"), light, strict=True))
    return transform.with_env(env)(np.concatenate([XYZ, (n + 1) / 2], axis=2))


def read(path) -> np.ndarray:
    with open_tiff(path) as source:
        (block,) = source.blocks()
    return block.data


def test_height_map(run, tmp_path, colours):
    path, XYZ = colours
    heights = bump()
    relief = np.ptp(heights) / 4  # pixels of a quarter of a millimetre
    stored = np.rint((heights - heights.min()) / np.ptp(heights) * 65535).astype(np.uint16)
    (tmp_path / "height.png").write_bytes(imagecodecs.png_encode(stored))
    result = run(
        "apply", path, *CHAIN, "-o", tmp_path / "out.tif", "--light", "1,0,1",
        "--height", tmp_path / "height.png", "--relief", relief, "--pixel-pitch", 0.25,
    )  # fmt: skip
    assert (result.code, result.err) == (0, "")
    found = read(tmp_path / "out.tif")[1:-1, 1:-1]
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    # The slopes of the paraboloid; rows go down, y goes up.
    n = np.stack([(x - (WIDTH - 1) / 2) / 50, -(y - (HEIGHT - 1) / 2) / 50, np.ones_like(heights)], axis=2)
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    expected = proof(XYZ, n, (1, 0, 1))[1:-1, 1:-1]
    assert np.abs(found / expected - 1).max() < 0.01
    # Lit from the right, the bump is brighter on its right flank.
    assert (found[:, -8:, 1] / XYZ[1:-1, -9:-1, 1]).mean() > 1.3 * (
        found[:, :8, 1] / XYZ[1:-1, 1:9, 1]
    ).mean()


@pytest.mark.parametrize("green", ["up", "down"])
def test_normal_map(run, tmp_path, colours, green):
    path, XYZ = colours
    n = np.zeros((HEIGHT, WIDTH, 3))
    n[..., 1], n[..., 2] = 0.6, 0.8  # facing the top
    stored = n * (1, 1 if green == "up" else -1, 1)
    encoded = np.rint((stored + 1) / 2 * 65535).astype(np.uint16)
    (tmp_path / "normals.png").write_bytes(imagecodecs.png_encode(encoded))
    result = run(
        "apply", path, *CHAIN, "-o", tmp_path / "out.tif", "--light", "0,1,1",
        "--normals", tmp_path / "normals.png", "--green", green,
    )  # fmt: skip
    assert (result.code, result.err) == (0, "")
    assert np.abs(read(tmp_path / "out.tif") - proof(XYZ, n, (0, 1, 1))).max() < 1e-4


def test_pixels_without_a_direction_are_reported(run, tmp_path, colours):
    path, _ = colours
    encoded = np.full((HEIGHT, WIDTH, 3), 32768, np.uint16)
    encoded[..., 2] = 65535
    encoded[3, 4, 2] = 32768
    (tmp_path / "normals.png").write_bytes(imagecodecs.png_encode(encoded))
    result = run("apply", path, *CHAIN, "-o", tmp_path / "out.tif", "--normals", tmp_path / "normals.png")
    assert result.code == 0
    assert "warning" in result.err
    assert "1 pixels without a direction" in result.err


def test_sizes_and_options_that_do_not_fit(run, tmp_path, colours):
    path, _ = colours
    (tmp_path / "small.png").write_bytes(imagecodecs.png_encode(np.zeros((HEIGHT, WIDTH - 1), np.uint8)))
    (tmp_path / "map.png").write_bytes(imagecodecs.png_encode(np.full((HEIGHT, WIDTH, 3), 200, np.uint8)))
    lengths = ("--relief", 1, "--pixel-pitch", 1)
    for options, code, message in (
        (("--height", tmp_path / "small.png", *lengths), 3, "49 x 40 pixels, expected the image's 50 x 40"),
        (("--height", tmp_path / "small.png"), 2, "belong together"),
        (("--pixel-pitch", 1), 2, "belong together"),
        (("--height", tmp_path / "map.png", *lengths), 3, "expected a height map in grey"),
        (("--height", tmp_path / "no.png", *lengths), 3, "no.png"),
        (("--normals", tmp_path / "map.png", "--height", tmp_path / "small.png", *lengths), 2, "one of them"),
    ):
        result = run("apply", path, *CHAIN, "-o", tmp_path / "out.tif", *options)
        assert (result.code, result.out) == (code, ""), result.err
        assert message in result.err
        assert not (tmp_path / "out.tif").exists()


def test_an_image_with_normals_of_its_own(run, tmp_path):
    path = tmp_path / "xyzn.tif"
    with create_tiff(path, HEIGHT, WIDTH, ("X", "Y", "Z", "n.x", "n.y", "n.z"), samples="device") as sink:
        sink.write(Block(0, 0, np.full((HEIGHT, WIDTH, 6), 0.5, np.float32)))
    (tmp_path / "map.png").write_bytes(imagecodecs.png_encode(np.full((HEIGHT, WIDTH, 3), 200, np.uint8)))
    result = run("apply", path, *CHAIN, "-o", tmp_path / "out.tif", "--normals", tmp_path / "map.png")
    assert result.code == 2
    assert "has a channel 'n.x' itself" in result.err
