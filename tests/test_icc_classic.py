"""The tag types of versions 2 and 4, of printers, of other profiles, and of sparse matrices."""

import tracemalloc
import warnings

import iccdev
import numpy as np
import pytest
from icc_examples import unhex

from iccbrdf.errors import LimitError, ProfileError, ProfileWarning, UsageError
from iccbrdf.icc import (
    TAGS,
    XYZ,
    BlackGeneration,
    Chromaticity,
    ColorantOrder,
    Combination,
    CrdInfo,
    DataTag,
    DeviceSettings,
    EmbeddedProfile,
    Header,
    Measurement,
    Mluc,
    NamedColour,
    NamedColours,
    PlainViewingConditions,
    PlatformSettings,
    Profile,
    ProfileDescription,
    ProfileIdentities,
    ProfileIdentity,
    ProfileSequence,
    ResponseCurve,
    ResponseCurves,
    Screen,
    Screening,
    Setting,
    SignatureTag,
    SparseMatrix,
    SparseMatrixArray,
    TextDescription,
    describe,
    to_dict,
)
from iccbrdf.icc.reader import MAX_PARTS, Reader
from iccbrdf.icc.text import MAX_PROFILES
from iccbrdf.icc.xml import profile_from_xml, profile_to_xml

MLUC_A = "6d6c7563 00000000 00000001 0000000c 656e 5553 00000002 0000001c 0061"
MLUC_BC = "6d6c7563 00000000 00000001 0000000c 656e 5553 00000004 0000001c 00620063"
ROOT = Profile(Header(device_class="spac"), {"cprt": Mluc.of("a")})

