"""What a scene's reduced profiles spare, of the demo's print flat and in relief, matte and glossy.

`tools/bench.py` asks for these rows.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.build.recipe import Recipe
from iccbrdf.build.spans import Directions
from iccbrdf.demo import four_scenes
from iccbrdf.icc import Profile
from iccbrdf.images import Block, create_tiff, open_tiff
from iccbrdf.planning import Planning
from iccbrdf.resources import folder
from iccbrdf.scene import LIGHT, VIEW, environment

LIT = environment("45,180", "0,0", ())


@dataclass(frozen=True)
class Bench:
    """A scene's pixels, (height * width, channels), and the chains that prove it."""

    pixels: NDArray[np.float32]
    full: list[Profile]
    reduced: list[Profile]
    without: tuple[str, ...]
    planning: Mapping[str, float]
    """Seconds spent on reading the image, on decoding it to parameters, and on bounding."""


def scenes() -> Mapping[str, Bench]:
    """The four scenes under a lamp at 45 degrees, seen from above, each with its exact plan."""
    primaries = read_primaries(folder("profiles") / "landscape" / "primaries.json")
    light, view = (Directions.single([[LIT[name] for name in names]], ["here"]) for names in (LIGHT, VIEW))
    found = {}
    with tempfile.TemporaryDirectory() as place:
        for name, image in four_scenes(primaries).items():
            path = Path(place) / "image.tif"
            height, width, channels = image.device.shape
            with create_tiff(path, height, width, image.names, samples="device", overwrite=True) as sink:
                sink.write(Block(0, 0, image.device))
            with open_tiff(path) as source:
                planning = Planning(source, Recipe(primaries))
                plan = planning.plan(light, view)
                found[name] = Bench(
                    image.device.reshape(-1, channels),
                    plan.full.chain,
                    plan.reduced.chain,
                    plan.decision.without,
                    plan.seconds,
                )
    return found


def moved(pixels: NDArray[Any], copy: NDArray[Any], out: NDArray[Any]) -> None:
    """Copy the bytes that come in, and write as many as come out."""
    np.copyto(copy, pixels)
    out.fill(0.5)
