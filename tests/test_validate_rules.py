"""Every rule: a sound profile does not break it, and the least mistake breaks it and hardly any other."""

import struct
from dataclasses import replace

import numpy as np
import pytest
from cmm_examples import device_profile, matrix, mid, mvis, program
from validate_examples import (
    changed,
    laid_out,
    named,
    patched,
    signed,
    sound_mid,
    sound_mvis,
    tag_patched,
    tags_of,
    under,
    version_4,
    with_tag,
)

from iccbrdf.calc.program import Temporary, parse
from iccbrdf.errors import ProfileWarning
from iccbrdf.icc import (
    MCS_SUBSET,
    XYZ,
    Chromaticity,
    Clut,
    ColorantOrder,
    CompressedUtf8,
    CurveSet,
    EmbeddedProfile,
    FormulaSegment,
    LocalisedText,
    Matrix,
    Measurement,
    Mluc,
    MultiProcess,
    NamedColour,
    NamedColours,
    NumberArray,
    PlainText,
    Profile,
    Screen,
    Screening,
    SegmentedCurve,
    TagArray,
    TextDescription,
    Unknown,
    UnknownElement,
    Utf8,
    ViewingConditions,
    read_profile,
)
from iccbrdf.icc.source_tag import CalculatorSource, Source
from iccbrdf.resources import folder
from iccbrdf.validate import RULES, validate, validate_pair

SHIPPED = sorted(folder("profiles").glob("*/*.icc"))
TABLE_V4 = read_profile(folder("profiles") / "fogra39_gloss" / "table-v4.icc")
D65 = (0.95, 1.0, 1.09)


def running(text, elements=()):
    """An MVIS with another program."""
    return sound_mvis(M2B0=program(text, 2, 3, elements))


COMPILES = "output A B C = kd * m"


def made_from(output, **fields):
    """An MVIS that says what its program is compiled from, which is to be that of COMPILES."""
    text = f"model one\ninput kd\ninput m\n{output}\n"
    fields = {"inputs": ("kd", "m"), "outputs": ("A", "B", "C"), "templates": ((text, "one.calc"),), **fields}
    tag = Source((CalculatorSource("M2B0", **fields),)).tag()
    return sound_mvis(M2B0=program("in(0,2) mul copy(1,2) out(0,3)", 2, 3), bsrc=tag)


def test_a_source_that_compiles_to_its_program():
    assert fired(made_from(COMPILES)) == {"TAG-009"}


def test_a_profile_whose_program_was_changed_is_told_of():
    profile = read_profile(folder("profiles") / "fogra39_gloss" / "mvis.icc")
    (calculator,) = profile["M2B0"].elements
    other = replace(calculator, program=(*calculator.program, *parse("0 pop")))
    report = validate(profile.replace(tags={"M2B0": MultiProcess.of(other)}).to_bytes())
    (found,) = (finding for finding in report.findings if finding.rule.id == "SRC-002")
    assert "tag M2B0, element 0: the source compiles to another program, of 144 operations, found 146" in (
        found.text
    )


def transforming(*elements):
    """A MID with other elements."""
    return sound_mid(A2M0=MultiProcess(2, 2, elements))


def scanner():
    """An input profile of version 5."""
    return device_profile("scnr", A2B0=matrix(np.eye(3)))


def spectral(**fields):
    """A scanner's spectra, 31 of them from 400 to 700 nm."""
    fields = {"spectral_pcs": "rs001f", "spectral_range": (400, 700), "spectral_steps": 31, **fields}
    return changed(scanner(), **fields)


def encoding():
    """A colour encoding of version 5 that is told by its name alone."""
    profile = device_profile("cenc").replace(tags={"rfnm": Utf8("sRGB")}, remove=["wtpt"])
    return changed(profile, pcs="", illuminant=(0, 0, 0))


def named_colours():
    """Spectra of named colours, without a device space."""
    profile = device_profile("nmcl").replace(tags={"ncl2": TagArray("ncol", ())})
    return changed(
        profile, colour_space="", pcs="", spectral_pcs="rs001f", spectral_range=(400, 700), spectral_steps=31
    )


