"""The tables against the exact map, with Little CMS and iccdev as witnesses.

imagecodecs' own functions know no pixels of five channels and more, so its Little CMS is called directly.
"""

from __future__ import annotations

import ctypes
import functools
from dataclasses import replace
from pathlib import Path

import iccdev
import imagecodecs
import numpy as np
import pytest
from cmm_examples import reference

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.brdf.primaries import Primaries, read_primaries
from iccbrdf.build.power import cube, near_exponential, root
from iccbrdf.build.table import HEADROOM, build_table_mid, build_table_profile
from iccbrdf.build.table_error import sample
from iccbrdf.cmm import link
from iccbrdf.errors import InputError, UsageError
from iccbrdf.icc import Header, Matrix, Mluc, MultiProcess, Profile, TagArray
from iccbrdf.resources import folder

PRIMARIES = read_primaries(folder("profiles") / "fogra39_gloss" / "primaries.json")
COLOURS = sample(PRIMARIES)[::5]
EXACT = interpolate(COLOURS, PRIMARIES)
NO_OPTIMISATION = 0x0100
RELATIVE, ABSOLUTE = 1, 3


def of_model(model: str) -> Primaries:
    """The example with the parameters of another model."""
    pick = {"ward": [0, 1, 2, 4, 6], "brdf2": [0, 1, 2, 3, 4, 5, 6, 6, 6]}[model]
    entries = [replace(p, parameters=tuple(np.array(p.parameters)[pick])) for p in PRIMARIES.primaries]
    encoding = {"Rd" if family == "kd" and model == "ward" else family: 1.0 for family in PRIMARIES.encoding}
    return replace(PRIMARIES, model=model, primaries=tuple(entries), encoding=encoding)


@functools.cache
def table_profile(grid: int = 17):
    return build_table_profile(PRIMARIES, grid=grid)


@functools.cache
def table_mid(grid: int = 17):
    return build_table_mid(PRIMARIES, grid=grid)


def errors(found: np.ndarray, exact: np.ndarray = EXACT) -> tuple[float, float, float, float]:
    """CIEDE2000 of kd and difference of the logarithms of gloss, mean and maximum each."""
    Lab, Lab_exact = (XYZ_to_Lab(values[:, :3], PRIMARIES.white) for values in (found, exact))
    difference = delta_E_CIE2000(Lab, Lab_exact)
    gloss = np.abs(np.log(found[:, 3:]) - np.log(exact[:, 3:]))
    return difference.mean(), difference.max(), gloss.mean(), gloss.max()


@functools.cache
def little_cms() -> ctypes.CDLL:
    libraries = list(Path(imagecodecs.__file__).parent.parent.glob("imagecodecs.libs/liblcms2*"))
    if not libraries:
        pytest.skip("imagecodecs comes without a Little CMS library of its own")
    lcms = ctypes.CDLL(str(libraries[0]))
    pointer, number = ctypes.c_void_p, ctypes.c_uint32
    for name, arguments in {
        "cmsOpenProfileFromMem": [ctypes.c_char_p, number],
        "cmsCreateXYZProfile": [],
        "cmsCreateTransform": [pointer, number, pointer, number, number, number],
        "cmsDoTransform": [pointer, pointer, pointer, number],
    }.items():
        function = getattr(lcms, name)
        function.argtypes, function.restype = arguments, pointer
    return lcms


