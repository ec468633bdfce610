"""A real painting, measured: its BRDF image through the Ward profiles, lit from four sides."""

from __future__ import annotations

import imagecodecs
import numpy as np
import pytest
from conftest import ROOT
from painting import CHANNELS, SRGB_TO_XYZ, read_painting

import iccbrdf
from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.ward import ward
from iccbrdf.cli import main
from iccbrdf.images import Block, create_tiff, open_tiff

SIDES = {"left": 180, "top": 90, "right": 0, "bottom": 270}
PROFILES = [ROOT / "profiles" / "ward_painting" / name for name in ("mid.icc", "mvis.icc")]


@pytest.fixture(scope="module")
def painting(shared_data) -> np.ndarray:
    return read_painting(shared_data / "painting")


@pytest.fixture(scope="module")
def proofs(painting) -> dict[str, np.ndarray]:
    """XYZ of the painting by the side from which it is lit, raking."""
    transform = iccbrdf.link(PROFILES, samples="real")
    assert transform.channels_in == CHANNELS
    lights = {side: direction(70, azimuth) for side, azimuth in SIDES.items()}
    return {
        side: transform.with_env(dict(zip(("litX", "litY", "litZ"), light, strict=True)))(painting)
        for side, light in lights.items()
    }


def test_equals_the_reference(painting, proofs):
    real = painting.astype(np.float64)
    Rd, ks, m, normals = np.split(real, (3, 4, 5), axis=-1)
    for side, azimuth in SIDES.items():
        expected = ward(Rd, ks, m, normals, direction(70, azimuth), (0, 0, 1))
        np.testing.assert_allclose(proofs[side], expected, rtol=1e-4, atol=1e-7)


def test_the_relief_does_not_invert(painting, proofs):
    """Ground that faces a side is brighter when lit from there."""
    n_x, n_y = painting[..., 5], painting[..., 6]
    for one, other, slope in (("right", "left", n_x), ("top", "bottom", n_y)):
        a, b = proofs[one][..., 1], proofs[other][..., 1]
        contrast = (a - b) / (a + b + 1e-6)
        assert np.corrcoef(contrast.ravel(), slope.ravel())[0, 1] > 0.9


def test_highlights_move_with_the_light(proofs):
    """The brightest hundredth of the picture lies elsewhere when the light comes from the other side."""
    brightest = {side: xyz[..., 1] > np.quantile(xyz[..., 1], 0.99) for side, xyz in proofs.items()}
    for one, other in (("left", "right"), ("top", "bottom")):
        both = (brightest[one] & brightest[other]).sum() / brightest[one].sum()
        assert both < 0.5


def test_from_file_to_file(painting, proofs, tmp_path):
    """The command line gives what the library gives, from a float TIFF of real values."""
    crop = painting[300:420, 200:360]
    with create_tiff(tmp_path / "painting.tif", *crop.shape[:2], CHANNELS, samples="real") as sink:
        sink.write(Block(0, 0, crop))
    chain = [argument for path in PROFILES for argument in ("-p", str(path))]
    arguments = ["-o", str(tmp_path / "xyz.tif"), "-o", str(tmp_path / "proof.png"), "--light", "70,180"]
    with pytest.raises(SystemExit) as done:
        main(["apply", str(tmp_path / "painting.tif"), *chain, *arguments])
    assert done.value.code == 0
    with open_tiff(tmp_path / "xyz.tif") as source:
        assert source.names == ("X", "Y", "Z")
        (block,) = source.blocks()
    left = proofs["left"][300:420, 200:360]
    np.testing.assert_allclose(block.data, left, rtol=1e-6, atol=1e-7)
    # D65 white of the painting becomes the display's white: a grey stays grey.
    picture = imagecodecs.imread(tmp_path / "proof.png")
    linear = np.clip(left @ np.linalg.inv(SRGB_TO_XYZ).T, 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.abs(picture / 255 - encoded).max() < 2 / 255
