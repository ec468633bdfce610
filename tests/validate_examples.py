"""What the tests of `validate` share: sound profiles, and a layout of files that obeys any mistake."""

from __future__ import annotations

import hashlib
import struct
from dataclasses import replace

import numpy as np
from cmm_examples import WHITE, device_profile, matrix, mid, mvis, program

from iccbrdf.icc import Header, NumberArray, Profile, TagArray, ViewingConditions

CHANNELS = ("kd", "m")
LIT = "env(litX) not if { pop 0.5 } in(0) mul copy(1,2) in(1) mul out(0,3)"
"""A sound program from two channels to three."""


def sound_mid(**tags):
    return mid(CHANNELS, **tags)


def sound_mvis(**tags):
    tags = {"M2B0": program(LIT, 2, 3), **tags}
    return mvis(CHANNELS, defaults=NumberArray("fl32", [1.0, 0.5]), **tags)


def named(*names, array_type="utf8"):
    return TagArray(array_type, TagArray.of_texts(names).items)


def under(XYZ, observer=1, illuminant=2, *, defaults=True, **tags):
    """An MVIS whose viewing conditions are not the standard ones."""
    gains = np.diag(WHITE / XYZ)
    svcn = ViewingConditions(
        observer=observer,
        illuminant=illuminant,
        illuminant_XYZ=tuple(100 * v for v in XYZ),
        surround_XYZ=(0, 0, 0),
    )
    conversions = {"c2sp": matrix(gains), "s2cp": matrix(np.linalg.inv(gains))}
    return mvis(
        CHANNELS,
        illuminant=XYZ,
        defaults=NumberArray("fl32", [1.0, 0.5]) if defaults else None,
        **{"M2B0": program(LIT, 2, 3), "svcn": svcn, **conversions, **tags},
    )


def version_4():
    """An abstract profile of version 4, from Lab to Lab."""
    sound = device_profile("abst", space="Lab ", pcs="Lab ", A2B0=matrix(np.eye(3)))
    return sound.replace(header=replace(sound.header, version=(4, 4, 0)))


def changed(profile, **fields):
    """The profile with other header fields."""
    return profile.replace(header=replace(profile.header, **fields))


def tags_of(profile):
    return {signature: profile.tag_data(signature) for signature in profile}


def laid_out(header: Header, tags):
    """The file of tags as bytes, (signature, data) each, one after the other as they are given."""
    table, body = struct.pack(">I", len(tags)), b""
    start = 128 + 4 + 12 * len(tags)
    for signature, data in tags:
        table += struct.pack(">4sII", signature.encode("latin-1"), start + len(body), len(data))
        body += data + bytes(-len(data) % 4)
    size = start + len(body)
    return signed(replace(header, size=size).to_bytes() + table + body)


def signed(data):
    """`data` with the profile ID that belongs to it."""
    zeroed = data[:44] + bytes(4) + data[48:64] + bytes(4) + data[68:84] + bytes(16) + data[100:]
    if data[8] < 4:
        return data
    return data[:84] + hashlib.md5(zeroed[: int.from_bytes(data[:4], "big")]).digest() + data[100:]


def with_tag(profile: Profile, signature, data):
    """The profile's file with the bytes `data` as one of its tags."""
    return laid_out(profile.header, list((tags_of(profile) | {signature: data}).items()))


def patched(profile: Profile, offset, data):
    """The profile's file with other bytes at an offset."""
    file = profile.to_bytes()
    return signed(file[:offset] + data + file[offset + len(data) :])


def tag_patched(profile: Profile, signature, offset, data):
    """The profile's file with other bytes at an offset in one of its tags."""
    tag = profile.tag_data(signature)
    return with_tag(profile, signature, tag[:offset] + data + tag[offset + len(data) :])
