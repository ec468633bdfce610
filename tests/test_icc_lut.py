"""The look-up-table tag types: commented bytes, and what is no such tag."""

import numpy as np
import pytest
from icc_examples import unhex

from iccbrdf.errors import ProfileError, UsageError
from iccbrdf.icc import TAGS, Curve, ExtendedClut, Header, LutAToB, LutBToA, ParametricCurve, Profile
from iccbrdf.icc.reader import Reader

ROOT = ParametricCurve(2, (0.5, 1, 0.25, -0.5))
IDENTITIES = (Curve(),) * 3
TABLE = ExtendedClut(np.arange(8).reshape(2, 2, 2, 1) / 65535, encoding=2)

EXAMPLES = {
    "all parts": (
        LutBToA(
            b_curves=(Curve(), Curve((0x0200,)), Curve((0, 1, 0xFFFF))),
            matrix=(1, 0, 0, 0, -2, 0, 0, 0, 0.5, 0, 0, 1),
            m_curves=(ROOT, ROOT, Curve()),
            clut=TABLE,
            a_curves=(ParametricCurve(0, (3,)),),
        ),
        """
        6d424120 00000000                                   # 'mBA ', reserved
        03 01 0000                                          # three inputs, one output, reserved
        00000020 00000050 00000080 000000c4 000000e8        # offsets: B, matrix, M, CLUT, A
        63757276 00000000 00000000                          # 0x20: 'curv' without entries
        63757276 00000000 00000001 0200 0000                # gamma 2, padding
        63757276 00000000 00000003 0000 0001 ffff 0000      # three samples, padding
        00010000 00000000 00000000                          # 0x50: first row
        00000000 fffe0000 00000000
        00000000 00000000 00008000
        00000000 00000000 00010000                          # offsets
        70617261 00000000 0002 0000                         # 0x80: 'para' of type 2
        00008000 00010000 00004000 ffff8000                 # g a b c
        70617261 00000000 0002 0000
        00008000 00010000 00004000 ffff8000
        63757276 00000000 00000000
        02020200 00000000 00000000 00000000 02 000000       # 0xc4: grid, two bytes a value
        0000 0001 0002 0003 0004 0005 0006 0007
        70617261 00000000 0000 0000 00030000                # 0xe8: X^3
        """,
    ),
    "table of bytes": (
        LutAToB(
            b_curves=IDENTITIES,
            clut=ExtendedClut([[0, 0.2, 1], [1, 0, 0]], encoding=3),
            a_curves=(Curve(),),
        ),
        """
        6d414220 00000000 01 03 0000                        # 'mAB ', one input, three outputs
        00000020 00000000 00000000 00000044 00000060        # B, no matrix, no M, CLUT, A
        63757276 00000000 00000000
        63757276 00000000 00000000
        63757276 00000000 00000000
        02000000 00000000 00000000 00000000 01 000000       # 0x44: grid, one byte a value
        00 33 ff ff 00 00 0000                              # last input slowest; padding
        63757276 00000000 00000000                          # 0x60
        """,
    ),
    "curves alone": (
        LutBToA(b_curves=(Curve(),)),
        """
        6d424120 00000000 01 01 0000
        00000020 00000000 00000000 00000000 00000000
        63757276 00000000 00000000
        """,
    ),
}


