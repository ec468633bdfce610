"""Named colours and colour encodings in chains, and bi-spectral colours, which named ones often are."""

from dataclasses import replace

import colour
import numpy as np
import pytest
from cmm_examples import TEXTS, WHITE, device_profile, matrix, reference, scaled

import iccbrdf
from iccbrdf.cmm.encodings import as_display
from iccbrdf.cmm.ramps import named_colours
from iccbrdf.errors import InputError, LimitError, LinkError, ProfileError, UnsupportedError
from iccbrdf.icc import (
    D50,
    XYZ,
    FormulaSegment,
    Header,
    Member,
    NamedColour,
    NamedColours,
    NumberArray,
    PlainText,
    Profile,
    SegmentedCurve,
    SparseMatrix,
    SparseMatrixArray,
    TagArray,
    TagStruct,
    Utf8,
    ViewingConditions,
)

PAPER, RED, DEEP = (95.0, 1.0, -2.0), (50.0, 60.0, 30.0), (30.0, 50.0, 20.0)
RNG = np.random.default_rng(4)


def numbers(*values, kind="fl32"):
    return NumberArray(kind, np.concatenate([np.ravel(v) for v in values]))


def structure(kind, **members):
    """Members whose names are shorter than four characters are padded."""
    return TagStruct(kind, tuple(Member(f"{name:<4}", value) for name, value in members.items()))


def named(*colours, zero=None, tag="ncl2", array="nmcl", pcs="Lab ", tags=None, **header):
    """A profile of version 5; `colours` are structures."""
    items = (structure("tnt0", **(zero or {})), *colours)
    fields = {"device_class": "nmcl", "colour_space": "", "pcs": pcs} | header
    return Profile(
        Header(**fields), {**TEXTS, **(tags or {}), tag: TagArray(array, items)}, source="named.icc"
    )


def inks(**options):
    return named(
        structure("nmcl", name=Utf8("Red"), pcs=numbers(RED)),
        structure("nmcl", name=Utf8("Deep: red"), pcs=numbers(RED, DEEP), tint=numbers(0.5, 1)),
        structure("nmcl", name=Utf8("Bare"), spec=numbers(0.5)),
        zero={"pcs": numbers(PAPER)},
        **options,
    )


def run(profiles, pixels, **options):
    return iccbrdf.link(profiles, dtype=np.float64, **options)(pixels)


def mixed(a, b, amount):
    return (1 - amount) * np.array(a) + amount * np.array(b)


@pytest.mark.parametrize(("tag", "array"), [("ncl2", "nmcl"), ("nmcl", "ncol")])
def test_tints(tag, array):
    profile = inks(tag=tag, array=array)
    assert named_colours(profile) == ("Red", "Deep: red", "Bare")
    transform = iccbrdf.link([profile], dtype=np.float64)
    assert transform.channels_in == ("colour", "tint")
    assert transform.channels_out == ("L*", "a*", "b*")
    found = transform([[0, 1], [0, 0.25], [0, 0], [1, 0.25], [1, 0.8], [1, 1]])
    expected = [RED, mixed(PAPER, RED, 0.25), PAPER, mixed(PAPER, RED, 0.5), mixed(RED, DEEP, 0.6), DEEP]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_tints_beyond_0_and_1_are_held():
    found = run([inks()], [[0, -1], [0, 2], [0, np.nan]])
    np.testing.assert_allclose(found[:2], [PAPER, RED])
    assert np.isnan(found[2]).all()


def test_equal_steps_where_no_tints_are_told():
    profile = named(structure("nmcl", name=Utf8("A"), pcs=numbers(RED, DEEP)), zero={"pcs": numbers(PAPER)})
    found = run([profile], [[0, 0.25], [0, 0.5], [0, 0.75]])
    np.testing.assert_allclose(found, [mixed(PAPER, RED, 0.5), RED, mixed(RED, DEEP, 0.5)])


def test_shapes_and_back_ends():
    transform = iccbrdf.link([inks()])
    assert transform.backend == "interpreter"
    assert transform(np.zeros((2, 5, 2))).shape == (2, 5, 3)
    assert transform(np.zeros((0, 2))).shape == (0, 3)
    assert (
        iccbrdf.link([inks()], channels=["tint", "colour"])([0.5, 0]).tolist() == transform([0, 0.5]).tolist()
    )
    with pytest.raises(UnsupportedError, match="back end numpy: named colours are looked up one by one"):
        iccbrdf.link([inks()], backend="numpy")


