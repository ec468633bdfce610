"""A caller's own channels, fitted to the first profile of a chain."""

from __future__ import annotations

from dataclasses import replace

from iccbrdf.calc.decoding import Decoding, decoding_of
from iccbrdf.cmm.stages import Stage
from iccbrdf.cmm.steps import Route, Step
from iccbrdf.errors import LinkError, nearest
from iccbrdf.icc import Calculator, MultiProcess


def without_decoding(stage: Stage) -> Stage:
    """`stage` less its decoding: real values enter where the device values would have become real.

    A stage that starts from no device space, or has no elements, takes real values already.  Raises LinkError
    where the profile does not begin by decoding its channels one by one.
    """
    elements = stage.process.elements
    if stage.source.kind != "device" or not elements:
        return stage
    decoding = decoding_of(elements[0])
    if decoding is None:
        raise LinkError(
            f"{stage.where}: real samples need a profile that first decodes its device channels one by one, "
            f"to a factor times the channel plus an offset; found {elements[0].signature!r}"
        )
    own, sources = stage.source.names, decoding.sources
    if len(sources) < len(own):
        # Channels that go no further are still the caller's.
        first = _calculator(_plain(sources), len(own))
        return replace(stage, process=replace(stage.process, elements=(first, *elements[1:])))
    names = tuple(own[source] for source in sources)
    return replace(
        stage,
        process=MultiProcess(len(names), stage.process.outputs, elements[1:]),
        source=replace(stage.source, names=names),
    )


def arranged(stage: Stage, names: tuple[str, ...]) -> tuple[list[Step], Stage]:
    """Put the caller's channels `names` into the order of `stage`, which is narrowed to what there is.

    Raises LinkError for a name that the profile does not have, and for a missing one that it cannot spare.
    """
    own = stage.source.names
    if not names:
        raise LinkError(f"no channels are named, expected some of {', '.join(own)}")
    for i, name in enumerate(names):
        if name not in own:
            raise LinkError(f"channel {name!r} is not in {stage.profile.source}: {nearest(str(name), own)}")
        if name in names[:i]:
            raise LinkError(f"channel {name!r} comes twice")
    if names == own:
        return [], stage
    kept = [name for name in own if name in names]
    if len(kept) < len(own):
        stage = _narrowed(stage, kept)
    return [Route(tuple(names.index(name) for name in kept), (0.0,) * len(kept))], stage


def _narrowed(stage: Stage, kept: list[str]) -> Stage:
    """`stage` for a caller who has only the channels `kept`: the others vanish from its multiplex space."""
    own, elements = stage.source.names, stage.process.elements
    decoding = decoding_of(elements[0]) if elements else _plain(tuple(range(len(own))))
    if decoding is None or len(elements) > 1 or stage.destination.kind != "mcs":
        missing = [name for name in own if name not in kept]
        which = f"channel {missing[0]!r} is" if len(missing) == 1 else f"channels {', '.join(missing)} are"
        hint = "; a map of normals or heights gives them (--normals, --height)" if "n.z" in missing else ""
        raise LinkError(f"{which} missing, which {stage.profile.source} needs{hint}")
    rows = [row for row, source in enumerate(decoding.sources) if own[source] in kept]
    narrow = Decoding(
        tuple(kept.index(own[decoding.sources[row]]) for row in rows),
        tuple(decoding.factors[row] for row in rows),
        tuple(decoding.offsets[row] for row in rows),
    )
    names = tuple(stage.destination.names[row] for row in rows)
    return replace(
        stage,
        process=MultiProcess(len(kept), len(rows), (_calculator(narrow, len(kept)),)),
        source=replace(stage.source, names=tuple(kept)),
        destination=replace(stage.destination, names=names),
    )


def _plain(sources: tuple[int, ...]) -> Decoding:
    """Channels as they are."""
    return Decoding(sources, (1.0,) * len(sources), (0.0,) * len(sources))


def _calculator(decoding: Decoding, inputs: int) -> Calculator:
    return Calculator(inputs=inputs, outputs=len(decoding.sources), program=decoding.program())