EXAMPLES = {
    "desc": (
        TextDescription("Ab", "θ", 0x656E5553, 1, 2, b"xy".ljust(67, b"\0")),
        "64657363 00000000  00000003 4162 00  656e5553 00000002 03b8 0000  0001 02 7879" + "00" * 65,
    ),
    "desc, in short": (
        TextDescription("Ab", macintosh_size=1, macintosh=b"\0"),
        "64657363 00000000  00000003 4162 00  00000000 00000000  0000 01 00",
    ),
    "view": (
        PlainViewingConditions((19.5, 20, 16), (4, 4, 3.25), 1),
        """
        76696577 00000000
        00138000 00140000 00100000  # illuminant, cd/m2
        00040000 00040000 00034000  # surround
        00000001                    # D50
        """,
    ),
    "meas": (
        Measurement(1, (0, 0, 0.5), 2, 1.0, 2),
        """
        6d656173 00000000
        00000001                    # CIE 1931
        00000000 00000000 00008000  # backing
        00000002 00010000 00000002  # 0/d, all of it flare, D65
        """,
    ),
    "chrm": (
        Chromaticity(1, ((0.5, 0.25), (1, 40000))),
        "6368726d 00000000  0002 0001  00008000 00004000  00010000 9c400000",
    ),
    "clro": (ColorantOrder((3, 0, 1)), "636c726f 00000000  00000003 03 00 01"),
    "ncl2": (
        NamedColours((NamedColour("a", (1, 0x8000, 0xFFFF), (7,)),), 1, "p", "", 5),
        "6e636c32 00000000  00000005 00000001 00000001" + "70" + "00" * 31 + "00" * 32
        + "61" + "00" * 31 + "0001 8000 ffff  0007",
    ),
    "data": (DataTag(1, b"\1\2\3"), "64617461 00000000  00000001 010203"),
    "rcs2": (
        ResponseCurves(
            2, (ResponseCurve("StaT", ((1, 1, 1), (0, 0, 0.5)), ([[0, -0.25], [65535, 1.5]], [[3, 0.5]])),)
        ),
        """
        72637332 00000000
        0002 0001                   # two channels, one kind of density
        00000010                    # at 16
        53746154 00000002 00000001  # StaT: two and one measurements
        00010000 00010000 00010000  00000000 00000000 00008000
        0000 0000 ffffc000  ffff 0000 00018000
        0003 0000 00008000
        """,
    ),
    "crdi": (
        CrdInfo("P1", ("a", "", "", "bc")),
        """
        63726469 00000000
        00000003 5031 00  00000002 61 00  00000001 00  00000001 00  00000003 6263 00
        """,
    ),
    "scrn": (
        Screening(1, (Screen(150, -15, 2),)),
        "7363726e 00000000  00000001 00000001  00960000 fff10000 00000002",
    ),
    "bfd": (
        BlackGeneration([0, 65535], [50], "GCR"),
        "62666420 00000000  00000002 0000 ffff  00000001 0032  47435200",
    ),
    "devs": (
        DeviceSettings((PlatformSettings("MSFT", (Combination((Setting("mtyp", 4, b"\0\0\0\1" * 2),)),)),)),
        """
        64657673 00000000 00000001  # one platform
        4d534654 00000028 00000001  # MSFT, 40 bytes, one combination
        0000001c 00000001           # 28 bytes, one setting
        6d747970 00000004 00000002 00000001 00000001
        """,
    ),
    "pseq": (
        ProfileSequence(
            (
                ProfileDescription("abcd", "", 2**63 + 2, "CRT ", Mluc.of("a"), Mluc.of("bc")),
                ProfileDescription("abcd", "", 0, "", Mluc.of("bc"), Mluc.of("a")),
            )
        ),
        f"""
        70736571 00000000 00000002
        61626364 00000000 8000000000000002 43525420  {MLUC_A} 0000  {MLUC_BC}
        61626364 00000000 0000000000000000 00000000  {MLUC_BC}  {MLUC_A} 0000
        """,
    ),
    "pseq, not aligned": (
        ProfileSequence((ProfileDescription("abcd", "", 0, "", Mluc.of("a"), Mluc.of("a")),) * 2, False),
        "70736571 00000000 00000002"
        + f"61626364 00000000 0000000000000000 00000000 {MLUC_A} {MLUC_A}" * 2,
    ),
    "pseq, version 2": (
        ProfileSequence((ProfileDescription("", "", 0, "", TextDescription("Ab"), TextDescription("")),)),
        "70736571 00000000 00000001" + "00" * 20
        + "64657363 00000000  00000003 4162 00" + "00" * (8 + 3 + 67)
        + "64657363 00000000  00000001 00" + "00" * (8 + 3 + 67),
    ),
    "psid": (
        ProfileIdentities((ProfileIdentity(bytes(range(16)), Mluc.of("a")),)),
        f"70736964 00000000 00000001  00000014 0000002e  000102030405060708090a0b0c0d0e0f {MLUC_A}",
    ),
    "smat": (
        SparseMatrixArray(36, 4, (SparseMatrix.of([[0, 1.5], [0, 0], [-1, 2]]),)),
        """
        736d6174 00000000
        0024 0004 00000001          # 36 channels, float32, one matrix
        0003 0002                   # 3 x 2
        0000 0001 0001 0003         # where the rows begin
        0001 0000 0001 0000         # columns, filled up
        3fc00000 bf800000 40000000
        """,
    ),
    "smat, 8 bits": (
        SparseMatrixArray(9, 1, (SparseMatrix.of([[0.2, 0, 1]]), SparseMatrix.of([[0]]))),
        "736d6174 00000000 0009 0001 00000002  0001 0003  0000 0002  0000 0002  33 ff 0000"
        "0001 0001 0000 0000",
    ),
    "ICCp": (EmbeddedProfile.of(ROOT), "49434370 00000000" + ROOT.to_bytes().hex()),
}  # fmt: skip


