"""The colour MID against the float64 reference and the ICC's own CMM; closure; the two ways to a proof."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import iccdev
import numpy as np
import pytest
import tifffile
from conftest import ROOT

import iccbrdf
from iccbrdf.brdf import smooth_interpolation
from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.brdf.models import MODELS, NORMAL
from iccbrdf.brdf.primaries import Primaries, read_primaries
from iccbrdf.brdf.slopes import read_slopes, slope_adjust, slope_angle
from iccbrdf.brdf.smooth_interpolation import SmoothMap
from iccbrdf.build import build_colour_mid, build_pair, image_link
from iccbrdf.build.profiles import XYZ_RANGE
from iccbrdf.errors import InputError, UsageError
from iccbrdf.images import Block, create_tiff, open_tiff

FOLDER = ROOT / "profiles" / "fogra39_gloss"
SLOPES = read_slopes(FOLDER / "slopes.json")
# In steps of 1/1024 the differences of W and B, which a program holds, are float32 numbers too.
BINARY_SLOPES = replace(
    SLOPES,
    slopes=tuple(
        replace(
            s,
            W=tuple(np.rint(np.multiply(s.W, 1024)) / 1024),
            B=tuple(np.rint(np.multiply(s.B, 1024)) / 1024),
        )
        for s in SLOPES.slopes
    ),
)
METHODS = ("smooth", "published")
SLOPE_METHODS = (None, "affine", "published")


def rounded(values):
    """As float32 constants of a profile."""
    return np.asarray(values, np.float32).astype(np.float64)


def in_float32(primaries: Primaries) -> Primaries:
    """The same primaries with every figure a float32, so that profile and reference start from the same."""
    entries = tuple(
        replace(entry, XYZ=tuple(rounded(entry.XYZ)), parameters=tuple(rounded(entry.parameters)))
        for entry in primaries.primaries
    )
    return replace(primaries, primaries=entries, white=tuple(rounded(primaries.white)))


PRIMARIES = in_float32(read_primaries(FOLDER / "primaries.json"))


def colours(count: int, seed: int) -> np.ndarray:
    """XYZ within the gamut: random mixtures of the primaries, as float32 device values hold them."""
    rng = np.random.default_rng(seed)
    return rng.dirichlet(np.full(len(PRIMARIES.primaries), 0.6), count) @ PRIMARIES.XYZ


def normals(count: int, seed: int, steepest: float = 70) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return direction(rng.uniform(0, steepest, count), rng.uniform(0, 360, count))


def device(XYZ: np.ndarray, n: np.ndarray) -> np.ndarray:
    return np.concatenate([XYZ / XYZ_RANGE[1], (n + 1) / 2], axis=-1).astype(np.float32)


def real(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """XYZ and normals of device values, in float64, by the float32 matrix of the profile."""
    scale = float(np.float32(XYZ_RANGE[1]))
    wide = values.astype(np.float64)
    return wide[:, :3] * scale, 2 * wide[:, 3:] - 1


def colour_mid(interpolation: str, slope_method: str | None, primaries: Primaries):
    slopes = None if slope_method is None else BINARY_SLOPES
    return build_colour_mid(
        primaries, interpolation=interpolation, slopes=slopes, slope_method=slope_method or "affine"
    )


@cache
def of_the_print(interpolation: str, slope_method: str | None):
    """The colour MID of the primaries, built once."""
    return colour_mid(interpolation, slope_method, PRIMARIES)


@cache
def closing(interpolation: str):
    """Of primaries whose kd is their XYZ the colour MID, and the MVIS of the diffuse part."""
    entries = tuple(
        replace(entry, parameters=(*entry.XYZ, *entry.parameters[3:])) for entry in PRIMARIES.primaries
    )
    primaries = replace(PRIMARIES, primaries=entries)
    mvis = build_pair(primaries, without=["specular"]).mvis
    return colour_mid(interpolation, "affine", primaries).mid, mvis


def on_slope(values, slope_method) -> tuple[np.ndarray, np.ndarray]:
    """XYZ adjusted to the slope, and normals."""
    XYZ, n = real(values)
    if slope_method is not None:
        XYZ = slope_adjust(XYZ, slope_angle(n), BINARY_SLOPES, method=slope_method)
    return XYZ, n


def reference(values, interpolation, slope_method, primaries) -> np.ndarray:
    """The float64 reference, fed the constants as a profile rounds them."""
    XYZ, n = on_slope(values, slope_method)
    if interpolation == "published":
        parameters = interpolate(XYZ, primaries, method="published")
    else:
        solved = SmoothMap.of(primaries)
        names = ("nodes", "coefficients", "constant")
        held = replace(solved, **{name: rounded(getattr(solved, name)) for name in names})
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(smooth_interpolation, "KNEE", rounded(smooth_interpolation.KNEE))
            parameters = held.parameters(XYZ)
    return np.concatenate([parameters, n], axis=1)


def unambiguous(values, slope_method, primaries) -> np.ndarray:
    """Where a rounding error of float32 does not move the published choice of the number of nodes."""
    XYZ, _ = on_slope(values, slope_method)
    here = interpolate(XYZ, primaries, method="published")
    steady = np.ones(len(XYZ), bool)
    for nudge in (1 - 3e-6, 1 + 3e-6):
        for axis in range(3):
            moved = XYZ.copy()
            moved[:, axis] *= nudge
            change = np.abs(interpolate(moved, primaries, method="published") / here - 1).max(axis=1)
            steady &= change < 1e-3
    return steady


@pytest.mark.parametrize("slope_method", SLOPE_METHODS)
@pytest.mark.parametrize("interpolation", METHODS)
def test_float64_equals_the_reference(interpolation, slope_method):
    values = device(colours(3000, 1), normals(3000, 2))
    transform = iccbrdf.link([of_the_print(interpolation, slope_method).mid], dtype="float64")
    expected = reference(values, interpolation, slope_method, PRIMARIES)
    error = np.abs(transform(values) - expected) / np.maximum(np.abs(expected), 1e-3)
    assert error.max() < 1e-10


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("interpolation", METHODS)
def test_every_model(interpolation, model):
    """The same nodes with parameters of another model, in which every channel differs."""
    width = len(MODELS[model].channels)
    rng = np.random.default_rng(3)
    entries = tuple(
        replace(entry, parameters=(*np.multiply(entry.XYZ, 0.9), *rng.uniform(0.05, 0.5, width - 3)))
        for entry in PRIMARIES.primaries
    )
    primaries = in_float32(replace(PRIMARIES, model=model, primaries=entries))
    mid = colour_mid(interpolation, None, primaries).mid
    transform = iccbrdf.link([mid], dtype="float64")
    assert transform.channels_out == (*MODELS[model].channels, "n.x", "n.y", "n.z")
    values = device(colours(500, 4), normals(500, 5))
    expected = reference(values, interpolation, None, primaries)
    np.testing.assert_allclose(transform(values), expected, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("slope_method", SLOPE_METHODS)
@pytest.mark.parametrize("interpolation", METHODS)
def test_float32(interpolation, slope_method):
    values = device(colours(5000, 6), normals(5000, 7))
    found = iccbrdf.link([of_the_print(interpolation, slope_method).mid])(values)
    expected = reference(values, interpolation, slope_method, PRIMARIES)
    used = np.ones(len(values), bool)
    if interpolation == "published":
        used = unambiguous(values, slope_method, PRIMARIES)
        assert used.mean() > 0.98
    kd = [XYZ_to_Lab(np.maximum(p[used, :3], 1e-6), PRIMARIES.white) for p in (found, expected)]
    assert delta_E_CIE2000(*kd).max() < 1e-3
    assert np.abs(np.log(found[used, 3:7] / expected[used, 3:7])).max() < 1e-3
    assert np.abs(found[:, 7:] - expected[:, 7:]).max() < 1e-6


def iccdev_run(tmp_path, profiles, values) -> np.ndarray:
    cmm = iccdev.IccCmm()
    for i, profile in enumerate(profiles):
        iccbrdf.write_profile(profile, tmp_path / f"{i}.icc")
        cmm.attach(tmp_path / f"{i}.icc", intent=1, lut_type=iccdev.LutType.MCS)
    cmm.begin()
    return cmm.apply_ndarray(values).astype(np.float64)


@pytest.mark.parametrize("slope_method", ["affine", "published"])
@pytest.mark.parametrize("interpolation", METHODS)
def test_iccdev_agrees_on_the_mid(interpolation, slope_method, tmp_path):
    values = device(colours(5000, 8), normals(5000, 9))
    mid = of_the_print(interpolation, slope_method).mid
    assert iccdev.validate_profile(mid.to_bytes()).status == iccdev.ValidationStatus.OK
    found = iccbrdf.link([mid])(values)
    expected = iccdev_run(tmp_path, [mid], values)
    error = np.abs(found - expected) / np.maximum(np.abs(expected), 1e-3)
    if interpolation == "published":
        # A last bit (its cbrt) may move the choice of the number of nodes.
        assert np.mean(error.max(axis=1) < 1e-5) > 0.995
    else:
        assert error.max() < 1e-5


@pytest.mark.parametrize("interpolation", METHODS)
def test_iccdev_agrees_on_the_whole_proof(interpolation, tmp_path):
    values = device(colours(5000, 10), normals(5000, 11, steepest=60))
    chain = [of_the_print(interpolation, "affine").mid, build_pair(PRIMARIES).mvis]
    found = iccbrdf.link(chain)(values)
    expected = iccdev_run(tmp_path, chain, values) * 65535 / 32768
    error = np.abs(found - expected) / np.maximum(np.abs(expected), 1e-2)
    assert np.mean(error.max(axis=1) < 2e-5) > (0.995 if interpolation == "published" else 0.99999)


@pytest.mark.parametrize("interpolation", METHODS)
def test_two_steps_equal_one(interpolation):
    """The BRDF image in the binding MID's encoding, then binding MID and MVIS, is the same proof."""
    built, pair = of_the_print(interpolation, "affine"), build_pair(PRIMARIES)
    values = device(colours(2000, 12), normals(2000, 13, steepest=60))
    to_image = iccbrdf.link([built.mid, image_link(built.mid)])
    assert to_image.channels_out == iccbrdf.link([pair.mid]).channels_in
    assert to_image.samples_out == "device"
    brdf_image = to_image(values)
    assert brdf_image.min() >= 0
    assert brdf_image.max() <= 1
    two = iccbrdf.link([pair.mid, pair.mvis])(brdf_image)
    one = iccbrdf.link([built.mid, pair.mvis])(values)
    # Normals pass through (n + 1) / 2 in float32, and a steep lobe shows what that rounds.
    assert np.abs(two - one).max() < 1e-6


