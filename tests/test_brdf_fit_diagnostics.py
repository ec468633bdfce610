"""What tells a fit that must not be trusted: an example for every check, and good fits that pass them all."""

import numpy as np
import pytest
from fit_examples import BRDF1, LIGHT, VIEW, WHITE, measured, papers_geometries

from iccbrdf.brdf.fit import fit
from iccbrdf.brdf.fit_diagnostics import CHECKS, half_width, hemispherical_albedo
from iccbrdf.brdf.geometry import direction, planar, unit
from iccbrdf.brdf.models import MODELS, evaluate


def flags(XYZ, light=LIGHT, view=VIEW, **options):
    """Names of the checks that one patch fails."""
    return {flag.check.name for flag in fit(XYZ[np.newaxis], light, view, WHITE, **options).flags[0]}


def finding(name, XYZ, light=LIGHT, view=VIEW):
    result = fit(XYZ[np.newaxis], light, view, WHITE)
    return next(found for found in result.findings[0] if found.check.name == name)


def grey_lobe(ks, m):
    return measured([0, 0, 0, ks, ks, ks, m])


@pytest.mark.parametrize("model", MODELS)
def test_good_fits_are_not_flagged(model):
    rng = np.random.default_rng(3)
    (_, _), (_, ks), (_, m) = MODELS[model].parameters
    truth = [0.5, 0.4, 0.1, *[0.1] * ks, *[0.2] * m]
    XYZ = measured(truth, model=model) * np.exp(rng.normal(0, 0.03, (50, len(LIGHT), 1)))
    result = fit(XYZ, LIGHT, VIEW, WHITE, model=model)
    assert not any(result.flags)
    assert [found.check for found in result.findings[0]] == list(CHECKS)


@pytest.mark.parametrize("m", [0.02, 0.03, 0.05])
def test_lobe_narrower_than_the_sampling(m):
    # 5 degrees of the viewer: half a step is 2.5, and a lobe of m = .05 has a half width of 2.4.
    assert flags(measured([*BRDF1[:6], m])) == {"narrow lobe", "too few geometries"}
    assert finding("narrow lobe", measured([*BRDF1[:6], m])).value == pytest.approx(half_width(m) / 2.5)


def test_lobe_as_wide_as_the_sampling():
    assert not flags(measured([*BRDF1[:6], 0.055]))


@pytest.mark.parametrize("noise", [0, 0.003, 0.01])
def test_no_lobe(noise):
    rng = np.random.default_rng(0)
    XYZ = np.array([0.5, 0.4, 0.1]) * np.exp(rng.normal(0, noise, (10, len(LIGHT), 1)))
    result = fit(XYZ, LIGHT, VIEW, WHITE)
    for found, raised in zip(result.findings, result.flags, strict=True):
        assert "no lobe" in {flag.check.name for flag in raised}
        assert {each.value for each in found if each.check.name == "narrow lobe"} == {None}


def test_parameter_at_a_bound():
    result = fit(measured([[1e-7, *BRDF1[1:]]]), LIGHT, VIEW, WHITE)
    (flag,) = result.flags[0]
    assert str(flag) == "at a bound: 1, expected at most 0 (kd.X)"


def test_energy_above_1():
    assert flags(measured([0.95, 1.0, 0.8, 1.0, 1.0, 0.8, 0.2])) == {"energy above 1"}
    assert not flags(measured([0.85, 0.9, 0.7, 0.2, 0.2, 0.2, 0.2]))


def test_one_angle_of_incidence():
    light, view = papers_geometries(incidences=(30,))
    assert flags(measured(BRDF1, light, view), light, view) == {"too few geometries"}


def test_nothing_near_the_mirror_direction():
    away = np.sum(LIGHT * [-1, -1, 1] * VIEW, axis=-1) < np.cos(np.radians(20))
    light, view = LIGHT[away], VIEW[away]
    assert finding("too few geometries", measured(BRDF1, light, view), light, view).value == 0


def test_two_lobes():
    dark = measured([0.01, 0.01, 0.01, 0.5, 0.5, 0.5, 0.06])
    assert {"misfit", "misfit of some", "shape of the lobe"} <= flags(dark + grey_lobe(0.3, 0.25))


