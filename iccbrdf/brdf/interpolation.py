"""From the XYZ of a colour to the parameters of its reflection, by interpolation between the primaries.

Two methods: `published`, the papers' algorithm to the letter, which jumps where its choice of nodes changes
(`published_interpolation`); and `smooth`, which is continuous (`smooth_interpolation`).  Both hold at the
nodes and take 4 to 16 of them.  Which colours those are is the primaries file's matter: the papers use white,
C, M, Y, CM, CY, MY and as the eighth CMY (2020) or K (2023); recommended are nine, with both.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.cook_torrance import channels
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.primaries import Primaries
from iccbrdf.brdf.published_interpolation import interpolate_published
from iccbrdf.brdf.smooth_interpolation import SmoothMap
from iccbrdf.errors import UsageError, nearest

InterpolationMethod = Literal["smooth", "published"]


def interpolate(
    XYZ: ArrayLike,
    primaries: Primaries,
    *,
    method: InterpolationMethod = "smooth",
    p: float = 2,
    exponent: float = -1,
) -> Array:
    """
    Return the model's parameters of colours.

    Parameters
    ----------
    XYZ
        Shape (..., 3), Y = 1 for the perfect diffuser, in the primaries' illuminant; any real numbers.
    primaries
        4 to 16 nodes of any model.
    method
        `smooth` or `published`.
    p, exponent
        Norm of the chromaticity distance and exponent of the weights, of `published` only.

    Returns
    -------
    Parameters in the order of the model's channels, shape (..., k): diffuse reflectance at least 0, the rest
    above 0 where it is so at the nodes.  Finite for every XYZ that float32 can hold; not a number where an
    XYZ is infinite or not a number.

    Raises
    ------
    InputError
        Too few or too many nodes, nodes that coincide, or a node's XYZ that is not above 0.
    UsageError
        An unknown method, an array of the wrong width, `p` or `exponent` out of range.

    Examples
    --------
    >>> from iccbrdf.brdf.primaries import read_primaries
    >>> from iccbrdf.resources import folder
    >>> primaries = read_primaries(folder("profiles") / "fogra39_gloss" / "primaries.json")
    >>> interpolate([0.4, 0.4, 0.3], primaries).round(3)
    array([0.377, 0.377, 0.281, 0.26 , 0.269, 0.222, 0.254])
    """
    XYZ = channels("XYZ", XYZ, 3)
    has_place = np.all(np.isfinite(XYZ), axis=-1, keepdims=True)
    colours = np.where(has_place, XYZ, 0.0)
    if method == "smooth":
        parameters = SmoothMap.of(primaries).parameters(colours)
    elif method == "published":
        parameters = interpolate_published(colours, primaries, p=p, exponent=exponent)
    else:
        valid = get_args(InterpolationMethod)
        raise UsageError(f"unknown interpolation method {method!r}: {nearest(method, valid)}")
    return np.where(has_place, parameters, np.nan)
