"""Profile connection conditions: under which illuminant and for which observer the XYZ of a profile holds."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass

from iccbrdf.errors import LinkError, ProfileError, ProfileWarning
from iccbrdf.icc import MultiProcess, Profile, ViewingConditions
from iccbrdf.icc.header import D50

# Illuminant ids of spectralViewingConditionsType whose colour the correlated colour temperature sets.
_BY_TEMPERATURE = (9, 10)


@dataclass(frozen=True)
class Conditions:
    """`key` is equal for equal conditions; `white` is the illuminant's XYZ with Y = 1."""

    key: tuple[object, ...]
    white: tuple[float, float, float]

    @property
    def standard(self) -> bool:
        """Whether this is D50 and the 2 degree observer, the ICC's own meeting point."""
        return self.key == _STANDARD


_STANDARD: tuple[object, ...] = ("D50", "CIE 1931")


def conditions(profile: Profile) -> Conditions:
    """The connection conditions that `profile` states (spectralViewingConditionsTag, else its header).

    Those of versions before 5 are the standard ones.
    """
    svcn = profile.get("svcn")
    stated = profile.header.illuminant
    if profile.header.version[0] < 5:
        return Conditions(_STANDARD, D50)
    if svcn is None:
        if not any(stated):  # nothing is stated
            return Conditions(_STANDARD, D50)
        white = _normalised(stated, f"{profile.source}: header: illuminant")
        if max(abs(a - b) for a, b in zip(stated, D50, strict=True)) < 5e-4:
            return Conditions(_STANDARD, white)
        return Conditions(("header illuminant", *white), white)
    if not isinstance(svcn, ViewingConditions):
        raise ProfileError(
            f"{profile.source}: tag svcn: found type {svcn.signature!r}, expected spectral viewing conditions"
        )
    white = _normalised(svcn.illuminant_XYZ, f"{profile.source}: tag svcn: illuminant")
    if svcn.observer == 1 and svcn.illuminant == 1:
        return Conditions(_STANDARD, D50)
    observer: tuple[object, ...] = (svcn.observer,)
    if svcn.observer == 0:
        observer += (*svcn.observer_range, svcn.observer_table.tobytes())
    illuminant: tuple[object, ...] = (svcn.illuminant,)
    if svcn.illuminant == 0:
        illuminant += (*svcn.illuminant_range, svcn.spd.tobytes(), *white)
    elif svcn.illuminant in _BY_TEMPERATURE:
        illuminant += (svcn.cct,)
    return Conditions((*observer, *illuminant), white)


def equal_in_file(a: Iterable[float], b: Iterable[float]) -> bool:
    """Whether the numbers are the same as s15Fixed16."""
    return all(round(p * 65536) == round(q * 65536) for p, q in zip(a, b, strict=True))


def _normalised(XYZ: Iterable[float], place: str) -> tuple[float, float, float]:
    x, y, z = XYZ
    if not all(math.isfinite(v) and v > 0 for v in (x, y, z)):
        raise ProfileError(f"{place}: found XYZ {x:g} {y:g} {z:g}, expected finite numbers above 0")
    return x / y, 1.0, z / y


def conversions(source: Profile, destination: Profile) -> list[tuple[str, MultiProcess]]:
    """The c2sp and s2cp transforms between two profiles' conditions, each with the place that it comes from.

    Raises LinkError where the conditions differ and a transform that the change needs is missing.
    """
    if conditions(source).key == conditions(destination).key:
        return []
    return to_standard(source) + _steps(destination, "s2cp")


def to_standard(profile: Profile) -> list[tuple[str, MultiProcess]]:
    """The c2sp transform, with the place that it comes from; nothing for D50 and the 2 degree observer."""
    return _steps(profile, "c2sp")


def _steps(profile: Profile, tag: str) -> list[tuple[str, MultiProcess]]:
    if conditions(profile).standard:
        return []
    if "svcn" not in profile and tag not in profile:
        # As the reference implementation: conditions are what the tag svcn states.
        x, y, z = profile.header.illuminant
        warnings.warn(
            f"{profile.source}: header: illuminant {x:.5g} {y:.5g} {z:.5g}, but no tag svcn or {tag}; "
            "its colours are taken for those under D50",
            ProfileWarning,
            stacklevel=2,
        )
        return []
    return [(f"{profile.source}: {tag}", _transform(profile, tag))]


def _transform(profile: Profile, tag: str) -> MultiProcess:
    value = profile.get(tag)
    if value is None:
        raise LinkError(
            f"{profile.source}: tag {tag} is missing, which takes its viewing conditions "
            "to or from D50 and the 2 degree observer"
        )
    if not isinstance(value, MultiProcess) or (value.inputs, value.outputs) != (3, 3):
        raise ProfileError(f"{profile.source}: tag {tag}: expected processing elements from 3 to 3 channels")
    return value
