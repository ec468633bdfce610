"""Figures that the papers print, to stand beside ours; their measurements are not public.

References
----------
-   [Habib2020] T. Habib, P. Green, P. Nussbaum: BRDF rendering by interpolation of optimised model
    parameters. Color and Imaging Conference 28, 2020.
-   [Habib2023] T. Habib, P. Green, P. Nussbaum: An appearance reproduction framework for printed 3D
    surfaces. Journal of Imaging Science and Technology, 2023.
"""

from __future__ import annotations

ANGLES = (15.0, 30.0, 45.0, 60.0)
"""Degrees, of incidence in 2020 and of the slopes in 2023."""

MEAN_CIEDE2000 = {"cook_torrance_2020": 6.5, "ward": 6.79}
"""[Habib2020], text: overall mean by model."""

SPECULAR_RMSD = {
    ("cook_torrance_2020", "interpolated"): (0.48, 0.37, 0.66, 2.24),
    ("cook_torrance_2020", "optimised"): (0.82, 0.66, 0.54, 1.61),
    ("ward", "interpolated"): (0.72, 0.57, 0.62, 2.03),
    ("ward", "optimised"): (0.70, 0.58, 0.68, 2.07),
}
"""[Habib2020], Table 1: root mean square difference of specular Y from the reference, at `ANGLES`."""

DIFFUSE_CIEDE2000 = {
    ("interpolated", "measured"): {"cook_torrance_2020": 5.02, "ward": 5.09},
    ("optimised", "measured"): {"cook_torrance_2020": 4.74, "ward": 4.85},
    ("optimised", "interpolated"): {"cook_torrance_2020": 1.17, "ward": 1.11},
}
"""[Habib2020], Table 2: mean of the diffuse readings."""

FLAT_AGAINST_SLOPE = {"before": (1.14, 2.35, 6.45, 4.86), "after": (0.95, 1.50, 3.66, 3.15)}
"""[Habib2023], Table I: mean CIEDE2000 before and after adjustment, at `ANGLES`."""

FITS = {
    "BRDF1 CD": {"diffuse": 5.67, "near-specular": 2.78, "specular": 3.80},
    "BRDF1 RMSE": {"diffuse": 8.52, "near-specular": 4.56, "specular": 2.37},
    "BRDF2 CD": {"diffuse": 5.14, "near-specular": 2.64, "specular": 2.36},
}
"""[Habib2023], Table II: mean CIEDE2000 over the primaries."""

INTERPOLATION = {"IB": (4.39, 4.46, 18.97), "AIB": (3.95, 3.84, 14.23)}
"""[Habib2023], Table IV: mean, median and largest CIEDE2000."""


def significant_difference(level: float) -> float | None:
    """
    Return the difference of two CIEDE2000 that counts as significant, by the rule of [Habib2023].

    Parameters
    ----------
    level
        The larger of the two.

    Returns
    -------
    1 below 5, 2 from 5 to 10; None above, of which the rule does not speak.

    Examples
    --------
    >>> significant_difference(4.9), significant_difference(5), significant_difference(11)
    (1.0, 2.0, None)
    """
    if level < 5:
        return 1.0
    return 2.0 if level <= 10 else None
