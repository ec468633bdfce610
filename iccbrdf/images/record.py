"""What a TIFF of ours says about its samples: the record in its ImageDescription.

The record is one line of ASCII JSON:

    {"schema": "iccbrdf.image/1", "samples": "real", "channels": ["X", "Y", "Z"], "encoding": "u1.15"}

`samples` is "device" (0..1, the device space of a MID) or "real" (physical values as they are, such as
XYZ with Y = 1 for white or signed normals).  `encoding` is there for real values in 16-bit integers only:
"u1.15" is the ICC's encoding of XYZ, the value times 32768.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Literal, NamedTuple, cast

from iccbrdf.errors import InputError, UnsupportedError, nearest

Samples = Literal["device", "real"]
SAMPLES: tuple[Samples, ...] = ("device", "real")

SCHEMA = "iccbrdf.image/1"
U1_15 = "u1.15"
U1_15_ONE = 32768
"""The integer that stands for 1 in u1.15."""


class Record(NamedTuple):
    """What the samples mean, the channels' names, and how integers hold real values (None: they do not)."""

    samples: Samples
    channels: tuple[str, ...]
    encoding: str | None = None

    def to_description(self) -> str:
        """The ImageDescription that holds this record."""
        fields: dict[str, str | Sequence[str]] = {
            "schema": SCHEMA,
            "samples": self.samples,
            "channels": self.channels,
        }
        if self.encoding:
            fields["encoding"] = self.encoding
        return json.dumps(fields)


def from_description(description: str, path: object) -> Record | None:
    """The record in an ImageDescription, or None where it is somebody else's text.

    Raises
    ------
    InputError
        It is a record of ours, but damaged.
    UnsupportedError
        It is the record of another version.
    """
    try:
        fields = json.loads(description)
    except (ValueError, RecursionError):
        return None
    schema = fields.get("schema") if isinstance(fields, dict) else None
    if not isinstance(schema, str) or not schema.startswith("iccbrdf.image/"):
        return None
    if schema != SCHEMA:
        raise UnsupportedError(f"{path}: the ImageDescription follows schema {schema!r}, known is {SCHEMA!r}")
    samples, channels, encoding = (fields.get(key) for key in ("samples", "channels", "encoding"))
    if samples not in SAMPLES:
        hint = nearest(str(samples), SAMPLES)
        raise InputError(f"{path}: the ImageDescription says samples {samples!r}: {hint}")
    if not isinstance(channels, list) or not all(isinstance(name, str) for name in channels):
        raise InputError(f"{path}: the ImageDescription says channels {channels!r}, expected a list of names")
    if encoding not in (None, U1_15):
        raise InputError(f"{path}: the ImageDescription says encoding {encoding!r}, known is {U1_15!r}")
    return Record(cast(Samples, samples), tuple(channels), encoding)
