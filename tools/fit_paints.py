"""Fit the models to two measured paints, print how well they do and draw paints.png.

    python tools/fit_paints.py [--data ../shared/data] [-o docs]

The data folder holds paint/garnet_red.brdf and paint/krylon_blue.brdf, measured by the Cornell Program of
Computer Graphics.  Geometries beyond 70 degrees are left out.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt

from iccbrdf.brdf.fit import fit
from iccbrdf.brdf.fit_problem import Problem
from iccbrdf.brdf.geometry import planar
from iccbrdf.brdf.models import MODELS, evaluate
from iccbrdf.measure import Measurements, read_measurements

ROOT = Path(__file__).resolve().parent.parent
PAINTS = ("garnet_red", "krylon_blue")
MAX_ANGLE = 70
OBJECTIVES = ("rms CIEDE2000", "mean CIEDE2000")


def read_paint(data: Path, name: str) -> Measurements:
    """The measurements of a paint up to `MAX_ANGLE`."""
    paint = read_measurements(data / "paint" / f"{name}.brdf")
    return paint.select(geometries=np.maximum(paint.theta_i, np.abs(paint.theta_r)) <= MAX_ANGLE + 1e-6)


def draw(data: Path, path: Path) -> None:
    """Measured and fitted Y in the plane of incidence, a panel a paint, a colour an incidence."""
    figure, panels = plt.subplots(1, len(PAINTS), figsize=(9, 3.8), constrained_layout=True)
    for panel, name in zip(panels, PAINTS, strict=True):
        paint = read_paint(data, name)
        result = fit(paint.XYZ, paint.light, paint.view, np.array(paint.white))
        fitted = evaluate("brdf1", result.parameters[0], planar(0), paint.light, paint.view)
        # A model's value is the radiance under pi of irradiance: over the cosine it is pi times the BRDF.
        Y = fitted[:, 1] / np.cos(np.radians(paint.theta_i))
        for i, theta_i in enumerate(np.unique(paint.theta_i[paint.in_plane])[::2]):
            here = np.flatnonzero(paint.in_plane & (paint.theta_i == theta_i))
            here = here[np.argsort(paint.theta_r[here])]
            panel.semilogy(paint.theta_r[here], paint.XYZ[0, here, 1], ".", color=f"C{i}")
            panel.semilogy(paint.theta_r[here], Y[here], color=f"C{i}", label=f"{theta_i:.0f}")
        panel.set(title=name.replace("_", " "), xlabel="theta_r, degrees; the mirror direction is -theta_i")
        panel.legend(title="theta_i", fontsize=8)
    panels[0].set_ylabel("Y of pi times the BRDF: measured (dots), BRDF1")
    figure.savefig(path, dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs")
    arguments = parser.parse_args()
    mpl.use("Agg")
    draw(arguments.data, arguments.output / "paints.png")
    print(
        f"{'paint':<12} {'model':<19} {'objective':<15} {'dE mean':>7} {'median':>6} {'90 %':>6}"
        f" {'|log10 Y|':>9} {'90 %':>5} {'s':>5}  parameters, flags"
    )
    for paint in PAINTS:
        data = read_paint(arguments.data, paint)
        arrays = data.XYZ, data.light, data.view, np.array(data.white)
        for model in MODELS:
            for objective in OBJECTIVES:
                result = fit(*arrays, model=model, objective=objective)
                problem = Problem(MODELS[model], *arrays, objective, result.refractive_index.item(), False)
                fitted = problem.predict(result.parameters)
                difference = problem.colour_differences(data.XYZ, fitted)
                ratio = np.abs(np.log10(data.XYZ[..., 1] / fitted[..., 1]))
                flags = ", ".join(flag.check.name for flag in result.flags[0]) or "no flags"
                print(
                    f"{paint:<12} {model:<19} {objective:<15} {difference.mean():7.2f}"
                    f" {np.median(difference):6.2f} {np.quantile(difference, 0.9):6.2f}"
                    f" {np.median(ratio):9.3f} {np.quantile(ratio, 0.9):5.3f} {result.seconds:5.2f}"
                    f"  {' '.join(f'{value:.3g}' for value in result.parameters[0])}, {flags}"
                )


if __name__ == "__main__":
    main()
