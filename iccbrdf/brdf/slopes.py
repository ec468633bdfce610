"""Colours printed on a slope: the slopes file and the adjustment of a flat print's XYZ by it.

The same ink does not give the same colour on a slope as on the flat.  [Habib2023] measures white and black on
both, each 0:45 to its own normal, and moves every colour between them.  A slopes file is a JSON object with
these keys:

    schema            "iccbrdf-slopes"
    version           1
    illuminant        of the XYZ: "D50", ...
    observer          "CIE 1931 2 Degree Standard Observer" or "CIE 1964 10 Degree Standard Observer"
    white             XYZ of the perfect diffuser, Y = 1; optional, by default of that illuminant and observer
    geometry          of the XYZ, to the slope's own normal: "0:45"
    source            where the figures come from
    slopes            list of objects: angle in degrees, ascending from 0, and W and B, the XYZ of the printed
                      white and of the printed black (Y = 1 for the perfect diffuser)

References
----------
-   [Habib2023] T. Habib, P. Green, P. Nussbaum: An appearance reproduction framework for printed 3D
    surfaces. Journal of Imaging Science and Technology, 2023.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.cook_torrance import channels
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.primaries import ILLUMINANTS, OBSERVERS, read_white
from iccbrdf.brdf.records import Record, read_record
from iccbrdf.errors import UsageError, nearest
from iccbrdf.files import StrPath, atomic_output
from iccbrdf.json_text import to_json

SCHEMA = "iccbrdf-slopes"
VERSION = 1

SlopeMethod = Literal["affine", "published"]


@dataclass(frozen=True)
class Slope:
    """One slope: its angle in degrees and the XYZ of white and black printed on it."""

    angle: float
    W: tuple[float, ...]
    B: tuple[float, ...]


@dataclass(frozen=True)
class Slopes:
    """The contents of a slopes file; see the module for the meaning of the fields."""

    illuminant: str
    observer: str
    white: tuple[float, ...]
    geometry: str
    source: str
    slopes: tuple[Slope, ...]
    file: str = field(default="", compare=False)
    """Where it was read from, for messages."""

    @property
    def angles(self) -> Array:
        """The measured angles in degrees, shape (s,)."""
        return np.array([slope.angle for slope in self.slopes])

    @property
    def W(self) -> Array:
        """XYZ of the white on each slope, shape (s, 3); row 0 is the flat white Wf."""
        return np.array([slope.W for slope in self.slopes])

    @property
    def B(self) -> Array:
        """XYZ of the black on each slope, shape (s, 3); row 0 is the flat black Bf."""
        return np.array([slope.B for slope in self.slopes])

    def at(self, angles: ArrayLike) -> tuple[Array, Array]:
        """
        Return Ws and Bs, each (..., 3), at angles (...) in degrees.

        They are linear in the angle between the measured slopes and held beyond the last (`beyond`).
        """
        angles, measured = np.asarray(angles, dtype=np.float64), self.angles
        Ws, Bs = (
            np.stack([np.interp(angles, measured, component) for component in XYZ.T], axis=-1)
            for XYZ in (self.W, self.B)
        )
        return Ws, Bs

    def beyond(self, angles: ArrayLike) -> NDArray[np.bool_]:
        """Return where angles (...) in degrees exceed the last measured one, where `at` holds its colours."""
        steeper: NDArray[np.bool_] = np.asarray(angles, dtype=np.float64) > self.slopes[-1].angle
        return steeper


class Jumps(NamedTuple):
    """The steps that the published adjustment makes at the two ends of the tone scale."""

    white_XYZ: Array
    """Just below the flat white's luminance less at it, (..., 3)."""
    black_XYZ: Array
    """Just above the flat black's luminance less at it, (..., 3)."""
    white_dE: Array
    """CIEDE2000 of the step at white, (...)."""
    black_dE: Array
    """CIEDE2000 of the step at black, (...)."""


def slope_angle(normals: ArrayLike) -> Array:
    """
    Return the angle between normals and the z axis in degrees, 0..180.

    The arc tangent of atan2(hypot(nx, ny), nz) keeps its digits at every angle, where the arc cosine loses
    half of them near 0.

    Parameters
    ----------
    normals
        Shape (..., 3), any length; a normal without direction counts as flat.

    Returns
    -------
    Angles, shape (...).

    Examples
    --------
    >>> slope_angle([[0, 0, 2], [1, 0, 1], [0, -3, 0]])
    array([ 0., 45., 90.])
    """
    x, y, z = np.moveaxis(channels("normals", normals, 3), -1, 0)
    angles: Array = np.degrees(np.arctan2(np.hypot(x, y), z))
    return angles


