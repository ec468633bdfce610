"""When a fit must not be trusted: figures of a fit and the limits that they keep to.

The limits leave room for the misfit that one lobe has on sound paints: two that were measured, garnet red and
krylon blue, come to half of them or more, and keep to them all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.brdf.colour_difference import XYZ_to_Lab
from iccbrdf.brdf.fit_problem import Problem
from iccbrdf.brdf.geometry import Array, direction, planar, tan2_theta_h
from iccbrdf.brdf.models import evaluate, find_model

REGIONS = ("diffuse", "near-specular", "specular")
"""Of the papers: specular is the mirror direction, near-specular within 15 degrees of it."""

_NEAR = 15.0
_EXACT = 0.5
"""Degrees from a direction that count as in it."""

_BIN = 5.0
"""Width in degrees of the bins of theta_h in which residuals are averaged."""
_READINGS_IN_BIN = 3
_BROAD = 25.0
_CHROMA = 10.0
"""Below this chroma a hue says little."""
_LEAST_RESIDUAL = 0.5
"""CIEDE2000; a lobe that changes colours by less than twice this is none, however good the readings."""
_VISIBLE = 2.0
_AT_BOUND = 1e-3
"""Of a logarithm."""
_LEAST_ANGLES = 6
"""So many of the least theta_h tell the step of the angles where the lobe is."""

_INCIDENCES = (0.0, 15.0, 30.0, 45.0, 60.0)
"""In degrees, of the albedo: nearer grazing the Fresnel term of theta_i overshoots in sound fits too."""
_RINGS, _SECTORS = 20, 12
_AROUND = direction(90, np.tile((np.arange(_SECTORS) + 0.5) * 180 / _SECTORS, _RINGS))[:, :2]
"""Azimuths of the half vectors that the albedo is summed over, on one side of the plane of incidence."""
_UP = planar(0)


@dataclass(frozen=True)
class Check:
    """A figure of a fit and the limit that it must keep to."""

    name: str
    limit: float
    at_least: bool
    """Whether the figure must be at least the limit; else at most."""
    meaning: str

    def passes(self, value: float) -> bool:
        return value >= self.limit if self.at_least else value <= self.limit


_LOG_Y = "log10 of measured over fitted Y"

CHECKS = (
    Check("no lobe", _VISIBLE, True, "largest change of colour by the lobe, in units of the residual"),
    Check("narrow lobe", 1.0, True, "half width of the lobe, in units of half the step of the angles"),
    Check("too few geometries", 6, True, "distinct pairs of theta_i and theta_h within the half width"),
    Check("at a bound", 0, False, "parameters at an end of their range"),
    Check("energy above 1", 1.02, False, "largest hemispherical albedo, up to 60 degrees of incidence"),
    Check("misfit", 0.10, False, f"median of the absolute {_LOG_Y}"),
    Check("misfit of some", 0.35, False, f"90 % point of the absolute {_LOG_Y}"),
    Check("shape of the lobe", 0.20, False, f"scatter over theta_h of the mean {_LOG_Y}"),
    Check("shape of the tail", 0.25, False, f"scatter over theta_h beyond 25 degrees of the mean {_LOG_Y}"),
    Check("shift of hue", 15.0, False, "scatter of measured less fitted hue in degrees, chromas above 10"),
    Check("retro-reflection", 0.20, False, f"median {_LOG_Y}, within 15 degrees of the lamp"),
    Check("disagreeing starts", 0.5, True, "share of starts that reach the best; only beside another flag"),
)
"""What is looked at, in this order."""


@dataclass(frozen=True)
class Finding:
    """What a check found in the fit of a patch."""

    check: Check
    value: float | None
    """None where it could not be tested."""
    flagged: bool
    detail: str = ""
    """What the figure counts."""

    def __str__(self) -> str:
        if self.value is None:
            return f"{self.check.name}: not tested"
        bound = "at least" if self.check.at_least else "at most"
        text = f"{self.check.name}: {self.value:.3g}, expected {bound} {self.check.limit:g}"
        return f"{text} ({self.detail or self.check.meaning})"


def regions(light: Array, view: Array) -> NDArray[np.intp]:
    """Return the index in `REGIONS` of each geometry, from unit vectors (g, 3); shape (g,)."""
    mirror = light * [-1, -1, 1]
    angle = _angle(mirror, view)
    return np.where(angle <= _EXACT, 2, np.where(angle <= _NEAR + 1e-6, 1, 0))


def half_width(m: ArrayLike) -> Array:
    """
    Return the angle theta_h in degrees at which exp(-tan^2 theta_h / m^2) has fallen to a half.

    Examples
    --------
    >>> print(half_width(0.25).round(2))
    11.76
    """
    width: Array = np.degrees(np.arctan(np.asarray(m, dtype=np.float64) * np.sqrt(np.log(2))))
    return width


def hemispherical_albedo(
    model: str, parameters: ArrayLike, theta_i: ArrayLike, refractive_index: ArrayLike = 1.5
) -> Array:
    """
    Return the share of light from one direction that a model reflects into the hemisphere.

    The lobe is integrated over half vectors spread as the facets are, tan^2 theta_h = -m^2 ln(1 - u), where
    the integrand is smooth however narrow the lobe.

    Parameters
    ----------
    model
        Key of `MODELS`.
    parameters
        Channels of the model, (p, k).
    theta_i
        Angles of incidence in degrees, (a,).
    refractive_index
        A number or (p,), for models with a Fresnel term.

    Returns
    -------
    Albedo for X, Y, Z, relative to Y = 1 of the perfect diffuser, (p, a, 3).

    Examples
    --------
    >>> hemispherical_albedo("ward", [[0.5, 0.5, 0.5, 0.1, 0.1]], [0.0]).round(3).tolist()
    [[[0.597, 0.597, 0.597]]]
    """
    entry = find_model(model)
    parameters, theta_i = np.asarray(parameters, dtype=np.float64), np.asarray(theta_i, dtype=np.float64)
    light = planar(-theta_i)[:, np.newaxis]
    options = {}
    if entry.has_fresnel:
        options["refractive_index"] = np.reshape(refractive_index, (-1, 1, 1))
    intensity = entry.intensity / light[..., 2:]

    def factor(parameters: Array, view: Array) -> Array:
        return evaluate(
            model, parameters[:, np.newaxis, np.newaxis], _UP, light, view, intensity=intensity, **options
        )

    lobe = np.concatenate([np.zeros_like(parameters[:, :3]), parameters[:, 3:]], axis=-1)
    above = np.broadcast_to(_UP, (len(parameters), 1, 1, 3))
    diffuse = (factor(parameters, above) - factor(lobe, above))[:, :, 0]

    roughness = entry.split(parameters)[2]
    specular = np.empty_like(diffuse)
    for channel in range(roughness.shape[-1]):
        tan2, weight = _facet_nodes(roughness[:, channel])
        tangent = np.sqrt(tan2)[..., np.newaxis]
        half = np.concatenate([tangent * _AROUND, np.ones_like(tangent)], axis=-1)
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        half = half[:, np.newaxis]
        cos_alpha = np.sum(light * half, axis=-1)
        view = 2 * cos_alpha[..., np.newaxis] * half - light
        weight = weight[:, np.newaxis] * 4 * np.maximum(cos_alpha, 0) * np.maximum(view[..., 2], 0) / np.pi
        total = np.sum(factor(lobe, view) * weight[..., np.newaxis], axis=2)
        columns = slice(None) if roughness.shape[-1] == 1 else [channel]
        specular[..., columns] = total[..., columns]
    return diffuse + specular


def diagnose(
    problem: Problem, parameters: Array, refractive_index: Array, agreement: Array
) -> tuple[tuple[Finding, ...], ...]:
    """
    Look at the fits of p patches.

    Parameters
    ----------
    problem
        The measurements.
    parameters
        Optima, (p, k).
    refractive_index
        Of each patch, (p,).
    agreement
        Share of the starts that reached the optimum, (p,).

    Returns
    -------
    For each patch a finding for each of `CHECKS`, in their order.
    """
    model = problem.model
    channels = parameters[:, : len(model.channels)]
    albedo = hemispherical_albedo(model.name, channels, _INCIDENCES, refractive_index)
    fitted = problem.predict(parameters)
    without_lobe = parameters.copy()
    without_lobe[:, 3 : 3 + dict(model.parameters)["ks"]] = 0
    change = problem.colour_differences(problem.predict(without_lobe), fitted)
    residual = np.sqrt(np.nanmean(problem.colour_differences(problem.XYZ, fitted) ** 2, axis=-1))
    visible = np.nanmax(change, axis=-1) / np.maximum(residual, _LEAST_RESIDUAL)
    m = model.split(channels)[2].min(axis=-1)
    found = []
    for p in range(len(parameters)):
        rows = problem.measured[p]
        geometry = problem.light[rows], problem.view[rows]
        at_bound = _at_bound(problem, parameters[p])
        figures = {
            "no lobe": float(visible[p]),
            **_sampling(*geometry, float(m[p])),
            "at a bound": float(len(at_bound)),
            "energy above 1": float(np.max(albedo[p] / problem.white)),
            **_misfit(*geometry, problem.XYZ[p, rows], fitted[p, rows], problem.white),
            "disagreeing starts": float(agreement[p]),
        }
        if visible[p] < _VISIBLE:
            # The width of a lobe that is not there is no figure.
            figures |= {"narrow lobe": None, "too few geometries": None}
        found.append(tuple(_findings(figures, {"at a bound": ", ".join(at_bound)})))
    return tuple(found)


def _findings(figures: dict[str, float | None], details: dict[str, str]) -> Iterator[Finding]:
    beside_another = False
    for check in CHECKS:
        value = figures[check.name]
        flagged = value is not None and not check.passes(value)
        if check is CHECKS[-1]:
            flagged &= beside_another
        beside_another |= flagged
        yield Finding(check, value, flagged, details.get(check.name, "") if flagged else "")


def _at_bound(problem: Problem, parameters: Array) -> list[str]:
    low, high = problem.bounds
    held = (np.log(parameters) <= low + _AT_BOUND) | (np.log(parameters) >= high - _AT_BOUND)
    return [name for name, at in zip(problem.names, held, strict=True) if at]


def _sampling(light: Array, view: Array, m: float) -> dict[str, float | None]:
    """How the geometries of a patch sample a lobe."""
    theta_h = _theta_h(light, view)
    theta_i = np.degrees(np.arccos(light[:, 2]))
    width = float(half_width(m))
    halves = np.rint(2 * theta_h) / 2
    inside = halves <= width
    distinct = {*zip(np.rint(2 * theta_i[inside]).tolist(), halves[inside].tolist(), strict=True)}
    steps = np.diff(np.unique(halves)[:_LEAST_ANGLES])
    return {
        # A step of the viewer turns the half vector by half as much.
        "narrow lobe": width / float(np.median(steps)) if steps.size else 0.0,
        "too few geometries": float(len(distinct)),
    }


def _misfit(
    light: Array, view: Array, measured: Array, fitted: Array, white: Array
) -> dict[str, float | None]:
    """How one lobe fits the measurements of a patch, (g, 3)."""
    positive = (measured[:, 1] > 0) & (fitted[:, 1] > 0)
    light, view, measured, fitted = (rows[positive] for rows in (light, view, measured, fitted))
    ratio = np.log10(measured[:, 1] / fitted[:, 1])
    theta_h = _theta_h(light, view)
    broad = theta_h > _BROAD
    a_measured, a_fitted = (XYZ_to_Lab(XYZ, white)[:, 1:] @ [1, 1j] for XYZ in (measured, fitted))
    coloured = (np.abs(a_measured) > _CHROMA) & (np.abs(a_fitted) > _CHROMA)
    hue = np.degrees(np.angle(a_measured[coloured] / a_fitted[coloured]))
    at_lamp = (_angle(light, view) <= _NEAR) & (regions(light, view) == 0)
    return {
        "misfit": _if_any(np.median, np.abs(ratio)),
        "misfit of some": _if_any(lambda x: np.quantile(x, 0.9), np.abs(ratio)),
        "shape of the lobe": _scatter_of_bins(theta_h, ratio),
        "shape of the tail": _scatter_of_bins(theta_h[broad], ratio[broad]),
        "shift of hue": _if_any(np.std, hue),
        "retro-reflection": _if_any(np.median, ratio[at_lamp]),
    }


def _scatter_of_bins(theta_h: Array, ratio: Array) -> float | None:
    """Standard deviation over bins of theta_h of the mean in each."""
    bins = np.floor(theta_h / _BIN + 1e-6).astype(np.intp)
    counts = np.bincount(bins)
    enough = counts >= _READINGS_IN_BIN
    means = np.bincount(bins, ratio)[enough] / counts[enough]
    return float(np.std(means)) if means.size > 1 else None


def _if_any(figure: Callable[[Array], Any], values: Array) -> float | None:
    return float(figure(values)) if values.size else None


def _theta_h(light: Array, view: Array) -> Array:
    theta_h: Array = np.degrees(np.arctan(np.sqrt(tan2_theta_h(_UP, light + view))))
    return theta_h


def _angle(a: Array, b: Array) -> Array:
    """Angle in degrees between unit vectors; the arc sine keeps its digits where they are close."""
    angle: Array = 2 * np.degrees(np.arcsin(np.minimum(np.linalg.norm(a - b, axis=-1) / 2, 1)))
    return angle


def _facet_nodes(m: Array) -> tuple[Array, Array]:
    """tan^2 theta_h (p, nodes) and solid angle of half vectors (p, nodes) for roughnesses (p,)."""
    nodes, weights = np.polynomial.legendre.leggauss(_RINGS)
    u, du = np.repeat((nodes + 1) / 2, _SECTORS), np.repeat(weights / 2, _SECTORS)
    m2 = m[:, np.newaxis] ** 2
    tan2 = -m2 * np.log1p(-u)
    # tan theta_h d tan theta_h = m^2 du / (2 (1 - u)), and a solid angle has cos^3 theta_h times that.
    return tan2, (1 + tan2) ** -1.5 * m2 / (2 * (1 - u)) * du * 2 * np.pi / _SECTORS
