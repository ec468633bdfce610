"""Images beyond one machine: a transform on the blocks of a TIFF, spread by dask (extra `cluster`).

Every worker opens the image and the result itself, so both lie where all of them see the files under the
same path: pixels go from file to file, and neither to the scheduler nor to the client.  The result is laid
out first, the workers put their blocks in their places, and it appears under its name when all are there.

The image is a dask array by way of our own reader: tifffile's zarr store holds an open file and does not
pickle, and takes a file in one strip for one chunk.
"""

from __future__ import annotations

import importlib
import logging
import pickle
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from iccbrdf.cmm import Transform
from iccbrdf.errors import InputError, LimitError, UnsupportedError, UsageError
from iccbrdf.files import StrPath
from iccbrdf.images import Block, ImageSource, Place, TiffSink, create_tiff, processors
from iccbrdf.images.blocks import Array
from iccbrdf.images.checks import NonFinite, admitted, check_scale, not_finite, steeper
from iccbrdf.images.tiff_writer import SampleType

LOCAL = "local"
"""The cluster that is started on this machine, `local:N` with N worker processes."""

_SECONDS_TO_CONNECT = 10


class Met(NamedTuple):
    """What was met in all blocks together."""

    not_finite_in: int
    """Samples of the image that are not finite numbers."""
    not_finite_out: int
    """The same of the result."""
    beyond_slopes: int
    """Pixels steeper than the last measured slope."""
    clipped: int
    """Samples of the result that did not fit its integers."""


def apply(
    transform: Transform,
    source: ImageSource,
    target: StrPath,
    *,
    cluster: str = LOCAL,
    dtype: SampleType = "float32",
    tile: tuple[int, int] | None = None,
    profile: bytes | None = None,
    last_slope: float | None = None,
    overwrite: bool = False,
    nonfinite: NonFinite = "keep",
) -> Met:
    """Map an image through a transform on a cluster; the file is that of one process, byte for byte.

    Parameters
    ----------
    source
        The image, as `open_tiff` gives it.
    target
        A TIFF, uncompressed; BigTIFF where it needs to be.
    cluster
        The address of a dask scheduler, such as "tcp://10.0.0.5:8786"; or "local" or "local:N" for worker
        processes on this machine, as many as processors or N.  Each thread of a worker holds one block.
    dtype, tile, profile, overwrite
        As `create_tiff`.
    last_slope
        The steepest slope in degrees that the transform has measurements for, if it adjusts to slopes.
    nonfinite
        What becomes of pixels of the image that are not finite.

    Raises
    ------
    UnsupportedError
        dask is not installed.
    LimitError
        Workers die, or the disk is full.
    UsageError
        No such cluster; or as `create_tiff`.
    InputError
        The scheduler cannot be reached; or a worker cannot read the image.

    Examples
    --------
    >>> with open_tiff("brdf.tif") as source:                 # doctest: +SKIP
    ...     apply(transform, source, "xyz.tif", cluster="tcp://10.0.0.5:8786")
    """
    array = _package("dask.array")
    # Decided here, so that a machine on which another back end is the best one does not use that.
    transform = replace(transform, wanted=transform.backend, threads=1)
    with create_tiff(
        target,
        source.height,
        source.width,
        transform.channels_out,
        samples=transform.samples_out,
        dtype=dtype,
        tile=tile,
        profile=profile,
        overwrite=overwrite,
    ) as sink:
        work = _Work(transform, source.samples, last_slope, sink, nonfinite)
        pixels = array.from_array(
            _Pixels(source), chunks=_chunks(source), name=False, meta=np.empty((0, 0, 0), np.float32)
        )
        rows, columns, _ = pixels.numblocks
        met = pixels.map_blocks(
            work,
            chunks=((1,) * rows, (1,) * columns, (len(Met._fields),)),
            dtype=np.int64,
            meta=np.empty((0, 0, 0), np.int64),
        )
        total = Met(*_computed(met.sum(axis=(0, 1)), cluster).tolist())
        sink.put_elsewhere(source.height * source.width, total.clipped)
    return total


@dataclass(frozen=True)
class _Work:
    """What a worker does to a block: it goes through the transform into the file.  Gives `Met`."""

    transform: Transform
    samples: str
    last_slope: float | None
    sink: TiffSink
    nonfinite: NonFinite

    def __call__(self, data: Array, block_info: Any) -> Array:
        (y0, _), (x0, _), _ = block_info[0]["array-location"]
        block, not_finite_in = admitted(Block(y0, x0, data), self.nonfinite, "the image")
        check_scale(block, self.samples, self.transform.channels_in, "the image")
        data = block.data
        result = self.transform(data)
        encoded = self.sink.encode(Block(y0, x0, result))
        self.sink.put(encoded)
        met = Met(
            not_finite_in,
            not_finite(result),
            steeper(data, self.samples, self.transform.channels_in, self.last_slope),
            encoded.clipped,
        )
        return np.array([[met]], np.int64)


class _Pixels:
    """An image as dask wants to see an array.  A process that reads from it opens the file when it begins."""

    def __init__(self, source: ImageSource) -> None:
        # The image of another run may have the same path.
        self._run = secrets.token_hex(8)
        self._pickled = pickle.dumps(source)
        self.shape = source.height, source.width, source.channels
        self.ndim = len(self.shape)
        self.dtype = np.dtype(np.float32)

    def __getitem__(self, key: tuple[slice, slice, slice]) -> Array:
        rows, columns, _ = key
        place = Place(rows.start, columns.start, rows.stop - rows.start, columns.stop - columns.start)
        return _opened(self._run, self._pickled).read(place).data


@lru_cache(maxsize=2)
def _opened(run: str, pickled: bytes) -> ImageSource:
    source: ImageSource = pickle.loads(pickled)
    return source


def _chunks(source: ImageSource) -> tuple[tuple[int, ...], ...]:
    """The heights and widths of the blocks of an image, and its channels."""
    places = list(source.places())
    heights = tuple(place.height for place in places if place.x0 == 0)
    widths = tuple(place.width for place in places if place.y0 == 0)
    return heights, widths, (source.channels,)


def _computed(array: Any, cluster: str) -> Array:
    """A dask array, computed on a cluster."""
    killed = _package("distributed").KilledWorker
    with _connected(cluster) as client:
        try:
            result: Array = client.compute(array).result()
        except killed as error:
            raise LimitError(f"cluster {cluster}: workers died, likely of little memory: {error}") from error
    return result


@contextmanager
def _connected(cluster: str) -> Iterator[Any]:
    """A `distributed.Client`."""
    distributed = _package("distributed")
    kind, _, count = cluster.partition(":")
    if kind == LOCAL:
        if count and not (count.isdecimal() and int(count)):
            raise UsageError(f"cluster {cluster!r}: found {count!r}, expected a number of worker processes")
        with (
            distributed.LocalCluster(
                n_workers=int(count or processors()),
                threads_per_worker=1,
                dashboard_address=None,
                # Errors come out where the result is asked for.
                silence_logs=logging.CRITICAL,
            ) as started,
            distributed.Client(started) as client,
        ):
            yield client
        return
    try:
        client = distributed.Client(cluster, timeout=_SECONDS_TO_CONNECT)
    except ValueError as error:
        raise UsageError(f"cluster {cluster!r} is neither an address nor {LOCAL!r}: {error}") from None
    except OSError as error:
        raise InputError(f"cluster {cluster}: cannot be reached: {error}") from error
    with client:
        yield client


def _package(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise UnsupportedError("a cluster needs dask: pip install 'iccbrdf[cluster]'") from None
