"""Small sound inputs to start from: our own profiles, parameters, tables and images, made on the spot."""

from __future__ import annotations

import io
import json
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import icc_examples
import imagecodecs
import numpy as np
import proof_examples
import tifffile
import xml_examples

from iccbrdf.calc.program import encode_ops, parse
from iccbrdf.icc import (
    XYZ,
    Calculator,
    Curve,
    ExtendedClut,
    Header,
    LutAToB,
    MultiProcess,
    Profile,
    read_profile,
)
from iccbrdf.icc.source_tag import SIGNATURE
from iccbrdf.icc.xml import profile_to_xml
from iccbrdf.images.blocks import Block
from iccbrdf.images.exr import create_exr
from iccbrdf.images.showing import srgb
from iccbrdf.resources import folder

_HERE = folder("profiles") / "fogra39_gloss"


def profiles() -> list[bytes]:
    """A MID and an MVIS that use every element, those of the models, and one of every tag type.

    Without what they were made from, which takes longest to compile and has a target of its own.
    """
    tags = {f"t{i:03}": tag for i, tag in enumerate(xml_examples.TAGS.values())}
    shipped = [path for path in sorted(_HERE.parent.rglob("*.icc")) if path.stat().st_size < 10_000]
    made = [icc_examples.a_mid(), icc_examples.an_mvis(), xml_examples.a_profile(**tags)]
    for profile in map(read_profile, shipped):
        tags = {signature: profile[signature] for signature in profile if signature != SIGNATURE}
        made.append(Profile(profile.header, tags))
    return [profile.to_bytes() for profile in made]


def xml() -> list[bytes]:
    """The same as XML."""
    return [profile_to_xml(Profile.from_bytes(data)) for data in profiles()[:4]]


_PROGRAMS = (
    "in(0,3) copy(3) mul(3) sum(3) sqrt copy(1,2) out(0,3)",
    "in(0) 0.5 gt if { in(1) sin tput(3) } else { in(2) exp tput(3) } tget(3) 2 pow out(0)",
    "in(0) 3 mul sel case { 1 } case { in(0) ln } dflt { env(litX) pop } out(1)",
    "in(0,3) mtx(0) clut(1) curv(2) out(0,3) scnt out(0)",
    "in(0,3) calc(3) tJab(4) tLab tXYZ out(0,3)",
    "1 in(0) in(1) 2 in(2) 1 solv(2,2) out(0) out(1,2)",
    "in(0,3) rotl(3,1) rotr(3,2) flip(3) posd(1,4) tsav(0,7) pop(7) in(0,2) ctop ptoc out(0,2)",
)


def programs() -> list[bytes]:
    """Calculator programs of three channels, as operations."""
    return [encode_ops(parse("{ " + text + " }")) for text in _PROGRAMS]


def primaries() -> list[bytes]:
    """Primaries files of all models."""
    return [path.read_bytes() for path in sorted(_HERE.parent.rglob("primaries.json"))]


def slopes() -> list[bytes]:
    """A slopes file."""
    return [(_HERE / "slopes.json").read_bytes()]


_DECLARED = (
    '# schema = "iccbrdf-measurements"\n# version = 1\n# angles = "degree"\n# view_angles = "lamp"\n'
    '# quantity = "reflectance"\n# scale = 1\n'
)
_VIEW = '# illuminant = "D50"\n# observer = "CIE 1931 2 Degree Standard Observer"\n'
_CGATS = (
    "CGATS.17\nNUMBER_OF_FIELDS 4\nBEGIN_DATA_FORMAT\nSAMPLE_ID LAB_L LAB_A LAB_B\nEND_DATA_FORMAT\n"
    'NUMBER_OF_SETS 2\nBEGIN_DATA\n"paper" 95 0 -2\ncyan 55 -37 -50\nEND_DATA\n'
)