def slope_adjust(
    XYZ: ArrayLike, angles: ArrayLike, slopes: Slopes, *, method: SlopeMethod = "affine"
) -> Array:
    """
    Return the colour on a slope, T', of the colour T printed flat.

    With C = (Ws - Bs) / (Wf - Bf) for each of X, Y, Z:

    `affine`
        T' = C (T - Bf) + Bs: Ws for Wf, Bs for Bf, continuous, and T itself on the flat.
    `published`
        [Habib2023], Eqs 9-12, to the letter, the lightnesses compared by Y:
        T' = T Ws / Wf where Y_T >= Y_Wf; T' = (T - C Bf) + C Bs where Y_T <= Y_Bf;
        T' = (T - C Bf) Ws / Wf + C Bs between.  This neither gives the measured black back nor is continuous
        (`published_jumps`).

    Parameters
    ----------
    XYZ
        T, shape (..., 3), Y = 1 for the perfect diffuser.  Nothing is clipped: what is darker than the black
        may become negative.
    angles
        Slope of the surface in degrees, shape (...), as of `slope_angle`.
    slopes
        The measured white and black.
    method
        `affine` or `published`.

    Returns
    -------
    T', shape (..., 3).

    Raises
    ------
    UsageError
        An unknown method, or an array of the wrong width.

    Examples
    --------
    >>> flat, steep = Slope(0, (0.85,) * 3, (0.03,) * 3), Slope(30, (0.70,) * 3, (0.05,) * 3)
    >>> slopes = Slopes("E", OBSERVERS[0], (1.0,) * 3, "0:45", "an example", (flat, steep))
    >>> slope_adjust([0.85, 0.85, 0.85], 30, slopes).round(3)
    array([0.7, 0.7, 0.7])
    >>> slope_adjust([0.849999, 0.849999, 0.849999], 30, slopes, method="published").round(3)
    array([0.72, 0.72, 0.72])
    """
    T = channels("XYZ", XYZ, 3)
    Ws, Bs = slopes.at(angles)
    Wf, Bf = slopes.W[0], slopes.B[0]
    C = (Ws - Bs) / (Wf - Bf)
    adjusted: Array
    if method == "affine":
        adjusted = C * (T - Bf) + Bs
    elif method == "published":
        y, y_white, y_black = T[..., 1:2], Wf[1], Bf[1]
        shifted = T - C * Bf
        darker = np.where(y <= y_black, shifted + C * Bs, shifted * Ws / Wf + C * Bs)
        adjusted = np.where(y >= y_white, T * Ws / Wf, darker)
    else:
        raise UsageError(f"unknown slope method {method!r}: {nearest(method, get_args(SlopeMethod))}")
    return adjusted


def published_jumps(slopes: Slopes, angles: ArrayLike) -> Jumps:
    """
    Return how far the published adjustment jumps at the flat white and at the flat black.

    At white C (Bs - Bf Ws / Wf), at black (1 - C) Bf (Ws / Wf - 1): the middle formula less the outer one.

    Parameters
    ----------
    slopes
        The measured white and black.
    angles
        In degrees, shape (...); `slopes.angles` for the measured slopes.

    Returns
    -------
    Steps in XYZ and CIEDE2000 (against the perfect diffuser).
    """
    Ws, Bs = slopes.at(angles)
    Wf, Bf = slopes.W[0], slopes.B[0]
    C = (Ws - Bs) / (Wf - Bf)
    at_white, at_black = Ws, (Bf - C * Bf) + C * Bs
    white_XYZ, black_XYZ = C * (Bs - Bf * Ws / Wf), (1 - C) * Bf * (Ws / Wf - 1)
    white_dE, black_dE = (
        delta_E_CIE2000(XYZ_to_Lab(end, slopes.white), XYZ_to_Lab(end + jump, slopes.white))
        for end, jump in ((at_white, white_XYZ), (at_black, black_XYZ))
    )
    return Jumps(white_XYZ, black_XYZ, white_dE, black_dE)


def read_slopes(path: StrPath) -> Slopes:
    """
    Read a slopes file.

    Parameters
    ----------
    path
        JSON as the module describes it.

    Raises
    ------
    InputError
        The file cannot be read, or an entry is missing, unknown or out of range; among others, Y of the
        white is not 1, the slopes do not ascend from 0, or a white on them is not lighter than its black in
        each of X, Y, Z.
    """
    record = read_record(path, SCHEMA, VERSION)
    record.check_keys(
        ["schema", "version", "illuminant", "observer", "white", "geometry", "source", "slopes"]
    )
    illuminant = record.choice("illuminant", ILLUMINANTS)
    observer = record.choice("observer", OBSERVERS)
    return Slopes(
        illuminant=illuminant,
        observer=observer,
        white=read_white(record, illuminant, observer),
        geometry=record.text("geometry"),
        source=record.text("source"),
        slopes=read_entries(record),
        file=record.file,
    )


def write_slopes(slopes: Slopes, path: StrPath, *, overwrite: bool = False) -> None:
    """
    Write a slopes file; the same slopes give the same bytes.

    Raises
    ------
    UsageError
        The file cannot be written, or exists and `overwrite` is not set.
    """
    contents = {
        "schema": SCHEMA,
        "version": VERSION,
        "illuminant": slopes.illuminant,
        "observer": slopes.observer,
        "white": list(slopes.white),
        "geometry": slopes.geometry,
        "source": slopes.source,
        "slopes": entries_of(slopes),
    }
    with atomic_output(path, overwrite=overwrite) as temporary:
        temporary.write_bytes(f"{to_json(contents)}\n".encode())


def entries_of(slopes: Slopes) -> list[dict[str, Any]]:
    """Return what stands under `slopes` in a slopes file."""
    return [{"angle": slope.angle, "W": list(slope.W), "B": list(slope.B)} for slope in slopes.slopes]


def read_entries(record: Record) -> tuple[Slope, ...]:
    """Return the slopes of a file; errors as those of `read_slopes`."""
    slopes: list[Slope] = []
    for entry in record.records("slopes", "slope"):
        entry.check_keys(["angle", "W", "B"])
        angle = entry.number("angle", 0, 90)
        if not slopes and angle != 0:
            raise entry.error(f"angle is {angle:g}, expected 0: the first slope is the flat print")
        if slopes and angle <= slopes[-1].angle:
            raise entry.error(f"angle is {angle:g}, expected more than the {slopes[-1].angle:g} before it")
        W, B = entry.numbers("W", 3, 1e-6), entry.numbers("B", 3, 1e-6)
        for k in range(3):
            if W[k] <= B[k]:
                raise entry.error(f"W[{k}] is {W[k]:g}, expected more than B[{k}], which is {B[k]:g}")
        slopes.append(Slope(angle, W, B))
    return tuple(slopes)
