"""A job -> its proofs: profiles, pictures, contact sheet, animation, kept images, and the log of all that."""

from __future__ import annotations

import re
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from datetime import datetime, timezone
from typing import Any, Literal, cast

import numpy as np

from iccbrdf.brdf.models import NORMAL
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import build_colour_mid, build_pair, last_slope
from iccbrdf.cmm import link, standard_XYZ
from iccbrdf.errors import IccBrdfWarning, InputWarning, LimitError, UsageError
from iccbrdf.files import as_text, atomic_output, check_target, make_folder, write_together
from iccbrdf.icc import read_profile
from iccbrdf.images import ImageSource, WithNormals, create_png, create_tiff
from iccbrdf.images.display import create_rgb_tiff
from iccbrdf.images.exr import create_exr
from iccbrdf.images.showing import Highlights, Showing, display_profile
from iccbrdf.proof import log
from iccbrdf.proof.colour_in import ColourIn
from iccbrdf.proof.job import Job
from iccbrdf.proof.reduced import Cell, Reduction, write_animation, write_sheet
from iccbrdf.proof.relief import read_normals
from iccbrdf.proof.render import BRDF, FLAT, Chain, Counts, Target, run
from iccbrdf.proof.scenes import INTENSITY, Scene, scenes, sweep

MAX_SMALL_PIXELS = 1 << 26
"""Of contact sheet and animation together, which are held in memory at 32 bytes a pixel."""
PROFILES = ("colour-mid.icc", "mid.icc", "mvis.icc")


def make_proof(
    job: Job,
    *,
    overwrite: bool = False,
    workers: int = 1,
    advance: Callable[[int, int], None] = lambda pixels, total: None,
) -> dict[str, Any]:
    """Make the proofs of a job in its folder, the log `proof.json` last.

    Parameters
    ----------
    overwrite
        Make them even where they are there already.
    workers
        Threads that read and compute.
    advance
        Is told how many pixels more are done, and of how many.

    Returns
    -------
    dict
        The log.  Its `status` is "done", or "skipped" where an earlier log in the folder says that the same
        inputs gave the same files, which are there.

    Raises
    ------
    InputError, ProfileError, UnsupportedError, LinkError
        An input is missing or malformed, or inputs do not fit each other.
    UsageError
        Outputs exist and are of another job, or a setting contradicts another.
    LimitError
        An input is too large, or the disk is full.
    """
    started = time.perf_counter(), datetime.now(timezone.utc)
    inputs = log.hashed_inputs(job)
    signature = log.signature(job, inputs)
    if not overwrite and (found := log.earlier(job, signature)) is not None:
        return {**found, "status": "skipped"}
    with _recorded() as messages:
        made = _make(job, overwrite, workers, advance)
    seconds, begun = time.perf_counter() - started[0], started[1]
    entry = {
        "schema": log.SCHEMA,
        "status": "done",
        "signature": signature,
        "job": log.settings(job),
        "inputs": inputs,
        **made,
        "warnings": messages,
        "versions": log.versions(),
        "times": {"started": begun.isoformat(timespec="seconds"), "seconds": round(seconds, 3)},
    }
    with atomic_output(job.output / log.NAME, overwrite=overwrite) as temporary:
        temporary.write_text(log.as_json(entry), encoding="utf-8")
    return entry


def _make(job: Job, overwrite: bool, workers: int, advance: Callable[[int, int], None]) -> dict[str, Any]:
    primaries = read_primaries(job.primaries)
    slopes = read_slopes(job.slopes) if job.slopes is not None else None
    pair = build_pair(primaries)
    colour = build_colour_mid(primaries, interpolation=job.interpolation, slopes=slopes)
    intensity = pair.compiled.variables[INTENSITY]
    stills, frames = scenes(job, intensity), sweep(job, intensity)
    showing = Showing(
        display_profile(job.display), job.exposure, cast(Highlights, job.highlights), job.gamut_warning
    )
    outputs = _Outputs(job, stills)
    printer = read_profile(job.printer) if job.printer is not None else None
    with ExitStack() as stack:
        colours = stack.enter_context(ColourIn(job.image, printer, primaries))
        source = _with_relief(job, colours)
        # Inputs that are wrong leave no empty folder.
        make_folder(job.output)
        for file in (*PROFILES, *outputs.names, log.NAME):
            check_target(job.output / file, overwrite=overwrite)
        height, width = source.height, source.width
        to_brdf = link([colour.mid], samples="real", channels=source.names)
        seen = link([pair.mvis], channels=to_brdf.channels_out)
        chain = Chain(
            to_brdf=to_brdf,
            scenes=[seen.with_env(scene.env) for scene in (*stills, *frames)],
            to_display=standard_XYZ(pair.mvis),
            last_slope=last_slope(colour.mid),
        )
        targets = [
            Target(stack.enter_context(sink), image, for_display)
            for sink, image, for_display in outputs.sinks(source, chain, showing, overwrite)
        ]
        pictures = [target.sink for target in targets if target.for_display]
        small = [Reduction(height, width, job.sheet_size) for _ in stills] if job.sheet else []
        moving = [Reduction(height, width, job.sweep_size) for _ in frames]
        _check_size([*small, *moving])
        targets += [Target(cell, k, True) for k, cell in enumerate(small)]
        targets += [Target(cell, k, True) for k, cell in enumerate(moving, start=len(stills))]
        total = height * width
        counts = run(source, chain, targets, workers=workers, advance=lambda done: advance(done, total))
        _warn_of(counts, chain.last_slope)
        # Before the pictures appear under their names, so that a failure leaves none of them.
        if small:
            cells = [Cell(s.light, s.view, cell.XYZ) for s, cell in zip(stills, small, strict=True)]
            sheet = job.output / outputs.sheet
            write_sheet(sheet, as_text(job.image.name), cells, showing, overwrite=overwrite)
        if moving:
            kind = cast(Literal["png", "webp"], job.sweep_format)
            write_animation(
                job.output / outputs.sweep, [cell.XYZ for cell in moving], kind, showing, overwrite=overwrite
            )
        files = {"colour-mid.icc": colour.mid, "mid.icc": pair.mid, "mvis.icc": pair.mvis}
        write_together({job.output / name: p.to_bytes() for name, p in files.items()}, overwrite=overwrite)
    return {
        "size": {"width": width, "height": height},
        "colours": colours.summary,
        "scenes": [
            {
                "light": scene.light,
                "view": scene.view,
                "env": scene.env,
                "picture": name,
                "above_white": sink.above_white / total,
                "out_of_gamut": sink.out_of_gamut / total,
                "clipped": sink.clipped / total,
            }
            for scene, name, sink in zip(stills, outputs.pictures, pictures, strict=True)
        ],
        "limits": {
            "not_finite_in": counts.not_finite_in,
            "not_finite_out": counts.not_finite_out,
            "beyond_slopes": counts.beyond_slopes,
        },
        "outputs": [
            {"file": name, "bytes": (job.output / name).stat().st_size}
            for name in (*PROFILES, *outputs.names)
        ],
    }


