"""Hard cases of geometry and material, in every back end and number type, and in the ICC's own CMM.

What the models are by themselves and what is known not to hold:

-   As the viewer nears the horizon radiance does not vanish, but below it nothing is seen: a jump.  Ward's
    grows without bound there.  Towards the light's horizon all models go to 0.
-   Fresnel's term with theta_i, as printed, is not reciprocal; with alpha it is.
-   Facets give back no more than 4 ks (Ward: ks) of the light, but kd is not lessened by what they take:
    with kd + 4 ks above 1 more light leaves a grazing surface than falls on it.
-   Published slope adjustment jumps at the flat white, downwards, and at the flat black; published
    interpolation wherever the number of nodes changes.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import islice, product

import hard_cases
import numpy as np
import pytest
from cmm_examples import mid, reference
from hard_examples import (
    BACKENDS,
    COLOUR_MIDS,
    DTYPES,
    GRAZING,
    PRIMARIES,
    SLOPES,
    anything,
    colours,
    directions,
    held_index,
    is_beside_switch,
    looks,
    mvis_of,
    on_slopes,
    primaries,
    prints,
    promised,
    relative_error,
    roughness,
    smallest_cosine,
    variables,
)

import iccbrdf
from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.brdf.models import MODELS, evaluate
from iccbrdf.build import build_colour_mid, build_pair
from iccbrdf.build.pair import GEOMETRIES
from iccbrdf.build.profiles import XYZ_RANGE
from iccbrdf.calc import compile_template, run
from iccbrdf.errors import InputError
from iccbrdf.resources import folder

LIGHTS = 64
"""With a viewer each: four of each kind."""
PRINTS = 640
ANYTHING = 160
"""Pixels for each light and view: with four models 200,000 samples, in either geometry."""

DOUBLE = ("llvm" if "llvm" in BACKENDS else "numpy", "float64")


@pytest.fixture(scope="module", params=list(product(MODELS, GEOMETRIES)), ids=" ".join)
def found(request):
    """A model's results under all lights and views."""
    model, geometry = request.param
    return list(looks(model, geometry, LIGHTS, PRINTS, ANYTHING, seed=7))


def test_no_finite_input_makes_a_result_that_is_not(found):
    for look in found:
        for key, XYZ in look.XYZ.items():
            assert np.isfinite(XYZ).all(), (look.model, key, look.light, look.view)


def test_normals_without_direction_and_facing_away_are_exactly_0(found):
    dark = 0
    for look in found:
        n = look.pixels[:, -3:]
        zero = np.all(n == 0, axis=1)
        away = np.zeros(len(n), bool)
        away[: look.prints] = look.cosine[:, 0] < -1e-6
        for XYZ in look.XYZ.values():
            assert np.all(XYZ[zero | away] == 0)
        dark += np.sum(zero) + np.sum(away & ~zero)
    assert dark > 0.1 * len(found) * (PRINTS + ANYTHING)


def test_back_ends_agree(found):
    # Of prints only: where kd and ks have unlike signs, what is left of their sum has any relative error.
    for look in found:
        for dtype, tolerance in (("float32", 1e-6), ("float64", 2e-15)):
            expected = look.of_prints("interpreter", dtype)
            for backend in BACKENDS:
                assert relative_error(look.of_prints(backend, dtype), expected).max() < tolerance


def test_float64_is_the_reference(found):
    model = found[0].model
    options = {"refractive_index": held_index()} if MODELS[model].has_fresnel else {}
    compared = 0
    for look in found:
        pixels = look.printed.astype(np.float64)
        expected = evaluate(model, pixels[:, :-3], pixels[:, -3:], look.light, look.view, **options)
        error = relative_error(look.of_prints(*DOUBLE), expected)
        # The condition of a lobe that is steep or grazed; 1e-4 as float32 holds it is 3e-8 less.
        scale = np.minimum(1, look.m / 0.01) ** 2 * np.minimum(1, look.cosine / GRAZING)
        used = (look.cosine > 1e-9) & (look.m > 1.001e-4)
        assert np.max(error * scale, where=used, initial=0) < 1e-10
        compared += used.sum()
    assert compared > len(found) * PRINTS


