"""The fit: residuals, both solvers, recovery of known parameters, confidence intervals, errors."""

import colour
import numpy as np
import pytest
import scipy.optimize
from fit_examples import BRDF1, LIGHT, VIEW, WHITE, measured, papers_geometries, random_truths

from iccbrdf.brdf.colour_difference import XYZ_to_Lab
from iccbrdf.brdf.fit import fit
from iccbrdf.brdf.fit_diagnostics import REGIONS, regions
from iccbrdf.brdf.fit_problem import CIEDE2000_components, Problem
from iccbrdf.brdf.geometry import planar
from iccbrdf.brdf.models import MODELS
from iccbrdf.errors import InputError, UsageError

COVERED = 179, 198
"""Of 200 intervals of 95 %: the range that counts as right."""


def noisy(parameters, count, model="brdf1", scatter=0.02, seed=1):
    """Measurements of one patch, made many times over, with errors of geometry and of channel."""
    rng = np.random.default_rng(seed)
    XYZ = measured(parameters, model=model)
    errors = rng.normal(0, scatter, (count, len(XYZ), 1)) + rng.normal(0, scatter / 2, (count, *XYZ.shape))
    return XYZ * np.exp(errors)


def problem(XYZ, objective="rms CIEDE2000", model="brdf1", refractive_index=1.5, as_published=False):
    return Problem(MODELS[model], XYZ, LIGHT, VIEW, WHITE, objective, refractive_index, as_published)


# Residuals


@pytest.mark.parametrize("scatter", [1e-3, 0.1, 3, 50])
def test_components_are_CIEDE2000(scatter):
    rng = np.random.default_rng(0)
    Lab_1 = rng.uniform([0, -100, -100], [100, 100, 100], (20000, 3))
    Lab_2 = Lab_1 + rng.normal(0, scatter, Lab_1.shape)
    expected = colour.difference.delta_E_CIE2000(Lab_1, Lab_2)
    np.testing.assert_allclose(
        np.linalg.norm(CIEDE2000_components(Lab_1, Lab_2), axis=-1), expected, rtol=0, atol=1e-10
    )


def test_components_of_greys_and_of_equal_colours():
    rng = np.random.default_rng(0)
    greys = rng.uniform(0, 100, (1000, 3)) * [1, 1e-4, 1e-4]
    expected = colour.difference.delta_E_CIE2000(greys, greys[::-1])
    found = np.linalg.norm(CIEDE2000_components(greys, greys[::-1]), axis=-1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)
    assert not CIEDE2000_components([50, 0, 0], [50, 0, 0]).any()
    assert not CIEDE2000_components(greys, greys).any()


@pytest.mark.parametrize("objective", ["rms CIEDE2000", "rms XYZ"])
@pytest.mark.parametrize("model", MODELS)
def test_derivatives_are_those_of_central_differences(model, objective):
    truths = random_truths(model, 3, np.random.default_rng(2))
    set_up = problem(measured(truths, model=model) * 1.1, objective, model)
    logs, patches = np.log(truths), np.arange(3)
    residuals, derivatives = set_up.linearise(logs, patches)
    np.testing.assert_array_equal(residuals, set_up.residuals(set_up.predict(truths), patches))
    step = 1e-5
    for k in range(logs.shape[1]):
        moved = np.eye(logs.shape[1])[k] * step
        ahead, behind = (
            set_up.residuals(set_up.predict(np.exp(logs + sign * moved)), patches) for sign in (1, -1)
        )
        numeric = (ahead - behind) / (2 * step)
        np.testing.assert_allclose(derivatives[..., k], numeric, rtol=0, atol=1e-4 * np.abs(numeric).max())


# Recovery of known parameters


@pytest.mark.parametrize("model", MODELS)
def test_noise_free_data_give_their_parameters_back(model):
    truths = random_truths(model, 100, np.random.default_rng(5))
    result = fit(measured(truths, model=model), LIGHT, VIEW, WHITE, model=model)
    np.testing.assert_allclose(result.parameters, truths, rtol=1e-6)


@pytest.mark.parametrize("objective", ["mean CIEDE2000", "rms XYZ"])
def test_by_every_objective(objective):
    truths = random_truths("brdf1", 20, np.random.default_rng(6))
    result = fit(measured(truths), LIGHT, VIEW, WHITE, objective=objective)
    np.testing.assert_allclose(result.parameters, truths, rtol=1e-6)


