"""PNG for the display: levels against colour-science, files against libpng and Pillow."""

import io
import os
import warnings

import imagecodecs
import numpy as np
import pytest
from PIL import Image, ImageCms

from iccbrdf.errors import UsageError
from iccbrdf.images import Block
from iccbrdf.images.display import create_png, srgb_profile, xyz_to_srgb

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import colour

D50 = np.array([0.9642, 1.0, 0.8249], np.float32)
D50_XY = D50[:2] / D50.sum(dtype=float)


def expected_srgb(xyz):
    """colour-science: D50 to D65 by Bradford, then sRGB."""
    return colour.XYZ_to_sRGB(xyz, D50_XY, chromatic_adaptation_transform="Bradford")


def colours(height, width):
    """XYZ of colours inside and around the sRGB gamut, up to twice as bright as white."""
    random = np.random.default_rng(3)
    return (random.random((height, width, 3)) * 2 * D50).astype(np.float32)


def write(path, xyz, rows=20, columns=40, **options):
    with create_png(path, *xyz.shape[:2], **options) as sink:
        for y in range(0, xyz.shape[0], rows):
            for x in range(0, xyz.shape[1], columns):
                sink.write(Block(y, x, xyz[y : y + rows, x : x + columns]))
    return sink


def test_levels_agree_with_colour_science():
    rgb = np.random.default_rng(1).random((100, 100, 3))
    inside = colour.sRGB_to_XYZ(rgb, D50_XY, chromatic_adaptation_transform="Bradford")
    # Near zero the curve's slope, 12.92, magnifies the last digits of the matrices, which are relative to the
    # other components: bright colours at the edge of the gamut may differ by a level more.
    for xyz, levels in ((inside, 1), (2 * inside, 1), (colours(100, 100), 2)):
        difference = np.clip(xyz_to_srgb(xyz), 0, 1) - np.clip(expected_srgb(xyz), 0, 1)
        assert np.abs(difference).max() < levels / 255


def test_greys_are_the_srgb_curve():
    levels = np.array([0, 0.001, 0.0031308, 0.02, 0.18, 0.5, 1, 1.5, 4])
    expected = np.where(levels <= 0.0031308, 12.92 * levels, 1.055 * levels ** (1 / 2.4) - 0.055)
    rgb = xyz_to_srgb((levels[:, None] * D50)[None])[0]
    np.testing.assert_allclose(rgb, np.repeat(expected[:, None], 3, axis=1), rtol=2e-4, atol=2e-5)


@pytest.mark.parametrize("depth", [8, 16])
def test_decoders_read_what_was_sent(tmp_path, depth):
    path = tmp_path / "a.png"
    xyz = colours(61, 83)
    write(path, xyz, depth=depth)
    largest = 2**depth - 1
    expected = np.rint(xyz_to_srgb(xyz) * largest).clip(0, largest)
    np.testing.assert_array_equal(imagecodecs.png_decode(path.read_bytes()), expected)
    with Image.open(path) as picture:
        picture.load()
        assert picture.size == (83, 61)
        assert picture.info["icc_profile"] == srgb_profile()
        if depth == 8:
            np.testing.assert_array_equal(np.asarray(picture), expected)


def test_a_single_pixel(tmp_path):
    write(tmp_path / "a.png", np.full((1, 1, 3), 0.18, np.float32) * D50)
    picture = imagecodecs.png_decode((tmp_path / "a.png").read_bytes())
    np.testing.assert_array_equal(picture, [[[118, 118, 118]]])


def test_profile_is_srgb_and_the_same_every_day():
    profile = srgb_profile()
    assert profile[24:36] == bytes([7, 208, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0])
    opened = ImageCms.ImageCmsProfile(io.BytesIO(profile))
    assert opened.profile.xcolor_space.strip() == "RGB"
    # The primaries of sRGB adapted to D50 (IEC 61966-2-1, Bradford), and its curve.
    adapted = [[0.4361, 0.2225, 0.0139], [0.3851, 0.7169, 0.0971], [0.1431, 0.0606, 0.7141]]
    for primary, xyz in zip(("red", "green", "blue"), adapted, strict=True):
        np.testing.assert_allclose(getattr(opened.profile, primary + "_colorant")[0], xyz, atol=2e-4)


def test_what_the_display_cannot_show_is_counted(tmp_path):
    greys = [D50, 1.01 * D50, 5 * D50, 0 * D50]
    xyz = np.array([[*greys, [0.1, 0.35, 0.02], [np.nan, 0.2, 0.2], [np.inf] * 3, [-1] * 3]], np.float32)
    sink = write(tmp_path / "a.png", xyz, rows=1, columns=3)
    assert sink.above_white == 3
    assert sink.not_finite == 2
    # Green beyond sRGB, NaN in X taken as 0, and the negative one.
    assert sink.out_of_gamut == 3
    picture = imagecodecs.png_decode((tmp_path / "a.png").read_bytes())[0]
    assert (picture[[0, 1, 2, 6]] == 255).all()
    assert (picture[[3, 7]] == 0).all()


def test_exposure_is_a_factor_on_xyz(tmp_path):
    xyz = colours(20, 20)
    write(tmp_path / "a.png", xyz, exposure=0.25)
    write(tmp_path / "b.png", xyz / 4)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def fail_in_the_middle(path, **options):
    with create_png(path, 2, 3, **options) as sink:
        sink.write(Block(0, 0, np.zeros((1, 3, 3), np.float32)))
        raise ValueError("stop")


def test_only_whole_files_appear(tmp_path):
    path = tmp_path / "a.png"
    with pytest.raises(ValueError, match="stop"):
        fail_in_the_middle(path)
    with pytest.raises(UsageError, match="0 pixels were written to an image of 2"), create_png(path, 2, 3):
        pass
    assert os.listdir(tmp_path) == []
    write(path, colours(2, 3))
    before = path.read_bytes()
    with pytest.raises(UsageError, match="exists already"):
        fail_in_the_middle(path)
    with pytest.raises(ValueError, match="stop"):
        fail_in_the_middle(path, overwrite=True)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["a.png"]


def write_upside_down(path):
    with create_png(path, 40, 3) as sink:
        sink.write(Block(20, 0, np.zeros((20, 3, 3), np.float32)))


def test_impossible_requests(tmp_path):
    path = tmp_path / "a.png"
    with pytest.raises(UsageError, match="row 20 came before those above it"):
        write_upside_down(path)
    for size, options, message in (
        ((0, 3), {}, "a PNG of 0 x 3 pixels"),
        ((1, 2**31), {}, "a PNG of 1 x 2147483648 pixels"),
        ((2, 3), {"depth": 12}, "12 bits per sample, a picture has 8 or 16"),
        ((2, 3), {"exposure": 0.0}, "exposure 0.0, expected a positive factor"),
        ((2, 3), {"exposure": np.nan}, "exposure nan"),
    ):
        with pytest.raises(UsageError, match=message), create_png(path, *size, **options):
            pytest.fail("the block must not run")
    assert os.listdir(tmp_path) == []
