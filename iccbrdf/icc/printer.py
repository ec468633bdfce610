"""The tag types that describe printers: response curves, and of version 2 what PostScript printers are told.

Sources: ICC.1:2010, 10.19 (responseCurveSet16Type); ICC.1:2001-04, 6.5.2, 6.5.6, 6.5.15 and 6.5.20.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.icc.fields import (
    S15,
    SIGNATURE,
    U16,
    U32,
    Bytes,
    Repeat,
    Text,
    frozen,
    tag_layout,
)
from iccbrdf.icc.layout import Field, FieldType, Layout, Record, Seen
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.rows import CountedText, Integers, Structures, members
from iccbrdf.icc.tags import TAGS


@TAGS.add("crdi")
@dataclass(frozen=True, eq=False)
class CrdInfo(Record):
    """crdInfoType: the PostScript product that colour rendering dictionaries are for, and their names.

    `dictionaries` are those of the four rendering intents, in their order.
    """

    product: str
    dictionaries: tuple[str, str, str, str]

    signature = "crdi"
    layout = tag_layout(
        signature,
        Field("product", CountedText("latin-1")),
        Field("dictionaries", Repeat(CountedText("latin-1"), 4)),
    )


@dataclass(frozen=True, eq=False)
class Screen(Record):
    """The screen of a channel.

    frequency : lines per unit of length; angle : degrees
    shape : of the dot; 0 not known, 1 the printer's, 2 round, 3 diamond, 4 ellipse, 5 line, 6 square, 7 cross
    """

    frequency: float
    angle: float
    shape: int = 0

    layout = Layout(Field("frequency", S15), Field("angle", S15), Field("shape", U32))


@TAGS.add("scrn")
@dataclass(frozen=True, eq=False)
class Screening(Record):
    """screeningType: the screen of each channel; `flags` 1: the printer's own ones, 2: lines per inch."""

    flags: int
    screens: tuple[Screen, ...]

    signature = "scrn"
    layout = tag_layout(
        signature,
        Field("flags", U32),
        Field("channels", U32, derived=lambda r: len(r.screens)),
        Field("screens", Structures(Screen, lambda seen: int(seen["channels"]))),
    )


@TAGS.add("bfd ")
@dataclass(frozen=True, eq=False)
class BlackGeneration(Record):
    """ucrbgType: the curves of under-colour removal and of black generation, and what the method is called.

    The curves are 16-bit numbers that span 0..1; one number alone is a percentage.
    """

    removal: npt.NDArray[np.uint16]
    generation: npt.NDArray[np.uint16]
    text: str

    signature = "bfd "
    layout = tag_layout(
        signature,
        Field("removal_count", U32, derived=lambda r: r.removal.size),
        Field("removal", Integers(">u2", lambda seen: (seen["removal_count"],))),
        Field("generation_count", U32, derived=lambda r: r.generation.size),
        Field("generation", Integers(">u2", lambda seen: (seen["generation_count"],))),
        Field("text", Text("latin-1", end=b"\0")),
    )

    def check(self) -> None:
        if self.removal.ndim != 1 or self.generation.ndim != 1:
            raise ValueError(
                f"found curves of shape {self.removal.shape} and {self.generation.shape}, expected numbers "
                "in a row"
            )


