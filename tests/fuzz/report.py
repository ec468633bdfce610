"""The counts of a run as text for people."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from typing import Any

from fuzz.one import MAX_ADDRESSES
from fuzz.targets import TARGETS
from fuzz.watch import MAX_MEMORY, MAX_SECONDS

COLUMNS = {
    "inputs": "inputs",
    "taken": "taken",
    "seconds": "seconds",
    "worst_seconds": "worst s",
    "worst_memory_mib": "worst MiB",
}
"""Of a table's row, and what stands at their heads."""


def row(label: str, counts: Mapping[str, Any]) -> str:
    """A row of the table."""
    cells = [label, *(str(counts[column]) for column in COLUMNS), str(len(counts["findings"]))]
    return "| " + " | ".join(cells) + " |"


def markdown(results: Mapping[str, Mapping[str, Any]]) -> str:
    """The report of a run: `results` by target and engine, as in "xml (atheris)"."""
    totals = {
        column: (max if column.startswith("worst") else sum)(counts[column] for counts in results.values())
        for column in COLUMNS
    }
    found = {f"{label}: {key}": f for label, r in results.items() for key, f in r["findings"].items()}
    named = dict.fromkeys(label.partition(" ")[0] for label in results)
    text = [
        "# Fuzzing",
        "",
        f"{totals['inputs']:,} inputs in {totals['seconds'] / 60:.0f} minutes ({platform.machine()}, Python "
        f"{platform.python_version()}). The worst took {totals['worst_seconds']:.1f} s of processor, and "
        f"{totals['worst_memory_mib']} MiB more than any before it. Findings: {len(found) or 'none'}.",
        "",
        "An input is a finding if anything but the documented errors comes of it, if it takes more than "
        f"{MAX_SECONDS} seconds, or if the process grows by more than {MAX_MEMORY >> 20} MiB "
        f"(or beyond {MAX_ADDRESSES >> 30} GiB in all). Taken: what was not refused. Made by `make fuzz`; "
        "inputs by mutation are the same wherever it runs as long.",
        "",
        "| target | " + " | ".join(COLUMNS.values()) + " | findings |",
        "|---" * (len(COLUMNS) + 2) + "|",
        *(row(label, counts) for label, counts in results.items()),
        "",
        *(f"- `{key}`, {finding['times']} times: {finding['error']}" for key, finding in found.items()),
        *[""] * bool(found),
        "What is done with an input:",
        "",
        *(f"- **{name}**: {_summary(name)}" for name in named),
    ]
    return "\n".join(text) + "\n"


def _summary(name: str) -> str:
    line, *_ = (TARGETS[name].run.__doc__ or "").split("\n")
    return line
