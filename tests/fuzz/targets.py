"""What is done with an input, and which errors may be the end of it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np

from fuzz import seeds
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import build_pair
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.program import decode_ops, listing
from iccbrdf.calc.verify import verify
from iccbrdf.cmm import link
from iccbrdf.errors import (
    IccBrdfWarning,
    InputError,
    LimitError,
    LinkError,
    ProfileError,
    UnsupportedError,
    UsageError,
)
from iccbrdf.icc import (
    Calculator,
    Clut,
    CurveSet,
    FormulaSegment,
    Header,
    Matrix,
    MultiProcess,
    Profile,
    SegmentedCurve,
    XYZToJab,
    describe,
)
from iccbrdf.icc.xml import profile_from_xml, profile_to_xml
from iccbrdf.images import open_tiff, read_height_map, read_normal_map
from iccbrdf.measure import read_measurements
from iccbrdf.proof.job import read_job
from iccbrdf.validate import validate

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


def _pixels(channels: int) -> np.ndarray:
    return np.resize(np.array(_ODD, np.float32), (len(_ODD), min(channels, 65535)))


def run_chain(profile: Profile, *backends: str) -> bool:
    """Link and run a profile; whether it could be."""
    taken = False
    for backend in backends:
        try:
            transform = link([profile], backend=backend, max_cost=MAX_COST)
            transform(_pixels(len(transform.channels_in)))
        # A profile for another place in a chain is no fault of its own.
        except (*OF_PROFILES, LinkError):
            continue
        taken = True
    return taken


def profile(data: bytes) -> bool:
    """Decode all tags, write them back as bytes and as XML, describe, validate, link and run."""
    validate(data, "a.icc")
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
    describe(read)
    try:
        xml = profile_to_xml(read)
    except OF_PROFILES:
        pass
    else:
        xml_file(xml)
    return run_chain(read, "numpy", "interpreter")


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
    # The quickest back end first, which makes machine code.
    return run_chain(Profile(header, {"A2B0": process}), "auto", "numpy", "interpreter")


# Files of users ------------------------------------------------------------------------------------------


def _in_file(data: bytes, name: str, read: Callable[[Path], object]) -> bool:
    with TemporaryDirectory(prefix="fuzz-") as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        try:
            read(path)
        except OF_FILES:
            return False
    return True


def primaries(data: bytes) -> bool:
    """A primaries file, and the profiles of what it says."""
    return _in_file(data, "primaries.json", lambda path: build_pair(read_primaries(path)))


def slopes(data: bytes) -> bool:
    """A slopes file."""
    return _in_file(data, "slopes.json", read_slopes)


def table(data: bytes) -> bool:
    """A table of measurements behind a line that names its format."""
    kind, _, text = data.partition(b"\n")
    ending = kind.decode("latin-1") if kind in (b"csv", b"tsv", b"txt", b"brdf") else "csv"
    declared = {"txt": SimpleNamespace(geometry="45:0", quantity="reflectance", illuminant="D50",
                observer="CIE 1931 2 Degree Standard Observer", scale=1)}  # fmt: skip
    declarations = vars(declared[ending]) if ending in declared else {}
    return _in_file(text, f"table.{ending}", lambda path: read_measurements(path, **declarations))


def tiff(data: bytes) -> bool:
    """A TIFF, block by block."""

    def read(path: Path) -> None:
        with open_tiff(path) as image:
            for number, place in enumerate(image.places(4096)):
                # The header may promise any number of blocks; sparse ones cost nothing to promise.
                if number == 64:
                    break
                image.read(place)

    return _in_file(data, "a.tif", read)


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


# All of them ---------------------------------------------------------------------------------------------

_OPERATORS = tuple(name.encode().ljust(4) for name in OPERATORS)
_TYPES = (
    b"mpet cvst matf clut xclt calc func curf parf samf sngf clcf tint eobs robs emtx tmap tary utf8 mluc"
).split()
_NAMES = tuple(b'"a" null true NaN -1 1e999 [] {} "" 0 99999999999999999999 , : [ ] { } "model" "X"'.split())
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
    "job": Target(job, seeds.jobs, (*_NAMES, b"=", b"mm", b"dpi", b"%", b"\n", b"[[", b"'''", b"1979-05-27")),
}


def quietly(target: Target, data: bytes) -> bool:
    """Run an input as a careful caller would: our warnings are none of the matter, others are findings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", IccBrdfWarning)
        return target.run(data)
