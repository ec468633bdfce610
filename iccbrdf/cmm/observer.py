"""Spectra -> XYZ: the observer and the illuminant of a profile's viewing conditions, as matrices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import LinkError, ProfileError
from iccbrdf.icc import Profile, ViewingConditions
from iccbrdf.icc.tags import ILLUMINANTS, OBSERVERS

Array: TypeAlias = npt.NDArray[np.float64]

# Where a standard observer or illuminant is stated by its id alone.
_STANDARD_FIRST, _STANDARD_LAST, _STANDARD_STEP = 380.0, 780.0, 5.0


@dataclass(frozen=True)
class Wavelengths:
    """`steps` wavelengths at equal distances from `first` to `last`, in nm."""

    first: float
    last: float
    steps: int

    @property
    def values(self) -> Array:
        return np.linspace(self.first, self.last, self.steps)


def wavelengths(limits: tuple[float, float], steps: int, place: str) -> Wavelengths:
    """The wavelengths that a profile states; ProfileError, which begins with `place`, where they are none."""
    first, last = limits
    if not (np.isfinite(limits).all() and first < last and steps > 1):
        raise ProfileError(
            f"{place}: found {steps} wavelengths from {first:g} to {last:g} nm, "
            "expected two or more that increase"
        )
    return Wavelengths(first, last, steps)


def interpolated(rows: Array, source: Wavelengths, destination: Wavelengths) -> Array:
    """Spectra in rows, linearly interpolated at other wavelengths and held at the ends."""
    return np.stack([np.interp(destination.values, source.values, row) for row in rows])


def folded(rows: Array, source: Wavelengths, destination: Wavelengths) -> Array:
    """The rows that weigh spectra at `source` as `rows` weighs them once interpolated at `destination`."""
    step = (source.last - source.first) / (source.steps - 1)
    position = np.clip((destination.values - source.first) / step, 0, source.steps - 1)
    left = np.minimum(position.astype(np.intp), source.steps - 2)
    result = np.zeros((len(rows), source.steps))
    for row, weights in zip(result, rows, strict=True):
        np.add.at(row, left, weights * (1 - (position - left)))
        np.add.at(row, left + 1, weights * (position - left))
    return result


@dataclass(frozen=True, eq=False)
class Observer:
    """Colour-matching functions (3, N) and relative spectral power (M,), each at its wavelengths."""

    observed: Wavelengths
    functions: Array
    lit: Wavelengths
    power: Array

    def emission(self, spectra: Wavelengths, white: npt.ArrayLike) -> Array:
        """The matrix (3, steps) from light to XYZ, Y = 1 for the light `white` (steps,)."""
        matrix = interpolated(self.functions, self.observed, spectra)
        return _scaled(matrix, float(matrix[1] @ np.asarray(white, np.float64)))

    def reflectance(self, spectra: Wavelengths) -> Array:
        """The matrix (3, steps) from reflectance to XYZ, Y = 1 for the perfect diffuser.

        Summed at the wavelengths of the illuminant (CIE 15:2018, 7.1, as the ICC's reference implementation).
        """
        matrix = interpolated(self.functions, self.observed, self.lit) * self.power
        return folded(_scaled(matrix, float(matrix[1].sum())), spectra, self.lit)

    def radiance(self, spectra: Wavelengths) -> Array:
        """The matrix (3, steps) from light to XYZ, Y = 1 for what a perfect diffuser reflects.

        Summed at the wavelengths of the spectra or of the observer, whichever are closer together.
        """
        scale = float(interpolated(self.functions, self.observed, self.lit)[1] @ self.power)
        own, other = ((w.last - w.first) / w.steps for w in (self.observed, spectra))
        if other < own:
            return _scaled(interpolated(self.functions, self.observed, spectra), scale)
        return _scaled(folded(self.functions, spectra, self.observed), scale)

    def reflected(self, spectra: Wavelengths) -> Array:
        """The light that a perfect diffuser reflects, (steps,)."""
        light: Array = interpolated(self.power[None], self.lit, spectra)[0]
        return light


def _scaled(matrix: Array, luminance: float) -> Array:
    if not (np.isfinite(luminance) and luminance > 0):
        raise ProfileError(f"spectra: found a white of luminance {luminance:g}, expected one above 0")
    return matrix / luminance


def observer(profile: Profile) -> Observer:
    """The observer and the illuminant in the tag svcn of `profile`.

    Raises LinkError where it is missing, ProfileError where it holds no spectra that can be used.
    """
    svcn = profile.get("svcn")
    place = f"{profile.source}: tag svcn"
    if svcn is None:
        raise LinkError(f"{place} is missing, which says for what observer and light spectra become colours")
    if not isinstance(svcn, ViewingConditions):
        raise ProfileError(f"{place}: found type {svcn.signature!r}, expected spectral viewing conditions")
    observed, functions = _functions(svcn, f"{place}: observer")
    lit, power = _power(svcn, f"{place}: illuminant")
    return Observer(observed, functions, lit, power)


def _functions(svcn: ViewingConditions, place: str) -> tuple[Wavelengths, Array]:
    table = svcn.observer_table
    if table.shape[1]:
        return wavelengths(svcn.observer_range, table.shape[1], place), table.astype(np.float64)
    import colour  # takes a second to import, and few profiles leave out their tables

    names = {number: name for name, number in OBSERVERS.items()}
    if svcn.observer not in names:
        raise ProfileError(f"{place} {svcn.observer}: found no colour-matching functions")
    return _standard(colour.MSDS_CMFS[names[svcn.observer]])


def _power(svcn: ViewingConditions, place: str) -> tuple[Wavelengths, Array]:
    if svcn.spd.size:
        return wavelengths(svcn.illuminant_range, svcn.spd.size, place), svcn.spd.astype(np.float64)
    import colour

    names = {number: name for name, number in ILLUMINANTS.items()}
    if svcn.illuminant not in names:
        raise ProfileError(f"{place} {svcn.illuminant}: found no spectral power")
    return _standard(colour.SDS_ILLUMINANTS[names[svcn.illuminant]])


def _standard(table: Any) -> tuple[Wavelengths, Array]:
    import colour

    shape = colour.SpectralShape(_STANDARD_FIRST, _STANDARD_LAST, _STANDARD_STEP)
    values = table.copy().align(shape).values
    return Wavelengths(_STANDARD_FIRST, _STANDARD_LAST, len(values)), np.asarray(values, np.float64).T