@pytest.mark.parametrize("angle", [0, 15, 30, 45, 60])
@pytest.mark.parametrize("interpolation", METHODS)
def test_closure_of_the_diffuse_part(interpolation, angle):
    """Light along the normal, view at 45 degrees to it: with kd = XYZ the diffuse part is the colour itself.

    On a slope, in its own frame, it is the colour adjusted to the slope.
    """
    mid, mvis = closing(interpolation)
    env = dict(zip(("litX", "litY", "litZ"), direction(angle, 30), strict=True))
    view = direction(abs(angle - 45), 30 if angle >= 45 else 210)
    env |= dict(zip(("vueX", "vueY", "vueZ"), view, strict=True)) if "vueX" in _variables(mvis) else {}
    XYZ = colours(1000, 14)
    n = np.broadcast_to(direction(angle, 30), XYZ.shape)
    found = iccbrdf.link([mid, mvis], env=env, dtype="float64")(device(XYZ, n))
    expected = slope_adjust(XYZ, angle, BINARY_SLOPES)
    assert np.abs(found - expected).max() < 1e-6


def _variables(profile) -> tuple[str, ...]:
    return iccbrdf.link([profile]).variables


@pytest.mark.parametrize("interpolation", METHODS)
def test_nodes_give_their_parameters(interpolation):
    mid = of_the_print(interpolation, None).mid
    n = np.broadcast_to([0.0, 0.0, 1.0], (len(PRIMARIES.primaries), 3))
    real_values = np.concatenate([PRIMARIES.XYZ, n], axis=1).astype(np.float32)
    found = iccbrdf.link([mid], samples="real")(real_values)
    tolerance = 1e-7 if interpolation == "published" else 5e-6
    np.testing.assert_allclose(found[:, :7], PRIMARIES.parameters, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("slope_method", SLOPE_METHODS)
@pytest.mark.parametrize("interpolation", METHODS)
def test_hard_input_is_finite(interpolation, slope_method):
    """Black, negative and four times too light, normals of no length and facing away."""
    rng = np.random.default_rng(15)
    XYZ = np.concatenate([np.zeros((1, 3)), -rng.random((50, 3)), 4 * rng.random((200, 3)), np.eye(3)])
    n = rng.uniform(-1, 1, XYZ.shape)
    n[:3] = ((0, 0, 0), (0, 0, -1), (0, 0, 4))
    values = np.concatenate([XYZ, n], axis=1).astype(np.float32)
    mid = of_the_print(interpolation, slope_method).mid
    for dtype in ("float32", "float64"):
        out = iccbrdf.link([mid], samples="real", dtype=dtype)(values)
        assert np.isfinite(out).all()
        assert (out[:, :3] >= 0).all()
        assert (out[:, 3:7] > 0).all()


def test_operators():
    """State the cost: a rise is to be seen, not to be found out later."""
    nine = {method: of_the_print(method, "affine").compiled.executed for method in METHODS}
    assert nine["smooth"] < 300
    assert nine["published"] < 2700


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda entries: entries[:3], "4 to 16"),
        (lambda entries: (*entries, replace(entries[2], name="again")), "again"),
        (lambda entries: (*entries[:-1], replace(entries[-1], XYZ=(0.1, -0.1, 0.1))), "XYZ"),
    ],
)
def test_nodes_that_cannot_be_interpolated(change, message):
    with pytest.raises(InputError, match=message):
        build_colour_mid(replace(PRIMARIES, primaries=change(PRIMARIES.primaries)))


