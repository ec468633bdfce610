"""Time the two solvers on eight primaries in 68 geometries, and count the starts that reach the best.

    python tools/bench_fit.py [--random-starts 100]

The primaries are made up: the colours of profiles/fogra39_gloss with 3 per cent of noise.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.fit import SOLVERS, STARTS, fit
from iccbrdf.brdf.fit_problem import Objective
from iccbrdf.brdf.geometry import planar
from iccbrdf.brdf.models import MODELS, evaluate
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.resources import folder

Array = NDArray[np.float64]

OBJECTIVES: tuple[Objective, ...] = ("rms CIEDE2000", "mean CIEDE2000")
NOISE = 0.03
RANGES = {"kd": (0.02, 0.9), "Rd": (0.02, 0.9), "ks": (0.05, 1.0), "m": (0.1, 0.5)}
SAME = 1e-6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--random-starts", type=int, default=100)
    arguments = parser.parse_args()
    rng = np.random.default_rng(0)
    light, view = papers_geometries()
    primaries = read_primaries(folder("profiles") / "fogra39_gloss" / "primaries.json")
    truth = primaries.parameters[:8]

    print(f"{len(truth)} primaries x {len(light)} geometries, brdf1, {STARTS} starts from the data")
    noise = np.exp(rng.normal(0, NOISE, (len(truth), len(light), 1)))
    XYZ = pi_brdf("brdf1", truth, light, view) * noise
    for objective in OBJECTIVES:
        # Each solver in turn, the first run of the first warming up.
        fit(XYZ, light, view, primaries.white, objective=objective)
        seconds = {}
        for solver in SOLVERS:
            result = fit(XYZ, light, view, primaries.white, objective=objective, solver=solver)
            seconds[solver] = result.seconds
            print(
                f"  {objective}, {solver:<13} {result.seconds:7.2f} s, {result.value.mean():.4f}, "
                f"{result.agreement.mean():.0%} of the starts reach the best"
            )
        print(f"  {objective}, ratio {seconds['nelder_mead'] / seconds['least_squares']:.0f}")

    print(f"{arguments.random_starts} random starts on data without noise, share that gives the truth back")
    for model in MODELS:
        truth, starts = (random_parameters(model, count, rng) for count in (1, arguments.random_starts))
        XYZ = np.repeat(pi_brdf(model, truth, light, view), len(starts), axis=0)
        found = fit(XYZ, light, view, primaries.white, model=model, starts=starts[:, np.newaxis]).parameters
        print(f"  {model:<19} {np.mean(np.all(np.abs(found / truth - 1) < SAME, axis=-1)):.0%}")


def papers_geometries() -> tuple[Array, Array]:
    """Light and view of the papers' goniometer without normal incidence, (68, 3) each."""
    pairs = [
        (theta_i, theta_r)
        for theta_i in (15.0, 30.0, 45.0, 60.0)
        for theta_r in np.arange(-65.0, 31.0, 5.0)
        if abs(theta_r - theta_i) > 15
    ]
    theta_i, theta_r = np.array(pairs).T
    return planar(theta_i), planar(theta_r)


def pi_brdf(model: str, parameters: Array, light: Array, view: Array) -> Array:
    """Pi times the BRDF of patches, (p, g, 3)."""
    intensity = MODELS[model].intensity / light[:, 2:]
    return evaluate(model, parameters[:, np.newaxis], planar(0), light, view, intensity=intensity)


def random_parameters(model: str, count: int, rng: np.random.Generator) -> Array:
    """Parameters log-uniform in their ranges, (count, k)."""
    return np.concatenate(
        [
            np.exp(rng.uniform(*np.log(RANGES[family]), (count, width)))
            for family, width in MODELS[model].parameters
        ],
        axis=-1,
    )


if __name__ == "__main__":
    main()
