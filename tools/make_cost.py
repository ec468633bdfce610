"""What accuracy costs, in pictures and tables: of the demo's print and of a measured painting.

    python tools/make_cost.py [-o docs] [--fit]

Writes cost.json and cost.md, and pictures of each scene; a scene whose data are missing is left out.  With
--fit also fit_cost.md and fit_cost.png, the same for fitting: residual against time.  Minutes.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from numpy.typing import NDArray
from painting import CHANNELS, read_painting
from PIL import Image

from iccbrdf.brdf.fit import fit
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build.recipe import Recipe
from iccbrdf.cli.cost import machine, pictures
from iccbrdf.demo import landscape
from iccbrdf.images import Block, create_tiff, open_tiff
from iccbrdf.measure.simulation import simulate
from iccbrdf.planning import Planning
from iccbrdf.report.appearance import Appearance, predict, rms
from iccbrdf.report.cost import CostReport, measure_image, recommend
from iccbrdf.report.cost_tables import markdown
from iccbrdf.scene import environment

ROOT = Path(__file__).resolve().parent.parent
PROFILES = ROOT / "profiles"

BUDGET = 0.5
PIXELS = 1 << 21
"""Of a sample: more than either scene has."""

FITS = (("least_squares", (1, 3, 9)), ("nelder_mead", (1, 3)))
"""Solvers and numbers of starts."""
GEOMETRY_STEPS = (8, 4, 2, 1)
"""Every so many geometries are fitted to."""


@dataclass(frozen=True)
class Print:
    """A scene: an image, written to a file to be read like any other, and how it is lit and seen."""

    title: str
    image: NDArray[np.floating[Any]]
    names: tuple[str, ...]
    samples: str
    recipe: Recipe
    env: Mapping[str, float]
    shown: str
    """The way whose errors are drawn."""


def demo() -> Print:
    """The demo's print as XYZ and normals."""
    image = landscape(read_primaries(PROFILES / "landscape" / "primaries.json")).xyz
    printer = PROFILES / "fogra39_gloss"
    recipe = Recipe(read_primaries(printer / "primaries.json"), read_slopes(printer / "slopes.json"))
    env = environment("50,180", "0,0", ())
    title, shown = "the demo's relief print", "table 9 trilinear"
    return Print(title, image.device, image.names, "device", recipe, env, shown)


def painting(folder: Path) -> Print:
    """The painting as a BRDF image."""
    recipe = Recipe(read_primaries(PROFILES / "ward_painting" / "primaries.json"))
    env = environment("70,180", "0,0", ())
    image = read_painting(folder)
    return Print("a measured painting", image, CHANNELS, "real", recipe, env, "parameters at 1/2")


