"""Connection spaces, viewing conditions, rendering intents and the media white."""

import warnings

import colour
import numpy as np
import pytest
from cmm_examples import (
    TEXTS,
    WHITE,
    device_profile,
    matrix,
    mid,
    mvis,
    pixels,
    program,
    reference,
    scaled,
)

import iccbrdf
from iccbrdf.cmm import INTENTS, standard_XYZ
from iccbrdf.errors import LinkError, ProfileError, ProfileWarning
from iccbrdf.icc import D50, XYZ, Header, Mluc, Profile, ViewingConditions

D65_10 = (0.948118, 1.0, 1.073241)
TO_D50 = np.diag(WHITE / D65_10)
XY_D50 = colour.XYZ_to_xy(WHITE)


def close(found, expected, rtol=2e-5):
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=2e-6)


def svcn(observer=2, illuminant=2, white=D65_10, **more):
    """Conditions at 100 cd/m2; the spectra are made up: only the ids and the white count here."""
    luminance = tuple(100 * v for v in white)
    spectra = {
        "observer_range": (400, 700),
        "observer_table": np.ones((3, 4)),
        "illuminant_range": (400, 700),
        "spd": np.ones(4),
    }
    return ViewingConditions(observer, illuminant, luminance, luminance, **{**spectra, **more})


def custom_mvis(conditions=None, **tags):
    return mvis("abc", illuminant=D65_10, M2B0=scaled(1), svcn=conditions or svcn(), **tags)


def printer(**options):
    return device_profile("prtr", **{"A2B1": scaled(2), "B2A1": scaled(0.5), **options})


# Connection spaces ---------------------------------------------------------------------------------------


def test_lab_comes_out_as_lightness_a_and_b(tmp_path):
    chain = [mid("abc"), mvis("abc", pcs="Lab ", M2B0=matrix(np.diag([100, 50, 50]), [0, -25, -25]))]
    transform = iccbrdf.link(chain)
    assert transform.channels_out == ("L*", "a*", "b*")
    assert transform([0.5, 1, 0]).tolist() == [50, 25, -25]
    close(transform(pixels(3)), reference(tmp_path, chain, pixels(3), pcs="Lab "))


def test_xyz_to_a_lab_profile(tmp_path):
    to_lab = printer(pcs="Lab ", B2A1=matrix(np.diag([0.01, 0.004, 0.004])))
    chain = [mid("abc"), mvis("abc"), to_lab]
    found = iccbrdf.link(chain)(pixels(3))
    close(found, reference(tmp_path, chain, pixels(3)), rtol=1e-4)
    lab = colour.XYZ_to_Lab(pixels(3).astype(float), XY_D50)
    np.testing.assert_allclose(found * (100, 250, 250), lab, rtol=1e-5, atol=1e-4)


def test_lab_to_an_xyz_profile(tmp_path):
    lab = matrix(np.diag([100, 200, 200]), [0, -100, -100])
    chain = [mid("abc"), mvis("abc", pcs="Lab ", M2B0=lab), printer()]
    found = iccbrdf.link(chain, dtype="float64")(pixels(3))
    real = pixels(3) * (100.0, 200.0, 200.0) - (0, 100, 100)
    XYZ = colour.Lab_to_XYZ(real, XY_D50)
    assert 5 < (XYZ < 0).any(axis=1).sum() < 25
    close(found, np.maximum(XYZ, 0) / 2, rtol=1e-6)
    close(found, reference(tmp_path, chain, pixels(3)), rtol=1e-4)
    assert np.isnan(iccbrdf.link(chain)([np.nan, 0.5, 0.5])).all()


def test_dark_and_negative_xyz_in_lab():
    """Below (6/29)^3 the curve is a line, which goes on below 0."""
    chain = [mid("abc"), mvis("abc"), printer(pcs="Lab ", B2A1=scaled(1))]
    dark = np.array([[1e-3, 2e-3, 3e-3], [-0.1, 0.5, -0.01], [0, 0, 0]])
    found = iccbrdf.link(chain, dtype="float64")(dark)
    slope = 841 / 108

    def f(v):
        return np.where(v > 216 / 24389, np.cbrt(v), slope * v + 4 / 29)

    x, y, z = f(dark / WHITE).T
    np.testing.assert_allclose(
        found, np.column_stack([116 * y - 16, 500 * (x - y), 200 * (y - z)]), atol=1e-9
    )


