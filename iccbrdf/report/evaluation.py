"""The experiments of the two papers, on any print that was measured as theirs were.

[Habib2020]: 8 primaries, the eighth CMY; test patches without K; Cook-Torrance and Ward; every patch as
measured, as its own fit has it (optimised) and as interpolated between the fits of the primaries.

[Habib2023]: 8 primaries, the eighth K; all test patches, on slopes; the colour of the flat patch adjusted to
the slope; BRDF interpolated from the flat colour (IB) and from the adjusted one (AIB).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.fit import fit
from iccbrdf.brdf.fit_problem import Objective
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.interpolation import InterpolationMethod, interpolate
from iccbrdf.brdf.primaries import Primaries, Primary
from iccbrdf.brdf.slopes import SlopeMethod, slope_adjust
from iccbrdf.measure import Measurements
from iccbrdf.report.appearance import Appearance, mean, predict
from iccbrdf.report.print_data import NODES_2020, NODES_2023, PrintData, at_45_0, rows

MODELS_2020 = ("cook_torrance_2020", "ward")
OPTIMISED, INTERPOLATED = "optimised", "interpolated"

FITS_2023: dict[str, tuple[str, Objective]] = {
    "BRDF1 CD": ("brdf1", "mean CIEDE2000"),
    "BRDF1 RMSE": ("brdf1", "rms XYZ"),
    "BRDF2 CD": ("brdf2", "mean CIEDE2000"),
}
"""Model and objective of the fits that the paper compares."""

_OBJECTIVE: Objective = "mean CIEDE2000"


@dataclass(frozen=True, eq=False)
class ModelEvaluation:
    """One model of [Habib2020]."""

    primaries: Appearance
    """Measured and `OPTIMISED`."""
    tests: Appearance
    """Patches without K, measured, `OPTIMISED` and `INTERPOLATED`."""


@dataclass(frozen=True, eq=False)
class SlopeColours:
    """Colours at 45:0 of the flat print against those on slopes, [Habib2023], Table I."""

    patches: tuple[str, ...]
    angles: Array
    """Slopes in degrees, (s,)."""
    before: Array
    """CIEDE2000 of the flat colour against the one on the slope, (s, patches)."""
    after: Array
    """The same of the flat colour adjusted to the slope."""


@dataclass(frozen=True)
class Wilcoxon:
    """The signed-rank test of IB against AIB."""

    pairs: int
    statistic: float
    p: float


@dataclass(frozen=True, eq=False)
class Evaluation:
    """All experiments on one print."""

    models: dict[str, ModelEvaluation]
    """By `MODELS_2020`."""
    slope_colours: SlopeColours
    fits: Appearance
    """Primaries, measured and by `FITS_2023`."""
    slopes: Appearance
    """Test patches on slopes, measured, "IB" and "AIB"."""
    wilcoxon: Wilcoxon
    """Of the means of each patch on each slope: the readings of one patch do not vary independently."""


def evaluate_print(
    data: PrintData,
    *,
    as_published: bool = False,
    interpolation: InterpolationMethod = "smooth",
    slope_method: SlopeMethod = "affine",
) -> Evaluation:
    """
    Run the experiments of both papers.

    Parameters
    ----------
    data
        Measurements of a print.
    as_published
        Fit the models' I, cosine included, to the measured reflectance, as the papers do; otherwise compare
        the same quantity of both.
    interpolation
        From colours to parameters: `smooth`, or `published`.
    slope_method
        From a flat colour to the one on a slope: `affine`, or `published`.

    Raises
    ------
    InputError
        A patch was measured in too few geometries, or primaries coincide.
    """
    nodes = data.primaries.select(rows(data.primaries, NODES_2023))
    fits = {
        name: _fitted(nodes, model, objective, as_published) for name, (model, objective) in FITS_2023.items()
    }
    computed = {
        name: predict(FITS_2023[name][0], parameters, nodes, as_published=as_published)
        for name, parameters in fits.items()
    }
    primaries = fitted_primaries(nodes, "brdf1", fits["BRDF1 CD"])
    slopes = _on_slopes(data, primaries, interpolation, slope_method, as_published)
    return Evaluation(
        models={model: _evaluate_2020(data, model, interpolation, as_published) for model in MODELS_2020},
        slope_colours=_slope_colours(data, slope_method),
        fits=Appearance(nodes, computed),
        slopes=slopes,
        wilcoxon=_wilcoxon(slopes),
    )


def _evaluate_2020(
    data: PrintData, model: str, interpolation: InterpolationMethod, as_published: bool
) -> ModelEvaluation:
    nodes = data.primaries.select(rows(data.primaries, NODES_2020))
    tests = data.tests_without_K
    of_nodes = _fitted(nodes, model, _OBJECTIVE, as_published)
    primaries = fitted_primaries(nodes, model, of_nodes)
    parameters = {
        OPTIMISED: _fitted(tests, model, _OBJECTIVE, as_published),
        INTERPOLATED: interpolate(at_45_0(tests), primaries, method=interpolation),
    }
    return ModelEvaluation(
        Appearance(nodes, {OPTIMISED: predict(model, of_nodes, nodes, as_published=as_published)}),
        Appearance(
            tests,
            {
                name: predict(model, values, tests, as_published=as_published)
                for name, values in parameters.items()
            },
        ),
    )


def _slope_colours(data: PrintData, method: SlopeMethod) -> SlopeColours:
    flat = np.concatenate([at_45_0(data.primaries)[rows(data.primaries, NODES_2023)], at_45_0(data.tests)])
    names = (*NODES_2023, *data.tests.patches)
    angles = data.colours.angles[1:]
    printed = np.stack([at_45_0(data.slopes)[rows(data.slopes, names, angle)] for angle in angles])
    adjusted = slope_adjust(flat, angles[:, np.newaxis], data.colours, method=method)
    on_slope, *others = (XYZ_to_Lab(XYZ, data.colours.white) for XYZ in (printed, flat, adjusted))
    before, after = (delta_E_CIE2000(Lab, on_slope) for Lab in others)
    return SlopeColours(names, angles, before, after)


def _on_slopes(
    data: PrintData,
    primaries: Primaries,
    interpolation: InterpolationMethod,
    slope_method: SlopeMethod,
    as_published: bool,
) -> Appearance:
    """The test patches on each slope in turn."""
    angles, flat = data.colours.angles[1:], at_45_0(data.tests)
    places = [row for angle in angles for row in rows(data.slopes, data.tests.patches, angle)]
    printed = data.slopes.select(places)
    steepness = np.repeat(angles, len(flat))
    colours = np.tile(flat, (len(angles), 1))
    adjusted = slope_adjust(colours, steepness, data.colours, method=slope_method)
    return Appearance(
        printed,
        {
            name: predict(
                primaries.model,
                interpolate(XYZ, primaries, method=interpolation),
                printed,
                as_published=as_published,
            )
            for name, XYZ in (("IB", colours), ("AIB", adjusted))
        },
    )


def _fitted(measured: Measurements, model: str, objective: Objective, as_published: bool) -> Array:
    """Parameters of the model for each patch, (patches, k)."""
    return fit(
        measured.XYZ,
        measured.light,
        measured.view,
        measured.white,
        model=model,
        objective=objective,
        as_published=as_published,
        patches=measured.patches,
    ).parameters


def fitted_primaries(measured: Measurements, model: str, parameters: Array) -> Primaries:
    """Return measured patches with the parameters (patches, k) fitted to them, their XYZ at 45:0."""
    entries = zip(measured.patches, at_45_0(measured).tolist(), parameters.tolist(), strict=True)
    return Primaries(
        model=model,
        illuminant=measured.illuminant,
        observer=measured.observer,
        white=measured.white,
        geometry="45:0",
        source=measured.source,
        primaries=tuple(Primary(name, tuple(XYZ), tuple(values)) for name, XYZ, values in entries),
    )


def _wilcoxon(slopes: Appearance) -> Wilcoxon:
    # Takes half a second to import.
    from scipy.stats import wilcoxon

    IB, AIB = (np.array([mean(patch) for patch in slopes.differences(name)]) for name in ("IB", "AIB"))
    paired = np.isfinite(IB) & np.isfinite(AIB)
    if np.array_equal(IB[paired], AIB[paired]):
        return Wilcoxon(int(paired.sum()), 0.0, 1.0)
    found = wilcoxon(IB[paired], AIB[paired])
    return Wilcoxon(int(paired.sum()), float(found.statistic), float(found.pvalue))