def measured(scene: Print) -> CostReport:
    """All ways to the proof of a scene."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "image.tif"
        height, width, _ = scene.image.shape
        with create_tiff(path, height, width, scene.names, samples=scene.samples) as sink:
            sink.write(Block(0, 0, scene.image.astype(np.float32)))
        with open_tiff(path) as source:
            return measure_image(
                Planning(source, scene.recipe),
                scene.env,
                pixels=PIXELS,
                told=lambda name: print(f"  {name}", file=sys.stderr, flush=True),
            )


def write_costs(scenes: Mapping[str, Print], folder: Path) -> None:
    """The reports of all scenes."""
    numbers: dict[str, Any] = {"machine": machine()}
    page = ["# What accuracy costs\n", f"Made by `make cost` on {machine()}.\n"]
    for name, scene in scenes.items():
        print(scene.title, file=sys.stderr)
        report = measured(scene)
        best = recommend(report.costs, budget=BUDGET)
        drawn = pictures(report, scene.title, best, BUDGET, scene.shown)
        (folder / f"cost_{name}.png").write_bytes(drawn["cost.png"])
        errors = Image.open(io.BytesIO(drawn["cost_errors.png"])).convert("RGB")
        errors.save(folder / f"cost_{name}_errors.jpg", quality=85)
        numbers[name] = {
            **report.to_dict(),
            "budget": BUDGET,
            "recommended": best.way.name if best else None,
        }
        advice = f"{best.way.name}: `{best.way.advice}`" if best else "none"
        page += [
            f"## {scene.title[0].upper()}{scene.title[1:]}\n",
            f"![Time against error, Pareto front](cost_{name}.png)\n",
            markdown(report),
            f"The cheapest way within CIEDE2000 {BUDGET:g} everywhere: {advice}\n",
            f"![Where {scene.shown} errs](cost_{name}_errors.jpg)\n",
        ]
    (folder / "cost.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    (folder / "cost.md").write_text("\n".join(page), encoding="utf-8")


# Fitting -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FitCost:
    """One way to fit the primaries of a simulated print."""

    solver: str
    starts: int
    geometries: int
    ms: float
    """Milliseconds a patch."""
    fitted: float
    """Root mean square CIEDE2000 of the readings that were fitted to."""
    all_readings: float
    """The same of all readings."""


def fit_costs() -> list[FitCost]:
    """Every solver with every number of starts and of geometries."""
    readings = simulate(0).primaries
    found = []
    for step in GEOMETRY_STEPS:
        chosen = np.arange(len(readings.theta_i)) % step == 0
        part = readings.select(list(range(len(readings.patches))), chosen)
        for solver, counts in FITS:
            for starts in counts:
                result = fit(
                    part.XYZ, part.light, part.view, part.white,
                    solver=solver, starts=starts, patches=part.patches,
                )  # fmt: skip
                computed = predict("brdf1", result.parameters, readings, as_published=False)
                dE = Appearance(readings, {"fit": computed}).differences("fit")
                ms = 1e3 * result.seconds / len(part.patches)
                found.append(
                    FitCost(solver, starts, int(chosen.sum()), ms, rms(dE[:, chosen]), rms(dE))
                )
                print(found[-1], file=sys.stderr, flush=True)
    return found


def write_fit_costs(folder: Path) -> None:
    """Table and picture of `fit_costs`."""
    found = fit_costs()
    lines = [
        "# What fitting costs",
        "",
        f"Made by `tools/make_cost.py --fit` on {machine()}: "
        "BRDF1 fitted to the primaries of a simulated print (seed 0), "
        "by the root mean square CIEDE2000 over some or all of the geometries.",
        "",
        "| solver | starts | geometries | ms a patch | rms CIEDE2000, fitted readings | all readings |",
        "|---|---:|---:|---:|---:|---:|",
        *(
            f"| {f.solver} | {f.starts} | {f.geometries} | {f.ms:.0f} | {f.fitted:.3f} "
            f"| {f.all_readings:.3f} |"
            for f in found
        ),
        "",
        "![Residual against time](fit_cost.png)",
    ]
    (folder / "fit_cost.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    numbers = json.dumps([asdict(f) for f in found], indent=1)
    (folder / "fit_cost.json").write_text(numbers + "\n", encoding="utf-8")
    figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
    sizes = sorted({f.geometries for f in found})
    for solver, counts in FITS:
        marker = "o" if solver == "least_squares" else "^"
        for starts in counts:
            line = [f for f in found if (f.solver, f.starts) == (solver, starts)]
            points = [(f.ms, f.all_readings) for f in line]
            axes.plot(*zip(*points, strict=True), f"{marker}-", label=f"{solver}, {starts}", alpha=0.8,
                      markersize=4 + 2 * starts**0.5)  # fmt: skip
            for f, point in zip(line, points, strict=True):
                axes.annotate(str(f.geometries), point, (4, 4), textcoords="offset points", fontsize=7)
    title = f"Fits of BRDF1 to {sizes[0]} to {sizes[-1]} geometries (numbers at the markers)"
    labels = {"xlabel": "milliseconds a patch", "ylabel": "rms CIEDE2000 of all readings"}
    axes.set(xscale="log", title=title, **labels)
    axes.legend(title="solver, starts")
    axes.grid(alpha=0.3)
    figure.savefig(folder / "fit_cost.png", dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs")
    parser.add_argument("--painting", type=Path, default=ROOT.parent / "shared" / "data" / "painting",
                        help="folder of the painting's maps")  # fmt: skip
    parser.add_argument("--fit", action="store_true", help="also what fitting costs")
    arguments = parser.parse_args()
    mpl.use("Agg")
    arguments.output.mkdir(exist_ok=True)
    scenes = {"demo": demo()}
    if arguments.painting.is_dir():
        scenes["painting"] = painting(arguments.painting)
    else:
        print(f"no painting: {arguments.painting} is missing", file=sys.stderr)
    write_costs(scenes, arguments.output)
    if arguments.fit:
        write_fit_costs(arguments.output)


if __name__ == "__main__":
    main()
