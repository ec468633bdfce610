"""What a proof was made of and with: hashes, versions, and whether an earlier log says that it is done."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

import iccbrdf
from iccbrdf.errors import IccBrdfError, InputError
from iccbrdf.files import check_regular, read_whole
from iccbrdf.images.showing import DISPLAYS
from iccbrdf.proof.job import Job

SCHEMA = "iccbrdf.proof/1"
NAME = "proof.json"
MAX_BYTES = 16 << 20
"""Of a log: a thousand times those of common jobs."""
_SCENE = {"light", "view", "env", "picture", "clipped"}
"""What others read of a scene's entry."""

_PACKAGES = ("numpy", "scipy", "imagecodecs", "tifffile", "pillow", "OpenEXR", "llvmlite")


def hashed_inputs(job: Job) -> dict[str, dict[str, Any]]:
    """Path, size and SHA-256 of each file that a job reads, by setting.

    Raises InputError where one cannot be read.
    """
    paths = {
        "image": job.image,
        "primaries": job.primaries,
        "printer": job.printer,
        "slopes": job.slopes,
        "height": job.height,
        "normals": job.normals,
        "display": None if job.display in DISPLAYS else Path(job.display),
    }
    return {name: _hashed(path) for name, path in paths.items() if path is not None}


def settings(job: Job) -> dict[str, Any]:
    """The settings of a job as JSON has them."""
    return {
        name.replace("_", "-"): str(value) if isinstance(value, Path) else value
        for name, value in asdict(job).items()
    }


def signature(job: Job, inputs: Mapping[str, Mapping[str, Any]]) -> str:
    """A hash of all that the results depend on: settings, contents of the inputs, version of this package."""
    named = settings(job)
    for name in (*inputs, "output"):
        named.pop(name)
    contents = {name: entry["sha256"] for name, entry in inputs.items()}
    text = json.dumps([named, contents, iccbrdf.__version__], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def versions() -> dict[str, str]:
    """Versions of this package, of Python, and of the packages that take part where they are installed."""
    found = {"iccbrdf": iccbrdf.__version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def earlier(job: Job, expected: str) -> dict[str, Any] | None:
    """The log of an earlier run that did just this, and whose outputs are all there; else None."""
    try:
        log = json.loads(read_whole(job.output / NAME, MAX_BYTES))
        files = [(job.output / output["file"], output["bytes"]) for output in log["outputs"]]
        same = log["schema"] == SCHEMA and log["signature"] == expected
        same = same and all(path.stat().st_size == size for path, size in files)
        same = same and all({*scene} >= _SCENE and 0 <= scene["clipped"] <= 1 for scene in log["scenes"])
    # No log, another program's, or outputs that are gone.
    except (IccBrdfError, OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return {**log, "job": settings(job)} if same else None


def _hashed(path: Path) -> dict[str, Any]:
    digest = hashlib.sha256()
    check_regular(path)
    try:
        with path.open("rb") as file:
            while piece := file.read(1 << 20):
                digest.update(piece)
            return {"path": str(path), "bytes": file.tell(), "sha256": digest.hexdigest()}
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error


def as_json(entry: Mapping[str, Any]) -> str:
    """The text of a log."""
    return json.dumps(entry, indent=2) + "\n"