def test_colours_that_are_not_there():
    transform = iccbrdf.link([inks()])
    for position in (-1, 3, 0.5, np.nan, np.inf):
        with pytest.raises(
            InputError, match=r"named colours: found colour .*, expected a whole number from 0 to 2"
        ):
            transform([position, 1])
    with pytest.raises(InputError, match="named colours: 'Bare' has no values in the space"):
        transform([2, 1])
    bare = iccbrdf.link([named(structure("nmcl", name=Utf8("Red"), pcs=numbers(RED)))])
    assert bare([0, 1]).tolist() == list(RED)
    with pytest.raises(InputError, match=r"'Red': found tint 0\.5, the profile tells only 1"):
        bare([0, 0.5])
    told = structure("nmcl", name=Utf8("Red"), pcs=numbers(RED, DEEP), tint=numbers(0.25, 0.5))
    with pytest.raises(InputError, match=r"'Red': found tint 1, the profile tells 0\.25 to 0\.5"):
        iccbrdf.link([named(told)])([0, 1])


def test_values_are_relative_to_the_media_white():
    """As the reference implementation has them: absolute XYZ are those times the white over D50."""
    white = np.array([0.9, 0.95, 0.7])
    ink = structure("nmcl", name=Utf8("A"), pcs=numbers([0.3, 0.2, 0.1]))
    profile = named(ink, pcs="XYZ ", tags={"wtpt": XYZ.of(*white)})
    np.testing.assert_allclose(run([profile], [[0, 1]]), [[0.3, 0.2, 0.1]], rtol=1e-6)
    found = run([profile], [[0, 1]], intent="absolute")
    np.testing.assert_allclose(found[0], [0.3, 0.2, 0.1] * white / D50, rtol=1e-4)
    # Perceptual colours have the black that version 4 has agreed on.
    black = np.array([0.00336, 0.0034731, 0.00287])
    found = run([profile], [[0, 1]], intent="perceptual")
    np.testing.assert_allclose(found[0], np.array([0.3, 0.2, 0.1]) * (1 - black / D50) + black, rtol=1e-5)


def test_on_to_a_device():
    device = device_profile("prtr", pcs="Lab ", B2A1=scaled(0.01))
    np.testing.assert_allclose(run([inks(), device], [[0, 1]]), [np.array(RED) / 100], rtol=1e-6)


@pytest.mark.parametrize(("pcs", "version"), [("Lab ", (2, 4, 0)), ("Lab ", (4, 3, 0)), ("XYZ ", (4, 3, 0))])
def test_before_version_5(pcs, version):
    table = NamedColours(
        (NamedColour("Red", (32640, 49152, 16384)), NamedColour("b", (0, 1, 2))), 0, "P ", " s"
    )
    header = Header(device_class="nmcl", colour_space="RGB ", pcs=pcs, version=version)
    profile = Profile(header, {"wtpt": XYZ.of(*D50), "ncl2": table}, source="old.icc")
    assert named_colours(profile) == ("P Red s", "P b s")
    transform = iccbrdf.link([profile], dtype=np.float64)
    assert transform.channels_in == ("colour",)
    assert transform([0]).tolist() == ([50, 64, -64] if pcs == "Lab " else [32640 / 32768, 1.5, 0.5])


LAB = RNG.uniform((60, -40, -40), (100, 40, 40), (40, 3)).astype(np.float32)


@pytest.mark.parametrize("pcs", ["Lab ", "XYZ "])
def test_the_nearest_name(pcs):
    values = LAB if pcs == "Lab " else colour.Lab_to_XYZ(LAB, colour.XYZ_to_xy(WHITE))
    profile = named(
        structure("nmcl", name=Utf8("spectrum alone"), spec=numbers(0.5)),
        *(structure("nmcl", name=Utf8(str(i)), pcs=numbers(v)) for i, v in enumerate(values)),
        pcs=pcs,
    )
    pixels = RNG.uniform((60, -40, -40), (100, 40, 40), (300, 3))
    source = device_profile("scnr", pcs="Lab ", A2B1=matrix(np.eye(3)))
    transform = iccbrdf.link([source, profile], dtype=np.float64)
    assert transform.channels_out == ("colour",)
    distances = colour.delta_E(pixels[:, None], LAB[None], method="CIE 1976")
    assert transform(pixels)[:, 0].tolist() == (distances.argmin(axis=1) + 1).tolist()
    assert np.isnan(transform([np.nan, 0, 0]))


