"""What profiles say about spectra: processing elements that an observer looks at, and their wavelengths.

The elements hold spectra and become colours only under the profile's viewing conditions; `iccbrdf.cmm`
brings the two together (ICC.2, 11.2, and the ICC's reference implementation).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from iccbrdf.icc.elements import ELEMENTS, Grid
from iccbrdf.icc.fields import (
    F16,
    U16,
    U32,
    FloatArray,
    Floats,
    Repeat,
    Reserved,
    encodable,
    tag_layout,
)
from iccbrdf.icc.header import Colour
from iccbrdf.icc.layout import Field, Layout, Record, Seen
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.tags import TAGS

ABSOLUTE, LAB = 1, 2
"""Flags: XYZ is not scaled to the medium's white; the results are L*, a*, b*."""

_RANGE = Repeat(F16, 2)
_CHANNELS = range(1, 65536)


def _range(steps: Any) -> tuple[Field, Field]:
    return Field("wavelengths", _RANGE), Field("steps", U16, derived=steps, valid=range(2, 65536))


class _Spectral(Record):
    """What all of the elements share.

    `wavelengths` are the first and the last one in nm, between which the spectra have samples at equal
    distances; `white` is the spectrum of the white, shape (steps,).
    """

    wavelengths: tuple[float, float]
    white: FloatArray
    flags: int = 0

    @property
    def steps(self) -> int:
        """Samples of a spectrum."""
        return len(self.white)

    @property
    def absolute(self) -> bool:
        return bool(self.flags & ABSOLUTE)

    @property
    def lab(self) -> bool:
        return bool(self.flags & LAB)

    def check(self) -> None:
        first, last = self.wavelengths
        if not (np.isfinite([first, last]).all() and first < last):
            raise ValueError(f"wavelengths: found {first} to {last}, expected finite ones that increase")
        if self.white.ndim != 1 or len(self.white) < 2:
            raise ValueError(f"white: found shape {self.white.shape}, expected two or more in a row")


class _OptionalOffset(Floats):
    """One spectrum; zeros where the element ends before it."""

    def read(self, reader: Reader, name: str, seen: Seen) -> FloatArray:
        return super().read(reader, name, seen) if reader.left else np.zeros(seen["steps"], np.float32)


class _SpectralMatrix(_Spectral):
    """One spectrum for each device channel."""

    spectra: FloatArray
    offset: FloatArray

    def check(self) -> None:
        super().check()
        if self.spectra.ndim != 2 or self.spectra.shape[1] != self.steps or not len(self.spectra):
            raise ValueError(f"spectra: found shape {self.spectra.shape}, expected (channels, {self.steps})")
        if self.offset.shape != (self.steps,):
            raise ValueError(f"offset: found shape {self.offset.shape}, expected {(self.steps,)}")


def _matrix_layout(signature: str, device: str) -> Layout:
    return tag_layout(
        signature,
        Field("inputs", U16, derived=lambda r: r.inputs, valid=_CHANNELS if device == "inputs" else (3,)),
        Field("outputs", U16, derived=lambda r: r.outputs, valid=(3,) if device == "inputs" else _CHANNELS),
        *_range(lambda r: r.steps),
        Reserved(2),
        Field("white", Floats(lambda seen: (seen["steps"],))),
        Field("spectra", Floats(lambda seen: (seen[device], seen["steps"]))),
        Field("offset", _OptionalOffset(lambda seen: (seen["steps"],))),
        exact=True,
    )


@ELEMENTS.add("emtx")
@dataclass(frozen=True, eq=False)
class EmissionMatrix(_SpectralMatrix):
    """Lights that add up, to XYZ; `spectra` has shape (inputs, steps), `offset` is what shines without any.

    XYZ is scaled so that `white` has Y = 1.
    """

    wavelengths: tuple[float, float]
    white: FloatArray
    spectra: FloatArray
    offset: FloatArray

    signature = "emtx"
    outputs = 3
    layout = _matrix_layout(signature, "inputs")

    @property
    def inputs(self) -> int:
        return len(self.spectra)


@ELEMENTS.add("iemx")
@dataclass(frozen=True, eq=False)
class InverseEmissionMatrix(_SpectralMatrix):
    """The inverse of `EmissionMatrix`: XYZ to amounts of lights; `spectra` has shape (outputs, steps)."""

    wavelengths: tuple[float, float]
    white: FloatArray
    spectra: FloatArray
    offset: FloatArray

    signature = "iemx"
    inputs = 3
    layout = _matrix_layout(signature, "outputs")

    @property
    def outputs(self) -> int:
        return len(self.spectra)


