"""What several test files share."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

# Before NumPy is imported: each worker has one processor, and idle threads of BLAS would spin on it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from iccbrdf.cli import main
from iccbrdf.icc import Profile

ROOT = Path(__file__).resolve().parent.parent
SHARED = ROOT.parent / "shared"


def comparable(data: bytes) -> object:
    """A file; of a profile all that does not hang on the zlib at hand, which packs its source."""
    if data[36:40] != b"acsp":
        return data
    profile = Profile.from_bytes(data)
    header = replace(profile.header, size=0, profile_id=bytes(16))
    packed = {"bsrc": profile["bsrc"].text} if "bsrc" in profile else {}
    return header.to_bytes(), {tag: profile.tag_data(tag) for tag in profile} | packed


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real measurements beside the checkout; the test is skipped where there is none."""
    folder = SHARED / "data"
    if not folder.is_dir():
        pytest.skip(f"no real data: {folder} is missing")
    return folder


@dataclass(frozen=True)
class Result:
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The one JSON object on stdout, strictly read."""

        def refuse(text: str) -> None:
            raise ValueError(f"{text} is not JSON")

        return json.loads(self.out, parse_constant=refuse)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., Result]:
    """A function that runs `iccbrdf` with the arguments that it is given, within the test process."""

    def run(*arguments: object) -> Result:
        capsys.readouterr()
        with pytest.raises(SystemExit) as leaving:
            main([str(argument) for argument in arguments])
        return Result(leaving.value.code, *capsys.readouterr())

    return run
