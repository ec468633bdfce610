"""Spectral elements and spectral connection spaces under a profile's viewing conditions."""

from dataclasses import replace

import colour
import numpy as np
import pytest
from cmm_examples import device_profile, matrix, mvis, program, reference, scaled

import iccbrdf
from iccbrdf.errors import LimitError, LinkError, ProfileError, UnsupportedError
from iccbrdf.icc import (
    EmissionClut,
    EmissionMatrix,
    EmissionObserver,
    Header,
    InverseEmissionMatrix,
    MultiProcess,
    Profile,
    ReflectanceClut,
    ReflectanceObserver,
    TagArray,
    ViewingConditions,
)

SHAPE = colour.SpectralShape(380, 780, 5)
CMFS = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(SHAPE)
CMFS_10 = colour.MSDS_CMFS["CIE 1964 10 Degree Standard Observer"].copy().align(SHAPE)
D65 = colour.SDS_ILLUMINANTS["D65"].copy().align(SHAPE)
AT = SHAPE.wavelengths
RANGE = (380.0, 780.0)
RNG = np.random.default_rng(8)
LIGHTS = np.stack([np.exp(-(((AT - peak) / 25) ** 2)) for peak in (450, 540, 620)]).astype(np.float32)
WHITE = LIGHTS.sum(axis=0)
REFLECTANCES = (0.5 + 0.4 * np.sin(AT / 60 + RNG.uniform(0, 6, (8, 1)))).astype(np.float32)


def svcn(cmfs=CMFS, illuminant=D65, observer=1, number=2):
    x, y, z = cmfs.values.T @ illuminant.values
    stated = (100 * x / y, 100.0, 100 * z / y)
    return ViewingConditions(observer, number, stated, stated, RANGE, cmfs.values.T, RANGE, illuminant.values)


def scanner(element, *, space=None, header=None, **tags):
    """A profile of class scnr whose A2B1 is one element; `svcn` unless the tags say otherwise."""
    names = {3: "RGB ", 1: "GRAY"}
    fields = {"device_class": "scnr", "colour_space": names.get(element.inputs, f"nc{element.inputs:04x}")}
    fields |= {"pcs": "Lab " if getattr(element, "lab", False) else "XYZ "}
    return Profile(
        Header(**fields | (header or {})),
        {"svcn": svcn(), "A2B1": MultiProcess.of(element), **tags},
        source="scnr.icc",
    )


def spectral(space="rs0051", limits=RANGE, tag="D2B1", process=None, device_class="scnr", **tags):
    """A profile that takes the samples of spectra as device channels to a spectral connection space."""
    count = int(space[2:], 16)
    header = Header(
        device_class=device_class,
        colour_space=f"nc{count:04x}",
        spectral_pcs=space,
        spectral_range=limits,
        spectral_steps=count,
    )
    transform = process or matrix(np.eye(count))
    return Profile(header, {"svcn": svcn(), tag: transform, **tags}, source="spectral.icc")


def run(profiles, pixels, **options):
    return iccbrdf.link(profiles, dtype=np.float64, **options)(pixels)


def integrated(spectra, cmfs=CMFS, white=WHITE):
    """XYZ of light, with Y = 1 for the white."""
    return spectra @ cmfs.values / (white @ cmfs.values[:, 1])


PIXELS = RNG.uniform(0, 1, (20, 3)).astype(np.float32)


def test_lights_add_up(tmp_path):
    offset = np.full(len(AT), 0.01, np.float32)
    profile = scanner(EmissionMatrix(RANGE, WHITE, LIGHTS, offset))
    found = run([profile], PIXELS)
    np.testing.assert_allclose(found, integrated(PIXELS @ LIGHTS + offset), rtol=1e-5)
    np.testing.assert_allclose(
        found, reference(tmp_path, [profile], PIXELS, pcs="XYZ "), rtol=1e-4, atol=1e-5
    )


def test_lights_for_a_colour(tmp_path):
    offset = np.full(len(AT), 0.01, np.float32)
    emission = EmissionMatrix(RANGE, WHITE, LIGHTS, offset)
    display = scanner(emission, B2A1=MultiProcess.of(InverseEmissionMatrix(RANGE, WHITE, LIGHTS, offset)))
    found = run([display, display], PIXELS)
    np.testing.assert_allclose(found, PIXELS, atol=1e-5)
    np.testing.assert_allclose(found, reference(tmp_path, [display, display], PIXELS), atol=1e-4)