def test_lab_to_lab_needs_no_xyz():
    """Impossible colours pass as they are."""
    chain = [mid("abc"), mvis("abc", pcs="Lab ", M2B0=scaled(1)), printer(pcs="Lab ", B2A1=scaled(2))]
    assert iccbrdf.link(chain)([-60, 900, -900]).tolist() == [-120, 1800, -1800]


def abstract(process, pcs="XYZ ", **tags):
    header = Header(device_class="abst", colour_space=pcs, pcs=pcs)
    return Profile(header, {**TEXTS, "wtpt": XYZ.of(*D50), "A2B0": process, **tags}, source="abst.icc")


def test_abstract_profiles():
    darker = abstract(scaled(0.5))
    assert iccbrdf.link([mid("abc"), mvis("abc"), darker])([1, 2, 4]).tolist() == [0.5, 1, 2]
    assert iccbrdf.link([darker, printer()])([1, 2, 4]).tolist() == [0.25, 0.5, 1]
    lighter = abstract(matrix(np.eye(3), [10, 0, 0]), "Lab ")
    found = iccbrdf.link([mid("abc"), mvis("abc"), lighter, printer()])(WHITE / 2)
    neutral = colour.Lab_to_XYZ([colour.XYZ_to_Lab(WHITE / 2, XY_D50)[0] + 10, 0, 0], XY_D50)
    close(found, neutral / 2)


def test_an_abstract_profile_at_either_end_keeps_absolute_colours_absolute():
    """A relative tag between absolute colours: divided by the media white, and multiplied by it again."""
    paper = abstract(scaled(1)).replace(
        tags={"A2B1": matrix(np.eye(3), [0.1, 0.1, 0.1]), "wtpt": XYZ.of(0.5, 0.5, 0.25)}
    )
    found = iccbrdf.link([paper], intent="absolute")([0.5, 0.5, 0.25])
    close(found, np.array([0.5, 0.5, 0.25]) + 0.1 * np.array([0.5, 0.5, 0.25]) / WHITE)


# Viewing conditions --------------------------------------------------------------------------------------


def test_white_of_other_conditions_becomes_d50_white(tmp_path):
    chain = [mid("abc"), custom_mvis(c2sp=matrix(TO_D50)), printer(B2A1=scaled(1))]
    transform = iccbrdf.link(chain)
    close(transform(D65_10), D50)
    close(iccbrdf.link(chain, intent="absolute")(D65_10), D50)
    close(transform(pixels(3)), reference(tmp_path, chain, pixels(3)))


def test_at_the_end_of_a_chain_xyz_stays_in_its_own_conditions(tmp_path):
    chain = [mid("abc"), custom_mvis()]
    close(iccbrdf.link(chain)(D65_10), D65_10)
    close(iccbrdf.link(chain)(pixels(3)), reference(tmp_path, chain, pixels(3), pcs="XYZ "))


def test_c2sp_may_be_a_program(tmp_path):
    gains = " ".join(f"{g:.9g}" for g in np.diag(TO_D50))
    chain = [mid("abc"), custom_mvis(c2sp=program(f"in(0,3) {gains} mul(3) out(0,3)", 3, 3)), printer()]
    close(iccbrdf.link(chain)(pixels(3)), pixels(3) @ TO_D50 / 2)
    close(iccbrdf.link(chain)(pixels(3)), reference(tmp_path, chain, pixels(3)))


def test_from_standard_to_other_conditions(tmp_path):
    inverse = matrix(np.linalg.inv(TO_D50))
    chain = [mid("abc"), mvis("abc"), printer(illuminant=D65_10, svcn=svcn(), s2cp=inverse)]
    close(iccbrdf.link(chain)(D50), np.array(D65_10) / 2)
    close(iccbrdf.link(chain)(pixels(3)), reference(tmp_path, chain, pixels(3)))


