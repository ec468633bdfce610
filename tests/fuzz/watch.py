"""What an input took, what came of it, and a limit on its time."""

from __future__ import annotations

import os
import resource
import signal
import time
import traceback
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from types import FrameType
from typing import Any

import iccbrdf
from fuzz.targets import Target, quietly

_PACKAGE = Path(iccbrdf.__file__).parent

MAX_SECONDS = 10
"""Processor time that an input may take."""
MAX_MEMORY = 3 << 29
"""Bytes by which an input may raise the most that the process has held (see SECURITY.md)."""


class TooSlow(BaseException):
    """Raised in the midst of whatever takes too long, which shall not catch it."""


@contextmanager
def time_limit(seconds: float):
    """Processor time for a block; TooSlow where it takes more."""

    def stop(signum: int, frame: FrameType | None) -> None:
        raise TooSlow(f"more than {seconds} seconds")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def _held() -> int:
    """The most bytes that the process has held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


@dataclass
class Watch:
    """Runs inputs of one target and keeps count.

    folder: where inputs that are findings go.  findings: by the place that they come from, each once.
    """

    name: str
    target: Target
    folder: Path
    tried: int = 0
    taken: int = 0
    worst_seconds: float = 0.0
    worst_memory: int = 0
    findings: dict[str, dict[str, Any]] = field(default_factory=dict)

    def run(self, data: bytes) -> None:
        """Run one input; what is wrong with it is written down."""
        held, begun = _held(), time.process_time()
        try:
            with time_limit(MAX_SECONDS):
                self.taken += quietly(self.target, data)
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException as error:
            self._found(data, error)
        seconds, memory = time.process_time() - begun, _held() - held
        self.tried += 1
        if memory > MAX_MEMORY:
            self._found(data, MemoryError(f"{memory >> 20} MiB"))
        self.worst_seconds = max(self.worst_seconds, seconds)
        self.worst_memory = max(self.worst_memory, memory if self.tried > 1 else 0)

    def _found(self, data: bytes, error: BaseException) -> None:
        frames = reversed(traceback.extract_tb(error.__traceback__))
        ours = (f for f in frames if f.filename.startswith(f"{_PACKAGE}{os.sep}"))
        place = next((f"{os.path.relpath(f.filename, _PACKAGE.parent)}:{f.lineno}" for f in ours), "?")
        key = f"{type(error).__name__} at {place}"
        if key in self.findings:
            self.findings[key]["times"] += 1
            return
        digest = sha256(data).hexdigest()[:12]
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / f"{self.name}-{digest}").write_bytes(data)
        self.findings[key] = {"error": repr(error)[:300], "input": f"{self.name}-{digest}", "times": 1}

    def counts(self) -> dict[str, Any]:
        """What goes into the report."""
        return {
            "inputs": self.tried,
            "taken": self.taken,
            "worst_seconds": round(self.worst_seconds, 2),
            "worst_memory_mib": self.worst_memory >> 20,
            "peak_memory_mib": _held() >> 20,
            "findings": self.findings,
        }
