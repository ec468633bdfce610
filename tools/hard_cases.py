"""How models and colour MIDs stand hard cases, in every back end and number type, on millions of samples.

    python tools/hard_cases.py [--samples 20000000] [--seed 1] [-o docs]

The cases are those of tests/hard_examples.py.  Writes hard_cases.md, tables, and hard_cases.png, an error
map; ends with 1 where a result is not finite or float32 breaks a promise.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise, product
from pathlib import Path
from typing import TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests"))

from hard_examples import (  # noqa: E402  (which lies in tests)
    BACKENDS,
    COLOUR_MIDS,
    DTYPES,
    GRAZING,
    LEAST_COSINE,
    NOTHING_LEFT,
    PRIMARIES,
    PROMISES,
    SLOPES,
    Array,
    Look,
    Promise,
    colours,
    held_index,
    is_beside_switch,
    looks,
    on_slopes,
    promised,
    relative_error,
)

import iccbrdf  # noqa: E402
from iccbrdf.brdf.models import MODELS, evaluate  # noqa: E402
from iccbrdf.build import build_colour_mid  # noqa: E402
from iccbrdf.build.pair import GEOMETRIES  # noqa: E402

PRINTS, ANYTHING = 1800, 450
"""Pixels for each light and viewer."""

COLOURS = 10_000
"""Colours at a time."""

OF_COLOURS = 0.1
"""The share of the samples that colour MIDs get."""

DOUBLE = (BACKENDS[-1], "float64")
SINGLE = (BACKENDS[-1], "float32")

LOG_ERRORS = np.linspace(-9, 3, 1201)
"""Bins of a histogram of log10 of errors, from which quantiles are read."""

M_ENDS = (1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0)
"""Between these lie the classes of m."""

LOG_M, LOG_COSINES = np.linspace(-4, 0, 49), np.linspace(-7, 0, 57)
"""Cells of the error map."""


@dataclass
class Errors:
    """Relative errors of a class of samples: a histogram and the largest."""

    histogram: NDArray[np.int64] = field(default_factory=lambda: np.zeros(len(LOG_ERRORS), np.int64))
    largest: float = 0.0

    def add(self, errors: Array) -> None:
        self.largest = max(self.largest, float(np.max(errors, initial=0)))
        logs = np.log10(np.clip(errors, 10 ** LOG_ERRORS[0], 10 ** LOG_ERRORS[-2]))
        self.histogram += np.bincount(np.searchsorted(LOG_ERRORS, logs), minlength=len(LOG_ERRORS))

    def quantile(self, share: float) -> float:
        """The error that this share does not exceed."""
        counts = np.cumsum(self.histogram)
        return float(10 ** LOG_ERRORS[int(np.argmax(counts >= share * counts[-1]))])


Both: TypeAlias = tuple[Errors, Errors]
"""Ours and those of the printed formulas."""


@dataclass
class Findings:
    """What hard cases show of a model or a colour MID."""

    name: str
    samples: int = 0
    not_finite: int = 0
    broken: int = 0
    """Samples beyond what is promised."""
    between_back_ends: dict[str, float] = field(default_factory=lambda: dict.fromkeys(DTYPES, 0.0))
    from_reference: float = 0.0


@dataclass
class ErrorMap:
    """Errors of all models by promise and by cell of m and cosine, ours and of the printed formulas."""

    geometry: str
    by_promise: dict[Promise, Both] = field(
        default_factory=lambda: {promise: (Errors(), Errors()) for promise in PROMISES}
    )
    by_m: dict[tuple[float, float], Both] = field(
        default_factory=lambda: {ends: (Errors(), Errors()) for ends in pairwise(M_ENDS)}
    )
    """For cosines from .1."""
    grazing: dict[Promise, float] = field(default_factory=lambda: dict.fromkeys(PROMISES, 0.0))
    """The largest error below the least cosine, divided by what the promise grows by there."""
    cells: NDArray[np.float64] = field(
        default_factory=lambda: np.zeros((2, len(LOG_M) - 1, len(LOG_COSINES) - 1))
    )

    def add(self, m: Array, cosine: Array, ours: Array, printed: Array) -> None:
        classes = [
            *(
                ((m >= p.least_m) & (cosine >= p.from_cosine(self.geometry)), both)
                for p, both in self.by_promise.items()
            ),
            *(((m >= low) & (m < high) & (cosine >= 0.1), both) for (low, high), both in self.by_m.items()),
        ]
        for of, both in classes:
            for kept, values in zip(both, (ours, printed), strict=True):
                kept.add(values[of])
        for promise in PROMISES:
            bound = promised(m, cosine, self.geometry)
            low = (m >= promise.least_m) & (cosine < promise.least_cosine) & np.isfinite(bound)
            scaled = np.max(ours * cosine / promise.least_cosine, where=low, initial=0)
            self.grazing[promise] = max(self.grazing[promise], float(scaled))
        cell = tuple(
            np.clip(np.searchsorted(edges, np.log10(values)) - 1, 0, len(edges) - 2)
            for edges, values in ((LOG_M, m), (LOG_COSINES, cosine))
        )
        for part, values in zip(self.cells, (ours, printed), strict=True):
            np.maximum.at(part, cell, np.minimum(values, 1e3))


def examine(model: str, geometry: str, samples: int, seed: int, errors: ErrorMap) -> Findings:
    """A model under lights and viewers of every kind."""
    findings = Findings(f"{model}, {geometry}")
    count = -(-samples // (PRINTS + ANYTHING))
    for look in looks(model, geometry, count, PRINTS, ANYTHING, seed):
        findings.samples += len(look.pixels)
        findings.not_finite += sum(int(np.sum(~np.isfinite(XYZ))) for XYZ in look.XYZ.values())
        for dtype in DTYPES:
            expected = look.of_prints("interpreter", dtype)
            differences = [relative_error(look.of_prints(b, dtype), expected).max() for b in BACKENDS]
            findings.between_back_ends[dtype] = max(findings.between_back_ends[dtype], *differences)
        findings.from_reference = max(findings.from_reference, _from_reference(look))
        bound = look.promised
        exact = look.of_prints(*DOUBLE)
        for backend in BACKENDS:
            error = relative_error(look.of_prints(backend, "float32"), exact)
            findings.broken += int(np.sum(error > bound))
        used = np.broadcast_to(look.cosine >= LEAST_COSINE, exact.shape)
        errors.add(
            look.m[used],
            np.broadcast_to(look.cosine, exact.shape)[used],
            relative_error(look.of_prints(*SINGLE), exact)[used],
            relative_error(look.as_printed(), exact)[used],
        )
    return findings


def _from_reference(look: Look) -> float:
    """The largest relative difference of float64, for m from .01 and cosines from GRAZING."""
    pixels = look.printed.astype(np.float64)
    options = {"refractive_index": held_index()} if MODELS[look.model].has_fresnel else {}
    expected = evaluate(look.model, pixels[:, :-3], pixels[:, -3:], look.light, look.view, **options)
    used = (look.m >= 0.01) & (look.cosine >= GRAZING)
    return float(np.max(relative_error(look.of_prints(*DOUBLE), expected), where=used, initial=0))


def examine_colours(interpolation: str, slope_method: str, samples: int, seed: int) -> Findings:
    """A colour MID on colours and slopes of every kind."""
    findings = Findings(f"{interpolation} interpolation, {slope_method} slopes")
    mid = build_colour_mid(
        PRIMARIES, interpolation=interpolation, slopes=SLOPES, slope_method=slope_method
    ).mid
    transforms = {
        (backend, dtype): iccbrdf.link([mid], samples="real", backend=backend, dtype=dtype)
        for backend in BACKENDS
        for dtype in DTYPES
    }
    rng = np.random.default_rng(seed)
    for _ in range(-(-samples // COLOURS)):
        pixels = colours(COLOURS, rng)
        findings.samples += len(pixels)
        found = {key: transform(pixels).astype(np.float64) for key, transform in transforms.items()}
        findings.not_finite += sum(int(np.sum(~np.isfinite(parameters))) for parameters in found.values())
        steady = np.ones(len(pixels), bool)
        if interpolation == "published":
            steady = ~is_beside_switch(on_slopes(pixels, slope_method))
        for (_, dtype), parameters in found.items():
            difference = _apart(parameters, found["interpreter", dtype])[steady].max()
            findings.between_back_ends[dtype] = max(findings.between_back_ends[dtype], difference)
            if dtype == "float32":
                error = _apart(parameters, found[DOUBLE])[steady].max()
                findings.from_reference = max(findings.from_reference, error)
    return findings


def _apart(one: Array, other: Array) -> Array:
    """The largest difference of parameters of a pixel, relative where they are large, (n)."""
    return np.asarray(np.max(np.abs(one - other) / (np.abs(other) + 0.01), axis=1))


INTRODUCTION = """# Hard cases

