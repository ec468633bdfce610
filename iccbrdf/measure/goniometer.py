"""A synthetic goniometer in the papers' geometries.  This is a simulation: it measures synthetic prints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iccbrdf.brdf.geometry import Array, direction, planar
from iccbrdf.brdf.primaries import white_of
from iccbrdf.measure.colorimetry import weights
from iccbrdf.measure.measurements import Measurements
from iccbrdf.measure.synthetic_print import WAVELENGTHS, Film, SyntheticPrint

INCIDENCES = (0.0, 15.0, 30.0, 45.0, 60.0)
VIEWING_ANGLES = tuple(np.arange(-65.0, 31.0, 5.0).tolist())

LAMP_EXCLUSIONS = (15, 20)
"""Degrees from the lamp up to which the viewer does not see the print for the lamp.

The papers print both 68 and 65 geometries.  Without normal incidence these are what exclusions of 15 and of
20 degrees leave, each with four mirror directions: our inference.
"""

DIGITS = 6
"""Decimals of the instrument's readings."""

# Seven points over a disc of radius 1 that integrate polynomials up to the fifth degree exactly.
_DISC_RADII = np.array([0, *[np.sqrt(2 / 3)] * 6])
_DISC_ANGLES = np.array([0, *range(0, 360, 60)])
_DISC_WEIGHTS = np.array([1 / 4, *[1 / 8] * 6])


@dataclass(frozen=True)
class Sensor:
    """The errors of the instrument."""

    noise: float = 0.01
    """Standard deviation of a reading, relative, common to all wavelengths.

    Each wavelength has half as much of its own, and a dark reading a fiftieth, the perfect diffuser being 1.
    """
    aperture: float = 1.0
    """Half angle in degrees of the cone that the sensor averages over, the lamp's size included."""


def goniometer_angles(lamp_exclusion: float) -> tuple[Array, Array]:
    """
    Return theta_i and theta_r in degrees, each (geometries,), by the papers' convention.

    Parameters
    ----------
    lamp_exclusion
        Viewing angles no further than this from the lamp are left out, degrees.
    """
    theta_i, theta_r = (grid.ravel() for grid in np.meshgrid(INCIDENCES, VIEWING_ANGLES, indexing="ij"))
    clear = np.abs(theta_r - theta_i) > lamp_exclusion
    return theta_i[clear], theta_r[clear]


def measure(
    truth: SyntheticPrint,
    patches: tuple[str, ...],
    cmyk: Array,
    slopes: Array,
    film: Film,
    *,
    sensor: Sensor,
    lamp_exclusion: float,
    illuminant: str,
    observer: str,
    source: str,
    random: np.random.Generator,
) -> Measurements:
    """
    Return simulated measurements of patches of a synthetic print.

    Parameters
    ----------
    truth
        The print.
    patches, cmyk, slopes, film
        Names, inks in per cent (patches, 4), slopes in degrees (patches,) and deviations.
    sensor, lamp_exclusion
        Errors of the instrument; degrees around the lamp that it cannot see.
    illuminant, observer
        Of the XYZ.
    random
        Draws the noise.
    """
    theta_i, theta_r = goniometer_angles(lamp_exclusion)
    view = _disc(theta_r, sensor.aperture)
    light = np.broadcast_to(planar(-theta_i)[:, np.newaxis], view.shape)
    seen = truth.reflectance(cmyk, slopes, light.reshape(-1, 3), view.reshape(-1, 3), film)
    spectra = np.einsum("pgqw,q->pgw", seen.reshape(len(patches), *view.shape[:2], -1), _DISC_WEIGHTS)
    common = sensor.noise * random.standard_normal((*spectra.shape[:2], 1))
    own = sensor.noise / 2 * random.standard_normal(spectra.shape)
    dark = sensor.noise / 50 * random.standard_normal(spectra.shape)
    readings = (spectra * (1 + common + own) + dark).round(DIGITS)
    return Measurements(
        patches=patches,
        theta_i=theta_i,
        theta_r=theta_r,
        phi=np.zeros_like(theta_i),
        XYZ=(readings @ weights(WAVELENGTHS, illuminant, observer)).round(DIGITS),
        illuminant=illuminant,
        observer=observer,
        white=white_of(illuminant, observer),
        source=source,
        cmyk=cmyk,
        slopes=slopes,
        wavelengths=WAVELENGTHS,
        spectra=readings,
    )


def _disc(theta_r: Array, half_angle: float) -> Array:
    """Directions over the cone around each viewing direction, (geometries, points, 3)."""
    around = direction(half_angle * _DISC_RADII, _DISC_ANGLES)
    # Turned from the z axis to the viewing direction, in the plane of incidence.
    z, x = planar(-theta_r), planar(90 - theta_r)
    y = np.array([0.0, 1.0, 0.0])
    directions: Array = np.einsum("qk,kgc->gqc", around, np.stack([x, np.broadcast_to(y, x.shape), z]))
    return directions
