"""A progress bar, where somebody looks at it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress(label: str) -> Iterator[Callable[[int, int], None]]:
    """A bar where stderr is a terminal; gives what is told how many pixels more are done, and of how many.

    Until that is told, the bar only says that something goes on.

    Parameters
    ----------
    label
        What stands before the bar, such as the name of a file.
    """
    if not sys.stderr.isatty():
        yield lambda pixels, total: None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(escape(label), total=None)
        yield lambda pixels, total: bar.update(task, total=total, advance=pixels)
