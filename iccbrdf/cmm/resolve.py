"""Elements that need to know more than their pixels, made into ones that do not.

Spectral elements become matrices and tables of colours under the viewing conditions of their profile, and the
tables of three channels are marked for the interpolation that is wanted.  Back ends see the results alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.calc.meanings import xyz_to_lab
from iccbrdf.calc.program import Program, parse
from iccbrdf.calc.tables import TetrahedralTable
from iccbrdf.cmm.observer import Observer, Wavelengths, observer
from iccbrdf.errors import ProfileError, UnsupportedError
from iccbrdf.icc import Clut, Matrix, Profile

INTERPOLATIONS = ("multilinear", "tetrahedral")


@dataclass(frozen=True, eq=False)
class ResolvedCalculator:
    """A calculator some of whose elements, or all, have been resolved."""

    inputs: int
    outputs: int
    program: Program
    elements: tuple[Any, ...]

    signature = "calc"


@dataclass(frozen=True)
class Resolver:
    """Makes elements plain: `resolver(element, place)`.

    viewing: the profile whose viewing conditions spectra are seen under.
    """

    viewing: Profile
    interpolation: str

    def __call__(self, element: Any, place: str) -> Any:
        """The element to run instead of `element`, often itself; `place` names it for messages.

        Raises LinkError where a spectral element finds no viewing conditions, ProfileError where its spectra
        cannot be used.
        """
        if element.signature == "calc":
            inner = tuple(
                self(e, f"{place}, sub-element {i} ({e.signature})") for i, e in enumerate(element.elements)
            )
            if all(a is b for a, b in zip(inner, element.elements, strict=True)):
                return element
            return ResolvedCalculator(element.inputs, element.outputs, element.program, inner)
        if element.signature in _SPECTRAL:
            try:
                element = _SPECTRAL[element.signature](element, self.observer)
            except ProfileError as error:
                raise ProfileError(f"{place}: {error}") from None
        is_table = element.signature in ("clut", "xclt")
        if is_table and element.inputs == 3 and self.interpolation == "tetrahedral":
            return TetrahedralTable(element.table)
        return element

    @cached_property
    def observer(self) -> Observer:
        """Whom the spectra are seen by."""
        return observer(self.viewing)


def holds_spectra(element: Any) -> bool:
    """Whether an element is a spectral one, or a calculator that applies one."""
    return element.signature in _SPECTRAL or any(map(holds_spectra, getattr(element, "elements", ())))


def _wavelengths(element: Any) -> Wavelengths:
    first, last = element.wavelengths
    return Wavelengths(first, last, element.steps)


def _lights(element: Any, seen_by: Observer) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """XYZ of a spectral matrix's spectra, shape (3, channels), and of its offset."""
    matrix = seen_by.emission(_wavelengths(element), element.white)
    return matrix @ element.spectra.T, matrix @ element.offset


def _emission_matrix(element: Any, seen_by: Observer) -> Matrix:
    return Matrix.of(*_lights(element, seen_by))


def _inverse_emission_matrix(element: Any, seen_by: Observer) -> Matrix:
    matrix, offset = _lights(element, seen_by)
    if matrix.shape != (3, 3):
        raise UnsupportedError(
            f"inverse of a spectral matrix of {matrix.shape[1]} channels, which has none: expected 3"
        )
    if not np.linalg.cond(matrix) < 1e12:
        raise ProfileError("spectra: their colours are not independent, expected a matrix with an inverse")
    inverse = np.linalg.inv(matrix)
    return Matrix.of(inverse, -inverse @ offset)


def _emission(element: Any, seen_by: Observer) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """The matrix from the element's spectra to XYZ, and the white that its Lab is relative to."""
    matrix = seen_by.emission(_wavelengths(element), element.white)
    return matrix, matrix @ element.white


def _reflectance(element: Any, seen_by: Observer) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """As `_emission`; relative to the medium, each of X, Y, Z is scaled so that its white is the light's."""
    matrix = seen_by.reflectance(_wavelengths(element))
    light, medium = matrix.sum(axis=1), matrix @ element.white
    if element.absolute:
        return matrix, light
    if not (medium > 0).all():
        raise ProfileError(f"white: found XYZ {medium}, expected above 0")
    return matrix * (light / medium)[:, None], light


def _table(element: Any, seen_by: Observer) -> Clut:
    matrix, white = (_emission if element.signature == "eclt" else _reflectance)(element, seen_by)
    XYZ = element.table @ matrix.T
    if element.lab:
        with np.errstate(all="ignore"):
            XYZ = np.stack(xyz_to_lab(*np.moveaxis(XYZ / white, -1, 0)), axis=-1)
    return Clut(XYZ)


def _observer(element: Any, seen_by: Observer) -> Any:
    matrix, white = (_emission if element.signature == "eobs" else _reflectance)(element, seen_by)
    if not element.lab:
        return Matrix.of(matrix)
    relative = Matrix.of(matrix / white[:, None])
    program = parse(f"in(0,{element.inputs}) mtx(0) tLab out(0,3)")
    return ResolvedCalculator(element.inputs, 3, program, (relative,))


_SPECTRAL: Mapping[str, Callable[[Any, Observer], Any]] = {
    "emtx": _emission_matrix,
    "iemx": _inverse_emission_matrix,
    "eclt": _table,
    "rclt": _table,
    "eobs": _observer,
    "robs": _observer,
}
