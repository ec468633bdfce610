"""An image through a transform into files, block by block: what `apply` and `demo` share.

A worker takes a block from the file to the samples of the outputs; what must come in order, the writing, is
done by the one thread that gives out the blocks (`iccbrdf.images.in_order`).  So reading, computing and
writing overlap, and memory is that of some blocks, however large the image.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

from iccbrdf.brdf.models import NORMAL
from iccbrdf.cli.progress import progress
from iccbrdf.cmm import Tally, Transform, standard_XYZ
from iccbrdf.errors import InputError, UsageError, nearest
from iccbrdf.files import check_target
from iccbrdf.icc import Profile
from iccbrdf.images import ImageSource, Place, Samples, create_tiff, in_order, open_tiff
from iccbrdf.images.checks import NonFinite, admitted, check_scale, not_finite, steeper

TIFF_SUFFIXES = (".tif", ".tiff")
PNG_SUFFIX = ".png"
EXR_SUFFIX = ".exr"

_SUFFIXES = (*TIFF_SUFFIXES, PNG_SUFFIX, EXR_SUFFIX)

SAMPLES_AT_A_TIME = 1 << 26
"""Blocks that are read at a time hold no more samples, unless one alone does, as a compressed segment may."""

_COLORIMETRIC = (("X", "Y", "Z"), ("L*", "a*", "b*"))


@dataclass(frozen=True)
class Output:
    """A file to write, by its suffix: a TIFF or OpenEXR file of what the transform gives, a PNG softproof."""

    path: Path
    dtype: Literal["float32", "uint16"] = "float32"
    """Sample type of a TIFF: float32, or uint16 for XYZ in u1.15."""
    profile: bytes | None = None
    """Profile to embed in a TIFF."""
    compression: Literal["deflate", "zstd"] | None = None
    """Of a TIFF."""
    exposure: float = 1.0
    """Factor on the XYZ of a PNG."""
    depth: Literal[8, 16] = 8
    """Bits of a PNG's samples."""

    @property
    def is_png(self) -> bool:
        return self.path.suffix.lower() == PNG_SUFFIX

    @property
    def is_exr(self) -> bool:
        return self.path.suffix.lower() == EXR_SUFFIX


class _Worked(NamedTuple):
    """What a worker made of a block: the blocks that the sinks will put, and what it met."""

    pixels: int
    encoded: list[Any]
    not_finite_in: int
    not_finite_out: int
    beyond_slopes: int
    kinds: Tally


@dataclass
class Done:
    """What a run wrote and met."""

    outputs: list[dict[str, Any]] = field(default_factory=list)
    not_finite_in: int = 0
    """Samples of the image that are not finite numbers."""
    not_finite_out: int = 0
    """The same of the result."""
    beyond_slopes: int = 0
    """Pixels steeper than the last measured slope, which holds for them."""
    kinds: Tally = field(default_factory=Counter)
    """Pixels by the kind of tile that they ran in; nothing is counted on a cluster."""


def check_outputs(outputs: Sequence[Output], *, overwrite: bool) -> None:
    """Refuse, before any work, an output that could not be written."""
    seen = set()
    for output in outputs:
        suffix = output.path.suffix.lower()
        if suffix not in _SUFFIXES:
            raise UsageError(f"{output.path}: found suffix {suffix!r}, expected {', '.join(_SUFFIXES)}")
        target = check_target(output.path, overwrite=overwrite)
        if target in seen:
            raise UsageError(f"{output.path}: is to be written twice")
        seen.add(target)


