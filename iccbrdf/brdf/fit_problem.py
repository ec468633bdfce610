"""What is fitted: measured XYZ, a model at the same geometries, and the residuals between them.

The solvers work on the logarithms of the parameters, which keeps them positive and makes steps relative.

References
----------
-   [Habib2023] T. Habib, P. Green, P. Nussbaum: An appearance reproduction framework for printed 3D
    surfaces. Journal of Imaging Science and Technology, 2023.
-   [Sharma2005] G. Sharma, W. Wu, E. Dalal: The CIEDE2000 color-difference formula. Implementation notes,
    supplementary test data, and mathematical observations. Color Research and Application 30(1), 2005.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.brdf.colour_difference import XYZ_to_Lab
from iccbrdf.brdf.geometry import Array, planar
from iccbrdf.brdf.models import Model, evaluate

Objective = Literal["rms CIEDE2000", "mean CIEDE2000", "rms XYZ"]

REFRACTIVE_INDEX = "refractive_index"
"""Name of the parameter that follows the model's channels where the refractive index is fitted."""

BOUNDS: dict[str, tuple[float, float]] = {
    "kd": (1e-5, 1.5),
    "Rd": (1e-5, 1.5),
    "ks": (1e-5, 10.0),
    "m": (0.003, 1.0),
    REFRACTIVE_INDEX: (1.05, 3.0),
}
"""Range of each family of parameters.

kd: beyond the perfect diffuser by as much as brighteners add.  ks: a mirror has 1 / (4 R0) = 6.25 under a
coat of n = 1.5.  m: .003 is a lobe a tenth of the width that any goniometer resolves, 1 one that covers the
hemisphere.
"""

_KS_OF_SHARES = (1e-5, 0.9999)
"""ks where the model gives the diffuse part the share 1 - ks."""

_MODEL_STEP = 1e-7
_XYZ_STEP = 1e-7
"""Steps of the forward differences: of a logarithm; of XYZ, relative."""

_UP = planar(0)


