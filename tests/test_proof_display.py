"""On which display, and how: profiles, highlights, gamut, RGB TIFF; against colour-science, closed forms."""

import imagecodecs
import numpy as np
import pytest
import tifffile
from proof_examples import lut_display

from iccbrdf.errors import InputError, UnsupportedError, UsageError
from iccbrdf.icc.header import D50
from iccbrdf.images import Block, create_png
from iccbrdf.images.display import create_rgb_tiff
from iccbrdf.images.little_cms import from_XYZ, to_XYZ
from iccbrdf.images.showing import Showing, display_p3, display_profile, srgb
from iccbrdf.resources import folder

WHITE = np.array(D50)


def pixels(*XYZ):
    return np.float32([XYZ])


def inside(profile, count=500):
    """XYZ of colours that a display has."""
    device = np.random.default_rng(0).random((1, count, 3)).astype(np.float32)
    return to_XYZ(device, profile, "relative"), device


def test_display_p3_is_that_of_colour_science():
    import colour

    p3 = colour.RGB_COLOURSPACES["Display P3"]
    XYZ, device = inside(display_p3())
    linear = p3.cctf_decoding(device.astype(float))
    to_D50 = colour.adaptation.matrix_chromatic_adaptation_VonKries(
        p3.matrix_RGB_to_XYZ.sum(axis=1), WHITE, transform="Bradford"
    )
    np.testing.assert_allclose(XYZ, linear @ (to_D50 @ p3.matrix_RGB_to_XYZ).T, atol=3e-4)
    np.testing.assert_allclose(from_XYZ(XYZ, display_p3()), device, atol=2e-4)


def test_display_p3_is_that_of_argyll(shared_data):
    theirs = display_profile(shared_data / "icc" / "DisplayP3.icm")
    XYZ, device = inside(display_p3())
    np.testing.assert_allclose(Showing(theirs)(XYZ).device, device, atol=1 / 255)


def test_built_in_profiles_are_the_same_every_day():
    for profile in (srgb(), display_p3()):
        assert profile.to_bytes()[24:36] == bytes([7, 208, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0])
        imagecodecs.cms_profile_validate(profile.to_bytes())


def test_a_display_of_tables():
    display = lut_display()
    assert "rXYZ" not in display
    linear = np.random.default_rng(0).random((1, 300, 3))
    matrix = np.array([srgb()[tag].values[0] for tag in ("rXYZ", "gXYZ", "bXYZ")]).T
    shown = Showing(display)((linear @ matrix.T).astype(np.float32))
    np.testing.assert_allclose(shown.device, linear ** (1 / 2.2), atol=2e-3)
    assert not shown.above_white.any()
    assert not shown.out_of_gamut.any()
    bright = Showing(display)(pixels(3 * WHITE, (0.1, 0.4, 0.02)))
    assert bright.above_white.tolist() == [[True, False]]
    assert bright.out_of_gamut.tolist() == [[False, True]]


def test_which_displays_there_are(tmp_path):
    assert display_profile("display-p3") is display_p3()
    (tmp_path / "lut.icc").write_bytes(lut_display().to_bytes())
    assert display_profile(tmp_path / "lut.icc") == lut_display()
    (tmp_path / "cut.icc").write_bytes(srgb().to_bytes()[:300])
    five = folder("profiles") / "fogra39_gloss" / "mvis.icc"
    for display, error, message in (
        ("display-p4", InputError, "did you mean 'display-p3'"),
        (tmp_path / "cut.icc", Exception, r"cut\.icc"),
        (five, UnsupportedError, "version 5"),
    ):
        with pytest.raises(error, match=message):
            display_profile(display)


def test_a_printer_is_no_display(shared_data):
    with pytest.raises(InputError, match="colour space 'CMYK', expected 'RGB ' for a display"):
        display_profile(shared_data / "icc" / "ISOcoated_v2_300_bas.icc")


def test_only_what_is_not_shown_counts():
    XYZ, device = inside(srgb())
    shown = Showing(srgb())(XYZ)
    np.testing.assert_allclose(shown.device, device, atol=1e-4)
    assert not shown.above_white.any()
    assert not shown.out_of_gamut.any()
    # The white of P3 is that of sRGB, its other corners lie outside.
    corners = to_XYZ(
        np.float32([[[1, 1, 1], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 1, 1]]]), display_p3(), "relative"
    )
    assert Showing(srgb())(corners).out_of_gamut.tolist() == [[False, True, True, True, True]]
    assert not Showing(display_p3())(corners).out_of_gamut.any()
    # Within a few units no one sees it: 2 of 100 more saturated than red.
    red = to_XYZ(np.float32([[[1, 0.02, 0.02]]]), srgb(), "relative")
    assert not Showing(srgb())(red + np.float32([0, 0, -5e-4])).out_of_gamut.any()


