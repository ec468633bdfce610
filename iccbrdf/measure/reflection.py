"""How the synthetic print reflects: physical terms, none of which the fitted models hold.

The fitted models have Beckmann's distribution, Schlick's Fresnel term and a Lambertian base.  This one has
GGX facets with Smith's shadowing, the exact Fresnel term of a dielectric, and a rough diffuse base
that is seen through the surface.

References
----------
-   [Walter2007] B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet models for refraction through rough
    surfaces. Eurographics Symposium on Rendering, 2007.
-   [Heitz2014] E. Heitz: Understanding the masking-shadowing function in microfacet-based BRDFs. Journal of
    Computer Graphics Techniques 3(2), 2014.
-   [Oren1994] M. Oren, S. Nayar: Generalization of Lambert's reflectance model. SIGGRAPH, 1994.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.geometry import Array, Cosines


def fresnel(cosine: ArrayLike, refractive_index: ArrayLike) -> Array:
    """
    Return the share of unpolarised light that a dielectric reflects ([Walter2007], Eq 22).

    Parameters
    ----------
    cosine
        Of the angle between light and facet, 0..1.
    refractive_index
        Against air, above 1.  The two broadcast.
    """
    c = np.asarray(cosine, dtype=np.float64)
    g = np.sqrt(np.asarray(refractive_index, dtype=np.float64) ** 2 - 1 + c**2)
    share: Array = ((g - c) / (g + c)) ** 2 / 2 * (1 + ((c * (g + c) - 1) / (c * (g - c) + 1)) ** 2)
    return share


def ggx_facets(cosine: Cosines, tan2_theta_h: Array, alpha: ArrayLike) -> Array:
    """
    Return D G / (4 cos theta_i cos theta_v) of GGX facets, 1/sr: the specular BRDF but for the Fresnel term.

    Parameters
    ----------
    cosine
        Of the geometries, (...), light and viewer above the surface.
    tan2_theta_h
        Squared tangent of the half vector's angle, (...).
    alpha
        Roughness of GGX, broadcasts with the geometries.  D is [Walter2007], Eq 33, and G [Heitz2014], Eq 99,
        height-correlated.
    """
    squared = np.asarray(alpha, dtype=np.float64) ** 2
    distribution = squared * (1 + tan2_theta_h) ** 2 / (np.pi * (squared + tan2_theta_h) ** 2)
    light, viewer = (
        (np.sqrt(1 + squared * (1 / cos**2 - 1)) - 1) / 2 for cos in (cosine.theta_i, cosine.theta_v)
    )
    facets: Array = distribution / (1 + light + viewer) / (4 * cosine.theta_i * cosine.theta_v)
    return facets


def oren_nayar(cosine: Cosines, cos_light_viewer: Array, sigma: float) -> Array:
    """
    Return pi times the BRDF of rough facets of albedo 1 ([Oren1994], Eq 30, the qualitative model).

    Parameters
    ----------
    cosine
        Of the geometries, (...), light and viewer above the surface.
    cos_light_viewer
        Cosine of the angle between light and viewer, (...).
    sigma
        Standard deviation of the facets' slopes in radians; 0 gives Lambert's 1.
    """
    A = 1 - 0.5 * sigma**2 / (sigma**2 + 0.33)
    B = 0.45 * sigma**2 / (sigma**2 + 0.09)
    # sin alpha tan beta cos(phi_v - phi_i), the larger angle being alpha and the smaller beta.
    sines_and_azimuth = cos_light_viewer - cosine.theta_i * cosine.theta_v
    rough: Array = A + B * np.maximum(sines_and_azimuth, 0) / np.maximum(cosine.theta_i, cosine.theta_v)
    return rough
