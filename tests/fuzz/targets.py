"""What is done with an input, and which errors may be the end of it."""

from __future__ import annotations

import functools
import io
import json
import math
import warnings
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar
from zlib import crc32

import numpy as np
import tifffile

from fuzz import seeds
from iccbrdf.brdf.primaries import Primaries, read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import build_colour_mid, build_pair
from iccbrdf.build.recipe import recipe_of
from iccbrdf.build.source import recompiled, with_effects
from iccbrdf.calc import compile_template
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.program import decode_ops, listing
from iccbrdf.calc.verify import verify
from iccbrdf.cli import cli
from iccbrdf.cmm import Transform, link
from iccbrdf.cmm.environment import checked_environment
from iccbrdf.errors import (
    IccBrdfWarning,
    InputError,
    LimitError,
    LinkError,
    ProfileError,
    UnsupportedError,
    UsageError,
    VariableError,
)
from iccbrdf.icc import (
    Calculator,
    Clut,
    CompressedUtf8,
    CompressedXml,
    CurveSet,
    FormulaSegment,
    Header,
    Matrix,
    MultiProcess,
    Profile,
    SegmentedCurve,
    XYZToJab,
    describe,
    read_profile,
    to_dict,
)
from iccbrdf.icc.compare import compare
from iccbrdf.icc.source_tag import SIGNATURE, read_source
from iccbrdf.icc.xml import profile_from_xml, profile_to_xml
from iccbrdf.images import ImageSource, open_tiff, read_height_map, read_normal_map
from iccbrdf.images.exr import open_exr
from iccbrdf.images.little_cms import check_profile, to_XYZ
from iccbrdf.images.showing import Showing, display_profile
from iccbrdf.measure import read_measurements
from iccbrdf.proof.colour_in import ColourIn
from iccbrdf.proof.job import make_job, read_job
from iccbrdf.proof.log import earlier
from iccbrdf.proof.scenes import scenes
from iccbrdf.proof.scenes import sweep as sweep_scenes
from iccbrdf.resources import folder
from iccbrdf.validate import CHECKS, check_numeric, validate, validate_pair
from iccbrdf.viewer import make_display, make_page, read_folder, read_print

T = TypeVar("T")

OF_PROFILES = (ProfileError, UnsupportedError, LimitError)
"""The three errors that a profile may cause: malformed, unsupported, over a limit."""
OF_FILES = (InputError, UnsupportedError, LimitError)
"""Those of a user's other files."""

MAX_COST = 1e9
"""Of a transform that is run here: seconds."""
_ODD = [0.0, 1.0, 0.5, -1.0, 2.0, 1e30, np.inf, -np.inf, np.nan]


@dataclass(frozen=True)
class Target:
    """A kind of input.

    run: does everything with an input; raises what is a finding, and returns whether the input was taken.
    seeds: gives inputs that are sound.  words: what may be put anywhere in them.
    """

    run: Callable[[bytes], bool]
    seeds: Callable[[], list[bytes]]
    words: tuple[bytes, ...] = ()


# Profiles ------------------------------------------------------------------------------------------------


_HERE = folder("profiles") / "fogra39_gloss"
_PAIR = [(_HERE / name).read_bytes() for name in ("mid.icc", "mvis.icc")]


def _pixels(channels: int) -> np.ndarray:
    return np.resize(np.array(_ODD, np.float32), (len(_ODD), min(channels, 65535)))


def run_chain(profiles: list[Profile], *backends: str) -> bool:
    """Link and run profiles; whether it could be."""
    taken = False
    for backend in backends:
        try:
            transform = link(profiles, backend=backend, max_cost=MAX_COST)
            transform(_pixels(len(transform.channels_in)))
        # A profile for another place in a chain is no fault of its own.
        except (*OF_PROFILES, LinkError):
            continue
        taken = True
    return taken


def profile(data: bytes) -> bool:
    """Decode all tags, write them back as bytes and as XML, describe, compare, validate, link and run."""
    validate(data, "a.icc", checks=(*CHECKS, check_numeric))
    mid, mvis = map(Profile.from_bytes, _PAIR)
    validate_pair((data, "a.icc"), (_turn(data, _PAIR), "b.icc"))
    try:
        read = Profile.from_bytes(data, "a.icc")
    except OF_PROFILES:
        return False
    if read.to_bytes() != data[: read.header.size] and read.to_bytes() != data:
        raise ValueError("a profile that was read is written as other bytes")
    for signature in read:
        try:
            read[signature]
        except OF_PROFILES:
            continue
    describe(read, listing=listing)
    to_dict(read, listing=listing)
    with suppress(LimitError):
        compare(read, mid, listing=listing)
    try:
        xml = profile_to_xml(read)
    except OF_PROFILES:
        pass
    else:
        xml_file(xml)
    taken = run_chain([read], "numpy", "interpreter")
    return run_chain(_turn(data, [[mid, read], [read, mvis]]), "numpy") | taken


