"""Interpolation in tetrahedra; the multilinear one is tested with the elements."""

import itertools

import numpy as np
import pytest
from scipy.interpolate import LinearNDInterpolator

from iccbrdf.calc.elements import apply
from iccbrdf.calc.tables import TetrahedralTable
from iccbrdf.errors import UsageError

CUBE = np.array(list(itertools.product((0, 1), repeat=3)), float)


def run(table, points, dtype=np.float64):
    element = TetrahedralTable(np.asarray(table, np.float32))
    return np.stack(apply(element, list(np.asarray(points).T), dtype=dtype), axis=-1)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_linear_functions_are_met_on_any_grid(dtype):
    axes = [np.linspace(0, 1, n) for n in (2, 3, 5)]
    r, g, b = np.meshgrid(*axes, indexing="ij")
    points = np.random.default_rng(1).uniform(0, 1, (100, 3))
    found = run(np.stack([r + 2 * g + 4 * b, -g], axis=-1), points, dtype)
    np.testing.assert_allclose(found, np.stack([points @ [1, 2, 4], -points[:, 1]], axis=-1), atol=2e-6)
    assert found.dtype == dtype


def test_six_tetrahedra_around_the_diagonal():
    """Against Delaunay interpolation within each of the six, whose corners are a path from 000 to 111."""
    values = np.random.default_rng(2).normal(size=8)
    points = np.random.default_rng(3).uniform(0, 1, (300, 3))
    found = run(values.reshape(2, 2, 2, 1), points)[:, 0]
    for order in itertools.permutations(range(3)):
        inside = (np.diff(points[:, order], axis=1) <= 0).all(axis=1)
        corners = np.cumsum([np.zeros(3), *np.eye(3)[list(order)]], axis=0)
        at_corners = [values[int(corner @ [4, 2, 1])] for corner in corners]
        expected = LinearNDInterpolator(corners, at_corners)(points[inside])
        assert inside.sum() > 20
        np.testing.assert_allclose(found[inside], expected, rtol=1e-6, atol=1e-7)


def test_nodes_and_diagonal():
    values = np.arange(8.0)
    np.testing.assert_array_equal(run(values.reshape(2, 2, 2, 1), CUBE)[:, 0], values)
    grey = np.linspace(0, 1, 5)
    found = run(values.reshape(2, 2, 2, 1) ** 2, np.stack([grey] * 3, axis=-1))[:, 0]
    np.testing.assert_allclose(found, grey * 49)


def test_inputs_are_clipped_and_nan_is_zero():
    table = CUBE.sum(axis=1).reshape(2, 2, 2, 1)
    found = run(table, [[-1, 2, np.nan], [np.inf, 0.5, -np.inf]])
    np.testing.assert_array_equal(found[:, 0], [1, 1.5])


def test_numbers_for_all_pixels():
    table = TetrahedralTable(CUBE.reshape(2, 2, 2, 3).astype(np.float32))
    outs = apply(table, [np.array([0.0, 1.0]), 0.25, 0.5])
    np.testing.assert_allclose(outs, [[0, 1], [0.25, 0.25], [0.5, 0.5]])
    assert all(np.ndim(out) == 0 for out in apply(table, [0.0, 0.25, 0.5]))


def test_three_channels_only():
    with pytest.raises(UsageError, match="found 2 channels, expected 3"):
        TetrahedralTable(np.zeros((2, 2, 1), np.float32))
