"""Look-up-table tags in version 5 profiles, and the interpolation of tables."""

import pickle

import numpy as np
import pytest
from cmm_examples import device_profile, program, reference

import iccbrdf
from iccbrdf.errors import ProfileError, UnsupportedError, UsageError
from iccbrdf.icc import (
    Clut,
    Curve,
    ExtendedClut,
    Lut8,
    Lut16,
    LutAToB,
    LutBToA,
    MultiProcess,
    ParametricCurve,
    PlainText,
)

RNG = np.random.default_rng(4)
PIXELS = RNG.uniform(0, 1, (60, 3)).astype(np.float32)
LINE = Curve()
SAMPLED = Curve((0, 9000, 30000, 65535))
GAMMA = Curve((round(2.2 * 256),))
# Both parts of each are met, and none leaves 0..1, to which the reference does not clip.
PARAMETRIC = (
    ParametricCurve(0, (1.8,)),
    ParametricCurve(1, (2.0, 1.25, -0.25)),
    ParametricCurve(2, (2.0, 1.0, -0.25, 0.125)),
    ParametricCurve(3, (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)),
    ParametricCurve(4, (2.0, 0.65, 0.25, 0.5, 0.3, 0.1, 0.05)),
)
TURN = (0.5, 0.3, 0.2, 0.1, 0.8, 0.1, 0.0, 0.2, 0.7, 0.02, 0.01, 0.05)
TABLE = ExtendedClut(RNG.uniform(0, 1, (3, 4, 2, 3)), 2)

RAMP = np.linspace(0, 1, 256)

FORWARD = {
    "curves": LutAToB((SAMPLED, GAMMA, LINE)),
    "matrix": LutAToB((LINE,) * 3, TURN, (GAMMA, SAMPLED, LINE)),
    "table": LutAToB((LINE, SAMPLED, GAMMA), TURN, (GAMMA,) * 3, TABLE, (SAMPLED, LINE, GAMMA)),
    "parametric 0 to 2": LutAToB(PARAMETRIC[:3]),
    "parametric 3 to 4": LutAToB((*PARAMETRIC[3:], LINE)),
    "16 bits": Lut16(RNG.uniform(0, 1, (3, 5)), RNG.uniform(0, 1, (4, 4, 4, 3)), RNG.uniform(0, 1, (3, 6))),
    "8 bits": Lut8([RAMP, RAMP**2, 1 - RAMP], RNG.uniform(0, 1, (3, 3, 3, 3)), [RAMP**2, 1 - RAMP, RAMP]),
}


@pytest.mark.parametrize("pcs", ["XYZ ", "Lab "])
@pytest.mark.parametrize("name", FORWARD)
def test_to_the_connection_space(name, pcs, tmp_path):
    profile = device_profile(pcs=pcs, A2B1=FORWARD[name])
    found = iccbrdf.link([profile])(PIXELS)
    theirs = reference(tmp_path, [profile], PIXELS, pcs=pcs)
    np.testing.assert_allclose(found, theirs, rtol=1e-4, atol=2e-5 if pcs == "XYZ " else 2e-3)


BACK = {
    "table": LutBToA((SAMPLED, GAMMA, LINE), TURN, (GAMMA, LINE, SAMPLED), TABLE, (LINE, GAMMA, SAMPLED)),
    "curves": LutBToA((LINE, SAMPLED, LINE)),
    "16 bits": Lut16(
        np.linspace([0, 0, 0], [1, 1, 0.9], 7).T,
        RNG.uniform(0, 1, (4, 4, 4, 3)),
        np.linspace([0, 0.1, 0], [1, 1, 0.9], 6).T,
        (0.9, 0.1, 0, 0, 0.8, 0.1, 0.1, 0, 0.7),
    ),
}


@pytest.mark.parametrize("pcs", ["XYZ ", "Lab "])
@pytest.mark.parametrize("name", BACK)
def test_from_the_connection_space(name, pcs, tmp_path):
    first = device_profile("scnr", pcs=pcs, A2B1=LutAToB((LINE,) * 3))
    chain = [first, device_profile(pcs=pcs, B2A1=BACK[name])]
    found = iccbrdf.link(chain)(PIXELS)
    np.testing.assert_allclose(found, reference(tmp_path, chain, PIXELS), rtol=1e-4, atol=1e-4)