def conditions(**fields):
    stated = {"observer": 1, "illuminant": 2, "illuminant_XYZ": (95, 100, 109), "surround_XYZ": (0, 0, 0)}
    return under(D65, svcn=ViewingConditions(**stated | fields))


def without_id():
    data = sound_mid().to_bytes()
    return data[:84] + bytes(16) + data[100:]


def altered():
    data = bytearray(sound_mid().to_bytes())
    data[data.index(b"\0e\0x\0a") + 1] ^= 2  # a letter of the description
    return bytes(data)


def odd_size():
    """One byte short, which the last tag's padding can spare."""
    data = sound_mid(zzzz=NumberArray("ui08", [1])).to_bytes()
    return signed(struct.pack(">I", len(data) - 1) + data[4:-1])


def with_rows(profile, *rows):
    return laid_out(profile.header, [*tags_of(profile).items(), *rows])


def long_table():
    """As many rows as make one too many, all for the same bytes."""
    return with_rows(sound_mid(), *[("desc", b"") for _ in range(1021)])


def read(profile):
    """The profile as its file is read: with the offsets of its tags."""
    return Profile.from_bytes(profile.to_bytes())


def row_patched(profile, signature, at, value):
    """The profile's file with another number in a row of its tag table, 4 for the offset, 8 for the size."""
    return patched(profile, 132 + 12 * list(profile).index(signature) + at, struct.pack(">I", value))


def shifted():
    """The last tag begins two bytes later than it might."""
    profile = read(sound_mid(zzzz=NumberArray("ui08", [1, 2, 3, 4])))
    file, offset = profile.to_bytes(), profile.tag_offset("zzzz")
    moved = row_patched(profile, "zzzz", 4, offset + 2)[:offset] + bytes(2) + file[offset:] + bytes(2)
    return signed(struct.pack(">I", len(moved)) + moved[4:])


def overlapping():
    """The tag cprt claims four bytes of the next one."""
    return row_patched(sound_mid(), "cprt", 8, len(sound_mid().tag_data("cprt")) + 4)


def gap():
    """Four bytes more before the end."""
    data = sound_mid().to_bytes() + bytes(4)
    return signed(struct.pack(">I", len(data)) + data[4:])


def warning_type(monkeypatch):
    """A tag type whose reader warns."""
    read = Utf8.read.__func__

    def warn(cls, reader):
        import warnings

        warnings.warn(f"{reader.where}: tolerated", ProfileWarning, stacklevel=1)
        return read(cls, reader)

    monkeypatch.setattr(Utf8, "read", classmethod(warn))
    return sound_mid()


def broken_chain():
    """The second of two elements takes three channels, although the first one gives two."""
    two, three = Matrix.of(np.eye(2)).to_bytes(), Matrix.of(np.eye(2, 3)).to_bytes()
    head = struct.pack(">4s4xHHIIIII", b"mpet", 2, 2, 2, 32, len(two), 32 + len(two), len(three))
    return with_tag(sound_mid(), "A2M0", head + two + three)


def no_offsets():
    """A matrix that ends with its coefficients."""
    element = Matrix.of(np.eye(2)).to_bytes()[:-8]
    head = struct.pack(">4s4xHHIII", b"mpet", 2, 2, 1, 24, len(element))
    return with_tag(sound_mid(), "A2M0", head + element)


def overstated():
    """The function of a calculator claims eight bytes of the element behind it."""
    sound = running("in(0,2) mtx(0) out(0,3)", (Matrix.of(np.ones((3, 2))),))
    size = int.from_bytes(sound.tag_data("M2B0")[44:48], "big")
    return tag_patched(sound, "M2B0", 44, struct.pack(">I", size + 8))


def nested_too_deep():
    tag = Utf8("a")
    for _ in range(33):
        tag = TagArray("utf8", (tag,))
    return sound_mid(zzzz=tag)


def curves(*parameters):
    curve = SegmentedCurve((), (FormulaSegment(0, parameters),))
    return transforming(CurveSet((curve, curve)))


