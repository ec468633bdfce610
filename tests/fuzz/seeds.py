"""Small sound inputs to start from: our own profiles, parameters, tables and images, made on the spot."""

from __future__ import annotations

import io
import json
from typing import Any

import icc_examples
import imagecodecs
import numpy as np
import tifffile
import xml_examples

from iccbrdf.calc.program import encode_ops, parse
from iccbrdf.icc import Profile
from iccbrdf.icc.xml import profile_to_xml
from iccbrdf.resources import folder

_HERE = folder("profiles") / "fogra39_gloss"


def profiles() -> list[bytes]:
    """A MID and an MVIS that use every element, those of the models, and one of every tag type."""
    tags = {f"t{i:03}": tag for i, tag in enumerate(xml_examples.TAGS.values())}
    shipped = [path for path in sorted(_HERE.parent.rglob("*.icc")) if path.stat().st_size < 10_000]
    made = [icc_examples.a_mid(), icc_examples.an_mvis(), xml_examples.a_profile(**tags)]
    return [*(profile.to_bytes() for profile in made), *(path.read_bytes() for path in shipped)]


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
