"""The colours of a print job -> XYZ of the flat print, under the viewing conditions of the primaries.

CMYK and RGB go through a profile of version 2 or 4 by Little CMS, with the absolute colorimetric intent:
the relative one would turn the paper into the perfect diffuser, which the primaries' paper is not.  L*a*b*
is decoded by its formula.  What results holds under D50 for the 2 degree observer; where the primaries state
other conditions it is adapted by von Kries in Bradford's cone space (ICC.1, Annex E), the `s2cp` of the
MVIS, which the way to the display undoes exactly.  XYZ is taken as it is, as a colour MID takes it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Any

import numpy as np

from iccbrdf.brdf.models import NORMAL
from iccbrdf.brdf.primaries import OBSERVERS, Primaries
from iccbrdf.build.profiles import XYZ_RANGE
from iccbrdf.build.viewing import Viewing, viewing
from iccbrdf.errors import InputError, InputWarning, UnsupportedError
from iccbrdf.files import StrPath
from iccbrdf.icc import Profile
from iccbrdf.icc.header import D50
from iccbrdf.images import Block, Place, Samples, TiffSource, open_tiff
from iccbrdf.images.blocks import Array
from iccbrdf.images.checks import check_scale
from iccbrdf.images.little_cms import check_profile, to_XYZ
from iccbrdf.images.tiff_storage import LAB_PHOTOMETRICS
from iccbrdf.measure.colorimetry import Lab_to_XYZ

XYZ_NAMES = ("X", "Y", "Z")

_SPACES = {"SEPARATED": ("CMYK", 4), "RGB": ("RGB ", 3)}
"""Photometric interpretation -> colour space of the profile, and its channels."""
_CMYK_INKS = 1
_OF_MEDIA = "prtr"


class ColourIn:
    """A job's image as an image of real X, Y, Z (and n.x, n.y, n.z, where an XYZ image has them).

    An `ImageSource`; use it in a `with` statement.

    Parameters
    ----------
    path
        A TIFF: CMYK, RGB or L*a*b* of 8 or 16 bits or floats, or one of ours with channels X, Y, Z.
    printer
        The profile of its CMYK or RGB; None for the one that is embedded in the file.
    primaries
        Whose viewing conditions the XYZ is to hold under.

    Attributes
    ----------
    space
        "CMYK", "RGB", "Lab" or "XYZ".
    profile
        The profile that is used, or None.

    Warns
    -----
    InputWarning
        The file has another profile embedded than the one given; the primaries are for another observer;
        or the profile is not one of a print.

    Raises
    ------
    InputError
        No profile is given or embedded, or it does not fit; the channels are no colours; or as `open_tiff`.
    UnsupportedError
        Spot channels or other extra channels; or as `open_tiff`.
    """

    samples: Samples = "real"

    def __init__(self, path: StrPath, printer: Profile | None, primaries: Primaries) -> None:
        self._path = path
        self._conditions = viewing(primaries.illuminant, primaries.observer, primaries.white)
        with ExitStack() as stack:
            self._tiff = stack.enter_context(_open(path))
            self.profile: Profile | None = None
            self.space, self._to_XYZ = self._conversion(printer)
            self._stack = stack.pop_all()
        self.height, self.width = self._tiff.height, self._tiff.width
        has_normals = self.space == "XYZ" and self._tiff.channels > len(XYZ_NAMES)
        self.names: Sequence[str] | None = XYZ_NAMES + NORMAL * has_normals
        self.channels = len(self.names)

    def __enter__(self) -> ColourIn:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def places(self) -> Iterator[Place]:
        """Where the blocks of the image lie, in row order."""
        return self._tiff.places()

    def read(self, place: Place) -> Block:
        """The XYZ at a place, float32; several threads may read at a time."""
        block = self._tiff.read(place)
        # What is not finite is counted where it is computed with.
        with np.errstate(over="ignore", invalid="ignore"):
            block = block._replace(data=self._to_XYZ(block.data))
        check_scale(block, self.samples, XYZ_NAMES + NORMAL, str(self._path))
        return block

    @property
    def summary(self) -> dict[str, Any]:
        """What is done to the colours, for the log."""
        adapted = self.space != "XYZ" and self._conditions.svcn is not None
        return {
            "space": self.space,
            "profile": self.profile.source if self.profile else None,
            "intent": "absolute" if self.profile else None,
            "conditions": self._conditions.text,
            "adaptation": "Bradford, from D50 for the 2 degree observer" if adapted else None,
        }

    def _conversion(self, printer: Profile | None) -> tuple[str, Callable[[Array], Array]]:
        tiff, path = self._tiff, self._path
        if tiff.names is not None:
            if tuple(tiff.names) not in (XYZ_NAMES, XYZ_NAMES + NORMAL):
                raise InputError(
                    f"{path}: channels {', '.join(tiff.names)}, expected colours: CMYK, RGB, L*a*b* or "
                    "X, Y, Z (and n.x, n.y, n.z); a BRDF image goes through `iccbrdf apply`"
                )
            if printer is not None:
                self._warn("the profile that is given is not used: the image holds XYZ")
            return "XYZ", _real if tiff.samples == "real" else _decoded
        self._check_channels()
        self._warn_of_observer()
        if tiff.photometric in LAB_PHOTOMETRICS:
            if printer is not None:
                self._warn("the profile that is given is not used: the image holds L*a*b*")
            decode = _lab_decoder(tiff)
            return "Lab", lambda data: self._adapted(Lab_to_XYZ(decode(data), D50))
        space, _ = _SPACES[tiff.photometric]
        profile = self._checked_profile(printer, space)
        self.profile = profile

        def convert(data: Array) -> Array:
            XYZ = self._adapted(to_XYZ(np.nan_to_num(data).clip(0, 1), profile, "absolute"))
            # Little CMS would make a colour of it.
            XYZ[~np.isfinite(data).all(axis=-1)] = np.nan
            return XYZ

        return space.strip(), convert

    def _check_channels(self) -> None:
        tiff, path = self._tiff, self._path
        if tiff.photometric in LAB_PHOTOMETRICS:
            expected = 3
        elif tiff.photometric in _SPACES:
            _, expected = _SPACES[tiff.photometric]
        else:
            raise InputError(
                f"{path}: photometric interpretation {tiff.photometric}, {tiff.channels} channels without "
                "names, expected CMYK, RGB, L*a*b*, or channels named X, Y, Z in the file"
            )
        if tiff.photometric == "SEPARATED" and tiff.ink_set != _CMYK_INKS:
            raise UnsupportedError(
                f"{path}: its {tiff.channels} inks are not CMYK (InkSet {tiff.ink_set}); spot inks cannot be "
                "proofed: convert them to CMYK"
            )
        if tiff.channels != expected or tiff.extra_samples:
            raise UnsupportedError(
                f"{path}: {tiff.channels} channels, expected {expected} for {tiff.photometric}: spot and "
                "alpha channels cannot be proofed; convert them to process colours or remove them"
            )

    def _checked_profile(self, printer: Profile | None, space: str) -> Profile:
        embedded = self._tiff.profile
        if printer is None:
            if embedded is None:
                raise InputError(
                    f"{self._path}: no profile is embedded; say which one holds: --printer FILE.icc"
                )
            printer = Profile.from_bytes(embedded, source=f"{self._path}: embedded profile")
        elif embedded is not None and embedded != printer.to_bytes():
            self._warn(f"another profile is embedded in it than {printer.source}, which is used")
        check_profile(printer, space, f"{self._path}, an image of {space.strip()},")
        if printer.header.device_class != _OF_MEDIA:
            self._warn(
                f"{printer.source} is no profile of a print (class {printer.header.device_class!r}): its "
                "white becomes the perfect diffuser, brighter than any paper"
            )
        return printer

    def _warn_of_observer(self) -> None:
        if self._conditions.observer != OBSERVERS[0]:
            self._warn(
                "its colours are for the 2 degree observer, the primaries for the "
                f"{self._conditions.observer}: the adaptation takes white to white exactly, other colours "
                "approximately"
            )

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self._path}: {text}", InputWarning, stacklevel=2)

    def _adapted(self, XYZ: Array) -> Array:
        adapted: Array = np.asarray(XYZ, np.float32)
        if self._conditions.svcn is not None:
            adapted = adapted @ adaptation(self._conditions).T.astype(np.float32)
        return adapted


def adaptation(conditions: Viewing) -> Array:
    """The matrix, (3, 3), from XYZ under D50 for the 2 degree observer to `conditions`: the MVIS's s2cp."""
    (element,) = conditions.from_standard().elements
    matrix: Array = element.matrix
    return matrix