def tables() -> list[bytes]:
    """Tables of measurements, each behind a line that names its format."""
    rows = [f"{p},{t},{r},{0.2 + t / 1000},{0.3},{0.1}" for p in ("paper", "cyan") for t in (0, 45) for r in
            (-60, 0, 44.5)]  # fmt: skip
    colours = _DECLARED + _VIEW + "\n".join(["patch,theta_i,theta_r,X,Y,Z", *rows]) + "\n"
    names = ",".join(["patch", "theta_i", "theta_r", *map(str, range(400, 701, 20))])
    spectra = _DECLARED + "\n".join([names, *(f"p,{t},0," + ",".join(["0.5"] * 16) for t in (0, 45))])
    bands = list(range(400, 701, 20))
    cornell = "\n".join(
        [f"# 2 rows\n{len(bands)}", *map(str, bands), "0 0 0 0" + " 0.1" * 16, "0.7 0 0.7 3.1" + " 0.2" * 16]
    )
    return [
        b"csv\n" + colours.encode(),
        b"csv\n" + spectra.encode(),
        b"tsv\n" + colours.replace(",", "\t").encode(),
        b"txt\n" + _CGATS.encode(),
        b"brdf\n" + cornell.encode(),
    ]


def tiffs() -> list[bytes]:
    """TIFFs of the kinds that are read."""
    pixels = np.random.default_rng(3).random((9, 13, 4), np.float32)
    kinds: list[dict[str, Any]] = [
        {},
        {"tile": (16, 16)},
        {"compression": "deflate", "rowsperstrip": 4},
        {"compression": "zstd", "predictor": True},
        {"planarconfig": "separate", "rowsperstrip": 4},
        {"bigtiff": True, "byteorder": ">"},
    ]
    found = []
    for kind in kinds:
        for data in (pixels, (pixels * 255).astype(np.uint8)):
            file = io.BytesIO()
            tifffile.imwrite(file, data, **({"photometric": "minisblack", "planarconfig": "contig"} | kind))
            found.append(file.getvalue())
    file = io.BytesIO()
    record = {"schema": "iccbrdf.image/1", "samples": "device", "channels": ["kd.X", "kd.Y", "kd.Z", "m"]}
    options = {"photometric": "minisblack", "planarconfig": "contig", "metadata": None}
    tifffile.imwrite(file, pixels, description=json.dumps(record), **options)
    return [*found, file.getvalue()]


def pictures() -> list[bytes]:
    """Normal maps and height maps."""
    grey = np.arange(48, dtype=np.uint8).reshape(6, 8)
    return [
        imagecodecs.png_encode(grey),
        imagecodecs.png_encode(np.stack([grey, grey, grey + 100], -1)),
        imagecodecs.png_encode(grey.astype(np.uint16) * 999),
        *tiffs()[:2],
    ]


def jobs() -> list[bytes]:
    """Proof jobs."""
    return [
        b'image = "a.tif"\nprimaries = "p.json"\nlight = ["left=45,180", "60,0"]\nrelief = "2 mm"\n'
        b'height = "h.png"\npixel-pitch = "0.1 mm"\ndisplay = "srgb"\nmax-clipped = 0.05\nframes = 12\n',
        b'image = "a.tif"\nprimaries = "p.json"\nnormals = "n.png"\nsheet = true\nsweep = "60,0:60,360"\n'
        b'env = ["litI=3"]\nexposure = 1.5\ndepth = "16"\nkeep = ["xyz"]\n',
    ]


def packed() -> list[bytes]:
    """Compressed texts."""
    return [zlib.compress(text.encode()) for text in ("", "a text\0", "<CxF>\u00e4</CxF>" * 1000)]


def templates() -> list[bytes]:
    """Models in the source language."""
    names = ("cook_torrance", "cook_torrance_2020_literal", "ward_literal", "ward")
    return [(folder("calc_templates") / f"{name}.calc").read_bytes() for name in names]


def sources() -> list[bytes]:
    """What the source tags of an MVIS and of a colour MID say."""
    profiles = (read_profile(_HERE / name) for name in ("mvis.icc", "colour-mid.icc"))
    return [profile[SIGNATURE].text.encode() for profile in profiles]


def arguments() -> list[bytes]:
    """Light, view, sweep, and run-time variables, a line each."""
    return [
        b"45,180\n0,0\n60,0:60,360\nlitI=3\nlitX=-1e-7",
        b"left=0.5,0,1\nabove=1,-2,3e5\n-10,20:30,40\nlitZ=0",
    ]


