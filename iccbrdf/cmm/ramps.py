"""What a profile tells of its named colours: values at some tints of each.

ICC.2:2019, 8.10, 9.2.104 and 13.2.1 (an array of structures); ICC.1:2022, 10.17 (namedColor2Type).  The
standard's signatures of the tag and of the array, `nmcl` and `ncol`, are read as well as `ncl2` and `nmcl`,
which the reference implementation has in their stead.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import InputError, LimitError, ProfileError
from iccbrdf.icc import NamedColours, NumberArray, Profile, SparseMatrixArray, TagArray, TagStruct, Utf8

NAMED = ("ncl2", "nmcl")
"""Tags that hold named colours."""

MAX_NUMBERS = 1 << 24
"""Of all the colours of a profile together."""

_ARRAYS = ("nmcl", "ncol")

Member = Literal["pcs ", "spec", "dev "]
_WHAT: Mapping[Member, str] = {
    "pcs ": "connection space values",
    "spec": "spectrum",
    "dev ": "device values",
}

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ramp:
    """A colour from its lightest tint to its full strength.

    tints : shape (n,), increasing within 0..1; n = 0 where the profile does not tell the values
    values : shape (n, channels)
    """

    name: str
    tints: Array
    values: Array

    def at(self, tints: Array) -> Array:
        """Values (..., channels) at tints, which are held within 0..1; linear between those that are told.

        Raises InputError where there are none so light, or so strong.
        """
        wanted = np.clip(tints, 0, 1)
        first, last = self.tints[[0, -1]]
        outside = wanted[(wanted < first) | (wanted > last)]
        if outside.size:
            told = f"{first:g} to {last:g}" if first < last else f"only {first:g}"
            raise InputError(f"colour {self.name!r}: found tint {outside[0]:g}, the profile tells {told}")
        right = np.searchsorted(self.tints, wanted).clip(max=len(self.tints) - 1)
        left = np.maximum(right - 1, 0)
        span = np.where(left < right, self.tints[right] - self.tints[left], 1)
        weight = ((wanted - self.tints[left]) / span)[..., None]
        values: Array = self.values[left] * (1 - weight) + self.values[right] * weight
        return values


def named_colours(profile: Profile) -> tuple[str, ...]:
    """The names of a profile's colours, in order: a transform takes a colour by its position among them.

    Raises ProfileError where the profile has no named colours, or malformed ones.
    """
    table = _table(profile)
    if isinstance(table, NamedColours):
        return tuple(f"{table.prefix}{colour.name}{table.suffix}" for colour in table.colours)
    return tuple(_name(colour) for colour in _structures(profile, table)[1])


def ramps(profile: Profile, member: Member, channels: int) -> tuple[Ramp, ...]:
    """The colours of a profile: their values in the connection space, their spectra, or their device values.

    Raises ProfileError where they are malformed, LimitError beyond `MAX_NUMBERS`.
    """
    table = _table(profile)
    if isinstance(table, NamedColours):
        return _plain_ramps(profile, table, member)
    place = f"{profile.source}: named colours"
    zero, colours = _structures(profile, table)
    lightest = _rows(zero.get(member), channels, f"{place}: zero tint, {_WHAT[member]}")
    found: list[Ramp] = []
    room = MAX_NUMBERS
    for colour in colours:
        name = _name(colour)
        room -= max(1, _size(colour.get(member), channels))
        if room < 0:
            raise LimitError(f"{place}: more than {MAX_NUMBERS} numbers for their {_WHAT[member]}")
        found.append(_ramp(colour, member, channels, lightest, f"{place}: {name!r}"))
    return tuple(found)


def has_tints(profile: Profile) -> bool:
    """Whether the profile tells tints of its colours, as those of version 5 do."""
    return isinstance(_table(profile), TagArray)


def _table(profile: Profile) -> NamedColours | TagArray:
    for tag in NAMED:
        if tag not in profile:
            continue
        value = profile[tag]
        if isinstance(value, NamedColours) or (isinstance(value, TagArray) and value.array_type in _ARRAYS):
            return value
        found = f"an array of {value.array_type!r}" if isinstance(value, TagArray) else repr(value.signature)
        raise ProfileError(
            f"{profile.source}: tag {tag}: found {found}, expected 'ncl2', or an array of 'nmcl'"
        )
    raise ProfileError(f"{profile.source}: no named colours, expected tag {' or '.join(NAMED)}")


def _structures(profile: Profile, table: TagArray) -> tuple[TagStruct, tuple[TagStruct, ...]]:
    """What all colours look like at tint 0, and the colours."""
    for i, item in enumerate(table.items):
        expected = "nmcl" if i else "tnt0"
        if not isinstance(item, TagStruct) or item.type != expected:
            found = item.type if isinstance(item, TagStruct) else getattr(item, "signature", None)
            raise ProfileError(
                f"{profile.source}: named colours: item {i}: found {found!r}, "
                f"expected a structure of type {expected!r}"
            )
    if not table.items:
        raise ProfileError(f"{profile.source}: named colours: found none, expected a zero tint and colours")
    return table.items[0], table.items[1:]


def _name(colour: TagStruct) -> str:
    name = colour.get("name")
    return name.text if isinstance(name, Utf8) else ""


def _size(value: Any, channels: int) -> int:
    if isinstance(value, SparseMatrixArray):
        return channels * len(value.matrices)
    return len(value.values) if isinstance(value, NumberArray) else 0


def _rows(value: Any, channels: int, place: str) -> Array:
    """Values of shape (n, channels), those of matrices row by row; n = 0 where there are none."""
    if value is None:
        return np.empty((0, channels))
    if isinstance(value, SparseMatrixArray):
        numbers = [np.zeros(0), *(_dense(matrix) for matrix in value.matrices if _fits(matrix, channels))]
        flat = np.concatenate(numbers)
        if len(flat) == channels * len(value.matrices) > 0:
            return flat.reshape(-1, channels)
        raise ProfileError(f"{place}: expected matrices of {channels} numbers, one or more")
    if not isinstance(value, NumberArray):
        raise ProfileError(f"{place}: found type {value.signature!r}, expected numbers")
    flat = value.normalised()
    if not flat.size or flat.size % channels:
        raise ProfileError(f"{place}: found {flat.size} numbers, expected a multiple of {channels}")
    return flat.reshape(-1, channels)


def _fits(matrix: Any, channels: int) -> bool:
    return bool(matrix.rows * matrix.columns == channels)


def _dense(matrix: Any) -> Array:
    numbers = np.zeros((matrix.rows, matrix.columns))
    numbers[np.repeat(np.arange(matrix.rows), np.diff(matrix.starts)), matrix.indices] = matrix.values
    return numbers.reshape(-1)


def _ramp(colour: TagStruct, member: Member, channels: int, lightest: Array, place: str) -> Ramp:
    values = _rows(colour.get(member), channels, f"{place}, {_WHAT[member]}")
    told = colour.get("tint")
    if told is None:
        # In equal steps up to full strength.
        tints = np.arange(1, len(values) + 1) / max(len(values), 1)
    elif isinstance(told, NumberArray):
        tints = told.normalised()
    else:
        raise ProfileError(f"{place}, tints: found type {told.signature!r}, expected numbers")
    if not len(values):
        return Ramp(_name(colour), np.zeros(0), values)
    if len(tints) != len(values):
        raise ProfileError(f"{place}: found {len(tints)} tints for {len(values)} {_WHAT[member]}")
    if not (tints[0] >= 0 and tints[-1] <= 1 and (np.diff(tints) > 0).all()):
        raise ProfileError(f"{place}, tints: found {tints}, expected numbers that increase within 0..1")
    if tints[0] > 0 and len(lightest) == 1:
        tints, values = np.concatenate([[0.0], tints]), np.concatenate([lightest, values])
    return Ramp(_name(colour), tints, values)


def _plain_ramps(profile: Profile, table: NamedColours, member: Member) -> tuple[Ramp, ...]:
    full = np.ones(1)
    if member == "dev ":
        numbers = [np.array([c.device]) / 65535 for c in table.colours]
    elif profile.header.pcs == "XYZ ":
        numbers = [np.array([c.pcs]) / 32768 for c in table.colours]
    else:
        # The 16-bit encoding of version 2, in all versions.
        numbers = [np.array([c.pcs]) * [100 / 65280, 1 / 256, 1 / 256] - [0, 128, 128] for c in table.colours]
    return tuple(Ramp(name, full, row) for name, row in zip(named_colours(profile), numbers, strict=True))
