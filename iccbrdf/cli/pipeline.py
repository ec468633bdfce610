"""An image through a transform into files, block by block: what `apply` and `demo` share."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from iccbrdf.cmm import Transform, standard_XYZ
from iccbrdf.errors import LinkError, UsageError, nearest
from iccbrdf.files import check_target
from iccbrdf.icc import Profile
from iccbrdf.images import Block, TiffSource, create_tiff
from iccbrdf.images.display import create_png

TIFF_SUFFIXES = (".tif", ".tiff")
PNG_SUFFIX = ".png"


@dataclass(frozen=True)
class Output:
    """A file to write: a TIFF of what the transform gives, or a PNG softproof, by its suffix."""

    path: Path
    dtype: Literal["float32", "uint16"] = "float32"
    """Sample type of a TIFF: float32, or uint16 for XYZ in u1.15."""
    profile: bytes | None = None
    """Profile to embed in a TIFF."""
    exposure: float = 1.0
    """Factor on the XYZ of a PNG."""
    depth: Literal[8, 16] = 8
    """Bits of a PNG's samples."""

    @property
    def is_png(self) -> bool:
        return self.path.suffix.lower() == PNG_SUFFIX


@dataclass
class Done:
    """What a run wrote and met."""

    outputs: list[dict[str, Any]] = field(default_factory=list)
    not_finite: int = 0
    """Samples of the result that are not finite numbers."""


def check_outputs(outputs: Sequence[Output], *, overwrite: bool) -> None:
    """Refuse, before any work, an output that could not be written."""
    for i, output in enumerate(outputs):
        suffix = output.path.suffix.lower()
        if suffix not in (*TIFF_SUFFIXES, PNG_SUFFIX):
            raise UsageError(
                f"{output.path}: found suffix {suffix!r}, expected {', '.join((*TIFF_SUFFIXES, PNG_SUFFIX))}"
            )
        if output.path in [o.path for o in outputs[:i]]:
            raise UsageError(f"{output.path}: is to be written twice")
        check_target(output.path, overwrite=overwrite)


def run(
    source: TiffSource,
    transform: Transform,
    last: Profile,
    outputs: Sequence[Output],
    *,
    overwrite: bool,
    label: str,
) -> Done:
    """Stream `source` through `transform`, whose chain ends on profile `last`, into `outputs`."""
    to_display = None
    if any(output.is_png for output in outputs):
        if last.header.pcs not in ("XYZ ", "Lab "):
            raise LinkError(
                f"{last.source}: a PNG needs a chain that ends on XYZ or Lab, such as a MID and an MVIS"
            )
        to_display = standard_XYZ(last)
    done = Done()
    with ExitStack() as stack:
        sinks = [
            stack.enter_context(_open(output, source, transform.channels_out, overwrite))
            for output in outputs
        ]
        for block in _progress(source, label):
            result = transform(block.data)
            done.not_finite += int(result.size - np.count_nonzero(np.isfinite(result)))
            display = to_display(result) if to_display else result
            for output, sink in zip(outputs, sinks, strict=True):
                sink.write(block._replace(data=display if output.is_png else result))
    for output, sink in zip(outputs, sinks, strict=True):
        counts = ("above_white", "out_of_gamut") if output.is_png else ("clipped",)
        done.outputs.append({"path": str(output.path), **{name: getattr(sink, name) for name in counts}})
    return done


def _open(output: Output, source: TiffSource, names: tuple[str, ...], overwrite: bool) -> Any:
    if output.is_png:
        return create_png(
            output.path,
            source.height,
            source.width,
            depth=output.depth,
            exposure=output.exposure,
            overwrite=overwrite,
        )
    return create_tiff(
        output.path,
        source.height,
        source.width,
        names,
        samples="real",
        dtype=output.dtype,
        profile=output.profile,
        overwrite=overwrite,
    )


def _progress(source: TiffSource, label: str) -> Iterable[Block]:
    """The blocks of `source`, with a progress bar where stderr is a terminal."""
    if not sys.stderr.isatty():
        yield from source.blocks()
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(label, total=source.height * source.width)
        for block in source.blocks():
            yield block
            height, width, _ = block.data.shape
            bar.advance(task, height * width)


def arranged_channels(
    source: TiffSource, own: Sequence[str], declared: Sequence[str] | None
) -> list[str] | None:
    """The names to link by: those declared, else those in the file; None where there are neither.

    Raises UsageError where the number of channels does not fit, or a name is unknown.
    """
    names = declared or source.names
    if names is None:
        if source.channels != len(own):
            raise UsageError(
                f"the image has {source.channels} channels without names, the first profile {len(own)} "
                f"({', '.join(own)}); name the image's channels with --channels"
            )
        return None
    if len(names) != source.channels:
        raise UsageError(f"--channels names {len(names)} channels, the image has {source.channels}")
    for name in names:
        if name not in own:
            raise LinkError(f"the image's channel {name!r} is not in the first profile: {nearest(name, own)}")
    return list(names)
