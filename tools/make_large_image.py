"""Write a large BRDF image, the landscape of the demo tiled, to try out memory and speed.

python tools/make_large_image.py large.tif                  100 megapixels, 10 channels, float32: 4 GB
python tools/make_large_image.py small.tif --megapixels 4 --tile 256 --compression deflate
"""

from __future__ import annotations

import argparse
import math

import numpy as np

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.demo import landscape
from iccbrdf.images import Block, create_tiff
from iccbrdf.resources import folder

ROWS = 64
"""Rows that are made at a time."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("image")
    parser.add_argument("--megapixels", type=float, default=100)
    parser.add_argument("--tile", type=int, help="side of the tiles; strips without it")
    parser.add_argument("--compression", choices=("deflate", "zstd"))
    arguments = parser.parse_args()

    image = landscape(read_primaries(folder("profiles") / "landscape" / "primaries.json")).brdf
    image_height, image_width, _ = image.device.shape
    side = round(math.sqrt(arguments.megapixels * 1e6))
    columns = np.arange(side) % image_width
    with create_tiff(
        arguments.image,
        side,
        side,
        image.names,
        samples="device",
        tile=(arguments.tile, arguments.tile) if arguments.tile else None,
        compression=arguments.compression,
    ) as sink:
        for y0 in range(0, side, ROWS):
            rows = np.arange(y0, min(y0 + ROWS, side)) % image_height
            sink.write(Block(y0, 0, image.device[rows][:, columns]))


if __name__ == "__main__":
    main()