def test_float32_keeps_its_promises(found):
    samples = 0
    for look in found:
        bound = look.promised
        exact = look.of_prints(*DOUBLE)
        for backend in BACKENDS:
            error = relative_error(look.of_prints(backend, "float32"), exact)
            assert np.all(error <= bound), (backend, look.light, look.view, np.max(error / bound))
        samples += np.isfinite(bound).sum()
    assert samples > 0.75 * len(found) * PRINTS


def test_the_printed_formulas_do_not(found):
    """As they stand, in float32, they are worse by a factor that grows as m falls."""
    ours, theirs, m = [], [], []
    for look in found:
        exact = look.of_prints(*DOUBLE)
        used = (look.cosine >= 0.1) & (exact > 0)
        ours.append(relative_error(look.of_prints("numpy", "float32"), exact)[used])
        theirs.append(relative_error(look.as_printed(), exact)[used])
        m.append(look.m[used])
    ours, theirs, m = map(np.concatenate, (ours, theirs, m))
    for least, most, factor in ((0.05, 0.1, 10), (0.01, 0.02, 40), (1e-3, 2e-3, 200)):
        of = (m >= least) & (m < most)
        at_99 = [np.quantile(error[of], 0.99) for error in (theirs, ours)]
        assert at_99[0] > factor * at_99[1], (least, at_99)


# Pixels that are not finite ---------------------------------------------------------------------------------


def test_pixels_that_are_not_finite_spoil_no_others_and_are_the_same_everywhere(found):
    look, rng = found[0], np.random.default_rng(3)
    env = variables(look.light, look.view)
    pixels = np.tile(look.printed, (30, 1))  # more than a tile
    spoilt = pixels.copy()
    chosen = rng.random(len(pixels)) < 0.1
    where = (rng.random(pixels.shape) < 0.2) & chosen[:, None]
    spoilt[where] = rng.choice([np.nan, np.inf, -np.inf], where.sum())
    clean = ~np.any(where, axis=1)
    patterns = {}
    for key in look.XYZ:
        mvis = mvis_of(look.model, geometry=look.geometry)
        transform = iccbrdf.link([mvis], backend=key[0], dtype=key[1], env=env)
        XYZ = transform(spoilt)
        np.testing.assert_array_equal(XYZ[clean], transform(pixels)[clean])
        patterns[key] = not_finite(XYZ)
    assert 0.005 < np.mean(patterns["interpreter", "float32"] != 0) < 0.1
    for key, pattern in patterns.items():
        # What overflows is another matter in float64.
        np.testing.assert_array_equal(pattern, patterns["interpreter", key[1]], err_msg=str(key))


# What the models are by themselves --------------------------------------------------------------------------

CHANNELS = {
    "brdf1": (1, 1, 1, 0.3, 0.2, 0.1, 0.2),
    "brdf2": (1, 1, 1, 0.3, 0.2, 0.1, 0.1, 0.2, 0.3),
    "cook_torrance_2020": (1, 1, 1, 0.3, 0.2),
    "ward": (1, 1, 1, 0.3, 0.2),
}
"""Parameters of an ordinary print."""


def degrees(zenith, azimuth=0.0):
    """Unit vectors (..., 3)."""
    zenith, azimuth = np.broadcast_arrays(np.radians(zenith), np.radians(azimuth))
    return np.stack([np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)], -1)


def shown(model, normals, light, view, dtype="float64", parameters=None, fresnel_angle=None):
    """XYZ of an ordinary print, or of other parameters, at normals (n, 3)."""
    mvis = mvis_of(model, fresnel_angle)
    transform = iccbrdf.link([mvis], env=variables(light, view), dtype=dtype, backend="numpy")
    given = np.asarray(CHANNELS[model] if parameters is None else parameters)
    given = np.broadcast_to(given, (len(normals), given.shape[-1]))
    return transform(np.concatenate([given, normals], axis=1)).astype(np.float64)


