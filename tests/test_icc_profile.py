import hashlib
import pickle

import iccdev
import numpy as np
import pytest
from icc_examples import a_mid, an_mvis, conformance_profiles, shared, unhex

from iccbrdf.errors import InputError, LimitError, ProfileError, UnsupportedError, UsageError
from iccbrdf.icc import (
    Header,
    Matrix,
    MissingTagError,
    Mluc,
    MultiProcess,
    Profile,
    SignatureTag,
    Unknown,
    Utf8,
    compute_profile_id,
    read_profile,
    write_profile,
)

# The reference tools overstate the size of a calculator's function.
pytestmark = pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")


def small():
    return Profile(
        Header(device_class="mid "),
        {"desc": Utf8("a"), "tech": SignatureTag("CRT "), "targ": Utf8("b")},
    )


def test_tag_table():
    assert small().to_bytes()[128:] == unhex(
        """
        00000003                # three tags
        64657363 000000a8 00000009  # 'desc': 9 bytes at 168
        74656368 000000b4 0000000c  # 'tech': 12 bytes at 180
        74617267 000000c0 00000009  # 'targ': 9 bytes at 192
        75746638 00000000 61  000000    # padded to a multiple of four
        73696720 00000000 43525420
        75746638 00000000 62  000000
        """
    )


def test_size_and_profile_id_are_computed():
    data = small().to_bytes()
    assert int.from_bytes(data[:4], "big") == len(data) == 204
    zeroed = data[:44] + bytes(4) + data[48:64] + bytes(4) + data[68:84] + bytes(16) + data[100:]
    assert data[84:100] == hashlib.md5(zeroed).digest()


def test_no_profile_id_before_version_4():
    data = Profile(Header(device_class="mntr", version=(2, 4, 0)), {}).to_bytes()
    assert data[84:100] == bytes(16)


@pytest.mark.parametrize("make", [a_mid, an_mvis])
def test_read_and_write(make):
    data = make().to_bytes()
    profile = Profile.from_bytes(data)
    assert profile.to_bytes() == data
    assert profile.replace().to_bytes() == data
    assert make().to_bytes() == data
    again = Profile(profile.header, dict(profile))
    assert again.to_bytes() == data
    assert dict(profile) == dict(make())


@pytest.mark.parametrize("make", [a_mid, an_mvis])
def test_the_reference_implementation_finds_nothing_wrong(make):
    result = iccdev.validate_profile(make().to_bytes())
    assert (result.status, result.report.strip()) == (iccdev.ValidationStatus.OK, "")


def test_the_reference_implementation_runs_our_profiles(tmp_path):
    """Every kind of element, by hand.

    For 0.1, 0.5: the curves give 2 * 0.1 + 0.1 = 0.3 and 0.5; the CLUT is the identity; the matrix swaps to
    0.75, 0.3; the tint array gives 0.15, 0.3 for 0.3, which the second CLUT leaves; their sum is 0.9, 0.6.
    The MVIS makes 0.9, 0.6, 0.75 of it, and the reference's encoding of XYZ halves that.
    """
    write_profile(a_mid(), tmp_path / "mid.icc")
    write_profile(an_mvis(), tmp_path / "mvis.icc")
    with iccdev.IccCmm() as cmm:
        cmm.attach(tmp_path / "mid.icc", lut_type=iccdev.LutType.MCS)
        cmm.attach(tmp_path / "mvis.icc", lut_type=iccdev.LutType.MCS)
        cmm.begin()
        found = cmm.apply([0.1, 0.5])
    np.testing.assert_allclose(np.array(found) * 65535 / 32768, [0.9, 0.6, 0.75], rtol=1e-6)


def test_tags_as_a_mapping():
    profile = Profile.from_bytes(small().to_bytes(), "a.icc")
    assert list(profile) == ["desc", "tech", "targ"]
    assert "desc" in profile
    assert "cprt" not in profile
    assert len(profile) == 3
    assert profile["desc"] == Utf8("a")
    assert profile["desc"] is profile["desc"]
    assert profile.get("cprt") is None
    with pytest.raises(MissingTagError, match=r"^a.icc: tag dsec is missing: did you mean 'desc'\?$"):
        profile["dsec"]
    assert issubclass(MissingTagError, ProfileError)


