"""How far the transforms of two profiles are apart on random inputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.models import NORMAL
from iccbrdf.cmm.conditions import conditions
from iccbrdf.cmm.link import link
from iccbrdf.errors import LinkError
from iccbrdf.icc import Profile

_BATCH = 65536
"""Inputs at a time."""


@dataclass(frozen=True)
class Agreement:
    """Of `samples` inputs.

    largest: greatest absolute difference of an output channel.  delta_E: greatest CIEDE2000 difference,
    None where the outputs are not XYZ.  not_finite: inputs for which one side or both give no finite
    output; they count in neither.
    """

    samples: int
    largest: float
    delta_E: float | None
    not_finite: int


def agreement(a: Profile, b: Profile, samples: int, *, seed: int = 0) -> Agreement:
    """Run both profiles on the same random inputs: 0..1 in every channel, -1..1 for those of a normal.

    Lab is relative to the white of the first profile's viewing conditions.  Raises LinkError where the
    channels of the two differ, and as `link`.
    """
    first, second = link([a]), link([b])
    for what, here, there in (
        ("takes", first.channels_in, second.channels_in),
        ("gives", first.channels_out, second.channels_out),
    ):
        if here != there:
            raise LinkError(
                f"{a.source} {what} the channels {', '.join(here)}, {b.source} {', '.join(there)}: "
                "there is nothing to compare"
            )
    colorimetric = first.channels_out == ("X", "Y", "Z")
    white = conditions(a).white if colorimetric else None
    random = np.random.default_rng(seed)
    low = np.array([-1.0 if name in NORMAL else 0.0 for name in first.channels_in])
    largest, difference, not_finite = 0.0, 0.0, 0
    for start in range(0, samples, _BATCH):
        inputs = random.uniform(low, 1.0, (min(_BATCH, samples - start), len(low))).astype(np.float32)
        one, other = (transform(inputs).astype(np.float64) for transform in (first, second))
        finite = np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
        not_finite += int((~finite).sum())
        one, other = one[finite], other[finite]
        if not len(one):
            continue
        largest = max(largest, float(np.abs(one - other).max()))
        if white is not None:
            labs = (XYZ_to_Lab(XYZ, white) for XYZ in (one, other))
            difference = max(difference, float(delta_E_CIE2000(*labs).max()))
    return Agreement(samples, largest, difference if colorimetric else None, not_finite)