def test_lab_is_relative_to_the_white_of_its_own_conditions(tmp_path):
    to_lab = printer(
        pcs="Lab ",
        illuminant=D65_10,
        svcn=svcn(),
        s2cp=matrix(np.linalg.inv(TO_D50)),
        B2A1=scaled(0.01),
    )
    chain = [mid("abc"), mvis("abc"), to_lab]
    close(iccbrdf.link(chain)(WHITE), [1, 0, 0])
    close(iccbrdf.link(chain)(pixels(3)), reference(tmp_path, chain, pixels(3)), rtol=1e-4)


def test_between_two_conditions_by_way_of_the_standard_ones():
    other = svcn(observer=1, illuminant=6, white=(1.0985, 1, 0.3558))
    to_other = np.diag(np.array([1.0985, 1, 0.3558]) / WHITE)
    chain = [
        mid("abc"),
        custom_mvis(c2sp=matrix(TO_D50)),
        printer(illuminant=(1.0985, 1, 0.3558), svcn=other, s2cp=matrix(to_other)),
    ]
    close(iccbrdf.link(chain)(pixels(3)), pixels(3) @ TO_D50 @ to_other / 2)


def test_missing_conversions():
    with pytest.raises(LinkError, match=r"mvis\.icc: tag c2sp is missing"):
        iccbrdf.link([mid("abc"), custom_mvis(), printer()])
    with pytest.raises(LinkError, match=r"prtr\.icc: tag s2cp is missing"):
        iccbrdf.link([mid("abc"), mvis("abc"), printer(svcn=svcn())])


@pytest.mark.parametrize(
    "conditions",
    [
        svcn(),
        svcn(illuminant=10, cct=6000.0),
        svcn(observer=0, observer_table=np.arange(12).reshape(3, 4)),
        svcn(illuminant=0, spd=[1, 2, 3, 4]),
    ],
)
def test_equal_conditions_need_no_conversion(conditions):
    to_printer = printer(illuminant=D65_10, svcn=conditions)
    found = iccbrdf.link([mid("abc"), custom_mvis(conditions), to_printer])(pixels(3))
    close(found, pixels(3) / 2)


@pytest.mark.parametrize(
    ("here", "there"),
    [
        (svcn(), svcn(observer=1)),
        (svcn(), svcn(illuminant=5)),
        (svcn(illuminant=10, cct=6000.0), svcn(illuminant=10, cct=6001.0)),
        (svcn(observer=0), svcn(observer=0, observer_table=np.zeros((3, 4)))),
        (svcn(observer=0), svcn(observer=0, observer_range=(400, 701))),
        (svcn(illuminant=0), svcn(illuminant=0, spd=np.zeros(4))),
        (svcn(illuminant=0), svcn(illuminant=0, illuminant_range=(380, 700))),
    ],
)
def test_different_conditions_need_a_conversion(here, there):
    with pytest.raises(LinkError, match="tag c2sp is missing"):
        iccbrdf.link([mid("abc"), custom_mvis(here), printer(svcn=there)])


def test_stated_standard_conditions(tmp_path):
    stated = svcn(observer=1, illuminant=1, white=D50)
    chain = [mid("abc"), mvis("abc", M2B0=scaled(1), svcn=stated), printer()]
    close(iccbrdf.link(chain)(pixels(3)), pixels(3) / 2)
    close(iccbrdf.link(chain)(pixels(3)), reference(tmp_path, chain, pixels(3)))


def test_the_headers_illuminant_counts_where_a_conversion_goes_with_it(tmp_path):
    chain = [mid("abc"), mvis("abc", illuminant=D65_10), printer()]
    with pytest.warns(ProfileWarning, match=r"mvis\.icc: header: illuminant .* taken for those under D50"):
        transform = iccbrdf.link(chain)
    close(transform(pixels(3)), reference(tmp_path, chain, pixels(3)))
    chain[1] = mvis("abc", illuminant=D65_10, M2B0=scaled(1), c2sp=matrix(TO_D50))
    close(iccbrdf.link(chain)(D65_10), WHITE / 2)


