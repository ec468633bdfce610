"""Version 2 and 4 profiles, run by Little CMS (imagecodecs): device colours to and from XYZ under D50."""

from __future__ import annotations

from typing import Literal

import imagecodecs
import numpy as np

from iccbrdf.errors import InputError, UnsupportedError
from iccbrdf.icc import Profile
from iccbrdf.images.blocks import Array

_CALLED = {"RGB ": "rgb", "CMYK": "cmyk"}
# Little CMS counts inks in per cent where its samples are floats.
_SCALE = {"RGB ": 1.0, "CMYK": 100.0}
_INTENTS = {
    "relative": imagecodecs.CMS.INTENT.RELATIVE_COLORIMETRIC,
    "absolute": imagecodecs.CMS.INTENT.ABSOLUTE_COLORIMETRIC,
}

Intent = Literal["relative", "absolute"]


def check_profile(profile: Profile, expected: str, what: str) -> None:
    """Refuse a profile that Little CMS cannot run, or one of another colour space than `expected`.

    Raises
    ------
    UnsupportedError
        Version 5.
    InputError
        Another colour space, or Little CMS finds it damaged; `what` says what the profile is for.
    """
    if profile.header.version[0] > 4:
        raise UnsupportedError(
            f"{profile.source}: version {profile.header.version[0]}; {what} has a profile of version 2 or 4"
        )
    if profile.header.colour_space != expected:
        raise InputError(
            f"{profile.source}: colour space {profile.header.colour_space!r}, "
            f"expected {expected!r} for {what}"
        )
    pixel = np.zeros((1, 1, 4 if expected == "CMYK" else 3), np.float32)
    to_XYZ(pixel, profile, "relative")


def to_XYZ(device: Array, profile: Profile, intent: Intent) -> Array:
    """XYZ under D50 for the 2 degree observer, Y = 1 for the perfect diffuser (relative: for the medium).

    Parameters
    ----------
    device
        Device values in 0..1, shape (height, width, channels of the profile).
    profile
        RGB or CMYK.

    Returns
    -------
    Array
        float32, shape (height, width, 3).

    Raises
    ------
    InputError
        Little CMS refuses the profile.
    """
    space = profile.header.colour_space
    scaled = np.asarray(device, np.float32) * np.float32(_SCALE[space])
    return _run(scaled, profile, intent, colorspace=_CALLED[space], outcolorspace="xyz")


def from_XYZ(XYZ: Array, profile: Profile) -> Array:
    """RGB device values, nominally 0..1, of XYZ relative to D50: the relative intent, float32.

    XYZ must be finite.  Beyond the device's gamut the values lie outside 0..1, or at its border where the
    profile holds tables.  Raises InputError where Little CMS refuses the profile.
    """
    return _run(np.asarray(XYZ, np.float32), profile, "relative", colorspace="xyz", outcolorspace="rgb")


def _run(pixels: Array, profile: Profile, intent: Intent, *, colorspace: str, outcolorspace: str) -> Array:
    chain = [profile.to_bytes(), imagecodecs.cms_profile("xyz")]
    if colorspace == "xyz":
        chain.reverse()
    try:
        found: Array = imagecodecs.cms_transform(
            np.ascontiguousarray(pixels),
            *chain,
            colorspace=colorspace,
            outcolorspace=outcolorspace,
            outdtype=np.float32,
            intent=_INTENTS[intent],
        )
    except (imagecodecs.CmsError, ValueError) as error:
        raise InputError(f"{profile.source}: Little CMS cannot use this profile: {error}") from error
    return found