def test_spectra_at_other_wavelengths_than_the_observer():
    """Colour-matching functions are interpolated linearly, which is exact where they are."""
    at = np.linspace(400, 700, 31)
    lights = LIGHTS[:, [int(np.flatnonzero(w == AT)[0]) for w in at]]
    white = lights.sum(axis=0)
    found = run([scanner(EmissionMatrix((400, 700), white, lights, 0 * white))], PIXELS)
    cmfs = np.stack([np.interp(at, AT, column) for column in CMFS.values.T])
    np.testing.assert_allclose(found, PIXELS @ lights @ cmfs.T / (white @ cmfs[1]), rtol=1e-5)


@pytest.mark.parametrize("lab", [False, True])
def test_table_of_lights(lab, tmp_path):
    table = RNG.uniform(0, 1, (3, 2, len(AT))).astype(np.float32)
    profile = scanner(EmissionClut(RANGE, WHITE, table, flags=2 * lab))
    nodes = np.array([[0, 0], [0, 1], [0.5, 0], [0.5, 1], [1, 0], [1, 1]], np.float32)
    expected = integrated(table.reshape(6, -1))
    if lab:
        white = integrated(WHITE)
        expected = colour.XYZ_to_Lab(expected, colour.XYZ_to_xy(white))
    found = run([profile], nodes)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)
    if not lab:
        theirs = reference(tmp_path, [profile], nodes, pcs="XYZ ")
        np.testing.assert_allclose(found, theirs, rtol=1e-4, atol=1e-5)


def perfect(reflectances, illuminant=D65, cmfs=CMFS):
    """As CIE 15 says, by colour-science; Y = 1 for the perfect diffuser."""
    return (
        np.stack(
            [
                colour.sd_to_XYZ(
                    colour.SpectralDistribution(r, AT), cmfs, illuminant, method="Integration", shape=SHAPE
                )
                for r in reflectances.astype(np.float64)
            ]
        )
        / 100
    )


@pytest.mark.parametrize("absolute", [False, True])
@pytest.mark.parametrize("lab", [False, True])
def test_observer_of_reflectances(absolute, lab):
    medium = np.full(len(AT), 0.9, np.float32) * np.linspace(1, 0.8, len(AT), dtype=np.float32)
    profile = scanner(ReflectanceObserver(RANGE, medium, absolute + 2 * lab))
    light = perfect(np.ones((1, len(AT))))[0]
    expected = perfect(REFLECTANCES)
    if not absolute:
        expected = expected * light / perfect(medium[None])[0]
    if lab:
        expected = colour.XYZ_to_Lab(expected, colour.XYZ_to_xy(light))
    np.testing.assert_allclose(run([profile], REFLECTANCES), expected, rtol=1e-4, atol=2e-4)


def test_table_of_reflectances():
    table = REFLECTANCES[:4].reshape(2, 2, -1)
    found = run(
        [scanner(ReflectanceClut(RANGE, np.ones(len(AT)), table))], [[0, 0], [0, 1], [1, 0], [0.5, 1]]
    )
    expected = perfect(REFLECTANCES[:4])
    expected[3] = (expected[1] + expected[3]) / 2
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_observer_of_lights():
    profile = scanner(EmissionObserver(RANGE, WHITE))
    np.testing.assert_allclose(run([profile], LIGHTS), integrated(LIGHTS), rtol=1e-5)


MEDIUM = 0.9 * np.linspace(1, 0.8, len(AT))
NODES = np.array([[0, 0], [0, 1], [1, 0], [0.5, 1]], np.float32)


@pytest.mark.parametrize("lab", [0, 2])
@pytest.mark.parametrize(
    ("make", "pixels"),
    [
        (lambda lab: ReflectanceObserver(RANGE, MEDIUM, lab), REFLECTANCES),
        (lambda lab: ReflectanceClut(RANGE, MEDIUM, REFLECTANCES[:4].reshape(2, 2, -1), flags=lab), NODES),
        (lambda lab: EmissionObserver(RANGE, WHITE, lab), LIGHTS),
        (lambda lab: EmissionClut(RANGE, WHITE, REFLECTANCES[:4].reshape(2, 2, -1), 1, lab), NODES),
    ],
    ids=["robs", "rclt", "eobs", "eclt"],
)
def test_the_reference_sees_the_same(make, pixels, lab, tmp_path):
    profile = scanner(make(lab))
    theirs = reference(tmp_path, [profile], pixels, pcs="Lab " if lab else "XYZ ")
    np.testing.assert_allclose(run([profile], pixels), theirs, rtol=1e-5, atol=2e-4 if lab else 1e-5)


