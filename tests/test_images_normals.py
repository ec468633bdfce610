"""Normal and height maps: a bump must stay a bump, whatever the file."""

import warnings

import imagecodecs
import numpy as np
import pytest
import tifffile
from conftest import SHARED

from iccbrdf.errors import InputError, LimitError, UsageError
from iccbrdf.images import Block, create_tiff, pictures
from iccbrdf.images.normals import height_to_normals, read_height_map, read_normal_map
from iccbrdf.images.pictures import read_picture

SIZE = 65
PITCH = 0.1
PAINTING = SHARED / "data" / "painting"


def hemisphere():
    """Heights and exact normals of a dome over the image: z^2 = r^2 - x^2 - y^2, y to the top."""
    x = (np.arange(SIZE) - SIZE // 2) * PITCH
    y = -x[:, None]
    radius = 2 * PITCH * SIZE
    z = np.sqrt(radius**2 - x**2 - y**2)
    normals = np.stack(np.broadcast_arrays(x, y, z), axis=2) / radius
    return z, normals


def write_map(path, normals, dtype, directx=False):
    coded = (normals * [1, -1 if directx else 1, 1] + 1) / 2
    pixels = np.rint(coded * np.iinfo(dtype).max).astype(dtype)
    if path.suffix == ".png":
        path.write_bytes(imagecodecs.png_encode(pixels))
    else:
        tifffile.imwrite(path, pixels, photometric="rgb")


# Heights


def test_a_dome_stays_a_dome():
    heights, expected = hemisphere()
    normals = height_to_normals(heights, PITCH)
    middle = SIZE // 2
    assert normals[middle, 0, 0] < -0.2  # the left flank looks to the left
    assert normals[middle, -1, 0] > 0.2
    assert normals[0, middle, 1] > 0.2  # the upper flank looks up
    assert normals[-1, middle, 1] < -0.2
    np.testing.assert_allclose(normals[middle, middle], [0, 0, 1], atol=1e-7)
    np.testing.assert_allclose(normals[1:-1, 1:-1], expected[1:-1, 1:-1], atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1, rtol=1e-6)


def test_a_plane_has_its_normal_everywhere():
    """z = 3/4 y: the normal is (0, -3/5, 4/5), at the edges too."""
    rows = np.arange(5, dtype=np.float32)[:, None]
    heights = np.broadcast_to(-0.75 * rows * PITCH, (5, 4))
    expected = np.broadcast_to([0, -0.6, 0.8], (5, 4, 3))
    np.testing.assert_allclose(height_to_normals(heights, PITCH), expected, atol=1e-6)
    np.testing.assert_allclose(height_to_normals(heights.T, PITCH)[0, 0], [0.6, 0, 0.8], atol=1e-6)


def test_bands_with_one_more_row_give_the_rows_of_the_whole():
    heights = np.random.default_rng(2).random((20, 9))
    whole = height_to_normals(heights, PITCH)
    np.testing.assert_array_equal(height_to_normals(heights[6:15], PITCH)[1:-1], whole[7:14])
    np.testing.assert_array_equal(height_to_normals(heights[:9], PITCH)[:-1], whole[:8])


def test_heights_of_small_integers_do_not_wrap():
    heights = np.array([[9, 5, 1]], np.uint8)
    np.testing.assert_allclose(height_to_normals(heights, 4.0), [[[2**-0.5, 0, 2**-0.5]] * 3], rtol=1e-6)


def test_heights_that_are_none():
    with pytest.raises(InputError, match=r"shape \(2, 2, 3\), expected \(height, width\)"):
        height_to_normals(np.zeros((2, 2, 3)), 1)
    for pitch in (0, -1, np.nan, np.inf):
        with pytest.raises(UsageError, match="pixel pitch"):
            height_to_normals(np.zeros((2, 2)), pitch)


def test_height_map_files(tmp_path):
    heights, expected = hemisphere()
    low, high = heights.min(), heights.max()
    grey = np.rint((heights - low) / (high - low) * 65535).astype(np.uint16)
    (tmp_path / "h.png").write_bytes(imagecodecs.png_encode(grey))
    tifffile.imwrite(tmp_path / "h.tif", grey)
    with create_tiff(tmp_path / "real.tif", SIZE, SIZE, ["height"], samples="real") as sink:
        sink.write(Block(0, 0, heights[:, :, None].astype(np.float32)))
    for name, scale in (("h.png", high - low), ("h.tif", high - low), ("real.tif", 1)):
        normals = height_to_normals(read_height_map(tmp_path / name, scale), PITCH)
        np.testing.assert_allclose(normals[1:-1, 1:-1], expected[1:-1, 1:-1], atol=2e-3)
    write_map(tmp_path / "rgb.png", expected, np.uint8)
    with pytest.raises(InputError, match=r"rgb\.png: 3 channels, expected a height map in grey"):
        read_height_map(tmp_path / "rgb.png")


# Normal maps


@pytest.mark.parametrize("convention", ["opengl", "directx"])
@pytest.mark.parametrize(("dtype", "tolerance"), [(np.uint8, 5e-3), (np.uint16, 2e-5)])
@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_normal_maps_come_back(tmp_path, suffix, dtype, tolerance, convention):
    path = tmp_path / f"n{suffix}"
    _, expected = hemisphere()
    write_map(path, expected, dtype, convention == "directx")
    normals = read_normal_map(path, convention)
    assert normals.dtype == np.float32
    np.testing.assert_allclose(normals, expected, atol=tolerance)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1, rtol=1e-6)