def test_changed_copy():
    profile = Profile.from_bytes(small().to_bytes())
    changed = profile.replace(
        header=Header(device_class="mvis"), tags={"tech": Utf8("new"), "cprt": Utf8("c")}, remove=["targ"]
    )
    assert list(changed) == ["desc", "tech", "cprt"]
    assert changed["tech"] == Utf8("new")
    assert Profile.from_bytes(changed.to_bytes()).header.device_class == "mvis"
    assert list(profile) == ["desc", "tech", "targ"]
    assert profile["tech"] == SignatureTag("CRT ")


def test_one_object_is_written_once():
    data = an_mvis().to_bytes()
    profile = Profile.from_bytes(data)
    assert profile["desc"] is profile["cprt"]
    assert profile.tag_offset("desc") == profile.tag_offset("cprt")
    assert Profile.from_bytes(profile.replace(remove=["targ"]).to_bytes())["desc"] == Mluc.of("An MVIS")


def test_what_is_unknown_survives():
    """Unknown types, reserved bytes, bytes after a structure, pads and bytes after the last tag."""
    data = bytearray(an_mvis().to_bytes())
    at = Profile.from_bytes(bytes(data)).tag_offset("wtpt")
    data[at : at + 8] = b"whatABCD"
    data += b"behind the end"
    data[:4] = len(data).to_bytes(4, "big")
    profile = Profile.from_bytes(bytes(data))
    for signature in profile:
        profile[signature]
    assert profile["wtpt"] == Unknown("what", b"ABCD", bytes(data[at + 8 : at + 20]))
    assert profile.to_bytes() == data
    changed = profile.replace(tags={"targ": Utf8("a")})
    assert changed.tag_data("wtpt") == data[at : at + 20]


def test_a_malformed_tag_hinders_nothing_else():
    data = bytearray(an_mvis().to_bytes())
    at = Profile.from_bytes(bytes(data)).tag_offset("M2B0")
    data[at + 12 : at + 16] = b"\xff\xff\xff\xff"
    profile = Profile.from_bytes(bytes(data), "bad.icc")
    assert profile["desc"] == Mluc.of("An MVIS")
    for _ in range(2):
        with pytest.raises(ProfileError, match=rf"bad.icc: tag M2B0 \(mpet\): byte offset {at + 16}: "):
            profile["M2B0"]
    assert profile.to_bytes() == data
    assert profile.replace(remove=["targ"]).tag_data("M2B0") == profile.tag_data("M2B0")


def test_files(tmp_path):
    path = tmp_path / "a.icc"
    write_profile(small(), path)
    assert path.read_bytes() == small().to_bytes()
    assert read_profile(path).source == str(path)
    assert read_profile(path) == small()
    with pytest.raises(UsageError, match="exists already"):
        write_profile(small(), path)
    write_profile(an_mvis(), path, overwrite=True)
    assert read_profile(path) == an_mvis()
    assert [p.name for p in tmp_path.iterdir()] == ["a.icc"]


def test_unreadable_files(tmp_path):
    with pytest.raises(InputError, match=r"missing.icc: cannot be read: No such file"):
        read_profile(tmp_path / "missing.icc")
    with pytest.raises(InputError, match="cannot be read"):
        read_profile(tmp_path)
    (tmp_path / "empty.icc").write_bytes(b"")
    with pytest.raises(ProfileError, match=r"empty.icc: header: byte offset 0: size: found 0 bytes"):
        read_profile(tmp_path / "empty.icc")


@pytest.mark.parametrize("path", [None, 3, b"a.icc", "nul\0.icc"])
def test_what_is_no_path(path):
    with pytest.raises(UsageError, match="not the path of a file to read"):
        read_profile(path)


@pytest.mark.parametrize("path", [None, 3, "nul\0.icc"])
def test_what_is_no_path_to_write_to(path):
    with pytest.raises(UsageError, match="not the path of a file to write"):
        write_profile(small(), path)


def test_only_profiles_are_written(tmp_path):
    # A number has a to_bytes of its own.
    with pytest.raises(UsageError, match="found 5, expected a Profile"):
        write_profile(5, tmp_path / "a.icc")
    assert not list(tmp_path.iterdir())


def test_pickling():
    made = Profile(Header(device_class="mid "), dict.fromkeys(("desc", "cprt"), Utf8("a")))
    read = Profile.from_bytes(made.to_bytes(), "a.icc")
    changed = read.replace(tags={"targ": Utf8("b")})
    for profile in (made, read, changed):
        again = pickle.loads(pickle.dumps(profile))
        assert again.to_bytes() == profile.to_bytes()
        assert again.source == profile.source
        assert [again[tag].text for tag in again] == [profile[tag].text for tag in profile]
        assert [again.tag_offset(tag) for tag in again] == [profile.tag_offset(tag) for tag in profile]


