"""A synthetic print.  This is a simulation: no goniometric measurement of printed CMYK patches is public.

Its truth is not one of the fitted models (`iccbrdf.measure.reflection`).  A halftone is a mixture of paper
and solid overprints by Demichel's areas [Neugebauer1937], with dot gain; colours and lobes mix alike.  The
solids have the smoothest spectra that give, with their gloss, the FOGRA39 figures at 45:0.  On a slope, films
are thinner, dots spread and the surface is rougher.  What no figure tells (roughness, the base's texture, the
behaviour on slopes) is drawn by the seed from plausible ranges: each seed is another print.

References
----------
-   [Neugebauer1937] H. E. J. Neugebauer: Die theoretischen Grundlagen des Mehrfarbenbuchdrucks.
    Zeitschrift für wissenschaftliche Photographie 36, 1937.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iccbrdf.brdf.geometry import Array, cosines, dot, planar, tan2_theta_h
from iccbrdf.measure import fogra39
from iccbrdf.measure.colorimetry import weights
from iccbrdf.measure.reflection import fresnel, ggx_facets, oren_nayar
from iccbrdf.measure.smooth_spectra import smoothest_spectra

WAVELENGTHS = np.arange(400.0, 701.0, 10.0)
"""Of the simulation, nm."""

_NORMAL = planar(0)
_SOLIDS = np.array(list(fogra39.SOLIDS), dtype=np.float64) / 100
"""Which inks each solid has, (16, 4)."""

_ALPHA = {"paper": 0.16, "one ink": 0.14, "overprint": 0.11, "black": 0.08}
"""Typical roughness of GGX: the more ink, the glossier.

At 45:0 the gloss of black overprints must stay below the 0.65 per cent of Z that FOGRA39 reflects there,
which allows no rougher ones.
"""


@dataclass(frozen=True)
class Behaviour:
    """What is drawn by the seed."""

    alpha: Array
    """Roughness of GGX of the 16 solids, in the order of `fogra39.SOLIDS`."""
    base_slope: float
    """Standard deviation of the diffuse base's slopes, radians."""
    dispersion: float
    """Of the surface: its refractive index is 1.48 + dispersion / wavelength^2, in micrometres."""
    thinning: float
    """On a slope, films are cos(slope)^thinning as thick as on the flat."""
    spreading: float
    """Share by which dot gain is larger on a slope of 60 degrees; in between it goes with 1 - cos."""
    roughening: float
    """Share by which the roughness is larger on a slope of 60 degrees; in between it goes with 1 - cos."""


def draw_behaviour(random: np.random.Generator) -> Behaviour:
    """Return the behaviour of a print, drawn from plausible ranges."""
    inks = _SOLIDS.sum(axis=1)
    kinds = np.select([_SOLIDS[:, 3] > 0, inks > 1, inks == 1], ["black", "overprint", "one ink"], "paper")
    typical = np.array([_ALPHA[kind] for kind in kinds])
    return Behaviour(
        alpha=typical * random.uniform(0.88, 1.14, len(typical)),
        base_slope=float(np.radians(random.uniform(10, 25))),
        dispersion=float(random.uniform(0.003, 0.006)),
        thinning=float(random.uniform(0.3, 0.7)),
        spreading=float(random.uniform(0.2, 0.6)),
        roughening=float(random.uniform(0.3, 0.9)),
    )


@dataclass(frozen=True)
class Film:
    """How one printed patch deviates from the print's behaviour, shapes (patches,); 1 is not at all."""

    thickness: Array
    roughness: Array