def test_spectral_elements_within_calculators():
    element = EmissionMatrix(RANGE, WHITE, LIGHTS, 0 * WHITE)
    calculator = program("in(0,3) 2 smul(3) elem(0) out(0,3)", 3, 3, (element,)).elements[0]
    found = run([scanner(calculator)], PIXELS)
    np.testing.assert_allclose(found, integrated(2 * PIXELS @ LIGHTS), rtol=1e-5)


def test_tables_of_standard_observers_and_illuminants_may_be_left_out():
    empty = np.zeros((3, 0))
    stated = ViewingConditions(1, 2, (95, 100, 109), (95, 100, 109), observer_table=empty)
    profile = scanner(ReflectanceObserver(RANGE, np.ones(len(AT)), 1), svcn=stated)
    np.testing.assert_allclose(run([profile], REFLECTANCES), perfect(REFLECTANCES), rtol=1e-5)
    for changed, message in (
        ({"observer": 9}, "observer 9: found no colour-matching functions"),
        ({"illuminant": 3}, "illuminant 3: found no spectral power"),
    ):
        broken = profile.replace(tags={"svcn": replace(stated, **changed)})
        with pytest.raises(ProfileError, match=message):
            iccbrdf.link([broken])


@pytest.mark.parametrize(
    ("element", "tags", "error", "message"),
    [
        (EmissionObserver(RANGE, WHITE), {"svcn": TagArray("utf8", ())}, ProfileError, "found type 'tary'"),
        (EmissionObserver(RANGE, 0 * WHITE), {}, ProfileError, "element 0 .eobs.: spectra: found a white of"),
        (ReflectanceObserver(RANGE, 0 * WHITE), {}, ProfileError, "white: found XYZ"),
    ],
)
def test_spectra_that_cannot_be_seen(element, tags, error, message):
    with pytest.raises(error, match=message):
        iccbrdf.link([scanner(element, **tags)])


def test_viewing_conditions_are_needed():
    profile = scanner(EmissionObserver(RANGE, WHITE))
    with pytest.raises(LinkError, match="tag svcn is missing"):
        iccbrdf.link([profile.replace(remove=["svcn"])])


@pytest.mark.parametrize(
    ("lights", "error", "message"),
    [
        (LIGHTS[:2], UnsupportedError, "of 2 channels, which has none: expected 3"),
        (np.repeat(LIGHTS[:1], 3, axis=0), ProfileError, "expected a matrix with an inverse"),
    ],
)
def test_lights_without_an_inverse(lights, error, message):
    element = InverseEmissionMatrix(RANGE, WHITE, lights, 0 * WHITE)
    space = "RGB " if len(lights) == 3 else "nc0002"
    printer = device_profile(
        space=space, svcn=svcn(), B2A1=MultiProcess.of(element), A2B1=matrix(np.ones((3, len(lights))))
    )
    with pytest.raises(error, match=message):
        iccbrdf.link([scanner(EmissionMatrix(RANGE, WHITE, LIGHTS, 0 * WHITE)), printer])


# Spectral connection spaces ----------------------------------------------------------------------------


def test_spectra_come_out(tmp_path):
    profile = spectral()
    transform = iccbrdf.link([profile])
    assert transform.channels_out[:2] == ("380 nm", "385 nm")
    assert transform.samples_out == "real"
    np.testing.assert_array_equal(transform(REFLECTANCES), REFLECTANCES)
    np.testing.assert_allclose(transform(REFLECTANCES), reference(tmp_path, [profile], REFLECTANCES))


def test_multiplex_channels_to_spectra():
    header = replace(mvis("ab").header, spectral_pcs="rs0003", spectral_range=(400, 700), spectral_steps=3)
    profile = mvis("ab", M2S1=matrix(np.ones((3, 2))), M2B1=matrix(np.eye(3, 2))).replace(header=header)
    assert iccbrdf.link([profile])([1, 2]).tolist() == [3, 3, 3]
    assert iccbrdf.link([profile], spectral=False)([1, 2]).tolist() == [1, 2, 0]
    only = profile.replace(remove=["M2B1"], header=replace(header, pcs=""))
    assert iccbrdf.link([only], spectral=False).channels_out == ("400 nm", "550 nm", "700 nm")


