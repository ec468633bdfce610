"""From a colour MID to the BRDF image: its multiplex channels as the device channels of the binding MID."""

from __future__ import annotations

from collections.abc import Sequence

from iccbrdf.brdf.primaries import Primaries
from iccbrdf.build.profiles import encoding, ranges, text_tags
from iccbrdf.icc import ColorantTable, Header, MultiProcess, Profile, TagArray

IMAGE_TAG = "bimg"
"""Private tag (processing elements) of a colour MID: multiplex channels -> device of the binding MID."""


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
