"""Patches measured and computed: regions, differences, specular errors, chromaticities."""

import colour
import numpy as np
import pytest
from report_examples import patches

from iccbrdf.report.appearance import Appearance, largest, mean, predict, rms

THETA_I, THETA_R = [15, 15, 15, 60, 60], [-15, -25, -45, -60, 0]
"""Specular, near-specular, diffuse; specular, diffuse."""


def random_XYZ(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.05, 0.9, (2, 5, 3))


@pytest.fixture
def appearance() -> Appearance:
    measured = random_XYZ(1)
    measured[1, 3] = np.nan
    return Appearance(patches(measured, THETA_I, THETA_R), {"model": random_XYZ(2), "other": random_XYZ(3)})


def ciede2000(XYZ_1: np.ndarray, XYZ_2: np.ndarray) -> np.ndarray:
    white = np.array([0.9642, 1.0, 0.8249])
    xy = white[:2] / white.sum()
    return colour.delta_E(*(colour.XYZ_to_Lab(XYZ, xy) for XYZ in (XYZ_1, XYZ_2)), method="CIE 2000")


def test_differences_against_colour_science(appearance):
    expected = ciede2000(random_XYZ(2), random_XYZ(1))
    expected[1, 3] = np.nan
    np.testing.assert_allclose(appearance.differences("model"), expected, rtol=1e-9)
    between = ciede2000(random_XYZ(2), random_XYZ(3))
    between[1, 3] = np.nan
    np.testing.assert_allclose(appearance.differences("model", "other"), between, rtol=1e-9)


def test_regions(appearance):
    d = ciede2000(random_XYZ(2), random_XYZ(1))
    means, maxima = appearance.by_region("model")
    specular = [d[0, 0], d[1, 0], d[0, 3]]
    np.testing.assert_allclose(means, [d[:, [2, 4]].mean(), d[:, 1].mean(), np.mean(specular)], rtol=1e-9)
    np.testing.assert_allclose(maxima, [d[:, [2, 4]].max(), d[:, 1].max(), max(specular)], rtol=1e-9)


def test_specular_errors(appearance):
    assert appearance.mirror_angles.tolist() == [15, 60]
    expected = (random_XYZ(2) - random_XYZ(1))[:, [0, 3], 1]
    expected[1, 1] = np.nan
    np.testing.assert_allclose(appearance.specular_errors("model"), expected)


def test_chromaticity(appearance):
    x, y = np.moveaxis(random_XYZ(1)[..., :2] / random_XYZ(1).sum(axis=-1, keepdims=True), -1, 0)
    expected = [[(x[p, 2] + x[p, 4]) / 2, (y[p, 2] + y[p, 4]) / 2] for p in (0, 1)]
    np.testing.assert_allclose(appearance.chromaticity("measured", "diffuse"), expected)
    np.testing.assert_allclose(appearance.chromaticity("measured", "specular")[1], [x[1, 0], y[1, 0]])


def test_select_keeps_sources_together(appearance):
    one = appearance.select([1])
    assert one.measurements.patches == ("patch 1",)
    np.testing.assert_array_equal(one.XYZ("other"), random_XYZ(3)[[1]])


def test_prediction_of_a_diffuser():
    geometries = patches(random_XYZ(1), THETA_I, THETA_R)
    kd = [0.5, 0.4, 0.3]
    parameters = np.array([[*kd, 0, 0, 0, 0.2]])
    XYZ = predict("brdf1", parameters, geometries, as_published=False)
    np.testing.assert_allclose(XYZ, np.broadcast_to(kd, (1, 5, 3)))
    XYZ = predict("brdf1", parameters, geometries, as_published=True)
    np.testing.assert_allclose(XYZ[0], np.cos(np.radians(THETA_I))[:, np.newaxis] * [kd])


def test_prediction_of_a_mirror_direction():
    geometries = patches(random_XYZ(1), THETA_I, THETA_R)
    XYZ = predict("ward", np.array([[0.9, 1, 0.8, 0.16, 0.2]]), geometries, as_published=False)
    # pi ks / (4 pi m^2 cos theta), theta_h = 0.
    gloss = 0.16 / (4 * 0.2**2) / np.cos(np.radians(60))
    np.testing.assert_allclose(XYZ[0, 3], [0.9 + gloss, 1 + gloss, 0.8 + gloss])


def test_figures_of_what_is_known():
    values = np.array([3.0, np.nan, -4.0])
    assert (mean(values), largest(values)) == (-0.5, 3.0)
    assert rms(values) == pytest.approx(np.sqrt(12.5))
    nothing = np.full(2, np.nan)
    assert np.isnan([mean(nothing), largest(nothing), rms(nothing)]).all()
