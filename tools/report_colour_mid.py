"""What the interpolation of the example primaries costs and how far it can be trusted.

    python tools/report_colour_mid.py [-o docs]

Prints operators, the error of float32 with the number of colours at a switch of the published method, and
closure (how near the whole model at 45:0 comes to the colour that it was asked for); draws continuity.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from numpy.typing import NDArray

import iccbrdf
from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes, slope_adjust
from iccbrdf.build import INTERPOLATIONS, build_colour_mid, build_pair
from iccbrdf.build.profiles import XYZ_RANGE

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "profiles" / "fogra39_gloss"
PRIMARIES = read_primaries(EXAMPLE / "primaries.json")
SLOPES = read_slopes(EXAMPLE / "slopes.json")

FLOAT32_COLOURS = 20_000

Array = NDArray[np.float64]


def colours(count: int, rng: np.random.Generator) -> Array:
    """XYZ within the gamut: mixtures of the primaries."""
    return rng.dirichlet(np.full(len(PRIMARIES.primaries), 0.6), count) @ PRIMARIES.XYZ


def closure(interpolation: str, angle: float, XYZ: Array) -> Array:
    """CIEDE2000 between the colour on a slope and what MID and MVIS give for it at 45:0, in its own frame."""
    chain = [
        build_colour_mid(PRIMARIES, interpolation=interpolation, slopes=SLOPES).mid,
        build_pair(PRIMARIES).mvis,
    ]
    light, view = direction(angle, 0), direction(abs(angle - 45), 0 if angle >= 45 else 180)
    env = dict(zip(("litX", "litY", "litZ", "vueX", "vueY", "vueZ"), (*light, *view), strict=True))
    normals = np.broadcast_to(light, XYZ.shape)
    values = np.concatenate([XYZ / XYZ_RANGE[1], (normals + 1) / 2], axis=1)
    found = iccbrdf.link(chain, env=env, dtype="float64")(values)
    wanted = slope_adjust(XYZ, angle, SLOPES)
    return delta_E_CIE2000(*(XYZ_to_Lab(value, PRIMARIES.white) for value in (found, wanted)))


def float32_error(interpolation: str, XYZ: Array) -> tuple[int, float]:
    """How far the program in float32 is from the float64 reference: a count and the largest CIEDE2000.

    Counted are colours so near to a switch of the choice of nodes that rounding moves it, which changes ks or
    m by more than a thousandth; the CIEDE2000 of kd is that of all others.
    """
    flat = np.broadcast_to([0.5, 0.5, 1.0], XYZ.shape)
    values = np.concatenate([XYZ / XYZ_RANGE[1], flat], axis=1).astype(np.float32)
    found = iccbrdf.link([build_colour_mid(PRIMARIES, interpolation=interpolation).mid])(values)
    wanted = interpolate(values[:, :3] * XYZ_RANGE[1], PRIMARIES, method=interpolation)
    k = wanted.shape[1]
    switched = np.abs(np.log(found[:, 3:k] / wanted[:, 3:])).max(axis=1) > 1e-3
    Labs = [XYZ_to_Lab(parameters[~switched, :3], PRIMARIES.white) for parameters in (found, wanted)]
    return int(switched.sum()), float(delta_E_CIE2000(*Labs).max())


def largest_steps(method: str, starts: Array, ends: Array, count: int) -> float:
    """The largest change of a logarithm of ks or m over one of `count` steps along any of the lines."""
    largest = 0.0
    share = np.linspace(0, 1, count + 1)[:, None]
    for start, end in zip(starts, ends, strict=True):
        gloss = interpolate(start + share * (end - start), PRIMARIES, method=method)[:, 3:]
        largest = max(largest, float(np.abs(np.diff(np.log(gloss), axis=0)).max()))
    return largest


def draw_continuity(path: Path, lines: int, rng: np.random.Generator) -> None:
    """Left: m along one line; right: the largest step of ln ks or ln m against the number of steps."""
    starts, ends = colours(lines, rng), colours(lines, rng)
    counts = (100, 1000, 10_000)
    figure, (along, steps) = plt.subplots(1, 2, figsize=(9, 3.6), constrained_layout=True)
    share = np.linspace(0, 1, 4001)
    for method in INTERPOLATIONS:
        m = interpolate(starts[0] + share[:, None] * (ends[0] - starts[0]), PRIMARIES, method=method)[:, -1]
        along.plot(share, m, label=method)
        largest = [largest_steps(method, starts, ends, count) for count in counts]
        steps.loglog(counts, largest, "o-", label=method)
        print(f"largest step of ln ks, ln m, {method}: " + ", ".join(f"{s:.2g}" for s in largest), flush=True)
    along.set(xlabel="way along a line in XYZ", ylabel="roughness m")
    steps.set(xlabel="steps a line", ylabel=f"largest step of ln ks, ln m on {lines} lines")
    along.legend()
    steps.legend()
    figure.savefig(path, dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs")
    parser.add_argument("--lines", type=int, default=200)
    arguments = parser.parse_args()
    mpl.use("Agg")
    arguments.output.mkdir(exist_ok=True)
    rng = np.random.default_rng(2023)
    XYZ = colours(1000, rng)
    print(f"{len(PRIMARIES.primaries)} nodes, 1,000 colours; CIEDE2000 mean / 95 % / max")
    for method in INTERPOLATIONS:
        compiled = build_colour_mid(PRIMARIES, interpolation=method, slopes=SLOPES).compiled
        print(f"{method}: {compiled.executed} operators with slope adjustment")
        switched, error = float32_error(method, colours(FLOAT32_COLOURS, rng))
        print(
            f"  float32: {switched} of {FLOAT32_COLOURS} colours at a switch of nodes, "
            f"others within CIEDE2000 {error:.1e}"
        )
        for angle in SLOPES.angles:
            dE = closure(method, angle, XYZ)
            figures = (dE.mean(), np.quantile(dE, 0.95), dE.max())
            print(f"  closure at {angle:>2g} degrees: " + " / ".join(f"{figure:.2f}" for figure in figures))
    draw_continuity(arguments.output / "continuity.png", arguments.lines, rng)


if __name__ == "__main__":
    main()
