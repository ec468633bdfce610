"""Colour encodings, told by a name or by parameters, as profiles that transform pixels (ICC.2:2019, 8.11).

Device values are those of the encoding's components, 0..1 for the colours of its medium; an extended one goes
beyond.  The transfer function goes from linear to encoded values, as in the ICC's own examples of encodings.
Whites are adapted to D50 in Bradford's cone space (ICC.1, Annex E).  The reference implementation has no such
transform but in a tool for named colours, where the white of sRGB comes out with Y = 0.39.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import ProfileError, UnsupportedError, UsageError, nearest
from iccbrdf.icc import (
    D50,
    XYZ,
    CurveSet,
    FormulaSegment,
    Matrix,
    MultiProcess,
    NumberArray,
    Profile,
    SegmentedCurve,
    TagStruct,
    Utf8,
)

_BY_PARAMETERS = "ISO 22028-1"
_PRIMARIES = ("rXYZ", "gXYZ", "bXYZ")
_WHITE, _FUNCTION, _LUMA = "wXYZ", "func", "lmat"


def _chromaticity(x: float, y: float) -> NumberArray:
    return NumberArray("fl64", np.array([x, y]))


_ROUNDING = 1e-3
"""How far a transfer function may fall where two of its formulas meet."""

_KNOWN: Mapping[str, Mapping[str, Any]] = {
    # IEC 61966-2-1
    "sRGB": {
        "rXYZ": _chromaticity(0.64, 0.33),
        "gXYZ": _chromaticity(0.3, 0.6),
        "bXYZ": _chromaticity(0.15, 0.06),
        "wXYZ": _chromaticity(0.3127, 0.329),
        "func": SegmentedCurve(
            (0.0031308,),
            (FormulaSegment(0, (1, 12.92, 0, 0)), FormulaSegment(3, (1 / 2.4, 1.055, 1, 0, -0.055))),
        ),
    }
}


def as_display(profile: Profile) -> Profile:
    """A colour-encoding profile (class cenc) as one of a display under D50, with transforms both ways.

    Raises
    ------
    UnsupportedError
        The encoding is one by a name that is not known here, or not of R, G and B, or its transfer function
        is made of other formulas than powers.
    ProfileError
        A parameter is missing or malformed.
    """
    place = f"{profile.source}: colour encoding"
    if profile.header.colour_space != "RGB ":
        raise UnsupportedError(f"{place}: found {profile.header.colour_space!r}, expected 'RGB '")
    told = _parameters(profile, place)
    if _LUMA in told:
        raise UnsupportedError(f"{place}: found luma and chroma (member {_LUMA}), expected R, G and B")
    function = told.get(_FUNCTION)
    if not isinstance(function, SegmentedCurve):
        raise ProfileError(f"{place}: member {_FUNCTION}: expected a segmented curve")
    linear = _to_D50(told, place)
    tags = {
        "A2B1": MultiProcess.of(CurveSet((_inverse(function, place),) * 3), Matrix.of(linear)),
        "B2A1": MultiProcess.of(Matrix.of(np.linalg.inv(linear)), CurveSet((function,) * 3)),
        "wtpt": XYZ.of(*D50),
    }
    header = replace(profile.header, device_class="mntr", pcs="XYZ ", illuminant=D50)
    return Profile(header, tags, source=profile.source)


def _parameters(profile: Profile, place: str) -> dict[str, Any]:
    """Members of the structure by signature; those of a known encoding where the profile has none."""
    structure = profile.get("cept")
    own = {m.signature: m.value for m in structure.members} if isinstance(structure, TagStruct) else {}
    reference = _text(profile, "rfnm")
    if reference == _BY_PARAMETERS:
        return own
    name = _text(profile, "csnm") or reference
    if name not in _KNOWN:
        raise UnsupportedError(
            f"{place}: its name {name!r} (tags rfnm, csnm) is not known here: "
            f"{nearest(name, [*_KNOWN, _BY_PARAMETERS])}"
        )
    return {**_KNOWN[name], **own}


def _text(profile: Profile, tag: str) -> str:
    value = profile.get(tag)
    return value.text if isinstance(value, Utf8) else ""


def _to_D50(told: Mapping[str, Any], place: str) -> npt.NDArray[np.float64]:
    """The matrix from linear R, G, B to XYZ under D50, Y = 1 for the encoding's white."""
    import colour  # takes a second to import, and few profiles are encodings

    points = []
    for name in (*_PRIMARIES, _WHITE):
        value = told.get(name)
        if not isinstance(value, NumberArray) or value.values.size < 2 or not value.values[1] > 0:
            raise ProfileError(f"{place}: member {name}: expected chromaticities x, y, with y above 0")
        points.append(value.normalised()[:2])
    *primaries, white = points
    try:
        with np.errstate(all="ignore"):
            matrix = np.asarray(colour.normalised_primary_matrix(np.array(primaries), white), np.float64)
            adapted = colour.adaptation.matrix_chromatic_adaptation_VonKries(
                colour.xy_to_XYZ(white), np.array(D50), transform="Bradford"
            )
            linear = np.asarray(adapted, np.float64) @ matrix
    except np.linalg.LinAlgError:
        linear = np.full((3, 3), np.nan)
    if not (np.isfinite(linear).all() and np.linalg.cond(linear) < 1e6):
        raise ProfileError(f"{place}: found primaries {primaries}, expected three that are not on a line")
    return linear


def _inverse(function: SegmentedCurve, place: str) -> SegmentedCurve:
    """From encoded values back to linear ones."""
    try:
        segments = tuple(_inverse_segment(segment, place) for segment in function.segments)
        with np.errstate(all="ignore"):
            breaks = tuple(map(_value, function.segments, function.breakpoints))
            after = tuple(map(_value, function.segments[1:], function.breakpoints))
        steps = all(b > a - _ROUNDING for a, b in zip(breaks, after, strict=True))
        if steps and all(a < b for a, b in pairwise(breaks)):
            return SegmentedCurve(breaks, segments)
    except UsageError:  # numbers that a curve cannot hold
        pass
    raise UnsupportedError(f"{place}: its transfer function does not increase, expected one that does")


def _value(segment: Any, point: float) -> float:
    gamma, a, b, c, *offset = segment.parameters
    if segment.type == 0:
        return float(np.float64(a * point + b) ** gamma + c)
    return float(a * np.float64(max(b * point + c, 0)) ** gamma + offset[0])


def _inverse_segment(segment: Any, place: str) -> FormulaSegment:
    if not isinstance(segment, FormulaSegment) or segment.type not in (0, 3):
        raise UnsupportedError(
            f"{place}: its transfer function is not all powers, expected formulas of type 0 or 3"
        )
    gamma, a, b, c, *offset = segment.parameters
    slope = gamma * a * (b if segment.type == 3 else 1)
    if not (np.isfinite(segment.parameters).all() and slope > 0):
        raise UnsupportedError(f"{place}: its transfer function does not increase, expected one that does")
    if segment.type == 3:
        return FormulaSegment(3, (1 / gamma, 1 / b, 1 / a, -offset[0] / a, -c / b))
    if gamma == 1:
        return FormulaSegment(0, (1, 1 / a, -(b + c) / a, 0))
    return FormulaSegment(3, (1 / gamma, 1 / a, 1, -c, -b / a))
