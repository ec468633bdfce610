"""The steps from a spectral connection space: to other wavelengths, to light, to XYZ."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from iccbrdf.cmm.conditions import conditions
from iccbrdf.cmm.observer import Wavelengths, folded, interpolated, observer, wavelengths
from iccbrdf.cmm.stages import Stage
from iccbrdf.cmm.steps import Process, Step
from iccbrdf.errors import LimitError, LinkError, ProfileError
from iccbrdf.icc import Matrix, MultiProcess, Profile

MAX_FACTORS = 1 << 22
"""Numbers in the matrix between two sets of wavelengths."""

_REFLECTED, _EMITTED, _FLUORESCENT = ("rs", "ts"), "es", "bs"
_BECOME = {
    "rs": ("rs", "ts", "bs"),
    "ts": ("rs", "ts", "bs"),
    "es": ("rs", "ts", "es", "bs"),
    "bs": ("bs",),
}
"""For each kind of spectra those that it can be made of."""


def to_XYZ(stage: Stage) -> list[Step]:
    """From the spectra that `stage` ends on to XYZ under the viewing conditions of its profile.

    The perfect diffuser has the XYZ that the conditions state for the illuminant, which may be rounded.
    """
    kind = _kind(stage)
    at = _wavelengths(stage.profile)
    seen_by = observer(stage.viewing)
    if kind == _EMITTED:
        return [_matrix(seen_by.radiance(at), stage)]
    if kind == _FLUORESCENT:
        light = _light(stage)
        lit = seen_by.reflected(light)
        weights = folded(seen_by.functions, at, seen_by.observed)
        matrix = _on_matrices(weights, lit)
        # The light of the perfect diffuser goes by way of the same wavelengths.
        computed = weights @ interpolated(lit[None], light, at)[0]
    else:
        matrix = seen_by.reflectance(at)
        computed = matrix.sum(axis=1)
    if not (computed > 0).all():
        raise ProfileError(
            f"{stage.viewing.source}: tag svcn: light of XYZ {computed}, expected numbers above 0"
        )
    return [_matrix(matrix * (conditions(stage.viewing).white / computed)[:, None], stage)]


def to_spectra(before: Stage, after: Stage) -> list[Step]:
    """From the spectra of one profile to those of the next: light for reflectance, other wavelengths.

    Bi-spectral matrices, which hold for any light, are seen under the first profile's.
    """
    here, there = _kind(before), _kind(after)
    source, destination = _wavelengths(before.profile), _wavelengths(after.profile)
    same = source == destination
    if here == there == _FLUORESCENT:
        same = same and _light(before) == _light(after)
    if here not in _BECOME[there] or (there == _FLUORESCENT and not same):
        raise LinkError(
            f"{before.profile.source} gives {before.destination.text}, "
            f"but {after.profile.source} takes {after.source.text}"
        )
    if same and (here == there or (there in _REFLECTED and here in _REFLECTED)):
        return []
    _check_factors(before, source.steps, destination.steps)
    matrix = folded(np.eye(destination.steps), source, destination)
    if here in _REFLECTED and there == _EMITTED:
        matrix = matrix * observer(before.viewing).reflected(source)
    if here == _FLUORESCENT:
        seen_by, light = observer(before.viewing), _light(before)
        _check_factors(before, source.steps * light.steps, destination.steps)
        if there in _REFLECTED:
            white = seen_by.reflected(source)
            if not (white > 0).all():
                raise ProfileError(
                    f"{before.viewing.source}: tag svcn: illuminant: found no light at some wavelengths, "
                    "expected some at all, to tell reflectance by"
                )
            matrix = matrix / white
        matrix = _on_matrices(matrix, seen_by.reflected(light))
    return [_matrix(matrix, before)]


def _check_factors(stage: Stage, here: int, there: int) -> None:
    if here * there > MAX_FACTORS:
        raise LimitError(
            f"{stage.profile.source}: {here} wavelengths to {there}: more than {MAX_FACTORS} factors"
        )


def _on_matrices(weights: npt.NDArray[np.float64], light: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """What `weights` (n, rows) makes of what comes from bi-spectral matrices under a light (columns,).

    Shape (n, rows x columns): a matrix has its channels row by row.
    """
    return (weights[:, :, None] * light).reshape(len(weights), -1)


def _kind(stage: Stage) -> str:
    """rs, ts, es or bs; LinkError for spaces that cannot be turned into others."""
    space = stage.destination if stage.destination.kind == "spectral" else stage.source
    kind = space.signature[:2]
    if kind not in _BECOME:
        raise LinkError(
            f"{stage.profile.source}: {space.text} links with none: expected spectra of reflection (rs), "
            "transmission (ts) or emission (es), or bi-spectral ones (bs)"
        )
    if kind == _FLUORESCENT and len(space.names) != _wavelengths(stage.profile).steps * _light(stage).steps:
        raise ProfileError(
            f"{stage.profile.source}: header: {space.text}, expected one for each pair of "
            f"{_wavelengths(stage.profile).steps} wavelengths and {_light(stage).steps} of light"
        )
    return kind


def _wavelengths(profile: Profile) -> Wavelengths:
    header = profile.header
    return wavelengths(header.spectral_range, header.spectral_steps, f"{profile.source}: header: spectra")


def _light(stage: Stage) -> Wavelengths:
    """The wavelengths of the light that excites, for bi-spectral data."""
    header = stage.profile.header
    place = f"{stage.profile.source}: header: bi-spectral range"
    return wavelengths(header.bispectral_range, header.bispectral_steps, place)


def _matrix(matrix: npt.NDArray[np.float64], stage: Stage) -> Process:
    return Process.checked(MultiProcess.of(Matrix.of(matrix)), f"{stage.profile.source}: its spectra")
