"""A caller's own channels, fitted to the first profile of a chain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from iccbrdf.cmm.spaces import single_inputs
from iccbrdf.cmm.stages import Stage
from iccbrdf.cmm.steps import Route, Step
from iccbrdf.errors import LinkError, nearest
from iccbrdf.icc import Matrix, MultiProcess


def without_decoding(stage: Stage) -> Stage:
    """`stage` less its leading matrix: real values enter where the device values would have become real.

    A stage that starts from no device space, or has no elements, takes real values already.  Raises LinkError
    where the profile begins with anything else than such a matrix.
    """
    elements = stage.process.elements
    if stage.source.kind != "device" or not elements:
        return stage
    inputs = single_inputs(elements[0])
    if inputs is None:
        raise LinkError(
            f"{stage.where}: real samples need a profile that first decodes its device channels by a matrix, "
            f"one channel a row; found {elements[0].signature!r}"
        )
    own = stage.source.names
    if len(inputs) < len(own):
        # Channels that go no further are still the caller's.
        selection = np.eye(len(own), dtype=np.float32)[list(inputs)]
        first = Matrix(inputs=len(own), matrix=selection, offset=np.zeros(len(inputs), np.float32))
        return replace(stage, process=replace(stage.process, elements=(first, *elements[1:])))
    names = tuple(own[i] for i in inputs)
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
    # For each multiplex channel the one device channel that it comes from.
    sources = single_inputs(elements[0]) if elements else tuple(range(len(own)))
    if sources is None or len(elements) > 1 or stage.destination.kind != "mcs":
        missing = next(name for name in own if name not in kept)
        raise LinkError(f"channel {missing!r} is missing, which {stage.profile.source} needs")
    rows = [row for row, source in enumerate(sources) if own[source] in kept]
    columns = [own.index(name) for name in kept]
    narrow = tuple(
        Matrix(inputs=len(kept), matrix=e.matrix[np.ix_(rows, columns)], offset=e.offset[rows])
        for e in elements
    )
    names = tuple(stage.destination.names[row] for row in rows)
    return replace(
        stage,
        process=MultiProcess(len(kept), len(rows), narrow),
        source=replace(stage.source, names=tuple(kept)),
        destination=replace(stage.destination, names=names),
    )
