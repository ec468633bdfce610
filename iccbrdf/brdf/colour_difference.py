"""CIELAB and CIEDE2000 of whole arrays, without the import of colour-science, which costs a second.

References
----------
-   [CIE15] CIE 15:2004, Colorimetry, 3rd edition.
-   [Sharma2005] G. Sharma, W. Wu, E. Dalal: The CIEDE2000 color-difference formula. Implementation notes,
    supplementary test data, and mathematical observations. Color Research and Application 30(1), 2005.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.geometry import Array

_LARGEST_CHROMA = 1e5
"""Beyond it C^7 / (C^7 + 25^7) is 1 to the last digit; C^7 itself would leave the range of float64."""


def XYZ_to_Lab(XYZ: ArrayLike, white: ArrayLike) -> Array:
    """
    Return CIE 1976 L*a*b* [CIE15].

    Parameters
    ----------
    XYZ
        Shape (..., 3), any scale.  Values up to 0 lie on the straight part of the formula and stay finite.
    white
        XYZ of the perfect diffuser in the same scale, (3,) or (..., 3), above 0.

    Returns
    -------
    L*, a*, b*, shape (..., 3), L* = 100 for white.

    Examples
    --------
    >>> XYZ_to_Lab([0.4, 0.2, 0.1], [0.9642, 1, 0.8249]).round(4)
    array([51.8372, 80.5056, 17.9772])
    """
    ratio = np.asarray(XYZ, dtype=np.float64) / np.asarray(white, dtype=np.float64)
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio * (841 / 108) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def delta_E_CIE2000(Lab_1: ArrayLike, Lab_2: ArrayLike) -> Array:
    """
    Return CIEDE2000 with kL = kC = kH = 1 [Sharma2005].

    Parameters
    ----------
    Lab_1, Lab_2
        L*, a*, b*, shapes (..., 3) that broadcast.

    Returns
    -------
    Differences, shape (...), exactly 0 for equal colours.

    Examples
    --------
    >>> print(delta_E_CIE2000([50, 2.6772, -79.7751], [50, 0, -82.7485]).round(4))
    2.0425
    """
    L_1, a_1, b_1 = np.moveaxis(np.asarray(Lab_1, dtype=np.float64), -1, 0)
    L_2, a_2, b_2 = np.moveaxis(np.asarray(Lab_2, dtype=np.float64), -1, 0)

    stretch = 1.5 - 0.5 * _share_of_chroma((np.hypot(a_1, b_1) + np.hypot(a_2, b_2)) / 2)
    C_1, h_1 = np.hypot(stretch * a_1, b_1), _hue(stretch * a_1, b_1)
    C_2, h_2 = np.hypot(stretch * a_2, b_2), _hue(stretch * a_2, b_2)

    # A grey has no hue, but needs no case of its own: it makes dH 0, by which every use of hue is multiplied.
    turn = h_2 - h_1
    dh = turn - 360 * np.sign(turn) * (np.abs(turn) > 180)
    dL, dC, dH = L_2 - L_1, C_2 - C_1, 2 * np.sqrt(C_1 * C_2) * np.sin(np.radians(dh / 2))

    L, C, h = (L_1 + L_2) / 2, (C_1 + C_2) / 2, (h_1 + h_2) / 2
    # The mean of the shorter way round.
    h = h + np.where(np.abs(turn) > 180, np.where(h < 180, 180.0, -180.0), 0.0)

    T = (
        1
        - 0.17 * np.cos(np.radians(h - 30))
        + 0.24 * np.cos(np.radians(2 * h))
        + 0.32 * np.cos(np.radians(3 * h + 6))
        - 0.20 * np.cos(np.radians(4 * h - 63))
    )
    S_L = 1 + 0.015 * (L - 50) ** 2 / np.sqrt(20 + (L - 50) ** 2)
    S_C = 1 + 0.045 * C
    S_H = 1 + 0.015 * C * T
    rotation = 60 * np.exp(-(((h - 275) / 25) ** 2))
    R_T = -2 * _share_of_chroma(C) * np.sin(np.radians(rotation))

    lightness, chroma, hue = dL / S_L, dC / S_C, dH / S_H
    difference: Array = np.sqrt(lightness**2 + chroma**2 + hue**2 + R_T * chroma * hue)
    return difference


def _hue(a: Array, b: Array) -> Array:
    """Hue angle in degrees, 0..360."""
    hue: Array = np.degrees(np.arctan2(b, a)) % 360
    return hue


def _share_of_chroma(C: Array) -> Array:
    """The formula's sqrt(C^7 / (C^7 + 25^7)), 0 for greys to 1."""
    C_7 = np.minimum(C, _LARGEST_CHROMA) ** 7
    share: Array = np.sqrt(C_7 / (C_7 + 25**7))
    return share