def _turn(data: bytes, choices: Sequence[T]) -> T:
    """One way to use an input, always the same for the same one: more inputs are worth more than all ways."""
    return choices[crc32(data) % len(choices)]


def xml_file(data: bytes) -> bool:
    """XML to a profile and its bytes."""
    try:
        profile_from_xml(data, "a.xml").to_bytes()
    except (*OF_PROFILES, InputError):
        return False
    return True


_TABLE = np.linspace(0, 1, 27 * 3, dtype=np.float32).reshape(3, 3, 3, 3)
_CURVE = SegmentedCurve((0.5,), (FormulaSegment(0, (2, 1, 0, 0)), FormulaSegment(1, (1, 1, 1, 1, 0))))


def _elements() -> tuple[object, ...]:
    """A sub-element of every kind that programs apply, three channels each."""
    inner = Calculator(3, 3, decode_ops(seeds.programs()[0], "inner"))
    matrix, appearance = Matrix.of(np.eye(3) * 0.5), XYZToJab((96.4, 100.0, 82.5))
    return matrix, Clut(_TABLE), CurveSet((_CURVE,) * 3), inner, appearance


def program(data: bytes) -> bool:
    """Verify, list, lift, compile and run operations on three channels, with sub-elements of every kind."""
    try:
        operations = decode_ops(data, "program")
        elements = _elements()
        verify(operations, 3, 3, elements)
        listing(operations)
    except OF_PROFILES:
        return False
    process = MultiProcess.of(Calculator(3, 3, operations, elements))
    header = Header(device_class="scnr", colour_space="RGB ", pcs="XYZ ")
    # What is quickest makes machine code.
    backends = _turn(data, [("auto",), ("numpy", "interpreter")])
    return run_chain([Profile(header, {"A2B0": process})], *backends)


def template(data: bytes) -> bool:
    """A model in the source language, which profiles carry."""
    try:
        compile_template(data.decode("utf-8", "replace"), filename="a.calc")
    except OF_FILES:
        return False
    return True


def source(data: bytes) -> bool:
    """What a profile says it was made from: read, validated, compiled again, written as XML."""
    try:
        tag = CompressedUtf8.of(data.decode("utf-8", "replace"))
        profile = Profile.from_bytes(_PAIR[1]).replace(tags={SIGNATURE: tag})
        validate(profile.to_bytes(), "a.icc")
        profile_to_xml(profile)
        calculators = read_source(profile).calculators
    except OF_PROFILES:
        return False
    use = _turn(
        data,
        [
            lambda: [recompiled(calculator) for calculator in calculators],
            lambda: with_effects([profile], {"fresnel": False}),
            lambda: recipe_of([Profile.from_bytes(_PAIR[0]), profile]),
        ],
    )
    try:
        use()
    # It may be of another model than the profile that it goes with.
    except (*OF_PROFILES, InputError, UsageError):
        return False
    return True


def packed(data: bytes) -> bool:
    """Compressed text in tags."""
    try:
        for tag in (CompressedUtf8(data), CompressedXml(data)):
            describe(Profile(Header(device_class="scnr"), {"meta": tag}))
            tag.text.encode()
    except OF_PROFILES:
        return False
    return True


@functools.cache
def _black() -> bytes:
    """Two pixels of ten channels."""
    file = io.BytesIO()
    tifffile.imwrite(file, np.zeros((1, 2, 10), np.uint8), photometric="minisblack", planarconfig="contig")
    return file.getvalue()


def page(data: bytes) -> bool:
    """The page of an image that goes through a profile: shader and script are made of it."""

    def read(path: Path) -> None:
        image = path.with_name("a.tif")
        image.write_bytes(_black())
        profile = read_profile(path)
        chain = (
            [profile, Profile.from_bytes(_PAIR[1])] if profile.header.device_class == "mid " else [profile]
        )
        with open_tiff(image) as source:
            shown = read_print(source, chain, None, {})
        text = make_page(shown, make_display("srgb"), "a")
        # What profiles say stays text: no element of the page ends or begins in it.
        if text.count("<script") != 2 or text.count("</script") != 2:
            raise ValueError("text of a profile became part of the page")

    # A chain that gives no XYZ, or knows no light, is no fault of the profile.
    return _in_file(data, "a.icc", read, (*OF_PROFILES, InputError, LinkError, UsageError))


