"""Work on many threads whose results are taken in the order in which it was given out."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, Protocol, TypeVar

T = TypeVar("T")


def processors() -> int:
    """The processors that this process may use."""
    usable = getattr(os, "sched_getaffinity", None)
    return len(usable(0)) if usable else os.cpu_count() or 1


class Submit(Protocol):
    """Gives out the call `function(*arguments)`.  Waits while as many calls are under way as may be."""

    def __call__(self, function: Callable[..., Any], /, *arguments: Any) -> None: ...


@contextmanager
def in_order(workers: int, take: Callable[[T], None]) -> Iterator[Submit]:
    """`workers` threads that work ahead of one consumer: a context manager that gives `Submit`.

    The consumer is the thread that submits: `take` gets each result there, in the order of submission.  At
    most 2 * workers + 1 results wait or are being made at any time, so memory does not grow with the number
    of calls.  When the block ends, all results have been taken.

    An exception of a call comes out where its result would have been taken, so the first in order wins, as
    if there were one thread.  After it, and after one of `take`, of the block or a keyboard interrupt, what
    has not begun never begins, and what has is waited for: no thread of ours runs on.

    Examples
    --------
    >>> results = []
    >>> with in_order(2, results.append) as submit:
    ...     for number in range(5):
    ...         submit(pow, number, 2)
    >>> results
    [0, 1, 4, 9, 16]
    """
    waiting: deque[Future[T]] = deque()
    pool = ThreadPoolExecutor(workers)

    def submit(function: Callable[..., T], /, *arguments: Any) -> None:
        waiting.append(pool.submit(function, *arguments))
        if len(waiting) > 2 * workers:
            take(waiting.popleft().result())

    try:
        yield submit
        while waiting:
            take(waiting.popleft().result())
    finally:
        pool.shutdown(cancel_futures=True)