@pytest.mark.parametrize("white", [(0, 1, 0), (0.9, 0, 0.8), (-1, 1, 1)])
def test_an_illuminant_without_light(white):
    with pytest.raises(ProfileError, match=r"mvis\.icc: header: illuminant: found XYZ .* above 0"):
        iccbrdf.link([mid("abc"), mvis("abc", illuminant=white), printer()])
    with pytest.raises(ProfileError, match=r"mvis\.icc: tag svcn: illuminant: found XYZ"):
        iccbrdf.link([mid("abc"), custom_mvis(svcn(white=white)), printer()])


@pytest.mark.parametrize("white", [(np.nan, 1, 1), (1, np.inf, 1)])
def test_an_illuminant_that_is_no_number(white):
    with pytest.raises(ProfileError, match="tag svcn: illuminant: found XYZ"):
        iccbrdf.link([mid("abc"), custom_mvis(svcn(white=white)), printer()])


def test_tags_of_the_wrong_type():
    text = Mluc.of("?")
    with pytest.raises(ProfileError, match="svcn: found type 'mluc'"):
        iccbrdf.link([mid("abc"), mvis("abc", M2B0=scaled(1), svcn=text), printer()])
    for wrong in (text, matrix(np.eye(4))):
        with pytest.raises(ProfileError, match="c2sp: expected processing elements from 3 to 3"):
            iccbrdf.link([mid("abc"), custom_mvis(c2sp=wrong), printer()])


def test_to_the_standard_conditions():
    white = standard_XYZ(custom_mvis(c2sp=matrix(TO_D50)))
    assert (white.channels_in, white.channels_out) == (("X", "Y", "Z"), ("X", "Y", "Z"))
    close(white(D65_10), D50)
    assert np.array_equal(standard_XYZ(mvis("abc"))(pixels(3)), pixels(3))
    lab = standard_XYZ(mvis("abc", pcs="Lab "), np.float64)
    assert lab.channels_in == ("L*", "a*", "b*")
    close(lab([60, 20, -30]), colour.Lab_to_XYZ([60, 20, -30], XY_D50), rtol=1e-9)
    close(standard_XYZ(custom_lab())([100, 0, 0]), D50)
    with pytest.raises(LinkError, match="tag c2sp is missing"):
        standard_XYZ(custom_mvis())
    with pytest.raises(ProfileError, match="connection space ''"):
        standard_XYZ(mid("abc"))


def custom_lab():
    return mvis("abc", pcs="Lab ", illuminant=D65_10, M2B0=scaled(1), svcn=svcn(), c2sp=matrix(TO_D50))


# Rendering intents ---------------------------------------------------------------------------------------

PAPER = np.array([0.8, 0.9, 0.7])


def on_paper(profile):
    return profile.replace(tags={"wtpt": XYZ.of(*PAPER)})


def constant(number):
    """A transform to be recognised by."""
    return matrix(np.zeros((3, 3)), [number] * 3)


ABSOLUTE, RELATIVE = PAPER / WHITE, WHITE / PAPER


@pytest.mark.parametrize(
    ("tags", "intent", "expected"),
    [
        ("0123", "perceptual", 0),
        ("0123", "relative", 1),
        ("0123", "saturation", 2),
        ("0123", "absolute", 3),
        ("013", "saturation", 0),
        ("1", "absolute", 1 * ABSOLUTE),
        ("01", "absolute", 1 * ABSOLUTE),
        ("3", "relative", 3 * RELATIVE),
        ("03", "relative", 3 * RELATIVE),
        ("0", "relative", 0),
        ("0", "absolute", 0),
        ("02", "absolute", 0),
    ],
)
def test_the_tag_of_an_intent(tags, intent, expected):
    """Relative and absolute stand for each other by way of the media white, then ...0 stands in."""
    profile = on_paper(mvis("abc", **{f"M2B{n}": constant(int(n)) for n in tags}))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        transform = iccbrdf.link([mid("abc"), profile], intent=intent)
    close(transform([0, 0, 0]), np.broadcast_to(expected, 3))