def read(data):
    return TAGS.read(Reader(data, "a.icc", "tag test"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_bytes_and_object(name):
    tag, text = EXAMPLES[name]
    assert tag.to_bytes() == unhex(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read(unhex(text))
    assert type(found) is type(tag)
    assert found == tag
    assert found.to_bytes() == unhex(text)


REFERENCE = {
    "desc": "dmnd",
    "view": "view",
    "meas": "meas",
    "chrm": "chrm",
    "clro": "clro",
    "ncl2": "ncl2",
    "data": "ps2s",
    "rcs2": "resp",
    "pseq": "pseq",
    "pseq, not aligned": "pseq",
    "pseq, version 2": "pseq",
    "psid": "psid",
    "smat": "swpt",
    "ICCp": "ICC5",
}
"""The tag that has an example in a profile for the ICC's own library."""


@pytest.mark.parametrize("name", REFERENCE)
def test_the_reference_finds_nothing_wrong(name, tmp_path):
    tags = {"desc": Mluc.of("a"), "cprt": Mluc.of("a"), "wtpt": XYZ.of(0.9642, 1, 0.8249)}
    header = Header(device_class="mntr", colour_space="RGB ", pcs="XYZ ", version=(4, 4, 0))
    data = Profile(header, {**tags, REFERENCE[name]: EXAMPLES[name][0]}).to_bytes()
    last_size = 132 + 12 * len(tags) + 8
    short = data[:last_size] + (10).to_bytes(4, "big") + data[last_size + 4 :]
    for given, wrong in ((data, False), (short, True)):
        path = tmp_path / "a.icc"
        path.write_bytes(given)
        report = iccdev.validate_profile_file(path).report
        assert ("Tag has invalid structure" in report) == wrong, report


@pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")
@pytest.mark.parametrize("name", EXAMPLES)
def test_no_truncation_passes_unseen(name):
    tag, text = EXAMPLES[name]
    data = unhex(text)
    for size in range(len(data)):
        try:
            found = read(data[:size])
        except ProfileError as error:
            assert "a.icc: tag test" in str(error)  # noqa: PT017
        else:
            # What has no end of its own, or may be cut off.
            assert name.startswith(("desc", "data", "bfd", "pseq", "ICCp"))
            assert found != tag or name in ("bfd", "pseq")


@pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")
def test_what_is_cut_off_of_a_description_is_told_of():
    data = unhex(EXAMPLES["desc"][1])
    with pytest.warns(ProfileWarning, match="byte offset 15: language: found 0 bytes, expected 4"):
        assert read(data[:15]) == TextDescription("Ab", macintosh=b"")


def test_values_as_they_are_read():
    curves = read(unhex(EXAMPLES["rcs2"][1])).curves
    np.testing.assert_array_equal(curves[0].responses[0], [[0, -0.25], [65535, 1.5]])
    assert curves[0].maxima[1] == (0, 0, 0.5)
    (matrix,) = read(unhex(EXAMPLES["smat"][1])).matrices
    assert (matrix.rows, matrix.columns) == (3, 2)
    np.testing.assert_array_equal(matrix.starts, [0, 1, 1, 3])
    np.testing.assert_array_equal(matrix.indices, [1, 0, 1])
    np.testing.assert_array_equal(matrix.values, [1.5, -1, 2])
    assert read(unhex(EXAMPLES["ICCp"][1])).profile["cprt"].text == "a"
    assert read(unhex(EXAMPLES["pseq"][1])).profiles[1].model_text.text == "a"


def test_curves_that_share_their_bytes_are_one():
    tag = EXAMPLES["rcs2"][0]
    both = ResponseCurves(2, tag.curves * 2)
    assert len(both.to_bytes()) == len(tag.to_bytes()) + 4
    first, second = read(both.to_bytes()).curves
    assert first is second
    assert first == tag.curves[0]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TextDescription("€"), "expected latin-1 text"),
        (lambda: TextDescription("a", macintosh=bytes(68)), "expected up to 67"),
        (lambda: Chromaticity(0, ((0.1, -0.1),)), "found -0.1, expected 0 to 65535.99998"),
        (lambda: ColorantOrder((256,)), "expected 0 to 255"),
        (lambda: NamedColour("", (0, 0, 0)), "name: found '', expected 1 to 31"),
        (lambda: NamedColours((NamedColour("a", (0, 0, 0), (1,)),)), "found 1 device values, expected 0"),
        (lambda: NamedColours((), 17), "channels: found 17, expected 0 to 16"),
        (lambda: NamedColours((SignatureTag("abcd"),)), "expected a NamedColour"),
        (lambda: ResponseCurve("StaT", ((1, 1, 1),), ()), "found 1 maxima and 0 responses"),
        (lambda: ResponseCurve("StaT", ((1, 1, 1),), ([[0.5, 0]],)), "which uint16 cannot hold"),
        (lambda: ResponseCurve("StaT", ((1, 1, 1),), ([[0, 4e4]],)), "which int32 cannot hold"),
        (lambda: ResponseCurve("StaT", ((1, 1, 1),), ([0],)), "expected pairs"),
        (lambda: ResponseCurves(2, (ResponseCurve("StaT", (), ()),)), "found 0 channels, expected 2"),
        (lambda: Setting("rsln", 8, bytes(9)), "found 9 bytes, expected values of 8"),
        (lambda: Setting("rsln", 0, b"a"), "expected values of 0"),
        (lambda: ProfileSequence((ProfileDescription("", "", 0, "", Mluc.of("a"), "b"),)), "model_text"),
        (lambda: ProfileIdentity(bytes(16), SignatureTag("abcd")), "found type 'sig ', expected 'mluc'"),
        (lambda: SparseMatrix(1, 2, [0, 2], [1, 0], [1, 2]), "two of a row that do not increase"),
        (lambda: SparseMatrix(1, 2, [0, 1], [2], [1]), "found 2, expected less than 2"),
        (lambda: SparseMatrix(2, 2, [0, 2, 1], [0], [1]), "a row that ends before it begins"),
        (lambda: SparseMatrix(2, 2, [0, 1], [0], [1]), "expected 3 of them from 0 to 1"),
        (lambda: SparseMatrixArray(1, 1, (SparseMatrix.of([[2]]),)), "outside 0..1"),
        (lambda: SparseMatrixArray(1, 5, ()), "kind: found 5, expected 1 to 4"),
    ],
)
def test_what_the_file_cannot_hold_is_refused(make, message):
    with pytest.raises(UsageError, match=message):
        make()