def run(
    source: ImageSource,
    transform: Transform,
    last: Profile,
    outputs: Sequence[Output],
    *,
    overwrite: bool,
    label: str,
    last_slope: float | None = None,
    workers: int = 1,
    nonfinite: NonFinite = "keep",
) -> Done:
    """Stream `source` through `transform`, whose chain ends on profile `last`, into `outputs`.

    Parameters
    ----------
    last_slope
        The steepest slope in degrees that the chain has measurements for, if it adjusts to slopes.
    workers
        Blocks that are read and computed at a time; the result does not depend on it.
    nonfinite
        What becomes of pixels of the image that are not finite; counted in any case.

    Raises
    ------
    LimitError
        The image costs more than the transform allows.
    InputError
        The image cannot be read, is not finite and shall be, or holds XYZ on another scale.
    """
    to_display = None
    if any(output.is_png for output in outputs):
        if transform.channels_out not in _COLORIMETRIC:
            raise UsageError(
                f"a PNG needs profiles that end on XYZ or Lab, such as a MID and an MVIS; "
                f"{last.source} gives {', '.join(transform.channels_out)}"
            )
        to_display = standard_XYZ(last)
    done = Done()
    transform.check_cost(source.height * source.width)
    first = next(iter(source.places()))
    samples = first.height * first.width * source.channels
    workers = max(1, min(workers, SAMPLES_AT_A_TIME // samples))
    with ExitStack() as stack:
        sinks = [
            stack.enter_context(_open(output, source, transform, overwrite, workers)) for output in outputs
        ]
        advance = stack.enter_context(progress(label))

        def work(place: Place) -> _Worked:
            block, not_finite_in = admitted(source.read(place), nonfinite, label)
            check_scale(block, source.samples, transform.channels_in, label)
            data, kinds = transform.tallied(block.data)
            result = block._replace(data=data)
            display = block._replace(data=to_display(result.data)) if to_display else result
            encoded = [
                sink.encode(display if output.is_png else result)
                for output, sink in zip(outputs, sinks, strict=True)
            ]
            return _Worked(
                pixels=place.height * place.width,
                encoded=encoded,
                not_finite_in=not_finite_in,
                not_finite_out=not_finite(result.data),
                beyond_slopes=steeper(block.data, source.samples, transform.channels_in, last_slope),
                kinds=kinds,
            )

        def take(worked: _Worked) -> None:
            for sink, encoded in zip(sinks, worked.encoded, strict=True):
                sink.put(encoded)
            done.not_finite_in += worked.not_finite_in
            done.not_finite_out += worked.not_finite_out
            done.kinds += worked.kinds
            done.beyond_slopes += worked.beyond_slopes
            advance(worked.pixels, source.height * source.width)

        with in_order(workers, take) as submit:
            for place in source.places():
                submit(work, place)
    for output, sink in zip(outputs, sinks, strict=True):
        counts = ("above_white", "out_of_gamut") if output.is_png else ("clipped",)
        done.outputs.append({"path": str(output.path), **{name: getattr(sink, name) for name in counts}})
    return done


def run_on_cluster(
    source: ImageSource,
    transform: Transform,
    outputs: Sequence[Output],
    cluster: str,
    *,
    overwrite: bool,
    last_slope: float | None = None,
    nonfinite: NonFinite = "keep",
) -> Done:
    """As `run`, on the machines of a cluster (`iccbrdf.cluster`), into one TIFF."""
    from iccbrdf.cluster import apply

    if len(outputs) != 1 or outputs[0].is_png or outputs[0].is_exr:
        raise UsageError("a cluster writes one TIFF; make pictures and copies of it")
    transform.check_cost(source.height * source.width)
    (output,) = outputs
    if output.compression:
        raise UsageError("a cluster writes no compressed TIFF, as nobody knows before where a block belongs")
    met = apply(
        transform,
        source,
        output.path,
        cluster=cluster,
        dtype=output.dtype,
        profile=output.profile,
        last_slope=last_slope,
        overwrite=overwrite,
        nonfinite=nonfinite,
    )
    written = [{"path": str(output.path), "clipped": met.clipped}]
    return Done(written, met.not_finite_in, met.not_finite_out, met.beyond_slopes)


def _open(output: Output, source: ImageSource, transform: Transform, overwrite: bool, workers: int) -> Any:
    if output.is_png:
        # Imported late, as codecs and displays are not needed for a TIFF.
        from iccbrdf.images.display import create_png

        return create_png(
            output.path,
            source.height,
            source.width,
            depth=output.depth,
            exposure=output.exposure,
            overwrite=overwrite,
        )
    if output.is_exr:
        from iccbrdf.images.exr import create_exr

        return create_exr(
            output.path,
            source.height,
            source.width,
            transform.channels_out,
            samples=transform.samples_out,
            overwrite=overwrite,
        )
    return create_tiff(
        output.path,
        source.height,
        source.width,
        transform.channels_out,
        samples=transform.samples_out,
        dtype=output.dtype,
        profile=output.profile,
        compression=output.compression,
        overwrite=overwrite,
        workers=workers,
    )


def open_image(path: Path, samples: Samples | None) -> AbstractContextManager[ImageSource]:
    """An image to read: OpenEXR by its suffix, else TIFF."""
    if path.suffix.lower() == EXR_SUFFIX:
        from iccbrdf.images.exr import open_exr

        return open_exr(path, samples)
    return open_tiff(path, samples)


def arranged_channels(
    source: ImageSource, own: Sequence[str], declared: Sequence[str] | None
) -> Sequence[str] | None:
    """The names to link by: those declared, else those in the file; None where there are neither.

    `own` are the first profile's.

    Raises
    ------
    UsageError
        The number of names or channels does not fit; a declared name is unknown or comes twice.
    InputError
        A name in the file is none of the first profile.
    """
    if declared is None and source.names is None and source.channels != len(own):
        raise UsageError(
            f"the image has {source.channels} channels without names, the first profile {len(own)} "
            f"({', '.join(own)}); name the image's channels with --channels"
        )
    if declared is None:
        recorded = source.names or ()
        if not set(recorded) <= set(own):
            raise InputError(
                f"the image holds {', '.join(recorded)}, the first profile takes {', '.join(own)}"
            )
        return source.names
    if len(declared) != source.channels:
        raise UsageError(f"--channels names {len(declared)} channels, the image has {source.channels}")
    for name in declared:
        if name not in own:
            raise UsageError(f"--channels: {name!r} is not in the first profile: {nearest(name, own)}")
        if declared.count(name) > 1:
            raise UsageError(f"--channels: {name!r} comes twice")
    return declared


def check_decoded(first: Profile, source: ImageSource, names: Sequence[str]) -> None:
    """Refuse encoded normals where nothing decodes them, for the picture would be a wrong one.

    Parameters
    ----------
    first
        The first profile of the chain.
    names
        Of the image's channels.

    Raises
    ------
    UsageError
        The chain begins with the MVIS, and the image holds device values, normals among them.
    """
    if first.header.device_class == "mvis" and source.samples == "device" and not {*NORMAL}.isdisjoint(names):
        raise UsageError(
            f"the image holds device values, and {first.source} takes real ones: begin with the MID "
            "(-p MID -p MVIS), or say --samples real where a float image holds these"
        )
