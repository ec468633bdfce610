"""The scene of `iccbrdf demo`: a relief print of a real landscape, as an image.

Heights: the digital elevation model of the Jacksboro fault, Tennessee, that comes with matplotlib.
Colours: elevation tints of FOGRA39 inks; gloss: two measured paints, matt in the valleys and a little
glossier on the ridges (profiles/landscape).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from iccbrdf.brdf.models import MODELS, NORMAL
from iccbrdf.brdf.primaries import Primaries
from iccbrdf.build.profiles import XYZ_RANGE
from iccbrdf.images.normals import height_to_normals

PRINT_WIDTH = 200.0
"""Width of the print, mm."""
PIXEL_PITCH = 0.2
"""Of the print, mm."""
EXAGGERATION = 1.5
"""Vertical scale over horizontal scale: at 1 the 840 m of relief would be 5.6 mm on a print of 30 km."""

_METRES_PER_DEGREE = 111_320.0


@dataclass(frozen=True)
class Image:
    """Device values in 0..1, (height, width, channels), and names of the channels."""

    device: npt.NDArray[np.float32]
    names: tuple[str, ...]


@dataclass(frozen=True)
class Scene:
    """A relief print: as a BRDF image, and as the XYZ of the flat print; both with normals."""

    brdf: Image
    xyz: Image


def landscape(primaries: Primaries) -> Scene:
    """The relief print whose tints, from the lowest to the highest ground, are those of `primaries`."""
    heights, pitch = _heights()
    normals = height_to_normals(heights * EXAGGERATION, pitch)
    level = (heights - heights.min()) / np.ptp(heights)
    steps = np.linspace(0, 1, len(primaries.primaries))

    def image(tints: npt.NDArray[np.float64], names: tuple[str, ...]) -> Image:
        columns = [np.interp(level, steps, column) for column in tints.T]
        device = np.stack([*columns, *np.moveaxis((normals + 1) / 2, -1, 0)], axis=-1).astype(np.float32)
        return Image(device, (*names, *NORMAL))

    return Scene(
        brdf=image(primaries.parameters / primaries.scales, MODELS[primaries.model].channels),
        xyz=image(primaries.XYZ / XYZ_RANGE[1], ("X", "Y", "Z")),
    )


def four_scenes(primaries: Primaries) -> dict[str, Image]:
    """The print as BRDF images: flat and in relief, matte and glossy, by name (`flat matte`, ...).

    Flat ones have their normals along z, matte ones a ks of 0.
    """
    brdf = landscape(primaries).brdf
    is_normal = np.isin(brdf.names, NORMAL)
    is_gloss = np.array([name.partition(".")[0] == "ks" for name in brdf.names])
    flat = np.where(is_normal, np.where(np.array(brdf.names) == "n.z", 1.0, 0.5), brdf.device)
    scenes = {"flat": flat.astype(np.float32), "relief": brdf.device}
    return {
        f"{shape} {surface}": Image(np.where(is_gloss, factor * device, device), brdf.names)
        for shape, device in scenes.items()
        for surface, factor in (("matte", np.float32(0)), ("glossy", np.float32(1)))
    }


def _heights() -> tuple[npt.NDArray[np.float64], float]:
    """Heights on the print's pixel grid, and the grid's pitch, both in mm of the unexaggerated print."""
    from matplotlib.cbook import get_sample_data
    from scipy.ndimage import zoom

    with np.load(get_sample_data("jacksboro_fault_dem.npz", asfileobj=False)) as dem:
        metres = dem["elevation"].astype(np.float64)
        # The file calls its northern edge ymin: row 0 is in the north.
        latitude = np.radians((dem["ymin"] + dem["ymax"]) / 2)
        cell_x = dem["dx"] * _METRES_PER_DEGREE * np.cos(latitude)
        cell_y = dem["dy"] * _METRES_PER_DEGREE
    ground_width = metres.shape[1] * cell_x
    pixel = ground_width * PIXEL_PITCH / PRINT_WIDTH
    smooth = zoom(metres, (cell_y / pixel, cell_x / pixel), order=3, mode="nearest", grid_mode=True)
    return smooth * PRINT_WIDTH / ground_width, PIXEL_PITCH
