"""Which interpolation of BRDF parameters comes nearer to patches that were not fitted, on simulated prints.

    python tools/compare_interpolations.py [--seeds 20]

For every simulated print the nine primaries are fitted, and the 15 flat test patches are computed by either
method from their XYZ at 45:0.  Shown are the mean CIEDE2000 to the simulated readings by region, the means of
both over the seeds, and on how many prints the smooth method is the nearer one.
"""

from __future__ import annotations

import argparse

import numpy as np

from iccbrdf.brdf.fit import fit
from iccbrdf.brdf.fit_diagnostics import REGIONS
from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.build import INTERPOLATIONS
from iccbrdf.measure.simulation import simulate
from iccbrdf.report.appearance import Appearance, predict
from iccbrdf.report.evaluation import fitted_primaries
from iccbrdf.report.print_data import at_45_0


def errors(seed: int) -> np.ndarray:
    """Mean CIEDE2000 of the test patches of one print, (methods, regions)."""
    simulated = simulate(seed)
    nodes, tests = simulated.primaries, simulated.tests
    parameters = fit(nodes.XYZ, nodes.light, nodes.view, nodes.white, patches=nodes.patches).parameters
    primaries = fitted_primaries(nodes, "brdf1", parameters)
    XYZ = at_45_0(tests)
    computed = {
        method: predict("brdf1", interpolate(XYZ, primaries, method=method), tests, as_published=False)
        for method in INTERPOLATIONS
    }
    appearance = Appearance(tests, computed)
    return np.array([appearance.by_region(method)[0] for method in INTERPOLATIONS])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    arguments = parser.parse_args()
    found = np.stack([errors(seed) for seed in range(arguments.seeds)])
    smooth, published = (found[:, INTERPOLATIONS.index(method)] for method in ("smooth", "published"))
    for i, region in enumerate(REGIONS):
        nearer = np.count_nonzero(smooth[:, i] < published[:, i])
        print(
            f"{region:<14} smooth {smooth[:, i].mean():.2f}, published {published[:, i].mean():.2f}; "
            f"smooth nearer on {nearer} of {len(found)}"
        )


if __name__ == "__main__":
    main()
