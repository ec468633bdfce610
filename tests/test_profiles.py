"""MID and MVIS pairs as a whole: against the float64 reference and against the ICC's own CMM.

The reference is written from the papers, the profiles come from the templates, and iccdev shares no code
with either.
"""

from __future__ import annotations

from dataclasses import replace

import iccdev
import numpy as np
import pytest

import iccbrdf
from iccbrdf.brdf.models import MODELS, evaluate
from iccbrdf.brdf.primaries import Primaries, Primary
from iccbrdf.build import build_pair

DEFAULT_LIGHT = (-np.sqrt(0.5), 0.0, np.sqrt(0.5))
VIEW = (0.0, 0.0, 1.0)
# Of unit length in float32 as well as may be; the default, one from the right, a grazing one, one behind.
SCENES = {
    "default": (DEFAULT_LIGHT, VIEW),
    "raking": ((0.8, 0.5, 0.331662), (0.1, -0.2, 0.974679)),
    "mirror": ((-0.5, 0.0, 0.866025), (0.5, 0.0, 0.866025)),
    "not unit": ((3.0, 4.0, 2.0), (0.0, -5.0, 5.0)),
}


def primaries(model: str) -> Primaries:
    """A primaries file's contents in memory; the parameters of its one colour do not enter the profiles."""
    parameters = tuple([0.5] * len(MODELS[model].channels))
    return Primaries(
        model=model,
        illuminant="D50",
        observer="CIE 1931 2 Degree Standard Observer",
        white=(0.9642, 1.0, 0.8249),
        geometry="45:0",
        source="none",
        primaries=(Primary("any", (0.5, 0.5, 0.5), parameters),),
    )


def variables(light, view) -> dict[str, float]:
    names = ("litX", "litY", "litZ", "vueX", "vueY", "vueZ")
    return dict(zip(names, map(float, (*light, *view)), strict=True))


def device_samples(model: str, count: int, seed: int, least_m: float, facing: float) -> np.ndarray:
    """Device values, float32 (count, channels): parameters at random, m log-uniform, normals every way up.

    `facing` is the least z of a normal before it is scaled to a random length.
    """
    rng = np.random.default_rng(seed)
    channels = MODELS[model].channels
    parameters = rng.random((count, len(channels)))
    for i, name in enumerate(channels):
        if name.startswith("m"):
            parameters[:, i] = np.exp(rng.uniform(np.log(least_m), 0, count))
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals[:, 2] = np.maximum(np.abs(normals[:, 2]), facing)
    normals *= rng.uniform(0.5, 1, (count, 1)) / np.linalg.norm(normals, axis=1, keepdims=True)
    return np.concatenate([parameters, (normals + 1) / 2], axis=1).astype(np.float32)


