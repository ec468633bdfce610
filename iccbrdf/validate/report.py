"""The check of a whole file, and of a MID with its MVIS."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any, TypeAlias

from iccbrdf.validate.classic import check_classic
from iccbrdf.validate.conditions import check_conditions, check_media_white
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.header import check_header, check_profile_id
from iccbrdf.validate.multiplex import check_defaults, check_names
from iccbrdf.validate.pair import check_pair, is_pair
from iccbrdf.validate.programs import check_programs
from iccbrdf.validate.rules import SEVERITIES, Severity
from iccbrdf.validate.source import check_source
from iccbrdf.validate.subject import Subject, open_subject
from iccbrdf.validate.table import check_table
from iccbrdf.validate.tags import check_required, check_tags
from iccbrdf.validate.texts import check_texts
from iccbrdf.validate.transforms import check_channels, check_elements

Check: TypeAlias = Callable[[Subject], Iterable[Finding]]
"""A source of findings about one file."""

CHECKS: tuple[Check, ...] = (
    check_header,
    check_profile_id,
    check_table,
    check_tags,
    check_required,
    check_texts,
    check_classic,
    check_names,
    check_defaults,
    check_channels,
    check_elements,
    check_programs,
    check_source,
    check_conditions,
    check_media_white,
)
"""What is checked of every file."""

MAX_FINDINGS = 1000
"""A file made to break programs could have millions."""


@dataclass(frozen=True)
class Report:
    """What was found in one file, or in a MID with its MVIS; the gravest first, then by byte offset."""

    source: str
    findings: tuple[Finding, ...]

    def count(self, severity: Severity) -> int:
        return sum(found.rule.severity == severity for found in self.findings)

    @property
    def passed(self) -> bool:
        """Whether there is no error."""
        return not self.count("error")

    def to_dict(self) -> dict[str, Any]:
        return {
            "source": self.source,
            "passed": self.passed,
            **{f"{severity}s": self.count(severity) for severity in SEVERITIES},
            "findings": [found.to_dict() for found in self.findings],
        }

    def lines(self) -> Iterator[str]:
        """A line for each finding, and one that counts them."""
        for found in self.findings:
            yield _printable(f"{self.source}: {found.text}")
        counts = (f"{n} {s}{'s' if n != 1 else ''}" for s in SEVERITIES for n in [self.count(s)])
        yield _printable(f"{self.source}: {', '.join(counts)}")


def _printable(text: str) -> str:
    """`text` kept to its line, whatever a profile holds."""
    return text if text.isprintable() else text.encode("unicode_escape").decode("ascii")


def validate(data: bytes, source: str = "<bytes>", *, checks: Sequence[Check] = CHECKS) -> Report:
    """Check the profile `data`, which `source` names in messages.  Raises nothing, however odd `data` is."""
    subject = open_subject(data, source)
    return _report(source, chain(subject.findings, *(check(subject) for check in checks)))


def validate_pair(first: tuple[bytes, str], second: tuple[bytes, str]) -> Report | None:
    """Check whether two profiles, each its bytes and its source, fit.

    None where they are no MID with an MVIS, in either order.  Raises nothing.
    """
    one, other = open_subject(*first), open_subject(*second)
    mid, mvis = (one, other) if is_pair(one, other) else (other, one)
    if not is_pair(mid, mvis):
        return None
    return _report(f"{mid.source} + {mvis.source}", check_pair(mid, mvis))


def _report(source: str, findings: Iterable[Finding]) -> Report:
    found = list(islice(findings, MAX_FINDINGS + 1))
    if len(found) > MAX_FINDINGS:
        message = f"found more than {MAX_FINDINGS}; the rest is left out"
        found[-1] = finding("ALL-001", Place("profile"), message)
    rank = {severity: i for i, severity in enumerate(SEVERITIES)}
    found.sort(key=lambda one: (rank[one.rule.severity], one.place.offset or 0))
    return Report(source, tuple(found))
