"""How single values are written: numbers that survive, signatures, hexadecimal digits, named choices."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from iccbrdf.errors import nearest
from iccbrdf.icc.header import Colour

Numbers: TypeAlias = npt.NDArray[Any]

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|inf(inity)?|nan)", re.IGNORECASE)
_INFINITY = "1e999"
"""A number that every reader takes for infinity; the ICC's tools take the letters `inf` for 0."""


class Odd(ValueError):
    """Text that is no value as it should be written, but that the ICC's tools take for `value`."""

    def __init__(self, message: str, value: Any) -> None:
        super().__init__(message)
        self.value = value


@dataclass(frozen=True)
class Codec:
    """A value as text: `read` raises ValueError with what was found and expected."""

    read: Callable[[str], Any]
    write: Callable[[Any], str]


# Numbers -----------------------------------------------------------------------------------------------


def decimal(value: Any) -> str:
    """One number as `decimals` writes it."""
    return decimals(np.asarray([value]))[0]


def decimals(values: Numbers) -> list[str]:
    """Each number of a flat array as text that gives it back in the array's precision; integers as such.

    Single precision takes seven digits where these give the number back, else nine, which always do.
    """
    if values.dtype.kind in "ui":
        return [str(v) for v in values.tolist()]
    if values.dtype.itemsize == 8:
        texts = [repr(v) for v in values.tolist()]
    else:
        values = values.astype(np.float32)
        texts = [f"{v:.7g}" for v in values.tolist()]
        with np.errstate(over="ignore"):
            back = np.array([float(t) for t in texts], np.float64).astype(np.float32)
        for index in np.flatnonzero(back != values):
            texts[index] = f"{values[index]:.9g}"
    for index in np.flatnonzero(~np.isfinite(values)):
        value = values[index]
        texts[index] = "nan" if np.isnan(value) else _INFINITY if value > 0 else f"-{_INFINITY}"
    return texts


def numbers(dtype: npt.DTypeLike) -> Codec:
    """Numbers between blanks or commas, read as unsigned integers of `dtype` or as float64."""
    kind = np.dtype(dtype)

    def read(text: str) -> Numbers:
        texts = text.replace(",", " ").split()
        odd = None
        for index, token in enumerate(texts):
            number = _NUMBER.match(token)
            if number is None or number[0] != token:
                odd = token if odd is None else odd
                if number is None:
                    raise ValueError(f"found {odd!r:.40}, expected a number")
                texts[index] = number[0]
        values: Numbers
        if kind.kind == "u":
            values = np.fromiter((_integer(t, kind) for t in texts), kind, len(texts))
        else:
            values = np.fromiter(map(float, texts), np.float64, len(texts))
        if odd is not None:
            raise Odd(f"found {odd!r:.40}, read as far as it is a number", values)
        return values

    return Codec(read, lambda values: " ".join(decimals(np.asarray(values))))


def _integer(token: str, kind: np.dtype[Any]) -> int:
    number = int(token) if token.isdecimal() and len(token) <= 20 else float(token)
    if not (number == number // 1 and 0 <= number < 256**kind.itemsize):
        raise ValueError(f"found {token:.40}, expected an integer from 0 to {256**kind.itemsize - 1}")
    return int(number)


def _float(text: str) -> float:
    text = text.strip()
    match = _NUMBER.match(text)
    if match is None:
        raise ValueError(f"found {text!r:.40}, expected a number")
    if match[0] != text:
        raise Odd(f"found {text!r:.40}, read as {match[0]}", float(match[0]))
    return float(text)


def unsigned(bits: int) -> Codec:
    """An integer of so many bits."""

    def read(text: str) -> int:
        if not re.fullmatch(r"\s*\d{1,20}\s*", text) or int(text) >= 1 << bits:
            raise ValueError(f"found {text!r:.40}, expected an integer from 0 to {(1 << bits) - 1}")
        return int(text)

    return Codec(read, str)


FLOAT32 = Codec(_float, lambda value: decimal(np.float32(value)))
FIXED16 = Codec(_float, lambda value: f"{value:.6f}".rstrip("0").rstrip("."))
"""In steps of 1/65536, which six decimals tell apart."""
U8, U16, U32 = unsigned(8), unsigned(16), unsigned(32)


# Signatures, bytes, choices ----------------------------------------------------------------------------


def signature_text(data: bytes) -> str:
    """Four bytes as characters, none for zeros, else as eight hexadecimal digits and `h`."""
    if not any(data):
        return ""
    plain = all(0x20 <= byte < 0x7F and byte != ord(":") for byte in data)
    return data.decode("ascii") if plain else data.hex().upper() + "h"


def signature_bytes(text: str) -> bytes:
    """The inverse; fewer than four characters are filled up with blanks, and `nc000a` has a count in it."""
    if len(text) <= 4 and text.isascii():
        return text.encode("ascii").ljust(4) if text else bytes(4)
    if re.fullmatch(r"[0-9A-Fa-f]{8}h?", text):
        return bytes.fromhex(text[:8])
    if re.fullmatch(r"[a-z]{2}[0-9A-Fa-f]{4}", text):
        return text[:2].encode("ascii") + bytes.fromhex(text[2:])
    raise ValueError(f"found {text!r:.40}, expected up to four characters, or eight hexadecimal digits and h")


def _read_signature(text: str) -> str:
    data = signature_bytes(text)
    return data.decode("latin-1") if any(data) else ""


SIGNATURE = Codec(_read_signature, lambda value: signature_text(value.encode("latin-1")))
"""Four characters, "" for zeros."""

_COLOUR = Colour()
COLOUR = Codec(
    lambda text: _COLOUR.decode(signature_bytes(text)),
    lambda value: value if len(value) == 6 else signature_text(_COLOUR.encode(value)),
)
"""A colour space of the header; one with a channel count as two letters and four hexadecimal digits."""


def parse_hex(text: str) -> bytes:
    """Bytes of hexadecimal digits, with blanks anywhere."""
    try:
        return bytes.fromhex("".join(text.split()))
    except ValueError:
        raise ValueError(f"found {text.strip()!r:.40}, expected pairs of hexadecimal digits") from None


def _hex_lines(data: bytes) -> str:
    return "\n".join(["", *(data[i : i + 32].hex() for i in range(0, len(data), 32)), ""])


HEX = Codec(parse_hex, lambda data: data.hex().upper())
"""Bytes on one line."""
HEX_LINES = Codec(parse_hex, _hex_lines)
"""Bytes, 32 a line."""
RESERVED = Codec(
    lambda text: U32.read(text).to_bytes(4, "big"), lambda data: str(int.from_bytes(data, "big"))
)
"""Four bytes as an integer."""


_OTHER = re.compile(r"(?:Unknown [A-Za-z ]+ '(?=-?\d))?((?<=')-\d{1,10}|\d{1,10})'?")


def choice(names: Mapping[int, tuple[str, ...]]) -> Codec:
    """A number that stands for one of several names, of which the first is written; others as digits.

    The ICC's tools write others as `Unknown Illuminant '99`, which is read as well.
    """
    values = {name: value for value, several in names.items() for name in several}

    def read(text: str) -> int:
        text = text.strip()
        other = _OTHER.fullmatch(text)
        if other is not None:
            return int(other[1]) % (1 << 32)
        if text not in values:
            raise ValueError(f"found {text!r:.60}: {nearest(text, values)}")
        return values[text]

    return Codec(read, lambda value: names[value][0] if value in names else str(value))
