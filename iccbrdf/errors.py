"""Every error that leaves the public face.

A message names the file, the place in it, what was found, what was expected and, where a name was
misspelt, the nearest valid one.  The class says whose fault it is, and the command line turns it into
an exit code.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from itertools import islice


class IccBrdfError(Exception):
    """Base of all errors of this package."""

    exit_code = 5


class UsageError(IccBrdfError):
    """The call asks for something that does not exist or contradicts itself (exit code 2)."""

    exit_code = 2


class ProfileError(IccBrdfError):
    """A profile is malformed (exit code 3)."""

    exit_code = 3


class UnsupportedError(IccBrdfError):
    """The input is legal, but this version cannot do it (exit code 3)."""

    exit_code = 3


class InputError(IccBrdfError):
    """User data (an image, a table, a parameter file) is missing, unreadable or malformed (exit code 3)."""

    exit_code = 3


class LinkError(IccBrdfError):
    """The profiles do not fit together, or a name that the link needs is unknown (exit code 3)."""

    exit_code = 3


class VariableError(LinkError):
    """A run-time (CMM environment) variable is unknown or has no number for a value (exit code 2)."""

    exit_code = 2


class LimitError(IccBrdfError):
    """A resource limit refuses the input (exit code 4)."""

    exit_code = 4


class IccBrdfWarning(UserWarning):
    """Base of all warnings of this package."""


class InputWarning(IccBrdfWarning):
    """User data is odd in a way that does not hinder its use."""


class ProfileWarning(IccBrdfWarning):
    """A profile deviates from the specification in a way that does not hinder its use."""


_MOST_NAMES, _MOST_SHOWN, _LONGEST_NAME = 2000, 100, 200
"""Of what a message about a name looks at, and shows: files may have millions of names, and long ones."""


def nearest(name: str, valid: Iterable[str]) -> str:
    """The end of a message about an unknown name: the nearest valid one, or all of them when none is near.

    Of very many names the first ones only, and none that are very long.
    """
    first = list(islice(valid, _MOST_NAMES))
    names = [v for v in first if len(v) <= _LONGEST_NAME]
    # A misspelling by case alone scores badly with difflib, yet is the likeliest one.
    folded = {v.casefold(): v for v in names}
    close = difflib.get_close_matches(name[:_LONGEST_NAME].casefold(), folded, n=1, cutoff=0.5)
    if close:
        return f"did you mean {folded[close[0]]!r}?"
    if not first:
        return "there are none"
    more = len(first) > min(len(names), _MOST_SHOWN)
    shown = (n if n.isprintable() else repr(n) for n in names[:_MOST_SHOWN])
    return "valid are " + ", ".join([*shown, *["..."] * more])