Light and viewer from straight above to the horizon and on it, alike, opposite and nearly so, grazing from
opposite sides, of any length.
Half of the normals lie within 3 m of the half vector; others are grazed, face away, or have no direction.
m is from 1e-4, ks from 0.  One sample in five is of any numbers within four times the ranges of the channels.
Every back end computes the same samples in float32 and in float64 (`tools/hard_cases.py`).

| | samples | not finite | beyond a promise | back ends apart, float32 | float64 | float64 from reference |
|---|---|---|---|---|---|---|"""

SINGLE_PRECISION = """
Differences are relative, the largest; from the reference, those for m from .01 and cosines from .02.

## float32

Relative error of XYZ, diffuse and specular together with kd of at least .01, against float64 on the same
float32 input, of all models.  Beside it programs of the papers' equations as they are printed, with an arc
cosine and a tangent (`calc_templates/*_literal.calc`).

| m from | cosines from | promised | largest | 99.9 % | as printed: largest | 99.9 % | times ours |
|---|---|---|---|---|---|---|---|"""

EXACT = """
With `iccbrdf build --geometry exact` the promises hold down to the horizon:

| m from | cosines from | promised | largest | 99.9 % |
|---|---|---|---|---|"""

BY_ROUGHNESS = """
By roughness alone, for cosines from .1, in the plain geometry:

