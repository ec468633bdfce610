"""The human-readable listing that goes with a pair of profiles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from iccbrdf.build.viewing import Viewing
from iccbrdf.calc import Compiled
from iccbrdf.calc import listing as program_listing
from iccbrdf.icc.source_tag import setting_text


def listing(
    title: str, compiled: Compiled, ranges: Sequence[tuple[float, float]], conditions: Viewing
) -> str:
    """What the MID decodes and what the MVIS runs; `ranges` are the values of device 0 and 1 by channel."""
    return "\n".join(_lines(title, compiled, ranges, conditions)) + "\n"


def _lines(
    title: str, compiled: Compiled, ranges: Sequence[tuple[float, float]], conditions: Viewing
) -> Iterator[str]:
    yield title
    yield ""
    yield "MID (tag A2M0): each device channel in 0..1 becomes the multiplex channel"
    for channel, (low, high) in zip(compiled.inputs, ranges, strict=True):
        yield f"  {channel:<5} = {low:g} + {high - low:g} * device"
    yield ""
    yield f"MVIS: XYZ with Y = 1 for the perfect diffuser, {conditions.text}"
    yield "  multiplex channels and what holds where an image has none (tag mdv)"
    for channel, value in zip(compiled.inputs, compiled.defaults, strict=True):
        yield f"    {channel:<5} {value:g}"
    yield "  run-time variables and what holds where none is set"
    for name, value in compiled.variables.items():
        yield f"    {name:<5} {value:.9g}"
    yield "  constants"
    for name, constant in compiled.constants.items():
        yield f"    {name} = {setting_text(constant)}"
    for state, heading in ((True, "effects simulated"), (False, "effects left out")):
        names = [name.replace("_", "-") for name, on in compiled.effects.items() if on is state]
        yield f"  {heading}: {', '.join(names) or 'none'}"
    yield ""
    yield (
        f"Program (tag M2B0): {len(compiled.program)} operators, "
        f"of which at most {compiled.executed} are executed for a pixel"
    )
    yield ""
    yield from compiled.documentation.splitlines()
    yield ""
    yield program_listing(compiled.program, compiled.temporaries)
