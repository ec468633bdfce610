"""The synthetic print and goniometer: physics of the truth, geometries, FOGRA39 colours, seeds."""

import numpy as np
import pytest

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import cosines, direction, planar
from iccbrdf.errors import UsageError
from iccbrdf.measure import fogra39, read_measurements
from iccbrdf.measure.colorimetry import weights
from iccbrdf.measure.goniometer import Sensor, goniometer_angles
from iccbrdf.measure.reflection import fresnel, ggx_facets, oren_nayar
from iccbrdf.measure.simulation import PRIMARIES, SLOPES, TESTS, simulate
from iccbrdf.measure.smooth_spectra import smoothest_spectra
from iccbrdf.measure.synthetic_print import (
    WAVELENGTHS,
    Film,
    SyntheticPrint,
    demichel,
    dot_areas,
    draw_behaviour,
)

NO_ERRORS = {"sensor": Sensor(noise=0, aperture=0), "scatter": 0.0}
FIGURES = {**{name: fogra39.SOLIDS[inks] for name, inks in PRIMARIES.items()},
           **{name: fogra39.TEST_PATCHES[inks] for name, inks in TESTS.items()}}  # fmt: skip
NODES, NODE_WEIGHTS = np.polynomial.legendre.leggauss(64)


@pytest.fixture(scope="module")
def truth() -> SyntheticPrint:
    return SyntheticPrint(draw_behaviour(np.random.default_rng(5)))


def reflectance(truth, light, view, cmyk=((0, 0, 0, 0), (40, 20, 0, 10), (0, 0, 0, 100)), slope=0.0):
    cmyk = np.array(cmyk, dtype=float)
    ones = np.ones(len(cmyk))
    return truth.reflectance(cmyk, slope * ones, np.atleast_2d(light), np.atleast_2d(view), Film(ones, ones))


def hemisphere() -> tuple[np.ndarray, np.ndarray]:
    """Directions over the hemisphere and the projected solid angle of each, sum pi."""
    # sin^2 as the variable spreads the projected solid angle evenly.
    zenith = np.degrees(np.arcsin(np.sqrt((NODES + 1) / 2)))
    azimuths = np.arange(0, 360, 2.0)
    views = direction(zenith[:, np.newaxis], azimuths)
    share = np.broadcast_to(NODE_WEIGHTS[:, np.newaxis] * np.pi / 2 / len(azimuths), views.shape[:2])
    return views.reshape(-1, 3), share.ravel()


def at_45_0(measurements):
    where = (measurements.theta_i == 45) & (measurements.theta_r == 0)
    assert where.sum() == 1
    return dict(zip(measurements.keys, measurements.XYZ[:, where][:, 0], strict=True))


# --- the terms


def test_fresnel_of_glass():
    n = 1.5
    assert fresnel(1.0, n) == pytest.approx(0.04)
    assert fresnel(0.0, n) == pytest.approx(1.0)
    # Snell and the two polarisations, as in any textbook.
    for degrees in (20, 45, 56.3099, 80):
        theta = np.radians(degrees)
        inside = np.arcsin(np.sin(theta) / n)
        s = (np.sin(theta - inside) / np.sin(theta + inside)) ** 2
        p = (np.tan(theta - inside) / np.tan(theta + inside)) ** 2
        assert fresnel(np.cos(theta), n) == pytest.approx((s + p) / 2, rel=1e-9)


@pytest.mark.parametrize("alpha", [0.3, 0.6])
def test_distribution_of_facets_is_normalised(alpha):
    # D cos theta_h over the hemisphere is 1.  Where light and viewer are both the half vector, what is given
    # is D / (1 + 2 lambda) / (4 cos^2), which this takes back.
    half, share = hemisphere()
    cosine = cosines(planar(0), half, half)
    tan2 = 1 / cosine.theta_h**2 - 1
    shadowing = 1 / np.sqrt(1 + alpha**2 * tan2)
    D = ggx_facets(cosine, tan2, alpha) * 4 * cosine.theta_i**2 / shadowing
    assert np.sum(D * share) == pytest.approx(1, abs=2e-3)


def test_rough_base():
    view = planar([-60.0, 0.0, 60.0])
    light = np.broadcast_to(planar(-60), view.shape)
    cosine = cosines(planar(0), light, view)
    towards = np.sum(light * view, axis=1)
    assert oren_nayar(cosine, towards, 0.0).tolist() == [1, 1, 1]
    # Brighter towards the lamp than away from it: A + B sin alpha tan beta, and A.
    rough = oren_nayar(cosine, towards, 0.3)
    A = 1 - 0.5 * 0.09 / 0.42
    B = 0.45 * 0.09 / 0.18
    expected = [A + B * np.sin(np.radians(60)) * np.tan(np.radians(60)), A, A]
    np.testing.assert_allclose(rough, expected, rtol=1e-12)


