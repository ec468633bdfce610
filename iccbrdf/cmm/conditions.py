"""Profile connection conditions: under which illuminant and for which observer the XYZ of a profile holds."""

from __future__ import annotations

from dataclasses import dataclass

from iccbrdf.errors import LinkError, ProfileError
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
    """The connection conditions that `profile` states (spectralViewingConditionsTag, else its header)."""
    if profile.header.version[0] < 5:
        return Conditions(_STANDARD, D50)
    svcn = profile.get("svcn")
    if svcn is None:
        white = profile.header.illuminant
        # A MID or a v4 style profile may leave the header's illuminant zero: nothing is stated there.
        if not any(white) or max(abs(a - b) for a, b in zip(white, D50, strict=True)) < 5e-4:
            return Conditions(_STANDARD, D50)
        return Conditions(("header illuminant", *white), white)
    if not isinstance(svcn, ViewingConditions):
        raise ProfileError(
            f"{profile.source}: tag svcn: found type {svcn.signature!r}, expected spectral viewing conditions"
        )
    x, y, z = (float(v) for v in svcn.illuminant_XYZ)
    if not y > 0:
        raise ProfileError(f"{profile.source}: tag svcn: the illuminant's luminance is {y}, expected above 0")
    white = (x / y, 1.0, z / y)
    if svcn.observer == 1 and svcn.illuminant == 1:
        return Conditions(_STANDARD, D50)
    observer: object = svcn.observer_table.tobytes() if svcn.observer == 0 else svcn.observer
    illuminant: tuple[object, ...] = (svcn.illuminant,)
    if svcn.illuminant == 0:
        illuminant += (svcn.spd.tobytes(), *white)
    elif svcn.illuminant in _BY_TEMPERATURE:
        illuminant += (svcn.cct,)
    return Conditions((observer, *illuminant), white)


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