def is_continuous(curve):
    """Of `curve(t)`, t from 0 to 1: steps 64 times as fine are a root's an eighth; a jump's stay."""
    coarse, fine = (np.abs(np.diff(curve(np.linspace(0, 1, n + 1)), axis=0)).max() for n in (1000, 64_000))
    return fine < coarse / 6


def turning(t, first, last, out_of_plane=0.0):
    """Normals that turn about the y axis from one angle to another, tilted out of that plane."""
    tilt = np.radians(out_of_plane)
    return degrees(first + (last - first) * t) * np.cos(tilt) + [0, np.sin(tilt), 0]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("out_of_plane", [0, 70])
def test_continuous_at_the_light_s_horizon_and_where_g_has_its_minima(model, out_of_plane):
    light, view = degrees(40), degrees(40, 180)
    n = turning(np.linspace(0, 1, 1001), -90, 49, out_of_plane)
    cos_i, cos_v = n @ light, n @ view
    lit = (cos_i > 0) & (cos_v > 0)
    shading = 4 * (cos_i + cos_v) / np.sum((light + view) ** 2) * np.minimum(cos_i, cos_v) < 1
    # In the plane nothing is shaded between light's side and viewer's; far out of it one follows the other.
    assert not lit[0]
    assert {*zip(shading[lit], (cos_i < cos_v)[lit], strict=True)} == {
        (shaded, by_light) for shaded in (True, bool(out_of_plane)) for by_light in (True, False)
    }
    assert is_continuous(lambda t: shown(model, turning(t, -90, 49, out_of_plane), light, view))


@pytest.mark.parametrize("model", MODELS)
def test_nothing_is_seen_below_the_viewer_s_horizon_which_is_a_jump(model):
    light, view = degrees(40), degrees(40, 180)
    assert not is_continuous(lambda t: shown(model, turning(t, 49, 51), light, view))


@pytest.mark.parametrize("model", MODELS)
def test_continuous_where_roughness_is_held(model):
    light, view = degrees(40), degrees(40, 180)
    m = [name.startswith("m") for name in MODELS[model].channels]

    def curve(t):
        # One tenth of a lobe's width beside the mirror direction.
        normals = np.tile(degrees(np.degrees(1e-5)), (len(t), 1))
        return shown(model, normals, light, view, parameters=np.where(m, 2e-4 * t[:, None], CHANNELS[model]))

    assert is_continuous(curve)
    held = curve(np.array([-1.0, 0, 0.1, 0.49999]))
    assert np.all(held == held[0])


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("dtype", DTYPES)
def test_monotone_in_reflectance_to_the_last_digit(model, dtype):
    """More kd or ks never gives less; but for ks of the 2020 model, which takes from the diffuse part."""
    names = MODELS[model].channels
    n = np.tile(degrees(12, 50), (5000, 1))
    for family in ("kd", "Rd", "ks"):
        if family == "ks" and model == "cook_torrance_2020":
            continue
        rising = [name.startswith(family) for name in names]
        parameters = np.where(rising, np.linspace(0, 4, 5000)[:, None] ** 2, CHANNELS[model])
        steps = np.diff(shown(model, n, degrees(40), degrees(20, 170), dtype, parameters), axis=0)
        assert np.all(steps >= 0)
        assert np.any(rising) == np.any(steps > 0)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("m", [1e-3, 0.03, 0.3])
def test_falls_all_the_way_from_the_highlight(model, m):
    """Light and viewer straight above: the steeper, the darker."""
    above = np.array([0, 0, 1.0])
    parameters = np.where([name.startswith("m") for name in MODELS[model].channels], m, CHANNELS[model])
    normals = degrees(np.linspace(0, 89.9, 3000))
    for dtype, rounding in (("float32", 1e-6), ("float64", 1e-14)):
        XYZ = shown(model, normals, above, above, dtype, parameters)
        assert np.all(XYZ[1:] <= XYZ[:-1] * (1 + rounding))
        assert XYZ[0, 1] > 100 * XYZ[-1, 1]