def by_little_cms(profile: Profile, XYZ: np.ndarray, *, intent=RELATIVE, flags=0, integers=False):
    """Device values, through unsigned 16-bit integers or floating point at both ends."""
    lcms = little_cms()
    data = profile.to_bytes()
    channels = int(profile.header.colour_space[0])
    kind = 2 if integers else 1 << 22 | 4  # bytes a sample, and the mark of floating point
    transform = lcms.cmsCreateTransform(
        lcms.cmsCreateXYZProfile(),
        9 << 16 | 3 << 3 | kind,
        lcms.cmsOpenProfileFromMem(data, len(data)),
        14 + channels << 16 | channels << 3 | kind,
        intent,
        flags,
    )
    assert transform
    pixels = np.rint(XYZ * 32768).astype(np.uint16) if integers else XYZ.astype(np.float32)
    found = np.empty((len(XYZ), channels), pixels.dtype)
    lcms.cmsDoTransform(transform, pixels.ctypes.data, found.ctypes.data, len(XYZ))
    # Floating-point samples of inks are in per cent.
    return found.astype(float) / (65535 if integers else 100)


def by_iccdev(path: Path, profile: Profile, XYZ: np.ndarray, **options) -> np.ndarray:
    path.write_bytes(profile.to_bytes())
    with iccdev.IccCmm(src_space=iccdev.ColorSpace.XYZ, first_is_input=False) as cmm:
        cmm.attach(path, intent=RELATIVE, **options)
        cmm.begin()
        return cmm.apply_ndarray(np.ascontiguousarray(XYZ * 32768 / 65535, np.float32)).astype(float)


# The curves --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("knee", [0.01, 0.0091, 1 / 3])
def test_axes_stay_within_the_table(knee):
    curve = root(knee)
    assert 0 <= curve(0) < 4e-5
    assert 1 - 4e-5 < curve(1) <= 1
    x = np.linspace(0, 1, 101)
    ends = np.cbrt([knee, 1 + knee])
    assert curve(x) == pytest.approx((np.cbrt(x + knee) - ends[0]) / (ends[1] - ends[0]), abs=6e-5)
    assert curve.inverse(curve(x)) == pytest.approx(x, abs=1e-12)


def test_codings_reach_their_ends():
    diffuse, gloss = cube(0.009, 0.87), near_exponential(0.004, 0.3)
    assert 0 <= diffuse(0) < 2e-5
    assert 0.87 <= diffuse(1) < 0.8702
    assert 0.3999 * 0.01 < gloss(0) <= 0.004
    assert 0.3 <= gloss(1) < 0.301
    assert near_exponential(0.2, 0.2)(0.5) == pytest.approx(0.2, rel=2e-3)


def test_profiles_store_the_curves_exactly():
    curve = root(0.009)
    stored = (curve.g, curve.a, curve.b, curve.c)
    assert curve.parametric.parameters == stored
    assert curve.formula.parameters == stored


# Accuracy ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("grid", "diffuse", "gloss"), [(17, 0.30, 0.020), (33, 0.15, 0.011)])
def test_error_of_the_smooth_map(grid, diffuse, gloss):
    for _, error in (table_profile(grid), table_mid(grid)):
        for spreads in error.tags.values():
            assert 0 < spreads["kd"].maximum < diffuse
            assert 0 < spreads["kd"].mean < diffuse / 14
            assert spreads["kd"].mean < spreads["kd"].percentile_95 < spreads["kd"].maximum
            for name in ("ln ks", "ln m"):
                assert 0 < spreads[name].maximum < gloss
                assert 0 < spreads[name].mean < gloss / 15


def test_error_lies_where_it_says():
    profile, error = table_mid()
    spread = error.tags["A2M0"]["kd"]
    XYZ = np.array([spread.worst_XYZ])
    found = link([profile], samples="real")(np.hstack([XYZ, [[0, 0, 1]]]))[:, :7]
    assert errors(found, interpolate(XYZ, PRIMARIES))[1] == pytest.approx(spread.maximum, rel=1e-3)


def test_offset_and_coding_earn_their_place():
    """The offset in the MID is better than the cube root of kd; so is a finer grid."""
    mids = [table_mid(grid)[1].tags["A2M0"]["kd"].mean for grid in (17, 33)]
    assert mids[0] < 0.6 * table_profile()[1].tags["B2D0"]["kd"].mean
    assert mids[1] < 0.4 * mids[0]


