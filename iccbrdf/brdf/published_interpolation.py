"""The papers' map from XYZ to parameters: inverse distances over as many nodes as reproduce the colour best.

For an input I and nodes I_1..I_N with parameters B_1..B_N, as in [Habib2020]:

1.  order the nodes by d_i = ||C - C_i||_p, C and C_i the chromaticities (x, y, z) of I and I_i;
2.  for n = 1..N, over the first n nodes: w = ||I - I_S||^exponent, T' = sum I_S w / sum w and
    E' = CIEDE2000(T', I);
3.  keep the n with the least E', the smaller one where two are equal: T = T', B = sum B_S w / sum w;
4.  multiply kd by I / T, for each of X, Y, Z.

Where the papers leave it open or differ:

-   Equal d_i: the order in the file.  Chromaticities of nodes are rounded to 6 digits, finer than they are
    measured, so that white and a grey tie in every precision.
-   d is taken over all three chromaticity coordinates, as in [Habib2020]; [Habib2023] prints ||I - I_S|| for
    this order too.
-   The exponent is -1 as in [Habib2020].  [Habib2023] prints D^1, which gives far nodes the greater weight:
    available, not the default.
-   I equal to a node: its parameters, exactly.
-   I with X + Y + Z <= 0 has no chromaticity and takes the perfect diffuser's.
-   T is a mean of nodes above 0 with weights above 0, so nothing is divided by 0.
-   A negative component of I: kd is held at 0 there.  XYZ = 0 therefore has kd = 0.

The choice of n makes the map discontinuous: ks and m jump in smooth gradients.

References
----------
-   [Habib2020] T. Habib, P. Green, P. Nussbaum: BRDF rendering by interpolation of optimised model
    parameters. Color and Imaging Conference 28, 2020.
-   [Habib2023] T. Habib, P. Green, P. Nussbaum: An appearance reproduction framework for printed 3D
    surfaces. Journal of Imaging Science and Technology, 2023.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.cook_torrance import channels
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.primaries import Primaries, check_nodes
from iccbrdf.errors import UsageError

CHROMATICITY_DIGITS = 6
"""To which the chromaticities of nodes are rounded."""

LARGEST_EXPONENT = 4
"""Of the weights, in magnitude: they stay within the range of float64."""


def interpolate_published(
    XYZ: ArrayLike, primaries: Primaries, *, p: float = 2, exponent: float = -1
) -> Array:
    """
    Return the parameters of colours by the papers' algorithm.

    Parameters
    ----------
    XYZ
        Shape (..., 3), Y = 1 for the perfect diffuser, finite.
    primaries
        4 to 16 nodes of any model.
    p
        Norm of the chromaticity distance, at least 1; infinity for the largest component.
    exponent
        Of the distances as weights, -4 to 4.

    Returns
    -------
    Parameters in the order of the model's channels, shape (..., k).

    Raises
    ------
    InputError
        Too few or too many nodes, nodes that coincide, or a node's XYZ that is not above 0.
    UsageError
        `p` or `exponent` out of range, or an array of the wrong width.
    """
    if not p >= 1:
        raise UsageError(f"p is {p}, expected a number of at least 1")
    if not abs(exponent) <= LARGEST_EXPONENT:
        raise UsageError(f"exponent is {exponent}, expected -{LARGEST_EXPONENT} to {LARGEST_EXPONENT}")
    check_nodes(primaries)
    XYZ, white = channels("XYZ", XYZ, 3), np.array(primaries.white)
    nodes, parameters = primaries.XYZ, primaries.parameters

    order = chromaticity_order(XYZ, nodes, white, p)
    D = np.linalg.norm(XYZ[..., np.newaxis, :] - nodes, axis=-1)
    is_node = D == 0
    w = np.where(is_node, 1.0, D) ** exponent

    w_ordered = np.take_along_axis(w, order, axis=-1)[..., np.newaxis]
    T_of_n = np.cumsum(nodes[order] * w_ordered, axis=-2) / np.cumsum(w_ordered, axis=-2)
    E_of_n = delta_E_CIE2000(XYZ_to_Lab(T_of_n, white), XYZ_to_Lab(XYZ, white)[..., np.newaxis, :])
    # argmin takes the first of equal ones, which is the smallest n.
    best = np.argmin(E_of_n, axis=-1)[..., np.newaxis]
    T = np.take_along_axis(T_of_n, best[..., np.newaxis], axis=-2)[..., 0, :]

    w_kept = np.where(np.argsort(order, axis=-1) <= best, w, 0.0)
    B: Array = w_kept @ parameters / np.sum(w_kept, axis=-1, keepdims=True)
    B[..., :3] = np.maximum(B[..., :3] * (XYZ / T), 0)
    at_node = parameters[np.argmax(is_node, axis=-1)]
    return np.where(np.any(is_node, axis=-1, keepdims=True), at_node, B)


def chromaticity_order(XYZ: Array, nodes: Array, white: Array, p: float) -> NDArray[np.intp]:
    """Return the nodes' numbers from the nearest in chromaticity to the farthest, shape (..., nodes)."""
    C = _chromaticity(np.where(np.sum(XYZ, axis=-1, keepdims=True) > 0, XYZ, white))
    C_nodes = _chromaticity(nodes).round(CHROMATICITY_DIGITS)
    d = np.linalg.norm(C[..., np.newaxis, :] - C_nodes, ord=p, axis=-1)
    return np.argsort(d, axis=-1, kind="stable")


def _chromaticity(XYZ: Array) -> Array:
    """x, y, z, shape (..., 3)."""
    chromaticity: Array = XYZ / np.sum(XYZ, axis=-1, keepdims=True)
    return chromaticity
