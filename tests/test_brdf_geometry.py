"""Directions, half vectors and the stable tangent, against values known by hand and exact angles."""

import doctest
import importlib

import numpy as np
import pytest

from iccbrdf.brdf.geometry import cosines, direction, half_vector, planar, tan2_theta_h, unit
from iccbrdf.errors import UsageError


@pytest.mark.parametrize("name", ["geometry", "cook_torrance", "ward", "models"])
def test_examples_in_docstrings_run(name: str) -> None:
    # colour-science switches NumPy to an old way of printing arrays when another test imports it.
    with np.printoptions(legacy=False):
        result = doctest.testmod(importlib.import_module(f"iccbrdf.brdf.{name}"))
    assert result.attempted > 0
    assert result.failed == 0


@pytest.mark.parametrize(
    ("zenith", "azimuth", "expected"),
    [
        (0, 0, (0, 0, 1)),
        (90, 0, (1, 0, 0)),
        (90, 90, (0, 1, 0)),
        (90, 180, (-1, 0, 0)),
        (90, -90, (0, -1, 0)),
        (90, 450, (0, 1, 0)),
        (180, 123, (0, 0, -1)),
    ],
)
def test_direction_is_exact_at_right_angles(zenith, azimuth, expected) -> None:
    assert direction(zenith, azimuth).tolist() == list(expected)


def test_direction_turns_counter_clockwise_from_x() -> None:
    x, y, z = direction(30, 60)
    assert (x, y, z) == pytest.approx((0.5 * 0.5, 0.5 * np.sqrt(3) / 2, np.sqrt(3) / 2))


def test_direction_broadcasts() -> None:
    vectors = direction(np.arange(0, 90, 10)[:, np.newaxis], np.arange(0, 360, 45))
    assert vectors.shape == (9, 8, 3)
    assert np.linalg.norm(vectors, axis=-1) == pytest.approx(1)


def test_mirror_direction_of_a_planar_angle() -> None:
    incidence = np.array([0, 10, 45, 80])
    assert half_vector(planar(-incidence), planar(incidence)) == pytest.approx(
        np.broadcast_to([0.0, 0.0, 1.0], (4, 3))
    )
    assert planar(30)[0] > 0


def test_unit_keeps_very_long_and_very_short_vectors() -> None:
    vectors = np.array([[3e200, 0, 4e200], [3e-200, 0, 4e-200], [3, 0, 4]])
    assert unit(vectors) == pytest.approx(np.tile([0.6, 0, 0.8], (3, 1)), rel=1e-15)


@pytest.mark.parametrize("vector", [(0, 0, 0), (np.nan, 0, 1), (np.inf, 0, 1)])
def test_unit_of_a_vector_without_direction_is_zero(vector) -> None:
    assert unit(vector).tolist() == [0, 0, 0]


def test_unit_refuses_other_widths() -> None:
    with pytest.raises(UsageError, match=r"shape \(5, 2\), expected \(\.\.\., 3\)"):
        unit(np.zeros((5, 2)))


def test_cosines_are_of_the_papers_angles() -> None:
    cosine = cosines(planar(10), planar(-40), planar(70))
    found = np.degrees(np.arccos(cosine))
    assert found == pytest.approx([50, 60, 5, 55])


def test_tangent_of_the_half_angle_keeps_its_digits_near_the_mirror_direction() -> None:
    tilt = 10.0 ** np.arange(-7, 2)
    half = planar(-30) + planar(30)
    found = tan2_theta_h(17 * planar(tilt), half)
    assert found == pytest.approx(np.tan(np.radians(tilt)) ** 2, rel=1e-8)