def test_names_stand_at_the_ends_of_a_chain():
    printer = device_profile("prtr", pcs="Lab ", B2A1=scaled(1.0))
    with pytest.raises(LinkError, match=r"named\.icc: named colours: found device space RGB"):
        iccbrdf.link([inks(), printer, inks()])
    source = device_profile("scnr", pcs="Lab ", A2B1=scaled(1.0))
    with pytest.raises(LinkError, match="found named colours"):
        iccbrdf.link([source, inks(), inks()])


MALFORMED = [
    ({"tags": {"ncl2": PlainText("a")}}, "tag ncl2: found 'text', expected 'ncl2', or an array of 'nmcl'"),
    ({"tags": {"ncl2": TagArray("utf8", ())}}, "tag ncl2: found an array of 'utf8'"),
    ({"tags": {"ncl2": TagArray("nmcl", ())}}, "found none, expected a zero tint and colours"),
    (
        {"tags": {"ncl2": TagArray("nmcl", (None,))}},
        "item 0: found None, expected a structure of type 'tnt0'",
    ),
    ({"tags": {"ncl2": TagArray("nmcl", (structure("nmcl"),))}}, "item 0: found 'nmcl', expected .* 'tnt0'"),
    ({"remove": ["ncl2"]}, "no named colours, expected tag ncl2 or nmcl"),
]


@pytest.mark.parametrize(("change", "message"), MALFORMED)
def test_malformed_tables(change, message):
    with pytest.raises(ProfileError, match=message):
        iccbrdf.link([inks().replace(**change)])


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({}, "found no connection space colours for any of them"),
        (
            {"pcs": numbers(RED, 1)},
            "'A', connection space colours: found 4 numbers, expected a multiple of 3",
        ),
        ({"pcs": Utf8("a")}, "'A', connection space colours: found type 'utf8', expected numbers"),
        ({"pcs": numbers(RED), "tint": numbers(0, 1)}, "'A': found 2 tints for 1 connection space"),
        ({"pcs": numbers(RED), "tint": Utf8("a")}, "'A', tints: found type 'utf8', expected numbers"),
        (
            {"pcs": numbers(RED, DEEP), "tint": numbers(1, 0.5)},
            r"tints: found \[.*\], expected .* increase",
        ),
        (
            {"pcs": numbers(RED, DEEP), "tint": numbers(0.5, np.nan)},
            "tints: found .* expected numbers that incr",
        ),
    ],
)
def test_malformed_colours(members, message):
    with pytest.raises(ProfileError, match=message):
        iccbrdf.link([named(structure("nmcl", name=Utf8("A"), **members))])


def test_too_many_numbers(monkeypatch):
    monkeypatch.setattr("iccbrdf.cmm.ramps.MAX_NUMBERS", 20)
    with pytest.raises(LimitError, match="named colours: more than 20 numbers"):
        iccbrdf.link([inks()])


AT, BY = (400.0, 700.0), (250.0, 700.0)
ROWS, COLUMNS = 5, 7


def svcn():
    shape = colour.SpectralShape(380, 780, 10)
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values
    light = np.linspace(120, 60, len(cmfs))
    x, y, z = cmfs.T @ light
    stated = (x / y, 1.0, z / y)
    return ViewingConditions(1, 5, stated, stated, (380.0, 780.0), cmfs.T, (380.0, 780.0), light)


def conversions():
    return {"svcn": svcn(), "c2sp": matrix(np.eye(3)), "s2cp": matrix(np.eye(3))}


def fluorescent(*colours, space=f"bs{ROWS * COLUMNS:04x}", **zero):
    return named(
        *colours, zero=zero, pcs="", spectral_pcs=space, spectral_range=AT, spectral_steps=ROWS,
        bispectral_range=BY, bispectral_steps=COLUMNS, tags=conversions(),
    )  # fmt: skip


DIFFUSER = np.eye(ROWS, COLUMNS, COLUMNS - ROWS)
"""What falls on it, it gives back at the same wavelength."""
NEON = 0.5 * DIFFUSER + RNG.uniform(0, 0.3, (ROWS, COLUMNS)) * (RNG.uniform(size=(ROWS, COLUMNS)) < 0.3)


def test_the_perfect_diffuser_is_white():
    profile = fluorescent(structure("nmcl", name=Utf8("A"), spec=numbers(DIFFUSER)))
    to_xyz = device_profile("spac", space="nc0003", pcs="XYZ ", B2A1=matrix(np.eye(3)))
    found = run([profile, to_xyz], [[0, 1]])
    np.testing.assert_allclose(found[0], svcn().illuminant_XYZ, rtol=1e-6)