@dataclass(frozen=True, eq=False)
class Setting(Record):
    """A setting of a device: values of `size` bytes each, whose meaning the platform defines."""

    name: str
    size: int
    data: bytes

    layout = Layout(
        Field("name", SIGNATURE),
        Field("size", U32),
        Field("count", U32, derived=lambda r: len(r.data) // max(1, r.size)),
        Field("data", Bytes(lambda seen: int(seen["size"] * seen["count"]))),
    )

    def check(self) -> None:
        if len(self.data) % self.size if self.size else self.data:
            raise ValueError(f"data: found {len(self.data)} bytes, expected values of {self.size}")


@dataclass(frozen=True, eq=False)
class Combination(Record):
    """Settings that go together."""

    settings: tuple[Setting, ...]

    layout = Layout(
        Field("bytes", U32, derived=lambda r: 8 + _size(r.settings)),
        Field("count", U32, derived=lambda r: len(r.settings)),
        Field("settings", Structures(Setting, lambda seen: int(seen["count"]))),
    )


@dataclass(frozen=True, eq=False)
class PlatformSettings(Record):
    """The combinations of settings that the profile holds for, under one operating system."""

    platform: str
    combinations: tuple[Combination, ...]

    layout = Layout(
        Field("platform", SIGNATURE),
        Field("bytes", U32, derived=lambda r: 12 + _size(r.combinations)),
        Field("count", U32, derived=lambda r: len(r.combinations)),
        Field("combinations", Structures(Combination, lambda seen: int(seen["count"]))),
    )


def _size(records: Iterable[Record]) -> int:
    return sum(len(record.to_bytes()) for record in records)


@TAGS.add("devs")
@dataclass(frozen=True, eq=False)
class DeviceSettings(Record):
    """deviceSettingsType: the settings of a device that the profile holds for."""

    platforms: tuple[PlatformSettings, ...]

    signature = "devs"
    layout = tag_layout(
        signature,
        Field("count", U32, derived=lambda r: len(r.platforms)),
        Field("platforms", Structures(PlatformSettings, lambda seen: int(seen["count"]))),
    )


_RESPONSE = np.dtype([("code", ">u2"), ("reserved", ">u2"), ("value", ">i4")])


class _Responses(FieldType):
    """For each channel as many pairs as `counts` says."""

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[npt.NDArray[np.float64], ...]:
        return tuple(self._channel(reader, count) for count in seen["counts"])

    @staticmethod
    def _channel(reader: Reader, count: int) -> npt.NDArray[np.float64]:
        stored = np.frombuffer(reader.take(_RESPONSE.itemsize * count, "responses"), _RESPONSE)
        reader.count_numbers(16 * count)  # what is in memory on the way
        return np.stack([stored["code"].astype(np.float64), stored["value"] / 65536], axis=1)

    def write(self, out: bytearray, value: Sequence[npt.NDArray[np.float64]], record: Any) -> None:
        for rows in value:
            stored = np.zeros(len(rows), _RESPONSE)
            stored["code"] = rows[:, 0]
            stored["value"] = np.rint(rows[:, 1] * 65536)
            out += stored.tobytes()

    def normal(self, value: Any) -> tuple[npt.NDArray[np.float64], ...]:
        return tuple(self._rows(rows) for rows in value)

    @staticmethod
    def _rows(rows: Any) -> npt.NDArray[np.float64]:
        pairs = frozen(rows, np.float64)
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise ValueError(f"found shape {pairs.shape}, expected pairs of a device value and what it gives")
        with np.errstate(invalid="ignore"):
            frozen(pairs[:, 0], np.uint16)
            values = frozen(np.rint(pairs[:, 1] * 65536), np.int32) / 65536
        return frozen(np.stack([pairs[:, 0], values], axis=1), np.float64)


@dataclass(frozen=True, eq=False)
class ResponseCurve(Record):
    """What a density meter says of each channel.

    unit : status of the density: StaA, StaE, StaI, StaT, StaM, `DN  `, `DN P`, `DNN `, DNNP
    maxima : XYZ of each channel at its full amount
    responses : for each channel shape (count, 2): device values 0..65535 and densities, in steps of 1/65536
    """

    unit: str
    maxima: tuple[tuple[float, float, float], ...]
    responses: tuple[npt.NDArray[np.float64], ...]

    layout = Layout(
        Field("unit", SIGNATURE),
        Field(
            "counts",
            Repeat(U32, lambda seen: int(seen["channels"])),
            derived=lambda r: tuple(len(rows) for rows in r.responses),
        ),
        Field("maxima", Repeat(Repeat(S15, 3), lambda seen: int(seen["channels"]))),
        Field("responses", _Responses()),
    )

    def check(self) -> None:
        if len(self.maxima) != len(self.responses):
            raise ValueError(
                f"found {len(self.maxima)} maxima and {len(self.responses)} responses, expected as many"
            )


class _Curves(FieldType):
    """Offsets from the start of the structure, and the curves that they point to."""

    def read(self, reader: Reader, name: str, seen: Seen) -> tuple[ResponseCurve, ...]:
        table = reader.take(4 * seen["count"], f"{seen['count']} offsets")
        offsets = [offset for (offset,) in struct.iter_unpack(">I", table)]
        sizes: dict[int, int] = {}
        end = reader.position
        for offset in sorted(set(offsets)):
            if offset < end:
                raise reader.error(
                    f"curve: found it at {offset} of this structure, expected {end} or later", at=offset
                )
            sizes[offset] = self._size(reader, offset, seen["channels"])
            end = offset + sizes[offset]
        return tuple(
            reader.parts(
                [(offset, sizes[offset]) for offset in offsets],
                lambda index: f"curve {index}",
                lambda part, _: ResponseCurve.read(part, seen),
            )
        )

    @staticmethod
    def _size(reader: Reader, offset: int, channels: int) -> int:
        """Of the curve at `offset`, which its counts tell."""
        counts = np.frombuffer(reader.peek(offset + 4, 4 * channels, "counts of a curve"), ">u4")
        return 4 + 16 * channels + _RESPONSE.itemsize * int(counts.sum(dtype=np.uint64))

    def write(self, out: bytearray, value: Sequence[ResponseCurve], record: Any) -> None:
        table = len(out)
        out += bytes(4 * len(value))
        placed: dict[int, int] = {}
        for index, curve in enumerate(value):
            if id(curve) not in placed:
                placed[id(curve)] = len(out)
                out += curve.to_bytes()
            struct.pack_into(">I", out, table + 4 * index, placed[id(curve)])

    def normal(self, value: Any) -> tuple[ResponseCurve, ...]:
        return members(value, ResponseCurve)


@TAGS.add("rcs2")
@dataclass(frozen=True, eq=False)
class ResponseCurves(Record):
    """responseCurveSet16Type: response curves of `channels` device channels, one for each kind of density."""

    channels: int
    curves: tuple[ResponseCurve, ...]

    signature = "rcs2"
    layout = tag_layout(
        signature,
        Field("channels", U16),
        Field("count", U16, derived=lambda r: len(r.curves)),
        Field("curves", _Curves()),
    )

    def check(self) -> None:
        for index, curve in enumerate(self.curves):
            if len(curve.responses) != self.channels:
                raise ValueError(
                    f"curve {index}: found {len(curve.responses)} channels, expected {self.channels}"
                )
