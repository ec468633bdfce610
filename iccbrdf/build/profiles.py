"""What the profiles that are built here have in common."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from iccbrdf.brdf.models import NORMAL
from iccbrdf.calc.decoding import Decoding
from iccbrdf.errors import UsageError
from iccbrdf.icc import Calculator, Matrix, Mluc, TagArray

COPYRIGHT = "No copyright, use freely"

Range = tuple[float, float]
"""What the device values 0 and 1 of a channel stand for."""

_NORMAL_RANGE = (-1.0, 1.0)
XYZ_RANGE = (0.0, 65535 / 32768)
"""u1.15: the largest 16-bit integer is almost 2."""


def text_tags(description: str, channels: Iterable[str]) -> dict[str, Any]:
    """Description, copyright and the names of the multiplex channels."""
    return {
        "desc": Mluc.of(description),
        "cprt": Mluc.of(COPYRIGHT),
        "mcta": TagArray.of_texts(channels),
    }


def ranges(channels: Sequence[str], encoding: Mapping[str, float]) -> list[Range]:
    """The range of each channel: `encoding` goes by family (`kd` of `kd.X`), normals -1..1, XYZ as u1.15."""
    known = {**dict.fromkeys(NORMAL, _NORMAL_RANGE), **dict.fromkeys("XYZ", XYZ_RANGE)}
    return [known.get(name, (0.0, encoding.get(name.partition(".")[0], 1.0))) for name in channels]


def decoding(channels: Sequence[str], limits: Sequence[Range], device: Sequence[str]) -> Matrix | Calculator:
    """Device values in 0..1 -> the real values of `channels`, which are among the `device` channels.

    A matrix where all device channels are taken.  A calculator where some go no further: a matrix would
    multiply them by 0, which takes time, and makes all of a pixel NaN where one of them is not finite.
    """
    low, high = np.array(limits, np.float32).T
    sources = [device.index(channel) for channel in channels]
    n, n_device = len(channels), len(device)
    if n < n_device:
        picked = Decoding(tuple(sources), tuple((high - low).tolist()), tuple(low.tolist()))
        return Calculator(inputs=n_device, outputs=n, program=picked.program())
    matrix = np.zeros((n, n_device), np.float32)
    matrix[np.arange(n), sources] = high - low
    return Matrix(inputs=n_device, matrix=matrix, offset=low)


def device_channels(device: Sequence[str] | None, needed: Sequence[str]) -> tuple[str, ...]:
    """The device channels of a MID that needs some of them: `device`, by default no others than `needed`.

    Raises UsageError where one that is needed is missing.
    """
    if device is None:
        return tuple(needed)
    missing = [name for name in needed if name not in device]
    if missing:
        raise UsageError(f"device channels {', '.join(device)}: {missing[0]!r} is missing, which is needed")
    return tuple(device)


def encoding(limits: Sequence[Range]) -> Matrix:
    """Real values -> device values in 0..1."""
    low, high = np.array(limits, np.float64).T
    return Matrix(inputs=len(limits), matrix=np.diag(1 / (high - low)), offset=-low / (high - low))
