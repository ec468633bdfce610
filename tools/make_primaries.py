"""Make the example primaries and slopes files of profiles/ from published tables: no figure is typed by hand.

    python tools/make_primaries.py [--data ../shared/data] [-o profiles]

The data folder holds print/FOGRA39L.ti3 (characterisation data of coated offset, CGATS) and painting/ (maps
of a measured painting: kd, ks and gloss, as PNG).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from imagecodecs import imread
from numpy.typing import NDArray

from iccbrdf.brdf.geometry import planar
from iccbrdf.brdf.models import evaluate
from iccbrdf.brdf.primaries import Primaries, Primary, write_primaries
from iccbrdf.brdf.slopes import Slope, Slopes, write_slopes
from iccbrdf.icc import D50
from iccbrdf.measure.simulation import PRIMARIES

ROOT = Path(__file__).resolve().parent.parent
TWO_DEGREES = "CIE 1931 2 Degree Standard Observer"
DIGITS = 6

ANGLES = (0, 15, 30, 45, 60)

# Of the darkest neutral patches, one within the usual 330 % limit of ink.
RICH_BLACK = (80, 65, 65, 100)

# ks and m of Cook-Torrance BRDF1 with n = 1.5, fitted to the gonioreflectometer data of the Cornell Program
# of Computer Graphics.  ks is that of a white of Y = 1: its colour is the illuminant's.
GARNET_RED = (0.265, 0.251)
KRYLON_BLUE = (0.205, 0.213)

# Elevation tints of a relief map, from the lowest to the highest ground.
TINTS = {
    "Valley": (70, 30, 85, 0),
    "Foot of the hills": (55, 10, 70, 0),
    "Low hills": (20, 10, 55, 0),
    "Hills": (10, 30, 70, 0),
    "Slopes": (40, 55, 85, 0),
    "High slopes": (55, 70, 85, 0),
    "Ridge": (10, 10, 10, 0),
    "Summit": (0, 0, 0, 0),
}

FOGRA39_SOURCE = (
    "Colours: FOGRA39L characterisation data, coated offset, D50, 2 degrees, 45:0 (Fogra, 2006). "
    "Gloss: ks and m fitted to two paints measured by the Cornell Program of Computer Graphics, garnet red "
    "(paper and single inks) and krylon true blue (overprints and K, the thicker ink). This pairing is the "
    "project's own: no goniometric measurement of printed CMYK is public. kd: the XYZ less the gloss at 45:0."
)
LANDSCAPE_SOURCE = (
    "Colours: FOGRA39L characterisation data, coated offset, D50, 2 degrees, 45:0 (Fogra, 2006), chosen as "
    "elevation tints from low to high ground. Gloss: ks and m fitted to two paints measured by the Cornell "
    "Program of Computer Graphics, from krylon true blue in the valley to garnet red on the summit. This "
    "pairing is the project's own. kd: the XYZ less the gloss at 45:0."
)
SLOPES_SOURCE = (
    "Computed, not measured: no colours of printed slopes are public. Flat: FOGRA39L characterisation data, "
    "coated offset, D50, 2 degrees, 45:0 (Fogra, 2006), paper and C80 M65 Y65 K100. Slopes: the same ink on "
    "1/cos of the area makes films cos times as thick; the white is a layer that scatters and does not "
    "absorb over black, R = t/(1 + t) with t its scattering power (Kubelka-Munk), the black a film on it "
    "whose density goes with its thickness."
)
PAINTING_SOURCE = (
    "F. Marton, Cape Spartivento Lighthouse, oil on canvas, measured by cnr-isti-vclab (OpenLIME): mean of "
    "the diffuse, specular and gloss maps over the lightest hundredth. XYZ: the model at 45:0."
)


def make_fogra39_gloss(data: Path) -> Primaries:
    """Return FOGRA39 colours with the gloss of two paints, so that the model at 45:0 gives the XYZ."""
    glosses = {
        name: KRYLON_BLUE if np.count_nonzero(cmyk) > 1 or name == "K" else GARNET_RED
        for name, cmyk in PRIMARIES.items()
    }
    return fogra39_print(data, PRIMARIES, glosses, FOGRA39_SOURCE)


def make_landscape(data: Path) -> Primaries:
    """Return elevation tints in FOGRA39 colours, whose gloss passes from one paint to the other."""
    share = np.linspace(0, 1, len(TINTS))
    glosses = {
        name: tuple((np.array(KRYLON_BLUE) + s * np.subtract(GARNET_RED, KRYLON_BLUE)).tolist())
        for name, s in zip(TINTS, share, strict=True)
    }
    return fogra39_print(data, TINTS, glosses, LANDSCAPE_SOURCE)


def fogra39_print(
    data: Path,
    patches: dict[str, tuple[int, ...]],
    glosses: dict[str, tuple[float, ...]],
    source: str,
) -> Primaries:
    """Return patches of FOGRA39 with ks (of a white of Y = 1) and m by name, and kd that fits XYZ at 45:0."""
    colours = read_colours(data / "print" / "FOGRA39L.ti3")
    primaries = []
    for name, cmyk in patches.items():
        ks, m = glosses[name]
        gloss = np.array([*np.multiply(ks, D50), m]).round(DIGITS)
        black = np.concatenate([np.zeros(3), gloss])
        kd = np.subtract(colours[cmyk], factor_45_0("brdf1", black)).round(DIGITS)
        primaries.append(
            Primary(name, colours[cmyk], (*kd.tolist(), *gloss.tolist()), tuple(map(float, cmyk)))
        )
    return Primaries(
        model="brdf1",
        illuminant="D50",
        observer=TWO_DEGREES,
        white=D50,
        geometry="45:0",
        source=source,
        primaries=tuple(primaries),
    )


def make_ward_painting(data: Path) -> Primaries:
    """Return the lightest paint of the painting, in the model that its maps were measured for."""
    # The maps' borders are invalid.
    kd, ks, gloss = (
        imread(data / "painting" / f"{name}map_level2.png")[40:-40, 40:-40].reshape(-1, 3) / 255
        for name in ("kd", "ks", "gl")
    )
    lightest = kd[:, 1] >= np.quantile(kd[:, 1], 0.99)
    Rd = linear_sRGB_to_XYZ(kd[lightest].mean(axis=0))
    m = ward_roughness(gloss[lightest, 0]).mean()
    parameters = np.array([*Rd, ks[lightest].mean(), m]).round(DIGITS)
    XYZ = factor_45_0("ward", parameters).round(DIGITS)
    return Primaries(
        model="ward",
        illuminant="D65",
        observer=TWO_DEGREES,
        white=tuple(linear_sRGB_to_XYZ(np.ones(3)).round(DIGITS).tolist()),
        geometry="45:0",
        source=PAINTING_SOURCE,
        primaries=(Primary("Lightest paint", tuple(XYZ.tolist()), tuple(parameters.tolist())),),
        encoding={"Rd": 1.25},
    )


def make_fogra39_slopes(data: Path) -> Slopes:
    """Return white and black of FOGRA39, and what thinner films of both would be on slopes."""
    colours = read_colours(data / "print" / "FOGRA39L.ti3")
    Wf, Bf = np.array(colours[PRIMARIES["White"]]), np.array(colours[RICH_BLACK])
    scattering_power = Wf / (D50 - Wf)
    slopes = []
    for angle in ANGLES:
        thickness = planar(angle)[2]
        t = scattering_power * thickness
        Ws = D50 * t / (1 + t)
        Bs = Ws * (Bf / Wf) ** thickness
        slopes.append(Slope(float(angle), *(tuple(XYZ.round(DIGITS).tolist()) for XYZ in (Ws, Bs))))
    return Slopes("D50", TWO_DEGREES, D50, "0:45", SLOPES_SOURCE, tuple(slopes))


def factor_45_0(model: str, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return XYZ at 45:0 relative to the perfect diffuser in the same light."""
    flat, light, view = planar(0), planar(-45), planar(0)
    return evaluate(model, parameters, flat, light, view, intensity=np.pi * np.sqrt(2))


