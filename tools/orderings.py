"""Which of the papers' orderings hold on simulated prints, seed by seed.

Every claim is that its first figure is below its second; shown are how often it holds, the means of the two
figures over the seeds, and the least and largest ratio of the first to the second.  The simulated prints are
not made to agree with the papers: what does not hold is shown as it is.
"""

from __future__ import annotations

import argparse

import numpy as np

from iccbrdf.build import INTERPOLATIONS, SLOPE_METHODS
from iccbrdf.measure.simulation import simulate
from iccbrdf.report import Ordering, PrintData, evaluate_print, orderings


def show(claims: list[list[Ordering]]) -> None:
    """Print one line for each claim; `claims` are those of each seed."""
    width = max(len(claim.name) for claim in claims[0])
    for same in zip(*claims, strict=True):
        lower, upper = np.array([(claim.lower, claim.upper) for claim in same]).T
        holding = sum(bool(claim.holds) for claim in same)
        ratio = lower / upper
        print(
            f"{same[0].name:<{width}}  {holding:>2} of {len(same)}  {lower.mean():6.2f} < {upper.mean():6.2f}"
            f"  ratio {ratio.min():.3f} to {ratio.max():.3f}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--scatter", type=float, default=0.01, help="as of iccbrdf simulate")
    parser.add_argument("--as-published", action="store_true", help="as of iccbrdf evaluate")
    parser.add_argument("--interpolation", choices=INTERPOLATIONS, default="smooth")
    parser.add_argument("--slope-method", choices=SLOPE_METHODS, default="affine")
    arguments = parser.parse_args()
    claims = []
    for seed in range(arguments.seeds):
        simulated = simulate(seed, scatter=arguments.scatter)
        data = PrintData(simulated.primaries, simulated.tests, simulated.slopes, simulated.colours)
        evaluation = evaluate_print(
            data,
            as_published=arguments.as_published,
            interpolation=arguments.interpolation,
            slope_method=arguments.slope_method,
        )
        claims.append(orderings(evaluation))
        print(f"seed {seed}: Wilcoxon p = {evaluation.wilcoxon.p:.2g}", flush=True)
    show(claims)


if __name__ == "__main__":
    main()
