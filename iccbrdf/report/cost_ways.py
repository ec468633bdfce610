"""The ways to one and the same proof whose time and error `iccbrdf cost` compares."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from iccbrdf.build.recipe import Recipe
from iccbrdf.build.table import GRIDS

Output = Literal["float32", "16-bit XYZ", "16-bit sRGB", "8-bit sRGB"]

TOLERANCES = (0.0, 0.5, 2.0)
"""CIEDE2000 within which effects are left out."""

REDUCTIONS = (2, 4)
"""By how much the sides of an image of parameters are shortened."""

V4_GRID = 33
"""Of the version 4 profile."""

OTHER_ROUGHNESS = {"brdf1": "brdf2", "brdf2": "brdf1"}
"""The model that differs in nothing but whether each of X, Y, Z has a roughness of its own."""


@dataclass(frozen=True)
class Way:
    """One way; the defaults are what `iccbrdf build` and `iccbrdf apply` do."""

    name: str
    axis: str
    """What it varies."""
    is_reference: bool = False
    """float64 NumPy, written from the papers: what is exact."""
    dtype: Literal["float32", "float64"] = "float32"
    by_tile: bool = False
    """Whether each tile runs what it calls for alone."""
    tolerance: float | None = None
    """CIEDE2000 within which effects are left out; None: none are."""
    interpolation: str | None = None
    """Another method than the one that was asked for, and so another answer."""
    grid: int | None = None
    """Of a table in place of the interpolation's program."""
    lookup: Literal["multilinear", "tetrahedral"] = "multilinear"
    version: Literal[4, 5] = 5
    """Of the profile that holds the table; 4: in 16 bits, with a 16-bit image behind it."""
    model: str | None = None
    """Another model, with the parameters at hand."""
    literal: bool = False
    """Whether the MVIS computes the formulas as printed."""
    geometry: str | None = None
    """Another geometry than the one that was asked for."""
    output: Output = "float32"
    reduction: int = 1
    """The parameters are those of an image with sides so much shorter, interpolated between its pixels."""

    @property
    def same_answer(self) -> bool:
        """Whether it approximates what was asked for, rather than another method or model.

        BRDF2 with the one roughness of BRDF1 three times is the same, but BRDF1 with one of BRDF2's is not.
        """
        return self.interpolation is None and self.model in (None, "brdf2")

    @property
    def is_built(self) -> bool:
        """Whether it is a matter of the profiles alone, so that `iccbrdf build` can make it."""
        settings = (self.grid, self.tolerance)
        return self == Way(self.name, self.axis, grid=settings[0], tolerance=settings[1])

    @property
    def advice(self) -> str | None:
        """What gives it at the command line or in Python; None where nothing here does."""
        if self.is_built:
            options = "" if self.tolerance is None else f" --for SCENE --tolerance {self.tolerance:g}"
            options += "" if self.grid is None else f" --table {self.grid}"
            used = "" if self.grid is None else ", then apply with table-mid.icc"
            return f"iccbrdf build PRIMARIES -o DIR{options}{used}"
        for others, advice in (
            (Way(self.name, self.axis, dtype="float64"), "iccbrdf apply --double"),
            (
                Way(self.name, self.axis, geometry=self.geometry),
                f"iccbrdf build PRIMARIES -o DIR --geometry {self.geometry}",
            ),
            (Way(self.name, self.axis, by_tile=True), "iccbrdf apply --effects auto"),
            (Way(self.name, self.axis, output="16-bit XYZ"), "iccbrdf apply -o xyz.tif --dtype uint16"),
            (Way(self.name, self.axis, output="16-bit sRGB"), "iccbrdf apply -o proof.png --depth 16"),
            (Way(self.name, self.axis, output="8-bit sRGB"), "iccbrdf apply -o proof.png"),
            (
                Way(self.name, self.axis, grid=self.grid, lookup="tetrahedral"),
                f"iccbrdf build PRIMARIES -o DIR --table {self.grid}, then "
                "iccbrdf.link([...], interpolation='tetrahedral')",
            ),
        ):
            if self == others:
                return advice
        return None


REFERENCE = Way("float64 reference", "number type", is_reference=True)
PLAIN = Way("float32", "number type")
"""What happens where nobody asks for anything else."""


def ways(
    recipe: Recipe,
    *,
    is_colour: bool,
    grids: Sequence[int] = GRIDS,
    tolerances: Sequence[float] = TOLERANCES,
    reductions: Sequence[int] = REDUCTIONS,
) -> tuple[Way, ...]:
    """The ways that there are for a recipe, and an image of colours or of parameters; `REFERENCE` first."""
    found = [REFERENCE, Way("float64", "number type", dtype="float64"), PLAIN, *_effects(tolerances)]
    if is_colour:
        other = "published" if recipe.interpolation == "smooth" else "smooth"
        found.append(Way(f"{other} interpolation", "interpolation", interpolation=other))
        found += _tables(recipe, grids)
    if recipe.primaries.model in OTHER_ROUGHNESS:
        model = OTHER_ROUGHNESS[recipe.primaries.model]
        found.append(Way(model.upper(), "model", model=model))
    found.append(Way("literal formulas", "formulas", literal=True))
    other = "plain" if recipe.geometry == "exact" else "exact"
    found.append(Way(f"{other} geometry", "formulas", geometry=other))
    outputs: tuple[Output, ...] = ("16-bit XYZ", "16-bit sRGB", "8-bit sRGB")
    found += [Way(output, "output", output=output) for output in outputs]
    found += [Way(f"parameters at 1/{n}", "resolution", reduction=n) for n in reductions]
    return tuple(found)


def _effects(tolerances: Sequence[float]) -> Iterator[Way]:
    yield Way("tile by tile", "effects", by_tile=True)
    for tolerance in tolerances:
        yield Way(f"effects within {tolerance:g}", "effects", tolerance=tolerance)


def _tables(recipe: Recipe, grids: Sequence[int]) -> Iterator[Way]:
    if recipe.interpolation == "published" and (recipe.p, recipe.exponent) != (2, -1):
        return  # tables hold no other published interpolation
    for grid in grids:
        yield Way(f"table {grid} trilinear", "tables", grid=grid)
        yield Way(f"table {grid} tetrahedral", "tables", grid=grid, lookup="tetrahedral")
    if grids:
        yield Way(f"v4 table {V4_GRID}, 16 bits", "tables", grid=V4_GRID, version=4)
