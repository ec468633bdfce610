"""The experiments as tables, for people and for JSON, with the papers' figures beside ours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from iccbrdf.brdf.fit_diagnostics import REGIONS
from iccbrdf.report import papers
from iccbrdf.report.appearance import MEASURED, Appearance, largest, mean, rms
from iccbrdf.report.evaluation import FITS_2023, INTERPOLATED, OPTIMISED, Evaluation

MODEL_NAMES = {"cook_torrance_2020": "Cook-Torrance", "ward": "Ward"}
_CELL = 14
_REGION_COLUMNS = tuple(
    f"{name.removesuffix('-specular')} {what}" for what in ("mean", "max") for name in REGIONS
)


@dataclass(frozen=True)
class Row:
    """Figures of ours and, where it has them, of the paper."""

    label: str
    ours: tuple[float, ...]
    """NaN where nothing was measured."""
    paper: tuple[float | None, ...] = ()
    """As many as `ours`, or none."""


@dataclass(frozen=True)
class Table:
    """One table of an evaluation."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()
    digits: int = 2
    """Decimals of the text."""

    def to_dict(self) -> dict[str, Any]:
        """Return the table ready for JSON, in which NaN is null."""
        return {
            "title": self.title,
            "columns": list(self.columns),
            "rows": [
                {
                    "label": row.label,
                    "ours": [value if np.isfinite(value) else None for value in row.ours],
                    "paper": list(row.paper) if row.paper else None,
                }
                for row in self.rows
            ],
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        width = max(len(row.label) for row in self.rows)
        lines = [self.title, " " * width + "".join(f"{column:>{_CELL}}" for column in self.columns)]
        for row in self.rows:
            published = row.paper or (None,) * len(row.ours)
            cells = [self._cell(*pair) for pair in zip(row.ours, published, strict=True)]
            lines.append(f"{row.label:<{width}}" + "".join(f"{cell:>{_CELL}}" for cell in cells))
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])

    def _cell(self, ours: float, published: float | None) -> str:
        value = f"{ours:.{self.digits}f}" if np.isfinite(ours) else "-"
        return f"{value} ({published:.{self.digits}f})" if published is not None else value


def tables(evaluation: Evaluation) -> list[Table]:
    """Return all tables of an evaluation, in the order of the papers."""
    return [
        _overall(evaluation),
        _primaries_specular(evaluation),
        _tests_specular(evaluation),
        _tests_diffuse(evaluation),
        _chromaticity(evaluation),
        _flat_against_slope(evaluation),
        _fits(evaluation),
        _by_slope(evaluation),
        _interpolation(evaluation),
    ]


def histograms(slopes: Appearance) -> dict[str, list[float]]:
    """Return `edges`, half a CIEDE2000 apart, and the numbers of readings between them for IB and AIB."""
    differences = {source: slopes.differences(source) for source in ("IB", "AIB")}
    edges = np.arange(0, max(largest(values) for values in differences.values()) + 0.5, 0.5)
    counts = {source: np.histogram(values, edges)[0].tolist() for source, values in differences.items()}
    return {"edges": edges.tolist(), **counts}


def by_rmsd(appearance: Appearance, source: str) -> list[int]:
    """Return the patches from the least to the largest rms difference of specular Y from the measured."""
    return ranked([rms(patch) for patch in appearance.specular_errors(source)])


def ranked(values: Sequence[float]) -> list[int]:
    """Return the places of values from the least to the largest, of those that are known."""
    order = np.argsort(values)
    return [int(place) for place in order if np.isfinite(values[place])]


def _overall(evaluation: Evaluation) -> Table:
    rows = []
    for model, found in evaluation.models.items():
        ours = (
            mean(found.primaries.differences(OPTIMISED)),
            mean(found.tests.differences(OPTIMISED)),
            mean(found.tests.differences(INTERPOLATED)),
        )
        rows.append(Row(MODEL_NAMES[model], ours, (papers.MEAN_CIEDE2000[model], None, None)))
    return Table(
        "2020, mean CIEDE2000 of all readings",
        ("primaries", "tests opt.", "tests interp."),
        tuple(rows),
        ("The paper's overall mean is taken to be that of the primaries.",),
    )


def _primaries_specular(evaluation: Evaluation) -> Table:
    appearances = [found.primaries for found in evaluation.models.values()]
    errors = [[rms(patch) for patch in each.specular_errors(OPTIMISED)] for each in appearances]
    names = appearances[0].measurements.patches
    return Table(
        "2020, RMSD of the primaries' specular Y, optimised",
        tuple(MODEL_NAMES[model] for model in evaluation.models),
        tuple(Row(name, tuple(pair)) for name, *pair in zip(names, *errors, strict=True)),
    )


