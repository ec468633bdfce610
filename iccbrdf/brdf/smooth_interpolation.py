"""The continuous map from XYZ to parameters: linear radial basis functions over cube-root-coded XYZ.

Coded colour:  u = cbrt(max(XYZ / W, 0) + 0.01) for each of X, Y, Z, with W the perfect diffuser.
Values:        f(u) = constant + sum_i r_i coefficients_i,  r_i = |u - u_i|,  with the coefficients of a
               channel adding up to 0, and f(u_i) = f_i at every node.
Channels:      for diffuse reflectance f = kd - XYZ, so that kd = max(XYZ + f(u), 0); for all others
               f = ln, so that they are exp(f(u)) and stay positive.

This is the kernel -r with a constant, or what is the same, a mean of the nodes' values with weights that add
up to 1.  As the coefficients add up to 0, |f(u) - constant| <= sum_i |coefficients_i| |u_i| for every u: out
of the gamut gloss levels off.  The 0.01 bounds the slope of the cube root at black, so that steps of f are at
most in proportion to steps of XYZ.

The interpolated offset need not be 0 at XYZ = 0, where kd may be some thousandths.  A node whose gloss is 0
has no logarithm and counts as one of `GLOSS_FLOOR`.

References
----------
-   [Micchelli1986] C. Micchelli: Interpolation of scattered data: distance matrices and conditionally
    positive definite functions. Constructive Approximation 2, 1986. (The system has one solution.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.cook_torrance import channels
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.primaries import Primaries, check_nodes

KNEE = 0.01
"""Added to XYZ / W under the cube root."""

GLOSS_FLOOR = 1e-6
"""The least ks or m whose logarithm is taken."""

DIFFUSE = slice(0, 3)
"""The channels of kd or Rd, which stand first in every model."""

GLOSS = slice(3, None)
"""The channels of ks and m."""


@dataclass(frozen=True)
class SmoothMap:
    """The solved interpolation: the constants that a program needs to compute it."""

    white: Array
    """XYZ of the perfect diffuser, shape (3,)."""
    nodes: Array
    """Coded colours u_i of the nodes, shape (nodes, 3)."""
    coefficients: Array
    """Factors of the distances, by node and channel of the model, shape (nodes, k)."""
    constant: Array
    """Constant by channel of the model, shape (k,)."""

    @classmethod
    def of(cls, primaries: Primaries) -> SmoothMap:
        """
        Return the map through the primaries.

        Raises
        ------
        InputError
            Too few or too many nodes, nodes that coincide, or a node's XYZ that is not above 0.
        """
        check_nodes(primaries)
        white = np.array(primaries.white)
        nodes = coded(primaries.XYZ, white)
        values = np.hstack(
            [
                primaries.parameters[:, DIFFUSE] - primaries.XYZ,
                np.log(np.maximum(primaries.parameters[:, GLOSS], GLOSS_FLOOR)),
            ]
        )
        # The last row makes the coefficients add up to 0, the last column is the constant.
        count = len(nodes)
        system = np.ones((count + 1, count + 1))
        system[:count, :count] = _distances(nodes, nodes)
        system[count, count] = 0
        solution = np.linalg.solve(system, np.vstack([values, np.zeros(values.shape[1])]))
        return cls(white, nodes, solution[:count], solution[count])

    def parameters(self, XYZ: ArrayLike) -> Array:
        """
        Return the parameters of colours.

        Parameters
        ----------
        XYZ
            Shape (..., 3), Y = 1 for the perfect diffuser, finite.

        Returns
        -------
        Parameters in the order of the model's channels, shape (..., k).
        """
        XYZ = channels("XYZ", XYZ, 3)
        values = _distances(coded(XYZ, self.white), self.nodes) @ self.coefficients + self.constant
        kd = np.maximum(XYZ + values[..., DIFFUSE], 0)
        return np.concatenate([kd, np.exp(values[..., GLOSS])], axis=-1)


def coded(XYZ: ArrayLike, white: ArrayLike) -> Array:
    """
    Return u = cbrt(max(XYZ / white, 0) + KNEE), shape (..., 3).

    Near to lightness, in which print colours are more evenly spread than in XYZ.
    """
    ratio = np.asarray(XYZ, dtype=np.float64) / np.asarray(white, dtype=np.float64)
    u: Array = np.cbrt(np.maximum(ratio, 0) + KNEE)
    return u


def _distances(u: Array, nodes: Array) -> Array:
    """Distances of colours (..., 3) to nodes (n, 3), shape (..., n)."""
    return np.stack([np.linalg.norm(u - node, axis=-1) for node in nodes], axis=-1)
