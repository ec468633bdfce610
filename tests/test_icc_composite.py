"""Structures, dictionaries, packed data and old tables: tag types beside those of test_icc_tags."""

import zlib

import numpy as np
import pytest
from icc_examples import unhex

from iccbrdf.errors import LimitError, ProfileError, UsageError
from iccbrdf.icc import (
    TAGS,
    CompressedUtf8,
    CompressedXml,
    Curve,
    DateTime,
    Dictionary,
    Entry,
    FormulaSegment,
    GamutBoundary,
    Header,
    HeightImage,
    Lut8,
    Lut16,
    Matrix,
    Member,
    Mluc,
    MultiProcess,
    NormalImage,
    ParametricCurve,
    Profile,
    SegmentedCurve,
    SignatureTag,
    TagStruct,
    Utf16,
    VideoCodePoints,
    to_dict,
)
from iccbrdf.icc.packed import MAX_TEXT
from iccbrdf.icc.reader import Reader

EXAMPLES = {
    "tstr": (
        TagStruct("brdf", (Member("type", SignatureTag("CT10")), Member("func", SignatureTag("mono")))),
        """
        74737472 00000000       # 'tstr', reserved
        62726466 00000002       # a BRDF's, two members
        74797065 00000028 0000000c  # type: 12 bytes at 40
        66756e63 00000034 0000000c  # func: 12 bytes at 52
        73696720 00000000 43543130
        73696720 00000000 6d6f6e6f
        """,
    ),
    "dict": (
        Dictionary((Entry("a", "bc"), Entry("d"), Entry("e", "")), 16),
        """
        64696374 00000000       # 'dict', reserved
        00000003 00000010       # three records of 16 bytes
        00000040 00000002  00000044 00000004  # a: name at 64, value at 68
        00000048 00000002  00000000 00000000  # d: without a value
        0000004c 00000002  00000050 00000000  # e: an empty one
        0061 0000 00620063 0064 0000 0065 0000
        """,
    ),
    "dict with translations": (
        Dictionary((Entry("a", "b", Mluc.of("A"), None),), 24),
        """
        64696374 00000000 00000001 00000018  # one record of 24 bytes
        00000028 00000002  0000002c 00000002  00000030 0000001e
        0061 0000 0062 0000
        6d6c7563 00000000 00000001 0000000c 656e 5553 00000002 0000001c 0041
        """,
    ),
    "ut16": (Utf16("aé"), "75743136 00000000 0061 00e9"),
    "dtim": (DateTime((2026, 11, 22, 2, 19, 47)), "6474696d 00000000 07ea 000b 0016 0002 0013 002f"),
    "cicp": (VideoCodePoints(9, 16, 0, 1), "63696370 00000000 09 10 00 01"),
    "ehim": (
        HeightImage(1, 0, 0.0, 0.5, b"\x89PNG"),
        "6568696d 00000000 00000001 00000000 00000000 3f000000 89504e47",
    ),
    "enim": (NormalImage(0, 1, b"II*\0"), "656e696d 00000000 00000000 00000001 49492a00"),
    "gbd": (
        GamutBoundary([[0, 1, 2]], [[0, 0, 1], [1, 0, 0], [0, 1, 0]], [[1], [0], [0.5]]),
        """
        67626420 00000000       # 'gbd ', reserved
        0003 0001 00000003 00000001  # 3 PCS channels, 1 device channel, 3 vertices, 1 triangle
        00000000 00000001 00000002
        00000000 00000000 3f800000  3f800000 00000000 00000000  00000000 3f800000 00000000
        3f800000 00000000 3f000000
        """,
    ),
    "curv": (Curve((0, 65535)), "63757276 00000000 00000002 0000 ffff"),
    "para": (ParametricCurve(0, (2.5,)), "70617261 00000000 0000 0000 00028000"),
    "curf": (
        SegmentedCurve((), (FormulaSegment(0, (1, 1, 0, 0)),)),
        "63757266 00000000 0001 0000 70617266 00000000 0000 0000 3f800000 3f800000 00000000 00000000",
    ),
    "mft2": (
        Lut16([[0, 1]], [[0, 1], [1, 0.2]], [[0, 1, 0.4], [1, 0.6, 0]]),
        """
        6d667432 00000000       # 'mft2', reserved
        01 02 02 00             # 1 input, 2 outputs, 2 grid points
        00010000 00000000 00000000  00000000 00010000 00000000  00000000 00000000 00010000
        0002 0003               # entries of the curves
        0000 ffff
        0000 ffff  ffff 3333
        0000 ffff 6666  ffff 9999 0000
        """,
    ),
}  # fmt: skip


