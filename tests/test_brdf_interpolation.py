"""From XYZ to parameters: the papers' algorithm against a slow transcription, and the continuous map."""

import dataclasses
import functools
import math
import re

import colour
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iccbrdf.brdf.geometry import planar
from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.brdf.models import MODELS, evaluate
from iccbrdf.brdf.primaries import Primaries, Primary, read_primaries
from iccbrdf.brdf.smooth_interpolation import GLOSS_FLOOR, SmoothMap
from iccbrdf.errors import InputError, UsageError
from iccbrdf.resources import folder

METHODS = ("smooth", "published")
WHITE = (0.9642, 1.0, 0.8249)
FLOAT32 = st.floats(allow_nan=False, allow_infinity=False, width=32)


@functools.cache
def fogra39() -> Primaries:
    return read_primaries(folder("profiles") / "fogra39_gloss" / "primaries.json")


def random_primaries(model: str = "brdf1", count: int = 8, seed: int = 0) -> Primaries:
    """Nodes that lie anywhere, with unrelated parameters."""
    rng = np.random.default_rng(seed)
    width = len(MODELS[model].channels)
    return with_entries(
        [
            Primary(f"P{k}", tuple(rng.uniform(0.02, 0.9, 3)), tuple(rng.uniform(0.05, 0.6, width)))
            for k in range(count)
        ],
        model,
    )


def with_entries(entries: list[Primary], model: str = "brdf1") -> Primaries:
    return dataclasses.replace(fogra39(), model=model, white=WHITE, primaries=tuple(entries))


def mixtures(primaries: Primaries, count: int, seed: int) -> np.ndarray:
    """Colours inside the gamut: random means of the nodes."""
    shares = np.random.default_rng(seed).dirichlet(np.full(len(primaries.primaries), 0.5), count)
    return shares @ primaries.XYZ


def transcribed(XYZ: tuple[float, ...], primaries: Primaries, p: float, exponent: float) -> list[float]:
    """The published algorithm for one colour, step by step."""
    white_xy = colour.XYZ_to_xy(primaries.white)

    def delta_E(XYZ_1, XYZ_2) -> float:
        Lab = [colour.XYZ_to_Lab(XYZ, white_xy) for XYZ in (XYZ_1, XYZ_2)]
        return float(colour.delta_E(*Lab, method="CIE 2000"))

    def chromaticity(XYZ) -> list[float]:
        return [component / sum(XYZ) for component in XYZ]

    def distance(a, b, order: float) -> float:
        return sum(abs(x - y) ** order for x, y in zip(a, b, strict=True)) ** (1 / order)

    nodes = primaries.primaries
    d = [distance(chromaticity(XYZ), chromaticity(node.XYZ), p) for node in nodes]
    S = sorted(range(len(nodes)), key=lambda k: d[k])

    E_best, T, B = math.inf, None, None
    for n in range(1, len(nodes) + 1):
        D = [distance(XYZ, nodes[k].XYZ, 2) for k in S[:n]]
        if 0 in D:
            return list(nodes[S[D.index(0)]].parameters)
        w = [value**exponent for value in D]

        def mean(vectors, w=w) -> list[float]:
            columns = zip(*vectors, strict=True)
            return [sum(v * x for v, x in zip(column, w, strict=True)) / sum(w) for column in columns]

        T_n = mean([nodes[k].XYZ for k in S[:n]])
        E_n = delta_E(T_n, XYZ)
        if E_n < E_best:
            E_best, T, B = E_n, T_n, mean([nodes[k].parameters for k in S[:n]])
    return [B[k] * XYZ[k] / T[k] for k in range(3)] + B[3:]


