"""Chains by class, multiplex channels by name, the caller's own channels."""

import numpy as np
import pytest
from cmm_examples import (
    TEXTS,
    device_profile,
    matrix,
    mid,
    mvis,
    pixels,
    program,
    reference,
    scaled,
)
from conftest import ROOT

import iccbrdf
from iccbrdf.errors import (
    InputError,
    LinkError,
    ProfileError,
    UnsupportedError,
    UsageError,
)
from iccbrdf.icc import (
    D50,
    XYZ,
    Header,
    Mluc,
    MultiProcess,
    NumberArray,
    Profile,
    TagArray,
    Utf8,
    write_profile,
)


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


# By name -------------------------------------------------------------------------------------------------


def test_channels_meet_by_name_in_any_order(tmp_path):
    chain = [mid(["kd.Z", "m", "kd.X", "kd.Y"]), mvis(["kd.X", "kd.Y", "kd.Z"])]
    values = pixels(4)
    found = iccbrdf.link(chain)(values)
    assert np.array_equal(found, values[:, [2, 3, 0]])
    close(found, reference(tmp_path, chain, values, pcs="XYZ "))


def test_multiplex_values_are_not_clipped():
    chain = [mid("ab"), mvis("bax", defaults=NumberArray("fl32", [0, 0, -7]))]
    assert iccbrdf.link(chain)([-3, 40]).tolist() == [40, -3, -7]


@pytest.mark.parametrize(
    ("stored", "values", "expected"),
    [
        ("ui08", [255, 51, 0], 0.2),
        ("ui16", [65535, 16384, 0], 16384 / 65535),
        ("fl16", [1, -0.375, 0], -0.375),
        ("fl32", [1, 1e-6, 0], 1e-6),
        ("fl64", [1, 2.5, 0], 2.5),
    ],
)
def test_a_missing_channel_takes_its_default(tmp_path, stored, values, expected):
    chain = [mid("ca"), mvis("abc", defaults=NumberArray(stored, values))]
    array = pixels(2)
    found = iccbrdf.link(chain, dtype="float64")(array)
    close(found, np.column_stack([array[:, 1], np.full(len(array), expected), array[:, 0]]))
    close(found, reference(tmp_path, chain, array, pcs="XYZ "))


def test_a_channel_that_is_nowhere():
    with pytest.raises(
        LinkError, match=r"channel 'kd\.Z' of mvis\.icc is not in mid\.icc.*'kd\.z'\?"
    ) as error:
        iccbrdf.link([mid(["kd.X", "kd.Y", "kd.z"]), mvis(["kd.X", "kd.Y", "kd.Z"])])
    assert error.value.exit_code == 3


@pytest.mark.parametrize(
    ("defaults", "message"),
    [
        (NumberArray("fl32", [0, 0]), "mdv: 2 values, expected 3"),
        (NumberArray("ui32", [0, 0, 0]), "mdv: type 'ui32'"),
        (Utf8("0"), "mdv: type 'utf8'"),
    ],
)
def test_malformed_defaults(defaults, message):
    with pytest.raises(ProfileError, match=message):
        iccbrdf.link([mid("abc"), mvis("abc", defaults=defaults)])


@pytest.mark.parametrize("make", [mid, mvis])
def test_a_name_twice(make):
    with pytest.raises(ProfileError, match="mcta: channel name 'b' comes twice"):
        iccbrdf.link([make("abb")])


@pytest.mark.parametrize("array_type", ["utf8", "mcta"])
def test_both_ids_of_the_array_of_names(array_type):
    names = TagArray(array_type, tuple(Utf8(name) for name in "ba"))
    profile = Profile.from_bytes(mid("ab", mcta=names).to_bytes())
    assert iccbrdf.link([profile]).channels_out == ("b", "a")


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (Mluc.of("a"), "found type 'mluc', expected a tag array"),
        (TagArray.of_texts("a"), "1 names, expected 2 by the header"),
        (TagArray("utf8", (Utf8("a"), XYZ.of(1, 1, 1))), "item 1: found type 'XYZ '"),
        (TagArray("utf8", (Utf8("a"), None)), "item 1: found nothing"),
    ],
)
def test_malformed_names(names, message):
    with pytest.raises(ProfileError, match=f"mid.icc: tag mcta: {message}"):
        iccbrdf.link([mid("ab", mcta=names)])


# The subset flag -----------------------------------------------------------------------------------------


def test_a_flagged_profile_needs_all_its_channels_in_the_other():
    abc = NumberArray("fl32", [0, 0, 0])
    with pytest.raises(LinkError, match=r"mid.icc needs all .* mvis.icc, which has no 'kd'"):
        iccbrdf.link([mid(["a", "b", "c", "kd"], subset=True), mvis("abc")])
    with pytest.raises(LinkError, match=r"mvis.icc needs all .* mid.icc, which has no 'b'"):
        iccbrdf.link([mid("ac"), mvis("abc", subset=True, defaults=abc)])


