"""What a folder of `iccbrdf proof` holds for a page: image, profiles, and the light that it was seen in."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from iccbrdf.errors import InputError
from iccbrdf.files import check_regular, read_whole
from iccbrdf.viewer.page import Start

LOG = "proof.json"
MAX_BYTES = 16 << 20
"""Of the log."""
_INTENSITY = "litI"
_SOURCES = {"flat.tif": ("colour-mid.icc", "mvis.icc"), "brdf.tif": ("mvis.icc",)}
"""Kept images that a page can be made of, the better one first, and the profiles that each goes through."""


@dataclass(frozen=True)
class ProofFolder:
    """What the log of a proof leads to.

    Attributes
    ----------
    image, profiles
        The files.
    title
        Name of the job's image.
    env
        Run-time variables of the first scene.
    start
        How it was lit and shown.
    """

    image: Path
    profiles: tuple[Path, ...]
    title: str
    env: Mapping[str, float]
    start: Start


def read_folder(folder: Path) -> ProofFolder:
    """Read the log of a proof.

    Raises InputError where there is none, or where the proof kept no image that a page can be made of;
    LimitError where the log is larger than MAX_BYTES.
    """
    try:
        check_regular(folder / LOG)
        log = json.loads(read_whole(folder / LOG, MAX_BYTES))
        job, scene = log["job"], log["scenes"][0]
        env = {str(name): _finite(value) for name, value in scene["env"].items()}
        start = Start(
            auto_lamp=job["reference-white"] == "flat",
            soft_highlights=job["highlights"] == "roll-off",
            exposure=_finite(job["exposure"]),
        )
        if start.exposure <= 0:
            raise ValueError(f"exposure is {start.exposure}, expected a number above 0")
        title = Path(log["inputs"]["image"]["path"]).stem
    except InputError as error:
        raise InputError(f"{error}; expected a folder of `iccbrdf proof`") from error
    except (ValueError, ArithmeticError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{folder / LOG}: is not the log of a proof: {error!r}") from error
    if start.auto_lamp:
        env.pop(_INTENSITY, None)
    for name, profiles in _SOURCES.items():
        if (folder / name).is_file():
            paths = tuple(folder / profile for profile in profiles)
            return ProofFolder(folder / name, paths, title, env, start)
    raise InputError(
        f"{folder}: has neither {' nor '.join(_SOURCES)}: make the proof with --keep flat, which keeps what "
        "a page is made of"
    )


def _finite(value: float) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"found {number}, expected a finite number")
    return number