@pytest.mark.parametrize(
    ("primaries", "p", "exponent", "count"),
    [
        (fogra39(), 2, -1, 150),
        (random_primaries("brdf2", 8, 1), 2, -1, 50),
        (random_primaries("ward", 4, 2), 1, -1, 40),
        (random_primaries("cook_torrance_2020", 16, 3), 3, -2, 40),
        (fogra39(), 2, 1, 40),
    ],
)
def test_published_equals_a_transcription(primaries, p, exponent, count) -> None:
    inside = mixtures(primaries, count, 4)
    anywhere = np.random.default_rng(5).uniform(0.001, 1.2, (count // 2, 3))
    XYZ = np.concatenate([inside, anywhere, primaries.XYZ])
    found = interpolate(XYZ, primaries, method="published", p=p, exponent=exponent)
    expected = [transcribed(tuple(row), primaries, p, exponent) for row in XYZ.tolist()]
    assert found == pytest.approx(np.array(expected), rel=1e-11)


def test_published_by_hand() -> None:
    # The input lies on the line of P0 and P1, of one chromaticity with both, nearer to P0: two nodes at
    # distances 1 : 3 along the greys reproduce it exactly, so n = 2 has E' = 0 and weights 3/4 and 1/4.
    grey = np.array(WHITE)
    entries = [
        Primary("P0", tuple(grey * 0.2), (0.2, 0.2, 0.2, 0.1, 0.1, 0.1, 0.4)),
        Primary("P1", tuple(grey * 0.6), (0.6, 0.6, 0.6, 0.3, 0.3, 0.3, 0.2)),
        Primary("P2", (0.4, 0.2, 0.05), (0.3, 0.2, 0.1, 0.9, 0.9, 0.9, 0.9)),
        Primary("P3", (0.1, 0.3, 0.05), (0.1, 0.3, 0.1, 0.9, 0.9, 0.9, 0.9)),
    ]
    found = interpolate(grey * 0.3, with_entries(entries), method="published")
    assert found == pytest.approx([0.3, 0.3, 0.3, 0.15, 0.15, 0.15, 0.35], rel=1e-12)


def test_ties_of_chromaticity_go_by_the_order_in_the_file() -> None:
    # White and two greys share a chromaticity, which rounding computes differently for each; the input lies
    # so that one node alone reproduces it better than two or more.
    grey = np.array(WHITE)
    entries = [
        Primary(f"P{k}", tuple(grey * share), (share,) * 3 + (gloss,) * 4)
        for k, (share, gloss) in enumerate([(0.9, 0.1), (0.3, 0.2), (0.7, 0.3)])
    ]
    entries.append(Primary("P3", (0.1, 0.3, 0.05), (0.1, 0.3, 0.1, 0.9, 0.9, 0.9, 0.9)))
    # Above all of them: the first, .9, is the best that the prefix can be; .7 first would take .9 along.
    above = grey * 0.95
    first = interpolate(above, with_entries(entries), method="published")
    assert first[3:] == pytest.approx([0.1] * 4, rel=1e-12)
    swapped = with_entries([entries[2], entries[1], entries[0], entries[3]])
    assert interpolate(above, swapped, method="published")[6] > 0.11


def test_far_nodes_weigh_more_with_the_exponent_of_2023() -> None:
    XYZ = mixtures(fogra39(), 200, 6)
    near, far = (interpolate(XYZ, fogra39(), method="published", exponent=e) for e in (-1, 1))
    assert np.abs(near[:, 6] - far[:, 6]).max() > 0.005


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("count", [4, 8, 9, 16])
def test_nodes_have_their_own_parameters(method, model, count) -> None:
    primaries = random_primaries(model, count, seed=count)
    found = interpolate(primaries.XYZ, primaries, method=method)
    assert found == pytest.approx(primaries.parameters, abs=1e-12)


def test_published_nodes_are_bit_equal() -> None:
    found = interpolate(fogra39().XYZ, fogra39(), method="published")
    assert np.array_equal(found, fogra39().parameters)


@pytest.mark.parametrize("method", METHODS)
def test_shapes_lead_the_channels(method) -> None:
    XYZ = mixtures(fogra39(), 12, 7)
    flat = interpolate(XYZ, fogra39(), method=method)
    assert (
        interpolate(XYZ.reshape(3, 4, 3), fogra39(), method=method).tolist() == flat.reshape(3, 4, 7).tolist()
    )
    assert interpolate(XYZ[0], fogra39(), method=method) == pytest.approx(flat[0], rel=1e-14)


@pytest.mark.parametrize("method", METHODS)
def test_kd_is_the_colour_where_it_is_so_at_the_nodes(method) -> None:
    entries = [
        dataclasses.replace(primary, parameters=primary.XYZ + primary.parameters[3:])
        for primary in fogra39().primaries
    ]
    XYZ = np.concatenate([mixtures(fogra39(), 500, 8), np.random.default_rng(9).uniform(0, 1, (500, 3))])
    parameters = interpolate(XYZ, with_entries(entries), method=method)
    assert parameters[:, :3] == pytest.approx(XYZ, abs=1e-12)
    # Lit along the normal and seen at 45 degrees, the diffuse part is the input.
    parameters[:, 3:6] = 0
    seen = evaluate("brdf1", parameters, planar(0), planar(0), planar(45))
    assert seen == pytest.approx(XYZ, abs=1e-12)


def test_smooth_solves_its_equations() -> None:
    # With the printed definition: f = constant + sum r_i c_i, the c_i of a channel adding up to 0.
    smooth = SmoothMap.of(fogra39())
    assert smooth.coefficients.shape == (9, 7)
    assert np.sum(smooth.coefficients, axis=0) == pytest.approx(np.zeros(7), abs=1e-13)
    XYZ = [0.35, 0.4, 0.2]
    u = [(component / white + 0.01) ** (1 / 3) for component, white in zip(XYZ, WHITE, strict=True)]
    f = smooth.constant + sum(
        math.dist(u, [(c / w + 0.01) ** (1 / 3) for c, w in zip(primary.XYZ, WHITE, strict=True)]) * row
        for primary, row in zip(fogra39().primaries, smooth.coefficients, strict=True)
    )
    expected = [*(f[:3] + XYZ), *np.exp(f[3:])]
    assert interpolate(XYZ, fogra39()) == pytest.approx(expected, rel=1e-12)


def test_smooth_weights_of_the_nodes_add_up_to_1() -> None:
    # Parameters that all nodes share are those of every colour.
    entries = [
        dataclasses.replace(primary, parameters=(*primary.XYZ, 0.2, 0.3, 0.1, 0.25))
        for primary in random_primaries(count=12, seed=11).primaries
    ]
    XYZ = np.random.default_rng(12).uniform(-0.2, 1.5, (100, 3))
    gloss = interpolate(XYZ, with_entries(entries))[:, 3:]
    assert gloss == pytest.approx(np.tile([0.2, 0.3, 0.1, 0.25], (100, 1)), rel=1e-12)


def steps(method: str, count: int) -> np.ndarray:
    """Largest step of each parameter along 60 random lines inside the gamut, (lines, k)."""
    ends = mixtures(fogra39(), 120, 13).reshape(2, 60, 3)
    share = np.linspace(0, 1, count + 1)[:, np.newaxis, np.newaxis]
    parameters = interpolate(ends[0] + share * (ends[1] - ends[0]), fogra39(), method=method)
    return np.abs(np.diff(parameters, axis=0)).max(axis=0)


def test_smooth_is_continuous() -> None:
    coarse, fine = steps("smooth", 500), steps("smooth", 2000)
    assert fine / coarse == pytest.approx(np.full(fine.shape, 0.25), rel=0.02)


def test_published_jumps() -> None:
    # Most lines cross a switch, and there the step does not shrink with its length.
    coarse, fine = steps("published", 500)[:, 6], steps("published", 2000)[:, 6]
    jumps = fine > 0.002
    assert np.mean(jumps) > 0.5
    assert fine[jumps] == pytest.approx(coarse[jumps], abs=0.002)


def test_smooth_gloss_levels_off_out_of_gamut() -> None:
    smooth = SmoothMap.of(fogra39())
    bound = np.linalg.norm(smooth.nodes, axis=-1) @ np.abs(smooth.coefficients)
    directions = np.random.default_rng(14).normal(size=(1000, 3))
    for length in (1, 10, 1e6, 1e30):
        found = np.log(smooth.parameters(length * directions)[:, 3:])
        assert np.all(np.abs(found - smooth.constant[3:]) <= bound[3:])


def test_smooth_hardly_overshoots_on_print_colours() -> None:
    m = interpolate(mixtures(fogra39(), 5000, 15), fogra39())[:, 6]
    nodes = fogra39().parameters[:, 6]
    assert m.min() > nodes.min() * 0.96
    assert m.max() < nodes.max() * 1.04


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=200)
@given(XYZ=st.tuples(FLOAT32, FLOAT32, FLOAT32))
def test_every_colour_has_finite_parameters(method, XYZ) -> None:
    parameters = interpolate(XYZ, fogra39(), method=method)
    assert np.all(np.isfinite(parameters))
    assert np.all(parameters[:3] >= 0)
    assert np.all(parameters[3:] > 0)


@pytest.mark.parametrize(
    ("XYZ", "kd"),
    [
        ((0, 0, 0), (0, 0, 0)),
        ((-0.1, -0.2, -0.1), (0, 0, 0)),
        ((-1e-30, 0, 0), (0, 0, 0)),
        ((0.3, -0.2, 0.1), None),
        ((1, -1, 1e-45), None),
    ],
)
def test_black_and_impossible_colours(XYZ, kd) -> None:
    published = interpolate(XYZ, fogra39(), method="published")
    smooth = interpolate(XYZ, fogra39())
    assert np.all(np.isfinite(published))
    assert np.all(np.isfinite(smooth))
    assert np.all((published[6], smooth[6]) > np.array(0.15))
    if kd is not None:
        # Without a chromaticity black takes the light's, to which K is nearest in the whole.
        assert published == pytest.approx([*kd, *fogra39().parameters[-1, 3:]], rel=0.2)
        assert smooth[:3] == pytest.approx(kd, abs=0.005)


@pytest.mark.parametrize("method", METHODS)
def test_pixels_that_are_no_colour_spoil_only_themselves(method) -> None:
    XYZ = np.array([[0.3, 0.3, 0.2], [np.nan, 0.3, 0.2], [np.inf, 0.3, 0.2], [0.3, -np.inf, 0.2]])
    found = interpolate(XYZ, fogra39(), method=method)
    assert found[0] == pytest.approx(interpolate(XYZ[0], fogra39(), method=method), rel=1e-14)
    assert np.all(np.isnan(found[1:]))


def test_gloss_of_0_at_a_node_is_held_at_a_floor() -> None:
    entries = list(random_primaries("ward", 5, 16).primaries)
    entries[2] = dataclasses.replace(entries[2], parameters=(0.1, 0.1, 0.1, 0.0, 0.3))
    primaries = with_entries(entries, "ward")
    assert interpolate(primaries.XYZ, primaries)[2] == pytest.approx([0.1, 0.1, 0.1, GLOSS_FLOOR, 0.3])
    assert interpolate(primaries.XYZ, primaries, method="published")[2].tolist() == [0.1, 0.1, 0.1, 0, 0.3]


def replaced(number: int, XYZ: tuple[float, ...]) -> Primaries:
    entries = list(fogra39().primaries)
    entries[number] = dataclasses.replace(entries[number], XYZ=XYZ)
    return with_entries(entries)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("primaries", "message"),
    [
        (with_entries(list(fogra39().primaries[:3])), "3 primaries, expected 4 to 16"),
        (random_primaries(count=17), "17 primaries, expected 4 to 16"),
        (
            replaced(2, (0.1, 0.0, 0.1)),
            r"primary 3 \(M\): XYZ is \[0.1, 0.0, 0.1\], expected numbers above 0",
        ),
        (replaced(2, (0.1, np.nan, 0.1)), r"primary 3 \(M\): XYZ is .*, expected numbers above 0"),
        (
            replaced(8, (0.150205, 0.229298, 0.528501)),
            r"primary 9 \(K\): XYZ is .*, that of primary 2 \(C\), expected colours more than 1e-05 apart",
        ),
    ],
)
def test_nodes_that_span_nothing_are_named(method, primaries, message) -> None:
    with pytest.raises(InputError, match=message):
        interpolate([0.3, 0.3, 0.3], primaries, method=method)