def test_a_flagged_profile_does_not_bind_the_other(tmp_path):
    values = pixels(3)
    narrow = [mid("ab", subset=True), mvis("abc", defaults=NumberArray("fl32", [0, 0, 0.5]))]
    close(iccbrdf.link(narrow)(values[:, :2]), reference(tmp_path, narrow, values[:, :2], pcs="XYZ "))
    wide = [mid("abcd"), mvis("abc", subset=True)]
    assert np.array_equal(iccbrdf.link(wide)(pixels(4)), pixels(4)[:, :3])
    # In any order, though the reference implementation asks for the same positions.
    turned = [mid("cab", subset=True), mvis("abc", subset=True)]
    assert np.array_equal(iccbrdf.link(turned)(values), values[:, [1, 2, 0]])


# Chains by class -----------------------------------------------------------------------------------------


def test_a_single_mid_gives_its_multiplex_channels(tmp_path):
    profile = mid(["kd", "n"], matrix([[0, 0.5], [2, 0]], [0, -1]))
    transform = iccbrdf.link([profile])
    # Device channels are named by what the one-to-one matrix makes of them.
    assert (transform.channels_in, transform.channels_out) == (("n", "kd"), ("kd", "n"))
    found = transform(pixels(2))
    close(found, reference(tmp_path, [profile], pixels(2)))
    assert transform([0.25, 0.5]).tolist() == [0.25, -0.5]


def test_device_channels_without_names_are_numbered():
    assert iccbrdf.link([mid("ab", matrix([[1, 1], [0, 1]]))]).channels_in == ("1", "2")
    named = device_profile("scnr", space="CMYK", A2B0=matrix(np.ones((3, 4))))
    assert iccbrdf.link([named]).channels_in == ("C", "M", "Y", "K")


def test_a_single_mvis_takes_its_multiplex_channels():
    transform = iccbrdf.link([mvis("abc", pcs="Lab ", M2B1=scaled(50))])
    assert (transform.channels_in, transform.channels_out) == (("a", "b", "c"), ("L*", "a*", "b*"))
    assert transform([1, 2, -3]).tolist() == [50, 100, -150]


def multiplex_link(names, transform):
    n = len(names)
    header = Header(device_class="mlnk", colour_space="RGB ", mcs=f"mc{n:04x}")
    return Profile(header, {**TEXTS, "mcta": TagArray.of_texts(names), "M2A0": transform}, source="mlnk.icc")


def test_mid_to_mlnk(tmp_path):
    chain = [mid("abc"), multiplex_link("bca", scaled(0.5))]
    transform = iccbrdf.link(chain)
    assert transform.channels_out == ("R", "G", "B")
    close(transform(pixels(3)), pixels(3)[:, [1, 2, 0]] / 2)
    close(transform(pixels(3)), reference(tmp_path, chain, pixels(3)))


def test_scanner_with_multiplex_space(tmp_path):
    header = Header(device_class="scnr", colour_space="RGB ", pcs="XYZ ", mcs="mc0003")
    tags = {"mcta": TagArray.of_texts("bca"), "A2M0": scaled(0.5), "A2B0": scaled(0.25), "wtpt": XYZ.of(*D50)}
    scanner = Profile(header, {**TEXTS, **tags}, source="scnr.icc")
    to_mvis = [scanner, mvis("abc")]
    close(iccbrdf.link(to_mvis)(pixels(3)), reference(tmp_path, to_mvis, pixels(3), pcs="XYZ "))
    close(iccbrdf.link(to_mvis)(pixels(3)), pixels(3)[:, [2, 0, 1]] / 2)
    # Before anything else it is a scanner like others.
    assert iccbrdf.link([scanner])([1, 2, 4]).tolist() == [0.25, 0.5, 1]


def device_link(transform, space="RGB ", target="CMYK"):
    header = Header(device_class="link", colour_space=space, pcs=target)
    return Profile(header, {**TEXTS, "A2B0": transform}, source="link.icc")


def test_device_links(tmp_path):
    to_cmyk = device_link(matrix([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.3, 0.1]]))
    transform = iccbrdf.link([to_cmyk])
    assert (transform.channels_in, transform.channels_out) == (("R", "G", "B"), ("C", "M", "Y", "K"))
    close(transform(pixels(3)), reference(tmp_path, [to_cmyk], pixels(3)))
    back = device_link(matrix(np.eye(3, 4)), "CMYK", "RGB ")
    assert np.array_equal(iccbrdf.link([to_cmyk, back])(pixels(3)), pixels(3))
    with pytest.raises(LinkError, match=r"gives device space CMYK of 4 channels, but link\.icc takes .* RGB"):
        iccbrdf.link([to_cmyk, to_cmyk])