def exchanged(model, dtype, fresnel_angle):
    """How far light and viewer can not be exchanged: the largest relative difference of XYZ / cos theta_i."""
    light, view = degrees(60), degrees(35, 130)
    normals = degrees(np.linspace(0, 25, 2000), np.linspace(0, 40, 2000))
    one = shown(model, normals, light, view, dtype, fresnel_angle=fresnel_angle)
    other = shown(model, normals, view, light, dtype, fresnel_angle=fresnel_angle)
    return relative_error(one / (normals @ light)[:, None], other / (normals @ view)[:, None]).max()


@pytest.mark.parametrize("model", MODELS)
def test_reciprocity(model):
    has_fresnel = MODELS[model].has_fresnel
    for dtype, rounding in (("float32", 2e-5), ("float64", 1e-12)):
        assert exchanged(model, dtype, "alpha" if has_fresnel else None) < rounding
    if has_fresnel:
        assert exchanged(model, "float64", "theta_i") > 1e-3


def albedo(model, incidence, parameters):
    """The share of the light that leaves again, for Y, of parameters (n, channels): a sum over viewers."""
    pixels = np.concatenate([parameters, np.tile([0.0, 0, 1], (len(parameters), 1))], axis=1)
    transform = iccbrdf.link([mvis_of(model)], dtype="float64", backend="numpy")
    light = degrees(incidence, 180)
    total = np.zeros(len(parameters))
    for u, weight in zip(*np.polynomial.legendre.leggauss(16), strict=True):
        cosine, azimuths = (u + 1) / 2, (np.arange(16) + 0.5) / 16 * 180
        for azimuth in azimuths:
            view = degrees(np.degrees(np.arccos(cosine)), azimuth)
            XYZ = transform.with_env(variables(light, view))(pixels)
            total += XYZ[:, 1] * cosine * weight * np.pi / len(azimuths)
    return total / (MODELS[model].intensity * np.cos(np.radians(incidence)))


@pytest.mark.parametrize(("model", "full"), [("brdf1", 0.25), ("cook_torrance_2020", 0.25), ("ward", 1)])
def test_facets_return_no_more_than_they_receive(model, full):
    """ks of .25 is a full coat of the papers' Cook-Torrance, whose D has 1 / pi and not 1 / (4 pi)."""
    m = np.array([0.2, 0.3, 0.5, 1])
    widths = [width for _, width in MODELS[model].parameters]
    gloss = np.concatenate([np.zeros((4, 3)), np.full((4, widths[1]), full), m[:, None]], axis=1)
    for incidence in (0, 80):
        returned = albedo(model, incidence, gloss)
        assert np.all(returned < 1.01)
        assert np.all(returned > 0)
    if model != "brdf1":
        assert albedo(model, 0, gloss)[1] > 0.75  # F is 1, and little is lost


def test_kd_is_not_lessened_by_what_facets_take():
    coated = np.array([[0.85, 0.85, 0.85, 0.25, 0.25, 0.25, 0.3]])
    assert albedo("brdf1", 45, coated)[0] < 1
    assert albedo("brdf1", 85, coated)[0] > 1.1