BROKEN = [
    ("HDR-001", lambda: patched(sound_mid(), 36, b"ascp"), ""),
    ("HDR-001", lambda: sound_mid().to_bytes()[:120], ""),
    ("HDR-002", lambda: sound_mid().to_bytes()[:-4], "TAB-004"),
    ("HDR-003", lambda: sound_mid().to_bytes() + bytes(4), ""),
    ("HDR-004", odd_size, "TAG-009"),
    ("HDR-005", lambda: patched(version_4(), 8, b"\3"), ""),
    ("HDR-006", lambda: changed(sound_mvis(), device_class="mviz"), "TAG-007"),
    ("HDR-007", lambda: changed(sound_mid(), colour_space="nope"), ""),
    ("HDR-007", lambda: changed(sound_mid(), colour_space=""), ""),
    ("HDR-007", lambda: changed(named_colours(), colour_space="nope"), ""),
    ("HDR-008", lambda: changed(sound_mvis(), colour_space="RGB "), ""),
    ("HDR-009", lambda: changed(sound_mvis(), pcs="RGB "), ""),
    ("HDR-009", lambda: changed(sound_mid(), pcs="XYZ "), ""),
    ("HDR-010", lambda: changed(sound_mid(), mcs=""), ""),
    ("HDR-010", lambda: changed(sound_mid(), mcs="nc0002"), ""),
    ("HDR-011", lambda: changed(sound_mid(), reserved=b"\0\0\0\1"), ""),
    ("HDR-011", lambda: changed(sound_mid(), flags=1 << 4), ""),
    ("HDR-011", lambda: patched(version_4(), 100, b"\1"), ""),
    ("HDR-012", lambda: changed(sound_mid(), rendering_intent=4), ""),
    ("HDR-013", lambda: changed(sound_mvis(), illuminant=(0, 0, 0)), ""),
    ("HDR-013", lambda: changed(version_4(), illuminant=D65), ""),
    ("HDR-014", lambda: changed(sound_mid(), created=(2020, 2, 30, 0, 0, 0)), ""),
    ("HDR-015", lambda: changed(sound_mid(), platform="APPI"), ""),
    ("HDR-016", lambda: spectral(spectral_range=(700, 400)), ""),
    ("HDR-016", lambda: spectral(spectral_steps=30), ""),
    ("HDR-017", lambda: changed(scanner(), flags=MCS_SUBSET), ""),
    ("PID-001", altered, ""),
    ("PID-002", without_id, ""),
    ("TAB-001", lambda: sound_mid().to_bytes()[:128], "HDR-002 REQ-001 REQ-003 REQ-004"),
    ("TAB-001", lambda: patched(sound_mid(), 128, b"\0\0\1\0"),
     "TAB-003 TAB-004 TAB-005 TAB-007 TAG-004 TAG-006 TAG-009"),
    ("TAB-002", long_table, "TAB-003 TAB-007 ALL-001"),
    ("TAB-003", lambda: with_rows(sound_mid(), ("desc", sound_mid().tag_data("cprt"))), ""),
    ("TAB-004", lambda: row_patched(sound_mid(), "A2M0", 4, 10_000), ""),
    ("TAB-005", shifted, "TAG-009"),
    ("TAB-006", overlapping, ""),
    ("TAB-007", lambda: with_tag(sound_mid(), "wtpt", b"XYZ "), ""),
    ("TAB-008", gap, ""),
    ("TAG-001", lambda: tag_patched(sound_mid(), "mcta", 12, b"\xff\xff\xff\xff"), ""),
    ("TAG-002", nested_too_deep, "TAG-009"),
    ("TAG-004", lambda: sound_mid(ucrb=Unknown("zzzz", bytes(4), b"")), ""),
    ("TAG-005", lambda: sound_mid(cprt=XYZ.of(1, 1, 1)), ""),
    ("TAG-005", lambda: changed(version_4(), version=(4, 4, 0)).replace(tags={"desc": PlainText("a")}), ""),
    ("TAG-006", lambda: tag_patched(sound_mid(), "desc", 7, b"\1"), ""),
    ("TAG-007", lambda: sound_mid(M2B0=matrix(np.eye(3, 2))), ""),
    ("TAG-008", lambda: sound_mid(a2m0=matrix(np.eye(2))), ""),
    ("TAG-009", lambda: sound_mid(zzzz=XYZ.of(1, 1, 1)), ""),
    ("TAG-010", lambda: sound_mid(ICC5=EmbeddedProfile(sound_mid().to_bytes()[:200])), ""),
    ("TAG-011", lambda: sound_mid(chrm=Chromaticity(9, ())), ""),
    ("TAG-011", lambda: sound_mid(meas=Measurement(1, (0, 0, 0), 3, 0.5, 1)), ""),
    ("TAG-011", lambda: sound_mid(scrn=Screening(0, (Screen(150, 45, 8),))), ""),
    ("TAG-012", lambda: sound_mid(clro=ColorantOrder((1, 1))), ""),
    ("TAG-012", lambda: sound_mid(clro=ColorantOrder((1, 2, 3))), ""),
    ("TAG-013", lambda: sound_mid(ncl2=NamedColours((NamedColour("a", (0, 0, 0), (1,)),), 1)), ""),
    ("TAG-014", lambda: sound_mid(ncl2=NamedColours((NamedColour("a", (0, 0, 0)),) * 2)), ""),
    ("REQ-001", lambda: sound_mid().replace(remove=["desc"]), ""),
    ("REQ-001", lambda: sound_mid().replace(remove=["cprt"]), ""),
    ("REQ-002", lambda: sound_mvis().replace(remove=["wtpt"]), ""),
    ("REQ-002", lambda: version_4().replace(remove=["wtpt"]), ""),
    ("REQ-003", lambda: sound_mid().replace(remove=["A2M0"]), ""),
    ("REQ-003", lambda: sound_mvis().replace(remove=["M2B0"]), ""),
    ("REQ-003", lambda: version_4().replace(remove=["A2B0"]), ""),
    ("REQ-003", lambda: TABLE_V4.replace(remove=["B2A0"]), ""),
    ("REQ-004", lambda: sound_mid().replace(remove=["mcta"]), ""),
    ("REQ-005", lambda: TABLE_V4.replace(remove=["gamt"]), ""),
    ("REQ-005", lambda: TABLE_V4.replace(remove=["clrt"]), ""),
    ("REQ-006", lambda: sound_mvis().replace(remove=["mdv "]), ""),
    ("TXT-001", lambda: sound_mid(desc=Mluc.of(" ")), ""),
    ("TXT-001", lambda: sound_mid(desc=Mluc(())), ""),
    ("TXT-002", lambda: sound_mid(desc=Mluc.of("text", "EN", "us")), ""),
    ("TXT-003", lambda: sound_mid(desc=Mluc.of("a\0b")), ""),
    ("TXT-004", lambda: sound_mid(desc=Mluc((LocalisedText("en", "GB", "colour"),) * 2)), ""),
    ("TXT-005", lambda: changed(sound_mid(dmnd=TextDescription("é")), version=(5, 0, 0)), ""),
    ("TXT-005", lambda: sound_mid(cprt=PlainText("© me")), ""),
    ("MCS-001", lambda: sound_mid(mcta=TagArray("utf8", (Utf8("kd"), XYZ.of(1, 1, 1)))), ""),
    ("MCS-002", lambda: sound_mid(mcta=named("kd", "m", "n")), ""),
    ("MCS-003", lambda: sound_mid(mcta=named("kd", "kd")), ""),
    ("MCS-004", lambda: sound_mid(mcta=named("kd", "m", array_type="mcta")), ""),
    ("MCS-005", lambda: sound_mid(mcta=named("kd", "m", array_type="text")), ""),
    ("MCS-006", lambda: sound_mid(mcta=named("kd", "Kd")), ""),
    ("MCS-006", lambda: sound_mid(mcta=named("kd", "m ")), ""),
    ("MCS-007", lambda: sound_mvis(**{"mdv ": NumberArray("ui32", [1, 1])}), ""),
    ("MCS-008", lambda: sound_mvis(**{"mdv ": NumberArray("fl32", [1])}), ""),
    ("MCS-009", lambda: sound_mvis(**{"mdv ": NumberArray("fl32", [1, np.inf])}), ""),
    ("MPE-001", lambda: with_tag(sound_mvis(), "M2B1", matrix(np.eye(2)).to_bytes()), ""),
    ("MPE-001", lambda: under(D65, c2sp=matrix(np.eye(3, 2))), ""),
    ("MPE-001", lambda: changed(TABLE_V4, colour_space="6CLR"), ""),
    ("MPE-002", broken_chain, ""),
    ("MPE-003", lambda: tag_patched(transforming(Clut(np.zeros((2, 2, 2)))), "A2M0", 36, b"\1"), ""),
    ("MPE-004", lambda: transforming(), ""),
    ("MPE-005", lambda: transforming(UnknownElement("zzzz", bytes(4), 2, 2, b"")), ""),
    ("MPE-006", lambda: tag_patched(sound_mid(), "A2M0", 24 + 7, b"\1"), ""),
    ("MPE-007", lambda: transforming(UnknownElement("zzzz", bytes(4), 2, 0, b""),
                                     Matrix(0, np.zeros((2, 0)), [1, 1])), "MPE-005"),
    ("MPE-008", lambda: transforming(Matrix.of([[np.nan, 0], [0, 1]])), ""),
    ("MPE-008", lambda: transforming(Clut(np.full((2, 2, 2), np.inf))), ""),
    ("MPE-008", lambda: curves(1, np.nan, 0, 0), ""),
    ("MPE-009", no_offsets, ""),
    ("PRG-001", lambda: running("in(0,2) 1 add(2) out(0,3)"), ""),
    ("PRG-001", lambda: tag_patched(sound_mvis(), "M2B0", 60, b"fnv "), ""),
    ("PRG-002", overstated, ""),
    ("PRG-003", lambda: running("env(ndef) pop in(0,2) out(1,2) out(0)"), ""),
    ("PRG-004", lambda: running("env(litx) pop in(0,2) out(0,3)"), ""),
    ("PRG-005", lambda: running("env(6c697400) pop in(0,2) out(0,3)"), ""),
    ("PRG-006", lambda: running("in(0) copy(1,2) out(0,3)"), ""),
    ("PRG-007", lambda: running("in(0,2) out(0,2)"), ""),
    ("PRG-007", lambda: running("in(0,2) out(0,2) in(0) if { 1 out(2) }"), ""),
    ("PRG-008", lambda: running("in(0,2) tget(7) out(0,3)"), ""),
    ("PRG-008", lambda: running("in(0) sel case { 1 tput(0) } in(0,2) tget(0) out(0,3)"), ""),
    ("PRG-009", lambda: running("in(0,2) in(0) 0 div out(0,3)"), ""),
    ("PRG-009", lambda: running("in(0,2) -1 sqrt out(0,3)"), ""),
    ("PRG-010", lambda: running("7 in(0,2) in(0) out(0,3)"), ""),
    ("PRG-011", lambda: running("in(0,2) in(0) out(0,3)", (Matrix.of(np.eye(2)),)), ""),
    ("REF-001", lambda: running("in(0,2) scnt out(0,3)"), ""),
    ("REF-002", lambda: running("in(0) in(0) in(0) in(0) in(0,2) solv(2,2) out(0,3)"), ""),
    ("REF-003", lambda: running("in(0,2) in(0) out(0,3) in(0) if { 1 pop } else { }"), ""),
    ("PCC-001", lambda: conditions(illuminant=23), ""),
    ("PCC-001", lambda: conditions(observer=0), ""),
    ("PCC-001", lambda: conditions(illuminant=9, cct=0), ""),
    ("PCC-002", lambda: conditions(illuminant_range=(700, 400), spd=[1, 1]), ""),
    ("PCC-002", lambda: conditions(illuminant_range=(400, 700), spd=[1, np.nan]), ""),
    ("PCC-002", lambda: conditions(illuminant_XYZ=(95, 0, 109)), ""),
    ("PCC-003", lambda: changed(under(D65), illuminant=(0.95, 1, 1.0)), ""),
    ("PCC-004", lambda: under(D65).replace(remove=["c2sp"]), ""),
    ("PCC-005", lambda: changed(sound_mvis(), illuminant=D65), ""),
    ("PCC-006", lambda: under(D65, s2cp=matrix(np.eye(3))), ""),
    ("PCC-007", lambda: sound_mvis(wtpt=XYZ.of(0.9, 1, 0)), ""),
    ("ALL-001", lambda: sound_mid(**{f"{i:04d}": Mluc.of(str(i)) for i in range(1001)}), "TAG-009"),
    ("SRC-001", lambda: sound_mvis(bsrc=CompressedUtf8.of("{")), "TAG-009"),
    ("SRC-001", lambda: sound_mvis(bsrc=CompressedUtf8.of(" " * (1 << 20))), "TAG-009"),
    ("SRC-002", lambda: made_from("output A B C = 2 * kd"), "TAG-009"),
    ("SRC-002", lambda: made_from("output A B C = kb"), "TAG-009"),
    ("SRC-002", lambda: made_from("output A B C = total k = 1 to 99999999 { kd / k }"), "TAG-009"),
    ("SRC-002", lambda: made_from(COMPILES, inputs=("kd", "ks")), "TAG-009"),
    ("SRC-002", lambda: made_from(COMPILES, outputs=("A", "B", "C", "D")), "TAG-009"),
    ("SRC-002", lambda: made_from(COMPILES, element=1), "TAG-009"),
    ("SRC-002", lambda: made_from(COMPILES, temporaries=(Temporary("half", 0),)), "TAG-009"),
]  # fmt: skip
"""A rule, what breaks it, and the rules that break with it."""