def read(data):
    return TAGS.read(Reader(data, "a.icc", "tag test"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_bytes_and_object(name):
    tag, text = EXAMPLES[name]
    assert tag.to_bytes() == unhex(text)
    found = read(unhex(text))
    assert type(found) is type(tag)
    assert found == tag


def test_members_of_a_structure():
    shared = SignatureTag("CT10")
    transform = MultiProcess.of(Matrix.of([[1]]))
    tag = TagStruct("brdf", (Member("aaaa", shared), Member("bbbb", shared), Member("xfrm", transform)))
    found = read(tag.to_bytes())
    assert found.get("aaaa") is found.get("bbbb")
    assert found.get("xfrm") == transform
    assert found.get("outx") is None
    assert found.to_bytes() == tag.to_bytes()
    profile = Profile(Header(device_class="mvis"), {"bMB0": tag})
    listed = to_dict(profile)["tags"]["bMB0"]
    assert [m["signature"] for m in listed["members"]] == ["aaaa", "bbbb", "xfrm"]


def test_structures_nest():
    tag = TagStruct("nmcl", (Member("tint", TagStruct("tnt0", (Member("name", SignatureTag("abcd")),))),))
    assert read(tag.to_bytes()).get("tint").get("name").value == "abcd"


def test_compressed_texts():
    tag = CompressedUtf8.of("aé" * 100)
    assert len(tag.to_bytes()) < 40
    assert read(tag.to_bytes()).text == "aé" * 100
    assert read(CompressedXml.of("<a/>").to_bytes()).text == "<a/>"
    # Other compressors give other bytes, which stay as they are.
    data = b"zut8" + bytes(4) + zlib.compress(b"text\0", 0)
    assert read(data).to_bytes() == data
    assert read(data).text == "text"


@pytest.mark.parametrize(
    ("data", "error", "message"),
    [
        (b"no stream", ProfileError, "zut8: the text cannot be unpacked"),
        (zlib.compress(b"text")[:-2], ProfileError, "ends before its end"),
        (zlib.compress(b"\xff"), ProfileError, "no UTF-8"),
        (zlib.compress(bytes(MAX_TEXT + 1)), LimitError, f"more than {MAX_TEXT} bytes"),
    ],
)
def test_texts_that_cannot_be_unpacked(data, error, message):
    tag = CompressedUtf8(data)
    with pytest.raises(error, match=message):
        _ = tag.text


def test_table_of_8_bits_and_bytes_after_it():
    tables = np.linspace(0, 1, 256)[None]
    tag = Lut8(tables, [[0, 0.2], [1, 0.4]], np.repeat(tables, 2, axis=0))
    data = tag.to_bytes()
    assert len(data) == 48 + 256 + 4 + 512
    assert data[48 + 256 : 48 + 260] == bytes([0, 51, 255, 102])
    assert read(data) == tag
    padded = read(data + b"\0\0")
    assert padded.padding == b"\0\0"
    assert padded.to_bytes() == data + b"\0\0"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TagStruct("brdf", (Member("type", SignatureTag("abcd")),) * 2), "every signature once"),
        (lambda: TagStruct("brdf", (Member("abc", SignatureTag("abcd")),)), "expected four characters"),
        (lambda: TagStruct("brdf", (Member("abcd", 3),)), "found int, expected a tag type"),
        (lambda: Dictionary((Entry("a", "b", Mluc.of("A")),), 16), "record_size: found 16, expected 24"),
        (lambda: Dictionary((("a", "b"),)), "expected an Entry"),
        (lambda: HeightImage(0, 2, 0, 1, b""), "format: found 2, expected 0 to 1"),
        (lambda: GamutBoundary([[0, 0]], [[0]], [[0]]), r"expected \(count, 3\)"),
        (lambda: GamutBoundary([[0, 0, 0]], [[0]], [[0], [1]]), "as many in both"),
        (lambda: GamutBoundary([[0, 0, 0]], [[]], [[0]]), "pcs: found no channels"),
        (lambda: Lut16([[0, 1]], [[0, 1]], [[0, 1]]), "2 to 255 grid points"),
        (lambda: Lut16([[0, 1]], [[0], [1]], [[0]]), "output_tables: found shape"),
        (lambda: Lut8([[0, 1]], [[0], [1]], [[0, 1]]), "expected 1 rows of 256"),
        (lambda: Lut16([[0, 2]], [[0], [1]], [[0, 1]]), r"outside 0..1"),
    ],
)
def test_what_the_file_cannot_hold_is_refused(make, message):
    with pytest.raises(UsageError, match=message):
        make()


@pytest.mark.parametrize(
    ("name", "offset", "text", "message"),
    [
        ("tstr", 12, "7fffffff", "table of 2147483647 members: found 48 bytes"),
        ("tstr", 20, "00000000", "member type: found it at 0 of this structure, expected 40"),
        ("tstr", 32, "0000002c", "member func: found it at 44 of this structure, expected 52"),
        ("tstr", 28, "74797065", "expected every signature once"),
        ("dict", 12, "00000014", "record_size: found 20, expected 16 or 24 or 32"),
        ("dict", 8, "00ffffff", "16777215 records: found"),
        ("dict", 20, "00000003", "record 0: byte offset 66: found bytes that are no UTF-16"),
        ("dict with translations", 48, "74657874", "found type 'text', expected 'mluc'"),
        ("ehim", 12, "00000002", "format: found 2"),
        ("gbd", 12, "0fffffff", "pcs: found"),
        ("gbd", 16, "0fffffff", r"triangles of shape \(268435455, 3\): found"),
        ("mft2", 10, "01", "grid: found 1, expected 2 to 255"),
        ("mft2", 48, "0001", "input_entries: found 1, expected 2 to 4096"),
        ("mft2", 8, "10", "input_tables: found 24 bytes, expected 64"),
    ],
)
def test_malformed(name, offset, text, message):
    data = bytearray(unhex(EXAMPLES[name][1]))
    new = bytes.fromhex(text)
    data[offset : offset + len(new)] = new
    with pytest.raises(ProfileError, match=message):
        read(bytes(data))
