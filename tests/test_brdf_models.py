"""The reflection models: values by hand, a scalar transcription, the two forms, limits and physics."""

import math
import re

import numpy as np
import pytest
from conftest import SHARED

from iccbrdf.brdf.cook_torrance import (
    M_MIN,
    beckmann,
    beckmann_stable,
    cook_torrance,
    cook_torrance_2020,
    fresnel_schlick,
)
from iccbrdf.brdf.geometry import HORIZON, cosines, direction, planar, unit
from iccbrdf.brdf.models import MODELS, evaluate
from iccbrdf.brdf.ward import ward
from iccbrdf.errors import UsageError

FITS = SHARED / "data" / "published-fits"
UP = (0, 0, 1)
FORMS = ("stable", "literal")


def random_geometry(rng: np.random.Generator, m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """n, light, view with light and viewer anywhere above the surface; half of the normals lie within 3 m
    of the half vector, where a narrow lobe is, the others anywhere."""
    count = len(m)
    light, view, n = (
        direction(np.degrees(np.arccos(rng.uniform(0, 1, count))), rng.uniform(0, 360, count))
        for _ in range(3)
    )
    near = rng.random(count) < 0.5
    half = unit(light + view)
    across = unit(np.cross(half, rng.normal(size=(count, 3))))
    tilted = half + across * (rng.uniform(0, 3, count) * m)[:, np.newaxis]
    n = np.where(near[:, np.newaxis], tilted, n) * rng.uniform(0.1, 10, (count, 1))
    return n, light, view


def random_parameters(rng: np.random.Generator, model: str, m: np.ndarray) -> np.ndarray:
    """Parameters of a model with the given roughness (BRDF2: up to 10 % more in Y and Z)."""
    families = []
    for family, width in MODELS[model].parameters:
        values = rng.uniform(0, 1, (len(m), width))
        families.append(m[:, np.newaxis] * (1 + 0.1 * values * np.arange(width)) if family == "m" else values)
    return np.concatenate(families, axis=-1)


# --- values ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_brdf1_by_hand_in_the_mirror_direction(form) -> None:
    # cos theta_i = 1/2, F = .04 + .96/32 = .07, D = 1/m^2 = 25, G = 1:
    # pi/2 (kd/pi + ks .07 25 / (pi/4)) = kd/2 + 3.5 ks
    found = cook_torrance([0.2, 0.4, 0.6], [0.1, 0.2, 0.3], 0.2, UP, planar(-60), planar(60), form=form)
    assert found == pytest.approx([0.1 + 0.35, 0.2 + 0.7, 0.3 + 1.05], rel=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_brdf2_by_hand_beside_the_mirror_direction(form) -> None:
    # theta_h = 30 degrees: tan^2 = 1/3, cos^4 = 9/16; F = .04, G = 1, cos theta_v = 1/2.
    m = np.array([0.5, 1, 2])
    D = np.exp(-1 / (3 * m**2)) * 16 / (9 * m**2)
    found = cook_torrance(0.3, 0.5, m, UP, UP, planar(60), form=form)
    assert found == pytest.approx(0.3 + 0.5 * 0.04 * D / 0.5, rel=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_masking_by_hand(form) -> None:
    # Light along n, viewer at 80 degrees: G = 2 cos 80 as theta_h = alpha, and G / cos theta_v = 2.
    D = math.exp(-(math.tan(math.radians(40)) ** 2)) / math.cos(math.radians(40)) ** 4
    found = cook_torrance(0, 1, 1, UP, UP, planar(80), form=form)
    assert found == pytest.approx(np.full(3, 0.04 * D * 2), rel=1e-12)


def transcription(model, p, n, i, v, fresnel_angle="theta_i", refractive_index=1.5, ambient=0.0):
    """The papers' equations for one sample, with the math module."""

    def norm(a):
        length = math.sqrt(sum(x * x for x in a))
        return [x / length for x in a]

    def cos_of(a, b):
        return sum(x * y for x, y in zip(a, b, strict=True))

    n, i, v = norm(n), norm(i), norm(v)
    h = norm([a + b for a, b in zip(i, v, strict=True)])
    ti, tv, th, alpha = (math.acos(min(1.0, cos_of(a, b))) for a, b in ((n, i), (n, v), (n, h), (v, h)))
    if ti >= math.pi / 2 or tv >= math.pi / 2:
        return [0.0, 0.0, 0.0]
    cos = math.cos
    G = min(1, 2 * cos(th) * cos(ti) / cos(alpha), 2 * cos(th) * cos(tv) / cos(alpha))
    result = []
    for c in range(3):
        m = p[-1] if model != "brdf2" else p[6 + c]
        D = math.exp(-((math.tan(th) / m) ** 2)) / (m**2 * cos(th) ** 4)
        if model in ("brdf1", "brdf2"):
            r0 = ((1 - refractive_index) / (1 + refractive_index)) ** 2
            F = r0 + (1 - r0) * (1 - cos({"theta_i": ti, "alpha": alpha}[fresnel_angle])) ** 5
            Rs = F * D * G / (math.pi * cos(ti) * cos(tv))
            result.append(math.pi * cos(ti) * (p[c] / math.pi + p[3 + c] * Rs))
        elif model == "cook_torrance_2020":
            Rs = D * G / (math.pi * cos(ti) * cos(tv))
            result.append(ambient * p[c] + cos(ti) * (p[3] * Rs + (1 - p[3]) * p[c]))
        else:
            lobe = math.exp(-((math.tan(th) / m) ** 2)) / (4 * math.pi * m**2 * math.sqrt(cos(ti) * cos(tv)))
            result.append(math.pi * cos(ti) * (p[c] / math.pi + p[3] * lobe))
    return result


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("model", "options"),
    [
        ("brdf1", {}),
        ("brdf1", {"fresnel_angle": "alpha", "refractive_index": 1.33}),
        ("brdf2", {}),
        ("cook_torrance_2020", {"ambient": 0.25}),
        ("ward", {}),
    ],
)
def test_models_against_a_scalar_transcription(model, options, form) -> None:
    rng = np.random.default_rng(1)
    m = rng.uniform(0.05, 1, 300)
    n, light, view = random_geometry(rng, m)
    parameters = random_parameters(rng, model, m)
    found = evaluate(model, parameters, n, light, view, form=form, **options)
    lit = (np.einsum("ij,ij->i", n, light) > 0) & (np.einsum("ij,ij->i", n, view) > 0)
    expected = np.array(
        [transcription(model, *sample, **options) for sample in zip(parameters, n, light, view, strict=True)]
    )
    assert lit.sum() > 100
    assert found[lit] == pytest.approx(expected[lit], rel=1e-10)


@pytest.mark.parametrize("m", [1e-4, 1e-3, 0.03, 0.4])
def test_planar_form_of_2020_is_the_vector_form(m) -> None:
    # In the paper's plane delta is half the difference of the angles and cos alpha belongs to half the sum.
    theta_i, off = np.meshgrid(np.arange(0, 75, 15), np.linspace(-3, 3, 13) * np.degrees(m))
    theta_r = np.clip(theta_i + 2 * off, -85, 85)
    delta, alpha = np.radians(theta_r - theta_i) / 2, np.radians(theta_r + theta_i) / 2
    cos_i, cos_r = np.cos(np.radians(theta_i)), np.cos(np.radians(theta_r))
    lobe = np.exp(-(np.tan(delta) ** 2) / m**2)
    G = np.minimum(1, 2 * np.cos(delta) * np.minimum(cos_i, cos_r) / np.cos(alpha))
    facets = lobe / (m**2 * np.cos(delta) ** 4) * G / (np.pi * cos_i * cos_r)
    light, view = planar(-theta_i), planar(theta_r)

    found = ward(0.5, 0.1, m, UP, light, view)[..., 1]
    expected = cos_i * (0.5 + 0.1 * lobe / (4 * m**2 * np.sqrt(cos_i * cos_r)))
    assert found == pytest.approx(expected, rel=1e-13 / m)

    found = cook_torrance_2020(0.5, 0.1, m, UP, light, view)[..., 1]
    assert found == pytest.approx(cos_i * (0.1 * facets + 0.9 * 0.5), rel=1e-13 / m)


# --- the two forms --------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("m_low", "m_high", "tolerance"), [(2e-3, 2, 1e-9), (M_MIN, 2e-3, 1e-6)])
def test_literal_and_stable_agree(model, m_low, m_high, tolerance) -> None:
    rng = np.random.default_rng(2)
    m = np.exp(rng.uniform(np.log(m_low), np.log(m_high), 50_000))
    n, light, view = random_geometry(rng, m)
    parameters = random_parameters(rng, model, m)
    # Without a diffuse part, which would hide the lobe's flanks.
    parameters[:, :3] = 0
    stable = evaluate(model, parameters, n, light, view)
    literal = evaluate(model, parameters, n, light, view, form="literal")
    # Where a lobe has underflowed, both are less than the smallest number with all its digits.
    meaningful = stable > 1e-300
    assert meaningful.mean() > 0.25
    assert np.all(literal[~meaningful] < 1e-299)
    error = np.abs(literal[meaningful] / stable[meaningful] - 1)
    assert error.max() < tolerance


@pytest.mark.parametrize("model", MODELS)
def test_published_fits_are_in_the_range_of_both_forms(model) -> None:
    path = FITS / ("ngan_ward.fit" if model == "ward" else "ngan_cooktorrance.fit")
    if not path.is_file():
        pytest.skip(f"no published fits at {path}")
    lines = [line for line in path.read_text().splitlines() if line and not line.startswith("#")]
    fits = [
        [float(x) for x in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", line.split("=", 1)[1])]
        for line in lines
    ]
    # Diffuse RGB, specular RGB, (Schlick's F0,) roughness; MERL's channel scales on G and B.
    fits = np.array(fits) * ([1, 1.15, 1.66] * 2 + [1] * (len(fits[0]) - 6))
    assert len(fits) > 80
    kd, ks, m = fits[:, :3], fits[:, 3:6], fits[:, -1:]
    values = {"kd": kd, "Rd": kd, "ks": ks, "m": m}
    parameters = np.concatenate(
        [
            values[family][:, :width] if family != "m" else np.repeat(m, width, axis=1)
            for family, width in MODELS[model].parameters
        ],
        axis=-1,
    )
    view = planar(np.arange(-80, 81, 5))
    arguments = (parameters[:, np.newaxis], UP, planar(-45), view)
    stable, literal = (evaluate(model, *arguments, form=form) for form in FORMS)
    assert np.isfinite(stable).all()
    assert literal == pytest.approx(stable, rel=1e-9)


def test_no_digits_are_lost_towards_the_horizon() -> None:
    # As the viewer sinks to the horizon G / cos theta_v tends to 2, where the printed form multiplies by
    # cos theta_v and divides by it.
    grazing = 10.0 ** -np.arange(1.0, 15)
    view = np.stack([np.ones_like(grazing), np.zeros_like(grazing), grazing], axis=-1)
    value = cook_torrance(0, 1, 0.8, UP, UP, view)[:, 1]
    limit = 0.04 * math.exp(-1 / 0.64) * 4 / 0.64 * 2
    assert value[-1] == pytest.approx(limit, rel=1e-12)


# --- limits ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    ("n", "light", "view"),
    [
        (UP, direction(90, 180), UP),
        (UP, UP, direction(90, 0)),
        (UP, direction(91, 180), UP),
        (UP, UP, (0, 0, -1)),
        (UP, planar(-60), -planar(-60)),
        (UP, (1, 0, 0), (-1, 0, 0)),
        (UP, (1, 0, 1e-100), (-1, 0, 1e-100)),
        ((0, 0, 0), UP, UP),
        ((np.nan, 0, 1), UP, UP),
        (UP, (0, 0, 0), UP),
        (UP, UP, (0, 0, 0)),
        ((0, 0, -1), UP, UP),
    ],
)
def test_exactly_black_below_the_horizon(model, form, n, light, view) -> None:
    parameters = np.full(len(MODELS[model].channels), 0.3)
    assert evaluate(model, parameters, n, light, view, form=form).tolist() == [0, 0, 0]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("model", MODELS)
def test_finite_for_every_light_and_viewer_above_the_horizon(model, form) -> None:
    height = np.array([HORIZON * 1.1, 1e-30, 1e-9, 1e-3])[:, np.newaxis]
    turn = np.linspace(0, np.pi, 7)
    light = np.stack(np.broadcast_arrays(-1.0, 0.0, height[:, np.newaxis]), axis=-1)
    view = np.stack(np.broadcast_arrays(np.cos(turn), np.sin(turn), height), axis=-1)
    for m in (0, M_MIN, 1):
        parameters = np.full(len(MODELS[model].channels), 0.3)
        parameters[-1] = m
        value = evaluate(model, parameters, UP, light, view, form=form)
        assert value.shape == (4, 4, 7, 3)
        assert np.isfinite(value).all()
        assert (value >= 0).all()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("model", MODELS)
def test_roughness_is_held_at_its_least_value(model, form) -> None:
    channels = MODELS[model].channels
    held = np.array([M_MIN if name.startswith("m") else 0.3 for name in channels])
    below = np.where(held == M_MIN, 0, held)
    geometry = (planar(0.003), planar(-20), planar(20))
    assert evaluate(model, below, *geometry, form=form).tolist() == (
        evaluate(model, held, *geometry, form=form).tolist()
    )


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("model", MODELS)
def test_length_of_the_vectors_does_not_matter(model, form) -> None:
    parameters = np.full(len(MODELS[model].channels), 0.3)
    n, light, view = planar(5), direction(50, 170), direction(40, 10)
    expected = evaluate(model, parameters, n, light, view, form=form)
    found = evaluate(model, parameters, 7e-3 * n, 5 * light, 1e5 * view, form=form)
    assert found == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("model", MODELS)
def test_perfect_diffuser_facing_the_default_light_is_white(model) -> None:
    parameters = [
        1.0 if name[:2] in ("kd", "Rd") else 0.1 if name[0] == "m" else 0.0 for name in MODELS[model].channels
    ]
    assert evaluate(model, parameters, UP, UP, planar(30)) == pytest.approx([1, 1, 1])


def test_intensity_is_a_factor_and_may_have_a_colour() -> None:
    geometry = (UP, planar(-30), planar(20))
    one = cook_torrance(0.4, 0.3, 0.2, *geometry, intensity=1)
    assert cook_torrance(0.4, 0.3, 0.2, *geometry) == pytest.approx(np.pi * one)
    coloured = cook_torrance(0.4, 0.3, 0.2, *geometry, intensity=[1, 2, 0])
    assert coloured == pytest.approx(one * [1, 2, 0])


@pytest.mark.parametrize("form", FORMS)
def test_ambient_light_reaches_what_the_light_does_not(form) -> None:
    Rd = np.array([0.2, 0.4, 0.6])
    arguments = {"ambient": 0.5, "form": form}
    shadow = cook_torrance_2020(Rd, 0.1, 0.2, planar(60), planar(-45), UP, **arguments)
    assert shadow == pytest.approx(0.5 * Rd)
    hidden = cook_torrance_2020(Rd, 0.1, 0.2, planar(60), UP, planar(-45), **arguments)
    assert hidden.tolist() == [0, 0, 0]


# --- physics --------------------------------------------------------------------------------------------


def test_reciprocity_holds_with_alpha_and_fails_with_theta_i() -> None:
    rng = np.random.default_rng(3)
    m = rng.uniform(0.1, 0.6, 200)
    _, light, view = random_geometry(rng, m)
    light, view = (vectors + np.array([0, 0, 0.1]) for vectors in (light, view))

    def brdf(light: np.ndarray, view: np.ndarray, fresnel_angle: str) -> np.ndarray:
        value = cook_torrance(0.3, 0.5, m[:, np.newaxis], UP, light, view, fresnel_angle=fresnel_angle)
        return value / cosines(UP, light, view).theta_i[:, np.newaxis]

    assert brdf(light, view, "alpha") == pytest.approx(brdf(view, light, "alpha"), rel=1e-12)
    ratio = brdf(light, view, "theta_i") / brdf(view, light, "theta_i")
    assert np.abs(ratio - 1).max() > 0.1


@pytest.mark.parametrize("m", [0.05, 0.3, 0.8])
def test_projected_area_of_the_facets_is_that_of_the_surface(m) -> None:
    # The papers' D lacks the 1/pi of later texts: its integral of cos theta over the hemisphere is pi.
    theta = np.linspace(0, np.pi / 2, 20_001)[:-1]
    integrand = beckmann(theta, m) * np.cos(theta) * 2 * np.pi * np.sin(theta)
    assert np.trapezoid(integrand, theta) == pytest.approx(np.pi, rel=1e-6)
    assert beckmann_stable(np.tan(theta) ** 2, m) == pytest.approx(beckmann(theta, m), rel=1e-11, abs=1e-300)


@pytest.mark.parametrize("theta_i", [0, 30, 60])
def test_a_full_mirror_coat_has_a_quarter_for_ks(theta_i) -> None:
    # With the papers' 1/pi in place of 1/4 pi, ks = 1/4 and F = 1 reflect nearly all the light.
    zenith, azimuth = np.meshgrid(np.arange(0.125, 90, 0.25), np.arange(0.5, 360, 1), indexing="ij")
    value = cook_torrance_2020(0, 0.25, 0.1, UP, planar(-theta_i), direction(zenith, azimuth))[..., 1]
    solid_angle = np.sin(np.radians(zenith)) * np.radians(0.25) * np.radians(1)
    radiant_exitance = np.sum(value * np.cos(np.radians(zenith)) * solid_angle)
    assert radiant_exitance / np.cos(np.radians(theta_i)) == pytest.approx(1, abs=0.03)


def test_fresnel_at_both_ends() -> None:
    assert fresnel_schlick(1, 1.5) == pytest.approx(0.04)
    assert fresnel_schlick(1, 1) == 0
    assert fresnel_schlick(0, [1.2, 1.5, 2.5]).tolist() == [1, 1, 1]


# --- arrays and errors ----------------------------------------------------------------------------------


def test_equal_roughness_makes_brdf2_brdf1() -> None:
    geometry = (UP, planar(-30), planar(20))
    kd, ks = [0.1, 0.2, 0.3], [0.3, 0.2, 0.1]
    assert cook_torrance(kd, ks, [0.2, 0.2, 0.2], *geometry).tolist() == (
        cook_torrance(kd, ks, [0.2], *geometry).tolist()
    )


def test_leading_axes_broadcast() -> None:
    patches, views = 5, 7
    kd = np.linspace(0, 1, patches * 3).reshape(patches, 1, 3)
    m = np.linspace(0.1, 0.5, patches).reshape(patches, 1, 1)
    view = planar(np.linspace(-60, 60, views))
    found = cook_torrance(kd, 0.2, m, UP, planar(-45), view)
    assert found.shape == (patches, views, 3)
    assert found[3, 4].tolist() == cook_torrance(kd[3, 0], 0.2, m[3, 0], UP, planar(-45), view[4]).tolist()


def test_channels_are_named_in_the_order_of_the_profiles() -> None:
    assert {name: " ".join(model.channels) for name, model in MODELS.items()} == {
        "brdf1": "kd.X kd.Y kd.Z ks.X ks.Y ks.Z m",
        "brdf2": "kd.X kd.Y kd.Z ks.X ks.Y ks.Z m.X m.Y m.Z",
        "cook_torrance_2020": "Rd.X Rd.Y Rd.Z ks m",
        "ward": "Rd.X Rd.Y Rd.Z ks m",
    }


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda g: cook_torrance(0.1, 0.1, [0.1, 0.2], *g), r"m has the shape \(2,\), expected a number or"),
        (lambda g: cook_torrance([1, 2], 0.1, 0.2, *g), r"kd has the shape \(2,\)"),
        (lambda g: ward(0.1, [0.1, 0.2, 0.3], 0.2, *g), r"ks has the shape \(3,\)"),
        (
            lambda g: cook_torrance(0.1, 0.1, 0.2, *g, form="stabel"),
            "unknown form 'stabel': did you mean 'stable'",
        ),
        (lambda g: ward(0.1, 0.1, 0.2, *g, form="exact"), "unknown form 'exact'"),
        (lambda g: cook_torrance(0.1, 0.1, 0.2, *g, fresnel_angle="alfa"), "did you mean 'alpha'"),
        (lambda g: evaluate("brfd1", np.ones(7), *g), "unknown model 'brfd1': did you mean 'brdf1'"),
        (lambda g: evaluate("ward", np.ones(5), *g, ambient=1), "ward has no option 'ambient'"),
        (lambda g: evaluate("brdf1", np.ones(9), *g), r"shape \(9,\), expected \(\.\.\., 7\): kd\.X"),
    ],
)
def test_wrong_calls_are_named(call, message) -> None:
    with pytest.raises(UsageError, match=message):
        call((UP, UP, UP))