PAIRS = [
    ("LNK-001", ["kd", "m"], ["ks"], {}, "LNK-003 LNK-004"),
    ("LNK-001", ["kd", "m"], ["kd"], {"subset": True}, "LNK-004"),
    ("LNK-002", ["kd", "m"], ["kd", "M"], {"defaults": True}, "LNK-004"),
    ("LNK-003", ["kd"], ["kd", "m"], {"defaults": True}, ""),
    ("LNK-004", ["kd", "m"], ["kd"], {}, ""),
    ("LNK-005", ["kd", "m"], ["m", "kd"], {"subset": True}, ""),
]
"""A rule, the channels of a MID and an MVIS that break it, what else they have, rules that break with it."""


def fired(made):
    data = made.to_bytes() if isinstance(made, Profile) else made
    return {found.rule.id for found in validate(data, "x.icc").findings}


def a_pair(given, taken, options):
    one = mid(given, subset=options.get("subset", False))
    defaults = NumberArray("fl32", [0.5] * len(taken)) if options.get("defaults") else None
    other = mvis(taken, defaults=defaults, M2B0=matrix(np.ones((3, len(taken)))))
    return (one.to_bytes(), "mid.icc"), (other.to_bytes(), "mvis.icc")


@pytest.mark.parametrize(
    "make",
    [sound_mid, sound_mvis, lambda: under(D65), version_4, scanner, spectral, encoding, named_colours],
)
def test_sound_profiles_break_nothing(make):
    assert fired(make()) == set()


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_shipped_profiles_are_sound(path):
    report = validate(path.read_bytes(), str(path))
    assert report.count("error") == report.count("warning") == 0
    assert {found.rule.id for found in report.findings} <= {"TAG-009"}


