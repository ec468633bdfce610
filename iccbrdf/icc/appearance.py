"""The processing elements between XYZ and J, a, b of the colour appearance model (ICC.2, 11.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from iccbrdf.icc.elements import ELEMENTS
from iccbrdf.icc.fields import F32, U16, Repeat, tag_layout
from iccbrdf.icc.layout import Field, Layout, Record


def _layout(signature: str) -> Layout:
    return tag_layout(
        signature,
        Field("inputs", U16, derived=lambda r: 3, valid=(3,)),
        Field("outputs", U16, derived=lambda r: 3, valid=(3,)),
        Field("white", Repeat(F32, 3)),
        Field("luminance", F32),
        Field("background", F32),
        Field("surround", F32),
        Field("induction", F32),
        Field("adaptation", F32),
        exact=True,
    )


@dataclass(frozen=True, eq=False)
class _Appearance(Record):
    """What the two elements share.

    white : X, Y, Z of the adopted white, in the scale of the colours; the model is made for Y = 100
    luminance : of the adapting field, cd/m^2 (La)
    background : relative luminance of the background, in the scale of the white (Yb)
    surround, induction, adaptation : the factors c, Nc and F; 0.69, 1 and 1 for an average surround
    """

    white: tuple[float, float, float]
    luminance: float = 500.0
    background: float = 20.0
    surround: float = 0.69
    induction: float = 1.0
    adaptation: float = 1.0

    inputs = outputs = 3

    def check(self) -> None:
        fields = ("luminance", "background", "surround", "induction", "adaptation")
        numbers = (*self.white, *(getattr(self, name) for name in fields))
        if not all(map(math.isfinite, numbers)):
            raise ValueError(f"found {numbers}, expected finite ones")


@ELEMENTS.add("XtoJ")
@dataclass(frozen=True, eq=False)
class XYZToJab(_Appearance):
    """XYZ to lightness J and chroma on the axes red-green and yellow-blue."""

    signature = "XtoJ"
    layout = _layout(signature)


@ELEMENTS.add("JtoX")
@dataclass(frozen=True, eq=False)
class JabToXYZ(_Appearance):
    """J, a, b to XYZ."""

    signature = "JtoX"
    layout = _layout(signature)
