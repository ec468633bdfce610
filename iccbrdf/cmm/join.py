"""The steps between two profiles of a chain: multiplex routing, connection conditions, white and black."""

from __future__ import annotations

import numpy as np

from iccbrdf.cmm.conditions import conditions, conversions, equal_in_file
from iccbrdf.cmm.spectral import to_spectra, to_XYZ
from iccbrdf.cmm.stages import Stage
from iccbrdf.cmm.steps import LabToXYZ, Process, Route, Scale, Step, XYZToLab
from iccbrdf.errors import LinkError, ProfileError, nearest
from iccbrdf.icc import D50, XYZ, Matrix, MultiProcess, NumberArray, Profile

_PERCEPTUAL_BLACK = (0.00336, 0.0034731, 0.00287)
"""XYZ of the darkest printed black (ICC.1:2010, 6.3.3; the reference medium of the perceptual intent)."""
_DEFAULT_TYPES = ("ui08", "ui16", "fl16", "fl32", "fl64")
"""Types that a CMM takes multiplex default values in."""


def join(before: Stage, after: Stage) -> list[Step]:
    """The steps from the end of `before` to the start of `after`; LinkError where they do not fit."""
    here, there = before.destination, after.source
    if here.kind == "spectral" and there.kind == "spectral":
        return to_spectra(before, after)
    if here.kind == "spectral" and there.kind == "pcs":
        return [*to_XYZ(before), *_connection("XYZ ", before, after)]
    if here.kind != there.kind:
        raise LinkError(
            f"{before.profile.source} ends on {here.text}, {after.profile.source} starts from {there.text}"
        )
    if here.kind == "mcs":
        return _routing(before, after)
    if here.kind == "pcs":
        return _connection(here.signature, before, after)
    if here.signature != there.signature:
        raise LinkError(
            f"{before.profile.source} gives {here.text}, but {after.profile.source} takes {there.text}"
        )
    return []


def _connection(here: str, before: Stage, after: Stage) -> list[Step]:
    """From the connection space `here` to that of `after`; every change is done on XYZ."""
    there = after.source.signature
    steps: list[Step] = [
        *_adjusted(before, outward=True),
        *(Process.checked(process, place) for place, process in conversions(before.viewing, after.viewing)),
        *_adjusted(after, outward=False),
    ]
    if here == there and not steps:
        return []
    if here == "Lab ":
        steps.insert(0, LabToXYZ(conditions(before.viewing).white))
    if there == "Lab ":
        steps.append(XYZToLab(conditions(after.viewing).white))
    return steps


def at_the_end(stage: Stage, *, outward: bool) -> list[Step]:
    """At an end of the chain: the steps between the tag's own colorimetry and the one asked for."""
    space = stage.destination if outward else stage.source
    steps = _adjusted(stage, outward=outward)
    if steps and space.signature == "Lab ":
        white = conditions(stage.viewing).white
        return [LabToXYZ(white), *steps, XYZToLab(white)]
    return steps


def _adjusted(stage: Stage, *, outward: bool) -> list[Step]:
    """Between XYZ as the tag has it and XYZ of the intent that is asked for."""
    space = stage.destination if outward else stage.source
    return [*_media_white(stage, outward), *_black(stage, outward)] if space.kind == "pcs" else []


def _media_white(stage: Stage, outward: bool) -> list[Step]:
    absolute = stage.intent == "absolute"
    if stage.relates is None or (stage.relates == "absolute") == absolute:
        return []
    medium = stage.stated.get("wtpt")
    if medium is None:
        return []
    if not isinstance(medium, XYZ) or len(medium.values) != 1 or not min(medium.values[0]) > 0:
        raise ProfileError(f"{stage.stated.source}: tag wtpt: expected one XYZ number above 0")
    white = conditions(stage.stated).white
    if equal_in_file(medium.values[0], white):
        return []
    # Relative -> absolute multiplies by wtpt / illuminant; each of the two other switches inverts it once.
    power = (1 if absolute else -1) * (1 if outward else -1)
    return [Scale(tuple(float(m / w) ** power for m, w in zip(medium.values[0], white, strict=True)))]


def _black(stage: Stage, outward: bool) -> list[Step]:
    """Between a black of 0 and that of the perceptual intent, the white kept."""
    if not stage.without_black:
        return []
    white, black = np.array(D50), np.array(_PERCEPTUAL_BLACK)
    gain = 1 - black / white
    line = (gain, black) if outward else (1 / gain, -black / gain)
    process = MultiProcess.of(Matrix.of(np.diag(line[0]), line[1]))
    return [Process.checked(process, f"{stage.profile.source}: its black")]


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