def read(data):
    return TAGS.read(Reader(data, "a.icc", "tag B2A0"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_bytes_and_object(name):
    tag, text = EXAMPLES[name]
    assert tag.to_bytes() == unhex(text)
    found = read(unhex(text))
    assert type(found) is type(tag)
    assert found == tag


def test_values_as_they_are_read():
    tag = read(unhex(EXAMPLES["table of bytes"][1]))
    assert (tag.inputs, tag.outputs) == (1, 3)
    assert tag.clut.table == pytest.approx(np.array([[0, 0.2, 1], [1, 0, 0]]))
    assert (tag.matrix, tag.m_curves) == (None, None)


def test_parts_in_another_order_and_shared():
    """Writers lay the parts out as they like; A and B curves may be the same ones."""
    tag = read(
        unhex(
            """
            6d424120 00000000 02 02 0000
            0000003c 00000000 00000000 00000020 0000003c    # B, CLUT, A as B
            02020000 00000000 00000000 00000000 01 000000   # 0x20
            00 ff  ff 00  ff 00  00 ff
            63757276 00000000 00000000                      # 0x3c
            63757276 00000000 00000000
            """
        )
    )
    assert tag.b_curves == tag.a_curves == (Curve(), Curve())
    assert tag.clut.table[0, 1].tolist() == [1, 0]


@pytest.mark.parametrize("name", EXAMPLES)
def test_no_truncation_passes(name):
    _, text = EXAMPLES[name]
    data = unhex(text)
    for size in range(len(data)):
        with pytest.raises(ProfileError, match="tag B2A0"):
            read(data[:size])


@pytest.mark.parametrize(
    ("at", "value", "message"),
    [
        (8, "00", "inputs: found 0, expected 1 to 255"),
        (9, "02", "clut"),  # the table then ends too early
        (12, "00000000", "b_curves: found none"),
        (16, "00000010", "matrix: found it at 16, expected 32 or later"),
        (16, "ffffffff", "matrix: found bytes"),
        (0x20, "63757278", "expected 'curv' or 'para'"),
        (0x28, "ffffffff", "entries: found"),
        (0x80 + 8, "0005", "type: found 5"),
        (0xC4, "01", "2 or more points for every input"),
        (0xC4 + 16, "03", "precision: found 3, expected 1 or 2"),
        (0xC4, "ffffff", "table: found 16 bytes, expected 33162750"),
    ],
)
def test_malformed(at, value, message):
    data = bytearray(unhex(EXAMPLES["all parts"][1]))
    data[at : at + len(value) // 2] = bytes.fromhex(value)
    with pytest.raises(ProfileError, match=message):
        read(bytes(data))


def test_more_inputs_than_a_grid_has_room_for():
    data = bytearray(unhex(EXAMPLES["table of bytes"][1]))
    data[8] = 17
    with pytest.raises(ProfileError, match="expected 2 or more points for every input"):
        read(bytes(data))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"b_curves": ()}, "b_curves: found none"),
        ({"b_curves": IDENTITIES[:2], "clut": TABLE}, "b_curves: found 2, expected 3"),
        ({"b_curves": IDENTITIES, "clut": TABLE, "a_curves": IDENTITIES}, "a_curves: found 3, expected 1"),
        ({"b_curves": IDENTITIES, "m_curves": ()}, "m_curves: found 0, expected 3"),
        ({"b_curves": IDENTITIES[:2], "matrix": (0,) * 12}, "matrix: found one for 2 channels"),
        ({"b_curves": IDENTITIES, "matrix": (0,) * 9}, "found 9 values, expected 12"),
        ({"b_curves": IDENTITIES, "clut": ExtendedClut(TABLE.table, 0)}, "value encoding 0, expected 2 or 3"),
        ({"b_curves": (TABLE,) * 3}, "found ExtendedClut, expected a curve"),
    ],
)
def test_contradictions(fields, message):
    with pytest.raises(UsageError, match=message):
        LutBToA(**fields)


def test_parameters_of_a_curve():
    with pytest.raises(UsageError, match="found 3, expected 4 for type 2"):
        ParametricCurve(2, (1, 1, 0))
    assert ParametricCurve(0, (1 / 3,)).parameters == (21845 / 65536,)


def test_in_a_profile():
    tag = EXAMPLES["all parts"][0]
    header = Header(device_class="prtr", version=(4, 4, 0), colour_space="GRAY", pcs="XYZ ")
    data = Profile(header, {"B2A0": tag, "B2A1": tag}).to_bytes()
    found = Profile.from_bytes(data)
    assert found["B2A0"] is found["B2A1"]
    assert found["B2A0"] == tag


def test_broken_bytes_raise_nothing_else():
    data = unhex(EXAMPLES["all parts"][1])
    random = np.random.default_rng(1)
    refused = 0
    for _ in range(2000):
        broken = bytearray(data)
        for at in random.integers(8, len(data), 3):
            broken[at] = random.integers(0, 256)
        try:
            tag = read(bytes(broken))
        except ProfileError:
            refused += 1
        else:
            assert read(tag.to_bytes()) == tag
    assert 200 < refused < 1900
