"""CIELAB and CIEDE2000 against colour-science and the pairs of Sharma, Wu and Dalal (2005)."""

import colour
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000

WHITE = np.array([0.9642, 1.0, 0.8249])

# Pairs 1 to 6, 7 to 16 (hue edges), 25 and 33 of the supplementary test data.
SHARMA = [
    ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
    ((50, 3.1571, -77.2803), (50, 0, -82.7485), 2.8615),
    ((50, 2.8361, -74.0200), (50, 0, -82.7485), 3.4412),
    ((50, -1.3802, -84.2814), (50, 0, -82.7485), 1.0000),
    ((50, -1.1848, -84.8006), (50, 0, -82.7485), 1.0000),
    ((50, -0.9009, -85.5211), (50, 0, -82.7485), 1.0000),
    ((50, 0, 0), (50, -1, 2), 2.3669),
    ((50, -1, 2), (50, 0, 0), 2.3669),
    ((50, 2.4900, -0.0010), (50, -2.4900, 0.0009), 7.1792),
    ((50, 2.4900, -0.0010), (50, -2.4900, 0.0010), 7.1792),
    ((50, 2.4900, -0.0010), (50, -2.4900, 0.0011), 7.2195),
    ((50, 2.4900, -0.0010), (50, -2.4900, 0.0012), 7.2195),
    ((50, -0.0010, 2.4900), (50, 0.0009, -2.4900), 4.8045),
    ((50, -0.0010, 2.4900), (50, 0.0010, -2.4900), 4.8045),
    ((50, -0.0010, 2.4900), (50, 0.0011, -2.4900), 4.7461),
    ((50, 2.5, 0), (50, 0, -2.5), 4.3065),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ((6.7747, -0.2908, -2.4247), (5.8714, -0.0985, -2.2286), 0.6377),
]


def delta_E_of_colour(Lab_1, Lab_2):
    return colour.delta_E(Lab_1, Lab_2, method="CIE 2000")


@pytest.mark.parametrize(("Lab_1", "Lab_2", "expected"), SHARMA)
def test_published_pairs(Lab_1, Lab_2, expected) -> None:
    assert delta_E_CIE2000(Lab_1, Lab_2) == pytest.approx(expected, abs=5.1e-5)
    assert delta_E_CIE2000(Lab_1, Lab_2) == pytest.approx(delta_E_of_colour(Lab_1, Lab_2), abs=1e-10)


def test_random_pairs_equal_colour_science() -> None:
    rng = np.random.default_rng(1)
    Lab = rng.uniform([0, -120, -120], [100, 120, 120], (2, 20_000, 3))
    near = Lab[0] + rng.normal(0, 0.5, Lab[0].shape)
    for other in (Lab[1], near):
        expected = delta_E_of_colour(Lab[0], other)
        assert np.abs(delta_E_CIE2000(Lab[0], other) - expected).max() < 1e-10


def test_hue_edges_equal_colour_science() -> None:
    # Every pair of greys, hues on the axes, opposite hues and hues a hair from them.
    on_axes = [(0, 0), (20, 0), (-20, 0), (0, 20), (0, -20)]
    beside = [(20, 1e-9), (20, -1e-9), (-20, 1e-9), (0.0, -0.0)]
    Lab = np.array([(50, a, b) for a, b in on_axes + beside])
    found = delta_E_CIE2000(Lab[:, np.newaxis], Lab)
    expected = delta_E_of_colour(*np.broadcast_arrays(Lab[:, np.newaxis], Lab))
    assert found.shape == (9, 9)
    assert np.abs(found - expected).max() < 1e-10
    assert np.all(np.diag(found) == 0)


def test_Lab_equals_colour_science_on_both_parts_of_the_curve() -> None:
    XYZ = np.random.default_rng(2).uniform(-0.05, 1.2, (10_000, 3)) ** 3
    expected = colour.XYZ_to_Lab(XYZ, colour.XYZ_to_xy(WHITE))
    assert np.abs(XYZ_to_Lab(XYZ, WHITE) - expected).max() < 1e-10
    assert XYZ_to_Lab(WHITE, WHITE) == pytest.approx([100, 0, 0], abs=1e-12)
    assert XYZ_to_Lab([0, 0, 0], WHITE) == pytest.approx([0, 0, 0], abs=1e-13)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False, width=32), min_size=6, max_size=6))
def test_every_float32_has_a_finite_difference(values) -> None:
    Lab_1, Lab_2 = XYZ_to_Lab(np.reshape(values, (2, 3)), WHITE)
    assert delta_E_CIE2000(Lab_1, Lab_2) >= 0
    assert delta_E_CIE2000(Lab_1, Lab_2) < np.inf