def test_no_table_comes_near_to_the_published_map():
    maxima = []
    for grid in (17, 33):
        _, error = build_table_mid(PRIMARIES, method="published", grid=grid)
        assert error.tags["A2M0"]["kd"].mean < 0.6
        maxima.append([spread.maximum for spread in error.tags["A2M0"].values()])
        assert "no grid makes the maxima small" in str(error)
    assert np.all(np.array(maxima[1]) > 0.5 * np.array(maxima[0]))
    assert maxima[1][0] > 2


def test_report():
    _, error = table_profile()
    text = str(error)
    lines = text.splitlines()
    assert lines[0].startswith("Table of 17 x 17 x 17 against the exact map (smooth), 11476 colours")
    assert [line[:21].strip() for line in lines[2:]] == [
        f"{tag} {name}" for tag in ("B2A0", "B2D0") for name in ("CIEDE2000 of kd", "ln ks", "ln m")
    ]
    assert f"{error.tags['B2D0']['ln m'].maximum:.5f}" in lines[-1]
    assert "published" not in text


# The version 4 profile ---------------------------------------------------------------------------------


@pytest.mark.parametrize("model", ["brdf1", "brdf2", "ward"])
def test_profile_is_valid(model):
    primaries = PRIMARIES if model == "brdf1" else of_model(model)
    profile, _ = build_table_profile(primaries, grid=17)
    result = iccdev.validate_profile(profile.to_bytes())
    assert (result.status, result.report.strip()) == (iccdev.ValidationStatus.OK, "")
    assert profile.header.colour_space == {"brdf1": "7CLR", "brdf2": "9CLR", "ward": "5CLR"}[model]
    found = by_little_cms(profile, COLOURS)
    assert errors(found, interpolate(COLOURS, primaries))[1] < 0.3


@pytest.mark.parametrize("intent", [RELATIVE, ABSOLUTE])
@pytest.mark.parametrize("family", ["B2A", "B2D"])
def test_little_cms_gives_the_map(family, intent):
    other = {"B2A": "B2D", "B2D": "none"}[family]
    profile, error = table_profile()
    profile = profile.replace(remove=[tag for tag in profile if tag.startswith(other)])
    mean, maximum, gloss_mean, gloss_maximum = errors(by_little_cms(profile, COLOURS, intent=intent))
    # It cuts cells into tetrahedra, so that errors are alike but not the same.
    spreads = error.tags[f"{family}0"]
    assert mean < 1.3 * spreads["kd"].mean
    assert maximum < 1.3 * spreads["kd"].maximum
    assert gloss_mean < 2 * spreads["ln ks"].mean
    assert gloss_maximum < 1.3 * spreads["ln ks"].maximum


def test_little_cms_in_16_bits():
    profile, error = table_profile()
    profile = profile.replace(remove=[f"B2D{i}" for i in range(4)])
    found = by_little_cms(profile, COLOURS, flags=NO_OPTIMISATION, integers=True)
    assert errors(found)[0] < 1.3 * error.tags["B2A0"]["kd"].mean
    optimised = by_little_cms(profile, COLOURS, integers=True)
    assert errors(optimised)[1] > 1  # the reason for the flag


@pytest.mark.parametrize("in_floating_point", [True, False])
def test_iccdev_gives_the_map(tmp_path, in_floating_point):
    """It interpolates as the error report does, and does not round to 16 bits on the way."""
    profile, error = table_profile()
    found = by_iccdev(tmp_path / "table.icc", profile, COLOURS, use_d2b=in_floating_point)
    exact = errors(found)
    spreads = error.tags["B2D0"]
    assert exact[0] == pytest.approx(spreads["kd"].mean, rel=0.1)
    assert exact[1] < 1.01 * spreads["kd"].maximum
    assert exact[3] < 1.01 * spreads["ln ks"].maximum


