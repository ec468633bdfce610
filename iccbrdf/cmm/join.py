"""The steps between two profiles of a chain: multiplex routing, connection conditions, media white."""

from __future__ import annotations

from iccbrdf.cmm.conditions import conditions, conversions
from iccbrdf.cmm.spectral import to_spectra, to_XYZ
from iccbrdf.cmm.stages import Stage
from iccbrdf.cmm.steps import LabToXYZ, Process, Route, Scale, Step, XYZToLab
from iccbrdf.errors import LinkError, ProfileError, nearest
from iccbrdf.icc import XYZ, NumberArray, Profile

_DEFAULT_TYPES = ("ui08", "ui16", "fl16", "fl32", "fl64")
"""Types that a CMM takes multiplex default values in."""


def join(before: Stage, after: Stage, *, absolute: bool) -> list[Step]:
    """The steps from the end of `before` to the start of `after`; LinkError where they do not fit."""
    here, there = before.destination, after.source
    if here.kind == "spectral" and there.kind == "spectral":
        return to_spectra(before, after)
    if here.kind == "spectral" and there.kind == "pcs":
        steps = [*to_XYZ(before), *_connection("XYZ ", before, after)]
        return [*steps, *media_white(after, absolute, outward=False)]
    if here.kind != there.kind:
        raise LinkError(
            f"{before.profile.source} ends on {here.text}, {after.profile.source} starts from {there.text}"
        )
    if here.kind == "mcs":
        return _routing(before, after)
    if here.kind == "pcs":
        return [
            *media_white(before, absolute, outward=True),
            *_connection(here.signature, before, after),
            *media_white(after, absolute, outward=False),
        ]
    if here.signature != there.signature:
        raise LinkError(
            f"{before.profile.source} gives {here.text}, but {after.profile.source} takes {there.text}"
        )
    return []


def _connection(here: str, before: Stage, after: Stage) -> list[Step]:
    """From the connection space `here` to that of `after`; a change of conditions is done on XYZ."""
    there = after.source.signature
    steps: list[Step] = [Process.checked(p, place) for place, p in conversions(before.viewing, after.viewing)]
    if here == there and not steps:
        return []
    if here == "Lab ":
        steps.insert(0, LabToXYZ(conditions(before.viewing).white))
    if there == "Lab ":
        steps.append(XYZToLab(conditions(after.viewing).white))
    return steps


def media_white(stage: Stage, absolute: bool, *, outward: bool) -> list[Step]:
    """The step between the tag's own colorimetry and the one asked for; Lab is scaled by way of XYZ.

    Only the colorimetric tags, ...1 and ...3, relate to the media white.  A ...0 or ...2 that stands in for
    one of them is used as it is, as the reference implementation does at the end of a chain.
    """
    if stage.tag[-1] not in "13" or (stage.tag[-1] == "3") == absolute:
        return []
    space = stage.destination if outward else stage.source
    white, medium = conditions(stage.profile).white, stage.profile.get("wtpt")
    if medium is None:
        return []
    if not isinstance(medium, XYZ) or len(medium.values) != 1 or not min(medium.values[0]) > 0:
        raise ProfileError(f"{stage.profile.source}: tag wtpt: expected one XYZ number above 0")
    # Relative -> absolute multiplies by wtpt / illuminant; each of the two other switches inverts it once.
    power = (1 if absolute else -1) * (1 if outward else -1)
    factors = tuple(float(m / w) ** power for m, w in zip(medium.values[0], white, strict=True))
    if max(abs(f - 1) for f in factors) < 2**-16:  # s15Fixed16 tells no more
        return []
    if space.signature == "Lab ":
        return [LabToXYZ(white), Scale(factors), XYZToLab(white)]
    return [Scale(factors)]


def _routing(before: Stage, after: Stage) -> list[Step]:
    """Multiplex channels by name; what the source lacks takes the destination's default value (tag mdv)."""
    for flagged, other in ((before, after), (after, before)):
        if flagged.profile.header.mcs_subset:
            theirs = _mcs(other)
            missing = [name for name in _mcs(flagged) if name not in theirs]
            if missing:
                raise LinkError(
                    f"{flagged.profile.source} needs all its multiplex channels in {other.profile.source}, "
                    f"which has no {missing[0]!r}: {nearest(missing[0], theirs)}"
                )
    available, wanted = before.destination.names, after.source.names
    defaults = _default_values(after.profile, len(wanted))
    for name in wanted:
        if name not in available and defaults is None:
            raise LinkError(
                f"multiplex channel {name!r} of {after.profile.source} is not in {before.profile.source}, "
                f"and there is no default for it (tag mdv): {nearest(name, available)}"
            )
    if available == wanted:
        return []
    sources = tuple(available.index(name) if name in available else None for name in wanted)
    return [Route(sources, defaults or (0.0,) * len(wanted))]


def _mcs(stage: Stage) -> tuple[str, ...]:
    return (stage.destination if stage.destination.kind == "mcs" else stage.source).names


def _default_values(profile: Profile, count: int) -> tuple[float, ...] | None:
    values = profile.get("mdv ")
    if values is None:
        return None
    if not isinstance(values, NumberArray) or values.signature not in _DEFAULT_TYPES:
        raise ProfileError(
            f"{profile.source}: tag mdv: type {values.signature!r}: {nearest('', _DEFAULT_TYPES)}"
        )
    if len(values.values) != count:
        raise ProfileError(f"{profile.source}: tag mdv: {len(values.values)} values, expected {count}")
    return tuple(values.normalised().tolist())