# The ICC's own CMM ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("model", "geometry"), list(product(MODELS, GEOMETRIES)))
def test_the_icc_s_cmm_agrees_on_the_same_profiles(model, geometry, tmp_path):
    """It takes light and viewer from the profile: every third kind of pair, 200,000 samples in all."""
    rng, names = np.random.default_rng(5), (*MODELS[model].channels, "n.x", "n.y", "n.z")
    for light, view in islice(directions(rng), 0, 14, 3):
        settings = {"variables": variables(light, view), "geometry": geometry}
        chain = [mid(names), build_pair(primaries(model), **settings).mvis]
        printed, any_ = prints(model, light, view, 4600, rng), anything(len(names), 800, rng)
        spoilt = printed.copy()
        where = rng.random(spoilt.shape) < 0.02
        spoilt[where] = rng.choice([np.nan, np.inf, -np.inf], where.sum())
        pixels = np.concatenate([printed, any_, spoilt])
        theirs = np.split(reference(tmp_path, chain, pixels, pcs="XYZ "), [4600, 5400])
        ours = np.split(iccbrdf.link(chain, backend="numpy")(pixels).astype(np.float64), [4600, 5400])
        assert relative_error(ours[0], theirs[0]).max() < 1e-6
        exact = iccbrdf.link(chain, dtype="float64", backend="numpy")(printed)
        cosine = smallest_cosine(printed, light, view)
        bound = promised(roughness(model, printed), cosine[:, None], geometry)
        assert np.all(relative_error(theirs[0], exact) <= bound)
        assert np.isfinite(theirs[0]).all()
        assert np.isfinite(theirs[1]).all()
        # At the horizon itself, theirs or ours may be the one that is lit.
        clear = np.abs(smallest_cosine(printed, light, view)) > 1e-6
        np.testing.assert_array_equal(*(not_finite(XYZ[2][clear]) for XYZ in (ours, theirs)))


def not_finite(values):
    """0 for a number, else 2 for none and the sign of an infinity."""
    return np.where(np.isfinite(values), 0, np.where(np.isnan(values), 2, np.sign(values)))


# Colour MIDs ------------------------------------------------------------------------------------------------


@cache
def colour_mid_of(interpolation, slope_method):
    return build_colour_mid(
        PRIMARIES, interpolation=interpolation, slopes=SLOPES, slope_method=slope_method
    ).mid


@pytest.fixture(scope="module", params=COLOUR_MIDS, ids=" ".join)
def coloured(request):
    """A colour MID and its methods, hard colours, and what every back end makes of them."""
    interpolation, slope_method = request.param
    mid = colour_mid_of(interpolation, slope_method)
    pixels = colours(10_000, np.random.default_rng(11))
    found = {
        (backend, dtype): iccbrdf.link([mid], samples="real", backend=backend, dtype=dtype)(pixels)
        for backend in BACKENDS
        for dtype in DTYPES
    }
    return mid, interpolation, slope_method, pixels, found


def apart(one, other):
    """The largest difference of parameters of a pixel, relative where they are large, (n)."""
    one, other = (np.asarray(values, np.float64)[:, :7] for values in (one, other))
    return np.max(np.abs(one - other) / (np.abs(other) + 0.01), axis=1)


def test_every_colour_has_parameters(coloured):
    _, _, _, pixels, found = coloured
    for key, parameters in found.items():
        assert np.isfinite(parameters).all(), key
        assert np.all(parameters[:, :3] >= 0)
        assert np.all(parameters[:, 3:7] > 0)
        np.testing.assert_array_equal(parameters[:, 7:], pixels[:, 3:])


def test_colours_in_every_back_end_are_the_reference_s(coloured):
    _, interpolation, slope_method, pixels, found = coloured
    XYZ = on_slopes(pixels, slope_method)
    expected = interpolate(XYZ, PRIMARIES, method=interpolation)
    # Where white or black begin, a rounded Y decides (published).
    steady = np.ones(len(pixels), bool)
    if interpolation == "published":
        steady = ~is_beside_switch(XYZ)
        assert steady.mean() > 0.9
    for (_, dtype), parameters in found.items():
        assert apart(parameters, expected)[steady].max() < 5e-6
        assert apart(parameters, found["interpreter", dtype])[steady].max() < (
            5e-6 if dtype == "float32" else 1e-14
        )


