import numpy as np
import pytest
from icc_examples import unhex

from iccbrdf.errors import ProfileError, UsageError
from iccbrdf.icc import Header, channel_count
from iccbrdf.icc.reader import Reader

MVIS = Header(
    device_class="mvis",
    pcs="XYZ ",
    mcs="mc000a",
    version=(5, 1, 2),
    created=(2026, 2, 28, 23, 59, 58),
    flags=4,
    rendering_intent=3,
    creator="abcd",
    spectral_pcs="rs001f",
    spectral_range=(400, 700),
    spectral_steps=31,
)

MVIS_BYTES = unhex(
    """
    00000000                    # size: computed when a profile is written
    00000000                    # preferred CMM
    05 12                       # version 5, minor 1, bug fix 2
    0000                        # subclass version
    6d766973                    # class 'mvis'
    00000000                    # colour space
    58595a20                    # PCS 'XYZ '
    07ea 0002 001c 0017 003b 003a  # created 2026-02-28 23:59:58
    61637370                    # 'acsp'
    00000000                    # platform
    00000004                    # flags: MCS subset
    00000000 00000000           # manufacturer, model
    0000000000000000            # attributes
    00000003                    # rendering intent: absolute
    0000f6d6 00010000 0000d32d  # illuminant .9642 1 .8249
    61626364                    # creator
    00000000000000000000000000000000  # profile ID
    7273 001f                   # spectral PCS: reflectance, 31 channels
    5e40 6178 001f              # 400 to 700 nm, 31 steps
    0000 0000 0000              # bi-spectral range
    6d63 000a                   # MCS: 10 channels
    00000000                    # device subclass
    00000000                    # reserved
    """
)


def read(data):
    return Header.read(Reader(data, "a.icc", "header"))


def test_header_bytes():
    assert len(MVIS_BYTES) == 128
    assert MVIS.to_bytes() == MVIS_BYTES


def test_header_read():
    header = read(MVIS_BYTES)
    assert header == MVIS
    assert header.mcs == "mc000a"
    assert header.version == (5, 1, 2)
    assert header.created == (2026, 2, 28, 23, 59, 58)
    assert header.spectral_range == (400, 700)
    assert header.mcs_subset
    np.testing.assert_allclose(header.illuminant, (0.9642, 1, 0.8249), atol=2**-17)


def test_any_bytes_survive():
    data = bytearray(np.random.default_rng(1).integers(0, 256, 128, np.uint8).tobytes())
    data[36:40] = b"acsp"
    # NaN has several float16 patterns, of which one comes back.
    data[104:108] = data[110:114] = bytes(4)
    assert read(bytes(data)).to_bytes() == data


def test_same_header_without_a_clock():
    assert Header(device_class="mid ").to_bytes() == Header(device_class="mid ").to_bytes()


@pytest.mark.parametrize(
    ("text", "stored"),
    [
        ("nc000a", "6e63000a"),
        ("NC00FF", "6e6300ff"),
        ("RGB ", "52474220"),
        ("", "00000000"),
        ("ncol", "6e636f6c"),
    ],
)
def test_colour_spaces(text, stored):
    header = Header(device_class="mid ", colour_space=text)
    assert header.to_bytes()[16:20].hex() == stored


def test_a_colour_space_of_letters_is_read_as_a_count():
    assert Header(device_class="mid ", colour_space="ncol").colour_space == "nc6f6c"


@pytest.mark.parametrize(
    ("space", "count"),
    [("nc000a", 10), ("mcffff", 65535), ("FCLR", 15), ("CMYK", 4), ("Lab ", 3), ("what", None)],
)
def test_channel_count(space, count):
    assert channel_count(space) == count


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("colour_space", "nc00a", "colour_space: found 'nc00a', expected four characters"),
        ("illuminant", (0.9, 1), "found 2 values, expected 3"),
        ("illuminant", (40000, 1, 1), "expected -32768 to"),
        ("flags", 2**32, "expected 0 to 4294967295"),
        ("version", (5, 16, 0), "up to 15"),
        ("profile_id", b"short", "found 5 bytes, expected 16"),
        ("spectral_range", (1e6, 0), "16-bit floats"),
        ("creator", 7, "found 7, expected four characters"),
    ],
)
def test_what_the_file_cannot_hold_is_refused(field, value, message):
    with pytest.raises(UsageError, match=message):
        Header(**{"device_class": "mid ", field: value})


def test_not_a_profile():
    data = bytearray(MVIS_BYTES)
    data[36:40] = b"RIFF"
    with pytest.raises(ProfileError, match=r"a.icc: header: byte offset 36: found b'RIFF', expected b'acsp'"):
        read(bytes(data))


def test_short_header():
    with pytest.raises(ProfileError, match="byte offset 124: reserved: found 3 bytes, expected 4"):
        read(MVIS_BYTES[:127])