def test_exposure_is_a_factor():
    XYZ, _ = inside(srgb())
    np.testing.assert_allclose(
        Showing(srgb(), 0.3)(XYZ).device, Showing(srgb())(XYZ * np.float32(0.3)).device, atol=1e-6
    )
    assert Showing(srgb(), 1.1)(pixels(0.95 * WHITE)).above_white.all()


def test_highlights_roll_off_to_white():
    Y = np.array([0, 0.2, 0.5, 0.8999, 0.9, 0.9001, 1, 1.5, 3, 1e5])
    greys = Showing(srgb(), highlights="roll-off")(np.float32([Y[:, None] * WHITE]))
    linear = to_XYZ(greys.device, srgb(), "relative")[0, :, 1]
    expected = np.where(Y < 0.9, Y, 1 - 0.1 * np.exp((0.9 - Y) / 0.1))
    np.testing.assert_allclose(linear, expected, atol=2e-5)
    assert not greys.out_of_gamut.any()
    assert greys.above_white.tolist() == [(Y > 1.0045).tolist()]
    # A colour keeps its chromaticity below, and loses it towards white.
    yellow = WHITE * [1, 1, 0.5]
    below, above = Showing(srgb(), highlights="roll-off")(pixels(0.6 * yellow, 5 * yellow)).device[0]
    np.testing.assert_allclose(to_XYZ(below[None, None], srgb(), "relative")[0, 0], 0.6 * yellow, atol=1e-4)
    np.testing.assert_allclose(above, 1, atol=1e-3)


def test_gamut_warning_marks_pixels():
    XYZ = pixels(0.5 * WHITE, 2 * WHITE, (0.1, 0.4, 0.02), np.full(3, np.nan))
    plain, marked = Showing(srgb())(XYZ), Showing(srgb(), gamut_warning=True)(XYZ)
    np.testing.assert_array_equal(marked.device[0, 1], [0, 1, 1])
    np.testing.assert_array_equal(marked.device[0, 2], [1, 0, 1])
    np.testing.assert_array_equal(marked.device[0, [0, 3]], plain.device[0, [0, 3]])


def test_settings_that_do_not_exist():
    with pytest.raises(UsageError, match="did you mean 'roll-off'"):
        Showing(srgb(), highlights="rolloff")
    with pytest.raises(UsageError, match="exposure 0"):
        Showing(srgb(), 0)


@pytest.mark.parametrize("depth", [8, 16])
def test_tiff_holds_what_png_holds(tmp_path, depth):
    XYZ = (np.random.default_rng(3).random((61, 83, 3)) * 1.5 * WHITE).astype(np.float32)
    showing = Showing(display_p3(), 0.9, "roll-off")
    sinks = []
    for create, name in ((create_png, "a.png"), (create_rgb_tiff, "a.tif")):
        with create(tmp_path / name, 61, 83, depth=depth, showing=showing) as sink:
            for y in range(0, 61, 20):
                for x in range(0, 83, 40):
                    sink.write(Block(y, x, XYZ[y : y + 20, x : x + 40]))
        sinks.append((sink.above_white, sink.out_of_gamut, sink.clipped))
    assert sinks[0] == sinks[1]
    assert sinks[0][2] == sinks[0][1]  # what is rolled off is not clipped
    picture = imagecodecs.png_decode((tmp_path / "a.png").read_bytes())
    np.testing.assert_array_equal(picture, np.rint(showing(XYZ).device * (2**depth - 1)))
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        page = file.pages[0]
        assert page.photometric.name == "RGB"
        assert page.iccprofile == display_p3().to_bytes()
        np.testing.assert_array_equal(page.asarray(), picture)


def test_tiff_is_whole_or_not_there(tmp_path):
    with (
        pytest.raises(UsageError, match="0 pixels were written to an image of 4 x 5"),
        create_rgb_tiff(tmp_path / "a.tif", 4, 5, showing=Showing(srgb())),
    ):
        pass
    with (
        pytest.raises(UsageError, match="a TIFF of 0 x 5"),
        create_rgb_tiff(tmp_path / "a.tif", 0, 5, showing=Showing(srgb())),
    ):
        pytest.fail("the block must not run")
    assert list(tmp_path.iterdir()) == []
