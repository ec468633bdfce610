"""What the tests of proofs share: small jobs, and profiles to make them with."""

from __future__ import annotations

import dataclasses

import imagecodecs
import numpy as np
import tifffile

from iccbrdf.brdf.primaries import read_primaries, write_primaries
from iccbrdf.build.viewing import viewing
from iccbrdf.icc import Curve, Header, LutAToB, LutBToA, Mluc, ParametricCurve, Profile
from iccbrdf.icc.header import D50
from iccbrdf.icc.tags import XYZ
from iccbrdf.images.showing import srgb
from iccbrdf.resources import folder

PRIMARIES = folder("profiles") / "fogra39_gloss" / "primaries.json"
SLOPES = PRIMARIES.with_name("slopes.json")
TEN_DEGREES = "CIE 1964 10 Degree Standard Observer"
D65_10 = (0.94811, 1.0, 1.07304)


def write_lab(path, XYZ_D50, **options):
    """A float L*a*b* TIFF of XYZ under D50, by the formula of CIE 15."""
    ratio = np.asarray(XYZ_D50, float) / D50
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / 3 / (6 / 29) ** 2 + 4 / 29)
    Lab = np.stack(
        [116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1
    )
    tifffile.imwrite(path, Lab.astype(np.float32), photometric="cielab", **options)
    return path


def nodes():
    """XYZ of the nine primaries, a row of them, (1, 9, 3)."""
    return read_primaries(PRIMARIES).XYZ[np.newaxis]


def primaries_for_d65_10(path):
    """The primaries as they would be measured if all spectra followed the Bradford adaptation."""
    primaries = read_primaries(PRIMARIES)
    (element,) = viewing("D65", TEN_DEGREES, D65_10).from_standard().elements
    matrix = np.asarray(element.matrix, float)

    def adapted(values):
        return tuple((matrix @ values).tolist())

    entries = tuple(
        dataclasses.replace(
            entry,
            XYZ=adapted(entry.XYZ),
            parameters=(*adapted(entry.parameters[:3]), *adapted(entry.parameters[3:6]), entry.parameters[6]),
        )
        for entry in primaries.primaries
    )
    changed = dataclasses.replace(
        primaries,
        illuminant="D65",
        observer=TEN_DEGREES,
        white=D65_10,
        primaries=entries,
        encoding={"kd": 2.0, "ks": 1.0, "m": 1.0},
    )
    write_primaries(changed, path)
    return path


def write_height(path, heights):
    """A 16-bit height map; returns the height of its white above black."""
    relief = float(np.ptp(heights))
    stored = np.rint((heights - heights.min()) / relief * 65535).astype(np.uint16)
    path.write_bytes(imagecodecs.png_encode(stored))
    return relief


def bump(height, width):
    """A paraboloid, its top in the middle, in the unit of the pixels."""
    y, x = np.mgrid[:height, :width]
    return 10 - ((x - (width - 1) / 2) ** 2 + (y - (height - 1) / 2) ** 2) / 100


def lut_display():
    """A version 4 display without colorants: sRGB's primaries and a gamma of 2.2 in lutAToB and lutBToA."""
    linear = np.array([srgb()[tag].values[0] for tag in ("rXYZ", "gXYZ", "bXYZ")]).T
    half = 32768 / 65535  # the connection space holds XYZ up to almost 2
    identity = (Curve(),) * 3
    tags = {
        "desc": Mluc.of("LUT display"),
        "cprt": Mluc.of("No copyright, use freely"),
        "wtpt": XYZ.of(*D50),
        "A2B0": LutAToB(
            b_curves=identity,
            matrix=(*(linear * half).reshape(-1), 0, 0, 0),
            m_curves=(ParametricCurve(0, (2.2,)),) * 3,
        ),
        "B2A0": LutBToA(
            b_curves=identity,
            matrix=(*(np.linalg.inv(linear) / half).reshape(-1), 0, 0, 0),
            m_curves=(ParametricCurve(0, (1 / 2.2,)),) * 3,
        ),
    }
    header = Header(device_class="mntr", colour_space="RGB ", pcs="XYZ ", version=(4, 4, 0))
    return Profile.from_bytes(Profile(header, tags).to_bytes(), source="lut.icc")
