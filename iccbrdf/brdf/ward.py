"""Ward's isotropic reflection model, as [Habib2020] prints it.

References
----------
-   [Habib2020] T. Habib, P. Green, P. Nussbaum: BRDF rendering by interpolation of optimised model
    parameters. Color and Imaging Conference 28, 2020.
-   [Ward1992] G. Ward: Measuring and modeling anisotropic reflection. SIGGRAPH 1992.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.cook_torrance import M_MIN, Form, channels, check_form
from iccbrdf.brdf.geometry import Array, cosines, is_lit, tan2_theta_h, unit


def ward(
    Rd: ArrayLike,
    ks: ArrayLike,
    m: ArrayLike,
    n: ArrayLike,
    light: ArrayLike,
    view: ArrayLike,
    *,
    intensity: ArrayLike = np.pi,
    form: Form = "stable",
) -> Array:
    """
    Return the XYZ of Ward's isotropic model, 5 parameters.

    I = Ii cos theta_i (Rd / pi + ks exp(-tan^2 delta / m^2) / (4 pi m^2 sqrt(cos theta_i cos theta_r))).

    delta is the angle between half vector and normal.  In the plane of [Habib2020] that is half the
    difference of theta_i and theta_r, with theta_r positive on the mirror side.

    Parameters
    ----------
    Rd
        Diffuse reflectance for X, Y, Z, relative to Y = 1 of the perfect diffuser; (..., 3).
    ks, m
        Specular reflectance and roughness; a number or (..., 1).  An m below `M_MIN` is held there.
    n, light, view
        Normal, direction to the light, direction to the viewer; (..., 3), any length.
    intensity
        Irradiance Ii on a surface that faces the light; a number or (..., 1) or (..., 3).  With pi the
        perfect diffuser facing the light has Y = 1.
    form
        `literal` as printed, from the arc cosine of n . h; or `stable`, with tan^2 delta from the cross
        product and cos theta_i / sqrt(cos theta_i cos theta_r) as sqrt(cos theta_i / cos theta_r).

    Returns
    -------
    XYZ, shape (..., 3), Y = 1 for white: exactly 0 where light or viewer are not above the horizon or a
    vector has no direction.  The model itself grows without bound as the viewer nears the horizon.

    Raises
    ------
    UsageError
        An unknown `form`, or an array of the wrong width.

    Examples
    --------
    >>> from iccbrdf.brdf.geometry import planar
    >>> ward([0.9, 1, 0.8], 0.16, 0.2, planar(0), planar(-60), planar(60)).round(6)
    array([1.45, 1.5 , 1.4 ])
    """
    Rd, ks, m = channels("Rd", Rd, 3), channels("ks", ks, 1), channels("m", m, 1)
    check_form(form)
    intensity, m = np.asarray(intensity, dtype=np.float64), np.maximum(m, M_MIN)
    cosine = cosines(n, light, view)
    cos_i, cos_r = cosine.theta_i[..., np.newaxis], cosine.theta_v[..., np.newaxis]
    # Samples below the horizon may divide by zero on their way to being set to 0.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if form == "literal":
            # Rounding lifts a cosine above 1 now and then, which has no arc cosine.
            delta = np.arccos(np.clip(cosine.theta_h, -1.0, 1.0))[..., np.newaxis]
            lobe = np.exp(-(np.tan(delta) ** 2) / m**2) / (4 * np.pi * m**2 * np.sqrt(cos_i * cos_r))
            value = intensity * cos_i * (Rd / np.pi + ks * lobe)
        else:
            tan2_delta = tan2_theta_h(unit(n), unit(light) + unit(view))[..., np.newaxis]
            lobe = np.exp(-tan2_delta / m**2) / (4 * m**2) * np.sqrt(cos_i / cos_r)
            value = intensity / np.pi * (Rd * cos_i + ks * lobe)
    return np.where(is_lit(cosine)[..., np.newaxis], value, 0.0)