def test_beyond_the_table_holds_its_end(tmp_path):
    profile, _ = table_profile()
    white = np.array(PRIMARIES.white)
    colours = np.array([[-0.1, 0.2, -2], 1.3 * white, [0.0, 0, 0]])
    held = np.clip(colours, 0, HEADROOM * white)
    for found in (by_little_cms(profile, colours), by_iccdev(tmp_path / "t.icc", profile, colours)):
        assert np.minimum(found, 1) == pytest.approx(
            np.minimum(interpolate(held, PRIMARIES), 1), rel=0.01, abs=1e-3
        )


def test_another_illuminant():
    """The profile starts from D50; the primaries' own XYZ are what it looks up."""
    white = (0.9504, 1.0, 1.0888)
    primaries = replace(PRIMARIES, illuminant="D65", white=white)
    profile, error = build_table_profile(primaries, grid=17)
    assert iccdev.validate_profile(profile.to_bytes()).status == iccdev.ValidationStatus.OK
    # Bradford's adaptation from D65 to D50, as the ICC publishes it for sRGB.
    to_d50 = np.array(
        [[1.047886, 0.022919, -0.050216], [0.029582, 0.990484, -0.017079], [-0.009252, 0.015073, 0.751678]]
    )
    assert profile["chad"].values.reshape(3, 3) == pytest.approx(to_d50, abs=2e-4)
    found = by_little_cms(profile, COLOURS @ to_d50.T)
    assert errors(found, interpolate(COLOURS, primaries))[1] < 0.4
    assert error.tags["B2D0"]["kd"].maximum < 0.4


def test_backwards_a_colour_is_its_kd(tmp_path):
    profile, _ = table_profile()
    path = tmp_path / "table.icc"
    path.write_bytes(profile.to_bytes())
    with iccdev.IccCmm() as cmm:
        cmm.attach(path, intent=RELATIVE)
        cmm.begin()
        found = cmm.apply_ndarray(np.ascontiguousarray(EXACT, np.float32)) * (65535 / 32768)
    assert found == pytest.approx(EXACT[:, :3], abs=3e-5)


def test_encoding_too_narrow_for_a_colour():
    """Device values are the encoding's; what exceeds it is clipped, out of gamut, and in the report."""
    encoding = {"kd": 1.0, "ks": 0.25, "m": 0.5}
    profile, error = build_table_profile(replace(PRIMARIES, encoding=encoding), grid=17)
    found = by_little_cms(profile, COLOURS) * np.repeat([1, 0.25, 0.5], [3, 3, 1])
    assert errors(found)[1] < 0.3
    clipped = by_little_cms(profile, COLOURS, integers=True, flags=NO_OPTIMISATION)
    assert clipped[:, 4].max() == 1
    largest = interpolate(sample(PRIMARIES), PRIMARIES)[:, 3:6].max()
    assert error.tags["B2A0"]["ln ks"].maximum == pytest.approx(np.log(largest / 0.25), rel=1e-3)
    below_white = slice(0, 15)
    gamut, wider = (
        p["gamt"].clut.table[below_white, below_white, below_white] for p in (profile, table_profile()[0])
    )
    assert (gamut.max(), wider.max()) == (1, 0)


# The MID -----------------------------------------------------------------------------------------------


def with_normals(XYZ: np.ndarray) -> np.ndarray:
    return np.hstack([XYZ, np.tile([0.6, 0, 0.8], (len(XYZ), 1))])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_mid_gives_the_map(dtype):
    profile, error = table_mid()
    transform = link([profile], samples="real", dtype=dtype)
    assert transform.channels_in == ("X", "Y", "Z", "n.x", "n.y", "n.z")
    assert transform.channels_out == (
        "kd.X",
        "kd.Y",
        "kd.Z",
        "ks.X",
        "ks.Y",
        "ks.Z",
        "m",
        "n.x",
        "n.y",
        "n.z",
    )
    found = transform(with_normals(COLOURS))
    assert found[:, 7:] == pytest.approx(np.tile([0.6, 0, 0.8], (len(COLOURS), 1)))
    mean, maximum, _, gloss = errors(found[:, :7])
    assert mean == pytest.approx(error.tags["A2M0"]["kd"].mean, rel=0.1)
    assert maximum < 1.01 * error.tags["A2M0"]["kd"].maximum
    assert gloss < 1.01 * error.tags["A2M0"]["ln ks"].maximum


