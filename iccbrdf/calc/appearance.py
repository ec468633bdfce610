"""The colour appearance model of the elements XtoJ and JtoX, on planar values.

It is CIECAM02 (CIE 159:2004) with the two changes that the ICC's own model makes so that it has no holes:
chromatic adaptation happens in the cone space of Hunt, Pointer and Estevez, where negative responses
are cut off, and the compression of the responses is a straight line near zero
(I. Tastl, M. Bhachech, N. Moroney, J. Holm: ICC color management and CIECAM02, CIC13, 2005; the constants are
those of the ICC's reference implementation).  Seen over sRGB, lightness above J = 30 is within 1.5 of
CIECAM02's and darks are darker; chroma is larger, by 7 per cent at the median and 45 for the purest blues.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.calc.meanings import Value, where
from iccbrdf.errors import ProfileError

CONES: npt.NDArray[Any] = np.array(
    [[0.38970, 0.68898, -0.07868], [-0.22981, 1.18340, 0.04641], [0.0, 0.0, 1.0]]
)
"""XYZ to the responses of the cones, equal for equal-energy white."""

EXPONENT, STEEPER, RATIO, KNEE = 0.42, 0.3169, 0.2307, 4 / 255
"""Of the compression: the exponent of CIECAM02, the one above the knee, and how the two are matched."""

_NOISE = 0.1
_BLACKEST = 1e-5
"""Lightness below which a colour is black."""


def check_conditions(element: Any, where: str) -> None:
    """Raise ProfileError, which begins with `where`, for conditions that the model is not made for."""
    numbers = (*element.white, element.luminance, element.background, element.surround)
    if not all(number > 0 for number in numbers):
        raise ProfileError(
            f"{where}: found white {tuple(element.white)}, luminance {element.luminance}, "
            f"background {element.background} and surround {element.surround}, expected them above 0"
        )


def xyz_to_jab(element: Any, channels: list[Value]) -> list[Value]:
    """Lightness J and chroma C cos h, C sin h of planar X, Y, Z in the scale of `element.white`."""
    model = _model(element)
    cones = [np.maximum(c, 0.0) for c in _product(CONES, [c.astype(np.float64) for c in channels])]
    r, g, b = (
        model.compress(cone * gain / 100) + _NOISE for cone, gain in zip(cones, model.gains, strict=True)
    )
    red_green = r - 12 * g / 11 + b / 11
    yellow_blue = (r + g - 2 * b) / 9
    hue = np.arctan2(yellow_blue, red_green)
    lightness = 100 * np.power(np.maximum(model.achromatic(r, g, b), 0.0) / model.white, model.power)
    t = model.induction * _eccentricity(hue) * np.hypot(red_green, yellow_blue) / (r + g + 1.05 * b)
    chroma = np.power(t, 0.9) * np.sqrt(lightness / 100) * model.background
    results = (lightness, chroma * np.cos(hue), chroma * np.sin(hue))
    return [value.astype(channels[0].dtype)[()] for value in results]


def jab_to_xyz(element: Any, channels: list[Value]) -> list[Value]:
    """The inverse of `xyz_to_jab`; black for J below 1e-5."""
    model = _model(element)
    lightness, a, b = (c.astype(np.float64) for c in channels)
    black = lightness < _BLACKEST
    relative = where(black, np.float64(1.0), lightness / 100)
    chroma = np.hypot(a, b)
    grey = chroma == 0
    cosine, sine = where(grey, np.float64(1.0), a / chroma), where(grey, np.float64(0.0), b / chroma)
    t = np.power(chroma / (np.sqrt(relative) * model.background), 1 / 0.9)
    achromatic = model.white * np.power(relative, 1 / model.power)
    # r + g + 1.05 b is linear in the radius of red_green and yellow_blue, which t is proportional to.
    p = (achromatic / model.nbb + 0.305) * 460 / 1403
    eccentricity = model.induction * _eccentricity(np.arctan2(sine, cosine))
    radius = 3.05 * p * t / (eccentricity + t * (671 * cosine + 6588 * sine) / 1403)
    red_green, yellow_blue = radius * cosine, radius * sine
    responses = (
        p + (451 * red_green + 288 * yellow_blue) / 1403,
        p - (891 * red_green + 261 * yellow_blue) / 1403,
        p - (220 * red_green + 6300 * yellow_blue) / 1403,
    )
    cones = [
        100 * model.expand(where(black, np.float64(0.0), np.maximum(response, 0.0) - _NOISE)) / gain
        for response, gain in zip(responses, model.gains, strict=True)
    ]
    return [value.astype(channels[0].dtype)[()] for value in _product(np.linalg.inv(CONES), cones)]


def _product(matrix: npt.NDArray[Any], channels: list[Value]) -> list[Value]:
    return [row[0] * channels[0] + row[1] * channels[1] + row[2] * channels[2] for row in matrix]


def _eccentricity(hue: Value) -> Value:
    factor: Value = (np.cos(hue + 2) + 3.8) / 4
    return factor


def _sigmoid(x: Any, exponent: float) -> Any:
    power = np.power(x, exponent)
    return 400 * power / (27.13 + power)


@dataclass(frozen=True)
class _Model:
    """What depends on the viewing conditions alone.

    gains: of the cones, adaptation to the white and to the luminance (`level`, CIECAM02's FL) in one.
    power: from achromatic response to lightness (c z).  white: achromatic response of the white.
    induction, background: factors of the chroma.  slope: of the compression's straight line.
    """

    level: float
    gains: tuple[float, ...]
    nbb: float
    power: float
    induction: float
    background: float
    slope: float
    white: float

    def compress(self, x: Value) -> Value:
        """Responses from 0 on."""
        return where(x <= KNEE * self.level, self.slope * x, self._curve(np.maximum(x, KNEE * self.level)))

    def expand(self, y: Value) -> Value:
        """The inverse of `compress`, odd around 0."""
        size = np.abs(y)
        knee = self.slope * KNEE * self.level
        high = _sigmoid(self.level, STEEPER)
        s = (np.maximum(size, knee) / _sigmoid(self.level, EXPONENT) + RATIO) / (1 + RATIO) * high
        curve = np.power(27.13 * s / (400 - s), 1 / STEEPER)
        return where(size <= knee, y / self.slope, np.copysign(curve, y))

    def _curve(self, x: Any) -> Any:
        ratio = _sigmoid(x, STEEPER) / _sigmoid(self.level, STEEPER)
        return ((1 + RATIO) * ratio - RATIO) * _sigmoid(self.level, EXPONENT)

    def achromatic(self, r: Any, g: Any, b: Any) -> Any:
        return (2 * r + g + b / 20 - 0.305) * self.nbb


@lru_cache(maxsize=64)
def _conditions(white: tuple[float, ...], la: float, yb: float, c: float, nc: float, f: float) -> _Model:
    k = (1 / (5 * la + 1)) ** 4
    level = 0.2 * k * 5 * la + 0.1 * (1 - k) ** 2 * np.cbrt(5 * la)
    degree = f * (1 - np.exp(-(la + 42) / 92) / 3.6)
    adaptation = degree * white[1] / (CONES @ white) + 1 - degree
    n = yb / white[1]
    nbb = 0.725 / n**0.2
    model = _Model(
        level=level,
        gains=tuple(level * adaptation),
        nbb=nbb,
        power=c * (1.48 + np.sqrt(n)),
        induction=50000 / 13 * nc * nbb,
        background=(1.64 - 0.29**n) ** 0.73,
        slope=0.0,
        white=0.0,
    )
    knee = KNEE * level
    model = replace(model, slope=model._curve(knee) / knee)
    return replace(
        model, white=model.achromatic(*(model.compress(CONES @ white * model.gains / 100) + _NOISE))
    )


def _model(element: Any) -> _Model:
    return _conditions(
        tuple(element.white),
        element.luminance,
        element.background,
        element.surround,
        element.induction,
        element.adaptation,
    )
