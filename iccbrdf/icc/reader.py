"""Reading untrusted bytes: windows that nothing can look out of, and errors that name the place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from iccbrdf.errors import LimitError, ProfileError

MAX_DEPTH = 32
"""Structures inside structures (tag arrays, calculators) that a tag may nest."""
MAX_PARTS = 65_536
"""Elements, curves and members that one tag may hold; one that several positions share counts each time."""

MAX_OPERATIONS = 1 << 18
"""Of all calculator programs of one tag: each takes a hundred times its bytes when it is looked at."""

MAX_NUMBERS = 1 << 26
"""Of all tables and curves of one tag; each takes four bytes or eight, however small it is stored.

Four bytes of text or of raw data count as one.
"""

MAX_LIKE_ONE_TAG = 2
"""All tags of one profile together may hold so many times what a single one may."""


class Budget:
    """How many parts, operations and numbers have been used up so far: of one tag, and of its profile.

    A budget without `whole` is a profile's.
    """

    def __init__(self, whole: Budget | None = None) -> None:
        self.parts = 0
        self.operations = 0
        self.numbers = 0
        self._whole = whole

    @property
    def used(self) -> tuple[int, int, int]:
        """All of them."""
        return self.parts, self.operations, self.numbers

    def spend(self, kind: str, count: int, limit: int) -> str | None:
        """Add `count` of a kind; what is now beyond the limit of a tag or of a profile, if anything is."""
        spent = getattr(self, kind) + count
        setattr(self, kind, spent)
        if self._whole is None:
            return f"more {kind} in one profile than the limit of {limit}" if spent > limit else None
        if spent > limit:
            return f"more {kind} in one tag than the limit of {limit}"
        return self._whole.spend(kind, count, MAX_LIKE_ONE_TAG * limit)


class Reader:
    """A window on one structure of a file: reads forward and never beyond its end.

    Attributes
    ----------
    start : int
        Byte offset of the window in the file, which errors report.
    place : str
        Path to the structure, as `tag A2M0, element 0 (calc)`.
    position : int
        Bytes of the window read so far.
    """

    def __init__(
        self,
        data: bytes | memoryview,
        source: str,
        place: str,
        *,
        start: int = 0,
        depth: int = 0,
        budget: Budget | None = None,
    ) -> None:
        self._data = memoryview(data)
        self.source = source
        self.place = place
        self.start = start
        self.position = 0
        self._depth = depth
        self._budget = budget or Budget(Budget())

    def __len__(self) -> int:
        return len(self._data)

    @property
    def left(self) -> int:
        """Bytes between the position and the end of the window."""
        return len(self._data) - self.position

    @property
    def where(self) -> str:
        """File, place and byte offset, as they begin an error message."""
        return f"{self.source}: {self.place}: byte offset {self.start + self.position}"

    def error(self, message: str, *, at: int | None = None) -> ProfileError:
        """The error about what stands at window offset `at` (default: the position)."""
        offset = self.start + (self.position if at is None else at)
        return ProfileError(f"{self.source}: {self.place}: byte offset {offset}: {message}")

    def take(self, size: int, what: str) -> memoryview:
        """The next `size` bytes, which hold `what`; ProfileError where the window ends before."""
        if size > self.left:
            raise self.error(f"{what}: found {self.left} bytes, expected {size}")
        taken = self._data[self.position : self.position + size]
        self.position += size
        return taken

    def peek(self, offset: int, size: int, what: str) -> memoryview:
        """`size` bytes at window offset `offset`, without moving."""
        if offset + size > len(self):
            raise self.error(f"{what}: found {max(0, len(self) - offset)} bytes, expected {size}", at=offset)
        return self._data[offset : offset + size]

    def part(self, offset: int, size: int, name: str) -> Reader:
        """The window of a structure inside this one.

        Raises ProfileError where it does not lie inside, LimitError where it is nested too deep.
        """
        if offset + size > len(self):
            raise self.error(
                f"{name}: found bytes {offset} to {offset + size}, expected at most {len(self)}", at=offset
            )
        if self._depth == MAX_DEPTH:
            raise LimitError(
                f"{self.source}: {self.place}: byte offset {self.start + offset}: {name}: "
                f"nested deeper than the limit of {MAX_DEPTH}"
            )
        return Reader(
            self._data[offset : offset + size],
            self.source,
            f"{self.place}, {name}",
            start=self.start + offset,
            depth=self._depth + 1,
            budget=self._budget,
        )

    def parts(
        self,
        spans: Sequence[tuple[int, int]],
        label: Callable[[int], str],
        read: Callable[[Reader, int], Any],
    ) -> list[Any]:
        """The structures at `spans` (offset, size), each read by `read(window, index)`.

        `label(index)` names one in messages.  Equal spans give one shared object.  Other spans must not
        overlap one another nor what of this window has been read already, so that the work stays in
        proportion to the bytes.
        """
        # First, as a profile that is over its limits has many such tables.
        self.count_parts(len(spans))
        self._check_disjoint(spans, label)
        known: dict[tuple[int, int], tuple[Any, tuple[int, ...]]] = {}
        values = []
        for index, span in enumerate(spans):
            if span in known:
                value, weight = known[span]
                # Shared parts inside shared parts multiply: few bytes could stand for endless objects.
                for count, more in zip(self._counters, weight, strict=True):
                    count(more)
            else:
                before = self._budget.used
                value = read(self.part(*span, label(index)), index)
                weight = tuple(a - b for a, b in zip(self._budget.used, before, strict=True))
                known[span] = value, weight
            values.append(value)
        return values

    @property
    def _counters(self) -> tuple[Callable[[int], None], ...]:
        return self.count_parts, self.count_operations, self.count_numbers

    def count_parts(self, count: int) -> None:
        """Account for parts that become objects; LimitError where they are too many."""
        self._count("parts", count, MAX_PARTS)

    def count_operations(self, count: int) -> None:
        """Account for the operations of a program that is to be read; LimitError where they are too many."""
        self._count("operations", count, MAX_OPERATIONS)

    def count_numbers(self, count: int) -> None:
        """Account for numbers that are to be converted; LimitError where they are too many."""
        self._count("numbers", count, MAX_NUMBERS)

    def count_bytes(self, count: int) -> None:
        """Account for bytes that are kept as they are, or as text; LimitError where they are too many."""
        self.count_numbers(count // 4)

    def _count(self, kind: str, count: int, limit: int) -> None:
        if problem := self._budget.spend(kind, count, limit):
            raise LimitError(f"{self.where}: {problem}")

    def _check_disjoint(self, spans: Sequence[tuple[int, int]], label: Callable[[int], str]) -> None:
        first_index = {span: index for index, span in reversed(list(enumerate(spans)))}
        end = self.position
        for span in sorted(first_index):
            offset, size = span
            if offset < end:
                raise self.error(
                    f"{label(first_index[span])}: found it at {offset} of this structure, expected {end} or "
                    "later, or position and size the same as another's",
                    at=offset,
                )
            end = offset + size
