"""The steps from a spectral connection space: to other wavelengths, to light, to XYZ."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from iccbrdf.cmm.conditions import conditions
from iccbrdf.cmm.observer import Wavelengths, folded, observer, wavelengths
from iccbrdf.cmm.stages import Stage
from iccbrdf.cmm.steps import Process, Step
from iccbrdf.errors import LimitError, LinkError, ProfileError
from iccbrdf.icc import Matrix, MultiProcess, Profile

MAX_FACTORS = 1 << 22
"""Numbers in the matrix between two sets of wavelengths."""

_REFLECTED, _EMITTED = ("rs", "ts"), "es"


def to_XYZ(stage: Stage) -> list[Step]:
    """From the spectra that `stage` ends on to XYZ under the viewing conditions of its profile.

    The perfect diffuser has the XYZ that the conditions state for the illuminant, which may be rounded.
    """
    kind = _kind(stage)
    at = _wavelengths(stage.profile)
    seen_by = observer(stage.viewing)
    if kind == _EMITTED:
        return [_matrix(seen_by.radiance(at), stage)]
    matrix = seen_by.reflectance(at)
    computed = matrix.sum(axis=1)
    if not (computed > 0).all():
        raise ProfileError(
            f"{stage.viewing.source}: tag svcn: light of XYZ {computed}, expected numbers above 0"
        )
    return [_matrix(matrix * (conditions(stage.viewing).white / computed)[:, None], stage)]


def to_spectra(before: Stage, after: Stage) -> list[Step]:
    """From the spectra of one profile to those of the next: light for reflectance, other wavelengths."""
    here, there = _kind(before), _kind(after)
    source, destination = _wavelengths(before.profile), _wavelengths(after.profile)
    lights = here in _REFLECTED and there == _EMITTED
    if not lights and (here == _EMITTED) != (there == _EMITTED):
        raise LinkError(
            f"{before.profile.source} gives {before.destination.text}, "
            f"but {after.profile.source} takes {after.source.text}"
        )
    if source == destination and not lights:
        return []
    if source.steps * destination.steps > MAX_FACTORS:
        raise LimitError(
            f"{before.profile.source}: {source.steps} wavelengths to {destination.steps}: "
            f"more than {MAX_FACTORS} factors"
        )
    matrix = folded(np.eye(destination.steps), source, destination)
    if lights:
        matrix = matrix * observer(before.viewing).reflected(source)
    return [_matrix(matrix, before)]


def _kind(stage: Stage) -> str:
    """rs, ts or es; LinkError for spaces that cannot be turned into others."""
    space = stage.destination if stage.destination.kind == "spectral" else stage.source
    kind = space.signature[:2]
    if kind not in (*_REFLECTED, _EMITTED):
        raise LinkError(
            f"{stage.profile.source}: {space.text} links with none: expected spectra of reflection (rs), "
            "transmission (ts) or emission (es)"
        )
    return kind


def _wavelengths(profile: Profile) -> Wavelengths:
    header = profile.header
    return wavelengths(header.spectral_range, header.spectral_steps, f"{profile.source}: header: spectra")


def _matrix(matrix: npt.NDArray[np.float64], stage: Stage) -> Process:
    return Process.checked(MultiProcess.of(Matrix.of(matrix)), f"{stage.profile.source}: its spectra")