def test_fluorescent_colours_as_in_the_reference_implementation(tmp_path):
    """The same matrices from a profile whose device values are they: the reference takes pixels alone."""
    count = ROWS * COLUMNS
    header = Header(
        device_class="scnr", colour_space=f"nc{count:04x}", spectral_pcs=f"bs{count:04x}", spectral_range=AT,
        spectral_steps=ROWS, bispectral_range=BY, bispectral_steps=COLUMNS,
    )  # fmt: skip
    picked = np.eye(count)
    stand_in = Profile(header, {**conversions(), "D2B1": matrix(picked)}, source="bs.icc")
    ink = structure("nmcl", name=Utf8("A"), spec=numbers(NEON))
    profile = fluorescent(ink, spec=numbers(DIFFUSER))
    tints = np.array([0, 0.3, 1])
    values = (mixed(DIFFUSER, NEON, tints[:, None, None])).reshape(3, -1)
    colours = np.column_stack([np.zeros(3), tints])
    ends = {"pcs": device_profile("spac", space="nc0003", B2A1=matrix(np.eye(3)))}
    for kind in ("rs", "es"):
        there = Header(
            device_class="spac", colour_space="nc0010", spectral_pcs=f"{kind}0010",
            spectral_range=(420.0, 720.0), spectral_steps=16,
        )  # fmt: skip
        ends[kind] = Profile(there, {**conversions(), "B2D1": matrix(np.eye(16))}, source=f"{kind}.icc")
    for end in ends.values():
        expected = reference(tmp_path, [stand_in, end], values)
        np.testing.assert_allclose(run([profile, end], colours), expected, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(run([stand_in, end], values), expected, rtol=1e-4, atol=1e-5)
    assert run([profile], colours).shape == (3, count)


def test_sparse_matrices_are_the_matrices_that_they_stand_for():
    def sparse(array):
        return SparseMatrixArray(768, 4, (SparseMatrix.of(array),))

    full = structure("nmcl", name=Utf8("A"), spec=numbers(NEON))
    packed = structure("nmcl", name=Utf8("A"), spec=sparse(NEON))
    expected = run([fluorescent(full, spec=numbers(DIFFUSER))], [[0, 0.25], [0, 1]])
    found = run([fluorescent(packed, space="sm0300", spec=sparse(DIFFUSER))], [[0, 0.25], [0, 1]])
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    turned = structure("nmcl", name=Utf8("A"), spec=sparse(NEON.T))
    with pytest.raises(ProfileError, match="found a matrix of 7 by 5 numbers, expected 5 rows, 35 numbers"):
        run([fluorescent(turned, space="sm0300")], [[0, 1]])


def test_bispectral_spaces_that_do_not_link():
    ink = structure("nmcl", name=Utf8("A"), spec=numbers(np.ones(10)))
    wrong = fluorescent(ink, space="bs000a")
    device = device_profile("spac", space="nc0003", B2A1=matrix(np.eye(3)))
    with pytest.raises(
        ProfileError, match="of 10 channels, expected one for each pair of 5 wavelengths and 7"
    ):
        run([wrong, device], [[0, 1]])
    unstated = wrong.replace(header=replace(wrong.header, bispectral_steps=0, spectral_pcs="sm000a"))
    with pytest.raises(ProfileError, match="found matrices of 5 by 0 numbers"):
        run([unstated], [[0, 1]])


def test_reflectance_is_told_by_light():
    ink = structure("nmcl", name=Utf8("A"), spec=numbers(NEON))
    dark = svcn()
    dark = replace(dark, spd=np.where(np.arange(dark.spd.size) < 20, dark.spd, 0))
    profile = fluorescent(ink).replace(tags={"svcn": dark})
    header = Header(device_class="spac", spectral_pcs="rs0005", spectral_range=AT, spectral_steps=5)
    header = replace(header, colour_space="nc0005")
    there = Profile(header, {**conversions(), "B2D1": matrix(np.eye(5))})
    with pytest.raises(ProfileError, match="illuminant: found no light at some wavelengths"):
        run([profile, there], [[0, 1]])


SRGB_D50 = [
    [0.4360747, 0.3850649, 0.1430804],
    [0.2225045, 0.7168786, 0.0606169],
    [0.0139322, 0.0971045, 0.7141733],
]
"""Bradford-adapted (B. Lindbloom, RGB/XYZ matrices; from x = .31271, y = .32902)."""


def encoding(reference_name, *, space="RGB ", **members):
    tags = {"rfnm": Utf8(reference_name)}
    if members:
        tags["cept"] = structure("cept", **members)
    return Profile(Header(device_class="cenc", colour_space=space, pcs=""), tags, source="encoding.icc")


def power(gamma=0.5):
    return SegmentedCurve((), (FormulaSegment(0, (gamma, 1, 0, 0)),))


def parameters(**changed):
    """Those of sRGB but for its curve, here a square root."""
    points = {"rXYZ": (0.64, 0.33, 0.03), "gXYZ": (0.3, 0.6), "bXYZ": (0.15, 0.06), "wXYZ": (0.3127, 0.329)}
    found = {name: numbers(point) for name, point in points.items()} | {"func": power()} | changed
    return {name: value for name, value in found.items() if value is not None}


RGB = RNG.uniform(0, 1, (30, 3))


def test_srgb_by_name():
    found = run([encoding("sRGB")], RGB)
    linear = np.where(RGB <= 0.04045, RGB / 12.92, ((RGB + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(found, linear @ np.array(SRGB_D50).T, atol=4e-4)
    np.testing.assert_allclose(run([encoding("sRGB")], [[1, 1, 1]], intent="absolute")[0], D50, rtol=1e-6)


def test_an_encoding_by_its_parameters():
    found = run([encoding("ISO 22028-1", **parameters())], RGB)
    np.testing.assert_allclose(found, RGB**2 @ np.array(SRGB_D50).T, atol=4e-4)
    overridden = run([encoding("sRGB", func=power())], RGB)
    np.testing.assert_allclose(overridden, found, rtol=1e-5)


def test_encodings_there_and_back():
    pixels = np.concatenate([RGB, [[-0.02, 0.5, 1.3]]])
    found = run([encoding("sRGB"), encoding("sRGB")], pixels)
    np.testing.assert_allclose(found, pixels, atol=1e-5)
    lower, upper = FormulaSegment(0, (1, 2, 0.25, 0.25)), FormulaSegment(3, (2, 0.5, 1, 1, 0))
    own = encoding("ISO 22028-1", **parameters(func=SegmentedCurve((0.0,), (lower, upper))))
    np.testing.assert_allclose(run([own, own], pixels), pixels, atol=1e-5)


def test_the_reference_runs_an_encoding_once_it_is_a_display(tmp_path):
    display = as_display(encoding("sRGB"))
    expected = reference(tmp_path, [display], RGB, pcs="XYZ ")
    np.testing.assert_allclose(run([encoding("sRGB")], RGB), expected, rtol=1e-4, atol=1e-5)


FALLING = SegmentedCurve((), (FormulaSegment(0, (1, -1, 0, 0)),))
APART = SegmentedCurve((0.5,), (FormulaSegment(0, (1, 1, 0, 0)), FormulaSegment(0, (1, 1, 0, -0.5))))
TINY = SegmentedCurve((), (FormulaSegment(0, (1, 1e-40, 0, 0)),))
LOGARITHM = SegmentedCurve((), (FormulaSegment(1, (1, 1, 1, 1, 0)),))


@pytest.mark.parametrize(
    ("profile", "error", "message"),
    [
        (encoding("sRGBB"), UnsupportedError, "name 'sRGBB' .* is not known here: did you mean 'sRGB'"),
        (encoding("sRGB", space="CMYK"), UnsupportedError, "found 'CMYK', expected 'RGB '"),
        (encoding("sRGB", lmat=numbers(np.eye(3))), UnsupportedError, "found luma and chroma"),
        (encoding("sRGB", func=FALLING), UnsupportedError, "does not increase"),
        (encoding("sRGB", func=APART), UnsupportedError, "does not increase"),
        (encoding("sRGB", func=TINY), UnsupportedError, "does not increase"),
        (
            encoding("sRGB", func=LOGARITHM),
            UnsupportedError,
            "not all powers, expected formulas of type 0 or 3",
        ),
        (encoding("ISO 22028-1"), ProfileError, "member func: expected a segmented curve"),
        (
            encoding("ISO 22028-1", **parameters(wXYZ=None)),
            ProfileError,
            "member wXYZ: expected chromaticities",
        ),
        (encoding("sRGB", rXYZ=numbers(0.3, 0)), ProfileError, "member rXYZ: expected chromaticities"),
        (encoding("sRGB", rXYZ=numbers(0.3, 0.6)), ProfileError, "expected three that are not on a line"),
    ],
)
def test_encodings_that_are_refused(profile, error, message):
    with pytest.raises(error, match=f"encoding.icc: colour encoding: .*{message}"):
        iccbrdf.link([profile])
