"""What the tests of plans share: small scenes, in memory, and the profiles that go with them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from conftest import ROOT

from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.models import MODELS, NORMAL
from iccbrdf.brdf.primaries import Primaries, Primary, read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build.recipe import Recipe
from iccbrdf.build.spans import Directions
from iccbrdf.demo import four_scenes, landscape
from iccbrdf.images import Block, Place

LANDSCAPE = read_primaries(ROOT / "profiles" / "landscape" / "primaries.json")
PRINTER = ROOT / "profiles" / "fogra39_gloss"
PRINT = Recipe(read_primaries(PRINTER / "primaries.json"), read_slopes(PRINTER / "slopes.json"))
PAINTING = Recipe(read_primaries(ROOT / "profiles" / "ward_painting" / "primaries.json"))

CROP = (slice(300, 460, 10), slice(300, 460, 10))
"""Pixels apart, so that few of them differ in colour and slope."""


class ImageInMemory:
    """An array as `iccbrdf.images` has them from files."""

    def __init__(self, data, names, samples="device", rows=100):
        self.data, self.names, self.samples, self._rows = np.asarray(data, np.float32), names, samples, rows
        self.height, self.width, self.channels = self.data.shape

    def places(self):
        for y0 in range(0, self.height, self._rows):
            yield Place(y0, 0, min(self._rows, self.height - y0), self.width)

    def read(self, place):
        y0, x0, height, width = place
        return Block(y0, x0, self.data[y0 : y0 + height, x0 : x0 + width])


@cache
def scenes() -> dict[str, tuple[Recipe, ImageInMemory]]:
    """The four scenes of the demo's print, and the print as XYZ, each with what its profiles are made of."""
    recipe = Recipe(LANDSCAPE)
    found = {
        name: (recipe, ImageInMemory(image.device[CROP], image.names))
        for name, image in four_scenes(LANDSCAPE).items()
    }
    xyz = landscape(LANDSCAPE).xyz
    return {**found, "relief in XYZ": (PRINT, ImageInMemory(xyz.device[CROP], xyz.names))}


def painting(folder: Path) -> tuple[Recipe, ImageInMemory]:
    """The measured painting, if it is there."""
    from test_painting import CHANNELS, read_painting

    return PAINTING, ImageInMemory(read_painting(folder)[100:420:20, 200:520:20], CHANNELS, "real")


def recipe_of(model: str) -> Recipe:
    """A recipe of any model, whose device values are the parameters."""
    names = MODELS[model].channels
    primary = Primary("grey", (0.3, 0.3, 0.3), (0.3,) * len(names))
    return Recipe(
        Primaries(
            model,
            "D50",
            "CIE 1931 2 Degree Standard Observer",
            (0.9642, 1.0, 0.8249),
            "45:0",
            "an example",
            (primary,),
        )
    )


def names_of(model: str) -> tuple[str, ...]:
    """Channels of a BRDF image."""
    return (*MODELS[model].channels, *NORMAL)


def single(vector) -> Directions:
    return Directions.single([vector], ["here"])


def random_directions(count: int, seed: int, lowest: float = 89.0) -> np.ndarray:
    """Unit vectors (count, 3) whose zenith angles are uniform up to `lowest` degrees."""
    rng = np.random.default_rng(seed)
    return direction(rng.uniform(0, lowest, count), rng.uniform(0, 360, count))


def environment(light, view) -> dict[str, float]:
    return dict(zip(("litX", "litY", "litZ", "vueX", "vueY", "vueZ"), (*light, *view), strict=True))