def logs() -> list[bytes]:
    """What `iccbrdf proof` logs, as far as anything reads it."""
    scene = {"light": "45,180", "view": "0,0", "env": {"litX": -0.7, "litI": 4.5}, "picture": "proof.png"}
    log = {
        "schema": "iccbrdf.proof/1",
        "status": "done",
        "signature": "0",
        "job": {"output": "out", "reference-white": "flat", "highlights": "clip", "exposure": 1.5},
        "inputs": {"image": {"path": "a.tif", "bytes": 9, "sha256": "0"}},
        "scenes": [{**scene, "clipped": 0.25}],
        "outputs": [{"file": "flat.tif", "bytes": 0}],
    }
    return [json.dumps(log).encode()]


def page_profiles() -> list[bytes]:
    """The profiles of a page: an MVIS, a MID, and MVIS of little programs, of which more can be tried."""
    shipped = [(_HERE / name).read_bytes() for name in ("mvis.icc", "mid.icc")]
    mvis = Profile.from_bytes(shipped[0]).replace(remove=[SIGNATURE])
    channels = mvis["M2B0"].inputs
    little = (Calculator(channels, 3, parse("{ " + text + " }")) for text in _SHADERS)
    return [*shipped, *(mvis.replace(tags={"M2B0": MultiProcess.of(one)}).to_bytes() for one in little)]


_SHADERS = (
    "in(0,3) in(9) env(litZ) pop mul copy(1,2) mul(3) out(0,3)",
    "in(0,3) in(7) env(litX) pop gt if { sin cbrt } else { 0 max } in(3,3) add(3) out(0,3)",
    "env(litX) pop env(litY) pop atn2 copy(1,2) in(3,3) exp(3) mul(3) sqrt(3) out(0,3)",
)


def cmyk_profile() -> bytes:
    """A version 4 printer of two points an ink."""
    identity = (Curve(),) * 3
    table = np.random.default_rng(0).random((2, 2, 2, 2, 3)).astype(np.float32)
    lut = LutAToB(b_curves=identity, clut=ExtendedClut(table, 2), a_curves=(Curve(),) * 4)
    tags = {"A2B0": lut, "wtpt": XYZ.of(0.9, 1, 0.8)}
    header = Header(device_class="prtr", colour_space="CMYK", pcs="XYZ ", version=(4, 4, 0))
    return Profile(header, tags).to_bytes()


def device_profiles() -> list[bytes]:
    """Displays and a printer of version 4: by a matrix, and by tables."""
    return [proof_examples.lut_display().to_bytes(), srgb().to_bytes(), cmyk_profile()]


def print_jobs() -> list[bytes]:
    """Images in CMYK, RGB, L*a*b* and XYZ."""
    ink = (np.arange(4 * 5 * 4, dtype=np.uint8) * 3).reshape(4, 5, 4)
    record = {"schema": "iccbrdf.image/1", "samples": "real", "channels": ["X", "Y", "Z"]}
    colours = ink[..., :3] / np.float32(255)
    found = []
    for data, options in (
        (ink, {"photometric": "separated", "iccprofile": cmyk_profile()}),
        (ink[..., :3], {"photometric": "rgb", "iccprofile": srgb().to_bytes()}),
        (ink[..., :3].astype(np.uint16) * 99, {"photometric": "icclab"}),
        (colours, {"photometric": "cielab"}),
        (colours, {"photometric": "minisblack", "planarconfig": "contig", "description": json.dumps(record)}),
    ):
        file = io.BytesIO()
        tifffile.imwrite(file, data, metadata=None, **options)
        found.append(file.getvalue())
    return found


def exrs() -> list[bytes]:
    """OpenEXR files, of ours and without a record."""
    found = []
    with TemporaryDirectory() as place:
        for dtype in ("float32", "float16"):
            path = Path(place) / f"{dtype}.exr"
            names = ("kd.X", "m", "n.z")
            with create_exr(path, 40, 6, names, samples="real", dtype=dtype) as sink:
                for y0 in (0, 32):
                    sink.write(Block(y0, 0, np.full((min(32, 40 - y0), 6, 3), 0.25, np.float32)))
            found.append(path.read_bytes())
    return found


def fitted_tables() -> list[bytes]:
    """Measurements of two patches, enough to be fitted."""
    rows = [f"{p},{i},{r},{k + i / 900},{k},{k / 2}" for p, k in (("paper", 0.8), ("cyan", 0.2))
            for i in (0, 45) for r in (-60, -45, 0, 30, 60)]  # fmt: skip
    return [(_DECLARED + _VIEW + "\n".join(["patch,theta_i,theta_r,X,Y,Z", *rows]) + "\n").encode()]
