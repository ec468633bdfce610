"""The measured painting that some tests and figures are of, where its maps are at hand."""

from __future__ import annotations

from pathlib import Path

import imagecodecs
import numpy as np
from numpy.typing import NDArray

from iccbrdf.images.normals import read_normal_map

CHANNELS = ("Rd.X", "Rd.Y", "Rd.Z", "ks", "m", "n.x", "n.y", "n.z")

# Linear sRGB to XYZ (D65), IEC 61966-2-1.
SRGB_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def read_painting(folder: Path) -> NDArray[np.float32]:
    """The painting's BRDF image in real values, (height, width, 8), without its invalid border."""
    kd, ks, gloss = (
        imagecodecs.imread(folder / f"{name}map_level2.png")[..., :3] / 255 for name in ("kd", "ks", "gl")
    )
    normals = read_normal_map(folder / "nomap_level2.png")
    # The formula of the painting's viewer: gloss 0 is rough (m = .6), gloss 1 smooth (m = .05).
    least, most = 1 - 0.6**0.25, 1 - 0.05**0.25
    m = (1 - gloss[..., :1] * (most - least) - least) ** 4
    image = np.concatenate([kd @ SRGB_TO_XYZ.T, ks.mean(axis=2, keepdims=True), m, normals], axis=2)
    return image[40:-40, 40:-40].astype(np.float32)