| m | 99 % | largest | as printed: 99 % | largest | times ours, 99 % |
|---|---|---|---|---|---|"""

ON_COLOURS = """
![Largest relative error by roughness and cosine, ours and as printed](hard_cases.png)

## Colours

Nodes and their neighbours, ties of chromaticity, the whites and blacks of slopes, slopes on and beyond the
ends of segments, XYZ of -8 to 8.  Differences of parameters are relative to the parameter plus .01; those of
the published interpolation are of colours for which no rounding error moves the choice of nodes.

| | samples | not finite | back ends apart, float32 | float64 | float32 from float64 |
|---|---|---|---|---|---|"""


def row(*cells: object) -> str:
    """A line of a table."""
    return "| " + " | ".join(f"{c:.1e}" if isinstance(c, float) else str(c) for c in cells) + " |"


def report(
    models: Iterable[Findings], mids: Iterable[Findings], maps: Mapping[str, ErrorMap]
) -> Iterator[str]:
    """The lines of hard_cases.md; `maps` by geometry."""
    errors = maps["plain"]
    yield INTRODUCTION
    for f in models:
        apart = (f.between_back_ends[dtype] for dtype in DTYPES)
        yield row(f.name, f"{f.samples:,}", f.not_finite, f.broken, *apart, f.from_reference)
    yield SINGLE_PRECISION
    for promise, (ours, printed) in errors.by_promise.items():
        at, printed_at = ours.quantile(0.999), printed.quantile(0.999)
        limits = (f"{promise.least_m:g}", f"{promise.least_cosine:g}", f"{promise.error:.0e}")
        yield row(*limits, ours.largest, at, printed.largest, printed_at, f"{printed_at / at:,.0f}")
    yield ""
    yield (
        "Directions of length 1 are uncertain by 1e-7 in float32, and the half vector of light and viewer\n"
        "that graze a surface from opposite sides by more.  Below these cosines all promises but the second\n"
        f"grow as one over the cosine therefore, and end where they are {NOTHING_LEFT:g}.  "
        "The largest errors there,\ndivided by that growth: "
        + ", ".join(f"{errors.grazing[p]:.1e} for m from {p.least_m:g}" for p in PROMISES if p.grows)
        + "."
    )
    yield EXACT
    for promise, (ours, _) in maps["exact"].by_promise.items():
        limits = (f"{promise.least_m:g}", f"{promise.from_cosine('exact'):g}", f"{promise.error:.0e}")
        yield row(*limits, ours.largest, ours.quantile(0.999))
    yield BY_ROUGHNESS
    for (low, high), (ours, printed) in errors.by_m.items():
        at, printed_at = ours.quantile(0.99), printed.quantile(0.99)
        times = f"{printed_at / at:,.0f}"
        yield row(f"{low:g} to {high:g}", at, ours.largest, printed_at, printed.largest, times)
    yield ON_COLOURS
    for f in mids:
        apart = (f.between_back_ends[dtype] for dtype in DTYPES)
        yield row(f.name, f"{f.samples:,}", f.not_finite, *apart, f.from_reference)


def draw(maps: Mapping[str, ErrorMap], path: Path) -> None:
    """The error map: the largest relative error of each cell of m and cosine."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), sharey=True, constrained_layout=True)
    shown = [(f"{geometry} geometry", geometry, errors.cells[0]) for geometry, errors in maps.items()]
    shown.append(("as printed", "plain", maps["plain"].cells[1]))
    for axis, (title, geometry, cells) in zip(axes, shown, strict=True):
        image = axis.pcolormesh(
            10**LOG_M,
            10**LOG_COSINES,
            np.maximum(cells, 1e-7).T,
            norm=mpl.colors.LogNorm(1e-7, 1),
            cmap="magma",
        )
        for promise in PROMISES:
            least_cosine = promise.from_cosine(geometry)
            axis.plot([promise.least_m, promise.least_m, 1], [1, least_cosine, least_cosine], "w", lw=0.8)
            axis.text(
                promise.least_m * 1.1,
                least_cosine * 1.15,
                f"{promise.error:.0e}",
                color="w",
                fontsize=7,
            )
        axis.set(xscale="log", yscale="log", xlabel="roughness m", title=f"float32, {title}")
    axes[0].set_ylabel("lesser cosine of light and viewer")
    figure.colorbar(image, ax=axes, label="largest relative error of XYZ", extend="max")
    figure.savefig(path, dpi=100)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=20_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs")
    arguments = parser.parse_args()
    mpl.use("Agg")
    arguments.output.mkdir(exist_ok=True)
    of_colours = int(arguments.samples * OF_COLOURS)
    maps = {geometry: ErrorMap(geometry) for geometry in GEOMETRIES}
    kinds = list(product(GEOMETRIES, MODELS))
    models, mids = [], []
    for geometry, model in kinds:
        samples = (arguments.samples - of_colours) // len(kinds)
        models.append(examine(model, geometry, samples, arguments.seed, maps[geometry]))
        print(f"{models[-1].name}: {models[-1].samples:,} samples", file=sys.stderr)
    for methods in COLOUR_MIDS:
        mids.append(examine_colours(*methods, of_colours // len(COLOUR_MIDS), arguments.seed))
        print(f"{mids[-1].name}: {mids[-1].samples:,} samples", file=sys.stderr)
    text = "\n".join(report(models, mids, maps)) + "\n"
    (arguments.output / "hard_cases.md").write_text(text, encoding="utf-8")
    draw(maps, arguments.output / "hard_cases.png")
    print(text)
    sys.exit(int(any(f.not_finite or f.broken for f in (*models, *mids))))


if __name__ == "__main__":
    main()
