"""Changes to bytes: single ones, telling numbers, words of the format, pieces moved, cut or repeated."""

from __future__ import annotations

import random
from collections.abc import Sequence

_NUMBERS = [
    0, 1, 2, 3, 4, 7, 8, 12, 16, 20, 32, 64, 127, 128, 255, 256, 1000, 0x7FFF, 0x8000, 0xFFFF, 0x10000,
    0x7FFFFFFF, 0x80000000, 0xFFFFFFF8, 0xFFFFFFFF, 0x3F800000, 0x7F800000, 0x7FC00000, 0xBF800000,
]  # fmt: skip
"""As 32-bit words: sizes about a limit, and 1, infinity, NaN and -1 as float32."""


def mutated(data: bytes, words: Sequence[bytes], draw: random.Random) -> bytes:
    """A copy of `data` with up to eight changes, most often few."""
    changed = bytearray(data)
    for _ in range(draw.choice((1, 1, 2, 2, 3, 5, 8))):
        draw.choice(_CHANGES)(changed, words, draw)
    return bytes(changed)


def _place(data: bytearray, draw: random.Random, size: int = 0) -> int:
    return draw.randrange(max(1, len(data) - size + 1))


def _byte(data: bytearray, words: Sequence[bytes], draw: random.Random) -> None:
    at = _place(data, draw, 1)
    data[at : at + 1] = bytes([draw.randrange(256)])


def _bit(data: bytearray, words: Sequence[bytes], draw: random.Random) -> None:
    if data:
        data[_place(data, draw, 1)] ^= 1 << draw.randrange(8)


def _number(data: bytearray, words: Sequence[bytes], draw: random.Random) -> None:
    size = draw.choice((2, 4, 4, 4))
    at = _place(data, draw, size)
    if draw.random() < 0.7:
        at -= at % size
    number = draw.choice(_NUMBERS) & (1 << 8 * size) - 1
    data[at : at + size] = number.to_bytes(size, draw.choice(("big", "big", "little")))


def _near(data: bytearray, words: Sequence[bytes], draw: random.Random) -> None:
    """A number that is there becomes a little larger or smaller."""
    size = draw.choice((1, 2, 4))
    at = _place(data, draw, size)
    number = int.from_bytes(data[at : at + size], "big") + draw.choice((-8, -4, -1, 1, 4, 8))
    data[at : at + size] = (number & (1 << 8 * size) - 1).to_bytes(size, "big")


def _word(data: bytearray, words: Sequence[bytes], draw: random.Random) -> None:
    if words:
        word = draw.choice(words)
        at = _place(data, draw, len(word))
        data[at : at + draw.choice((0, len(word)))] = word


def _move(data: bytearray, words: Sequence[bytes], draw: random.Random) -> None:
    size = draw.choice((1, 4, 8, 12, 40))
    source, at = _place(data, draw, size), _place(data, draw, size)
    data[at : at + draw.choice((0, size))] = data[source : source + size]


def _cut(data: bytearray, words: Sequence[bytes], draw: random.Random) -> None:
    at = _place(data, draw)
    del data[at : at + draw.choice((1, 4, 8, 100, len(data)))]


def _repeat(data: bytearray, words: Sequence[bytes], draw: random.Random) -> None:
    size = draw.choice((1, 4, 8, 12, 64))
    at = _place(data, draw, size)
    data[at:at] = data[at : at + size] * draw.choice((1, 2, 10, 100))


_CHANGES = (_byte, _bit, _number, _number, _near, _word, _word, _move, _cut, _repeat)
