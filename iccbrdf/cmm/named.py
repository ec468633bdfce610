"""Named colours in a chain: from names and tints to values, and from values to the nearest name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.verify import MAX_WORK
from iccbrdf.cmm.conditions import conditions
from iccbrdf.cmm.ramps import Member, Ramp, has_tints, ramps
from iccbrdf.cmm.spaces import Space, pcs_space, spectral_space
from iccbrdf.cmm.steps import Channel, Process, XYZToLab
from iccbrdf.errors import InputError, LimitError, LinkError, ProfileError, UnsupportedError
from iccbrdf.icc import Profile

_COLOUR: Member = "pcs "
_SPECTRUM: Member = "spec"


@dataclass(frozen=True)
class _Named(Process):
    """A step that looks colours up, which the interpreter alone can run."""

    colours: tuple[Ramp, ...]

    def lift(self, graph: Graph, channels: Sequence[Node], *, finite_inputs: bool) -> list[Node]:
        raise UnsupportedError("named colours are looked up one by one")


@dataclass(frozen=True)
class Lookup(_Named):
    """From positions of colours, and tints where there is a second channel, to `channels` values."""

    channels: int

    def apply(self, channels: Sequence[Channel], env: Mapping[str, float], dtype: Any) -> list[Channel]:
        position, tint = np.broadcast_arrays(channels[0], channels[1] if len(channels) > 1 else 1.0)
        values = np.empty((self.channels, *position.shape), dtype)
        for each in np.unique(position):
            chosen = position == each
            values[:, chosen] = self._colour(each).at(tint[chosen].astype(np.float64)).T
        return list(values)

    def _colour(self, position: float) -> Ramp:
        if not (0 <= position < len(self.colours) and position == int(position)):
            raise InputError(
                f"{self.origin}: found colour {position:g}, expected a whole number from 0 to "
                f"{len(self.colours) - 1}"
            )
        ramp = self.colours[int(position)]
        if not len(ramp.tints):
            raise InputError(f"{self.origin}: {ramp.name!r} has no values in the space that is asked for")
        return ramp


@dataclass(frozen=True)
class Nearest(_Named):
    """From connection space values to the position of the colour that is nearest by CIELAB's distance.

    The first one of several; NaN where a value is not finite.
    """

    to_lab: XYZToLab | None

    def apply(self, channels: Sequence[Channel], env: Mapping[str, float], dtype: Any) -> list[Channel]:
        lab = self.to_lab.apply(channels, env, dtype) if self.to_lab else channels
        L, a, b = np.broadcast_arrays(*(np.asarray(channel, np.float64) for channel in lab))
        least = np.full(L.shape, np.inf)
        position = np.full(L.shape, np.nan, dtype)
        for i, ramp in enumerate(self.colours):
            if len(ramp.tints):
                full = self._lab(ramp)
                distance = (L - full[0]) ** 2 + (a - full[1]) ** 2 + (b - full[2]) ** 2
                position[distance < least] = i
                least = np.fmin(least, distance)
        return [position]

    def _lab(self, ramp: Ramp) -> Sequence[Any]:
        full = list(ramp.values[-1])
        return self.to_lab.apply(full, {}, np.float64) if self.to_lab else full


def named_step(profile: Profile, before: Space | None, *, spectral: bool) -> tuple[Process, Space, Space]:
    """A named-colour profile's part in a chain: what runs, from which space to which.

    At the start of a chain it gives spectra, where it has a spectral connection space and `spectral` allows,
    or colours; after a connection space it gives the nearest colour.  Raises LinkError after anything else.
    """
    origin = f"{profile.source}: named colours"
    tinted = has_tints(profile)
    header = profile.header
    if before is None:
        source = Space("named", "nmcl", ("colour", "tint") if tinted else ("colour",))
        if header.spectral_pcs and tinted and (spectral or not header.pcs):
            destination, member = _spectral_space(profile), _SPECTRUM
        else:
            destination, member = pcs_space(profile), _COLOUR
        channels = len(destination.names)
        colours = ramps(profile, member, channels)
        return Lookup(origin, (), (), channels, 0, 4 * channels, colours, channels), source, destination
    if before.kind not in ("pcs", "spectral"):
        raise LinkError(f"{origin}: found {before.text} before them, expected none or a connection space")
    space = pcs_space(profile)
    colours = ramps(profile, _COLOUR, 3)
    work = 8 * max(1, len(colours))
    if work > MAX_WORK:
        raise LimitError(f"{origin}: a pixel takes operations on more than {MAX_WORK} numbers")
    to_lab = XYZToLab(conditions(profile).white) if space.signature == "XYZ " else None
    return Nearest(origin, (), (), 8, 0, work, colours, to_lab), space, Space("named", "nmcl", ("colour",))


def _spectral_space(profile: Profile) -> Space:
    """As `spectral_space`; sparse matrices count as the whole matrices that they stand for."""
    header = profile.header
    if not header.spectral_pcs.startswith("sm"):
        return spectral_space(profile)
    count = header.spectral_steps * header.bispectral_steps
    if not 0 < count < 1 << 16:
        raise ProfileError(
            f"{profile.source}: header: found matrices of {header.spectral_steps} by "
            f"{header.bispectral_steps} numbers, expected 1 to 65535 of them"
        )
    return Space("spectral", f"bs{count:04x}", tuple(map(str, range(1, count + 1))))