class SyntheticPrint:
    """
    The simulated truth: pi times the BRDF of any halftone on any slope in any geometry.

    Parameters
    ----------
    behaviour
        What the FOGRA39 figures do not tell.
    """

    def __init__(self, behaviour: Behaviour) -> None:
        self.behaviour = behaviour
        self.refractive_index = 1.48 + behaviour.dispersion / (WAVELENGTHS / 1000) ** 2
        light, view = planar([-45.0]), planar([0.0])
        self._base_45_0 = self._base_factor(light, view)
        gloss = self._gloss(np.eye(len(_SOLIDS)), np.ones(len(_SOLIDS)), light, view)[:, 0]
        to_XYZ = weights(WAVELENGTHS, fogra39.ILLUMINANT, fogra39.OBSERVER)
        figures = np.array(list(fogra39.SOLIDS.values())) / 100
        self.base = smoothest_spectra(figures - gloss @ to_XYZ, to_XYZ)
        """Pi times the BRDF at 45:0 of the solids less their gloss, (16, wavelengths)."""

    def reflectance(self, cmyk: Array, slopes: Array, light: Array, view: Array, film: Film) -> Array:
        """
        Return pi times the BRDF.

        Parameters
        ----------
        cmyk
            Inks in per cent, (patches, 4).
        slopes
            Slope that each patch is printed on in degrees, (patches,).
        light, view
            Unit vectors in the frame of the slope, (geometries, 3), above the surface.
        film
            Deviation of each patch from the print's behaviour.

        Returns
        -------
        Shape (patches, geometries, wavelengths).
        """
        cosine = planar(slopes)[:, 2]
        # 0 on the flat, 1 at 60 degrees.
        steepness = 2 * (1 - cosine)
        gain = np.multiply.outer(1 + self.behaviour.spreading * steepness, fogra39.TONE_VALUE_INCREASE)
        areas = demichel(dot_areas(cmyk / 100, gain))
        solids = self._solids(film.thickness * cosine**self.behaviour.thinning)
        colours = np.einsum("pk,pkw->pw", areas, solids)
        base = colours[:, np.newaxis] * (self._base_factor(light, view) / self._base_45_0)
        roughness = film.roughness * (1 + self.behaviour.roughening * steepness)
        reflected: Array = base + self._gloss(areas, roughness, light, view)
        return reflected

    def _solids(self, thickness: Array) -> Array:
        """Base of the solids where the films have a thickness (patches,), (patches, 16, wavelengths).

        Paper white is a layer that scatters and does not absorb, R = t / (1 + t) with t its scattering power
        (Kubelka-Munk); an ink is a film on it whose density goes with its thickness.
        """
        thickness = thickness[:, np.newaxis, np.newaxis]
        white = self.base[0]
        power = thickness * white / (1 - white)
        solids: Array = power / (1 + power) * (self.base / white) ** thickness
        return solids

    def _gloss(self, areas: Array, roughness: Array, light: Array, view: Array) -> Array:
        """Pi times the specular BRDF, a mixture of the solids' lobes, (patches, geometries, wavelengths)."""
        cosine = cosines(_NORMAL, light, view)
        tan2 = tan2_theta_h(_NORMAL, light + view)
        alpha = np.multiply.outer(roughness, self.behaviour.alpha)[..., np.newaxis]
        lobes = np.einsum("pk,pkg->pg", areas, ggx_facets(cosine, tan2, alpha))
        mirrored = fresnel(cosine.alpha[:, np.newaxis], self.refractive_index)
        gloss: Array = np.pi * lobes[..., np.newaxis] * mirrored
        return gloss

    def _base_factor(self, light: Array, view: Array) -> Array:
        """Pi times the BRDF of a base of albedo 1 seen through the surface, (geometries, wavelengths)."""
        cosine = cosines(_NORMAL, light, view)
        into, out_of = (
            1 - fresnel(cos[:, np.newaxis], self.refractive_index) for cos in (cosine.theta_i, cosine.theta_v)
        )
        rough = oren_nayar(cosine, dot(light, view), self.behaviour.base_slope)
        return rough[:, np.newaxis] * into * out_of


def dot_areas(tone_values: Array, gain: Array) -> Array:
    """
    Return the areas that dots cover, a + 4 gain a (1 - a), at most 1.

    Parameters
    ----------
    tone_values
        Of C, M, Y, K in the printing data, 0..1, (..., 4).
    gain
        Increase at half tone, broadcasts.
    """
    areas: Array = np.minimum(tone_values + 4 * gain * tone_values * (1 - tone_values), 1.0)
    return areas


def demichel(areas: Array) -> Array:
    """
    Return the areas of paper and overprints under dots that lie independently of each other.

    Parameters
    ----------
    areas
        That the dots of C, M, Y, K cover, (..., 4).

    Returns
    -------
    In the order of `fogra39.SOLIDS`, sum 1, (..., 16).
    """
    dots = areas[..., np.newaxis, :]
    covered: Array = np.prod(np.where(_SOLIDS > 0, dots, 1 - dots), axis=-1)
    return covered
