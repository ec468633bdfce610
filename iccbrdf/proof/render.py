"""One pass over a job's image: each block goes to BRDF parameters once, and from there to every scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from iccbrdf.cmm import Transform
from iccbrdf.images import ImageSource, Place, in_order
from iccbrdf.images.checks import not_finite_pixels, steeper

FLAT, BRDF = "flat", "brdf"
"""Images that a target may take instead of a scene's."""


class Target(NamedTuple):
    """Something that takes blocks, a sink with `encode` and `put`, and which image it takes.

    `image` is `FLAT`, `BRDF`, or the number of a scene, whose XYZ it takes, under D50 where `for_display`.
    """

    sink: Any
    image: str | int
    for_display: bool = False


@dataclass
class Counts:
    """What a pass met."""

    not_finite_in: int = 0
    """Pixels of the flat print whose XYZ or normal are no finite numbers."""
    not_finite_out: int = 0
    """Pixels of the scenes that are no finite numbers, all scenes together."""
    beyond_slopes: int = 0
    """Pixels steeper than the last measured slope, which holds for them."""

    def add(self, other: Counts) -> None:
        """Count what another part of the pass met."""
        self.not_finite_in += other.not_finite_in
        self.not_finite_out += other.not_finite_out
        self.beyond_slopes += other.beyond_slopes


@dataclass(frozen=True)
class Chain:
    """The transforms of a proof.

    Attributes
    ----------
    to_brdf
        From real X, Y, Z, n.x, n.y, n.z to the multiplex channels.
    scenes
        From those to XYZ, one for each light and view.
    to_display
        From XYZ of the MVIS to XYZ under D50.
    last_slope
        The steepest slope in degrees that was measured; None where colours are not adjusted to slopes.
    """

    to_brdf: Transform
    scenes: Sequence[Transform]
    to_display: Transform
    last_slope: float | None


def run(
    source: ImageSource,
    chain: Chain,
    targets: Sequence[Target],
    *,
    workers: int,
    advance: Callable[[int], None],
) -> Counts:
    """Stream `source` (real X, Y, Z and normals) through `chain` into `targets`.

    Parameters
    ----------
    workers
        Blocks that are read and computed at a time; the results do not depend on it.
    advance
        Is told the number of pixels that are done.
    """
    counts = Counts()
    takers: dict[str | int, list[int]] = {}
    for number, target in enumerate(targets):
        takers.setdefault(target.image, []).append(number)

    def work(place: Place) -> tuple[Counts, list[Any]]:
        block = source.read(place)
        brdf = chain.to_brdf(block.data)
        met = Counts(
            not_finite_in=not_finite_pixels(block.data),
            beyond_slopes=steeper(block.data, source.samples, chain.to_brdf.channels_in, chain.last_slope),
        )
        encoded: list[Any] = [None] * len(targets)
        # Scene by scene: a block of each at a time would need much memory.
        for image, numbers in takers.items():
            if isinstance(image, int):
                data = chain.scenes[image](brdf)
                met.not_finite_out += not_finite_pixels(data)
            else:
                data = block.data if image == FLAT else brdf
            shown = chain.to_display(data) if any(targets[k].for_display for k in numbers) else data
            for k in numbers:
                own = shown if targets[k].for_display else data
                encoded[k] = targets[k].sink.encode(block._replace(data=own))
        return met, encoded

    def take(worked: tuple[Counts, list[Any]]) -> None:
        met, encoded = worked
        counts.add(met)
        for target, item in zip(targets, encoded, strict=True):
            target.sink.put(item)

    with in_order(workers, take) as submit:
        for place in source.places():
            submit(work, place)
            advance(place.height * place.width)
    return counts
