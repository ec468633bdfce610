"""A proof job: one table of settings, from which both the TOML file and the command line are read.

Each field of `Job` is a key of the TOML file and an option of `iccbrdf proof`, with hyphens for underscores.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_type_hints

from iccbrdf.build.colour_mid import INTERPOLATIONS
from iccbrdf.errors import IccBrdfError, InputError, UsageError, nearest
from iccbrdf.files import read_whole
from iccbrdf.images.showing import DISPLAYS, HIGHLIGHTS
from iccbrdf.proof import values as to
from iccbrdf.toml import parse_toml

MAX_BYTES = 1 << 16
"""Of a job file: the reading of TOML may take its square."""


class Setting(NamedTuple):
    """How a field is read, what it is, and what stands for its value in the help."""

    read: to.Reader
    help: str
    metavar: str = ""
    many: bool = False


def _choice(text: str, *choices: str) -> Setting:
    return Setting(to.one_of(*choices), text, "|".join(choices))


@dataclass(frozen=True)
class Job:
    """The settings of a proof, lengths in mm.  `read_job` and `make_job` check each value."""

    image: Annotated[Path, Setting(to.path, "The print job: a TIFF in CMYK, RGB, L*a*b* or XYZ.", "FILE")]
    primaries: Annotated[Path, Setting(to.path, "Primaries file: how the print's colours reflect.", "FILE")]
    output: Annotated[Path, Setting(to.path, "Folder for the proofs.", "FOLDER")] = Path("proof")
    printer: Annotated[
        Path | None,
        Setting(to.path, "Profile of the image's CMYK or RGB; default: the one embedded in it.", "FILE"),
    ] = None
    slopes: Annotated[
        Path | None, Setting(to.path, "Slopes file: white and black printed on slopes.", "FILE")
    ] = None
    interpolation: Annotated[str, _choice("Between the primaries.", *INTERPOLATIONS)] = "smooth"

    height: Annotated[Path | None, Setting(to.path, "Height map of the relief, white on top.", "FILE")] = None
    relief: Annotated[
        float,
        Setting(
            to.length, "Height of white (of 1, in a float file) above black: in mm, or with a unit.", "LENGTH"
        ),
    ] = 1.0
    pixel_pitch: Annotated[
        float | None, Setting(to.length, "Distance of the image's pixels on the print.", "LENGTH")
    ] = None
    normals: Annotated[
        Path | None, Setting(to.path, "Normal map of the relief, instead of a height map.", "FILE")
    ] = None
    green: Annotated[str, _choice("Which way green points in a normal map.", "up", "down")] = "up"
    fit_relief: Annotated[
        bool, Setting(to.flag, "Resample a relief that is of another size than the image.")
    ] = False

    light: Annotated[
        tuple[str, ...],
        Setting(to.texts, "Direction to a light; the name labels its pictures.", "[NAME=]DIRECTION", True),
    ] = ("45,180",)
    view: Annotated[
        tuple[str, ...],
        Setting(to.texts, "Direction to a viewer, who sees every light.", "[NAME=]DIRECTION", True),
    ] = ("0,0",)
    env: Annotated[tuple[str, ...], Setting(to.texts, "A run-time variable.", "NAME=VALUE", True)] = ()
    reference_white: Annotated[
        str,
        _choice(
            "What has Y = 1: a white diffuser that faces the light, or one that lies flat, so that the flat "
            "print has its own XYZ.",
            "diffuser",
            "flat",
        ),
    ] = "diffuser"

    display: Annotated[
        str, Setting(to.display, "A profile of version 2 or 4, or a name.", f"{'|'.join(DISPLAYS)}|FILE")
    ] = "srgb"
    exposure: Annotated[float, Setting(to.number, "Factor on XYZ on the way to the display.", "NUMBER")] = 1.0
    highlights: Annotated[
        str, _choice("What becomes of what is brighter than the display's white.", *HIGHLIGHTS)
    ] = "clip"
    gamut_warning: Annotated[
        bool, Setting(to.flag, "Mark pixels above white in cyan, pixels out of gamut in magenta.")
    ] = False
    format: Annotated[str, _choice("Of the pictures.", "png", "tiff")] = "png"
    depth: Annotated[str, _choice("Bits of the pictures' samples.", "8", "16")] = "8"
    max_clipped: Annotated[
        float | None,
        Setting(to.share, "Fail (exit code 1) where a larger share of a picture is clipped.", "SHARE"),
    ] = None

    sheet: Annotated[bool, Setting(to.flag, "A contact sheet of all lights and views.")] = False
    sheet_size: Annotated[
        int, Setting(to.count, "Longest side of a picture on the contact sheet.", "PIXELS")
    ] = 320
    sweep: Annotated[
        str | None, Setting(to.text, "An animation: the light moves, as in 60,0:60,360.", "FROM:TO")
    ] = None
    frames: Annotated[int, Setting(to.count, "Pictures of the animation.", "NUMBER")] = 24
    sweep_format: Annotated[str, _choice("Of the animation.", "png", "webp")] = "png"
    sweep_size: Annotated[int, Setting(to.count, "Longest side of the animation.", "PIXELS")] = 480

    keep: Annotated[
        tuple[str, ...],
        Setting(
            to.any_of("flat", "brdf", "xyz"),
            "Also write an image: flat (XYZ of the flat print and normals, for the colour MID), brdf (for "
            "the binding MID), xyz (of every light and view).",
            "flat|brdf|xyz",
            True,
        ),
    ] = ()
    keep_as: Annotated[str, _choice("Format of the images that are kept.", "tiff", "exr")] = "tiff"


SETTINGS: dict[str, Setting] = {
    name.replace("_", "-"): hint.__metadata__[0]
    for name, hint in get_type_hints(Job, include_extras=True).items()
}
"""The settings by the names that people write."""


def read_job(path: Path, overriding: Mapping[str, Any] | None = None) -> Job:
    """Read a job from a TOML file; paths in it are relative to its folder.

    Parameters
    ----------
    overriding
        Settings, by the names of `SETTINGS`, that replace those of the file; paths in them are relative to
        the working folder.

    Raises
    ------
    InputError
        The file cannot be read or is not TOML; or a key is unknown, missing or has no such value.
    LimitError
        The file is larger than MAX_BYTES.
    UsageError
        An overriding setting is unknown or has no such value.
    """
    try:
        values = parse_toml(read_whole(path, MAX_BYTES).decode("utf-8"))
    except ValueError as error:
        raise InputError(f"{path}: is not TOML: {error}") from error
    read = _read(values, path.parent, f"{path}: ", InputError)
    return _job({**read, **_read(overriding or {}, Path(), "--", UsageError)}, f"{path}: ", InputError)


def make_job(values: Mapping[str, Any]) -> Job:
    """A job of settings by the names of `SETTINGS`.

    Raises UsageError where one is unknown or missing or has no such value.
    """
    return _job(_read(values, Path(), "--", UsageError), "--", UsageError)


def _read(values: Mapping[str, Any], base: Path, place: str, failure: type[IccBrdfError]) -> dict[str, Any]:
    read = {}
    for name, value in values.items():
        if name not in SETTINGS:
            raise failure(f"{place}{name} is unknown: {nearest(name, SETTINGS)}")
        try:
            read[name.replace("-", "_")] = SETTINGS[name].read(value, base)
        except ValueError as error:
            # An option that may be repeated comes as a tuple.
            found = ", ".join(map(str, value)) if isinstance(value, tuple) else value
            raise failure(f"{place}{name}: found {found!r}, expected {error}") from None
    return read


def _job(read: dict[str, Any], place: str, failure: type[IccBrdfError]) -> Job:
    for field in fields(Job):
        if field.default is MISSING and field.name not in read:
            raise failure(f"{place}{field.name} is missing: {SETTINGS[field.name].help}")
    job = Job(**read)
    if job.height is not None and job.normals is not None:
        raise failure(f"{place}height and {place}normals are two ways to say one thing: give one of them")
    if job.height is not None and job.pixel_pitch is None:
        raise failure(f"{place}height needs {place}pixel-pitch, such as 0.1mm")
    return job
