"""Fit the models to two measured paints and print how well they do.

    python tools/fit_paints.py [--data ../shared/data]

The data folder holds paint/garnet_red.brdf and paint/krylon_blue.brdf, measured by the Cornell Program of
Computer Graphics.  Geometries beyond 70 degrees are left out.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from iccbrdf.brdf.fit import fit
from iccbrdf.brdf.fit_problem import Problem
from iccbrdf.brdf.models import MODELS
from iccbrdf.measure import read_measurements

ROOT = Path(__file__).resolve().parent.parent
PAINTS = ("garnet_red", "krylon_blue")
MAX_ANGLE = 70
OBJECTIVES = ("rms CIEDE2000", "mean CIEDE2000")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    arguments = parser.parse_args()
    print(
        f"{'paint':<12} {'model':<19} {'objective':<15} {'dE mean':>7} {'median':>6} {'90 %':>6}"
        f" {'|log10 Y|':>9} {'90 %':>5} {'s':>5}  parameters, flags"
    )
    for paint in PAINTS:
        data = read_measurements(arguments.data / "paint" / f"{paint}.brdf")
        data = data.select(geometries=np.maximum(data.theta_i, np.abs(data.theta_r)) <= MAX_ANGLE + 1e-6)
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
