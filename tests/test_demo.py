"""The demo: a relief print of a real landscape, lit from several sides."""

import os

import imagecodecs
import numpy as np
import pytest
import tifffile
from conftest import comparable
from matplotlib.cbook import get_sample_data
from matplotlib.colors import LightSource
from scipy.ndimage import zoom

import iccbrdf
from iccbrdf import demo
from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.cli.demo import SCENES
from iccbrdf.resources import folder

PRIMARIES = folder("profiles") / "landscape" / "primaries.json"
AZIMUTHS = {"left": 180, "top": 90, "right": 0, "bottom": 270}


@pytest.fixture(scope="module")
def scene():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "PIXEL_PITCH", 0.6)
        return demo.landscape(read_primaries(PRIMARIES))


@pytest.fixture(scope="module")
def lit(scene):
    """Y of the print by the side that it is lit from, at the demo's zenith angle."""
    transform = iccbrdf.link([PRIMARIES.with_name("mid.icc"), PRIMARIES.with_name("mvis.icc")])
    return {
        side: transform.with_env(dict(zip(("litX", "litY", "litZ"), direction(50, azimuth), strict=True)))(
            scene.brdf.device
        )[..., 1]
        for side, azimuth in AZIMUTHS.items()
    }


def test_scene_holds_device_values_and_unit_normals(scene):
    height, width, channels = scene.brdf.device.shape
    assert width == round(demo.PRINT_WIDTH / 0.6)
    assert 1 < height / width < 1.2  # 0.28 by 0.32 degrees at 36 degrees north
    assert channels == len(scene.brdf.names) == 10
    assert scene.brdf.device.dtype == np.float32
    assert scene.brdf.device.min() >= 0
    assert scene.brdf.device.max() <= 1
    normals = 2 * scene.brdf.device[..., 7:].astype(float) - 1
    assert np.linalg.norm(normals, axis=2) == pytest.approx(1, abs=1e-6)
    assert normals[..., 2].min() > 0.4
    assert np.abs(normals[..., :2].mean(axis=(0, 1))).max() < 0.02


def test_colours_run_from_the_lowest_to_the_highest_ground(scene):
    first, *_, last = read_primaries(PRIMARIES).parameters
    luminous = scene.brdf.device[..., 1]
    assert np.abs(scene.brdf.device[..., :7] - last).max(axis=2).min() < 0.01
    assert np.abs(scene.brdf.device[..., :7] - first).max(axis=2).min() < 0.01
    assert luminous.max() == pytest.approx(last[1], abs=0.01)


def hillshade(side: str, shape) -> np.ndarray:
    """Matplotlib's own shading of the same heights, at the size of the scene."""
    with np.load(get_sample_data("jacksboro_fault_dem.npz", asfileobj=False)) as dem:
        heights = dem["elevation"].astype(float)
    compass = (90 - AZIMUTHS[side]) % 360
    shade = LightSource(azdeg=compass, altdeg=40).hillshade(heights, dx=75, dy=92.5)
    return zoom(shade, np.divide(shape, shade.shape), order=1, mode="nearest", grid_mode=True)


@pytest.mark.parametrize(("side", "opposite"), [("left", "right"), ("top", "bottom")])
def test_relief_does_not_invert(lit, side, opposite):
    # The colours cancel in the ratio of two lights.
    ours = np.log((lit[side] + 1e-3) / (lit[opposite] + 1e-3))
    theirs = hillshade(side, ours.shape) - hillshade(opposite, ours.shape)
    assert np.corrcoef(ours.ravel(), theirs.ravel())[0, 1] > 0.9


@pytest.mark.parametrize("side", AZIMUTHS)
def test_highlights_face_the_light(scene, lit, side):
    brightest = lit[side] >= np.quantile(lit[side], 0.99)
    mean_normal = (2 * scene.brdf.device[brightest][:, 7:] - 1).mean(axis=0)
    assert mean_normal @ direction(90, AZIMUTHS[side]) > 0.15


def test_command(run, tmp_path, monkeypatch):
    monkeypatch.setattr(demo, "PIXEL_PITCH", 0.8)
    target = tmp_path / "shown"
    result = run("demo", "-o", target, "--json")
    assert (result.code, result.err) == (0, "")
    made = result.json
    assert made["schema"] == "iccbrdf.demo/1"
    files = [*made["profiles"], *made["images"].values(), made["slopes_proof"]]
    files += [f for p in made["proofs"].values() for f in p["files"]]
    assert sorted(os.path.basename(f) for f in files) == sorted(os.listdir(target))
    mvis, shipped = target / "mvis.icc", PRIMARIES.with_name("mvis.icc")
    assert comparable(mvis.read_bytes()) == comparable(shipped.read_bytes())
    pictures = {name: imagecodecs.imread(target / f"proof_{name}.png") for name in SCENES}
    for name, picture in pictures.items():
        assert picture.shape == tifffile.imread(target / f"xyz_{name}.tif").shape == (266, 250, 3)
        assert (picture.max(axis=2) < 10).mean() < 0.005, "too much shadow"
        assert (picture.min(axis=2) == 255).mean() < 0.005, "burnt out"
        assert picture.std() > 20
    assert len({picture.tobytes() for picture in pictures.values()}) == len(SCENES)

    before = {name: (target / name).read_bytes() for name in os.listdir(target)}
    again = run("demo", "-o", target)
    assert (again.code, again.out) == (2, "")
    assert "exists already" in again.err
    forced = run("demo", "-o", target, "--force")
    assert forced.code == 0
    for name in SCENES:
        assert str(target / f"proof_{name}.png") in forced.out
    assert {name: (target / name).read_bytes() for name in os.listdir(target)} == before