@pytest.mark.parametrize(
    ("tags", "intent", "tag", "expected"),
    [
        ("13", "perceptual", "M2B1", 1),
        ("3", "perceptual", "M2B3", 3 * RELATIVE),
        ("2", "relative", "M2B2", 2),
        ("2", "absolute", "M2B2", 2),
        ("13", "saturation", "M2B1", 1),
    ],
)
def test_a_tag_that_the_specification_does_not_let_stand_in(tags, intent, tag, expected):
    profile = on_paper(mvis("abc", **{f"M2B{n}": constant(int(n)) for n in tags}))
    with pytest.warns(ProfileWarning, match=f"no tag for the {intent} intent; {tag} stands in") as caught:
        transform = iccbrdf.link([mid("abc"), profile], intent=intent)
    assert caught[0].filename == __file__
    close(transform([0, 0, 0]), np.broadcast_to(expected, 3))


@pytest.mark.parametrize("intent", INTENTS)
def test_the_tag_of_an_intent_on_the_way_to_a_device(tmp_path, intent):
    tags = {f"B2A{n}": scaled(0.1 * (n + 1)) for n in range(4)}
    chain = [mid("abc"), mvis("abc"), printer(**tags)]
    found = iccbrdf.link(chain, intent=intent)(pixels(3))
    close(found, pixels(3) * 0.1 * (INTENTS.index(intent) + 1))
    close(found, reference(tmp_path, chain, pixels(3), intent=INTENTS.index(intent)))


def test_the_media_white_of_the_destination(tmp_path):
    chain = [mid("abc"), mvis("abc", M2B1=scaled(1)), on_paper(printer())]
    close(iccbrdf.link(chain)(PAPER), PAPER / 2)
    absolute = iccbrdf.link(chain, intent="absolute")
    close(absolute(PAPER), WHITE / 2)
    close(absolute(pixels(3)), reference(tmp_path, chain, pixels(3), intent=3))


def test_the_media_whites_of_both():
    """Equal papers: absolute is what relative is."""
    chain = [mid("abc"), on_paper(mvis("abc", M2B1=scaled(1))), on_paper(printer())]
    close(iccbrdf.link(chain, intent="absolute")(pixels(3)), iccbrdf.link(chain)(pixels(3)))


def test_lab_is_scaled_by_way_of_xyz():
    profile = on_paper(mvis("abc", pcs="Lab ", M2B1=scaled(100)))
    found = iccbrdf.link([mid("abc"), profile], intent="absolute")([1, 0, 0])
    np.testing.assert_allclose(found, colour.XYZ_to_Lab(PAPER, XY_D50), atol=2e-3)


def test_the_media_white_is_that_of_the_conditions():
    """Under other conditions the perfect diffuser is their illuminant: nothing to scale."""
    profile = mvis("abc", illuminant=D65_10, M2B1=scaled(1), svcn=svcn())
    close(iccbrdf.link([mid("abc"), profile], intent="absolute")([0.25, 0.5, 1]), [0.25, 0.5, 1])


@pytest.mark.parametrize("white", [XYZ(()), XYZ.of(0, 1, 1), Mluc.of("white")])
def test_a_malformed_media_white(white):
    profile = mvis("abc", M2B1=scaled(1)).replace(tags={"wtpt": white})
    with pytest.raises(ProfileError, match="tag wtpt: expected one XYZ number above 0"):
        iccbrdf.link([mid("abc"), profile], intent="absolute")


def test_direct_tags_go_first_for_their_own_intent():
    both = printer(B2D1=scaled(3), B2A0=scaled(5), B2A1=scaled(7), B2D0=scaled(9))
    found = iccbrdf.link([mid("abc"), mvis("abc"), both])([1, 1, 1])
    assert found.tolist() == [3, 3, 3]
    other = printer(B2D0=scaled(9), B2A1=scaled(7))
    assert iccbrdf.link([mid("abc"), mvis("abc"), other])([1, 1, 1]).tolist() == [7, 7, 7]


def test_direct_tags_of_a_spectral_profile_are_not_colorimetric():
    header = Header(device_class="prtr", colour_space="RGB ", pcs="XYZ ", spectral_pcs="rs0003")
    spectral = printer(B2D1=scaled(9)).replace(header=header)
    assert iccbrdf.link([mid("abc"), mvis("abc"), spectral])([1, 1, 1]).tolist() == [0.5, 0.5, 0.5]