def test_the_flat_print_alone_is_no_slope():
    flat = replace(SLOPES, slopes=SLOPES.slopes[:1])
    with pytest.raises(InputError, match="at least one slope"):
        build_colour_mid(PRIMARIES, slopes=flat)


@pytest.mark.parametrize("wrong", [{"p": 0.5}, {"p": np.inf}, {"exponent": 0}, {"interpolation": "smoth"}])
def test_settings_that_do_not_exist(wrong):
    with pytest.raises(UsageError):
        build_colour_mid(PRIMARIES, **wrong)


def test_a_colour_mid_alone_writes_the_brdf_image(run, tmp_path):
    """On the command line, in 16 bits, for the binding MID."""
    values = device(colours(600, 16), normals(600, 17, steepest=60)).reshape(20, 30, 6)
    with create_tiff(tmp_path / "xyzn.tif", 20, 30, ("X", "Y", "Z", *NORMAL), samples="device") as sink:
        sink.write(Block(0, 0, values))
    colour = FOLDER / "colour-mid.icc"
    for dtype in ("float32", "uint16"):
        image = tmp_path / f"{dtype}.tif"
        result = run("apply", tmp_path / "xyzn.tif", "-p", colour, "-o", image, "--dtype", dtype)
        assert (result.code, result.err) == (0, "")
    brdf_image = tifffile.imread(tmp_path / "float32.tif")
    two = iccbrdf.link([FOLDER / "mid.icc", FOLDER / "mvis.icc"])(brdf_image)
    one = iccbrdf.link([colour, FOLDER / "mvis.icc"])(values)
    assert np.abs(two - one).max() < 1e-6
    with open_tiff(tmp_path / "uint16.tif") as source:
        assert source.samples == "device"
        assert source.names == iccbrdf.link([FOLDER / "mid.icc"]).channels_in
        (block,) = source.blocks()
    assert np.abs(block.data - brdf_image).max() < 0.51 / 65535