def device_profile(data: bytes) -> bool:
    """A profile of version 2 or 4, as a display's and as a printer's."""

    def read(path: Path) -> None:
        profile = read_profile(path)
        if profile.header.colour_space == "CMYK":
            check_profile(profile, "CMYK", "a job")
            to_XYZ(np.resize(np.float32([0, 0.5, 1]), (3, 3, 4)), profile, "absolute")
            return
        showing = Showing(display_profile(path), 1.5, "roll-off", True)
        showing(np.resize(np.array(_ODD, np.float32), (4, 9, 3)))

    return _in_file(data, "a.icc", read, (*OF_PROFILES, InputError))


def arguments(data: bytes) -> bool:
    """Directions and run-time variables as people write them, a line each."""
    light, view, sweep, *env = [*data.decode("utf-8", "replace").split("\n"), "", ""]
    env = [item for item in env if item]
    job = {"image": "a.tif", "primaries": "p.json", "light": light, "view": view, "sweep": sweep, "env": env}
    try:
        made = make_job({key: value for key, value in job.items() if value})
        for scene in (*scenes(made, np.pi), *sweep_scenes(made, np.pi)):
            _mvis().with_env(scene.env)
    except (UsageError, LimitError, VariableError):
        return False
    return True


@functools.cache
def _mvis() -> Transform:
    return link([Profile.from_bytes(_PAIR[1])])


# Files of users ------------------------------------------------------------------------------------------


def _in_file(
    data: bytes, name: str, read: Callable[[Path], object], errors: tuple[type[Exception], ...] = OF_FILES
) -> bool:
    with TemporaryDirectory(prefix="fuzz-") as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        try:
            read(path)
        except errors:
            return False
    return True


def primaries(data: bytes) -> bool:
    """A primaries file, and the profiles of what it says."""

    def read(path: Path) -> None:
        found = read_primaries(path)
        pair = build_pair(found)
        made = [pair.mid, pair.mvis]
        if len(found.primaries) >= 4:
            made.append(build_colour_mid(found).mid)
        for profile in made:
            profile.to_bytes()

    return _in_file(data, "primaries.json", read)


@functools.cache
def _primaries() -> Primaries:
    return read_primaries(_HERE / "primaries.json")


def slopes(data: bytes) -> bool:
    """A slopes file, and the colour MID of what it says."""

    def read(path: Path) -> None:
        build_colour_mid(_primaries(), slopes=read_slopes(path)).mid.to_bytes()

    return _in_file(data, "slopes.json", read)


_DECLARED = {
    "geometry": "45:0",
    "quantity": "reflectance",
    "illuminant": "D50",
    "observer": "CIE 1931 2 Degree Standard Observer",
    "scale": 1,
}


def table(data: bytes) -> bool:
    """A table of measurements behind a line that names its format."""
    kind, _, text = data.partition(b"\n")
    ending = kind.decode("latin-1") if kind in (b"csv", b"tsv", b"txt", b"brdf") else "csv"
    declarations = _DECLARED if ending == "txt" else {}
    return _in_file(text, f"table.{ending}", lambda path: read_measurements(path, **declarations))


def fitted(data: bytes) -> bool:
    """A table of measurements, and what is fitted to it."""

    def read(path: Path) -> None:
        _command("fit", path, "-o", path.with_name("out.json"), "--starts", "1")

    return _in_file(data, "table.csv", read)


def _command(*words: object) -> None:
    """Run a command, whose errors are raised."""
    with redirect_stdout(io.StringIO()):
        cli.main([str(word) for word in words], standalone_mode=False)


def tiff(data: bytes) -> bool:
    """A TIFF, block by block."""

    def read(path: Path) -> None:
        with open_tiff(path) as image:
            _some_blocks(image)

    return _in_file(data, "a.tif", read)


def _some_blocks(image: ImageSource) -> None:
    # The header may promise any number of blocks; sparse ones cost nothing to promise.
    for place in islice(image.places(), 64):
        image.read(place)


def print_job(data: bytes) -> bool:
    """The image of a print job, with the profile in it."""

    def read(path: Path) -> None:
        with ColourIn(path, None, _primaries()) as image:
            _some_blocks(image)

    return _in_file(data, "a.tif", read, (*OF_FILES, ProfileError))


