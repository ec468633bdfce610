"""Checks of texts: descriptions, copyright, and every other text in a tag of its own."""

from __future__ import annotations

import re
from collections.abc import Iterator

from iccbrdf.icc import Mluc, PlainText, TextDescription, Utf8
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.subject import Subject

_LANGUAGE = re.compile(r"[a-z]{2}")
_COUNTRY = re.compile(r"[A-Z]{2}|\0\0")
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")


def check_texts(subject: Subject) -> Iterator[Finding]:
    """Texts in one language, and those in several."""
    for tag in subject.distinct:
        if isinstance(tag.value, Mluc):
            yield from _localised(tag.value, tag.place)
        elif isinstance(tag.value, (PlainText, TextDescription, Utf8)):
            for rule, message in _problems(tag.value.text):
                yield finding(rule, tag.place, message)
            if not isinstance(tag.value, Utf8) and not tag.value.text.isascii():
                yield finding("TXT-005", tag.place, "found bytes above 127, expected none")


def _localised(value: Mluc, place: Place) -> Iterator[Finding]:
    if not value.texts:
        yield finding("TXT-001", place, "found no text in any language")
    seen: set[tuple[str, str]] = set()
    # A long text may stand in thousands of records.
    problems = {text: tuple(_problems(text)) for text in {item.text for item in value.texts}}
    for index, item in enumerate(value.texts):
        here = place.inner(f"text {index}", place.offset)
        for rule, message in problems[item.text]:
            yield finding(rule, here, message)
        key = item.language, item.country
        if not _LANGUAGE.fullmatch(item.language) or not _COUNTRY.fullmatch(item.country):
            message = f"found {item.language!r}, {item.country!r}, expected such as 'en', 'GB'"
            yield finding("TXT-002", here, message)
        if key in seen:
            yield finding("TXT-004", here, f"found {item.language!r}, {item.country!r} a second time")
        seen.add(key)


def _problems(text: str) -> Iterator[tuple[str, str]]:
    """What is wrong with a text: the rule and the message."""
    if not text.strip("\0 \t\r\n"):
        yield "TXT-001", f"found {text[:20]!r}, expected a text"
    control = _CONTROL.search(text)
    if control is not None:
        yield "TXT-003", f"found {control[0]!r} after {control.start()} characters, expected text alone"
