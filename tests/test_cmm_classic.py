"""Profiles of versions 2 and 4 in a chain, extended ranges, intents and conditions for each profile."""

import warnings

import numpy as np
import pytest
import tifffile
from cmm_examples import WHITE, device_profile, matrix, mid, mvis, pixels, reference, scaled

import iccbrdf
from iccbrdf.cmm import INTENTS
from iccbrdf.errors import LinkError, ProfileError, UnsupportedError, UsageError
from iccbrdf.icc import (
    EXTENDED_RANGE,
    XYZ,
    Clut,
    Curve,
    FormulaSegment,
    Lut16,
    MultiProcess,
    ParametricCurve,
    SegmentedCurve,
    Utf8,
    ViewingConditions,
    write_profile,
)

SRGB = ParametricCurve(3, (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045))
RGB_TO_XYZ = np.array([[0.4361, 0.3851, 0.1431], [0.2225, 0.7169, 0.0606], [0.0139, 0.0971, 0.7141]])
RNG = np.random.default_rng(7)


def old(profile, major, space="RGB "):
    header = profile.header
    return profile.replace(
        header=type(header)(
            device_class=header.device_class, colour_space=space, pcs=header.pcs, version=(major, 0, 0)
        )
    )


def display(*curves, major=4, **tags):
    """A profile of colorants and curves, one or three."""
    columns = {f"{c}XYZ": XYZ.of(*column) for c, column in zip("rgb", RGB_TO_XYZ.T, strict=True)}
    trc = {f"{c}TRC": curve for c, curve in zip("rgb", curves * (3 // len(curves)), strict=True)}
    return old(device_profile("mntr", **{**columns, **trc, **tags}), major)


def grey(curve, pcs="XYZ "):
    return old(device_profile("mntr", space="GRAY", pcs=pcs, kTRC=curve), 4, "GRAY")


def source(*, pcs="XYZ "):
    """Version 5; its device values are XYZ, or L*/100 and so on."""
    lab = matrix(np.diag([100, 200, 200]), [0, -100, -100])
    return mvis("abc", pcs=pcs, M2B1=scaled(1) if pcs == "XYZ " else lab)


CURVES = {
    "gamma": (Curve((563,)),),
    "identity": (Curve(),),
    "parametric": (
        SRGB,
        ParametricCurve(1, (2.0, 1.25, -0.25)),
        ParametricCurve(4, (2.0, 0.65, 0.25, 0.5, 0.3, 0.1, 0.05)),
    ),
    "samples": (Curve((0, 9000, 30000, 65535)), Curve((0, 2000, 65535)), Curve((0, 40000, 65535))),
}


@pytest.mark.parametrize("name", CURVES)
def test_colorants_and_curves(name, tmp_path):
    profile = display(*CURVES[name])
    found = iccbrdf.link([profile])(pixels(3))
    np.testing.assert_allclose(
        found, reference(tmp_path, [profile], pixels(3), pcs="XYZ "), rtol=1e-4, atol=1e-5
    )
    chain = [mid("abc"), source(), profile]
    XYZ_of = iccbrdf.link([profile], dtype="float64")(pixels(3, low=0.3))
    np.testing.assert_allclose(iccbrdf.link(chain, dtype="float64")(XYZ_of), pixels(3, low=0.3), atol=2e-5)
    # The reference inverts by a table of 2048 entries.
    np.testing.assert_allclose(iccbrdf.link(chain)(XYZ_of), reference(tmp_path, chain, XYZ_of), atol=2e-3)


def test_beyond_the_display_colours_are_clipped():
    chain = [mid("abc"), source(), display(SRGB)]
    assert iccbrdf.link(chain)([[2, 2, 2], [-1, -1, -1]]).tolist() == [[1, 1, 1], [0, 0, 0]]


def test_a_falling_and_a_flat_curve():
    falling = display(Curve((65535, 40000, 0)), Curve((0, 0, 65535)), Curve((0, 65535, 65535)))
    there = iccbrdf.link([falling])([[0.25, 0.75, 0.25]])
    np.testing.assert_allclose(
        iccbrdf.link([mid("abc"), source(), falling])(there), [[0.25, 0.75, 0.25]], atol=1e-4
    )
    for curve in (Curve((7, 7, 7)), Curve((0,)), ParametricCurve(3, (32767, 2**-16, 0, 1, 0.5))):
        with pytest.raises(ProfileError, match="inverse"):
            iccbrdf.link([mid("abc"), source(), display(curve)])


@pytest.mark.parametrize("pcs", ["XYZ ", "Lab "])
def test_grey(pcs, tmp_path):
    values = np.linspace(0, 1, 9, dtype=np.float32)[:, None]
    found = iccbrdf.link([grey(Curve((512,)), pcs)])(values)
    expected = values**2 * (WHITE if pcs == "XYZ " else (100, 0, 0))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)
    back = iccbrdf.link([mid("abc"), source(pcs=pcs), grey(Curve((512,)), pcs)])
    device = found if pcs == "XYZ " else (found + np.array([0, 100, 100])) / (100, 200, 200)
    np.testing.assert_allclose(back(device), values, atol=1e-5)


def lut(pcs="Lab ", **tags):
    table = RNG.uniform(0.1, 0.9, (3, 3, 3, 3))
    ramp = np.linspace([0, 0, 0], [1, 1, 1], 5).T
    return old(device_profile("mntr", pcs=pcs, **(tags or {
        "A2B0": Lut16(ramp, table, ramp), "B2A0": Lut16(ramp, table, ramp),
    })), 2)  # fmt: skip


@pytest.mark.parametrize("intent", range(4))
@pytest.mark.parametrize("make", [lut, lambda: display(SRGB, major=2, wtpt=XYZ.of(0.95, 1, 1.09))])
def test_intents_of_version_2(make, intent, tmp_path):
    """Black is that of version 4 under the perceptual intent; absolute goes by way of the media white."""
    profile = make().replace(tags={"wtpt": XYZ.of(0.8, 0.9, 0.7)})
    for chain in ([profile, device_profile(B2A0=scaled(1))], [mid("abc"), source(), lut()]):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = iccbrdf.link(chain, intent=INTENTS[intent])(pixels(3))
        theirs = reference(tmp_path, chain, pixels(3), intent=intent)
        np.testing.assert_allclose(found, theirs, rtol=1e-4, atol=1e-4)


def test_what_is_missing_of_colorants_and_curves():
    whole = display(SRGB)
    for tags, message in (
        ({"gTRC": Utf8("?")}, "tag gTRC: found type 'utf8', expected 'curv', 'para', 'curf'"),
        ({"bXYZ": XYZ(())}, "tag bXYZ: found 0 XYZ numbers"),
        ({"gXYZ": XYZ.of(*RGB_TO_XYZ[:, 0])}, "depend on one another"),
    ):
        with pytest.raises(ProfileError, match=message):
            iccbrdf.link([mid("abc"), source(), whole.replace(tags=tags)])
    with pytest.raises(ProfileError, match="tag rXYZ: found none"):
        iccbrdf.link([whole.replace(remove=["rXYZ"])])
    with pytest.raises(ProfileError, match="found connection space Lab of 3 channels, expected XYZ"):
        iccbrdf.link([old(device_profile("mntr", pcs="Lab ", rTRC=SRGB, gTRC=SRGB, bTRC=SRGB), 4)])
    with pytest.raises(ProfileError, match="found device space CMYK of 4 channels, expected one of 3"):
        iccbrdf.link([old(whole, 4, "CMYK")])
    segmented = SegmentedCurve((), (FormulaSegment(0, (2, 1, 0, 0)),))
    with pytest.raises(UnsupportedError, match="inverse of a segmented curve"):
        iccbrdf.link([mid("abc"), source(), display(segmented)])


# Each profile its own ------------------------------------------------------------------------------------


def test_an_intent_for_each_profile():
    white = XYZ.of(0.5, 0.5, 0.25)
    first = device_profile("scnr", A2B1=scaled(1)).replace(tags={"wtpt": white})
    last = device_profile("prtr", B2A1=scaled(1)).replace(tags={"wtpt": white})
    gain = np.array([0.5, 0.5, 0.25]) / WHITE
    for intents, expected in (
        (("absolute", "relative"), gain),
        (("relative", "absolute"), 1 / gain),
        (("relative", "relative"), 1),
    ):
        found = iccbrdf.link([first, last], intent=intents)([1, 1, 1])
        np.testing.assert_allclose(found, expected * np.ones(3), rtol=1e-5)
    with pytest.raises(UsageError, match="intent: found 1, expected one, or 2"):
        iccbrdf.link([first, last], intent=["absolute"])
    with pytest.raises(UsageError, match="intent 'asolute' is unknown: did you mean 'absolute'"):
        iccbrdf.link([first, last], intent=["relative", "asolute"])


def test_the_conditions_of_another_profile():
    """They bring their white, and their way to D50."""
    white = (1.1, 1.0, 0.35)
    svcn = ViewingConditions(2, 6, white, white)
    other = device_profile("spac", illuminant=white, svcn=svcn, c2sp=scaled(0.5), A2B1=scaled(1))
    chain = [device_profile("scnr", A2B1=scaled(1)), device_profile("prtr", B2A1=scaled(1))]
    assert iccbrdf.link(chain, conditions={0: other})([1, 1, 1]).tolist() == [0.5, 0.5, 0.5]
    with pytest.raises(LinkError, match=r"spac\.icc: tag s2cp is missing"):
        iccbrdf.link(chain, conditions={1: other})
    with pytest.raises(UsageError, match="conditions: found position 2, expected 0 to 1"):
        iccbrdf.link(chain, conditions={2: other})


def test_apply_takes_both(run, tmp_path):
    white = XYZ.of(0.5, 0.5, 0.25)
    first = device_profile("scnr", A2B1=scaled(1)).replace(tags={"wtpt": white})
    last = device_profile("prtr", B2A1=scaled(1)).replace(tags={"wtpt": white})
    svcn = ViewingConditions(2, 6, (1.1, 1.0, 0.35), (1.1, 1.0, 0.35))
    other = device_profile("spac", illuminant=(1.1, 1.0, 0.35), svcn=svcn, c2sp=scaled(0.5), A2B1=scaled(1))
    paths = [tmp_path / f"{name}.icc" for name in ("first", "last", "other")]
    for path, profile in zip(paths, (first, last, other), strict=True):
        write_profile(profile, path)
    image = tmp_path / "image.tif"
    tifffile.imwrite(image, np.ones((1, 1, 3), np.float32), photometric="minisblack", planarconfig="contig")

    def applied(*options):
        command = ("apply", image, "-p", paths[0], "-p", paths[1], "-o", tmp_path / "out.tif", "--force")
        return run(*command, "--samples", "device", *options)

    for options, intents, conditions in (
        (("--intent", "absolute,relative"), ["absolute", "relative"], {}),
        (("--conditions", f"1={paths[2]}"), "relative", {0: other}),
    ):
        result = applied(*options)
        assert (result.code, result.err) == (0, "")
        found = tifffile.imread(tmp_path / "out.tif").reshape(-1)
        assert not np.allclose(found, 1)
        expected = iccbrdf.link([first, last], intent=intents, conditions=conditions)([1, 1, 1])
        np.testing.assert_array_equal(found, expected)
    for options, message in (
        (("--intent", "absolute,relativ"), "did you mean 'relative'"),
        (("--conditions", "0=other.icc"), "--conditions '0=other.icc': expected PLACE=PROFILE"),
    ):
        result = applied(*options)
        assert (result.code, message in result.err) == (2, True), result.err


def extended(profile):
    return profile.replace(header=type(profile.header)(**{**vars(profile.header), "flags": EXTENDED_RANGE}))


def test_colours_of_an_extended_range(tmp_path):
    """Brought to the usual one before a profile that does not take more."""
    first = extended(device_profile("scnr", A2B1=scaled(4), H2S1=matrix(np.eye(3) * 0.25, [0.1] * 3)))
    last = device_profile("prtr", B2A1=scaled(1))
    for chain, expected in (([first, last], pixels(3) + 0.1), ([first, extended(last)], pixels(3) * 4)):
        found = iccbrdf.link(chain)(pixels(3))
        np.testing.assert_allclose(found, expected, rtol=1e-5)
        np.testing.assert_allclose(found, reference(tmp_path, chain, pixels(3)), rtol=1e-5)
    assert iccbrdf.link([first])([1, 1, 1]).tolist() == [4, 4, 4]
    with pytest.raises(ProfileError, match="tag H2S1 has 4 channels out, expected 3"):
        iccbrdf.link([first.replace(tags={"H2S1": matrix(np.ones((4, 3)))}), last])


def test_a_table_of_channels_that_take_their_defaults():
    """Known before it runs, in every back end."""
    table = MultiProcess.of(Clut(RNG.uniform(0, 1, (2, 2, 3))))
    defaults = iccbrdf.icc.NumberArray("fl32", [0.25, 0.5])
    chain = [mid("c"), mvis("ab", defaults=defaults, M2B0=table)]
    found = [iccbrdf.link(chain, backend=b)([[0.5]]) for b in ("interpreter", "numpy", "llvm")]
    np.testing.assert_allclose(
        np.reshape(found, (3, 3)), [iccbrdf.link([chain[1]])([0.25, 0.5])] * 3, rtol=1e-6
    )