def exr(data: bytes) -> bool:
    """An OpenEXR file, block by block."""

    def read(path: Path) -> None:
        with open_exr(path) as image:
            _some_blocks(image)

    return _in_file(data, "a.exr", read)


def picture(data: bytes) -> bool:
    """A map of normals, and a map of heights."""
    name = "a.png" if data.startswith(b"\x89") else "a.tif"
    height = _in_file(data, name, read_height_map)
    return _in_file(data, name, read_normal_map) or height


def job(data: bytes) -> bool:
    """A proof job."""

    def read(path: Path) -> None:
        try:
            read_job(path)
        except UsageError as error:
            raise InputError(str(error)) from error

    return _in_file(data, "job.toml", read)


def log(data: bytes) -> bool:
    """The log of a proof: as a page starts from it, and as a job is skipped by it."""

    def read(path: Path) -> None:
        path.with_name("flat.tif").touch()
        try:
            signature = json.loads(data)["signature"]
        except (ValueError, RecursionError, TypeError, KeyError):
            signature = ""
        made = make_job({"image": "a.tif", "primaries": "p.json", "output": str(path.parent)})
        if (found := earlier(made, signature)) is not None:
            [f"{scene['light']} {scene['clipped']:.2%}" for scene in found["scenes"]]
        start = read_folder(path.parent)
        math.log2(start.start.exposure)
        checked_environment(start.env, start.env)

    # So it says of a variable beyond float32.
    return _in_file(data, "proof.json", read, (*OF_FILES, VariableError))


# All of them ---------------------------------------------------------------------------------------------

_OPERATORS = tuple(name.encode().ljust(4) for name in OPERATORS)
_TYPES = (
    b"mpet cvst matf clut xclt calc func curf parf samf sngf clcf tint eobs robs emtx tmap tary utf8 mluc"
).split()
_LANGUAGE = tuple(b"( ) [ ] { } , = == ^ * / - + 1e39 1e-46 0 if else and or not in out let sum dot".split())
_NAMES = tuple(
    b'"a" "\\ud800" null true NaN -1 1e999 [] {} "" 0 99999999999999999999 , : [ ] { } "model" "X"'.split()
)
_MARKUP = tuple(
    b"&lt; &#0; <!-- --> <![CDATA[ ]]> <MatrixElement> </MatrixElement> nan 1e39 -1 65536 { } ( ) [1]".split()
)

TARGETS = {
    "profile": Target(profile, seeds.profiles, (*_TYPES, *_OPERATORS)),
    "program": Target(program, seeds.programs, _OPERATORS),
    "xml": Target(xml_file, seeds.xml, _MARKUP),
    "primaries": Target(primaries, seeds.primaries, _NAMES),
    "slopes": Target(slopes, seeds.slopes, _NAMES),
    "table": Target(table, seeds.tables, (*_NAMES, b"#", b"\n", b" ", b"\t", b"=", b"END_DATA")),
    "tiff": Target(tiff, seeds.tiffs),
    "picture": Target(picture, seeds.pictures, (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND", b"iCCP")),
    "template": Target(template, seeds.templates, _LANGUAGE),
    "source": Target(source, seeds.sources, (*_NAMES, *_LANGUAGE)),
    "packed": Target(packed, seeds.packed),
    "page": Target(page, seeds.page_profiles, (*_TYPES, *_OPERATORS, b"</script>", b"{{page}}", b"*/")),
    "display": Target(device_profile, seeds.device_profiles, (*_TYPES, b"mft1", b"mft2", b"mAB ", b"para")),
    "arguments": Target(arguments, seeds.arguments, (*_NAMES, b"=", b":", b"\n", b"litX", b"litI", b"nan")),
    "fit": Target(fitted, seeds.fitted_tables, (*_NAMES, b"0", b"1e300", b"-1", b"1e-300", b"\n", b"89.9")),
    "print": Target(print_job, seeds.print_jobs),
    "exr": Target(exr, seeds.exrs, (b"channels", b"dataWindow", b"compression", b"chlist", b"box2i")),
    "log": Target(log, seeds.logs, _NAMES),
    "job": Target(job, seeds.jobs, (*_NAMES, b"=", b"mm", b"dpi", b"%", b"\n", b"[[", b"'''", b"1979-05-27")),
}


def quietly(target: Target, data: bytes) -> bool:
    """Run an input as a careful caller would: our warnings are none of the matter, others are findings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", IccBrdfWarning)
        return target.run(data)
