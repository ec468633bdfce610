"""The spaces on either side of a profile's transform, and the names of their channels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iccbrdf.calc.decoding import decoding_of
from iccbrdf.errors import ProfileError, UnsupportedError
from iccbrdf.icc import ColorantTable, MultiProcess, Profile, TagArray, channel_count

_NAMES = {
    "XYZ ": ("X", "Y", "Z"),
    "Lab ": ("L*", "a*", "b*"),
    "RGB ": ("R", "G", "B"),
    "CMYK": ("C", "M", "Y", "K"),
    "CMY ": ("C", "M", "Y"),
    "GRAY": ("Gray",),
}


_KINDS = {
    "device": "device space",
    "mcs": "multiplex space",
    "pcs": "connection space",
    "spectral": "spectral connection space",
    "named": "named colours",
}


@dataclass(frozen=True)
class Space:
    """`kind` is device, mcs, pcs, spectral or named; `signature` the header's characters (or nc000a)."""

    kind: str
    signature: str
    names: tuple[str, ...]

    @property
    def text(self) -> str:
        """For messages."""
        return f"{_KINDS[self.kind]} {self.signature.strip()} of {len(self.names)} channels"


def pcs_space(profile: Profile) -> Space:
    """The colorimetric connection space."""
    signature = profile.header.pcs
    if signature not in ("XYZ ", "Lab "):
        raise ProfileError(
            f"{profile.source}: header: connection space {signature!r}, expected 'XYZ ' or 'Lab '"
        )
    return Space("pcs", signature, _NAMES[signature])


def spectral_space(profile: Profile) -> Space:
    """The spectral connection space; its channels are named by their wavelengths where they have one each."""
    header = profile.header
    count = channel_count(header.spectral_pcs)
    if not count:
        raise ProfileError(
            f"{profile.source}: header: spectral connection space {header.spectral_pcs!r}, "
            "expected rs, ts, es, bs or sm and four hex digits, at least one channel"
        )
    names = tuple(map(str, range(1, count + 1)))
    if count == header.spectral_steps and np.isfinite(header.spectral_range).all():
        names = tuple(f"{wavelength:g} nm" for wavelength in np.linspace(*header.spectral_range, count))
    return Space("spectral", header.spectral_pcs, names)


def mcs_space(profile: Profile) -> Space:
    """The multiplex channel space, whose names stand in the tag mcta."""
    signature = profile.header.mcs
    count = channel_count(signature)
    if not signature.startswith("mc") or not count:
        raise ProfileError(
            f"{profile.source}: header: multiplex space {signature!r}, expected mc and four hex digits, "
            "at least one channel"
        )
    names = profile.get("mcta")
    if names is None:
        raise ProfileError(f"{profile.source}: tag mcta (names of the multiplex channels) is missing")
    if not isinstance(names, TagArray):
        raise ProfileError(
            f"{profile.source}: tag mcta: found type {names.signature!r}, expected a tag array"
        )
    try:
        texts = names.texts()
    except ValueError as error:
        raise ProfileError(f"{profile.source}: tag mcta: {error}") from None
    if len(texts) != count:
        raise ProfileError(f"{profile.source}: tag mcta: {len(texts)} names, expected {count} by the header")
    for i, text in enumerate(texts):
        if text in texts[:i]:
            raise ProfileError(f"{profile.source}: tag mcta: channel name {text!r} comes twice")
    return Space("mcs", signature, texts)


def device_space(profile: Profile, field: str = "colour_space") -> Space:
    """The device space of the header's `field`.

    Its channels are named by the colour space; those of an unnamed one (ncNNNN, NCLR) by the tag clrt; where
    there is none, a channel that alone feeds one multiplex channel bears that channel's name, and others
    are numbered from 1.
    """
    signature: str = getattr(profile.header, field)
    if signature in _NAMES:
        return Space("device", signature, _NAMES[signature])
    count = channel_count(signature)
    if not count:
        raise UnsupportedError(f"{profile.source}: header: device space {signature!r} is not known")
    names = _colorant_names(profile, count) or _decoded_names(profile, count)
    return Space("device", signature, names or tuple(map(str, range(1, count + 1))))


def _colorant_names(profile: Profile, count: int) -> tuple[str, ...] | None:
    """Names in the colorant table; None where it is missing or does not name each channel once."""
    table = profile.get("clrt")
    if not isinstance(table, ColorantTable) or not len(set(table.names)) == len(table.names) == count:
        return None
    return table.names


def _decoded_names(profile: Profile, count: int) -> tuple[str, ...] | None:
    """Names of device channels by what they are decoded to; None where that is not one to one."""
    process = profile.get("A2M0")
    if not isinstance(process, MultiProcess) or len(process.elements) != 1:
        return None
    decoding = decoding_of(process.elements[0])
    if decoding is None or len(decoding.sources) != count:
        return None
    names = mcs_space(profile).names
    return tuple(names[decoding.sources.index(i)] for i in range(count))