@pytest.mark.parametrize(
    ("tags", "message"),
    [
        ({"toolong": Utf8("a")}, "four ASCII characters"),
        ({"desc": "text"}, "tag desc: found str, expected a tag type"),
        ({"desc": Matrix.of([[1]])}, "tag desc: found Matrix, expected a tag type"),
        (
            {"A2M0": MultiProcess.of(Matrix.of([[1]]))},
            "found 1 inputs, expected 3 for the header's colour_space",
        ),
        (
            {"A2M0": MultiProcess.of(Matrix.of([[1, 1, 1]]))},
            "found 1 outputs, expected 2 for the header's mcs",
        ),
    ],
)
def test_what_makes_no_profile(tags, message):
    with pytest.raises(UsageError, match=message):
        Profile(Header(device_class="mid ", colour_space="RGB ", mcs="mc0002"), tags)


def test_channels_that_contradict_the_header():
    data = bytearray(a_mid().to_bytes())
    data[18:20] = b"\x00\x03"
    with pytest.raises(ProfileError, match=r"tag A2M0: found 2 inputs, expected 3 for .* 'nc0003'"):
        Profile.from_bytes(bytes(data), "a.icc")["A2M0"]


def table(*entries, size=400):
    """A file of `size` bytes with a tag table of (signature, offset, size)."""
    data = bytearray(Profile(Header(device_class="mid "), {}).to_bytes()[:128])
    data += len(entries).to_bytes(4, "big")
    for signature, offset, length in entries:
        data += signature + offset.to_bytes(4, "big") + length.to_bytes(4, "big")
    data = data.ljust(size, b"\0")
    data[:4] = size.to_bytes(4, "big")
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "error", "message"),
    [
        (table()[:399], ProfileError, "header: byte offset 0: size: found 400, expected 132 to the 399"),
        (table((b"desc", 300, 101)), ProfileError, "tag desc: found bytes 300 to 401, expected at most 400"),
        (table((b"desc", 2**32 - 8, 16)), ProfileError, "found bytes 4294967288 to 4294967304"),
        (
            table((b"desc", 128, 16)),
            ProfileError,
            "tag desc: found it at 128 of this structure, expected 144",
        ),
        (
            table((b"desc", 200, 16), (b"desc", 300, 16)),
            ProfileError,
            "tag table: byte offset 144: found tag 'desc' a second time",
        ),
        (
            table((b"desc", 200, 16), (b"cprt", 208, 16)),
            ProfileError,
            "tag cprt: found it at 208 of this structure, expected 216 or later",
        ),
        (
            table()[:128] + b"\x00\x00\x04\x01" + bytes(300),
            LimitError,
            "1025 tags, more than the limit of 1024",
        ),
        (table()[:128] + b"\x00\x00\x00\x80" + bytes(300), ProfileError, "128 entries: found 268 bytes"),
        (table()[:8] + b"\x06" + table()[9:], UnsupportedError, "found major version 6, expected up to 5"),
    ],
)
def test_malformed_files(data, error, message):
    with pytest.raises(error, match=message):
        Profile.from_bytes(data, "a.icc")


def test_profiles_of_the_reference_tools():
    count = 0
    for name, data in conformance_profiles():
        profile = Profile.from_bytes(data, name)
        assert profile.to_bytes() == data
        assert profile.replace().to_bytes() == data
        assert compute_profile_id(data) == profile.header.profile_id
        assert profile["mcta"].texts() == tuple(f"c{i}" for i in range(8))
        # Our writer differs from theirs in the true size of the main function only.
        ours, theirs = profile["A2M0"].to_bytes(), profile.tag_data("A2M0")
        differing = [i for i in range(len(theirs)) if ours[i] != theirs[i]]
        assert len(ours) == len(theirs)
        assert set(differing) <= set(range(44, 48))
        assert not differing or profile["A2M0"].elements[0].elements
        count += 1
    assert count == 92


@pytest.mark.parametrize("name", ["ISOcoated_v2_300_bas.icc", "sRGB.icm", "DisplayP3.icm"])
def test_version_2_profiles(name):
    path = shared(f"data/icc/{name}")
    profile = read_profile(path)
    for signature in profile:
        profile[signature]
    assert profile.to_bytes() == path.read_bytes()
    assert profile.replace().to_bytes() == path.read_bytes()
    # Every tag whose type is known is written as it was.
    for signature in profile:
        assert profile[signature].to_bytes() == profile.tag_data(signature)
