"""Threads that are kept: making some for each call takes as long as they then spare on a megapixel."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

T = TypeVar("T")
Piece = TypeVar("Piece")


def spread(work: Callable[[Piece], T], pieces: Iterable[Piece], threads: int) -> list[T]:
    """
    The results of `work` on all pieces, in no order, by this thread and `threads` - 1 others.

    Each takes the next piece when it is done with one.  After an exception of `work`, which comes out once
    all threads are done with theirs, no piece is begun.
    """
    pieces = tuple(pieces)
    # Iterators of tuples give each item once, whichever threads ask.
    waiting = iter(pieces)

    def share() -> list[T]:
        try:
            return [work(piece) for piece in waiting]
        except BaseException:
            deque(waiting, maxlen=0)
            raise

    others = [_pool(threads - 1).submit(share) for _ in range(min(threads, len(pieces)) - 1)]
    try:
        results = share()
    finally:
        # None is left running on memory of the caller's.
        errors = [other.exception() for other in others]
    for error in filter(None, errors):
        raise error
    return results + [result for other in others for result in other.result()]


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="iccbrdf")


if hasattr(os, "register_at_fork"):
    # Threads are not copied by a fork.
    os.register_at_fork(after_in_child=_pool.cache_clear)