def _check_size(small: Sequence[Reduction]) -> None:
    pixels = sum(picture.height * picture.width for picture in small)
    if pixels > MAX_SMALL_PIXELS:
        raise LimitError(
            f"contact sheet and animation have {pixels} pixels, the limit is {MAX_SMALL_PIXELS}: "
            "make them smaller, or fewer"
        )


def _warn_of(counts: Counts, last_slope: float | None) -> None:
    for count, text in (
        (counts.not_finite_in, "pixels of the flat print are no finite numbers"),
        (counts.not_finite_out, "pixels of the scenes are no finite numbers"),
        (
            counts.beyond_slopes,
            f"pixels are steeper than the last measured slope of {last_slope or 0:g} degrees, which holds "
            "for them",
        ),
    ):
        if count:
            warnings.warn(f"{count} {text}", InputWarning, stacklevel=2)


def _with_relief(job: Job, colours: ColourIn) -> ImageSource:
    """The colours with the normals of the relief; of a flat print where there is none."""
    normals = read_normals(job, colours.height, colours.width)
    names = colours.names or ()
    if normals is None:
        if NORMAL[0] in names:
            return colours
        normals = np.broadcast_to(np.array([0, 0, 1], np.float32), (colours.height, colours.width, 3))
    return WithNormals(colours, names, normals)


class _Outputs:
    """The names of a job's output files but for the profiles and the log, and the sinks that write them."""

    def __init__(self, job: Job, stills: Sequence[Scene]) -> None:
        self._job = job
        stems = _stems(stills)
        picture, kept = ("png" if job.format == "png" else "tif"), ("tif" if job.keep_as == "tiff" else "exr")
        self.pictures = [f"proof{stem}.{picture}" for stem in stems]
        self.sheet = "sheet.png"
        self.sweep = f"sweep.{job.sweep_format}"
        self._kept: dict[str, str | int] = {}
        if "flat" in job.keep:
            self._kept[f"flat.{kept}"] = FLAT
        if "brdf" in job.keep:
            self._kept[f"brdf.{kept}"] = BRDF
        if "xyz" in job.keep:
            self._kept |= {f"xyz{stem}.{kept}": k for k, stem in enumerate(stems)}

    @property
    def names(self) -> list[str]:
        """All of them."""
        job = self._job
        return [
            *self.pictures,
            *self._kept,
            *[self.sheet] * job.sheet,
            *[self.sweep] * (job.sweep is not None),
        ]

    def sinks(
        self, source: ImageSource, chain: Chain, showing: Showing, overwrite: bool
    ) -> Iterator[tuple[AbstractContextManager[Any], str | int, bool]]:
        """Of each file but sheet and animation the sink, the image it takes, whether for the display."""
        job, size = self._job, (source.height, source.width)
        depth: Literal[8, 16] = 16 if job.depth == "16" else 8
        create = create_png if job.format == "png" else create_rgb_tiff
        for k, name in enumerate(self.pictures):
            path = job.output / name
            yield create(path, *size, depth=depth, showing=showing, overwrite=overwrite), k, True
        create_image = create_tiff if job.keep_as == "tiff" else create_exr
        for name, image in self._kept.items():
            names: Sequence[str] = source.names or ()
            if image != FLAT:
                names = chain.to_brdf.channels_out if image == BRDF else ("X", "Y", "Z")
            path = job.output / name
            yield create_image(path, *size, names, samples="real", overwrite=overwrite), image, False


def _stems(stills: Sequence[Scene]) -> list[str]:
    """What tells the files of one scene from those of another: nothing for a single one."""
    if len(stills) == 1:
        return [""]
    several = len({scene.view for scene in stills}) > 1
    labels = [f"{s.light}_{s.view}" if several else s.light for s in stills]
    stems = ["_" + re.sub(r"[^A-Za-z0-9.+-]+", "-", label) for label in labels]
    twice = [stem for stem in stems if stems.count(stem) > 1]
    if twice:
        raise UsageError(f"two lights or views would be written to proof{twice[0]}: name them")
    return stems


@contextmanager
def _recorded() -> Iterator[list[str]]:
    """The texts of this package's warnings, which are shown after all."""
    messages: list[str] = []
    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", IccBrdfWarning)
            yield messages
    finally:
        for warning in caught:
            warnings.showwarning(warning.message, warning.category, warning.filename, warning.lineno)
    messages += [str(w.message) for w in caught if issubclass(w.category, IccBrdfWarning)]
