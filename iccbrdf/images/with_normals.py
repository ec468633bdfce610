"""An image and the normals of its relief, which come from another file, as one image."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from iccbrdf.brdf.models import NORMAL
from iccbrdf.errors import InputError, UsageError
from iccbrdf.images.blocks import Array, Block, Place
from iccbrdf.images.record import Samples


class ImageSource(Protocol):
    """What can be read block by block; see `TiffSource`."""

    height: int
    width: int
    channels: int
    samples: Samples

    @property
    def names(self) -> Sequence[str] | None:
        """The channels' names, where they are known."""

    def places(self) -> Iterator[Place]:
        """Where the blocks of the image lie, in row order."""

    def read(self, place: Place) -> Block:
        """The block at a place; several threads may read at a time."""


class WithNormals:
    """`source` with three more channels, its normals, encoded as its other samples are.

    Parameters
    ----------
    source
        The image.
    names
        Names of its channels.
    normals
        Unit vectors, shape (height, width, 3).

    Raises
    ------
    UsageError
        The image has channels of these names itself.
    InputError
        The normals are of another size than the image.
    """

    def __init__(self, source: ImageSource, names: Sequence[str], normals: Array) -> None:
        twice = [name for name in NORMAL if name in names]
        if twice:
            raise UsageError(f"the image has a channel {twice[0]!r} itself; leave the relief's file out")
        if normals.shape != (source.height, source.width, 3):
            raise InputError(
                f"the relief has {normals.shape[1]} x {normals.shape[0]} pixels, "
                f"expected the image's {source.width} x {source.height}"
            )
        self._source = source
        self._normals = normals
        self.height, self.width = source.height, source.width
        self.channels = source.channels + len(NORMAL)
        self.samples = source.samples
        self.names: Sequence[str] | None = (*names, *NORMAL)

    def places(self) -> Iterator[Place]:
        """The places of the image."""
        return self._source.places()

    def read(self, place: Place) -> Block:
        """A block of the image, with the normals of its pixels."""
        block = self._source.read(place)
        y0, x0, height, width = place
        normals = self._normals[y0 : y0 + height, x0 : x0 + width]
        encoded = (normals + 1) / 2 if self.samples == "device" else normals
        return block._replace(data=np.concatenate([block.data, encoded], axis=2, dtype=np.float32))