def test_a_transform_without_elements_is_the_identity():
    assert iccbrdf.link([mid("ab", MultiProcess(2, 2, ()))])([3, 4]).tolist() == [3, 4]


# What does not fit ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("chain", "message"),
    [
        ([mvis("abc"), mid("abc")], "mvis.icc ends on connection space XYZ of 3 channels, mid.icc starts"),
        ([mid("abc"), mid("abc")], "mid.icc ends on multiplex space mc0003 of 3 channels, mid.icc starts"),
        ([mid("abc"), device_profile(A2B0=scaled(1))], "mid.icc ends on multiplex space .* prtr.icc starts"),
        ([mvis("abc"), mvis("abc")], "mvis.icc ends on connection space .* mvis.icc starts from multiplex"),
    ],
)
def test_spaces_that_do_not_meet(chain, message):
    with pytest.raises(LinkError, match=message):
        iccbrdf.link(chain)


def test_files(tmp_path):
    write_profile(mid("ab"), tmp_path / "mid.icc")
    assert iccbrdf.link([str(tmp_path / "mid.icc")])([1, 2]).tolist() == [1, 2]
    with pytest.raises(InputError, match=r"nowhere\.icc: cannot be read"):
        iccbrdf.link([tmp_path / "mid.icc", tmp_path / "nowhere.icc"])
    with pytest.raises(UsageError, match="found a single one"):
        iccbrdf.link(tmp_path / "mid.icc")
    with pytest.raises(UsageError, match="no profile"):
        iccbrdf.link([])
    with pytest.raises(UsageError, match="found None, expected a sequence"):
        iccbrdf.link(None)
    with pytest.raises(UsageError, match="not the path of a file to read"):
        iccbrdf.link([1, 2])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"backend": "interpeter"}, "did you mean 'interpreter'"),
        ({"intent": "relativ"}, "did you mean 'relative'"),
        ({"intent": 1}, "intent 1 is unknown"),
        ({"samples": "devices"}, "did you mean 'device'"),
        ({"dtype": "float16"}, "valid are float32 and float64"),
        ({"dtype": "no type"}, "valid are float32 and float64"),
        ({"threads": 0}, "expected a whole number of at least 1"),
        ({"threads": "2"}, "threads is '2', expected a whole number"),
        ({"threads": 1.5}, "threads is 1.5, expected a whole number"),
        ({"channels": "ab"}, "channels: found 'ab', expected a sequence of names"),
        ({"channels": 2}, "channels: found 2, expected a sequence of names"),
    ],
)
def test_unknown_arguments(arguments, message):
    with pytest.raises(UsageError, match=message) as error:
        iccbrdf.link([mid("ab")], **arguments)
    assert error.value.exit_code == 2


def test_a_missing_or_foreign_transform():
    with pytest.raises(ProfileError, match=r"mid.icc: tag A2M0 is missing"):
        iccbrdf.link([mid("ab").replace(remove=["A2M0"])])
    with pytest.raises(ProfileError, match=r"none of the tags M2B0\.\.3"):
        iccbrdf.link([mvis("abc").replace(remove=["M2B0"])])
    with pytest.raises(UnsupportedError, match="A2M0 is of type 'utf8'"):
        iccbrdf.link([mid("ab", A2M0=Utf8("?"))])
    with pytest.raises(UnsupportedError, match=r"found tag M2S0, which cannot run; expected M2B0\.\.3"):
        iccbrdf.link([mvis("abc", M2S0=scaled(1))])
    with pytest.raises(UnsupportedError, match="found tag bMB0, which cannot run"):
        iccbrdf.link([mvis("abc", bMB0=Utf8("?"))])
    with pytest.raises(ProfileError, match="A2B0 has 4 channels out, expected 3 by the header"):
        iccbrdf.link([device_profile("scnr", A2B0=matrix(np.ones((4, 3))))])


# The caller's own channels -------------------------------------------------------------------------------

DECODE = matrix(np.diag([1, 0.5, 2, 4]), [0, 0, -1, 0])
FLAT = NumberArray("fl32", [0.1, 0.2, 0.3])


def test_channels_in_the_callers_order():
    chain = [mid("abnx", DECODE), mvis("nab")]
    whole = iccbrdf.link(chain)
    turned = iccbrdf.link(chain, channels=["n", "x", "b", "a"])
    assert turned.channels_in == ("n", "x", "b", "a")
    assert np.array_equal(turned(pixels(4)[:, [2, 3, 1, 0]]), whole(pixels(4)))
    same = iccbrdf.link(chain, channels=["a", "b", "n", "x"])
    assert np.array_equal(same(pixels(4)), whole(pixels(4)))


