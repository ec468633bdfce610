"""The lights and views of a job: each pair of them is a scene, with the run-time variables that set it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from iccbrdf.errors import LimitError, UsageError
from iccbrdf.proof.job import Job
from iccbrdf.scene import LIGHT, environment, parse_direction, parse_number

INTENSITY = "litI"
MAX_FRAMES = 1000

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _.+-]*")
_LOWEST = 0.01
"""Cosine of the lowest light that a flat white may be referred to: the intensity is then a hundredfold."""


@dataclass(frozen=True)
class Scene:
    """A light and a view, each with its label, and the run-time variables that both set."""

    light: str
    view: str
    env: dict[str, float]


def scenes(job: Job, intensity: float) -> list[Scene]:
    """Every light from every view, light by light.

    `intensity` is the value of `litI` that the model has by default.  Raises UsageError where a direction is
    none, a name cannot be part of a file's name or comes twice, or a flat white is referred to under a light
    that does not shine on it.
    """
    lights, views = _named("--light", job.light), _named("--view", job.view)
    return [
        Scene(light, view, _env(job, light_from, view_from, intensity))
        for light, light_from in lights.items()
        for view, view_from in views.items()
    ]


def sweep(job: Job, intensity: float) -> list[Scene]:
    """The scenes of the animation, seen from the first view; none where the job has no sweep.

    A full turn leaves the last picture out, which would be the first again.  Raises UsageError as `scenes`,
    LimitError for more than `MAX_FRAMES` pictures.
    """
    if job.sweep is None:
        return []
    if job.frames > MAX_FRAMES:
        raise LimitError(f"--frames: {job.frames} pictures of the animation, the limit is {MAX_FRAMES}")
    ends = [_angles(end) for end in job.sweep.split(":")]
    if len(ends) != 2:
        raise UsageError(f"--sweep {job.sweep!r}: expected FROM:TO, such as 60,0:60,360")
    start, end = np.array(ends)
    is_turn = start[0] == end[0] and abs(end[1] - start[1]) == 360
    (view, view_from), *_ = _named("--view", job.view).items()
    found = []
    for zenith, azimuth in np.linspace(start, end, job.frames, endpoint=not is_turn).tolist():
        light = f"{zenith:g},{azimuth:g}"
        found.append(Scene(light, view, _env(job, light, view_from, intensity)))
    return found


def _env(job: Job, light: str, view: str, intensity: float) -> dict[str, float]:
    values = environment(light, view, ())
    if job.reference_white == "flat":
        cosine = values[LIGHT[2]]
        if cosine < _LOWEST:
            raise UsageError(
                f"--light {light!r}: hardly shines on a flat white (cosine {cosine:.3g}, expected at least "
                f"{_LOWEST}); refer to a white diffuser that faces the light"
            )
        values[INTENSITY] = intensity / cosine
    return values | environment(None, None, job.env)


def _named(option: str, texts: Sequence[str]) -> dict[str, str]:
    """Directions by their names, which are the directions themselves where none is given."""
    named: dict[str, str] = {}
    for text in texts:
        name, equals, direction = text.rpartition("=")
        parse_direction(option, direction)
        if equals and not _NAME.fullmatch(name):
            raise UsageError(f"{option} {text!r}: the name {name!r} cannot be part of a file's name")
        label = name or direction
        if label in named:
            raise UsageError(f"{option} {text!r}: {label!r} comes twice")
        named[label] = direction
    return named


def _angles(text: str) -> tuple[float, float]:
    parse_direction("--sweep", text)
    zenith, _, azimuth = text.partition(",")
    if "," in azimuth:
        raise UsageError(f"--sweep {text!r}: expected ZENITH,AZIMUTH in degrees, not a vector")
    return parse_number("--sweep", zenith), parse_number("--sweep", azimuth)
