"""The registered tags: types that they may have, classes that have them, and those that a class must have.

Sources: ICC.1:2010 and ICC.2, clauses 8 and 9.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

_NUMBERS = ("ui08", "ui16", "fl16", "fl32", "fl64")
_TRANSFORM = ("mpet",)
_LUTS = ("mft1", "mft2", "mAB ", "mBA ", "mpet")
_CURVES = ("curv", "para", "curf")
_TEXTS = ("mluc", "text", "desc", "utf8", "ut16")
_STRUCT = ("tstr",)


@dataclass(frozen=True)
class Registered:
    """`types`: allowed ones, none where they are not listed here.  `classes`: of devices, none for any."""

    types: tuple[str, ...] = ()
    classes: tuple[str, ...] = ()


def _family(prefix: str, row: Registered) -> dict[str, Registered]:
    """A tag for each of the four intents."""
    return {f"{prefix}{intent}": row for intent in range(4)}


_MVIS = ("mvis",)
# Newer drafts let output profiles take multiplex channels as well.
_FROM_MULTIPLEX = ("mvis", "prtr")

TAGS: Mapping[str, Registered] = {
    **_family("A2B", Registered((*_LUTS, *_STRUCT))),
    **_family("B2A", Registered(_LUTS)),
    **_family("D2B", Registered(_TRANSFORM)),
    **_family("B2D", Registered(_TRANSFORM)),
    "A2M0": Registered(_TRANSFORM, ("mid ", "scnr")),
    "M2A0": Registered(_TRANSFORM, ("mlnk",)),
    **_family("M2B", Registered(_TRANSFORM, _FROM_MULTIPLEX)),
    **_family("M2S", Registered(_TRANSFORM, _FROM_MULTIPLEX)),
    **_family("bMB", Registered(_STRUCT, _MVIS)),
    **_family("bMS", Registered(_STRUCT, _MVIS)),
    **_family("bcp", Registered(_STRUCT)),
    **_family("bsp", Registered(_STRUCT)),
    **{
        tag: row
        for prefix in ("bAB", "bBA", "bDB", "bBD", "dAB", "dBA", "dDB", "dBD")
        for tag, row in _family(prefix, Registered(_TRANSFORM)).items()
    },
    "mcta": Registered(("tary",), ("mid ", "mvis", "mlnk", "scnr", "prtr")),
    # The types of the defaults have a rule of their own.
    "mdv ": Registered((), ("mvis", "mlnk", "prtr")),
    "svcn": Registered(("svcn",)),
    "c2sp": Registered(_TRANSFORM),
    "s2cp": Registered(_TRANSFORM),
    "swpt": Registered((*_NUMBERS, "smat")),
    "wtpt": Registered(("XYZ ",)),
    "bkpt": Registered(("XYZ ",)),
    "lumi": Registered(("XYZ ",)),
    "rXYZ": Registered(("XYZ ",)),
    "gXYZ": Registered(("XYZ ",)),
    "bXYZ": Registered(("XYZ ",)),
    "rTRC": Registered(_CURVES),
    "gTRC": Registered(_CURVES),
    "bTRC": Registered(_CURVES),
    "kTRC": Registered(_CURVES),
    "chad": Registered(("sf32",)),
    "desc": Registered(_TEXTS),
    "cprt": Registered(_TEXTS),
    "dmnd": Registered(_TEXTS),
    "dmdd": Registered(_TEXTS),
    "vued": Registered(_TEXTS),
    "scrd": Registered(_TEXTS),
    "targ": Registered(("text", "utf8", "ut16", "zut8")),
    "tech": Registered(("sig ",)),
    "ciis": Registered(("sig ",)),
    "rig0": Registered(("sig ",)),
    "rig2": Registered(("sig ",)),
    "calt": Registered(("dtim",)),
    "gamt": Registered(_LUTS),
    "pre0": Registered(_LUTS),
    "pre1": Registered(_LUTS),
    "pre2": Registered(_LUTS),
    "clrt": Registered(("clrt", "tary")),
    "clot": Registered(("clrt", "tary")),
    "clro": Registered(("clro",)),
    "clio": Registered(),
    "chrm": Registered(("chrm",)),
    "meas": Registered(("meas",)),
    "meta": Registered(("dict",)),
    "ncl2": Registered(("ncl2", "tary")),
    "ncol": Registered(("ncol",)),
    "nmcl": Registered(("tary",)),
    "pseq": Registered(("pseq",)),
    "psid": Registered(("psid",)),
    "resp": Registered(("rcs2",)),
    "view": Registered(("view",)),
    "cicp": Registered(("cicp",)),
    "CxF ": Registered(("zxml", "ZXML", "utf8", "zut8", "text")),
    "smap": Registered(("ehim", "enim")),
    "ICC5": Registered(("ICCp",)),
    **{signature: Registered((signature,)) for signature in ("bfd ", "crdi", "devs", "scrn")},
    **dict.fromkeys(("ps2s", "ps2i", "psd0", "psd1", "psd2", "psd3"), Registered(("data",))),
    "ucrb": Registered(),
    **dict.fromkeys(
        ("cept", "csnm", "rfnm", "sdin", "minf", "miin", "psin", "sPCC", "gbd0", "gbd1", "gbd2", "gbd3"),
        Registered(),
    ),
    **dict.fromkeys(("H2S0", "H2S1", "H2S2", "H2S3"), Registered(_TRANSFORM)),
}
"""Tag by signature."""

SIDES: Mapping[str, tuple[str, str]] = {
    tag: sides
    for prefix, sides in {
        "A2B": ("colour_space", "pcs"),
        "B2A": ("pcs", "colour_space"),
        "A2M": ("colour_space", "mcs"),
        "M2A": ("mcs", "colour_space"),
        "M2B": ("mcs", "pcs"),
        "M2S": ("mcs", "spectral_pcs"),
    }.items()
    for tag in (f"{prefix}{intent}" for intent in range(4))
}
"""Header fields that state the spaces on both sides of a transform."""


@dataclass(frozen=True)
class Required:
    """One of `tags` sets must be there whole; `rule` is broken otherwise."""

    rule: str
    tags: tuple[tuple[str, ...], ...]


def _one(rule: str, *tags: str) -> Required:
    return Required(rule, (tags,))


_TEXTUAL = (_one("REQ-001", "desc"), _one("REQ-001", "cprt"))
_WHITE = (_one("REQ-002", "wtpt"),)
_COLORANTS = ("rXYZ", "gXYZ", "bXYZ", "rTRC", "gTRC", "bTRC")
_NAMES = (_one("REQ-004", "mcta"),)


def _any_intent(*prefixes: str) -> tuple[tuple[str, ...], ...]:
    return tuple((f"{prefix}{intent}",) for prefix in prefixes for intent in range(4))


_CLASSIC: Mapping[str, tuple[Required, ...]] = {
    "scnr": (*_WHITE, Required("REQ-003", (("A2B0",), _COLORANTS, ("kTRC",), ("D2B0",)))),
    "mntr": (*_WHITE, Required("REQ-003", (("A2B0",), _COLORANTS, ("kTRC",), ("D2B0",)))),
    "prtr": (*_WHITE, Required("REQ-003", (("A2B0", "B2A0"), ("kTRC",)))),
    "link": (_one("REQ-003", "A2B0"), _one("REQ-005", "pseq")),
    "spac": (*_WHITE, _one("REQ-003", "A2B0", "B2A0")),
    "abst": (*_WHITE, _one("REQ-003", "A2B0")),
    "nmcl": (*_WHITE, _one("REQ-003", "ncl2")),
}
_TO_CONNECTION = ("A2B", "D2B", "bAB", "bDB", "bcp", "bsp")
_MODERN: Mapping[str, tuple[Required, ...]] = {
    "scnr": (Required("REQ-003", (*_any_intent(*_TO_CONNECTION), ("A2M0",), _COLORANTS, ("kTRC",))),),
    "mntr": (Required("REQ-003", (*_any_intent(*_TO_CONNECTION), _COLORANTS, ("kTRC",))),),
    "prtr": (Required("REQ-003", (*_any_intent(*_TO_CONNECTION, "B2A", "B2D", "M2B", "M2S"), ("kTRC",))),),
    "link": (_one("REQ-003", "A2B0"),),
    "spac": (Required("REQ-003", _any_intent(*_TO_CONNECTION, "B2A", "B2D")),),
    "abst": (Required("REQ-003", _any_intent("A2B", "D2B")),),
    "nmcl": (Required("REQ-003", (("ncl2",), ("nmcl",))),),
    "mid ": (_one("REQ-003", "A2M0"), *_NAMES),
    "mlnk": (_one("REQ-003", "M2A0"), *_NAMES),
    "mvis": (Required("REQ-003", _any_intent("M2B", "M2S", "bMB", "bMS")), *_NAMES),
}


def required(version: int, device_class: str) -> tuple[Required, ...]:
    """What a profile of this major version and class must have; nothing but texts for an unknown class."""
    if device_class == "cenc":
        return ()  # a colour encoding profile names an encoding, and its own clause rules it
    table = _MODERN if version >= 5 else _CLASSIC
    return (*_TEXTUAL, *table.get(device_class, ()))