@dataclass(frozen=True)
class Problem:
    """Measurements of patches and the model to fit to each of them."""

    model: Model
    XYZ: Array
    """pi times the BRDF as XYZ, Y = 1 for the perfect diffuser; NaN where not measured; (patches, g, 3)."""
    light: Array
    """Directions to the light, (g, 3), above the surface."""
    view: Array
    """Directions to the viewer, (g, 3), above the surface."""
    white: Array
    """XYZ of the perfect diffuser, (3,)."""
    objective: Objective
    refractive_index: float | None
    """None where it is fitted, or where the model has none."""
    as_published: bool
    """Whether the model's I, with its cos theta_i, is what the measured XYZ are compared with."""
    measured: NDArray[np.bool_] = field(init=False)
    """Where there is a measurement, (patches, g)."""
    _Lab: Array = field(init=False)

    def __post_init__(self) -> None:
        measured = np.asarray(np.isfinite(self.XYZ).all(axis=-1))
        object.__setattr__(self, "measured", measured)
        object.__setattr__(self, "XYZ", np.where(measured[..., np.newaxis], self.XYZ, self.white))
        object.__setattr__(self, "_Lab", XYZ_to_Lab(self.XYZ, self.white))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that are fitted, k of them."""
        return (*self.model.channels, *((REFRACTIVE_INDEX,) if self.fits_index else ()))

    @property
    def bounds(self) -> Array:
        """Least and largest logarithm of each parameter, (2, k)."""
        ranges = []
        for name in self.names:
            family = name.split(".")[0]
            shares = self.model.name == "cook_torrance_2020" and family == "ks"
            ranges.append(_KS_OF_SHARES if shares else BOUNDS[family])
        limits: Array = np.log(ranges).T
        return limits

    @property
    def fits_index(self) -> bool:
        """Whether the refractive index is one of the parameters."""
        return self.model.has_fresnel and self.refractive_index is None

    def predict(self, parameters: ArrayLike) -> Array:
        """Return what the model gives for parameters (..., k) at every geometry, (..., g, 3)."""
        parameters = np.asarray(parameters, dtype=np.float64)[..., np.newaxis, :]
        options = {}
        if self.fits_index:
            options["refractive_index"] = parameters[..., -1]
            parameters = parameters[..., :-1]
        elif self.model.has_fresnel:
            options["refractive_index"] = np.asarray(self.refractive_index)
        intensity = np.full((len(self.light), 1), self.model.intensity)
        if not self.as_published:
            intensity /= self.light[:, 2:]
        return evaluate(
            self.model.name, parameters, _UP, self.light, self.view, intensity=intensity, **options
        )

    def residuals(self, XYZ: Array, patches: NDArray[np.intp]) -> Array:
        """
        Return three numbers at each geometry whose squares add up to the squared error there.

        Parameters
        ----------
        XYZ
            Of the model, (..., b, g, 3).
        patches
            Which patch each of the b stands for, (b,).

        Returns
        -------
        Residuals (..., b, g, 3), 0 where not measured: of CIEDE2000, or of XYZ for the objective "rms XYZ".
        """
        if self.objective == "rms XYZ":
            difference = XYZ - self.XYZ[patches]
        else:
            difference = CIEDE2000_components(XYZ_to_Lab(XYZ, self.white), self._Lab[patches])
        return difference * self.measured[patches][..., np.newaxis]

    def linearise(self, logs: Array, patches: NDArray[np.intp]) -> tuple[Array, Array]:
        """
        Return residuals and their derivatives by the logarithms of the parameters.

        The colour difference at a geometry depends on its three XYZ only, so the chain rule needs three
        forward differences of it however many parameters there are.

        Parameters
        ----------
        logs
            Logarithms of parameters, (b, k).
        patches
            Which patch each of the b stands for, (b,).

        Returns
        -------
        Residuals (b, g, 3) and derivatives (b, g, 3, k).
        """
        k = logs.shape[-1]
        steps = np.concatenate([np.zeros((1, k)), np.eye(k) * _MODEL_STEP])
        XYZ, *moved = self.predict(np.exp(logs + steps[:, np.newaxis]))
        by_logs = np.stack([(each - XYZ) / _MODEL_STEP for each in moved], axis=-1)
        residuals = self.residuals(XYZ, patches)
        if self.objective == "rms XYZ":
            return residuals, by_logs * self.measured[patches][..., np.newaxis, np.newaxis]
        # Far below any colour that is measured the step needs a floor, or it is lost in rounding.
        step = _XYZ_STEP * np.maximum(XYZ, 1e-3)
        by_XYZ = np.stack(
            [(self.residuals(XYZ + step * axis, patches) - residuals) / step[..., [c]]
             for c, axis in enumerate(np.eye(3))],
            axis=-1,
        )  # fmt: skip
        return residuals, by_XYZ @ by_logs

    def colour_differences(self, XYZ_1: Array, XYZ_2: Array) -> Array:
        """Return CIEDE2000 (p, g) between colours (p, g, 3) of the p patches, NaN where not measured."""
        components = CIEDE2000_components(XYZ_to_Lab(XYZ_1, self.white), XYZ_to_Lab(XYZ_2, self.white))
        return np.where(self.measured, np.linalg.norm(components, axis=-1), np.nan)

    def values(self, residuals: Array, patches: NDArray[np.intp]) -> Array:
        """Return the value of the objective of residuals (b, g, 3), shape (b,)."""
        squared = np.sum(residuals**2, axis=-1)
        count = np.count_nonzero(self.measured[patches], axis=-1)
        if self.objective == "mean CIEDE2000":
            return np.asarray(np.sum(np.sqrt(squared), axis=-1) / count)
        return np.asarray(np.sqrt(np.sum(squared, axis=-1) / count))


def CIEDE2000_components(Lab_1: ArrayLike, Lab_2: ArrayLike) -> Array:
    """
    Return three numbers whose squares add up to the square of CIEDE2000.

    dE^2 = L^2 + C^2 + H^2 + R C H = L^2 + (C + R H / 2)^2 + (1 - R^2 / 4) H^2 with |R| <= 2.  Least squares
    on the three converges as on any smooth residual, where dE itself has a kink at 0.  The mean hue is the
    bisector of two unit vectors and its multiples are polynomials of its cosine and sine, which takes three
    quarters of the time of the formula in angles.

    Parameters
    ----------
    Lab_1, Lab_2
        L*, a*, b*, shapes (..., 3) that broadcast.

    Returns
    -------
    Components of lightness, chroma and hue, (..., 3).  For hues exactly opposite, where CIEDE2000 jumps, the
    mean hue counts as 0 [Sharma2005].

    Examples
    --------
    >>> components = CIEDE2000_components([50, 2.6772, -79.7751], [50, 0, -82.7485])
    >>> print(np.linalg.norm(components).round(4))
    2.0425
    """
    L_1, a_1, b_1 = np.moveaxis(np.asarray(Lab_1, dtype=np.float64), -1, 0)
    L_2, a_2, b_2 = np.moveaxis(np.asarray(Lab_2, dtype=np.float64), -1, 0)
    stretch = 1.5 - 0.5 * _share_of_chroma((_length(a_1, b_1) + _length(a_2, b_2)) / 2)
    a_1, a_2 = stretch * a_1, stretch * a_2
    C_1, C_2 = _length(a_1, b_1), _length(a_2, b_2)
    product, dot, cross = C_1 * C_2, a_1 * a_2 + b_1 * b_2, a_1 * b_2 - a_2 * b_1

    # 2 sqrt(C_1 C_2) sin(dh / 2) in two forms, each where the other cancels.
    apart = np.copysign(np.sqrt(2 * np.maximum(product - dot, 0)), cross)
    dH = np.where(dot < 0, apart, cross / np.sqrt(np.maximum((product + dot) / 2, _TINY)))

    over_1, over_2 = 1 / np.maximum(C_1, _TINY), 1 / np.maximum(C_2, _TINY)
    cos, sin = a_1 * over_1 + a_2 * over_2, b_1 * over_1 + b_2 * over_2
    length = np.maximum(_length(cos, sin), _TINY)
    cos, sin = cos / length, sin / length
    cos_2, sin_2 = cos * cos - sin * sin, 2 * sin * cos
    cos_3, sin_3 = cos_2 * cos - sin_2 * sin, sin_2 * cos + cos_2 * sin
    cos_4, sin_4 = cos_2 * cos_2 - sin_2 * sin_2, 2 * sin_2 * cos_2
    T = (
        1
        - 0.17 * (cos * _COS_30 + sin * _SIN_30)
        + 0.24 * cos_2
        + 0.32 * (cos_3 * _COS_6 - sin_3 * _SIN_6)
        - 0.20 * (cos_4 * _COS_63 + sin_4 * _SIN_63)
    )
    L, C = (L_1 + L_2) / 2 - 50, (C_1 + C_2) / 2
    lightness = (L_1 - L_2) / (1 + 0.015 * L**2 / np.sqrt(20 + L**2))
    chroma = (C_1 - C_2) / (1 + 0.045 * C)
    hue = -dH / (1 + 0.015 * C * T)
    degrees = np.degrees(np.arctan2(sin, cos))
    rotation = np.radians(60) * np.exp(-(((degrees + 360 * (degrees < 0) - 275) / 25) ** 2))
    half_R = -_share_of_chroma(C) * np.sin(rotation)
    return np.stack([lightness, chroma + half_R * hue, np.sqrt(1 - half_R**2) * hue], axis=-1)


_TINY = 1e-300
_COS_6, _SIN_6 = np.cos(np.radians(6)), np.sin(np.radians(6))
_COS_30, _SIN_30 = np.cos(np.radians(30)), np.sin(np.radians(30))
_COS_63, _SIN_63 = np.cos(np.radians(63)), np.sin(np.radians(63))


def _length(x: Array, y: Array) -> Array:
    """np.hypot, ten times as fast: no a* and b* come near the ends of float64's range."""
    length: Array = np.sqrt(x * x + y * y)
    return length


def _share_of_chroma(C: Array) -> Array:
    """sqrt(C^7 / (C^7 + 25^7)), without a power of a fraction and without overflow."""
    ratio = np.minimum(C, 1e5) / 25
    squared = ratio * ratio
    C_7 = squared * squared * squared * ratio
    share: Array = np.sqrt(C_7 / (C_7 + 1))
    return share