def test_conventional_blue_is_nearly_flat(tmp_path):
    path = tmp_path / "n.png"
    path.write_bytes(imagecodecs.png_encode(np.full((2, 2, 4), (128, 128, 255, 7), np.uint8)))
    np.testing.assert_allclose(read_normal_map(path), [[[1 / 255, 1 / 255, 1]] * 2] * 2, atol=2e-5)


def test_pixels_without_direction_are_flat_and_counted(tmp_path):
    path = tmp_path / "n.png"
    pixels = np.full((2, 3, 3), (255, 128, 128), np.uint8)
    pixels[0, :2] = (127, 127, 127), (128, 127, 128)
    path.write_bytes(imagecodecs.png_encode(pixels))
    with pytest.warns(UserWarning, match=r"n\.png: 2 pixels without a direction are taken as flat"):
        normals = read_normal_map(path)
    np.testing.assert_array_equal(normals[0, :2], [[0, 0, 1]] * 2)
    assert (normals[1, :, 0] > 0.99).all()


def test_what_is_no_normal_map(tmp_path):
    path = tmp_path / "n.tif"
    tifffile.imwrite(path, np.full((4, 4, 3), -0.5, np.float32), photometric="rgb")
    with pytest.raises(InputError, match=r"values from -0\.5 to -0\.5, expected \(n \+ 1\)/2"):
        read_normal_map(path)
    with create_tiff(path, 1, 1, ["n.x", "n.y", "n.z"], samples="real", overwrite=True) as sink:
        sink.write(Block(0, 0, np.ones((1, 1, 3))))
    with pytest.raises(InputError, match="declared as 'device', but the file says 'real'"):
        read_normal_map(path)
    tifffile.imwrite(path, np.zeros((4, 4), np.uint8))
    with pytest.raises(InputError, match="1 channels, expected a normal map"):
        read_normal_map(path)
    with pytest.raises(UsageError, match="unknown normal map convention 'OpenGL': did you mean 'opengl'"):
        read_normal_map(path, "OpenGL")


# Pictures


def test_pictures_of_every_kind(tmp_path):
    path = tmp_path / "a.png"
    for pixels in (
        np.array([[0, 51], [102, 255]], np.uint8),
        np.array([[[0, 13107, 65535]]], np.uint16),
        np.array([[[0, 51, 255, 102]]], np.uint8),
    ):
        path.write_bytes(imagecodecs.png_encode(pixels))
        expected = pixels.reshape(*pixels.shape[:2], -1) / np.iinfo(pixels.dtype).max
        np.testing.assert_allclose(read_picture(path), expected, rtol=1e-7)


def test_unreadable_pictures(tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    with pytest.raises(InputError, match=r"a\.png: cannot be read: No such file"):
        read_picture(path)
    path.write_bytes(b"\xff\xd8\xff\xe0")
    with pytest.raises(InputError, match="neither a PNG nor a TIFF"):
        read_picture(path)
    whole = imagecodecs.png_encode(np.random.default_rng(0).integers(0, 255, (20, 30), np.uint8))
    for length in (8, 20, 30, len(whole) // 2):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match="damaged PNG"):
            read_picture(path)
    path.write_bytes(whole)
    monkeypatch.setattr(pictures, "MAX_SAMPLES", 2399)
    with pytest.raises(LimitError, match="20 x 30 pixels with 4 channels, the limit for a map is 2399"):
        read_picture(path)


def test_normals_of_a_real_painting():
    path = PAINTING / "nomap_level2.png"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        normals = read_normal_map(path)[40:-40, 40:-40]
    tilt = np.degrees(np.arccos(normals[:, :, 2]))
    assert 4 < tilt.mean() < 6
    assert 9 < np.percentile(tilt, 95) < 13