def to_device(pcs="XYZ ", **tags):
    return device_profile(pcs=pcs, B2A1=scaled(1), A2B1=scaled(1), illuminant=(0.9642, 1.0, 0.8249), **tags)


def test_reflectance_to_a_device(tmp_path):
    """Under D65 at first; c2sp takes XYZ to D50."""
    profile = spectral(c2sp=scaled(0.5))
    found = run([profile, to_device()], REFLECTANCES)
    np.testing.assert_allclose(found, perfect(REFLECTANCES) / 2, rtol=1e-5)
    theirs = reference(tmp_path, [profile, to_device()], REFLECTANCES)
    np.testing.assert_allclose(found, theirs, rtol=1e-4, atol=1e-5)


def test_light_to_a_device():
    profile = spectral("es0051", c2sp=scaled(1))
    found = run([profile, to_device()], LIGHTS)
    np.testing.assert_allclose(found, integrated(LIGHTS, white=D65.values), rtol=1e-5)


def test_other_wavelengths(tmp_path):
    """Of reflectance: interpolated, and held at the ends."""
    coarse = np.linspace(400, 800, 9)
    after = spectral("rs0009", (400, 800), tag="B2D1", device_class="prtr", D2B1=matrix(np.eye(9)))
    found = run([spectral(), after], REFLECTANCES)
    np.testing.assert_allclose(found, [np.interp(coarse, AT, r) for r in REFLECTANCES], rtol=1e-6)
    theirs = reference(tmp_path, [spectral(), after], REFLECTANCES)
    np.testing.assert_allclose(found, theirs, rtol=1e-4, atol=1e-5)


def test_an_abstract_profile_of_spectra():
    change = spectral(device_class="abst", process=matrix(np.eye(81) * 0.5))
    np.testing.assert_allclose(run([spectral(), change], REFLECTANCES), REFLECTANCES / 2)


def test_reflectance_becomes_light():
    lamp = spectral("es0051", tag="B2D1", device_class="mntr")
    found = run([spectral(), lamp], REFLECTANCES)
    np.testing.assert_allclose(found, REFLECTANCES * D65.values, rtol=1e-6)


def test_spectra_that_do_not_link():
    prints = spectral(tag="B2D1", device_class="prtr")
    with pytest.raises(LinkError, match=r"spectral connection space es0051 .* takes spectral connection"):
        iccbrdf.link([spectral("es0051"), prints])
    with pytest.raises(LinkError, match="links with none: expected spectra of reflection"):
        iccbrdf.link([spectral("sm0051"), to_device()])
    colours = scanner(EmissionMatrix(RANGE, WHITE, LIGHTS, 0 * WHITE))
    with pytest.raises(LinkError, match=r"ends on connection space XYZ .* starts from spectral"):
        iccbrdf.link([colours, prints])


def test_wavelengths_must_be_stated():
    unstated = spectral()
    unstated = unstated.replace(header=replace(unstated.header, spectral_range=(0, 0)))
    with pytest.raises(ProfileError, match="header: spectra: found 81 wavelengths from 0 to 0 nm"):
        iccbrdf.link([unstated, to_device()])
    assert iccbrdf.link([unstated]).channels_out[0] == "0 nm"


def test_too_many_factors(monkeypatch):
    monkeypatch.setattr("iccbrdf.cmm.spectral.MAX_FACTORS", 81 * 9 - 1)
    after = spectral("rs0009", (400, 800), tag="B2D1", device_class="prtr")
    with pytest.raises(LimitError, match="81 wavelengths to 9: more than 728 factors"):
        iccbrdf.link([spectral(), after])


def test_spectral_elements_after_spectra_are_bound_late(tmp_path):
    """The display's lights are seen by the first profile's observer, and nothing is converted."""
    ten = svcn(CMFS_10, observer=2)
    first = spectral("es0051", svcn=ten)
    inverse = InverseEmissionMatrix(RANGE, WHITE, LIGHTS, 0 * WHITE)
    display = device_profile("mntr", svcn=svcn(), B2A1=MultiProcess.of(inverse))
    found = run([first, display], WHITE[None] * D65.values.mean())
    white = D65.values.mean() * integrated(WHITE, CMFS_10, D65.values)
    expected = np.linalg.solve(integrated(LIGHTS, CMFS_10).T, white)
    np.testing.assert_allclose(found[0], expected, rtol=1e-5)
    assert found[0] == pytest.approx([expected.mean()] * 3)
