"""The tags that state an illuminant and an observer: svcn, c2sp and s2cp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import InputError, nearest
from iccbrdf.icc import Matrix, MultiProcess, ViewingConditions
from iccbrdf.icc.header import D50
from iccbrdf.icc.tags import ILLUMINANTS, OBSERVERS

# 5 nm from 380 to 780 nm, the CIE's own step for colorimetry of reflecting samples.
_START, _END, _STEP = 380, 780, 5

# Bradford cone responses, as ICC.1 Annex E uses them for chromatic adaptation.
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


@dataclass(frozen=True)
class Viewing:
    """An illuminant and an observer, with what a profile stores of them."""

    illuminant: str
    observer: str
    white: tuple[float, float, float]
    svcn: ViewingConditions | None
    """None for D50 and the 2 degree observer, the ICC's own conditions, which need no statement."""

    @property
    def text(self) -> str:
        """For descriptions."""
        return f"{self.illuminant}, {self.observer}"

    def to_standard(self) -> MultiProcess:
        """c2sp: XYZ of these conditions -> D50 and the 2 degree observer.

        A Bradford adaptation of the white point.  It takes white to white exactly; for other colours it
        stands in for the change of observer, which three numbers cannot carry.
        """
        return _matrix_process(_adaptation(self.white, D50))

    def from_standard(self) -> MultiProcess:
        """s2cp: the inverse of c2sp."""
        return _matrix_process(np.linalg.inv(_adaptation(self.white, D50)))


def viewing(illuminant: str, observer: str, white: tuple[float, ...]) -> Viewing:
    """The conditions of an illuminant (key of `ILLUMINANTS`) and an observer (key of `OBSERVERS`).

    `white` is the XYZ of the perfect diffuser that the measurements state, Y = 1; for D50 and the 2 degree
    observer it is always the ICC's own.  Raises InputError where a name is unknown.
    """
    for value, valid, what in ((illuminant, ILLUMINANTS, "illuminant"), (observer, OBSERVERS, "observer")):
        if value not in valid:
            raise InputError(f"{what} {value!r} is unknown: {nearest(value, valid)}")
    if (ILLUMINANTS[illuminant], OBSERVERS[observer]) == (1, 1):
        return Viewing(illuminant, observer, D50, None)
    cmfs, spd = _tables(illuminant, observer)
    x, y, z = white
    # Y is a luminance; 100 cd/m2 is a round figure, and only the ratios are used.
    luminance = (100 * x, 100 * y, 100 * z)
    svcn = ViewingConditions(
        observer=OBSERVERS[observer],
        observer_range=(_START, _END),
        observer_table=cmfs.T,
        illuminant=ILLUMINANTS[illuminant],
        illuminant_range=(_START, _END),
        spd=spd,
        illuminant_XYZ=luminance,
        surround_XYZ=luminance,
    )
    return Viewing(illuminant, observer, (x, y, z), svcn)


def _tables(illuminant: str, observer: str) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Colour-matching functions (n, 3) and relative spectral power (n,)."""
    import colour  # takes a second to import, and only other conditions than D50/2 need it

    shape = colour.SpectralShape(_START, _END, _STEP)
    cmfs = colour.MSDS_CMFS[observer].copy().align(shape)
    spd = colour.SDS_ILLUMINANTS[illuminant].copy().align(shape)
    return cmfs.values, spd.values


def _adaptation(source: tuple[float, ...], target: tuple[float, ...]) -> npt.NDArray[np.float64]:
    """Von Kries adaptation in Bradford's cone space (ICC.1, Annex E)."""
    gains = (_BRADFORD @ target) / (_BRADFORD @ source)
    matrix: npt.NDArray[np.float64] = np.linalg.inv(_BRADFORD) @ np.diag(gains) @ _BRADFORD
    return matrix


def _matrix_process(matrix: npt.NDArray[np.floating[Any]]) -> MultiProcess:
    element = Matrix(inputs=3, matrix=matrix, offset=np.zeros(3))
    return MultiProcess(3, 3, (element,))