def _clut_layout(signature: str) -> Layout:
    return tag_layout(
        signature,
        Field("inputs", U16, derived=lambda r: r.inputs, valid=range(1, 17)),
        Field("outputs", U16, derived=lambda r: r.outputs, valid=(3,)),
        Field("flags", U32),
        *_range(lambda r: r.steps),
        Field("encoding", U16, valid=range(4)),
        Field("grid", Grid(), derived=lambda r: r.table.shape[:-1]),
        Field("table", Floats(lambda seen: (*seen["grid"], seen["steps"]))),
        Field("white", Floats(lambda seen: (seen["steps"],))),
        exact=True,
    )


class _SpectralClut(_Spectral):
    """A table of spectra, shape (g_1, ..., g_inputs, steps), stored as that of an `ExtendedClut`."""

    table: FloatArray
    encoding: int

    outputs = 3

    @property
    def inputs(self) -> int:
        return self.table.ndim - 1

    def check(self) -> None:
        super().check()
        *grid, steps = self.table.shape or (0,)
        if not 1 <= len(grid) <= 16 or not all(2 <= g <= 255 for g in grid) or steps != self.steps:
            raise ValueError(
                f"table: found shape {self.table.shape}, expected 1 to 16 inputs of 2 to 255 grid points, "
                f"then {self.steps}"
            )
        object.__setattr__(self, "table", encodable(self.table, self.encoding))
        object.__setattr__(self, "white", encodable(self.white, self.encoding))


@ELEMENTS.add("eclt")
@dataclass(frozen=True, eq=False)
class EmissionClut(_SpectralClut):
    """Light interpolated between the nodes of a table, to XYZ or Lab; `white` has Y = 1."""

    wavelengths: tuple[float, float]
    white: FloatArray
    table: FloatArray
    encoding: int = 0
    flags: int = 0

    signature = "eclt"
    layout = _clut_layout(signature)


@ELEMENTS.add("rclt")
@dataclass(frozen=True, eq=False)
class ReflectanceClut(_SpectralClut):
    """Reflectance interpolated between the nodes of a table, to XYZ or Lab under the profile's illuminant.

    `white` is the medium's; unless `absolute`, its colour becomes that of the illuminant.
    """

    wavelengths: tuple[float, float]
    white: FloatArray
    table: FloatArray
    encoding: int = 0
    flags: int = 0

    signature = "rclt"
    layout = _clut_layout(signature)


def _observer_layout(signature: str) -> Layout:
    return tag_layout(
        signature,
        Field("inputs", U16, derived=lambda r: r.inputs),
        Field("outputs", U16, derived=lambda r: r.outputs, valid=(3,)),
        *_range(lambda r: r.steps),
        Field("flags", U16),
        Field("white", Floats(lambda seen: (seen["steps"],))),
        exact=True,
    )


class _Observer(_Spectral):
    """The channels are the samples of one spectrum."""

    outputs = 3

    @property
    def inputs(self) -> int:
        return self.steps


@ELEMENTS.add("eobs")
@dataclass(frozen=True, eq=False)
class EmissionObserver(_Observer):
    """The spectrum of a light, to XYZ or Lab; `white` has Y = 1."""

    wavelengths: tuple[float, float]
    white: FloatArray
    flags: int = 0

    signature = "eobs"
    layout = _observer_layout(signature)


@ELEMENTS.add("robs")
@dataclass(frozen=True, eq=False)
class ReflectanceObserver(_Observer):
    """A reflectance spectrum, to XYZ or Lab under the profile's illuminant; see `ReflectanceClut`."""

    wavelengths: tuple[float, float]
    white: FloatArray
    flags: int = 0

    signature = "robs"
    layout = _observer_layout(signature)


@TAGS.add("sdin")
@dataclass(frozen=True, eq=False)
class SpectralDataInfo(Record):
    """spectralDataInfoType: the kind of spectra that a profile was made of, and their wavelengths in nm.

    space : as the header's spectral connection space (rs001f: reflectance at 31 wavelengths)
    wavelengths, steps : of the spectra; bispectral_... : those of the light, for bi-spectral data
    """

    space: str
    wavelengths: tuple[float, float] = (0.0, 0.0)
    steps: int = 0
    bispectral_wavelengths: tuple[float, float] = (0.0, 0.0)
    bispectral_steps: int = 0

    signature = "sdin"
    layout = tag_layout(
        signature,
        Field("space", Colour()),
        Field("wavelengths", _RANGE),
        Field("steps", U16),
        Field("bispectral_wavelengths", _RANGE),
        Field("bispectral_steps", U16),
    )
