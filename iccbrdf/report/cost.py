"""What accuracy costs in time: ways to the same proof, measured on tiles of a scene.

Times are those of computing from an image in memory to samples in memory, on one thread, medians of runs that
take turns, so that a slow spell of the machine slows all of them.  Errors are CIEDE2000 to the float64
reference of the method that was asked for: another interpolation or model is another answer, and is marked.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache, partial
from statistics import median
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import Array
from iccbrdf.build.spans import Directions
from iccbrdf.calc.backends import COMPILERS
from iccbrdf.cmm import link
from iccbrdf.errors import UnsupportedError, UsageError
from iccbrdf.images.showing import finite
from iccbrdf.planning import Planning, ScenePlan
from iccbrdf.report.cost_runs import Ready, make_ready
from iccbrdf.report.cost_scene import PIXELS, REGIONS, CostScene, Tiles, sample_scene
from iccbrdf.report.cost_ways import Way, ways

Statistic = Literal["mean", "p95", "max"]
STATISTICS: tuple[Statistic, ...] = ("mean", "p95", "max")

RUNS = 15
NOTICED = 1.0
"""CIEDE2000 that counts as an error that is seen."""

AS_FAST = 1.1
"""Ways that take up to so many times the time of another count as taking as long."""

BACKENDS = ("interpreter", *COMPILERS)

_TURN = 0.05
"""Seconds that a way may take in its turn; slower ones run on some of the tiles."""
_AT_ONCE = 1 << 16
"""Pixels whose errors are computed at a time."""
BACKEND_PIXELS = 1 << 14
"""On which the back ends are compared, as the interpreter is slow."""

Errors32 = NDArray[np.float32]
"""CIEDE2000 by pixel."""


@dataclass(frozen=True)
class Errors:
    """CIEDE2000 of some pixels; NaN where there are none."""

    pixels: int
    mean: float
    p95: float
    max: float

    @classmethod
    def of(cls, dE: Errors32) -> Errors:
        """Those of differences of any shape."""
        if not dE.size:
            return cls(0, np.nan, np.nan, np.nan)
        return cls(dE.size, float(dE.mean()), float(np.percentile(dE, 95)), float(dE.max()))


@dataclass(frozen=True, eq=False)
class Cost:
    """What one way takes and gives."""

    way: Way
    ns: float
    """Nanoseconds a pixel, the median."""
    seconds_to_make: float
    """To build, link and compile its profiles, once."""
    errors: Errors
    by_region: Mapping[str, Errors]
    """By `REGIONS`."""
    noticed: float
    """Share of pixels with an error above `NOTICED`."""
    profile_bytes: int
    operators: float | None
    """Executed for a pixel at most; None where no program runs."""
    backend: str
    """What ran it."""
    bound: float | None
    """CIEDE2000 that a way with fewer effects promises not to exceed, up to rounding."""
    proof: Callable[[Tiles], Array] = field(repr=False)
    """From tiles of the image to XYZ, as stored."""
    dE: Errors32 = field(repr=False)
    """Error of each pixel of the sample, (tiles, height, width)."""

    def error(self, statistic: Statistic) -> float:
        """One of `STATISTICS` of all pixels."""
        return float(getattr(self.errors, statistic))


@dataclass(frozen=True)
class Backend:
    """One back end on the plain way."""

    name: str
    ns: float
    max_error: float
    """Largest CIEDE2000 to the exact result."""
    from_first: float
    """Largest CIEDE2000 to the first back end of the list."""


@dataclass(frozen=True, eq=False)
class CostReport:
    """All ways on one scene."""

    scene: CostScene
    costs: tuple[Cost, ...]
    """The reference first, where it is among them."""
    backends: tuple[Backend, ...]
    runs: int

    def ratios(self, cost: Cost) -> tuple[float | None, float]:
        """The time of a way by that of the reference, where there is one, and by that of the fastest."""
        references = [other.ns for other in self.costs if other.way.is_reference]
        return cost.ns / references[0] if references else None, cost.ns / min(c.ns for c in self.costs)

    def to_dict(self) -> dict[str, Any]:
        """Ready for JSON, in which NaN is null."""
        front = {id(cost) for cost in pareto(self.costs)}
        scene = self.scene
        return {
            "image": {
                "height": scene.size[0],
                "width": scene.size[1],
                "kind": "XYZ" if scene.is_colour else "BRDF",
            },
            "sample": {"pixels": scene.pixels, "tiles": len(scene.places), "whole": scene.is_whole},
            "exact": {
                "by": "float64 reference",
                "model": scene.recipe.primaries.model,
                "interpolation": scene.recipe.interpolation if scene.is_colour else None,
                "slope_method": scene.recipe.slope_method if scene.recipe.slopes else None,
            },
            "env": scene.variables,
            "runs": self.runs,
            "ways": [
                {
                    "name": cost.way.name,
                    "axis": cost.way.axis,
                    "same_answer": cost.way.same_answer,
                    "on_front": id(cost) in front,
                    "ns_per_pixel": cost.ns,
                    "to_reference": self.ratios(cost)[0],
                    "to_fastest": self.ratios(cost)[1],
                    "seconds_to_make": cost.seconds_to_make,
                    "delta_E_CIE2000": _numbers(cost.errors),
                    "by_region": {name: _numbers(errors) for name, errors in cost.by_region.items()},
                    "share_above_1": cost.noticed,
                    "profile_bytes": cost.profile_bytes,
                    "operators": cost.operators,
                    "backend": cost.backend,
                    "bound": cost.bound,
                    "advice": cost.way.advice,
                }
                for cost in self.costs
            ],
            "backends": [asdict(backend) for backend in self.backends],
        }


def _numbers(errors: Errors) -> dict[str, Any]:
    return {name: None if np.isnan(value) else value for name, value in asdict(errors).items()}


def measure_image(
    planning: Planning,
    env: Mapping[str, float],
    *,
    only: Callable[[Way], bool] = lambda way: True,
    pixels: int = PIXELS,
    runs: int = RUNS,
    backends: Sequence[str] = BACKENDS,
    told: Callable[[str], None] = lambda name: None,
) -> CostReport:
    """
    Measure the ways that there are on an image.

    Parameters
    ----------
    planning
        The image, and what its profiles are made of.
    env
        Run-time variables: light and view, where they are not the profiles' own.
    only
        Which of the ways.
    pixels
        Of the sample.
    runs, backends, told
        As of `measure`.
    """
    scene = sample_scene(planning, env, pixels=pixels)
    light = Directions.single([scene.light], ["light"])
    view = Directions.single([scene.view], ["view"])

    @cache
    def plan(tolerance: float) -> ScenePlan:
        return planning.plan(light, view, tolerance=tolerance, env=env)

    chosen = [way for way in ways(planning.recipe, is_colour=planning.is_colour) if only(way)]
    return measure(scene, chosen, plan, runs=runs, backends=backends, told=told)


def measure(
    scene: CostScene,
    chosen: Sequence[Way],
    plan: Callable[[float], ScenePlan],
    *,
    runs: int = RUNS,
    backends: Sequence[str] = BACKENDS,
    told: Callable[[str], None] = lambda name: None,
) -> CostReport:
    """
    Measure ways on a scene.

    Ways that leave out the same effects as an earlier one, or none, are left out themselves.

    Parameters
    ----------
    scene
        Tiles of an image.
    chosen
        Ways as `iccbrdf.report.cost_ways.ways` has them.
    plan
        Makes the plan of the whole image within a tolerance in CIEDE2000.
    runs
        Of each, after one to warm up.
    backends
        Whose time and error is shown, for the plain way; those that are not installed are left out.
    told
        Hears the name of each way as it is made ready.
    """
    exact = np.concatenate([scene.exact(tile[np.newaxis]) for tile in scene.tiles])
    regions = np.concatenate([scene.regions(tile[np.newaxis]) for tile in scene.tiles])
    trials = []
    effects: set[tuple[str, ...]] = {()}
    for way in chosen:
        told(way.name)
        if any(side % way.reduction for side in scene.tiles.shape[1:3]):
            continue
        if way.tolerance is not None:
            without = plan(way.tolerance).decision.without
            if without in effects:
                continue
            effects.add(without)
        trials.append(_try(way, scene, plan, exact))
    times = _in_turns([trial.work for trial in trials], runs)
    costs = [
        Cost(
            way=trial.way,
            ns=1e9 * seconds / trial.timed[..., 0].size,
            seconds_to_make=trial.seconds_to_make,
            errors=Errors.of(trial.dE),
            by_region={name: Errors.of(trial.dE[regions == i]) for i, name in enumerate(REGIONS)},
            noticed=float(np.mean(trial.dE > NOTICED)),
            profile_bytes=sum(len(profile.to_bytes()) for profile in trial.ready.profiles),
            operators=trial.ready.operators,
            backend=trial.ready.backend,
            bound=trial.ready.bound,
            proof=trial.proof,
            dE=trial.dE,
        )
        for trial, seconds in zip(trials, times, strict=True)
    ]
    return CostReport(scene, tuple(costs), _backends(scene, exact, backends, runs), runs)


@dataclass(frozen=True, eq=False)
class _Trial:
    """A way that has run once."""

    way: Way
    ready: Ready
    seconds_to_make: float
    dE: Errors32
    timed: Tiles
    """The tiles, or so many of them as take no longer than a turn."""

    def proof(self, tiles: Tiles) -> Array:
        return self.ready.decode(self.ready.run(self.ready.take(tiles)))

    def work(self) -> None:
        self.ready.run(self.timed)


def _try(way: Way, scene: CostScene, plan: Callable[[float], ScenePlan], exact: Array) -> _Trial:
    begun = time.perf_counter()
    ready = make_ready(way, scene, plan)
    tiles = ready.take(scene.tiles)
    ready.run(tiles[:1])
    made = time.perf_counter()
    stored = ready.run(tiles)
    share = min(1.0, _TURN / (time.perf_counter() - made))
    dE = differences(exact, ready.decode(stored), scene.recipe.primaries.white)
    return _Trial(way, ready, made - begun, dE, tiles[: max(1, round(share * len(tiles)))])


def differences(exact: ArrayLike, found: ArrayLike, white: Sequence[float]) -> Errors32:
    """CIEDE2000 of XYZ (..., 3), shape (...): as displays show it, NaN is black and infinity very bright."""
    shape = np.shape(exact)[:-1]
    one, other = (finite(np.asarray(values)).reshape(-1, 3) for values in (exact, found))
    dE: Errors32 = np.empty(len(one), np.float32)
    for start in range(0, len(one), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        dE[part] = delta_E_CIE2000(XYZ_to_Lab(one[part], white), XYZ_to_Lab(other[part], white))
    return dE.reshape(shape)


def _in_turns(works: Sequence[Callable[[], Any]], runs: int) -> list[float]:
    """Median seconds of each, run in turns."""
    seconds: list[list[float]] = [[] for _ in works]
    for _ in range(runs):
        for taken, work in zip(seconds, works, strict=True):
            begun = time.perf_counter()
            work()
            taken.append(time.perf_counter() - begun)
    return [median(taken) for taken in seconds]


def _backends(scene: CostScene, exact: Array, names: Sequence[str], runs: int) -> tuple[Backend, ...]:
    """The plain way by one back end after the other, on the first tiles."""
    if not names:
        return ()
    count = max(1, BACKEND_PIXELS // scene.tiles[0, ..., 0].size)
    tiles, white = scene.tiles[:count], scene.recipe.primaries.white
    profiles = [scene.mid, scene.pair.mvis]
    works: dict[str, Callable[[], Any]] = {}
    for name in names:
        try:
            run = link(profiles, env=scene.env, channels=scene.names, samples=scene.samples, backend=name)
        except UnsupportedError:
            continue
        works[name] = partial(run, tiles)
    found = {name: work() for name, work in works.items()}
    times = _in_turns(list(works.values()), runs)
    return tuple(
        Backend(
            name,
            1e9 * took / tiles[..., 0].size,
            float(differences(exact[:count], XYZ, white).max()),
            float(differences(next(iter(found.values())), XYZ, white).max()),
        )
        for (name, XYZ), took in zip(found.items(), times, strict=True)
    )


def pareto(costs: Sequence[Cost], statistic: Statistic = "max") -> tuple[Cost, ...]:
    """The ways to the same answer that no other one beats in both time and error, the fastest first."""
    front: list[Cost] = []
    for cost in sorted(costs, key=lambda cost: (cost.ns, cost.error(statistic))):
        if cost.way.same_answer and (not front or cost.error(statistic) < front[-1].error(statistic)):
            front.append(cost)
    return tuple(front)


def recommend(
    costs: Sequence[Cost],
    *,
    budget: float | None = None,
    ns: float | None = None,
    statistic: Statistic = "max",
) -> Cost | None:
    """
    The way to take: the cheapest within an error, or the most accurate within a time.

    Considered are the ways to the same answer that this package offers (`Way.advice`).  Of those that take as
    long as the cheapest, within `AS_FAST`, the most accurate one is taken.

    Parameters
    ----------
    costs
        What was measured.
    budget
        Largest error in CIEDE2000, of the statistic.
    ns
        Longest time in nanoseconds a pixel, instead.
    statistic
        Of the errors of all pixels.

    Returns
    -------
    None where no way is within the limit.

    Raises
    ------
    UsageError
        Not one of `budget` and `ns` is given.
    """
    if (budget is None) == (ns is None):
        raise UsageError("a recommendation needs a budget of errors or one of time, and not both")
    offered = [cost for cost in costs if cost.way.same_answer and cost.way.advice is not None]
    if budget is not None:
        within = [cost for cost in offered if cost.error(statistic) <= budget]
        if not within:
            return None
        limit = AS_FAST * min(cost.ns for cost in within)
        within = [cost for cost in within if cost.ns <= limit]
    else:
        within = [cost for cost in offered if cost.ns <= (ns or 0)]
    return min(within, key=lambda cost: (cost.error(statistic), cost.ns), default=None)