@pytest.mark.parametrize(
    ("name", "offset", "text", "message"),
    [
        ("desc", 8, "ffffffff", "text: found 85 bytes, expected 4294967295"),
        ("desc", 19, "7fffffff", "unicode: found .* expected 4294967294"),
        ("desc", 29, "44", "macintosh: found 68 of 67 bytes"),
        ("chrm", 8, "0003", "xy: found 0 bytes, expected 4"),
        ("clro", 8, "00ffffff", "count: found 16777215, expected 0 to 65535"),
        ("ncl2", 12, "00000002", "name: found 0 bytes, expected 32"),
        ("ncl2", 16, "00000011", "channels: found 17, expected 0 to 16"),
        ("ncl2", 84, "00", "expected 1 to 31 characters"),
        ("rcs2", 10, "ffff", "65535 offsets: found"),
        ("rcs2", 12, "0000000c", "curve: found it at 12 of this structure, expected 16 or later"),
        ("rcs2", 12, "fffffff0", "counts of a curve: found 0 bytes"),
        ("rcs2", 20, "ffffffff", "curve 0: found bytes 16 to"),
        ("scrn", 12, "00000002", "frequency: found 0 bytes"),
        ("bfd", 8, "ffffffff", "4294967295 numbers of removal: found"),
        ("devs", 16, "00000029", "bytes: found 41, expected 40"),
        ("devs", 24, "0000001d", "bytes: found 29, expected 28"),
        ("devs", 36, "00000000", "count: found 2, expected 0"),
        ("pseq", 8, "00000003", "manufacturer: found 2 bytes"),
        ("pseq", 32, "74657874", "found b'text', expected b'desc'"),
        ("psid", 8, "10000000", "position table of 268435456 profiles"),
        ("psid", 36, "64657363", "profile 0"),
        ("smat", 10, "0005", "kind: found 5, expected 1 to 4"),
        ("smat", 20, "0001", "starts: found"),
        ("smat", 26, "ffff", "65535 numbers of indices: found"),
        ("smat", 28, "0002", "indices: found 2, expected less than 2"),
    ],
)
def test_malformed(name, offset, text, message):
    data = bytearray(unhex(EXAMPLES[name][1]))
    new = bytes.fromhex(text)
    data[offset : offset + len(new)] = new
    with pytest.raises(ProfileError, match=message):
        read(bytes(data))


