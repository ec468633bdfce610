import numpy as np
import pytest
from icc_examples import unhex

from iccbrdf.errors import ProfileError, UsageError
from iccbrdf.icc import (
    TAGS,
    XYZ,
    Colorant,
    ColorantTable,
    LocalisedText,
    Mluc,
    NumberArray,
    PlainText,
    SignatureTag,
    TagArray,
    Unknown,
    Utf8,
    ViewingConditions,
)
from iccbrdf.icc.reader import Reader


def read(data):
    return TAGS.read(Reader(data, "a.icc", "tag test"))


EXAMPLES = {
    "mluc": (
        Mluc((LocalisedText("en", "US", "Ab"), LocalisedText("no", "NO", "Å𝄞"))),
        """
        6d6c7563 00000000       # 'mluc', reserved
        00000002 0000000c       # two records of 12 bytes
        656e 5553               # 'en' 'US'
        00000004 00000028       # 4 bytes at 40
        6e6f 4e4f               # 'no' 'NO'
        00000006 0000002c       # 6 bytes at 44
        0041 0062               # 'Ab'
        00c5 d834dd1e           # 'Å' and a surrogate pair
        """,
    ),
    "utf8": (Utf8("kd.X µ"), "75746638 00000000  6b642e5820 c2b5"),
    "clrt": (
        ColorantTable((Colorant("X"), Colorant("n.x", (1, 0x8000, 0xFFFF)))),
        """
        636c7274 00000000 00000002                                              # 'clrt', reserved, 2 of them
        58000000 00000000 00000000 00000000 00000000 00000000 00000000 00000000 # 'X'
        0000 0000 0000                                                          # its colour is not said
        6e2e7800 00000000 00000000 00000000 00000000 00000000 00000000 00000000 # 'n.x'
        0001 8000 ffff
        """,
    ),
    "text": (PlainText("© you"), "74657874 00000000  a920796f75 00  # Latin-1, ended by a NUL"),
    "sig": (SignatureTag("CT10"), "73696720 00000000  43543130"),
    "XYZ": (
        XYZ.of(0.9642, 1, -0.5),
        "58595a20 00000000  0000f6d6 00010000 ffff8000  # s15Fixed16, rounded to the nearest",
    ),
    "fl16": (NumberArray("fl16", [1, -2]), "666c3136 00000000  3c00 c000"),
    "fl32": (NumberArray("fl32", [1, np.inf]), "666c3332 00000000  3f800000 7f800000"),
    "fl64": (NumberArray("fl64", [1]), "666c3634 00000000  3ff0000000000000"),
    "ui08": (NumberArray("ui08", [1, 255]), "75693038 00000000  01 ff"),
    "ui16": (NumberArray("ui16", [1, 65535]), "75693136 00000000  0001 ffff"),
    "ui32": (NumberArray("ui32", [1]), "75693332 00000000  00000001"),
    "ui64": (NumberArray("ui64", [2**63 + 1]), "75693634 00000000  8000000000000001"),
    "sf32": (NumberArray("sf32", [-1.5]), "73663332 00000000  fffe8000"),
    "uf32": (NumberArray("uf32", [65535.5]), "75663332 00000000  ffff8000"),
    "mcta": (
        TagArray.of_texts(["kd.X", "m"]),
        """
        74617279 00000000       # 'tary', reserved
        75746638                # array of 'utf8'
        00000002                # two items
        00000020 0000000c       # 12 bytes at 32
        0000002c 00000009       # 9 bytes at 44
        75746638 00000000 6b642e58  # 'kd.X'
        75746638 00000000 6d        # 'm'
        """,
    ),
    "svcn": (
        ViewingConditions(
            observer=2,
            illuminant=10,
            cct=6500,
            illuminant_XYZ=(95, 100, 108),
            surround_XYZ=(19, 20, 21.5),
            observer_range=(400, 700),
            observer_table=[[1, 2], [3, 4], [5, 6]],
            illuminant_range=(380, 780),
            spd=[0.5],
        ),
        """
        7376636e 00000000       # 'svcn', reserved
        00000002                # observer: CIE 1964
        5e40 6178 0002 0000     # 400 to 700 nm in 2 steps, reserved
        3f800000 40000000       # x bar
        40400000 40800000       # y bar
        40a00000 40c00000       # z bar
        0000000a                # illuminant: daylight of a colour temperature
        45cb2000                # 6500 K
        5df0 6218 0001 0000     # 380 to 780 nm in 1 step, reserved
        3f000000                # spectral power
        42be0000 42c80000 42d80000  # illuminant XYZ, cd/m2
        41980000 41a00000 41ac0000  # surround XYZ
        """,
    ),
    "unknown": (Unknown("what", b"\x00\x00\x00\x07", b"any"), "77686174 00000007  616e79"),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_bytes_and_object(name):
    tag, text = EXAMPLES[name]
    assert tag.to_bytes() == unhex(text)
    found = read(unhex(text))
    assert type(found) is type(tag)
    assert found == tag
    assert hash(found) == hash(tag)


@pytest.mark.parametrize("name", EXAMPLES)
def test_no_truncation_passes(name):
    tag, text = EXAMPLES[name]
    data = unhex(text)
    for size in range(len(data)):
        try:
            assert read(data[:size]) != tag or name == "text"  # whose last byte is the NUL
        except ProfileError as error:
            assert "a.icc: tag test" in str(error)  # noqa: PT017


def test_values():
    svcn = read(unhex(EXAMPLES["svcn"][1]))
    np.testing.assert_array_equal(svcn.observer_table, [[1, 2], [3, 4], [5, 6]])
    assert svcn.illuminant_XYZ == (95, 100, 108)
    assert svcn.surround_XYZ == (19, 20, 21.5)
    assert (svcn.observer, svcn.illuminant, svcn.cct) == (2, 10, 6500)
    assert svcn.spd.tolist() == [0.5]
    assert read(unhex(EXAMPLES["mcta"][1])).texts() == ("kd.X", "m")
    assert read(unhex(EXAMPLES["mluc"][1])).text == "Ab"
    assert read(unhex(EXAMPLES["ui64"][1])).values.tolist() == [2**63 + 1]
    assert read(unhex(EXAMPLES["sf32"][1])).values.tolist() == [-1.5]


def test_standard_observer_without_tables():
    tag = ViewingConditions(observer=1, illuminant=1, illuminant_XYZ=(1, 1, 1), surround_XYZ=(0, 0, 0))
    assert len(tag.to_bytes()) == 60
    assert read(tag.to_bytes()) == tag


@pytest.mark.parametrize(("signature", "expected"), [("ui08", [0, 1]), ("ui16", [0, 1]), ("fl32", [0, 0.5])])
def test_normalised(signature, expected):
    stored = {"ui08": [0, 255], "ui16": [0, 65535], "fl32": [0, 0.5]}[signature]
    assert NumberArray(signature, stored).normalised().tolist() == expected


def test_a_NUL_that_a_writer_appended_is_dropped():
    assert read(b"utf8\0\0\0\0kd.X\0") == Utf8("kd.X")


def test_the_standards_array_type_of_mcta_is_read():
    data = unhex(EXAMPLES["mcta"][1]).replace(b"utf8", b"mcta", 1)
    assert read(data).array_type == "mcta"
    assert read(data).texts() == ("kd.X", "m")


def test_texts_of_another_array():
    with pytest.raises(ValueError, match="item 1: found type 'sig ', expected type 'utf8'"):
        TagArray("utf8", (Utf8("a"), SignatureTag("CT10"))).texts()


def test_shared_and_null_items():
    item = Utf8("a")
    tag = TagArray("utf8", (item, None, item))
    data = tag.to_bytes()
    assert data == unhex(
        """
        74617279 00000000 75746638 00000003
        00000028 00000009       # 9 bytes at 40
        00000000 00000000       # a null item
        00000028 00000009       # the same as the first
        75746638 00000000 61
        """
    )
    found = read(data)
    assert found == tag
    assert found.items[0] is found.items[2]


def test_what_is_made_equals_what_is_read_back():
    tag = XYZ.of(0.1, 0.2, 0.3)
    assert tag.values == read(tag.to_bytes()).values
    assert tag.values[0][0] == 6554 / 65536


def test_arrays_are_copies_and_read_only():
    given = np.array([1, 2], np.uint8)
    tag = NumberArray("ui08", given)
    given[0] = 9
    assert tag.values.tolist() == [1, 2]
    with pytest.raises(ValueError, match="read-only"):
        tag.values[0] = 3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: NumberArray("ui08", [256]), "found 256, which uint8 cannot hold"),
        (lambda: NumberArray("ui16", [0.5]), "found 0.5, which uint16 cannot hold"),
        (lambda: NumberArray("fl16", [1e6]), "which float16 cannot hold"),
        (lambda: NumberArray("sf32", [40000]), "cannot hold"),
        (lambda: NumberArray("sf32", [np.nan]), "cannot hold"),
        (lambda: NumberArray("fl99", [1]), "signature: found fl99, expected ui08 or"),
        (lambda: NumberArray("fl32", [[1]]), "found 2 dimensions, expected 1"),
        (lambda: SignatureTag("abc"), "expected four characters"),
        (lambda: Utf8("\udc80"), "expected utf-8 text"),
        (lambda: PlainText("€"), "expected latin-1 text"),
        (lambda: Mluc.of("a", language="eng"), "expected two characters each"),
        (lambda: Mluc(("a",)), "expected a LocalisedText"),
        (lambda: TagArray("utf8", ("a",)), "found str, expected a tag type"),
        (lambda: TagArray("utf8", (Unknown("utf8", bytes(4), b""),)), "found Unknown, expected a tag type"),
    ],
)
def test_what_the_file_cannot_hold_is_refused(make, message):
    with pytest.raises(UsageError, match=message):
        make()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("75746638 00000000 c2", "byte offset 8: text: found bytes that are no utf-8"),
        ("6d6c7563 00000000 00000001 00000010", "offset 12: record_size: found 16, expected 12"),
        ("6d6c7563 00000000 ffffffff 0000000c", "text records: found 0 bytes, expected 51539607540"),
        (
            "6d6c7563 00000000 00000001 0000000c 656e5553 00000003 0000001c 004100",
            r"tag test \(mluc\), text 0: byte offset 30: found bytes that are no UTF-16",
        ),
        (
            "6d6c7563 00000000 00000001 0000000c 656e5553 00000004 0000001c 0041",
            "text 0: found bytes 28 to 32, expected at most 30",
        ),
        ("58595a20 00000000 00000000", "values: found 0 bytes, expected 4"),
        ("666c3332 00000000 000000", "found 3 bytes, no whole number of fl32 values"),
        (
            "74617279 00000000 75746638 00000002 00000020 00000009 00000021 00000009 75746638 00000000 6161",
            "item 1: found it at 33 of this structure, expected 41 or later",
        ),
        (
            "74617279 00000000 75746638 00000001 00000000 00000018",
            "item 0: found it at 0 of this structure, expected 24 or later",
        ),
        (
            "74617279 00000000 75746638 00000001 fffffffc 00000010",
            "item 0: found bytes 4294967292 to 4294967308, expected at most 24",
        ),
        ("7376636e 00000000 00000001 7e00 6178 0000 0000 00000001 00000000 0000 0000 0000 0000" + "00" * 24,
         "observer_range: found .*expected finite"),
    ],
)  # fmt: skip
def test_malformed(text, message):
    with pytest.raises(ProfileError, match=message):
        read(unhex(text))


@pytest.mark.parametrize("name", ["", "a" * 32, "a\0b"])
def test_colorant_names_that_cannot_be_stored(name):
    with pytest.raises(UsageError, match="name"):
        ColorantTable.of([name])
