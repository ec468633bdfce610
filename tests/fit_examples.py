"""Geometries, truths and measurements that several tests of the fit share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import planar
from iccbrdf.brdf.models import MODELS, evaluate

Array = NDArray[np.float64]

WHITE = np.array([0.9642, 1.0, 0.8249])
BRDF1 = [0.5, 0.4, 0.1, 0.2, 0.22, 0.18, 0.2]
INCIDENCES = (15, 30, 45, 60)


def papers_geometries(
    incidences: tuple[int, ...] = INCIDENCES, lamp_exclusion: float = 15
) -> tuple[Array, Array]:
    """Light and view (g, 3) of the papers' goniometer: the lamp stands on the side of positive theta_r."""
    pairs = [
        (theta_i, theta_r)
        for theta_i in incidences
        for theta_r in range(-65, 31, 5)
        if abs(theta_r - theta_i) > lamp_exclusion
    ]
    theta_i, theta_r = np.array(pairs, dtype=float).T
    return planar(theta_i), planar(theta_r)


LIGHT, VIEW = papers_geometries()


def measured(
    parameters: object, light: Array = LIGHT, view: Array = VIEW, model: str = "brdf1", **options: float
) -> Array:
    """Pi times the BRDF of one patch or more, (..., g, 3)."""
    intensity = MODELS[model].intensity / light[:, 2:]
    rows = np.asarray(parameters, dtype=float)[..., np.newaxis, :]
    return evaluate(model, rows, planar(0), light, view, intensity=intensity, **options)


def random_truths(model: str, count: int, rng: np.random.Generator) -> Array:
    """Parameters (count, k), log-uniform: kd in .02..0.9, ks in .05..1, m in .1...5."""
    ranges = {"kd": (0.02, 0.9), "Rd": (0.02, 0.9), "ks": (0.05, 1.0), "m": (0.1, 0.5)}
    families = [
        np.exp(rng.uniform(*np.log(ranges[family]), (count, width)))
        for family, width in MODELS[model].parameters
    ]
    return np.concatenate(families, axis=-1)