def test_mid_decodes_its_device_channels():
    profile, _ = table_mid()
    device = np.hstack([COLOURS * 32768 / 65535, np.tile([0.8, 0.5, 0.9], (len(COLOURS), 1))])
    real = link([profile], samples="real")(with_normals(COLOURS))
    assert link([profile])(device) == pytest.approx(real, abs=2e-6)


def test_mid_in_iccdev(tmp_path):
    """The reference reads beyond a table whose input exceeds 1: the program must not let that happen."""
    profile, _ = table_mid()
    n = 10
    names = profile["mcta"].texts()
    out = Profile(
        Header(device_class="mlnk", colour_space=f"nc{n:04x}", mcs=f"mc{n:04x}"),
        {
            "desc": Mluc.of("d"),
            "cprt": Mluc.of("c"),
            "mcta": TagArray.of_texts(names),
            "M2A0": MultiProcess.of(Matrix.of(np.eye(n))),
        },
    )
    assert iccdev.validate_profile(profile.to_bytes()).status == iccdev.ValidationStatus.OK
    device = np.random.default_rng(1).uniform(0, 1, (2000, 6)).astype(np.float32)
    ours = link([profile, out])(device)
    assert reference(tmp_path, [profile, out], device) == pytest.approx(ours, abs=2e-6)


def test_mid_beyond_the_table():
    profile, _ = table_mid()
    white = np.array(PRIMARIES.white)
    colours = np.array([1.9 * white, [0, 0, 0], [-0.5, 0.1, 0.1], 1e30 * white])
    held = np.clip(colours, 0, HEADROOM * white)
    exact = interpolate(held, PRIMARIES)
    found = link([profile], samples="real")(with_normals(colours))[:, :7]
    assert found[:, 3:] == pytest.approx(exact[:, 3:], rel=1e-3)
    offset = found[0, :3] - colours[0]
    assert offset == pytest.approx((exact[0, :3] - held[0]), abs=1e-4)
    assert found[2, 0] == 0
    assert np.isfinite(found).all()


# Both --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("build", [build_table_profile, build_table_mid])
def test_same_bytes_every_time(build):
    first, second = (build(PRIMARIES, grid=17)[0] for _ in range(2))
    assert first.to_bytes() == second.to_bytes()
    assert Profile.from_bytes(first.to_bytes()) == first


@pytest.mark.parametrize("build", [build_table_profile, build_table_mid])
def test_what_cannot_be_built(build):
    with pytest.raises(UsageError, match="grid is 16, expected 9, 17, 33, 65"):
        build(PRIMARIES, grid=16)
    with pytest.raises(UsageError, match="did you mean 'smooth'"):
        build(PRIMARIES, method="smoth", grid=17)
    with pytest.raises(InputError, match="3 primaries, expected 4 to 16"):
        build(replace(PRIMARIES, primaries=PRIMARIES.primaries[:3]), grid=17)


def test_gloss_of_zero_has_a_logarithm():
    matt = replace(PRIMARIES.primaries[0], parameters=(*PRIMARIES.primaries[0].parameters[:3], 0, 0, 0, 0.3))
    primaries = replace(PRIMARIES, primaries=(matt, *PRIMARIES.primaries[1:]))
    for build in (build_table_profile, build_table_mid):
        for method in ("smooth", "published"):
            profile, error = build(primaries, method=method, grid=17)
            assert np.isfinite([s.maximum for tag in error.tags.values() for s in tag.values()]).all()
            assert iccdev.validate_profile(profile.to_bytes()).status == iccdev.ValidationStatus.OK