def test_encodings_of_white():
    """L* 100 is FFFF but in 16-bit tables FF00; 1.0 of XYZ is 8000."""
    top = np.ones((1, 3))
    profile = device_profile(pcs="XYZ ", A2B1=LutAToB((LINE,) * 3))
    np.testing.assert_allclose(iccbrdf.link([profile])(top), [[65535 / 32768] * 3])
    lab = iccbrdf.link([device_profile(pcs="Lab ", A2B1=LutAToB((LINE,) * 3))])
    np.testing.assert_allclose(lab(top), [[100, 127, 127]], rtol=1e-6)
    ramp, cube = np.tile([0.0, 1.0], (3, 1)), np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), -1)
    old = iccbrdf.link([device_profile(pcs="Lab ", A2B1=Lut16(ramp, cube, ramp))])
    white = np.array([[0xFF00, 0x8000, 0x8000]]) / 65535
    np.testing.assert_allclose(old(white), [[100, 0, 0]], atol=2e-5)


def test_inputs_are_clipped():
    transform = iccbrdf.link([device_profile(pcs="XYZ ", A2B1=LutAToB((GAMMA, SAMPLED, PARAMETRIC[0])))])
    np.testing.assert_allclose(transform([[-1, -1, -1], [2, 2, 2]]), [[0] * 3, [65535 / 32768] * 3])


def test_the_break_belongs_to_the_upper_part():
    curve = ParametricCurve(4, (1.0, 1.0, 0.0, 0.0, 0.5, 0.0, 0.25))
    transform = iccbrdf.link([device_profile(pcs="XYZ ", A2B1=LutAToB((curve,) * 3))])
    below = np.nextafter(np.float32(0.5), np.float32(0))
    found = transform([[0.5, below, 1]])[0] * 32768 / 65535
    np.testing.assert_allclose(found, [0.5, 0.25, 1], rtol=1e-6)


def test_what_has_no_meaning():
    curve = ParametricCurve(1, (2.0, 0.0, 1.0))
    with pytest.raises(ProfileError, match="tag A2B1: B curve 1: parameter a: found 0, expected above 0"):
        iccbrdf.link([device_profile(A2B1=LutAToB((LINE, curve, LINE)))])
    with pytest.raises(UnsupportedError, match="is of type 'text'; only processing elements and look-up"):
        iccbrdf.link([device_profile(A2B1=PlainText("a"))])


CORNERS = RNG.uniform(0, 1, (2, 2, 2, 3)).astype(np.float32)


def tetrahedron(pixel):
    """By hand: from the first corner along the axes in the order of the fractions."""
    corner = np.zeros(3, int)
    value = CORNERS[tuple(corner)].astype(float)
    for axis in np.argsort(-pixel, kind="stable"):
        before = CORNERS[tuple(corner)].astype(float)
        corner[axis] = 1
        value = value + pixel[axis] * (CORNERS[tuple(corner)] - before)
    return value


@pytest.mark.parametrize("kind", ["clut", "xclt", "nested", "table"])
def test_tetrahedral_interpolation(kind):
    table = Clut(CORNERS)
    tag = {
        "clut": MultiProcess.of(table),
        "xclt": MultiProcess.of(ExtendedClut(CORNERS, 0)),
        "nested": program("in(0,3) calc(0) out(0,3)", 3, 3, program(
            "in(0,3) clut(0) out(0,3)", 3, 3, (table,)).elements),
        "table": LutAToB((LINE,) * 3, clut=ExtendedClut(CORNERS, 2), a_curves=(LINE,) * 3),
    }[kind]  # fmt: skip
    transform = iccbrdf.link([device_profile(A2B1=tag)], interpolation="tetrahedral")
    expected = np.stack([tetrahedron(pixel) for pixel in PIXELS])
    if kind == "table":
        expected *= 65535 / 32768
    np.testing.assert_allclose(transform(PIXELS), expected, rtol=1e-4, atol=2e-5)
    assert transform.backend == "interpreter"
    multilinear = iccbrdf.link([device_profile(A2B1=tag)])
    assert np.abs(transform(PIXELS) - multilinear(PIXELS)).max() > 0.05
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(transform))(PIXELS), transform(PIXELS))


def test_tables_of_other_sizes_stay_multilinear():
    profile = device_profile(space="CMYK", A2B1=MultiProcess.of(Clut(RNG.uniform(0, 1, (2, 2, 2, 2, 3)))))
    pixels = RNG.uniform(0, 1, (20, 4))
    one, other = (iccbrdf.link([profile], interpolation=i)(pixels) for i in ("tetrahedral", "multilinear"))
    np.testing.assert_array_equal(one, other)


def test_interpolations_are_named():
    with pytest.raises(UsageError, match="interpolation 'linear' is unknown"):
        iccbrdf.link([device_profile(A2B1=MultiProcess.of(Clut(CORNERS)))], interpolation="linear")
