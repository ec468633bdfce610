"""Text tables, CSV, TSV, CGATS and that of Cornell University, as rows and columns of text.

References
----------
-   [CGATS17] ANSI CGATS.17-2009: Exchange format for colour and process control data using ASCII text.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from iccbrdf.brdf.geometry import Array
from iccbrdf.errors import InputError, LimitError
from iccbrdf.files import StrPath, read_whole
from iccbrdf.measure.declarations import SCHEMA, header_declarations

MAX_BYTES = 1 << 27
"""Of a table's text, which takes up to some 35 times its bytes in memory, fit included."""
MAX_COLUMNS = 1 << 16
MISSING = ("", "nan", "-", "n/a", "na")
"""What stands for a reading that is not there, in lower case."""

_HEADER = re.compile(rf'#\s*schema\s*=\s*"{SCHEMA}"')
_CGATS_TOKEN = re.compile(r'"(?:[^"]|"")*"|#.*|[^\s"#]+')


@dataclass(frozen=True)
class Table:
    """Columns of text by name, all of one length."""

    file: str
    columns: dict[str, list[str]]
    lines: list[int]
    """Line of the file, from 1, of each row."""
    header: dict[str, Any] = field(default_factory=dict)
    """Declarations that the file makes itself."""
    notes: tuple[str, ...] = ()

    def numbers(self, name: str) -> Array:
        """
        Return a column as numbers, NaN where nothing was measured.

        Raises
        ------
        InputError
            A field is neither a finite number nor one of `MISSING`.
        """
        texts = self.columns[name]
        values = np.empty(len(texts))
        for k, text in enumerate(texts):
            try:
                values[k] = float(text)
            except ValueError:
                if text.casefold() not in MISSING:
                    raise self._not_a_number(name, k) from None
                values[k] = np.nan
        if np.isinf(values).any():
            raise self._not_a_number(name, int(np.isinf(values).argmax()))
        return values

    def row(self, k: int) -> str:
        """Return the place of a row, for messages."""
        return f"{self.file}: line {self.lines[k]}"

    def _not_a_number(self, name: str, k: int) -> InputError:
        return InputError(f"{self.row(k)}: {name} is {self.columns[name][k]!r}, expected a finite number")


def read_text(path: StrPath) -> str:
    """
    Return the text of a file: UTF-8, with or without a mark, or Latin-1; lines end as they may.

    Raises
    ------
    InputError
        The file cannot be read or is not text.
    LimitError
        The file is larger than MAX_BYTES.
    """
    data = read_whole(path, MAX_BYTES)
    if b"\0" in data:
        raise InputError(f"{path}: is not a text file: it holds bytes of value 0")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_csv(path: StrPath, delimiter: str) -> Table:
    """
    Read a table whose first line names the columns; lines above it that begin with `#` are comments.

    Raises
    ------
    InputError
        No columns or rows, a name that stands twice, or a row of another length than the first line.
    LimitError
        A line of more than MAX_COLUMNS.
    """
    lines = read_text(path).split("\n")
    start = next((k for k, line in enumerate(lines) if line.strip() and not line.startswith("#")), len(lines))
    comments = [line for line in lines[:start] if line.startswith("#")]
    header = {}
    if comments and _HEADER.match(comments[0]):
        header = header_declarations("\n".join(line[1:].strip() for line in comments), path)
    if any(line.count(delimiter) >= MAX_COLUMNS for line in lines[start:]):
        raise LimitError(f"{path}: a line has more columns than the limit of {MAX_COLUMNS}")
    reader = csv.reader((f"{line}\n" for line in lines[start:]), delimiter=delimiter)
    rows, numbers, line = [], [], start
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                rows.append([" ".join(cell.split()) for cell in row])
                numbers.append(line + 1)
            line = start + reader.line_num
    except csv.Error as error:
        raise InputError(f"{path}: line {start + reader.line_num}: {error}, expected CSV") from error
    return _table(path, rows[0] if rows else [], rows[1:], numbers[1:], header)