@pytest.mark.parametrize(
    ("rule", "make", "besides"), BROKEN, ids=[f"{rule}-{i}" for i, (rule, *_) in enumerate(BROKEN)]
)
def test_broken(rule, make, besides):
    assert fired(make()) == {rule, *besides.split()}


def test_tolerated(monkeypatch):
    assert fired(warning_type(monkeypatch)) == {"TAG-003"}


@pytest.mark.parametrize(("rule", "given", "taken", "options", "besides"), PAIRS)
def test_broken_pairs(rule, given, taken, options, besides):
    report = validate_pair(*a_pair(given, taken, options))
    assert {found.rule.id for found in report.findings} == {rule, *besides.split()}


def test_a_sound_pair_breaks_nothing():
    report = validate_pair((sound_mid().to_bytes(), "mid.icc"), (sound_mvis().to_bytes(), "mvis.icc"))
    assert report.findings == ()
    assert report.source == "mid.icc + mvis.icc"


def test_every_rule_is_broken_here():
    elsewhere = {"TAG-003", *(rule for rule in RULES if rule.startswith("NUM"))}
    assert {rule for rule, *_ in BROKEN + PAIRS} | elsewhere == set(RULES)


def test_rules_are_whole():
    for rule in RULES.values():
        assert rule.text.endswith(".")
        assert rule.basis
