"""Inputs up to a size; outputs that appear whole or not at all, and replace nothing unless asked."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

from iccbrdf.errors import InputError, LimitError, UsageError

StrPath = str | os.PathLike[str]

_NO_SPACE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


def read_whole(path: StrPath, most: int) -> bytes:
    """All bytes of a user's file, of which there may be `most`, whatever the file says of its size.

    Raises
    ------
    InputError
        The file is missing, a folder, or cannot be read.
    LimitError
        It is larger.
    UsageError
        `path` is no path.
    """
    try:
        # `open` alone would take an integer for an open file.
        with Path(path).open("rb") as file:
            data = file.read(most + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except (TypeError, ValueError) as error:
        raise UsageError(f"not the path of a file to read: {error}") from None
    if len(data) > most:
        raise LimitError(f"{path}: larger than the limit of {most} bytes")
    return data


def check_regular(path: Path) -> None:
    """InputError where there is something else than a regular file: pipes and devices never end."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: is not a regular file")


def check_target(path: StrPath, *, overwrite: bool = False) -> Path:
    """The real path of an output file, after the checks that can be made before any work is done.

    Links are followed, so that replacing a linked file leaves the link in place.

    Raises
    ------
    UsageError
        The file exists and `overwrite` is not set, its folder does not exist, or it is no regular file; or
        `path` is no path.
    """
    try:
        target = Path(os.path.realpath(path))
    except (TypeError, ValueError) as error:
        raise UsageError(f"not the path of a file to write: {error}") from None
    if not target.parent.is_dir():
        raise UsageError(f"{path}: cannot be written: the folder {target.parent} does not exist")
    if target.exists():
        if not target.is_file():
            raise UsageError(f"{path}: cannot be written: it is not a regular file")
        if not overwrite:
            raise UsageError(f"{path}: exists already; choose another name, or ask for overwriting (--force)")
    return target


@contextmanager
def atomic_output(path: StrPath, *, overwrite: bool = False) -> Iterator[Path]:
    """Give a temporary path to write to, which becomes `path` when the block ends without an exception.

    The temporary file is made (empty) in the folder of `path`, so that the final rename is one step of
    the file system.  After an exception, a keyboard interrupt included, it is deleted and `path` is as it
    was before.

    Raises
    ------
    UsageError
        As `check_target`, before the block runs; also when the folder cannot be written to, or when the file
        came into being meanwhile.
    LimitError
        The block ran out of disk space.

    Examples
    --------
    >>> with atomic_output("print.icc") as temporary:         # doctest: +SKIP
    ...     temporary.write_bytes(data)
    """
    target = check_target(path, overwrite=overwrite)
    temporary = target.with_name(f".{secrets.token_hex(8)}.part")
    # From the file's first moment on inside `try`, so that an interrupt cannot leave it behind.
    try:
        _make_empty(temporary, path)
        yield temporary
        check_target(path, overwrite=overwrite)
        temporary.replace(target)
    except OSError as error:
        if error.errno in _NO_SPACE:
            raise LimitError(f"{path}: cannot be written: {error.strerror}") from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


def _make_empty(temporary: Path, path: StrPath) -> None:
    try:
        # Mode "x" applies the user's umask, which tempfile.mkstemp would not.
        temporary.open("xb").close()
    except OSError as error:
        raise UsageError(f"{path}: cannot be written: {error.strerror}") from error


def write_together(files: Mapping[Path, bytes], *, overwrite: bool = False) -> None:
    """Write files that belong together: none appears before all of them are written in full.

    Raises as `atomic_output`.
    """
    with ExitStack() as stack:
        for path, data in files.items():
            stack.enter_context(atomic_output(path, overwrite=overwrite)).write_bytes(data)


def as_text(name: str) -> str:
    """The name of a file for documents: bytes in it that are no text become question marks."""
    return name.encode(errors="replace").decode()


def make_folder(path: StrPath) -> None:
    """Make a folder for outputs, and those above it, unless it is there; UsageError where that cannot be."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{path}: cannot be made: {error.strerror}") from error
