"""Spectra and CIELAB to XYZ relative to the perfect diffuser.

References
----------
-   [CIE15] CIE 15:2004, Colorimetry, 3rd edition.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.primaries import white_of
from iccbrdf.errors import UsageError
from iccbrdf.measure.measurements import Measurements

SPECTRAL_ILLUMINANT, SPECTRAL_OBSERVER = "D65", "CIE 1964 10 Degree Standard Observer"
"""What spectra are weighted by where nothing else is asked for: the papers' viewing conditions."""

FIRST_NEEDED, LAST_NEEDED, STEP_NEEDED = 400.0, 700.0, 20.0
"""Wavelengths in nm that a spectrum must span, and their largest distance, to be turned into XYZ."""


def weights(wavelengths: ArrayLike, illuminant: str, observer: str) -> Array:
    """
    Return the weights that turn a spectrum into XYZ: `XYZ = spectrum @ weights`.

    The spectrum is interpolated to 1 nm (Sprague's formula where the wavelengths are equally spaced) and held
    beyond its ends, as [CIE15] recommends, then summed with illuminant and colour-matching functions.

    Parameters
    ----------
    wavelengths
        In nm, ascending, shape (w,), w at least 6.
    illuminant, observer
        One of `iccbrdf.brdf.primaries.ILLUMINANTS`, one of its `OBSERVERS`.

    Returns
    -------
    Weights, shape (w, 3), whose sum is the XYZ of the perfect diffuser, Y = 1.

    Raises
    ------
    UsageError
        Wavelengths that do not span 400 to 700 nm in steps of at most 20 nm.
    """
    wavelengths = np.asarray(wavelengths, dtype=np.float64)
    gap = spectral_gap(wavelengths)
    if gap:
        raise UsageError(gap)
    found: Array = _weights(tuple(wavelengths.tolist()), illuminant, observer).copy()
    return found


def spectral_gap(wavelengths: Array) -> str:
    """Return why wavelengths (w,) in nm do not allow XYZ, or an empty text where they do."""
    first, last, step = wavelengths[0], wavelengths[-1], np.diff(wavelengths).max(initial=0)
    if first <= FIRST_NEEDED and last >= LAST_NEEDED and step <= STEP_NEEDED:
        return ""
    return (
        f"the wavelengths run from {first:g} to {last:g} nm in steps of up to {step:g}, expected "
        f"{FIRST_NEEDED:g} to {LAST_NEEDED:g} or more in steps of at most {STEP_NEEDED:g}"
    )


@lru_cache(maxsize=32)
def _weights(wavelengths: tuple[float, ...], illuminant: str, observer: str) -> Array:
    # Takes a second to import, and tables of XYZ do without.
    import colour

    matching_functions = colour.MSDS_CMFS[observer]
    shape = matching_functions.shape
    light = colour.SDS_ILLUMINANTS[illuminant].copy().align(shape).values
    # Interpolation is linear in the samples: that of unit spectra is that of any.
    units = colour.MultiSpectralDistributions(np.eye(len(wavelengths)), wavelengths).align(shape).values
    products = light[:, np.newaxis] * matching_functions.values
    summed: Array = units.T @ products / products[:, 1].sum()
    return summed


def under(measurements: Measurements, illuminant: str, observer: str) -> Measurements:
    """
    Return measurements whose XYZ are those of another illuminant and observer.

    Raises
    ------
    UsageError
        They hold no spectra, or the wavelengths do not allow it.
    """
    if (illuminant, observer) == (measurements.illuminant, measurements.observer):
        return measurements
    if measurements.spectra is None or measurements.wavelengths is None:
        raise UsageError(
            f"measurements of XYZ under {measurements.illuminant}, {measurements.observer}, hold no spectra: "
            f"they cannot be turned into {illuminant}, {observer}"
        )
    return replace(
        measurements,
        XYZ=measurements.spectra @ weights(measurements.wavelengths, illuminant, observer),
        illuminant=illuminant,
        observer=observer,
        white=white_of(illuminant, observer),
    )


def Lab_to_XYZ(Lab: ArrayLike, white: ArrayLike) -> Array:
    """
    Return XYZ of CIE 1976 L*a*b* [CIE15], the inverse of `iccbrdf.brdf.colour_difference.XYZ_to_Lab`.

    Parameters
    ----------
    Lab
        L*, a*, b*, shape (..., 3).
    white
        XYZ of the perfect diffuser, shape (3,).

    Returns
    -------
    XYZ in the scale of `white`, shape (..., 3).
    """
    L, a, b = np.moveaxis(np.asarray(Lab, dtype=np.float64), -1, 0)
    y = (L + 16) / 116
    f = np.stack([y + a / 500, y, y - b / 200], axis=-1)
    ratio = np.where(f > 6 / 29, f**3, (f - 4 / 29) * (108 / 841))
    XYZ: Array = ratio * np.asarray(white, dtype=np.float64)
    return XYZ