def _open(path: StrPath) -> TiffSource:
    with open_tiff(path, lab=True) as tiff:
        is_real = tiff.photometric in LAB_PHOTOMETRICS and tiff.dtype.kind == "f"
    return open_tiff(path, "real" if is_real else None, lab=True)


def _real(data: Array) -> Array:
    return data


def _decoded(data: Array) -> Array:
    """XYZ in u1.15, and normals, of device values in 0..1."""
    return np.concatenate([data[..., :3] * np.float32(XYZ_RANGE[1]), 2 * data[..., 3:] - 1], axis=-1)


def _lab_decoder(tiff: TiffSource) -> Callable[[Array], Array]:
    """From samples as `TiffSource` gives them, in 0..1, to L*, a*, b*.

    TIFF 6.0, section 23 (CIELAB of 8 bits: a* and b* signed); Adobe Photoshop TIFF Technical Notes, 2002
    (of 16 bits: L* over 65535, a* and b* signed in steps of 1/256); ICC.1, table 12 (ICCLAB: a* and b* less
    128; of 16 bits the older encoding, where 65280 is L* = 100).
    """
    if tiff.dtype.kind == "f":
        return _real
    steps = 256.0 if tiff.dtype.itemsize == 2 else 1.0
    largest = float(np.iinfo(tiff.dtype).max)
    is_icc = tiff.photometric == "ICCLAB"
    white = 65280.0 if is_icc and steps > 1 else largest

    def decode(data: Array) -> Array:
        stored = np.rint(data * np.float64(largest))
        ab = stored[..., 1:] / steps
        ab = ab - 128 if is_icc else np.where(ab < 128, ab, ab - 256)
        return np.concatenate([stored[..., :1] * (100 / white), ab], axis=-1)

    return decode
