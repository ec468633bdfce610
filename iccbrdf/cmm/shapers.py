"""Profiles of a curve a channel and a matrix, or of one grey curve, as processing elements.

Their colours are relative to the media white (ICC.1:2010, 6.3 and Annex F).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from iccbrdf.cmm.luts import clipped, curve_elements, power
from iccbrdf.cmm.spaces import Space
from iccbrdf.errors import ProfileError, UnsupportedError
from iccbrdf.icc import (
    D50,
    XYZ,
    Curve,
    CurveSet,
    Matrix,
    MultiProcess,
    ParametricCurve,
    Profile,
    SampledCurve,
    SegmentedCurve,
)

_CURVES = {"rTRC": ("rTRC", "gTRC", "bTRC"), "kTRC": ("kTRC",)}
SHAPERS = tuple(_CURVES)
"""The tags that such a profile is known by."""
_COLORANTS = ("rXYZ", "gXYZ", "bXYZ")
_STEPS = 65535
"""The samples of a curve are multiples of 1/65535, so that its inverse is a line between two of them."""


def shaper(profile: Profile, tag: str, source: Space, destination: Space) -> MultiProcess:
    """
    The transform of a profile that has the curve `tag`, between its device space and connection space.

    Raises
    ------
    ProfileError
        A curve or colorant is missing or malformed, or has no inverse where one is needed.
    UnsupportedError
        A curve is of a type that is not inverted here.
    """
    names = _CURVES[tag]
    to_device = source.kind == "pcs"
    device, pcs = (destination, source) if to_device else (source, destination)
    if len(device.names) != len(names):
        raise ProfileError(
            f"{profile.source}: tag {tag}: found {device.text}, expected one of {len(names)} channels"
        )
    curves = [_value(profile, name, (Curve, ParametricCurve, SegmentedCurve)) for name in names]
    matrix = _matrix(profile, tag, pcs)
    if not to_device:
        elements = [*curve_elements(curves, f"{profile.source}: tag {tag}: curve"), Matrix.of(matrix)]
        return MultiProcess(len(names), 3, tuple(elements))
    inverses = [
        _inverse(curve, f"{profile.source}: tag {name}") for curve, name in zip(curves, names, strict=True)
    ]
    elements = [
        Matrix.of(_inverse_matrix(matrix, profile.source)),
        *clipped(len(names)),
        CurveSet(tuple(inverses)),
        *clipped(len(names)),
    ]
    return MultiProcess(3, len(names), tuple(elements))


def _value(profile: Profile, tag: str, types: tuple[type, ...]) -> Any:
    value = profile.get(tag)
    if not isinstance(value, types):
        found = "none" if value is None else f"type {value.signature!r}"
        expected = ", ".join(repr(t.signature) for t in types)  # type: ignore[attr-defined]
        raise ProfileError(f"{profile.source}: tag {tag}: found {found}, expected {expected}")
    return value


def _matrix(profile: Profile, tag: str, pcs: Space) -> Any:
    """From what curves give to the connection space, shape (3, channels)."""
    if tag == "kTRC":
        return np.array([D50 if pcs.signature == "XYZ " else (100.0, 0.0, 0.0)]).T
    if pcs.signature != "XYZ ":
        raise ProfileError(f"{profile.source}: tag {tag}: found {pcs.text}, expected XYZ")
    columns = [_value(profile, name, (XYZ,)).values for name in _COLORANTS]
    for name, column in zip(_COLORANTS, columns, strict=True):
        if len(column) != 1:
            raise ProfileError(f"{profile.source}: tag {name}: found {len(column)} XYZ numbers, expected one")
    return np.array([column[0] for column in columns]).T


def _inverse_matrix(matrix: Any, source: str) -> Any:
    if matrix.shape[1] == 1:
        # Grey is told by Y, or by L*.
        row = np.argmax(matrix[:, 0])
        return np.eye(3)[[row]] / matrix[row, 0]
    if not np.linalg.cond(matrix) < 1e12:
        raise ProfileError(f"{source}: tags rXYZ, gXYZ, bXYZ: found colours that depend on one another")
    return np.linalg.inv(matrix)


def _inverse(curve: Curve | ParametricCurve | SegmentedCurve, place: str) -> SampledCurve | SegmentedCurve:
    if isinstance(curve, SegmentedCurve):
        raise UnsupportedError(f"{place}: no inverse of a segmented curve (type 'curf') is made here")
    if isinstance(curve, Curve) and len(curve.entries) != 1:
        return _inverse_samples(curve.entries or (0, _STEPS), place)
    parameters: Sequence[float]
    if isinstance(curve, Curve):
        kind, parameters = 0, (curve.entries[0] / 256,)
    else:
        kind, parameters = curve.type, curve.parameters
    g, a, b, c, d, e, f = (*parameters, *(0.0,) * (7 - len(parameters)))
    if kind == 0:
        a = 1.0
    with np.errstate(all="ignore"):
        scale, slope = np.float64(a) ** -g, c if kind > 2 else 0.0
        if kind in (1, 2):
            # Below -b/a the curve is flat.
            d, e = -b / np.float64(a), c
        turn = np.float32(np.float64(max(a * d + b, 0.0)) ** g + e)
        written = np.abs([turn, scale, e * scale]) < np.finfo(np.float32).max
    if not (g > 0 and a > 0 and written.all()):
        raise ProfileError(f"{place}: found parameters {parameters}, whose curve has no inverse")
    upper = power(1 / g, scale, -e * scale, -b / a)
    if kind == 0:
        return SegmentedCurve((), (upper,))
    lower = power(1, 1 / slope, -f / slope) if slope else power(1, 0, 0, d)
    # What lies between is the upper one's.
    return SegmentedCurve((float(np.nextafter(turn, np.float32(-np.inf))),), (lower, upper))


def _inverse_samples(entries: tuple[int, ...], place: str) -> SampledCurve:
    values, positions = np.array(entries), np.linspace(0, 1, len(entries))
    if values[0] > values[-1]:
        values, positions = values[::-1], positions[::-1]
    values = np.maximum.accumulate(values)  # flat where the curve turns back
    if values[0] == values[-1]:
        raise ProfileError(f"{place}: found a flat curve, which has no inverse")
    # On a flat piece np.interp takes the last place.
    return SampledCurve(0, 1, 0, np.interp(np.arange(_STEPS + 1), values, positions))
