"""What a colour MID says beside its transform, in private tags.

`IMAGE_TAG` takes it on to the BRDF image: its multiplex channels as the device channels of the binding MID.
`SLOPES_TAG` tells the slopes that it was measured on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from iccbrdf.build.profiles import encoding, ranges, text_tags
from iccbrdf.icc import ColorantTable, Header, MultiProcess, NumberArray, Profile, TagArray

if TYPE_CHECKING:
    from iccbrdf.brdf.primaries import Primaries

IMAGE_TAG = "bimg"
"""Private tag (processing elements) of a colour MID: multiplex channels -> device of the binding MID."""
SLOPES_TAG = "slop"
"""Private tag (fl32) of a colour MID: the measured slopes in degrees.  Beyond the last one, it is held."""


def image_encoding(channels: Sequence[str], primaries: Primaries) -> MultiProcess:
    """The contents of `IMAGE_TAG`."""
    return MultiProcess.of(encoding(ranges(channels, primaries.encoding)))


def image_link(mid: Profile) -> Profile | None:
    """The multiplex link that takes a chain which ends on colour MID `mid` on to the BRDF image.

    None for a MID that does not say how a BRDF image of it is encoded.
    """
    encode, names = mid.get(IMAGE_TAG), mid.get("mcta")
    if not isinstance(encode, MultiProcess) or not isinstance(names, TagArray):
        return None
    channels = names.texts()
    n = len(channels)
    header = Header(device_class="mlnk", colour_space=f"nc{n:04x}", mcs=f"mc{n:04x}")
    tags = {**text_tags("BRDF image", channels), "clrt": ColorantTable.of(channels), "M2A0": encode}
    return Profile(header, tags, source=f"{mid.source}: tag {IMAGE_TAG}")


def last_slope(profile: Profile) -> float | None:
    """The steepest slope in degrees that a colour MID has measurements for; None where it adjusts to none."""
    slopes = profile.get(SLOPES_TAG)
    return float(slopes.values[-1]) if isinstance(slopes, NumberArray) and len(slopes.values) else None
