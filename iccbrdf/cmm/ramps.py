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
from iccbrdf.icc import (
    NamedColours,
    NumberArray,
    Profile,
    SparseMatrix,
    SparseMatrixArray,
    TagArray,
    TagStruct,
    Utf8,
)

NAMED = ("ncl2", "nmcl")
"""Tags that hold named colours."""

MAX_NUMBERS = 1 << 24
"""Of all the colours of a profile together."""

_ARRAYS = ("nmcl", "ncol")

Member = Literal["pcs ", "spec"]
_WHAT: Mapping[Member, str] = {"pcs ": "connection space colours", "spec": "spectra"}

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
    """The colours of a profile: their values in the connection space, of so many channels, or their spectra.

    Those of a namedColor2Type have no spectra.  Raises ProfileError where they are malformed or there are
    none, LimitError beyond `MAX_NUMBERS`.
    """
    place = f"{profile.source}: named colours"
    table = _table(profile)
    if isinstance(table, NamedColours):
        found = _plain_ramps(profile, table)
    else:
        found = _tinted_ramps(profile, table, member, channels, place)
    if not any(len(ramp.tints) for ramp in found):
        raise ProfileError(f"{place}: found no {_WHAT[member]} for any of them")
    return found


def _tinted_ramps(
    profile: Profile, table: TagArray, member: Member, channels: int, place: str
) -> tuple[Ramp, ...]:
    zero, colours = _structures(profile, table)
    if sum(channels + _size(each.get(member), channels) for each in (zero, *colours)) > MAX_NUMBERS:
        raise LimitError(f"{place}: more than {MAX_NUMBERS} numbers for their {_WHAT[member]}")
    shape = channels, profile.header.spectral_steps
    lightest = _rows(zero.get(member), shape, f"{place}: zero tint, {_WHAT[member]}")
    return tuple(_ramp(colour, member, shape, lightest, place) for colour in colours)


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


def _rows(value: Any, shape: tuple[int, int], place: str) -> Array:
    """Values of shape (n, channels), n = 0 where there are none.

    shape: the channels, and how many rows they are of a matrix, which comes row by row.
    """
    channels, steps = shape
    if value is None:
        return np.empty((0, channels))
    if isinstance(value, SparseMatrixArray):
        for matrix in value.matrices:
            if matrix.rows != steps or matrix.rows * matrix.columns != channels:
                raise ProfileError(
                    f"{place}: found a matrix of {matrix.rows} by {matrix.columns} numbers, "
                    f"expected {steps} rows, {channels} numbers"
                )
        return np.stack([np.zeros(channels), *map(_dense, value.matrices)])[1:]
    if not isinstance(value, NumberArray):
        raise ProfileError(f"{place}: found type {value.signature!r}, expected numbers")
    flat = value.normalised()
    if not flat.size or flat.size % channels:
        raise ProfileError(f"{place}: found {flat.size} numbers, expected a multiple of {channels}")
    return flat.reshape(-1, channels)


def _dense(matrix: SparseMatrix) -> Array:
    numbers = np.zeros((matrix.rows, matrix.columns))
    numbers[np.repeat(np.arange(matrix.rows), np.diff(matrix.starts)), matrix.indices] = matrix.values
    return numbers.reshape(-1)


def _ramp(colour: TagStruct, member: Member, shape: tuple[int, int], lightest: Array, table: str) -> Ramp:
    name = _name(colour)
    place = f"{table}: {name!r}"
    values = _rows(colour.get(member), shape, f"{place}, {_WHAT[member]}")
    if not len(values):
        return Ramp(name, np.zeros(0), values)
    told = colour.get("tint")
    if told is None:
        # In equal steps up to full strength.
        tints = np.arange(1, len(values) + 1) / len(values)
    elif isinstance(told, NumberArray):
        tints = told.normalised()
    else:
        raise ProfileError(f"{place}, tints: found type {told.signature!r}, expected numbers")
    if len(tints) != len(values):
        raise ProfileError(f"{place}: found {len(tints)} tints for {len(values)} {_WHAT[member]}")
    if not ((tints >= 0).all() and (tints <= 1).all() and (np.diff(tints) > 0).all()):
        raise ProfileError(f"{place}, tints: found {tints}, expected numbers that increase within 0..1")
    if tints[0] > 0 and len(lightest) == 1:
        tints, values = np.concatenate([[0.0], tints]), np.concatenate([lightest, values])
    return Ramp(name, tints, values)


def _plain_ramps(profile: Profile, table: NamedColours) -> tuple[Ramp, ...]:
    stored = np.array([colour.pcs for colour in table.colours], np.float64).reshape(-1, 1, 3)
    if profile.header.pcs == "XYZ ":
        values = stored / 32768
    else:
        # The 16-bit encoding of version 2, in all versions.
        values = stored * [100 / 65280, 1 / 256, 1 / 256] - [0, 128, 128]
    return tuple(
        Ramp(name, np.ones(1), row) for name, row in zip(named_colours(profile), values, strict=True)
    )