def test_refractive_index_is_fitted():
    truths = random_truths("brdf1", 10, np.random.default_rng(7))
    result = fit(
        measured(truths, refractive_index=1.7), LIGHT, VIEW, WHITE, refractive_index="free", starts=4
    )
    assert result.names[-1] == "refractive_index"
    np.testing.assert_allclose(result.refractive_index, 1.7, rtol=1e-6)
    np.testing.assert_allclose(result.parameters, truths, rtol=1e-6)


def test_as_published_compares_I_with_the_reflectance():
    # As published the model's value is pi times the BRDF times cos theta_i.
    radiance = measured([BRDF1]) * LIGHT[:, 2:]
    result = fit(radiance, LIGHT, VIEW, WHITE, as_published=True)
    np.testing.assert_allclose(result.parameters, [BRDF1], rtol=1e-6)
    assert fit(radiance, LIGHT, VIEW, WHITE).value > 1


def test_missing_readings_have_no_weight():
    XYZ = noisy(BRDF1, 3)
    some = np.random.default_rng(0).random((3, len(LIGHT))) < 0.2
    holes = XYZ.copy()
    holes[some, 1] = np.nan
    result = fit(holes, LIGHT, VIEW, WHITE)
    for p in range(3):
        rows = ~some[p]
        alone = fit(XYZ[[p]][:, rows], LIGHT[rows], VIEW[rows], WHITE)
        np.testing.assert_allclose(result.parameters[p], alone.parameters[0], rtol=1e-6)
        np.testing.assert_allclose(result.intervals[p], alone.intervals[0], rtol=1e-4)
        assert result.geometries[p] == rows.sum()


def test_vectors_of_any_length():
    XYZ = measured([BRDF1])
    np.testing.assert_allclose(fit(XYZ, 3 * LIGHT, VIEW / 7, WHITE).parameters, [BRDF1], rtol=1e-6)


# Solvers


def test_least_squares_finds_what_scipy_finds():
    XYZ = noisy(BRDF1, 1, scatter=0.05)
    set_up, patch = problem(XYZ), np.array([0])

    def residuals(logs):
        Lab = XYZ_to_Lab(set_up.predict(np.exp(logs)), WHITE)
        return colour.difference.delta_E_CIE2000(Lab, XYZ_to_Lab(XYZ[0], WHITE))

    result = fit(XYZ, LIGHT, VIEW, WHITE)
    found = scipy.optimize.minimize(lambda x: np.mean(residuals(x) ** 2), np.log(BRDF1), method="BFGS")
    np.testing.assert_allclose(result.parameters[0], np.exp(found.x), rtol=1e-4)
    np.testing.assert_allclose(result.value, np.sqrt(found.fun), rtol=1e-8)
    np.testing.assert_allclose(result.value, set_up.values(set_up.residuals(
        set_up.predict(result.parameters), patch), patch), rtol=1e-12)  # fmt: skip


@pytest.mark.parametrize("objective", ["rms CIEDE2000", "mean CIEDE2000", "rms XYZ"])
def test_both_solvers_agree(objective):
    XYZ = noisy(BRDF1, 1, scatter=0.05)
    options = {"objective": objective, "starts": 1}
    fast = fit(XYZ, LIGHT, VIEW, WHITE, **options)
    slow = fit(XYZ, LIGHT, VIEW, WHITE, solver="nelder_mead", **options)
    assert fast.value <= slow.value * (1 + 1e-5)
    np.testing.assert_allclose(fast.value, slow.value, rtol=1e-4)
    np.testing.assert_allclose(fast.parameters, slow.parameters, rtol=2e-2)


def test_each_objective_is_best_by_its_own_measure():
    XYZ = noisy(BRDF1, 5, scatter=0.1)
    patches = np.arange(5)
    objectives = ("rms CIEDE2000", "mean CIEDE2000", "rms XYZ")
    results = {name: fit(XYZ, LIGHT, VIEW, WHITE, objective=name) for name in objectives}
    for name in objectives:
        set_up = problem(XYZ, name)
        values = {
            other: set_up.values(set_up.residuals(set_up.predict(result.parameters), patches), patches)
            for other, result in results.items()
        }
        np.testing.assert_allclose(values[name], results[name].value, rtol=1e-12)
        for other in set(objectives) - {name}:
            assert np.all(values[name] < values[other])


def test_share_of_starts_that_reach_the_best():
    # From a lobe far too narrow to be seen, and with hardly any of it, there is no way to the lobe.
    lost = [0.5, 0.4, 0.1, 1e-4, 1e-4, 1e-4, 0.004]
    result = fit(measured([BRDF1]), LIGHT, VIEW, WHITE, starts=[BRDF1, lost, lost, [*BRDF1[:6], 0.25]])
    assert result.agreement.tolist() == [0.5]
    np.testing.assert_allclose(result.parameters, [BRDF1], rtol=1e-6)


