"""A look at the header of an OpenEXR file before the package opens it, which texts that are none bring down.

Source: OpenEXR File Layout (Academy Software Foundation, 2013): magic number and version, then attributes,
each a name, a type, a size and a value, until an empty name.
"""

from __future__ import annotations

import struct
from typing import BinaryIO

from iccbrdf.errors import InputError, LimitError, UnsupportedError
from iccbrdf.files import StrPath

MAX_BYTES = 1 << 20
"""Of the header."""

_MAGIC = b"v/1\x01"
_LONGEST_NAME = 255
_DEEP, _PARTS = 1 << 11, 1 << 12
"""Flags in the version."""

_SIZES = {
    "box2f": 16, "box2i": 16, "chromaticities": 32, "compression": 1, "deepImageState": 1, "double": 8,
    "envmap": 1, "float": 4, "int": 4, "keycode": 28, "lineOrder": 1, "m33d": 72, "m33f": 36, "m44d": 128,
    "m44f": 64, "rational": 8, "tiledesc": 9, "timecode": 8, "v2d": 16, "v2f": 8, "v2i": 8, "v3d": 24,
    "v3f": 12, "v3i": 12,
}  # fmt: skip
"""Bytes of the types that have always the same; the package goes by them, whatever the file says."""


def check_header(path: StrPath) -> None:
    """Check that a file begins with one header of OpenEXR, whose attributes lie within it and whose texts
    are UTF-8.

    Raises
    ------
    InputError
        The file is missing, is no OpenEXR file or has a damaged header.
    UnsupportedError
        Deep pixels or several parts.
    LimitError
        The header is larger than MAX_BYTES.
    """
    try:
        with open(path, "rb") as file:
            _check(file, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error


def _check(file: BinaryIO, path: StrPath) -> None:
    start = file.read(8)
    if len(start) < 8 or not start.startswith(_MAGIC):
        raise InputError(
            f"{path}: cannot be read as OpenEXR: found {start!r}, expected {_MAGIC!r} and a version"
        )
    (version,) = struct.unpack("<4xI", start)
    if version & (_DEEP | _PARTS):
        raise UnsupportedError(f"{path}: deep pixels or several parts, expected one flat image")
    data = file.read(MAX_BYTES)
    position = 0
    while not data.startswith(b"\0", position):
        names = data[position : position + 2 * _LONGEST_NAME + 2].split(b"\0", 2)[:2]
        end = position + sum(map(len, names)) + 2 + 4
        if end > len(data) or len(names) < 2:
            raise _damaged(path, position, data)
        (size,) = struct.unpack_from("<I", data, end - 4)
        value = data[end : end + size]
        if len(value) < size:
            raise _damaged(path, position, data)
        place = f"{path}: byte offset {8 + position}: attribute {names[0]!r}"
        try:
            kind = names[1].decode("utf-8")
            texts = _texts(kind, value)
            for text in (names[0], *texts):
                text.decode("utf-8")
        except UnicodeDecodeError as error:
            raise InputError(
                f"{place}: found {error.object[:40]!r}, expected UTF-8: {error.reason}"
            ) from None
        except (ValueError, struct.error):
            raise InputError(f"{place}: found {size} bytes, expected what {kind} is made of") from None
        position = end + size


def _texts(kind: str, value: bytes) -> list[bytes]:
    """The texts in the value of an attribute; ValueError or struct.error where it has not its type's size."""
    texts, end = [], _SIZES.get(kind, len(value))
    if kind == "string":
        texts = [value]
    elif kind == "chlist":
        end = 0
        # A name, and 16 bytes that say what the channel holds.
        while not value.startswith(b"\0", end):
            texts.append(value[end : value.index(b"\0", end)])
            end += len(texts[-1]) + 1 + 16
        end += 1
    elif kind == "stringvector":
        end = 0
        while end < len(value):
            (size,) = struct.unpack_from("<I", value, end)
            texts.append(value[end + 4 : end + 4 + size])
            end += 4 + size
    elif kind == "preview":
        width, height = struct.unpack_from("<II", value)
        end = 8 + 4 * width * height
    if end != len(value):
        raise ValueError
    return texts


def _damaged(path: StrPath, position: int, data: bytes) -> InputError | LimitError:
    if len(data) == MAX_BYTES:
        return LimitError(f"{path}: the header is larger than the limit of {MAX_BYTES} bytes")
    return InputError(
        f"{path}: byte offset {8 + position}: the header is cut off, expected an attribute's name, type, "
        "size and value"
    )
