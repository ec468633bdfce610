"""How far a table is from the map that it stands for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.interpolation import InterpolationMethod, interpolate
from iccbrdf.brdf.models import MODELS
from iccbrdf.brdf.primaries import Primaries
from iccbrdf.brdf.smooth_interpolation import DIFFUSE, GLOSS_FLOOR

MIXTURES = 10_000
"""Random mixtures of all primaries in the sample."""

STEPS = 41
"""Colours on the straight line between any two primaries, both ends included."""


@dataclass(frozen=True)
class Spread:
    """Absolute errors over the sample."""

    mean: float
    percentile_95: float
    maximum: float
    worst_XYZ: tuple[float, float, float]
    """The colour at which the maximum lies."""


@dataclass(frozen=True)
class TableError:
    """Differences between tables and the exact map, over colours within the primaries' gamut.

    The sample: `MIXTURES` random mixtures of all primaries' XYZ, and the lines between any two of them.
    """

    method: str
    grid: int
    colours: int
    tags: Mapping[str, Mapping[str, Spread]]
    """By tag and quantity: `kd` in CIEDE2000 against the primaries' white, `ln ks` and `ln m`, of which the
    channel that is farthest off counts."""

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield (
            f"Table of {self.grid} x {self.grid} x {self.grid} against the exact map ({self.method}), "
            f"{self.colours} colours within the gamut"
        )
        yield f"{'':<20}{'mean':>9}{'95 %':>9}{'max':>9}   at X Y Z"
        for tag, quantities in self.tags.items():
            for name, spread in quantities.items():
                label = f"{tag} {'CIEDE2000 of kd' if name == 'kd' else name}"
                yield (
                    f"{label:<20}{spread.mean:>9.5f}{spread.percentile_95:>9.5f}{spread.maximum:>9.5f}   "
                    + " ".join(f"{c:.4f}" for c in spread.worst_XYZ)
                )
        if self.method == "published":
            yield "The published map jumps where its choice of nodes changes; no grid makes the maxima small."


def measure(
    primaries: Primaries,
    method: InterpolationMethod,
    grid: int,
    maps: Mapping[str, Callable[[Array], Array]],
) -> TableError:
    """Compare `maps`, by tag, from XYZ (n, 3) to parameters (n, k), with the exact map."""
    colours = sample(primaries)
    exact = interpolate(colours, primaries, method=method)
    tags = {tag: _spreads(primaries, colours, table(colours), exact) for tag, table in maps.items()}
    return TableError(method, grid, len(colours), tags)


def sample(primaries: Primaries) -> Array:
    """The colours of the comparison, the same ones every time, shape (n, 3)."""
    nodes = primaries.XYZ
    # The even density over the mixing ratios would leave the edges of the gamut, where errors are, bare.
    shares = np.random.default_rng(0).dirichlet(np.full(len(nodes), 0.5), MIXTURES)
    t = np.linspace(0, 1, STEPS)[:, np.newaxis]
    lines = [(1 - t) * one + t * other for one, other in combinations(nodes, 2)]
    return np.concatenate([shares @ nodes, *lines])


def _spreads(primaries: Primaries, XYZ: Array, found: Array, exact: Array) -> dict[str, Spread]:
    labs = [XYZ_to_Lab(parameters[:, DIFFUSE], primaries.white) for parameters in (found, exact)]
    spreads = {"kd": _spread(delta_E_CIE2000(*labs), XYZ)}
    model = MODELS[primaries.model]
    families = zip(model.parameters, model.split(found), model.split(exact), strict=True)
    for (family, _), mine, true in list(families)[1:]:
        error = np.log(np.maximum(mine, GLOSS_FLOOR)) - np.log(np.maximum(true, GLOSS_FLOOR))
        spreads[f"ln {family}"] = _spread(np.max(np.abs(error), axis=-1), XYZ)
    return spreads


def _spread(errors: Array, XYZ: Array) -> Spread:
    x, y, z = map(float, XYZ[np.argmax(errors)])
    mean, percentile, maximum = np.mean(errors), np.percentile(errors, 95), np.max(errors)
    return Spread(float(mean), float(percentile), float(maximum), (x, y, z))