@pytest.mark.parametrize(
    "data",
    [
        unhex("6e636c32 00000000 00000000 7fffffff 00000000") + bytes(64) + (b"a" * 9).ljust(38, b"\0") * 9,
        unhex("7363726e 00000000 00000000 7fffffff") + bytes(1200),
        unhex("64657673 00000000 00000001 4d534654 0000000c 7fffffff") + bytes(800),
        unhex("70736571 00000000 7fffffff") + bytes(800),
        unhex("736d6174 00000000 0009 0001 7fffffff") + bytes(800),
    ],
    ids=["ncl2", "scrn", "devs", "pseq", "smat"],
)
def test_more_parts_than_a_tag_may_have(data):
    with pytest.raises(LimitError, match=f"more parts in one tag than the limit of {MAX_PARTS}"):
        read(data)


def test_many_offsets_to_one_curve_take_no_memory():
    """65,535 curves of ten measurements each, all at one place; and such that begin inside one another."""
    count, rows = 65535, 10
    head = unhex("72637332 00000000 0001") + count.to_bytes(2, "big")
    start = 12 + 4 * count
    curve = b"StaT" + rows.to_bytes(4, "big") + bytes(12 + 8 * rows)
    tracemalloc.start()
    one = read(head + start.to_bytes(4, "big") * count + curve)
    assert len({id(curve) for curve in one.curves}) == 1
    with pytest.raises(ProfileError, match="expected 262252 or later"):
        read(head + b"".join((start + i % 9).to_bytes(4, "big") for i in range(count)) + curve)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 32 << 20


def nested(depth, share):
    """Profiles inside profiles, each `share` times under several signatures."""
    profile = ROOT
    for _ in range(depth):
        tag = EmbeddedProfile.of(profile)
        profile = Profile(Header(device_class="spac"), {f"ICC{i}": tag for i in range(share)})
    return profile


def test_a_profile_inside_a_tag():
    profile = nested(2, 1)
    listed = to_dict(profile)["tags"]["ICC0"]["profile"]["tags"]["ICC0"]["profile"]
    assert listed["header"]["device_class"] == "spac"
    assert listed["tags"]["cprt"]["texts"][0]["text"] == "a"
    assert profile_from_xml(profile_to_xml(profile)).to_bytes() == profile.to_bytes()
    broken = Profile(Header(device_class="spac"), {"ICC5": EmbeddedProfile(ROOT.to_bytes()[:140])})
    assert "size: found" in to_dict(broken)["tags"]["ICC5"]["profile"]["error"]
    with pytest.raises(ProfileError, match="embedded profile: header"):
        profile_to_xml(broken)


def test_profiles_inside_of_profiles_come_to_an_end():
    assert describe(nested(6, 9)).count("embedded profile") == MAX_PROFILES
    with pytest.raises(LimitError, match="nested deeper than the limit of 32"):
        profile_to_xml(nested(33, 1))