def _tests_specular(evaluation: Evaluation) -> Table:
    rows, notes = [], []
    for model, found in evaluation.models.items():
        angles = found.tests.mirror_angles
        for source in (INTERPOLATED, OPTIMISED):
            errors = found.tests.specular_errors(source)
            published = _at(angles, papers.SPECULAR_RMSD[model, source])
            label = f"{MODEL_NAMES[model]} {source}"
            rows.append(Row(label, tuple(rms(column) for column in errors.T), published))
        ordered = by_rmsd(found.tests, INTERPOLATED)
        names = found.tests.measurements.patches
        median, worst = names[ordered[len(ordered) // 2]], names[ordered[-1]]
        notes.append(f"{MODEL_NAMES[model]} interpolated: median {median}, worst {worst}.")
    return Table(
        "2020, Table 1: RMSD of the test patches' specular Y, by theta_i",
        tuple(f"{angle:g}" for angle in angles),
        tuple(rows),
        tuple(notes),
    )


def _tests_diffuse(evaluation: Evaluation) -> Table:
    rows = []
    for (source, reference), published in papers.DIFFUSE_CIEDE2000.items():
        ours = [found.tests.by_region(source, reference)[0][0] for found in evaluation.models.values()]
        rows.append(
            Row(f"{source} - {reference}", tuple(ours), tuple(published[m] for m in evaluation.models))
        )
    return Table(
        "2020, Table 2: mean diffuse CIEDE2000 of the test patches",
        tuple(MODEL_NAMES[model] for model in evaluation.models),
        tuple(rows),
    )


def _chromaticity(evaluation: Evaluation) -> Table:
    rows = []
    for model, found in evaluation.models.items():
        for source in (MEASURED, OPTIMISED, INTERPOLATED):
            xy = [found.tests.chromaticity(source, region) for region in ("diffuse", "specular")]
            means = tuple(mean(column) for each in xy for column in each.T)
            rows.append(Row(f"{MODEL_NAMES[model]} {source}", means))
    return Table(
        "2020, mean chromaticity of the test patches",
        ("diffuse x", "y", "specular x", "y"),
        tuple(rows),
        digits=3,
    )


def _flat_against_slope(evaluation: Evaluation) -> Table:
    found = evaluation.slope_colours
    rows = []
    for name, values in (("before", found.before), ("after", found.after)):
        published = _at(found.angles, papers.FLAT_AGAINST_SLOPE[name])
        rows.append(Row(f"{name}, mean", tuple(mean(slope) for slope in values), published))
    for name, values in (("before", found.before), ("after", found.after)):
        rows.append(Row(f"{name}, max", tuple(largest(slope) for slope in values)))
    return Table(
        f"2023, Table I: CIEDE2000 of {len(found.patches)} patches, flat against slope, by slope",
        tuple(f"{angle:g}" for angle in found.angles),
        tuple(rows),
        (_rule("before", rows[0], "after", rows[1], [f"{angle:g} degrees" for angle in found.angles]),),
    )


def _fits(evaluation: Evaluation) -> Table:
    appearance = evaluation.fits
    rows = []
    for source in FITS_2023:
        for p, name in enumerate(appearance.measurements.patches):
            rows.append(Row(f"{source} {name}", _joined(appearance.select([p]).by_region(source))))
        published = tuple(papers.FITS[source][region] for region in REGIONS)
        ours = _joined(appearance.by_region(source))
        rows.append(Row(f"{source} all", ours, (*published, *[None] * len(REGIONS))))
    return Table("2023, Table II: CIEDE2000 of the primaries", _REGION_COLUMNS, tuple(rows))


def _by_slope(evaluation: Evaluation) -> Table:
    appearance = evaluation.slopes
    printed = appearance.measurements.keys
    rows, notes = [], []
    for angle in evaluation.slope_colours.angles:
        one = appearance.select([p for p, (_, slope) in enumerate(printed) if slope == angle])
        pair = [Row(f"{angle:g} degrees {name}", _joined(one.by_region(name))) for name in ("IB", "AIB")]
        rows += pair
        notes.append(f"{angle:g} degrees: {_rule('IB', pair[0], 'AIB', pair[1], _REGION_COLUMNS[:3])}")
    return Table(
        "2023, Table III: CIEDE2000 of the test patches on slopes", _REGION_COLUMNS, tuple(rows), tuple(notes)
    )


def _interpolation(evaluation: Evaluation) -> Table:
    rows = []
    for source in ("IB", "AIB"):
        differences = evaluation.slopes.differences(source)
        known = differences[np.isfinite(differences)]
        ours = (mean(known), float(np.median(known)), largest(known))
        rows.append(Row(source, ours, papers.INTERPOLATION[source]))
    test = evaluation.wilcoxon
    return Table(
        "2023, Table IV: CIEDE2000 of the test patches on all slopes",
        ("mean", "median", "max"),
        tuple(rows),
        (
            _rule("IB", rows[0], "AIB", rows[1], ["mean", "median"]),
            f"Wilcoxon signed-rank test of the means by patch and slope: {test.pairs} pairs, "
            f"W = {test.statistic:g}, p = {test.p:.2g}.",
        ),
    )


def _joined(mean_and_largest: tuple[Any, Any]) -> tuple[float, ...]:
    return tuple(float(value) for values in mean_and_largest for value in values)


def _at(angles: Any, published: tuple[float, ...]) -> tuple[float | None, ...]:
    """The paper's figures at our angles, None where it has none."""
    known = dict(zip(papers.ANGLES, published, strict=True))
    return tuple(known.get(float(angle)) for angle in angles)


def _rule(first: str, one: Row, second: str, other: Row, names: Sequence[str]) -> str:
    """Which of two rows is better by the paper's rule of significance."""
    verdicts: dict[str, list[str]] = {}
    for name, a, b in zip(names, one.ours, other.ours, strict=False):
        if not np.isfinite(a + b):
            continue
        threshold = papers.significant_difference(max(a, b))
        if threshold is None:
            verdict = "beyond the rule"
        elif abs(a - b) < threshold:
            verdict = "no significant difference"
        else:
            verdict = f"{second if b < a else first} significantly better"
        verdicts.setdefault(verdict, []).append(name)
    return "; ".join(f"{verdict}: {', '.join(where)}" for verdict, where in verdicts.items()) + "."
