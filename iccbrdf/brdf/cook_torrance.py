"""Cook-Torrance reflection as the two papers print it, and in the stable form that the profiles compute.

The microfacet term of both papers is Rs = F D G / (pi cos theta_i cos theta_v), with the 1/pi of Cook and
Torrance (1982), not the 1/4 of later texts: a full dielectric coat therefore has a ks of about .25.

Every function of a model takes `form`:

`literal`
    the equations as printed, on the normalised half vector and the arc cosine of n . h;
`stable`
    the same values without their cancellations: tan^2 theta_h by the cross product, 1/cos^4 theta_h as
    (1 + tan^2 theta_h)^2, and G / cos theta_v as one minimum that stays bounded as the viewer nears the
    horizon, so that nothing is divided by a cosine that the result does not contain.

The literal form loses digits in cos theta_h near 1: an error of e in it is one of 2 e / m^2 in the
exponent of D.  With the few 1e-16 of float64 that is 2e-10 for m = 2e-3 and 1e-7 for m = 1e-4; the printed
path over the arc cosine and the tangent adds nothing to it.

References
----------
-   [Habib2020] T. Habib, P. Green, P. Nussbaum: BRDF rendering by interpolation of optimised model
    parameters. Color and Imaging Conference 28, 2020.
-   [Habib2023] T. Habib, P. Green, P. Nussbaum: An appearance reproduction framework for printed 3D
    surfaces. Journal of Imaging Science and Technology, 2023.
-   [Cook1982] R. Cook, K. Torrance: A reflectance model for computer graphics. ACM Transactions on
    Graphics 1(1), 1982.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.geometry import HORIZON, Array, Cosines, cosines, dot, is_lit, tan2_theta_h, unit
from iccbrdf.errors import UsageError, nearest

Form = Literal["stable", "literal"]
FresnelAngle = Literal["theta_i", "alpha"]

M_MIN = 1e-4
"""Roughness below this is held at this, by the profiles and in both forms here: D is 1/m^2 high."""


def fresnel_schlick(cosine: ArrayLike, refractive_index: ArrayLike = 1.5) -> Array:
    """
    Return the Fresnel term F = R0 + (1 - R0) (1 - cosine)^5 with R0 = ((1 - n) / (1 + n))^2.

    Parameters
    ----------
    cosine
        cos theta_i as [Habib2023] prints it, or cos alpha as [Cook1982] has it; 0..1, any shape.
    refractive_index
        Of the coat against air, at least 1.

    Returns
    -------
    Reflectance 0..1.

    Examples
    --------
    >>> print(fresnel_schlick(1.0).round(6), fresnel_schlick(0.0))
    0.04 1.0
    """
    n = np.asarray(refractive_index, dtype=np.float64)
    r0 = ((1 - n) / (1 + n)) ** 2
    fresnel: Array = r0 + (1 - r0) * (1 - np.asarray(cosine, dtype=np.float64)) ** 5
    return fresnel


def beckmann(theta_h: ArrayLike, m: ArrayLike) -> Array:
    """
    Return Beckmann's distribution as printed, D = exp(-(tan theta_h / m)^2) / (m^2 cos^4 theta_h).

    Parameters
    ----------
    theta_h
        Angle between half vector and normal in radians.
    m
        Root mean square slope of the facets, above 0.

    Examples
    --------
    >>> print(beckmann(0.0, 0.5))
    4.0
    """
    theta_h, m = np.asarray(theta_h, dtype=np.float64), np.asarray(m, dtype=np.float64)
    distribution: Array = np.exp(-((np.tan(theta_h) / m) ** 2)) / (m**2 * np.cos(theta_h) ** 4)
    return distribution


def beckmann_stable(tan2_h: ArrayLike, m: ArrayLike) -> Array:
    """Return `beckmann` from tan^2 theta_h: D = exp(-tan^2 / m^2) ((1 + tan^2) / m)^2."""
    tan2_h, m = np.asarray(tan2_h, dtype=np.float64), np.asarray(m, dtype=np.float64)
    distribution: Array = np.exp(-tan2_h / m**2) * ((1 + tan2_h) / m) ** 2
    return distribution


def geometric_attenuation(cosine: Cosines) -> Array:
    """
    Return the shadowing and masking of V-shaped grooves as printed.

    G = min(1, 2 cos theta_h cos theta_i / cos alpha, 2 cos theta_h cos theta_v / cos alpha).

    Examples
    --------
    >>> from iccbrdf.brdf.geometry import cosines, planar
    >>> print(geometric_attenuation(cosines(planar(0), planar(-80), planar(80))).round(6))
    1.0
    >>> print(geometric_attenuation(cosines(planar(0), planar(0), planar(80))).round(6))
    0.347296
    """
    towards_light = 2 * cosine.theta_h * cosine.theta_i / cosine.alpha
    towards_viewer = 2 * cosine.theta_h * cosine.theta_v / cosine.alpha
    return np.minimum(1.0, np.minimum(towards_light, towards_viewer))


def attenuation_over_cosine(cos_i: ArrayLike, cos_v: ArrayLike, cos_alpha: ArrayLike) -> Array:
    """
    Return G / cos theta_v = min(min(1, q cos theta_i) / cos theta_v, q) with q = 2 cos theta_h / cos alpha.

    As |i + v| = 2 cos alpha, cos theta_h = (cos theta_i + cos theta_v) / (2 cos alpha) and
    q = (cos theta_i + cos theta_v) / cos^2 alpha <= 4 / (cos theta_i + cos theta_v): bounded for every
    light above the surface, whatever the viewer does.

    Parameters
    ----------
    cos_i, cos_v, cos_alpha
        Cosines of theta_i, theta_v and alpha, above 0.
    """
    cos_i, cos_v = np.asarray(cos_i, dtype=np.float64), np.asarray(cos_v, dtype=np.float64)
    q = (cos_i + cos_v) / np.asarray(cos_alpha, dtype=np.float64) ** 2
    bounded: Array = np.minimum(np.minimum(1.0, q * cos_i) / cos_v, q)
    return bounded


def cook_torrance(
    kd: ArrayLike,
    ks: ArrayLike,
    m: ArrayLike,
    n: ArrayLike,
    light: ArrayLike,
    view: ArrayLike,
    *,
    refractive_index: float = 1.5,
    intensity: ArrayLike = np.pi,
    fresnel_angle: FresnelAngle = "theta_i",
    form: Form = "stable",
) -> Array:
    """
    Return the XYZ of the Cook-Torrance model of [Habib2023], BRDF1 and BRDF2.

    I = Ii cos theta_i (kd / pi + ks Rs) for each of X, Y, Z.  One m is BRDF1 (7 parameters), an m for each
    of X, Y, Z is BRDF2 (9).

    Parameters
    ----------
    kd, ks
        Diffuse and specular reflectance for X, Y, Z, relative to Y = 1 of the perfect diffuser; (..., 3).
    m
        Roughness.  The last axis tells the model, as in `kd` and `ks` it is the axis of X, Y, Z: a number
        or (..., 1) is BRDF1, (..., 3) is BRDF2.  Values below `M_MIN` are held there.
    n, light, view
        Normal, direction to the light, direction to the viewer; (..., 3), any length.
    refractive_index
        Of the coat, one for the material.
    intensity
        Irradiance Ii on a surface that faces the light; a number or (..., 1) or (..., 3).  With pi the
        perfect diffuser facing the light has Y = 1.
    fresnel_angle
        The angle of the Fresnel term: `theta_i` as [Habib2023] prints it, which breaks reciprocity, or
        `alpha`, which keeps it.
    form
        `stable` or `literal`; see the module.

    Returns
    -------
    XYZ, shape (..., 3), Y = 1 for white: exactly 0 where light or viewer are not above the horizon or a
    vector has no direction.

    Raises
    ------
    UsageError
        An unknown `form` or `fresnel_angle`, or an array of the wrong width.

    Examples
    --------
    >>> from iccbrdf.brdf.geometry import planar
    >>> cook_torrance([0.9, 1, 0.8], 0, 0.2, planar(0), planar(-60), planar(0)).round(6)
    array([0.45, 0.5 , 0.4 ])
    """
    kd, ks, m = channels("kd", kd, 3), channels("ks", ks, 3), channels("m", m, 1, 3)
    if fresnel_angle not in get_args(FresnelAngle):
        valid = get_args(FresnelAngle)
        raise UsageError(f"unknown fresnel_angle {fresnel_angle!r}: {nearest(fresnel_angle, valid)}")
    check_form(form)
    intensity = np.asarray(intensity, dtype=np.float64)
    cosine = cosines(n, light, view)
    # Samples below the horizon may divide by zero on their way to being set to 0.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        fresnel = fresnel_schlick(getattr(cosine, fresnel_angle), refractive_index)[..., np.newaxis]
        cos_i = cosine.theta_i[..., np.newaxis]
        if form == "literal":
            value = intensity * cos_i * (kd / np.pi + ks * fresnel * _facets(cosine, m))
        else:
            facets = _facets_stable(n, light, view, cosine, m)
            value = intensity / np.pi * (kd * cos_i + ks * fresnel * facets)
    return np.where(is_lit(cosine)[..., np.newaxis], value, 0.0)


def cook_torrance_2020(
    Rd: ArrayLike,
    ks: ArrayLike,
    m: ArrayLike,
    n: ArrayLike,
    light: ArrayLike,
    view: ArrayLike,
    *,
    intensity: ArrayLike = 1.0,
    ambient: ArrayLike = 0.0,
    form: Form = "stable",
) -> Array:
    """
    Return the XYZ of the Cook-Torrance model of [Habib2020], 5 parameters.

    I = Ia Ra + Ii cos theta_i (ks Rs + (1 - ks) Rd), with F = 1 in Rs and Ra = Rd.  This Rd has no 1/pi: it
    is the reflectance factor itself, so the intensity that shows the perfect diffuser with Y = 1 is 1 here,
    not pi as in the other models.

    Parameters
    ----------
    Rd
        Diffuse reflectance for X, Y, Z, (..., 3).
    ks, m
        Share of specular reflection, 0..1, and roughness; a number or (..., 1).  An m below `M_MIN` is held
        there.
    n, light, view
        Normal, direction to the light, direction to the viewer; (..., 3), any length.
    intensity, ambient
        Ii and Ia, a number or (..., 1) or (..., 3).
    form
        `stable` or `literal`; see the module.

    Returns
    -------
    XYZ, shape (..., 3).  The light's part is exactly 0 where light or viewer are not above the horizon.
    The ambient part comes from all around: it goes only with the viewer or the normal.

    Raises
    ------
    UsageError
        An unknown `form`, or an array of the wrong width.

    Examples
    --------
    >>> from iccbrdf.brdf.geometry import planar
    >>> cook_torrance_2020([0.9, 1, 0.8], 0.25, 0.2, planar(0), planar(-60), planar(60), ambient=0.1).round(6)
    array([4.406374, 4.453874, 4.358874])
    """
    Rd, ks, m = channels("Rd", Rd, 3), channels("ks", ks, 1), channels("m", m, 1)
    check_form(form)
    intensity, ambient = np.asarray(intensity, dtype=np.float64), np.asarray(ambient, dtype=np.float64)
    cosine = cosines(n, light, view)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        cos_i = cosine.theta_i[..., np.newaxis]
        if form == "literal":
            value = intensity * cos_i * (ks * _facets(cosine, m) + (1 - ks) * Rd)
        else:
            facets = _facets_stable(n, light, view, cosine, m)
            value = intensity * (ks / np.pi * facets + (1 - ks) * Rd * cos_i)
    direct = np.where(is_lit(cosine)[..., np.newaxis], value, 0.0)
    return direct + np.where(cosine.theta_v[..., np.newaxis] > HORIZON, ambient * Rd, 0.0)


def channels(name: str, value: ArrayLike, *widths: int) -> Array:
    """
    Return a parameter as float64 with the axis of its channels last; a number gets an axis of length 1.

    Parameters
    ----------
    name
        For the message.
    value
        A number or an array (..., width).
    widths
        The widths that are allowed.

    Raises
    ------
    UsageError
        The last axis has none of these widths.
    """
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0:
        return array.reshape(1) if 1 in widths else np.broadcast_to(array, widths[:1])
    if array.shape[-1] not in widths:
        expected = " or ".join(f"(..., {width})" for width in widths)
        raise UsageError(f"{name} has the shape {array.shape}, expected a number or {expected}")
    return array


def check_form(form: str) -> None:
    """Raise UsageError unless `form` is one of `stable` and `literal`."""
    if form not in get_args(Form):
        raise UsageError(f"unknown form {form!r}: {nearest(form, get_args(Form))}")


def _facets(cosine: Cosines, m: Array) -> Array:
    """D G / (pi cos theta_i cos theta_v) as printed, (..., 1) or (..., 3)."""
    # Rounding lifts a cosine above 1 now and then, which has no arc cosine.
    theta_h = np.arccos(np.clip(cosine.theta_h, -1.0, 1.0))
    distribution = beckmann(theta_h[..., np.newaxis], np.maximum(m, M_MIN))
    geometric = geometric_attenuation(cosine) / (np.pi * cosine.theta_i * cosine.theta_v)
    facets: Array = distribution * geometric[..., np.newaxis]
    return facets


def _facets_stable(n: ArrayLike, light: ArrayLike, view: ArrayLike, cosine: Cosines, m: Array) -> Array:
    """D G / cos theta_v, which is pi cos theta_i times `_facets`, (..., 1) or (..., 3)."""
    half = unit(light) + unit(view)
    distribution = beckmann_stable(tan2_theta_h(unit(n), half)[..., np.newaxis], np.maximum(m, M_MIN))
    cos_alpha = np.sqrt(dot(half, half)) / 2
    geometric = attenuation_over_cosine(cosine.theta_i, cosine.theta_v, cos_alpha)
    facets: Array = distribution * geometric[..., np.newaxis]
    return facets
