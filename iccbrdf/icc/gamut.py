"""The tag type of gamut boundaries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from iccbrdf.icc.fields import U16, U32, FloatArray, Floats, tag_layout
from iccbrdf.icc.layout import Field, Record
from iccbrdf.icc.rows import Integers
from iccbrdf.icc.tags import TAGS


@TAGS.add("gbd ")
@dataclass(frozen=True, eq=False)
class GamutBoundary(Record):
    """gamutBoundaryDescType: a surface of triangles around the colours that a device can make.

    triangles : shape (T, 3), numbers of vertices; some writers count these from 1
    pcs : shape (V, PCS channels), the vertices in the connection space
    device : shape (V, device channels), the same as device values; no columns where they are not told
    """

    triangles: npt.NDArray[np.uint32]
    pcs: FloatArray
    device: FloatArray

    signature = "gbd "
    layout = tag_layout(
        signature,
        Field("pcs_channels", U16, derived=lambda r: r.pcs.shape[1]),
        Field("device_channels", U16, derived=lambda r: r.device.shape[1]),
        Field("vertices", U32, derived=lambda r: len(r.pcs)),
        Field("count", U32, derived=lambda r: len(r.triangles)),
        Field("triangles", Integers(">u4", lambda seen: (seen["count"], 3))),
        Field("pcs", Floats(lambda seen: (seen["vertices"], seen["pcs_channels"]))),
        Field("device", Floats(lambda seen: (seen["vertices"], seen["device_channels"]))),
    )

    def check(self) -> None:
        if self.pcs.ndim != 2 or self.device.ndim != 2 or len(self.pcs) != len(self.device):
            raise ValueError(
                f"found vertices of shape {self.pcs.shape} and {self.device.shape}, "
                "expected rows of channels, as many in both"
            )
        if not self.pcs.shape[1]:
            raise ValueError("pcs: found no channels, expected one or more")
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3:
            raise ValueError(f"triangles: found shape {self.triangles.shape}, expected (count, 3)")