# Confidence intervals and differences


@pytest.mark.parametrize(
    ("model", "truth", "objective"),
    [
        ("brdf1", BRDF1, "rms CIEDE2000"),
        ("ward", [0.5, 0.4, 0.1, 0.2, 0.2], "mean CIEDE2000"),
    ],
)
def test_intervals_cover_the_truth(model, truth, objective):
    XYZ = noisy(truth, 200, model)
    result = fit(XYZ, LIGHT, VIEW, WHITE, model=model, objective=objective, starts=1)
    covered = np.sum((result.intervals[..., 0] <= truth) & (truth <= result.intervals[..., 1]), axis=0)
    assert np.all((covered >= COVERED[0]) & (covered <= COVERED[1])), covered


def test_interval_of_a_parameter_at_a_bound_is_not_a_number():
    result = fit(measured([[1e-7, *BRDF1[1:]]]), LIGHT, VIEW, WHITE)
    assert np.isnan(result.intervals[0, 0]).all()
    assert np.isfinite(result.intervals[0, 1:]).all()


def test_regions_of_the_papers():
    light, view = papers_geometries()
    assert len(light) == 68
    region = regions(light, view)
    # Within 15 degrees of -15: 5, as the lamp hides 0; of -30 and -45: 6; of -60: 4, as -65 is the last.
    assert np.bincount(region).tolist() == [43, 5 + 6 + 6 + 4, 4]
    # theta_i = 60: the mirror direction is -60, and -65 to -45 lie within 15 degrees of it.
    assert region[-20:].tolist() == [1, 2, 1, 1, 1] + [0] * 15


def test_differences_by_region():
    XYZ = noisy(BRDF1, 2)
    result = fit(XYZ, LIGHT, VIEW, WHITE)
    Lab = [XYZ_to_Lab(each, WHITE) for each in (XYZ, measured(result.parameters))]
    difference = colour.difference.delta_E_CIE2000(*Lab)
    for k in range(len(REGIONS)):
        inside = difference[:, regions(LIGHT, VIEW) == k]
        np.testing.assert_allclose(result.mean_difference[:, k], inside.mean(axis=1), rtol=1e-9)
        np.testing.assert_allclose(result.max_difference[:, k], inside.max(axis=1), rtol=1e-9)
    rms = np.sqrt(np.mean(difference**2, axis=1))
    np.testing.assert_allclose(result.lack_of_fit, rms, rtol=1e-9)
    less = fit(XYZ, LIGHT, VIEW, WHITE, repeat_scatter=0.5).lack_of_fit
    np.testing.assert_allclose(less, np.sqrt(rms**2 - 0.25), rtol=1e-9)


# Errors


def refused(error=UsageError, XYZ=None, light=LIGHT, view=VIEW, white=WHITE, **options):
    with pytest.raises(error) as caught:
        fit(measured([BRDF1]) if XYZ is None else XYZ, light, view, white, **options)
    return str(caught.value)


def test_names_that_do_not_exist():
    assert "did you mean 'ward'" in refused(model="wart")
    assert "did you mean 'rms CIEDE2000'" in refused(objective="rms CIEDE200")
    assert "did you mean 'nelder_mead'" in refused(solver="nelder-mead")
    assert "ward has no refractive index" in refused(model="ward", refractive_index="free")
    for index in (0.9, np.inf, np.nan):
        assert "expected a finite number from 1" in refused(refractive_index=index)


def test_arrays_that_do_not_go_together():
    assert "expected (patches, 68, 3)" in refused(XYZ=measured(BRDF1))
    assert "expected (g, 3)" in refused(view=VIEW[1:])
    assert "three numbers above 0" in refused(white=[1, 1, 0])
    assert "expected (s, 7)" in refused(starts=[[1, 2, 3]])
    assert "not above 0" in refused(starts=[[0, *BRDF1[1:]]])
    assert "at least 1" in refused(starts=0)


def test_light_and_viewer_stand_above_the_surface():
    light = LIGHT.copy()
    light[3] = planar(90)
    assert refused(light=light) == "light 3 is [1.0, 0.0, 0.0], expected above the surface"


def test_more_geometries_than_parameters():
    XYZ = np.repeat(measured([BRDF1]), 2, axis=0)
    XYZ[1, 7:] = np.nan
    message = refused(InputError, XYZ=XYZ, patches=["White", "Cyan"])
    assert message == (
        "patch Cyan was measured in 7 geometries, expected more than the 7 parameters of the fit"
    )