def test_reciprocity(truth):
    random = np.random.default_rng(0)
    light, view = direction(random.uniform(0, 80, (2, 50)), random.uniform(0, 360, (2, 50)))
    for slope in (0, 45):
        there, back = (
            reflectance(truth, light, view, slope=slope),
            reflectance(truth, view, light, slope=slope),
        )
        np.testing.assert_allclose(there, back, rtol=1e-9)


@pytest.mark.parametrize("theta_i", [0, 45, 75])
def test_energy(truth, theta_i):
    view, share = hemisphere()
    light = np.broadcast_to(planar(-theta_i), view.shape)
    albedo = np.einsum("pgw,g->pw", reflectance(truth, light, view), share) / np.pi
    assert albedo.max() < 1
    assert albedo[0].min() > 0.7  # paper
    assert albedo[2].max() < fresnel(np.cos(np.radians(theta_i)), 1.5) + 0.05  # black: little but the surface


def test_truth_is_none_of_the_fitted_models(truth):
    # Their diffuse part is constant.  Far from the mirror direction, the truth's falls as the viewer sinks.
    view = planar([-45.0, 0.0, 75.0])
    seen = reflectance(truth, np.broadcast_to(planar(-40), view.shape), view, cmyk=[(0, 0, 0, 0)])[0, :, 15]
    assert seen[0] > 1.02 * seen[1]


# --- colours


def test_demichel():
    areas = demichel(np.array([0.5, 0.2, 0.0, 0.1]))
    inks = list(fogra39.SOLIDS)
    assert areas.sum() == pytest.approx(1)
    assert areas[inks.index((0, 0, 0, 0))] == pytest.approx(0.5 * 0.8 * 0.9)
    assert areas[inks.index((100, 100, 0, 0))] == pytest.approx(0.5 * 0.2 * 0.9)
    assert areas[inks.index((0, 0, 100, 0))] == 0
    assert demichel(np.array([0.0, 1, 0, 0]))[inks.index((0, 100, 0, 0))] == 1


def test_dot_gain():
    areas = dot_areas(np.array([0.0, 0.5, 0.9, 1.0]), np.array([0.2] * 4))
    np.testing.assert_allclose(areas, [0, 0.7, 0.972, 1], rtol=1e-12)


def test_smoothest_spectra():
    to_XYZ = weights(WAVELENGTHS, "D50", "CIE 1931 2 Degree Standard Observer")
    figures = np.array(list(fogra39.SOLIDS.values())) / 100
    spectra = smoothest_spectra(figures, to_XYZ)
    np.testing.assert_allclose(spectra @ to_XYZ, figures, atol=1e-11)
    assert (spectra.min() > 0) & (spectra.max() < 1)
    # A grey is constant, and any other spectrum of the same XYZ is rougher.
    np.testing.assert_allclose(smoothest_spectra([0.3 * to_XYZ.sum(axis=0)], to_XYZ), 0.3, atol=1e-9)

    def roughness(spectrum):
        return np.sum(np.diff(np.arctanh(2 * spectrum - 1)) ** 2)

    unseen = np.linalg.svd(to_XYZ.T)[2][3:]
    for change in np.random.default_rng(0).normal(0, 1e-4, (20, len(unseen))) @ unseen:
        assert roughness(spectra[1] + change) > roughness(spectra[1])


@pytest.mark.parametrize("XYZ", [(0.9, 0.1, 0.1), (1.2, 1.3, 1.0), (-0.01, 0.01, 0.01)])
def test_colours_that_no_surface_has(XYZ):
    to_XYZ = weights(WAVELENGTHS, "D50", "CIE 1931 2 Degree Standard Observer")
    with pytest.raises(UsageError, match="no reflectance spectrum found for the XYZ"):
        smoothest_spectra([XYZ], to_XYZ)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_FOGRA39_at_45_0(seed):
    simulation = simulate(seed, **NO_ERRORS)
    measured = {**at_45_0(simulation.primaries), **at_45_0(simulation.tests)}
    white = simulation.primaries.white
    dE = {
        name: float(delta_E_CIE2000(*(XYZ_to_Lab(XYZ, white) for XYZ in (measured[name, 0], figures))))
        for name, figures in ((name, np.array(figures) / 100) for name, figures in FIGURES.items())
    }
    # The solids are made to measure; halftones follow from Demichel's areas and the dot gain.
    assert max(dE[name] for name in PRIMARIES) < 0.02
    assert np.mean([dE[name] for name in TESTS]) < 2
    assert max(dE.values()) < 4