def test_colours_that_are_not_finite_spoil_no_others(coloured):
    mid, _, _, pixels, found = coloured
    rng, spoilt = np.random.default_rng(13), pixels.copy()
    where = rng.random(spoilt.shape) < 0.02
    spoilt[where] = rng.choice([np.nan, np.inf, -np.inf], where.sum())
    clean = ~np.any(where, axis=1)
    patterns = {}
    for key, expected in found.items():
        parameters = iccbrdf.link([mid], samples="real", backend=key[0], dtype=key[1])(spoilt)
        np.testing.assert_array_equal(parameters[clean], expected[clean])
        patterns[key] = not_finite(parameters)
    for key, pattern in patterns.items():
        np.testing.assert_array_equal(pattern, patterns["interpreter", key[1]], err_msg=str(key))


def test_the_icc_s_cmm_agrees_on_hard_colours(coloured, tmp_path):
    mid, interpolation, _, pixels, _ = coloured
    values = np.concatenate([pixels[:, :3] / XYZ_RANGE[1], (pixels[:, 3:] + 1) / 2], axis=1)
    values = values.astype(np.float32)
    theirs = reference(tmp_path, [mid], values)
    assert np.isfinite(theirs).all()
    differences = apart(iccbrdf.link([mid])(values), theirs)
    # The last digit of its cube root may move the choice of nodes.
    assert np.mean(differences < 1e-5) >= (0.99 if interpolation == "published" else 1)


def along(interpolation, slope_method, pixels):
    """Parameters in float64 along a path of pixels (n, 6)."""
    chain = [colour_mid_of(interpolation, slope_method)]
    return iccbrdf.link(chain, samples="real", dtype="float64", backend="numpy")(pixels)[:, :7]


def with_normal(XYZ, n=(0.0, 0.0, 1.0)):
    return np.concatenate(np.broadcast_arrays(XYZ, n), axis=-1)


@pytest.mark.parametrize("slope_method", ["affine", "published"])
@pytest.mark.parametrize("colour", [(0.4, 0.3, 0.2), (0.9, 1, 0.8), (0.005, 0.005, 0.005)])
def test_continuous_in_the_slope_over_all_segments_and_beyond(slope_method, colour):
    def curve(t):
        return along("smooth", slope_method, with_normal(colour, degrees(180 * t)))

    assert is_continuous(curve)
    beyond = curve(np.array([60, 60.01, 89, 90, 180]) / 180)
    np.testing.assert_allclose(beyond, np.tile(beyond[:1], (5, 1)), rtol=1e-12)


def line(first, last):
    """Colours flat and on a slope, by t."""
    return lambda t: with_normal(np.add(first, t[:, None] * np.subtract(last, first)), degrees(30))


@pytest.mark.parametrize(
    ("first", "last"),
    [((-0.5, -0.5, -0.5), (2, 2, 2)), (PRIMARIES.XYZ[0], PRIMARIES.XYZ[1]), ((0.1, -1, 1), (0.1, 1, -1))],
)
def test_smooth_interpolation_is_continuous_in_the_colour(first, last):
    path = line(first, last)
    assert is_continuous(lambda t: along("smooth", "affine", path(t)))


def test_what_is_published_jumps():
    grey = line((0.0, 0.0, 0.0), PRIMARIES.white)
    assert not is_continuous(lambda t: along("smooth", "published", grey(t)))
    hue = line(PRIMARIES.XYZ[1], PRIMARIES.XYZ[2])
    assert not is_continuous(lambda t: along("published", "affine", hue(t)))


@pytest.mark.parametrize("dtype", DTYPES)
def test_slope_adjustment_is_monotone_but_for_the_published_white(dtype):
    transforms = {method: slope_program(method, dtype) for method in ("affine", "published")}
    t = np.linspace(-1, 3, 4001)[:, None]
    for angle in (0, 10, 30, 45, 80):
        pixels = with_normal(t * np.array(PRIMARIES.white), degrees(angle))
        steps = {method: np.diff(adjust(pixels), axis=0) for method, adjust in transforms.items()}
        assert np.all(steps["affine"] >= 0)
        falls = np.any(steps["published"] < 0, axis=1)
        assert falls.sum() == (angle > 0)
        assert np.all(t[1:][falls, 0] >= SLOPES.W[0, 1] - 1e-6)


