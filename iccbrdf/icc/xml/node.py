"""XML elements as they are read and made: the place in every error, limits on everything, no entities."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from lxml import etree

from iccbrdf.errors import (
    IccBrdfError,
    InputError,
    LimitError,
    ProfileError,
    ProfileWarning,
    UnsupportedError,
    nearest,
)
from iccbrdf.files import check_regular
from iccbrdf.icc.source_tag import CalculatorSource
from iccbrdf.icc.xml.values import Codec, Odd

MAX_BYTES = 128 << 20
"""Of an XML file together with all files that it names, and of the XML that is written."""
MAX_MARKS = 1 << 21
"""Signs `<` and `=` in a file, of which each element and attribute has one: they take 250 bytes each."""
MAX_ATTRIBUTES = 256
"""Of an element."""
MAX_PROFILES = 1 << 10
"""Profiles inside others: each takes about as long as a document."""
MAX_WARNINGS = 20
MAX_TEXT = 10_000_000
"""Bytes in one piece of text: what libxml2 reads unless it is told to give up its limits."""

_ENCODING = re.compile(rb"""[^>]{0,200}encoding\s*=\s*["']([^"'>]*)""")
_PLAIN = re.compile(rb"utf-?8|utf-?16([bl]e)?|(us-)?ascii|iso-8859-\d+|(windows|cp)-?125\d", re.IGNORECASE)
"""Encodings in which each sign `<` is a byte: others hide from MAX_MARKS what they hold."""

_LIMIT_WORDS = ("huge", "excessive depth", "amplification", "entity reference loop", "resource limit")
"""How libxml2 says that a file is beyond its limits."""


class Document:
    """What holds for one document that is read, and for the files that it names.

    folder: nothing outside it is read; None: the document may name no file.  strict: refuse what else is
    ignored with a warning.
    """

    def __init__(self, folder: Path | None, *, strict: bool = False) -> None:
        self.folder = folder
        self.strict = strict
        self.main_words = 0
        """Words of main functions so far."""
        self.words = 0
        """Words that macros have stood for so far."""
        self.profiles = 0
        """Profiles inside profiles so far."""
        self._left = MAX_BYTES
        self._warnings = 0

    def warn(self, error: IccBrdfError) -> None:
        """Warn of something that hinders nothing, or raise it as an error."""
        if self.strict:
            raise error
        self._warnings += 1
        if self._warnings <= MAX_WARNINGS:
            more = "; further warnings are not shown" if self._warnings == MAX_WARNINGS else ""
            warnings.warn(f"{error}{more}", ProfileWarning, stacklevel=2)

    def read(self, path: Path) -> bytes:
        """All bytes of a file; InputError where it cannot be read, LimitError where it is too large."""
        try:
            with path.open("rb") as file:
                data = file.read(self._left + 1)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"{path}: cannot be read: {reason}") from error
        if len(data) > self._left:
            raise LimitError(f"{path}: an XML file and the files it names exceed {MAX_BYTES} bytes")
        self._left -= len(data)
        return data

    def named(self, node: Node, filename: str) -> tuple[Path, bytes]:
        """The path and bytes of a file that `node` names, relative to the folder."""
        if self.folder is None:
            raise node.error(f"found the file name {filename!r}, expected none without a folder to read from")
        folder = self.folder.resolve()
        try:
            path = (folder / filename).resolve()
            if not path.is_relative_to(folder):
                raise node.error(f"found the file name {filename!r:.200}, expected one inside {folder}")
            check_regular(path)
            return path, self.read(path)
        except InputError as error:
            raise node.error(str(error), kind=InputError) from None
        except (OSError, ValueError, RuntimeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise node.error(f"found the file name {filename!r:.200}: {reason}") from None


def parse(data: bytes, source: str, document: Document) -> Node:
    """The root element of a document.

    Raises InputError where it is no well-formed XML or in a rare encoding, ProfileError where it declares a
    document type, and LimitError where it is larger or deeper than libxml2 reads without being told to.
    """
    if len(data) > MAX_BYTES:
        raise LimitError(f"{source}: larger than the limit of {MAX_BYTES} bytes")
    if data.count(b"<") + data.count(b"=") > MAX_MARKS:
        raise LimitError(f"{source}: more elements and attributes than the limit of {MAX_MARKS}")
    encoding = _ENCODING.match(data)
    if encoding is not None and not _PLAIN.fullmatch(encoding[1]):
        found = encoding[1].decode("ascii", "replace")
        raise InputError(f"{source}:1: found the encoding {found!r}; expected an XML file in UTF-8 or UTF-16")
    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        message = f"{source}:{error.lineno or 1}: {error.msg}"
        if any(word in message.lower() for word in _LIMIT_WORDS):
            raise LimitError(message) from None
        raise InputError(f"{message}; expected an XML file") from None
    except (ValueError, LookupError) as error:
        raise InputError(f"{source}: {error}; expected an XML file") from None
    if root.getroottree().docinfo.doctype:
        raise ProfileError(f"{source}: found a document type declaration (DOCTYPE), expected none")
    return Node(root, source, document)


class Node:
    """An element that is read."""

    def __init__(
        self, element: Any, source: str, document: Document, *, records: int = 0, hidden: tuple[str, ...] = ()
    ) -> None:
        self.source = source
        self.document = document
        self.records = records
        """How many records this one stands in."""
        self._element = element
        self._hidden = hidden

    @property
    def name(self) -> str:
        return str(self._element.tag)

    @property
    def line(self) -> int:
        return int(self._element.sourceline or 1)

    @property
    def attributes(self) -> Mapping[str, str]:
        # libxml2 looks for each of them among all.
        if len(self._element.attrib) > MAX_ATTRIBUTES:
            raise self.error(f"more than {MAX_ATTRIBUTES} attributes", kind=LimitError)
        return dict(self._element.attrib)

    @property
    def text(self) -> str:
        """All text directly in the element."""
        return "".join([self._element.text or "", *(child.tail or "" for child in self._element)])

    def __iter__(self) -> Iterator[Node]:
        """The elements in it."""
        for child in self._element:
            if child.tag not in self._hidden:
                yield Node(child, self.source, self.document, records=self.records)

    def hiding(self, *names: str) -> Node:
        """The same element without the elements of these names in it."""
        return Node(self._element, self.source, self.document, records=self.records, hidden=names)

    def error(
        self, message: str, *, line: int | None = None, kind: type[IccBrdfError] = ProfileError
    ) -> IccBrdfError:
        """The error about what stands here."""
        return kind(f"{self.source}:{self.line if line is None else line}: <{self.name}>: {message}")

    def warn(self, message: str) -> None:
        """Warn about what stands here."""
        self.document.warn(self.error(message))

    def value(self, codec: Codec, text: str, what: str = "") -> Any:
        """What `text`, which stands here, says; `what` names it in messages."""
        label = f"{what}: " if what else ""
        try:
            return codec.read(text)
        except Odd as odd:
            self.warn(f"{label}{odd}")
            return odd.value
        except ValueError as error:
            raise self.error(f"{label}{error}") from None

    def get(self, name: str) -> str:
        """An attribute that must be there."""
        if name not in self.attributes:
            hint = nearest(name, self.attributes)
            raise self.error(f"no attribute {name!r} among those found: {hint}")
        return self.attributes[name]

    def child(self, *names: str) -> Node | None:
        """The one element in it of any of these names; None where there is none."""
        found = [child for child in self if child.name in names]
        if len(found) > 1:
            found[1].warn(f"a second one in <{self.name}> is ignored")
        return found[0] if found else None

    def required(self, name: str) -> Node:
        """The one element in it of this name, which must be there."""
        child = self.child(name)
        if child is None:
            raise self.error(f"no <{name}> found in it, expected one")
        return child

    def expect(self, attributes: tuple[str, ...], children: tuple[str, ...] | None) -> None:
        """Warn of attributes and, unless None, elements of other names than these, as they are ignored."""
        for name in self.attributes:
            if name not in attributes:
                self.warn(f"attribute {name!r} is ignored: {nearest(name, attributes)}")
        if children is not None:
            for child in self:
                if child.name not in children:
                    child.warn(f"ignored in <{self.name}>: {nearest(child.name, children)}")


class Job:
    """What the elements of one document that is made have in common.

    names: sources of calculators, by the `id` of their record.  profiles: those inside others, so far.
    """

    def __init__(self, source: str, names: Mapping[int, CalculatorSource] | None = None) -> None:
        self.source = source
        self.names = names or {}
        self.profiles = 0
        self._left = MAX_BYTES

    def spend(self, target: Target, characters: int) -> None:
        """Count what is written; LimitError where it gets too much (shared parts multiply)."""
        self._left -= characters
        if self._left < 0:
            raise target.error(f"the XML exceeds the limit of {MAX_BYTES} characters", LimitError)


class Target:
    """An element that is made."""

    def __init__(self, element: Any, job: Job) -> None:
        self.element = element
        self.job = job

    def error(self, message: str, kind: type[IccBrdfError] = UnsupportedError) -> IccBrdfError:
        """The error about what is to be written here."""
        path = [str(e.tag) for e in (*reversed(list(self.element.iterancestors())), self.element)]
        return kind(f"{self.job.source}: <{'> <'.join(path[2:] or path)}>: {message}")

    def child(self, name: str) -> Target:
        """A new element at the end of this one."""
        self.job.spend(self, 2 * len(name) + 5)
        return Target(etree.SubElement(self.element, name), self.job)

    def set(self, name: str, value: str) -> None:
        """Give it an attribute."""
        self.job.spend(self, len(name) + len(value) + 4)
        try:
            self.element.set(name, value)
        except ValueError:
            raise self.error(f"{name}: found {value!r}, a character that XML cannot hold") from None

    def comment(self, text: str) -> None:
        """Put a comment at its end; two hyphens, and what XML cannot hold, become other characters."""
        plain = "".join(c if c.isprintable() or c == "\n" else " " for c in text)
        plain = plain.replace("--", "\u2010\u2010")
        self.job.spend(self, len(plain) + 9)
        self.element.append(etree.Comment(f" {plain} "))

    def check_text(self, characters: int) -> None:
        """LimitError where its text would have more characters than XML readers take."""
        if characters > MAX_TEXT:
            raise self.error(f"{characters} characters, but XML readers take {MAX_TEXT} at most", LimitError)

    def write(self, text: str) -> None:
        """Give it its text."""
        self.check_text(len(text))
        self.job.spend(self, len(text))
        try:
            self.element.text = text
        except ValueError:
            raise self.error(f"found {text!r:.80}, a character that XML cannot hold") from None