def test_tail_that_is_no_lobe():
    half = unit(LIGHT + VIEW)
    theta_h = np.degrees(np.arccos(half[:, 2]))
    dark = measured([0.01, 0.01, 0.01, 0.2, 0.2, 0.2, 0.2])
    wave = np.where(theta_h > 25, (-1) ** np.floor(theta_h / 5 + 1e-6), 0)
    assert "shape of the tail" in flags(dark * 10 ** (0.4 * wave)[:, np.newaxis])


def test_flakes_that_shift_the_hue():
    turn = np.arctan2(VIEW[:, 0], VIEW[:, 2])
    mixed = [0.3 + 0.2 * np.sin(2 * turn), 0.3 - 0.05 * np.sin(2 * turn), 0.2 + 0.15 * np.cos(3 * turn)]
    assert "shift of hue" in flags(np.stack(mixed, axis=-1) + grey_lobe(0.2, 0.2))


def test_retro_reflection():
    light, view = papers_geometries(lamp_exclusion=4)
    XYZ = measured(BRDF1, light, view)
    from_lamp = np.degrees(np.arccos(np.clip(np.sum(light * view, axis=-1), -1, 1)))
    assert flags(XYZ * (1 + 4 * np.exp(-((from_lamp / 10) ** 2)))[:, np.newaxis], light, view) == {
        "retro-reflection"
    }
    assert not flags(XYZ, light, view)


def test_retro_reflection_is_not_tested_without_readings_at_the_lamp():
    found = finding("retro-reflection", measured(BRDF1))
    assert (found.value, found.flagged, str(found)) == (None, False, "retro-reflection: not tested")


def test_disagreeing_starts_count_beside_another_flag_only():
    lost = [0.5, 0.4, 0.1, 1e-4, 1e-4, 1e-4, 0.004]
    starts = [lost, lost, BRDF1]
    assert not flags(measured(BRDF1), starts=starts)
    assert flags(measured([1e-7, *BRDF1[1:]]), starts=starts) == {"at a bound", "disagreeing starts"}


def test_half_width():
    # exp(-tan^2 / m^2) = 1/2, by hand for tan = .2: m^2 = .04 / ln 2.
    assert half_width(np.sqrt(0.04 / np.log(2))) == pytest.approx(np.degrees(np.arctan(0.2)))


@pytest.mark.parametrize(
    ("model", "parameters"),
    [
        ("brdf1", [0.5, 0.4, 0.1, 0.3, 0.2, 0.1, 0.3]),
        ("brdf2", [0.5, 0.4, 0.1, 0.3, 0.2, 0.1, 0.3, 0.2, 0.4]),
        ("cook_torrance_2020", [0.5, 0.4, 0.1, 0.2, 0.3]),
        ("ward", [0.5, 0.4, 0.1, 0.3, 0.25]),
    ],
)
def test_albedo_is_the_integral_over_the_hemisphere(model, parameters):
    zenith, azimuth = (np.arange(225) + 0.5) * 0.4, np.arange(360) + 0.5
    view = direction(zenith[:, np.newaxis], azimuth)
    solid_angle = np.radians(0.4) * np.radians(1) * np.sin(np.radians(zenith))[:, np.newaxis]
    for theta_i in (0, 30, 60):
        light = planar(-theta_i)
        factor = evaluate(
            model, parameters, planar(0), light, view, intensity=MODELS[model].intensity / light[2]
        )
        expected = np.sum(factor / np.pi * (view[..., 2] * solid_angle)[..., np.newaxis], axis=(0, 1))
        found = hemispherical_albedo(model, [parameters], [theta_i])[0, 0]
        np.testing.assert_allclose(found, expected, atol=2e-3)


def test_full_dielectric_coat_reflects_its_fresnel_share():
    # With 1/pi instead of 1/(4 pi) a mirror's ks is .25, and R0 of n = 1.5 is .04.
    albedo = hemispherical_albedo("brdf1", [[0, 0, 0, 0.25, 0.25, 0.25, 0.01]], [0.0])
    np.testing.assert_allclose(albedo, 0.04, rtol=1e-3)