def decoded(device: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Parameters and normals of device values, in float64."""
    real = device.astype(np.float64)
    return real[:, :-3], 2 * real[:, -3:] - 1


def grazing(normals: np.ndarray, light, view) -> np.ndarray:
    """Which samples see the light or the viewer within half a degree of the horizon."""
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    cosines = [unit @ np.divide(v, np.linalg.norm(v)) for v in (light, view)]
    return np.minimum(*np.abs(cosines)) < 0.01


def rounded(values) -> np.ndarray:
    """float64 numbers as a float32 constant of a profile holds them."""
    return np.asarray(values, np.float32).astype(np.float64)


def rounded_index() -> float:
    """The refractive index whose R0 is the float32 that a profile holds for n = 1.5."""
    root = np.sqrt(rounded(0.04))
    return float((1 + root) / (1 - root))


def relative(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    assert np.array_equal(found == 0, expected == 0)
    return np.abs(found - expected) / np.where(expected == 0, 1, np.abs(expected))


@pytest.fixture(scope="module", params=MODELS)
def pair(request):
    return request.param, build_pair(primaries(request.param))


@pytest.mark.parametrize("scene", SCENES)
def test_float64_equals_the_reference_fed_the_same_constants(pair, scene):
    model, profiles = pair
    light, view = SCENES[scene]
    env = {} if scene == "default" else variables(light, view)
    device = device_samples(model, 10_000, 1, least_m=1e-3, facing=0)
    found = iccbrdf.link([profiles.mid, profiles.mvis], env=env, dtype="float64")(device)
    # A profile's defaults are float32 (pi is an operator); values of its environment are not rounded.
    used_light = rounded(light) if scene == "default" else light
    options = {"refractive_index": rounded_index()} if MODELS[model].has_fresnel else {}
    parameters, normals = decoded(device)
    expected = evaluate(model, parameters, normals, used_light, view, **options)
    assert (expected > 0).mean() > 0.3
    # The cosine of a grazing ray is the small difference of large products in any arithmetic.
    error = relative(found, expected)
    assert error[~grazing(normals, light, view)].max() < 1e-12
    assert error.max() < 1e-10


def test_float64_without_rounded_constants(pair):
    model, profiles = pair
    device = device_samples(model, 10_000, 2, least_m=1e-2, facing=0)
    found = iccbrdf.link([profiles.mid, profiles.mvis], dtype="float64")(device)
    expected = evaluate(model, *decoded(device), DEFAULT_LIGHT, VIEW)
    assert relative(found, expected).max() < 2e-7


@pytest.mark.parametrize("scene", SCENES)
def test_float32(pair, scene):
    model, profiles = pair
    light, view = (np.divide(v, np.linalg.norm(v)) for v in SCENES[scene])
    device = device_samples(model, 20_000, 3, least_m=0.05, facing=0)
    parameters, normals = decoded(device)
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    used = (unit @ light >= 0.1) & (unit @ view >= 0.1)
    found = iccbrdf.link([profiles.mid, profiles.mvis], env=variables(light, view))(device[used])
    expected = evaluate(model, parameters[used], normals[used], light, view)
    assert used.mean() > 0.3
    assert relative(found, expected).max() < 1e-5


def iccdev_xyz(tmp_path, profiles, device: np.ndarray) -> np.ndarray:
    """What the ICC's CMM makes of device values, as real XYZ."""
    cmm = iccdev.IccCmm()
    for name, profile in (("mid", profiles.mid), ("mvis", profiles.mvis)):
        iccbrdf.write_profile(profile, tmp_path / f"{name}.icc")
        cmm.attach(tmp_path / f"{name}.icc", intent=1, lut_type=iccdev.LutType.MCS)
    cmm.begin()
    # Its connection space holds XYZ in half range.
    return cmm.apply_ndarray(device).astype(np.float64) * 65535 / 32768


def test_iccdev_agrees(pair, tmp_path):
    model, profiles = pair
    device = device_samples(model, 10_000, 4, least_m=1e-2, facing=0)
    found = iccbrdf.link([profiles.mid, profiles.mvis])(device)
    expected = iccdev_xyz(tmp_path, profiles, device)
    assert (expected > 0).mean() > 0.5
    assert np.all(np.abs(found - expected) <= 2e-6 * np.abs(expected) + 1e-7)


@pytest.mark.parametrize("scene", ["raking", "mirror", "not unit"])
def test_iccdev_agrees_under_other_defaults(pair, scene, tmp_path):
    """iccdev cannot set run-time variables: other lights are other defaults."""
    model, _ = pair
    profiles = build_pair(primaries(model), variables=variables(*SCENES[scene]))
    device = device_samples(model, 2_000, 5, least_m=1e-2, facing=0)
    found = iccbrdf.link([profiles.mid, profiles.mvis])(device)
    expected = iccdev_xyz(tmp_path, profiles, device)
    assert (expected > 0).mean() > 0.3
    assert np.all(np.abs(found - expected) <= 2e-6 * np.abs(expected) + 1e-7)


def test_iccdev_finds_nothing_to_complain_of(pair):
    _, profiles = pair
    for profile in (profiles.mid, profiles.mvis):
        result = iccdev.validate_profile(profile.to_bytes())
        assert result.status == iccdev.ValidationStatus.OK, result.report


def test_variables_do_what_defaults_do(pair):
    model, profiles = pair
    device = device_samples(model, 500, 6, least_m=1e-2, facing=0)
    scene = variables(*SCENES["raking"])
    by_default = build_pair(primaries(model), variables={**scene, "litI": 2.0})
    found = iccbrdf.link([profiles.mid, profiles.mvis], env={**scene, "litI": 2.0})(device)
    assert np.array_equal(found, iccbrdf.link([by_default.mid, by_default.mvis])(device))


def test_reciprocal_fresnel_angle(tmp_path):
    profiles = build_pair(primaries("brdf1"), fresnel_angle="alpha")
    device = device_samples("brdf1", 5_000, 7, least_m=1e-2, facing=0)
    found = iccbrdf.link([profiles.mid, profiles.mvis], dtype="float64")(device)
    expected = evaluate("brdf1", *decoded(device), DEFAULT_LIGHT, VIEW, fresnel_angle="alpha")
    assert relative(found, expected).max() < 2e-7


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_below_the_horizon_is_black(pair, dtype):
    _, profiles = pair
    transform = iccbrdf.link([profiles.mid, profiles.mvis], dtype=dtype)
    count = len(transform.channels_in)
    facing = {
        "flat": (0, 0, 1),
        "away from the light": (0.9, 0, 0.3),
        "away from the viewer": (-0.9, 0, -0.1),
    }
    device = np.full((4, count), 0.5)
    device[:3, -3:] = (np.array(list(facing.values())) + 1) / 2
    device[3, -3:] = 0.5  # a normal of no length
    out = transform(device)
    assert np.all(out[0] > 0)
    assert np.all(out[1:] == 0)


def test_ambient_light(pair):
    """The 2020 model's ambient light reaches what the lamp does not."""
    if pair[0] != "cook_torrance_2020":
        pytest.skip("only the 2020 Cook-Torrance has an ambient term")
    _, profiles = pair
    device = device_samples("cook_torrance_2020", 5_000, 8, least_m=1e-2, facing=-1)
    found = iccbrdf.link([profiles.mid, profiles.mvis], env={"ambI": 0.25}, dtype="float64")(device)
    expected = evaluate("cook_torrance_2020", *decoded(device), DEFAULT_LIGHT, VIEW, ambient=0.25)
    assert relative(found, expected).max() < 2e-7


def test_an_image_without_normals_is_a_flat_print(pair):
    model, profiles = pair
    device = device_samples(model, 200, 9, least_m=1e-2, facing=0)
    device[:, -3:] = (0.5, 0.5, 1)
    whole = iccbrdf.link([profiles.mid, profiles.mvis])
    flat = iccbrdf.link([profiles.mid, profiles.mvis], channels=whole.channels_in[:-3])
    assert np.array_equal(flat(device[:, :-3]), whole(device))


def test_an_image_of_normals_alone_is_white_and_matte(pair):
    _, profiles = pair
    bare = iccbrdf.link([profiles.mid, profiles.mvis], channels=("n.x", "n.y", "n.z"), env={"litX": 0.0})
    white = bare(np.array([0.5, 0.5, 1.0]))
    assert white == pytest.approx([0.9642, 1, 0.8249], rel=1e-6)


def test_conditions_other_than_D50_2(pair, tmp_path):
    """White of a D65/10 pair is the header's illuminant, and D50 once taken to the ICC's own conditions."""
    model, _ = pair
    d65_10 = replace(
        primaries(model),
        illuminant="D65",
        observer="CIE 1964 10 Degree Standard Observer",
        white=(0.94811, 1.0, 1.07304),
    )
    profiles = build_pair(d65_10)
    for profile in (profiles.mid, profiles.mvis):
        assert iccdev.validate_profile(profile.to_bytes()).status == iccdev.ValidationStatus.OK
    white = profiles.mvis["wtpt"].values[0]
    assert white == pytest.approx(d65_10.white, abs=2**-16)
    from iccbrdf.cmm import standard_XYZ

    assert standard_XYZ(profiles.mvis)(np.array(white)) == pytest.approx((0.9642, 1, 0.8249), abs=2e-5)
    back = profiles.mvis["s2cp"].elements[0].matrix @ profiles.mvis["c2sp"].elements[0].matrix
    assert np.allclose(back, np.eye(3), atol=1e-6)
