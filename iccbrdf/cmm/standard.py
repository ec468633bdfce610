"""From a profile's own connection conditions to D50 and the 2 degree observer, where displays start."""

from __future__ import annotations

from typing import Any

import numpy as np

from iccbrdf.cmm.conditions import conditions, to_standard
from iccbrdf.cmm.spaces import pcs_space
from iccbrdf.cmm.steps import LabToXYZ, Process, Step
from iccbrdf.cmm.transform import Transform
from iccbrdf.icc import Profile


def standard_XYZ(profile: Profile, dtype: type[np.floating[Any]] = np.float32) -> Transform:
    """A transform from what `profile` ends on (XYZ, or L*, a*, b*) to XYZ under D50, 2 degree observer.

    Raises LinkError where the profile's conditions differ and it has no c2sp.
    """
    space = pcs_space(profile)
    steps: list[Step] = []
    if space.signature == "Lab ":
        steps.append(LabToXYZ(conditions(profile).white))
    steps += [Process.checked(process, origin) for origin, process in to_standard(profile)]
    return Transform(
        channels_in=space.names,
        channels_out=("X", "Y", "Z"),
        samples_out="real",
        steps=tuple(steps),
        variables=(),
        env={},
        dtype=dtype,
        wanted="auto",
        threads=1,
    )