def test_nodes_that_span_nothing_are_named_with_their_file() -> None:
    with pytest.raises(InputError, match=r"fogra39_gloss/primaries\.json: primary 3 \(M\): XYZ is"):
        interpolate([0.3, 0.3, 0.3], replaced(2, (0.1, 0.0, 0.1)))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "smoth"}, "unknown interpolation method 'smoth': did you mean 'smooth'?"),
        ({"method": "published", "p": 0.5}, "p is 0.5, expected a number of at least 1"),
        ({"method": "published", "exponent": 5}, "exponent is 5, expected -4 to 4"),
        ({"method": "published", "exponent": math.nan}, "exponent is nan"),
    ],
)
def test_wrong_options_are_named(options, message) -> None:
    with pytest.raises(UsageError) as caught:
        interpolate([0.3, 0.3, 0.3], fogra39(), **options)
    assert message in str(caught.value)
    with pytest.raises(UsageError, match=r"XYZ has the shape \(4,\)"):
        interpolate([0.3, 0.3, 0.3, 0.3], fogra39())


@pytest.mark.parametrize("method", METHODS)
def test_published_fits_of_other_materials_as_nodes(method, shared_data) -> None:
    # Cook-Torrance parameters of MERL materials by Ngan, Durand and Matusik, 2005.  G and B lack MERL's
    # channel scales; linear sRGB for want of better.
    lines = (shared_data / "published-fits" / "ngan_cooktorrance.fit").read_text().splitlines()
    fits = np.array([re.findall(r"\d+\.?\d*(?:e[-+]?\d+)?", line.split("=", 1)[1])
                     for line in lines if "=" in line], dtype=float)  # fmt: skip
    scaled = fits[:, :6].reshape(-1, 2, 3) * [1, 1.15, 1.66]
    sRGB = colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ
    (kd, ks), m = np.moveaxis(scaled @ sRGB.T, 1, 0), fits[:, -1]
    sound = np.flatnonzero((kd > 1e-3).all(axis=1) & (ks > 1e-3).all(axis=1))
    assert sound.size > 40
    parameters = np.concatenate([kd, ks, m[:, np.newaxis]], axis=1)
    # Each twelfth from the darkest on, so that the nodes span the lightness.
    nodes = sound[np.argsort(kd[sound, 1])][:: max(1, sound.size // 12)][:16]
    primaries = with_entries(
        [Primary(f"P{k}", tuple(kd[k].tolist()), tuple(parameters[k].tolist())) for k in nodes]
    )
    np.testing.assert_allclose(interpolate(kd[nodes], primaries, method=method), parameters[nodes], rtol=1e-9)
    others = np.setdiff1d(sound, nodes)
    between = interpolate(kd[others], primaries, method=method)
    assert np.isfinite(between).all()
    assert (between[:, 3:] > 0).all()
    # What one cannot know of another material stays near what the nodes have.
    span = np.log(parameters[nodes, 6])
    assert np.log(between[:, 6]).min() > span.min() - np.ptp(span) / 2
    assert np.log(between[:, 6]).max() < span.max() + np.ptp(span) / 2