def ward_roughness(gloss: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Ward's m of the painting's gloss map (0..1), by the formula of its viewer, OpenLIME."""
    least, most = 1 - 0.6**0.25, 1 - 0.05**0.25
    m: NDArray[np.float64] = (1 - gloss * (most - least) - least) ** 4
    return m


def linear_sRGB_to_XYZ(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return XYZ (D65, Y = 1) of linear sRGB."""
    import colour

    XYZ: NDArray[np.float64] = colour.models.RGB_COLOURSPACE_sRGB.matrix_RGB_to_XYZ @ rgb
    return XYZ


def read_colours(path: Path) -> dict[tuple[int, ...], tuple[float, ...]]:
    """Return XYZ (Y = 1) by CMYK in per cent, of a CGATS table."""
    text = path.read_text(encoding="ascii")
    names = text.split("BEGIN_DATA_FORMAT")[1].split("END_DATA_FORMAT")[0].split()
    rows = text.split("BEGIN_DATA\n")[1].split("END_DATA")[0].splitlines()
    colours = {}
    for row in rows:
        fields = dict(zip(names, row.split(), strict=True))
        cmyk = tuple(int(float(fields[f"CMYK_{ink}"])) for ink in "CMYK")
        # The table's Y = 100 becomes 1 without a digit that the table does not have.
        colours[cmyk] = tuple(round(float(fields[f"XYZ_{axis}"]) / 100, DIGITS) for axis in "XYZ")
    return colours


MAKERS = {
    "fogra39_gloss": make_fogra39_gloss,
    "landscape": make_landscape,
    "ward_painting": make_ward_painting,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "profiles")
    arguments = parser.parse_args()
    for name, make in MAKERS.items():
        folder = arguments.output / name
        folder.mkdir(parents=True, exist_ok=True)
        write_primaries(make(arguments.data), folder / "primaries.json", overwrite=True)
    slopes = make_fogra39_slopes(arguments.data)
    write_slopes(slopes, arguments.output / "fogra39_gloss" / "slopes.json", overwrite=True)


if __name__ == "__main__":
    main()
