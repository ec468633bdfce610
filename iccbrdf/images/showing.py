"""XYZ for the eye: through a display's profile, by Little CMS, to values that the display can show."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import imagecodecs
import numpy as np

from iccbrdf.brdf.colour_difference import XYZ_to_Lab
from iccbrdf.errors import InputError, UsageError, nearest
from iccbrdf.files import StrPath
from iccbrdf.icc import Mluc, Profile, read_profile
from iccbrdf.icc.header import D50
from iccbrdf.images.blocks import Array
from iccbrdf.images.little_cms import check_profile, from_XYZ, to_XYZ

Highlights = Literal["clip", "roll-off"]
HIGHLIGHTS: tuple[Highlights, ...] = ("clip", "roll-off")

# Little CMS turns infinities into black; beyond this value everything is white anyway.
_BRIGHTEST = 1e6
# Half a level of 8 bits above the display's white.
_WHITE = 1.0045
_KNEE = 0.9
"""Of the roll-off; above the Y of common papers, so that only highlights are changed."""
_NOTICEABLE = 3.0
"""CIE 1976 difference from which a colour counts as not shown; the tables of LUT profiles err by less."""
_NEAR_BORDER = 1 / 255
ABOVE_WHITE_MARK = (0.0, 1.0, 1.0)
OUT_OF_GAMUT_MARK = (1.0, 0.0, 1.0)
"""Device colours of the gamut warning: cyan for highlights, magenta for colours."""


@functools.cache
def srgb() -> Profile:
    """The sRGB display profile of Little CMS, dated 2000-01-01 so that it is the same on every day."""
    return Profile.from_bytes(_dated(imagecodecs.cms_profile("srgb")), source="sRGB")


@functools.cache
def display_p3() -> Profile:
    """Display P3: the primaries of DCI-P3 (SMPTE RP 431-2), white and curve of sRGB."""
    wide = imagecodecs.cms_profile(
        "rgb", whitepoint=(0.3127, 0.329), primaries=(0.68, 0.32, 0.265, 0.69, 0.15, 0.06), gamma=2.2
    )
    curve = srgb()["rTRC"]
    tags = {"desc": Mluc.of("Display P3"), "rTRC": curve, "gTRC": curve, "bTRC": curve}
    made = Profile.from_bytes(_dated(wide), source="Display P3").replace(tags=tags)
    return Profile.from_bytes(made.to_bytes(), source="Display P3")


DISPLAYS: dict[str, Callable[[], Profile]] = {"srgb": srgb, "display-p3": display_p3}
"""The displays that need no profile of their own."""


def _dated(data: bytes) -> bytes:
    return data[:24] + b"\x07\xd0\0\x01\0\x01" + bytes(6) + data[36:]


def display_profile(display: StrPath) -> Profile:
    """The profile of a display: a name in `DISPLAYS`, or a profile's file.

    Raises
    ------
    InputError
        No such file, a damaged one, or one that is not for RGB.
    UnsupportedError
        A profile of version 5.
    """
    if display in DISPLAYS:
        return DISPLAYS[str(display)]()
    if not Path(display).exists():
        raise InputError(f"{display}: neither a file nor a display: {nearest(str(display), DISPLAYS)}")
    profile = read_profile(display)
    check_profile(profile, "RGB ", "a display")
    return profile


def finite(xyz: Array) -> Array:
    """`xyz` with NaN as 0 and infinities as very large numbers."""
    numbers: Array = np.nan_to_num(xyz, posinf=_BRIGHTEST, neginf=-_BRIGHTEST)
    return numbers.clip(-_BRIGHTEST, _BRIGHTEST)


class Shown(NamedTuple):
    """Device values in 0..1, (height, width, 3), and for each pixel whether it is what was asked for."""

    device: Array
    above_white: Array
    """Brighter than the display's white."""
    out_of_gamut: Array
    """Not above white, yet shown in another colour."""


@dataclass(frozen=True)
class Showing:
    """How XYZ is shown: a callable from XYZ (D50, Y = 1 for white; (height, width, 3)) to `Shown`.

    Attributes
    ----------
    profile
        Of the display: RGB, version 2 or 4, matrix or tables.
    exposure
        Factor on XYZ; above 1 for prints in dim light, below 1 to keep highlights from clipping.
    highlights
        "clip": what is above white is cut off.  "roll-off": Y above 0.9 is compressed to
        1 - 0.1 exp(-(Y - 0.9) / 0.1), which never reaches 1, and the chromaticity goes to that of white in
        the same measure, since no display has bright colours at its white.
    gamut_warning
        Whether pixels above white become cyan and those out of gamut magenta.  A pixel is out of gamut where
        what the display shows is 3 or more CIE 1976 units off.

    Raises UsageError for an exposure that is not positive and for unknown highlights.
    """

    profile: Profile
    exposure: float = 1.0
    highlights: Highlights = "clip"
    gamut_warning: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.exposure < np.inf:
            raise UsageError(f"exposure {self.exposure}, expected a positive factor")
        if self.highlights not in HIGHLIGHTS:
            raise UsageError(
                f"unknown highlights {self.highlights!r}: {nearest(self.highlights, HIGHLIGHTS)}"
            )

    def __call__(self, xyz: Array) -> Shown:
        with np.errstate(over="ignore"):
            wanted = finite(np.asarray(xyz, np.float32) * np.float32(self.exposure))
        above_white = wanted[..., 1] > _WHITE
        if self.highlights == "roll-off":
            wanted = _rolled_off(wanted)
        device = from_XYZ(wanted, self.profile)
        near_border = ((device < _NEAR_BORDER) | (device > 1 - _NEAR_BORDER)).any(axis=-1)
        device = device.clip(0, 1)
        out_of_gamut = near_border & (wanted[..., 1] <= _WHITE)
        out_of_gamut[out_of_gamut] = self._is_off(device[out_of_gamut], wanted[out_of_gamut])
        if self.gamut_warning:
            device[above_white] = ABOVE_WHITE_MARK
            device[out_of_gamut] = OUT_OF_GAMUT_MARK
        return Shown(device, above_white, out_of_gamut)

    def _is_off(self, device: Array, wanted: Array) -> Array:
        """Whether pixels (n, 3) look otherwise than wanted."""
        if not len(device):
            return np.zeros(0, bool)
        shown = to_XYZ(device[np.newaxis], self.profile, "relative")[0]
        off: Array = np.linalg.norm(XYZ_to_Lab(shown, D50) - XYZ_to_Lab(wanted, D50), axis=-1) >= _NOTICEABLE
        return off


def _rolled_off(xyz: Array) -> Array:
    Y = xyz[..., 1:2]
    bright = np.maximum(Y, _KNEE)
    # The slope of the compressed Y, 1 at the knee and 0 at white.
    left = np.exp((_KNEE - bright) / (1 - _KNEE))
    compressed = 1 - (1 - _KNEE) * left
    white = np.array(D50, np.float32)
    rolled: Array = np.where(Y > _KNEE, compressed * (white + left * (xyz / bright - white)), xyz)
    return rolled