def test_channels_left_out_take_the_defaults_of_the_mvis():
    chain = [mid("abnx", DECODE), mvis("nab", defaults=FLAT)]
    found = iccbrdf.link(chain, channels=["b", "a"])([1, 3])
    np.testing.assert_allclose(found, [0.1, 3, 0.5], rtol=1e-6)


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        (["a", "b", "nn"], "channel 'nn' is not in mid.icc: did you mean 'n'"),
        (["a", "b", 3], "channel 3 is not in mid.icc"),
        (["a", "b", "a"], "channel 'a' comes twice"),
        (["a", "b"], "multiplex channel 'n' of mvis.icc is not in mid.icc, and there is no default"),
        ([], "no channels are named"),
    ],
)
def test_channels_that_do_not_fit(channels, message):
    with pytest.raises(LinkError, match=message):
        iccbrdf.link([mid("abnx", DECODE), mvis("nab")], channels=channels)


def test_a_program_cannot_spare_channels():
    mixing = mid("ab", program("in(0) in(1) add in(0) out(0,2)", 2, 2))
    with pytest.raises(LinkError, match=r"channel '2' is missing, which mid.icc needs"):
        iccbrdf.link([mixing], channels=["1"])
    with pytest.raises(LinkError, match=r"channel 'c' is missing, which mvis.icc needs"):
        iccbrdf.link([mvis("abc")], channels=["a", "b"])
    with pytest.raises(LinkError, match=r"channels n\.x, n\.y, n\.z are missing.*--normals, --height"):
        iccbrdf.link([ROOT / "profiles" / "fogra39_gloss" / "colour-mid.icc"], channels=["X", "Y", "Z"])


def test_real_samples_enter_behind_the_decoding():
    chain = [mid("abnx", DECODE), mvis("nab", defaults=FLAT)]
    real = iccbrdf.link(chain, samples="real")
    assert real.channels_in == ("a", "b", "n", "x")
    assert real([5, -6, 7, 8]).tolist() == [7, 5, -6]
    narrow = iccbrdf.link(chain, samples="real", channels=["b", "a"])
    np.testing.assert_allclose(narrow([5, -6]), [0.1, -6, 5], rtol=1e-6)


def test_real_samples_of_a_decoding_that_reorders():
    chain = [mid("ab", matrix([[0, 2], [4, 0]]))]
    assert iccbrdf.link(chain).channels_in == ("b", "a")
    real = iccbrdf.link(chain, samples="real")
    # What enters is what comes out: the multiplex channels in their own order.
    assert (real.channels_in, real.channels_out) == (("a", "b"), ("a", "b"))
    assert real([1, 2]).tolist() == [1, 2]


def test_real_samples_of_a_calculator_that_decodes():
    decode = program("in(2) in(0) 4 mul -1 add in(1) 2 add out(0,3)", 3, 3)
    chain = [mid("abc", decode)]
    device = iccbrdf.link(chain)
    assert device.channels_in == ("b", "c", "a")
    assert device([1, 2, 3]).tolist() == [3, 3, 4]
    real = iccbrdf.link(chain, samples="real")
    assert real.channels_in == ("a", "b", "c")
    assert real([1, 2, 3]).tolist() == [1, 2, 3]
    narrow = iccbrdf.link(chain, channels=["b", "a"])
    assert narrow.channels_out == ("a", "b")
    assert narrow([1, 2]).tolist() == [2, 3]


@pytest.mark.parametrize("text", ["in(0,2) mul in(1) out(0,2)", "in(0) in(0) out(0,2)", "in(0) 1 out(0,2)"])
def test_calculators_that_do_not_decode_channel_by_channel(text):
    with pytest.raises(LinkError, match="found 'calc'"):
        iccbrdf.link([mid("ab", program(text, 2, 2))], samples="real")


def test_what_the_results_are():
    ends = [mid("abc"), mvis("abc"), device_profile(B2A1=scaled(1))]
    assert [iccbrdf.link(ends[: n + 1]).samples_out for n in range(3)] == ["real", "real", "device"]


def test_real_samples_where_nothing_is_decoded():
    assert iccbrdf.link([mvis("abc")], samples="real")([1, 2, 3]).tolist() == [1, 2, 3]
    with pytest.raises(LinkError, match=r"real samples need .* decodes .* found 'calc'"):
        iccbrdf.link([mid("a", program("in(0) copy mul out(0)", 1, 1))], samples="real")
    with pytest.raises(LinkError, match="found 'matf'"):
        iccbrdf.link([mid("ab", matrix([[1, 1], [0, 1]]))], samples="real")