def read_cgats(path: StrPath) -> Table:
    """
    Read the first table of a CGATS file [CGATS17], such as `.ti3`.

    Keywords, in quotes or not, are passed over; `#` outside quotes begins a comment wherever it stands.

    Raises
    ------
    InputError
        A section is missing, a row has another number of fields than the format, or the numbers of fields or
        sets are not those that the file states.
    """
    names: list[str] = []
    rows: list[list[str]] = []
    numbers: list[int] = []
    stated: dict[str, tuple[str, int]] = {}
    section, tables = "", 0
    for number, tokens in _cgats_lines(read_text(path)):
        first = tokens[0]
        if first in ("BEGIN_DATA_FORMAT", "BEGIN_DATA"):
            section = first
            tables += first == "BEGIN_DATA"
            tokens = tokens[1:]
        elif first in ("END_DATA_FORMAT", "END_DATA"):
            section = ""
        elif not section and len(tokens) > 1 and not tables:
            stated[first] = (tokens[1], number)
        if not section or not tokens or tables > 1:
            continue
        if section == "BEGIN_DATA_FORMAT":
            names += tokens if not tables else []
        else:
            rows.append(tokens)
            numbers.append(number)
    if section:
        raise InputError(f"{path}: {section} has no end: the file is cut off")
    if not tables:
        raise InputError(f"{path}: no BEGIN_DATA, expected a CGATS file")
    for key, count in (("NUMBER_OF_FIELDS", len(names)), ("NUMBER_OF_SETS", len(rows))):
        text, number = stated.get(key, (str(count), 0))
        if text != str(count):
            raise InputError(f"{path}: line {number}: {key} is {text}, found {count}")
    notes = () if tables == 1 else (f"{tables - 1} more tables of the file were left out",)
    return _table(path, names, rows, numbers, {}, notes)


def read_cornell(path: StrPath) -> Table:
    """
    Read a BRDF text file of the Cornell Program of Computer Graphics: one patch, named like the file.

    `#` begins a comment.  The number of wavelengths comes first, then the wavelengths in nm, then rows of
    theta_i, phi_i, theta_s, phi_s in radians and the BRDF in 1/sr at each wavelength.

    Raises
    ------
    InputError
        The file is cut off, or its number of wavelengths is none.
    """
    lines = read_text(path).split("\n")
    tokens, places = [], []
    for number, line in enumerate(lines, start=1):
        found = line.partition("#")[0].split()
        tokens += found
        places += [number] * len(found)
    # Python reads no integer of thousands of digits.
    is_count = bool(tokens) and tokens[0].isdecimal() and len(tokens[0]) < 10
    if not is_count or not 0 < int(tokens[0]) < len(tokens):
        raise InputError(
            f"{path}: begins with {tokens[0]!r}, expected the number of wavelengths"
            if tokens
            else f"{path}: holds no numbers, expected a BRDF text file"
        )
    count = int(tokens[0])
    names = ["theta_i", "phi_i", "theta_r", "phi", *tokens[1 : count + 1]]
    start, width = count + 1, len(names)
    if (len(tokens) - start) % width:
        raise InputError(
            f"{path}: the last row has {(len(tokens) - start) % width} numbers, "
            f"expected {width}: 4 angles and {count} wavelengths"
        )
    rows = [[Path(path).stem, *tokens[k : k + width]] for k in range(start, len(tokens), width)]
    header = {"angles": "radian", "view_angles": "azimuth", "quantity": "brdf"}
    return _table(path, ["patch", *names], rows, places[start::width], header)


def _cgats_lines(text: str) -> Iterator[tuple[int, list[str]]]:
    """Line numbers, from 1, and the tokens of lines that have some."""
    for number, line in enumerate(text.split("\n"), start=1):
        tokens = [token for token in _CGATS_TOKEN.findall(line) if not token.startswith("#")]
        if tokens:
            unquoted = (token[1:-1].replace('""', '"') if token[0] == '"' else token for token in tokens)
            yield number, list(unquoted)


def _table(
    path: StrPath,
    names: list[str],
    rows: list[list[str]],
    numbers: list[int],
    header: dict[str, Any],
    notes: tuple[str, ...] = (),
) -> Table:
    if not names or not rows:
        raise InputError(f"{path}: holds no {'rows' if names else 'columns'}, expected a table")
    if len(set(names)) < len(names):
        twice = next(name for name, count in Counter(names).items() if count > 1)
        raise InputError(f"{path}: the column {twice!r} stands twice, expected different names")
    for row, number in zip(rows, numbers, strict=True):
        if len(row) != len(names):
            raise InputError(f"{path}: line {number}: found {len(row)} fields, expected {len(names)}")
    columns = {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}
    return Table(str(path), columns, numbers, header, notes)
