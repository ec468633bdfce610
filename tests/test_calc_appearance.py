"""The appearance model of the elements XtoJ and JtoX."""

import numpy as np
import pytest
from cmm_examples import mid, reference
from colour.appearance import ciecam02

import iccbrdf
from iccbrdf.calc.elements import apply
from iccbrdf.errors import ProfileError
from iccbrdf.icc import JabToXYZ, MultiProcess, XYZToJab

WHITE = (96.42, 100.0, 82.49)
CONDITIONS = {
    "average": (WHITE, 500.0, 20.0, 0.69, 1.0, 1.0),
    "dim": ((95.047, 100.0, 108.883), 60.0, 10.0, 0.59, 0.9, 0.9),
    "dark": ((109.85, 100.0, 35.585), 5.0, 40.0, 0.525, 0.8, 0.8),
}
SRGB = np.array([[43.61, 38.51, 14.31], [22.25, 71.69, 6.06], [1.39, 9.71, 71.42]])
"""Linear sRGB to XYZ with a white of Y = 100."""


def colours(count=200):
    linear = np.random.default_rng(3).uniform(0, 1, (count, 3)) ** 2.2
    return np.concatenate([linear @ SRGB.T, np.outer([1, 0.5, 0.05, 0.001], WHITE)])


def expected(xyz, white, la, yb, c, nc, f):
    """Only adaptation and compression are written out here, the rest is CIECAM02 as colour-science has it."""
    cones = np.array([[0.3897, 0.68898, -0.07868], [-0.22981, 1.1834, 0.04641], [0, 0, 1]])
    n, level, nbb, _, z = ciecam02.viewing_conditions_dependent_parameters(yb, white[1], la)
    degree = f * (1 - np.exp((-la - 42) / 92) / 3.6)

    def responses(colour):
        adapted = np.maximum(cones @ colour, 0) * (degree * white[1] / (cones @ white) + 1 - degree)

        def sigmoid(x, exponent):
            return 400 * x**exponent / (x**exponent + 27.13)

        def curve(x):
            matched = 1.2307 * sigmoid(x, 0.3169) / sigmoid(level, 0.3169) - 0.2307
            return matched * sigmoid(level, 0.42)

        x, knee = level * adapted / 100, level * 4 / 255
        return np.where(x <= knee, x * curve(knee) / knee, curve(np.maximum(x, knee))) + 0.1

    white_response = ciecam02.achromatic_response_forward(responses(np.array(white)), nbb)
    rows = []
    for colour in xyz:
        rgb = responses(colour)
        a, b = ciecam02.opponent_colour_dimensions_forward(rgb)
        hue = ciecam02.hue_angle(a, b)
        achromatic = max(float(ciecam02.achromatic_response_forward(rgb, nbb)), 0.0)
        lightness = ciecam02.lightness_correlate(achromatic, white_response, c, z)
        e = 0.25 * (np.cos(2 + np.radians(hue)) + 3.8)
        chroma = ciecam02.chroma_correlate(lightness, n, nc, nbb, e, a, b, rgb)
        rows.append([lightness, chroma * np.cos(np.radians(hue)), chroma * np.sin(np.radians(hue))])
    return np.array(rows)


def run(element, rows, dtype=np.float64):
    return np.stack(apply(element, list(np.asarray(rows).T), dtype=dtype), axis=-1)


@pytest.mark.parametrize("name", CONDITIONS)
def test_forward_model(name):
    xyz = colours(40)
    found = run(XYZToJab(*CONDITIONS[name]), xyz)
    np.testing.assert_allclose(found, expected(xyz, *CONDITIONS[name]), rtol=2e-5, atol=2e-5)


def test_measured_values_of_the_reference():
    """XYZ must be in the scale of the white, and the model wants a white of 100."""
    small = XYZToJab((0.9642, 1.0, 0.8249), 500.0, 20.0, 0.69, 1.0, 1.0)
    assert run(small, [[0.2, 0.2, 0.2]])[0, 0] == pytest.approx(0.137, abs=5e-4)
    assert run(XYZToJab(WHITE), [WHITE])[0] == pytest.approx([100, 0, 0], abs=0.02)


@pytest.mark.parametrize("name", CONDITIONS)
def test_round_trip(name):
    xyz = colours()
    jab = run(XYZToJab(*CONDITIONS[name]), xyz)
    np.testing.assert_allclose(run(JabToXYZ(*CONDITIONS[name]), jab), xyz, rtol=1e-9, atol=1e-9)


def test_black_greys_and_colours_outside():
    forward, back = XYZToJab(WHITE), JabToXYZ(WHITE)
    np.testing.assert_allclose(run(forward, [[0, 0, 0]]), [[0, 0, 0]], atol=1e-9)
    np.testing.assert_array_equal(run(back, [[0, 5, 5], [-3, 0, 0]]), np.zeros((2, 3)))
    assert np.isfinite(run(forward, [[-5, -5, -5], [1e6, 1e6, 1e6], [50, 0, 0]])).all()
    grey = run(back, [[50, 0, 0]])[0]
    assert run(forward, [grey])[0] == pytest.approx([50, 0, 0], abs=1e-9)
    assert np.isnan(run(forward, [[np.nan, 1, 1]])).any()


@pytest.mark.parametrize(
    "changed", [{"white": (1, 0, 1)}, {"luminance": 0}, {"background": -1}, {"surround": 0}]
)
def test_conditions_that_no_model_is_made_for(changed):
    broken = JabToXYZ(**{"white": WHITE, **changed})
    with pytest.raises(ProfileError, match=r"element 0 .JtoX.: found white .* expected them above 0"):
        iccbrdf.link([mid("abc", MultiProcess.of(broken))])


def test_uniform_colours_stay_numbers():
    assert all(np.ndim(v) == 0 for v in apply(XYZToJab(WHITE), [20.0, 20.0, 20.0]))
    assert all(np.ndim(v) == 0 for v in apply(JabToXYZ(WHITE), [50.0, 0.0, 0.0]))


@pytest.mark.parametrize("name", CONDITIONS)
def test_the_reference_agrees(name, tmp_path):
    xyz = colours().astype(np.float32)
    forward, back = XYZToJab(*CONDITIONS[name]), JabToXYZ(*CONDITIONS[name])
    jab = run(forward, xyz, np.float32)
    theirs = reference(tmp_path, [mid("abc", MultiProcess.of(forward))], xyz)
    np.testing.assert_allclose(jab, theirs, rtol=2e-4, atol=5e-4)
    theirs = reference(tmp_path, [mid("abc", MultiProcess.of(back))], jab)
    # Its inverse matrix has six digits.
    np.testing.assert_allclose(run(back, jab, np.float32), theirs, rtol=2e-4, atol=5e-3)
