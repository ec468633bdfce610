"""The table of models: what a pixel's parameters are called, in which order they stand, who computes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.cook_torrance import cook_torrance, cook_torrance_2020
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.ward import ward
from iccbrdf.errors import UsageError, nearest

NORMAL = ("n.x", "n.y", "n.z")
"""Channels of the normal, which follow those of a model's parameters."""


@dataclass(frozen=True)
class Model:
    """A reflection model and the layout of its parameters."""

    name: str
    title: str
    parameters: tuple[tuple[str, int], ...]
    """Families of parameters in channel order: name and width, 3 for X, Y, Z or 1."""
    function: Callable[..., Array]
    """Takes the families in this order, then n, light, view and `options` by keyword."""
    intensity: float
    """Default intensity, with which the perfect diffuser that faces the light has Y = 1."""
    options: tuple[str, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the parameter channels in order: `kd.X`, `kd.Y`, `kd.Z`, ..., `m`."""
        return tuple(
            f"{family}.{axis}" if axis else family
            for family, width in self.parameters
            for axis in ("XYZ" if width == 3 else ("",))
        )

    @property
    def has_fresnel(self) -> bool:
        """Whether the model knows a refractive index."""
        return "refractive_index" in self.options

    def split(self, parameters: ArrayLike) -> tuple[Array, ...]:
        """
        Split channels (..., k) into families (..., width).

        Raises
        ------
        UsageError
            The last axis is not as long as `channels`.
        """
        parameters = np.asarray(parameters, dtype=np.float64)
        names = self.channels
        if parameters.ndim == 0 or parameters.shape[-1] != len(names):
            raise UsageError(
                f"parameters of {self.name} have the shape {parameters.shape}, "
                f"expected (..., {len(names)}): {' '.join(names)}"
            )
        ends = np.cumsum([width for _, width in self.parameters])
        return tuple(np.split(parameters, ends[:-1], axis=-1))


MODELS: dict[str, Model] = {
    model.name: model
    for model in (
        Model(
            "brdf1",
            "Cook-Torrance with one roughness (Habib, Green, Nussbaum 2023, BRDF1)",
            (("kd", 3), ("ks", 3), ("m", 1)),
            cook_torrance,
            np.pi,
            ("refractive_index", "intensity", "fresnel_angle", "form"),
        ),
        Model(
            "brdf2",
            "Cook-Torrance with a roughness for each of X, Y, Z (Habib, Green, Nussbaum 2023, BRDF2)",
            (("kd", 3), ("ks", 3), ("m", 3)),
            cook_torrance,
            np.pi,
            ("refractive_index", "intensity", "fresnel_angle", "form"),
        ),
        Model(
            "cook_torrance_2020",
            "Cook-Torrance with F = 1 and an ambient term (Habib, Green, Nussbaum 2020)",
            (("Rd", 3), ("ks", 1), ("m", 1)),
            cook_torrance_2020,
            1.0,
            ("intensity", "ambient", "form"),
        ),
        Model(
            "ward",
            "Ward, isotropic (Habib, Green, Nussbaum 2020)",
            (("Rd", 3), ("ks", 1), ("m", 1)),
            ward,
            np.pi,
            ("intensity", "form"),
        ),
    )
}
"""The models by name; `parameters` and `channels` are in the order of a profile's MCS channels."""


def evaluate(
    model: str, parameters: ArrayLike, n: ArrayLike, light: ArrayLike, view: ArrayLike, **options: Any
) -> Array:
    """
    Return the XYZ of a model by name.

    Parameters
    ----------
    model
        Key of `MODELS`.
    parameters
        Channels in the order of `MODELS[model].channels`, shape (..., k).
    n, light, view
        Normal, direction to the light, direction to the viewer; (..., 3), any length.
    options
        Keyword arguments of the model's function, such as `intensity`, `form`, `refractive_index`.

    Returns
    -------
    XYZ, shape (..., 3).

    Raises
    ------
    UsageError
        An unknown model or option, or an array of the wrong width.

    Examples
    --------
    >>> from iccbrdf.brdf.geometry import planar
    >>> evaluate("ward", [0.9, 1, 0.8, 0.16, 0.2], planar(0), planar(-60), planar(60)).round(6)
    array([1.45, 1.5 , 1.4 ])
    """
    entry = find_model(model)
    for option in options:
        if option not in entry.options:
            raise UsageError(f"{model} has no option {option!r}: {nearest(option, entry.options)}")
    return entry.function(*entry.split(parameters), n, light, view, **options)


def find_model(name: str) -> Model:
    """
    Return a model of `MODELS` by name.

    Raises
    ------
    UsageError
        There is none, with the nearest name.
    """
    if name not in MODELS:
        raise UsageError(f"unknown model {name!r}: {nearest(name, MODELS)}")
    return MODELS[name]