def test_shipped_figures_are_those_of_FOGRA39(shared_data):
    table = read_measurements(
        shared_data / "print" / "FOGRA39L.ti3",
        geometry="45:0",
        quantity="reflectance",
        scale=1,
        illuminant=fogra39.ILLUMINANT,
        observer=fogra39.OBSERVER,
    )
    published = dict(zip(map(tuple, table.cmyk.astype(int).tolist()), table.XYZ[:, 0].tolist(), strict=True))
    for inks, XYZ in {**fogra39.SOLIDS, **fogra39.TEST_PATCHES}.items():
        assert published[inks] == list(XYZ)
    # Murray-Davies of each ink, on the component that it absorbs.
    for k, (axis, tone) in enumerate(((0, 55), (1, 55), (2, 55), (1, 40))):
        paper, solid, tint = (
            published[tuple(amount * (ink == k) for ink in range(4))][axis] for amount in (0, 100, tone)
        )
        a = tone / 100
        gain = ((paper - tint) / (paper - solid) - a) / (4 * a * (1 - a))
        assert fogra39.TONE_VALUE_INCREASE[k] == pytest.approx(gain, abs=5e-4)


def test_slopes_darken_white_lighten_black_and_roughen(truth):
    simulation = simulate(0, **NO_ERRORS)
    W, B = simulation.colours.W, simulation.colours.B
    assert np.all(np.diff(W, axis=0) < 0)
    assert np.all(np.diff(B, axis=0) > 0)
    mirror = (planar(-45), planar(45))
    assert np.all(reflectance(truth, *mirror, slope=60) < reflectance(truth, *mirror))


# --- the goniometer


@pytest.mark.parametrize(("exclusion", "count"), [(15, 68), (20, 65)])
def test_geometries_of_the_papers(exclusion, count):
    theta_i, theta_r = goniometer_angles(exclusion)
    oblique = theta_i > 0
    assert int(oblique.sum()) == count
    assert int((oblique & (theta_r == -theta_i)).sum()) == 4
    assert (theta_r.min(), theta_r.max()) == (-65, 30)
    assert np.unique(theta_i).tolist() == [0, 15, 30, 45, 60]
    assert np.abs(theta_r - theta_i).min() > exclusion


def test_aperture_averages_over_a_cone(truth):
    # Against a dense average over the same disc of directions around the mirror direction at 30 degrees.
    sharp, blurred = (
        simulate(0, sensor=Sensor(noise=0, aperture=aperture), scatter=0).primaries for aperture in (0, 2)
    )
    where = int(np.flatnonzero((sharp.theta_i == 30) & (sharp.theta_r == -30))[0])
    print_ = SyntheticPrint(draw_behaviour(np.random.default_rng(0).spawn(3)[0]))
    radii = 2 * np.sqrt((np.arange(40) + 0.5) / 40)
    around = direction(radii[:, np.newaxis], np.arange(0, 360, 9.0)).reshape(-1, 3)
    sin, cos = 0.5, np.sqrt(0.75)
    turn = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    view = around @ turn.T
    np.testing.assert_allclose(view.mean(axis=0), planar(30), atol=2e-3)
    dense = reflectance(print_, np.broadcast_to(planar(-30), view.shape), view, cmyk=[(0, 0, 0, 100)])
    k = sharp.patches.index("K")
    np.testing.assert_allclose(blurred.spectra[k, where], dense[0].mean(axis=0), rtol=5e-3)
    assert np.all(blurred.spectra[k, where] < 0.95 * sharp.spectra[k, where])


def test_noise_has_the_size_that_is_asked_for():
    clean, noisy = (
        simulate(0, sensor=Sensor(noise=noise)).slopes.select(patches=np.arange(0, 96, 24))
        for noise in (0, 0.02)
    )
    deviation = noisy.spectra / clean.spectra - 1
    common = deviation.mean(axis=2)
    assert common.std() == pytest.approx(0.02, rel=0.15)
    assert (deviation - common[..., np.newaxis]).std() == pytest.approx(0.01, rel=0.1)


def test_seeds():
    first, again, other = simulate(3), simulate(3), simulate(4)
    assert np.array_equal(first.slopes.spectra, again.slopes.spectra)
    assert first.colours == again.colours
    assert not np.array_equal(first.behaviour.alpha, other.behaviour.alpha)
    # The noise does not change the print.
    quiet = simulate(3, sensor=Sensor(noise=0))
    assert np.array_equal(quiet.behaviour.alpha, first.behaviour.alpha)
    ratio = first.primaries.XYZ / quiet.primaries.XYZ
    assert 0 < np.abs(ratio - 1).max() < 0.1


def test_what_is_measured():
    simulation = simulate(0)
    assert simulation.primaries.patches == ("White", "C", "M", "Y", "CM", "CY", "MY", "CMY", "K")
    assert len(simulation.tests.patches) == 15
    assert int((simulation.tests.cmyk[:, 3] == 0).sum()) == 9
    assert len(simulation.slopes.patches) == 24 * 4
    assert np.unique(simulation.slopes.slopes).tolist() == list(SLOPES[1:])
    assert simulation.colours.angles.tolist() == list(SLOPES)
    for table in (simulation.primaries, simulation.tests, simulation.slopes):
        assert np.isfinite(table.XYZ).all()
        assert table.source.startswith("Simulated, not measured")
        to_XYZ = weights(WAVELENGTHS, table.illuminant, table.observer)
        np.testing.assert_allclose(table.XYZ, table.spectra @ to_XYZ, atol=6e-7)