def slope_program(method, dtype):
    """XYZ on slopes by the template alone."""
    path = folder("calc_templates") / "slope_adjust.calc"
    constants = {
        "slope_angles": SLOPES.angles, "slope_W": SLOPES.W, "slope_B": SLOPES.B, "slope_method": method,
    }  # fmt: skip
    compiled = compile_template(path.read_text("utf-8"), filename=path.name, constants=constants)

    def adjust(pixels):
        columns = dict(zip(("X", "Y", "Z", "n.x", "n.y", "n.z"), pixels.T.astype(dtype), strict=True))
        inputs = [columns[name] for name in compiled.inputs]
        return np.stack(run(compiled.program, inputs, 3, dtype=np.dtype(dtype).type), axis=-1)

    return adjust


def test_white_and_black_that_are_equal_are_refused():
    for k in (0, 3):
        equal = list(SLOPES.slopes)
        equal[k] = replace(equal[k], B=equal[k].W)
        with pytest.raises(InputError, match=r"white .* black"):
            build_colour_mid(PRIMARIES, slopes=replace(SLOPES, slopes=tuple(equal)))


def test_white_and_black_that_are_nearly_equal_give_numbers():
    pixels = colours(2000, np.random.default_rng(17))
    flat = SLOPES.slopes[0]
    near = tuple(np.nextafter(np.float32(flat.W), np.float32(0)).astype(float))
    slopes = replace(SLOPES, slopes=(replace(flat, B=near), *SLOPES.slopes[1:]))
    for slope_method in ("affine", "published"):
        mid = build_colour_mid(PRIMARIES, slopes=slopes, slope_method=slope_method).mid
        for dtype in DTYPES:
            found = iccbrdf.link([mid], samples="real", dtype=dtype)(pixels)
            assert np.isfinite(found).all()


# The long run -----------------------------------------------------------------------------------------------


def test_the_tool_finds_the_same_and_writes_it(tmp_path, monkeypatch):
    monkeypatch.setattr(hard_cases, "COLOURS", 1000)
    errors = hard_cases.ErrorMap("plain")
    model = hard_cases.examine("ward", "plain", 10_000, 3, errors)
    colour = hard_cases.examine_colours("smooth", "affine", 1000, 3)
    assert (model.not_finite, model.broken, colour.not_finite) == (0, 0, 0)
    assert model.samples >= 10_000
    assert colour.samples == 1000
    ours, printed = errors.by_m[0.001, 0.003]
    assert printed.quantile(0.99) > 100 * ours.quantile(0.99)
    assert ours.quantile(0.99) <= ours.largest < printed.largest
    exact = hard_cases.ErrorMap("exact")
    low = hard_cases.examine("ward", "exact", 10_000, 3, exact)
    assert (low.not_finite, low.broken) == (0, 0)
    assert exact.cells[0].max() < errors.cells[0].max()
    maps = {"plain": errors, "exact": exact}
    lines = list(hard_cases.report([model, low], [colour], maps))
    assert len([line for line in lines if line.startswith("| ward")]) == 2
    hard_cases.draw(maps, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_what_is_broken_is_counted():
    errors = np.array([0.0, 1e-6, 1e-3, np.inf])
    held = hard_cases.Errors()
    held.add(errors)
    assert held.largest == np.inf
    assert held.quantile(0.75) == pytest.approx(1e-3, rel=0.03)
    bound = promised(np.full(4, 0.05), np.array([1, 0.04, 0.004, -0.1]))
    np.testing.assert_allclose(bound, [1e-4, 1e-4, 1e-3, np.inf])
    bound = promised(np.full(3, 0.05), np.array([1, 0.004, 1e-8]), "exact")
    np.testing.assert_allclose(bound, [1e-4, 1e-4, np.inf])
    assert promised(np.array([0.005]), np.array([1e-4])) == np.inf  # 5 would be promised, which is nothing
