"""Slopes -> what a program needs to adjust colours to them, and a program that does no more than that."""

from __future__ import annotations

from typing import Any

from iccbrdf.brdf.primaries import Primaries
from iccbrdf.brdf.slopes import Slopes
from iccbrdf.calc import compile_template
from iccbrdf.calc.program import parse
from iccbrdf.errors import InputError
from iccbrdf.icc import Calculator
from iccbrdf.resources import folder

TEMPLATE = "slope_adjust.calc"


def check_slopes(primaries: Primaries, slopes: Slopes) -> None:
    """InputError for slopes that colours cannot be adjusted to, or of other conditions than `primaries`."""
    file = slopes.file or "slopes"
    if len(slopes.slopes) < 2:
        raise InputError(f"{file}: found the flat print alone, expected at least one slope beside it")
    for what in ("illuminant", "observer"):
        found, expected = getattr(slopes, what), getattr(primaries, what)
        if found != expected:
            raise InputError(f"{file}: {what}: found {found!r}, expected that of the primaries, {expected!r}")
    for slope in slopes.slopes:
        # The adjustment divides by the difference on the flat.
        if not all(W > B for W, B in zip(slope.W, slope.B, strict=True)):
            raise InputError(
                f"{file}: slope {slope.angle:g}: white {slope.W}, black {slope.B}: expected the white above "
                "the black in each of X, Y, Z"
            )


def slope_constants(slopes: Slopes, method: str) -> dict[str, Any]:
    """The constants and choices of `TEMPLATE`; `method` is `affine` or `published`."""
    return {
        "slope_angles": slopes.angles,
        "slope_W": slopes.W,
        "slope_B": slopes.B,
        "slope_method": method,
    }


def slope_adjustment(slopes: Slopes, method: str) -> Calculator:
    """X, Y, Z, n.x, n.y, n.z -> the same, the colour as it is on the slope."""
    text = (folder("calc_templates") / TEMPLATE).read_text(encoding="utf-8")
    compiled = compile_template(text, filename=TEMPLATE, constants=slope_constants(slopes, method))
    return Calculator(6, 6, (*compiled.program, *parse("in(3,3) out(3,3)")))
