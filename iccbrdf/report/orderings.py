"""Which of two methods is better, on the print at hand and in the papers.

References
----------
-   [Habib2020], [Habib2023]: as of `iccbrdf.report`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from iccbrdf.brdf.fit_diagnostics import REGIONS
from iccbrdf.report.appearance import largest, mean
from iccbrdf.report.evaluation import INTERPOLATED, OPTIMISED, Evaluation

LARGE_GAIN = 0.05
"""Of the mean CIEDE2000, relative: what a model with more parameters must gain to be worth them."""


@dataclass(frozen=True)
class Ordering:
    """A claim that one figure is below another one."""

    name: str
    lower: float
    upper: float

    @property
    def holds(self) -> bool | None:
        """None where one of them could not be measured."""
        return self.lower < self.upper if np.isfinite(self.lower + self.upper) else None

    def to_dict(self) -> dict[str, Any]:
        """Return the claim ready for JSON, in which NaN is null."""
        lower, upper = (value if np.isfinite(value) else None for value in (self.lower, self.upper))
        return {"name": self.name, "lower": lower, "upper": upper, "holds": self.holds}

    def __str__(self) -> str:
        verdict = {True: "holds", False: "fails", None: "-"}[self.holds]
        return f"{verdict:<6} {self.name}: {self.lower:.3f}, {self.upper:.3f}"


def orderings(evaluation: Evaluation) -> list[Ordering]:
    """
    Return the papers' orderings with our figures, CIEDE2000.

    That BRDF2 brings no large gain is written as: BRDF1 less `LARGE_GAIN` is below BRDF2, in the mean of all
    readings.
    """
    fits = {source: evaluation.fits.by_region(source) for source in evaluation.fits.computed}
    (cd_mean, cd_max), (rmse_mean, rmse_max) = fits["BRDF1 CD"], fits["BRDF1 RMSE"]
    diffuse, near, specular = range(len(REGIONS))
    overall = {source: mean(evaluation.fits.differences(source)) for source in evaluation.fits.computed}
    IB, AIB = (evaluation.slopes.differences(source) for source in ("IB", "AIB"))
    IB_diffuse, AIB_diffuse = (float(evaluation.slopes.by_region(s)[0][diffuse]) for s in ("IB", "AIB"))
    colours = evaluation.slope_colours
    claims = [
        Ordering("diffuse mean: CD < RMSE", cd_mean[diffuse], rmse_mean[diffuse]),
        Ordering("diffuse max: CD < RMSE", cd_max[diffuse], rmse_max[diffuse]),
        Ordering("near-specular mean: CD < RMSE", cd_mean[near], rmse_mean[near]),
        Ordering("near-specular max: CD < RMSE", cd_max[near], rmse_max[near]),
        Ordering("specular mean: RMSE < CD", rmse_mean[specular], cd_mean[specular]),
        Ordering("mean: BRDF2 no large gain", (1 - LARGE_GAIN) * overall["BRDF1 CD"], overall["BRDF2 CD"]),
        Ordering("diffuse mean: AIB < IB", AIB_diffuse, IB_diffuse),
        Ordering("mean: AIB < IB", mean(AIB), mean(IB)),
        Ordering("max: AIB < IB", largest(AIB), largest(IB)),
        *(
            Ordering(f"slope {angle:g} mean: adjusted < flat", mean(after), mean(before))
            for angle, before, after in zip(colours.angles, colours.before, colours.after, strict=True)
        ),
    ]
    cook_torrance, ward = (evaluation.models[model] for model in ("cook_torrance_2020", "ward"))
    claims.append(
        Ordering(
            "2020 mean: Cook-Torrance < Ward",
            mean(cook_torrance.primaries.differences(OPTIMISED)),
            mean(ward.primaries.differences(OPTIMISED)),
        )
    )
    for name, found in (("Cook-Torrance", cook_torrance), ("Ward", ward)):
        lower, upper = (found.tests.by_region(s)[0][diffuse] for s in (OPTIMISED, INTERPOLATED))
        claims.append(Ordering(f"2020 diffuse mean, {name}: optimised < interpolated", lower, upper))
    return [Ordering(claim.name, float(claim.lower), float(claim.upper)) for claim in claims]
