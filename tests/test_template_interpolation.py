"""Slope adjustment and interpolation as programs, against the float64 reference and the ICC's implementation.

The reference is fed the constants as float32 holds them.  Where constants are folded (a difference of whites,
say), the tests take numbers of few binary digits, so that folding rounds nothing.
"""

import time
from dataclasses import dataclass, replace

import iccdev
import numpy as np
import pytest

from iccbrdf.brdf import smooth_interpolation
from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.brdf.models import MODELS
from iccbrdf.brdf.primaries import Primary, read_primaries
from iccbrdf.brdf.published_interpolation import chromaticity_order
from iccbrdf.brdf.slopes import Slope, read_slopes, slope_adjust, slope_angle
from iccbrdf.brdf.smooth_interpolation import SmoothMap
from iccbrdf.calc import compile_chain, compile_template, run
from iccbrdf.icc import Calculator, Header, Mluc, MultiProcess, Profile, TagArray, write_profile
from iccbrdf.resources import folder

PIXELS = 5000
CHANNELS = ("X", "Y", "Z", "n.x", "n.y", "n.z")
BRDFS = {
    "brdf1": ("kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m"),
    "brdf2": ("kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m.X", "m.Y", "m.Z"),
    "cook_torrance_2020": ("Rd.X", "Rd.Y", "Rd.Z", "ks", "m"),
    "ward": ("Rd.X", "Rd.Y", "Rd.Z", "ks", "m"),
}


def to_float32(values):
    return np.asarray(values, np.float32).astype(np.float64)


def make_primaries(brdf="brdf1", count=9):
    """The example's colours; for other models than its own and more nodes, parameters drawn by chance."""
    example = read_primaries(folder("profiles") / "fogra39_gloss" / "primaries.json")
    rng = np.random.default_rng(count)
    width = len(BRDFS[brdf])
    nodes = []
    for k in range(count):
        XYZ = example.XYZ[k] if k < len(example.primaries) else rng.uniform(0.05, 0.8, 3)
        known = brdf == example.model and k < len(example.primaries)
        parameters = example.parameters[k] if known else rng.uniform(0.05, 0.5, width)
        nodes.append(Primary(str(k), tuple(to_float32(XYZ)), tuple(to_float32(parameters))))
    white = tuple(to_float32(example.white))
    return replace(example, model=MODELS[brdf].name, white=white, primaries=tuple(nodes))


def make_slopes():
    """The example's slopes in steps of 2^-12, whose differences float32 holds."""
    example = read_slopes(folder("profiles") / "fogra39_gloss" / "slopes.json")

    def coarse(XYZ):
        return tuple(np.round(np.array(XYZ) * 4096) / 4096)

    return replace(example, slopes=tuple(Slope(s.angle, coarse(s.W), coarse(s.B)) for s in example.slopes))


def chain(*names, **constants):
    path = folder("calc_templates")
    texts = [((path / f"{name}.calc").read_text("utf-8"), f"{name}.calc") for name in names]
    return compile_chain(texts, constants=constants)


def slope_constants(slopes, method="affine"):
    return {
        "slope_angles": slopes.angles, "slope_W": slopes.W, "slope_B": slopes.B, "slope_method": method,
    }  # fmt: skip


def published_constants(primaries, **options):
    return {
        "brdf": primaries.model,
        "white": primaries.white,
        "node_XYZ": primaries.XYZ,
        "node_kd": primaries.parameters[:, :3],
        "node_gloss": primaries.parameters[:, 3:],
        **options,
    }


def smooth_constants(primaries, solved):
    return {
        "brdf": primaries.model,
        "white": primaries.white,
        "coded_nodes": solved.nodes,
        "coefficients": solved.coefficients,
        "constant_terms": solved.constant,
    }


@pytest.fixture
def knee(monkeypatch):
    """The reference's 0.01 as float32 holds it."""
    monkeypatch.setattr(smooth_interpolation, "KNEE", float(np.float32(smooth_interpolation.KNEE)))


def solve(primaries):
    """The smooth map with the constants that a program holds."""
    solved = SmoothMap.of(primaries)
    return SmoothMap(*(to_float32(v) for v in (
        solved.white, solved.nodes, solved.coefficients, solved.constant)))  # fmt: skip


@dataclass
class Pixels:
    XYZ: np.ndarray
    normals: np.ndarray

    def run(self, compiled, dtype=np.float64):
        """Outputs (pixels, channels) as float64."""
        columns = np.hstack([self.XYZ, self.normals]).T.astype(dtype)
        by_name = dict(zip(CHANNELS, columns, strict=True))
        outputs = run(
            compiled.program, [by_name[name] for name in compiled.inputs], len(compiled.outputs), dtype=dtype
        )
        return np.stack([np.broadcast_to(v, len(self.XYZ)) for v in outputs], axis=-1).astype(np.float64)


def make_pixels(primaries, seed=0):
    """Colours within the primaries, on straight lines to black, and all of 0..1; normals up to level."""
    rng = np.random.default_rng(seed)
    mixed = rng.dirichlet(np.full(len(primaries.primaries), 0.4), PIXELS) @ primaries.XYZ
    mixed[::5] *= rng.uniform(0, 1, (PIXELS // 5, 1))
    mixed[1::5] = rng.uniform(0, 1, (PIXELS // 5, 3)) ** 2
    normals = rng.normal(size=(PIXELS, 3))
    normals[:, 2] = abs(normals[:, 2])
    return Pixels(to_float32(mixed), to_float32(normals))


def is_beside_switch(XYZ, primaries, p=2, exponent=-1):
    """Whether rounding may change the order of the nodes or n for a colour; the papers' steps one by one."""
    nodes, white = primaries.XYZ, np.array(primaries.white)
    C = XYZ / XYZ.sum()
    distances = [np.sum(abs(C - np.round(node / node.sum(), 6)) ** p) ** (1 / p) for node in nodes]
    order = sorted(range(len(nodes)), key=lambda i: distances[i])
    gaps = np.diff(sorted(distances))
    differences = []
    for n in range(1, len(nodes) + 1):
        S = nodes[order[:n]]
        w = np.linalg.norm(XYZ - S, axis=-1) ** exponent
        T = w @ S / w.sum()
        differences.append(delta_E_CIE2000(XYZ_to_Lab(T, white), XYZ_to_Lab(XYZ, white)))
    least, second = np.sort(differences)[:2]
    return np.min(gaps[gaps > 0]) < 1e-6 or second - least < 1e-4


# Slope adjustment --------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["affine", "published"])
def test_slope_adjustment_is_the_reference(method):
    slopes, pixels = make_slopes(), make_pixels(make_primaries())
    compiled = chain("slope_adjust", **slope_constants(slopes, method))
    assert compiled.inputs == CHANNELS
    assert compiled.outputs == ("X", "Y", "Z")
    # A flat normal, one with no direction, one that looks down, and the flat white and black themselves.
    pixels.normals[:4] = [[0, 0, 1], [0, 0, 0], [0.5, 0, -1], [0, -2, 0]]
    pixels.XYZ[:60:2] = slopes.W[0]
    pixels.XYZ[1:60:2] = slopes.B[0]
    expected = slope_adjust(pixels.XYZ, slope_angle(pixels.normals), slopes, method=method)
    np.testing.assert_allclose(pixels.run(compiled), expected, rtol=0, atol=1e-13)
    np.testing.assert_allclose(pixels.run(compiled, np.float32), expected, rtol=0, atol=1e-6)
    if method == "affine":
        np.testing.assert_allclose(pixels.run(compiled)[0], slopes.W[0], rtol=1e-15)


def test_measured_slopes_return_what_was_measured():
    slopes = make_slopes()
    compiled = chain("slope_adjust", **slope_constants(slopes))
    angles = np.radians(np.repeat(slopes.angles, 2))
    around = np.arange(len(angles))
    normals = np.stack([np.sin(angles) * np.cos(around), np.sin(angles) * np.sin(around), np.cos(angles)], -1)
    patches = np.tile([slopes.W[0], slopes.B[0]], (len(slopes.angles), 1))
    result = Pixels(patches, 3 * normals).run(compiled)
    np.testing.assert_allclose(result[0::2], slopes.W, rtol=1e-12)
    np.testing.assert_allclose(result[1::2], slopes.B, rtol=1e-12)
    # Steeper than the last: as the last.
    level = Pixels(patches[:2], np.array([[1, 0, 0], [0, 1, -1]])).run(compiled)
    np.testing.assert_allclose(level, [slopes.W[-1], slopes.B[-1]], rtol=1e-12)


# Smooth ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("brdf", "count"), [("brdf1", 9), ("brdf2", 8), ("ward", 4), ("cook_torrance_2020", 16)]
)
def test_smooth_is_the_reference(knee, brdf, count):
    primaries = make_primaries(brdf, count)
    pixels, solved = make_pixels(primaries), solve(primaries)
    compiled = chain("interpolate_smooth", **smooth_constants(primaries, solved))
    assert compiled.inputs == CHANNELS
    assert compiled.outputs == (*BRDFS[brdf], "n.x", "n.y", "n.z")
    expected = np.hstack([solved.parameters(pixels.XYZ), pixels.normals])
    np.testing.assert_allclose(pixels.run(compiled), expected, rtol=1e-12, atol=1e-13)
    single = pixels.run(compiled, np.float32)
    np.testing.assert_allclose(single, expected, rtol=2e-6, atol=2e-6)
    assert max_difference(single, expected, primaries) < 1e-3


def max_difference(single, expected, primaries):
    """Greatest CIEDE2000 between diffuse colours."""
    white = np.array(primaries.white)
    return np.max(delta_E_CIE2000(XYZ_to_Lab(single[:, :3], white), XYZ_to_Lab(expected[:, :3], white)))


def test_smooth_returns_the_nodes():
    primaries = make_primaries()
    compiled = chain("interpolate_smooth", **smooth_constants(primaries, SmoothMap.of(primaries)))
    nodes = Pixels(primaries.XYZ, np.tile([0.0, 0, 1], (9, 1)))
    np.testing.assert_allclose(
        nodes.run(compiled, np.float32)[:, :7], primaries.parameters, rtol=1e-5, atol=1e-6
    )


# Published ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("brdf", "count", "options"),
    [
        ("brdf1", 9, {}),
        ("brdf2", 8, {}),
        ("ward", 4, {}),
        ("cook_torrance_2020", 16, {}),
        ("brdf1", 9, {"exponent": 1}),
        ("brdf1", 9, {"p": 1}),
        ("brdf1", 9, {"p": 3.5, "exponent": -2.5}),
        ("brdf1", 9, {"exponent": 4}),
    ],
)
def test_published_is_the_reference(brdf, count, options):
    primaries = make_primaries(brdf, count)
    pixels = make_pixels(primaries)
    compiled = chain("interpolate_published", **published_constants(primaries, **options))
    assert compiled.inputs == CHANNELS
    assert compiled.outputs == (*BRDFS[brdf], "n.x", "n.y", "n.z")
    parameters = interpolate(pixels.XYZ, primaries, method="published", **options)
    expected = np.hstack([parameters, pixels.normals])
    for dtype, tolerance in ((np.float64, 1e-10), (np.float32, 1e-4)):
        result = pixels.run(compiled, dtype)
        switched = np.any(abs(result - expected) > tolerance * (1 + abs(expected)), axis=-1)
        print(f"{brdf} {count} {options} {dtype.__name__}: {switched.sum()} of {PIXELS} switched")
        assert switched.sum() <= 5
        assert all(is_beside_switch(XYZ, primaries, **options) for XYZ in pixels.XYZ[switched])
        assert max_difference(result[~switched], expected[~switched], primaries) < 1e-3


def test_few_colours_are_beside_a_switch():
    # Else the test above could excuse anything.
    primaries = make_primaries()
    beside = [is_beside_switch(XYZ, primaries) for XYZ in make_pixels(primaries).XYZ[::5]]
    print(f"{sum(beside)} of {len(beside)} colours are beside a switch")
    assert np.mean(beside) < 0.02


@pytest.mark.parametrize("exponent", [-4, -1, 1])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_published_returns_the_nodes_exactly(dtype, exponent):
    primaries = make_primaries()
    compiled = chain("interpolate_published", **published_constants(primaries, exponent=exponent))
    nodes = Pixels(primaries.XYZ, np.tile([0.0, 0, 1], (9, 1)))
    np.testing.assert_array_equal(nodes.run(compiled, dtype)[:, :7], primaries.parameters)


def differences_by_n(XYZ, primaries):
    """E' of the first n nodes for n = 1..N, and the order of the nodes; the papers' steps."""
    nodes, white = primaries.XYZ, np.array(primaries.white)
    order = chromaticity_order(XYZ, nodes, white, 2)
    w = 1 / np.take_along_axis(np.linalg.norm(XYZ[:, None] - nodes, axis=-1), order, axis=-1)[..., None]
    T = np.cumsum(w * nodes[order], axis=1) / np.cumsum(w, axis=1)
    return delta_E_CIE2000(XYZ_to_Lab(T, white), XYZ_to_Lab(XYZ, white)[:, None]), order


@pytest.mark.parametrize("hues", ["any", "opposite", "grey", "blue"])
def test_differences_are_CIEDE2000(hues):
    """Under a white of equal parts and with Y = Z, hues are 0 and 180 degrees: T' and I may be opposite."""
    rng = np.random.default_rng(1)
    primaries, XYZ = make_primaries("ward", 5), rng.uniform(0.01, 1, (PIXELS, 3)) ** 2
    if hues in ("opposite", "grey"):
        colours = [[0.5, 0.3, 0.3], [0.3, 0.5, 0.5], [0.2, 0.1, 0.1], [0.1, 0.2, 0.2], [0.8, 0.75, 0.75]]
        nodes = tuple(Primary(str(k), tuple(to_float32(colours[k])), (0.5,) * 5) for k in range(5))
        primaries = replace(primaries, white=(1.0, 1.0, 1.0), primaries=nodes)
        XYZ = XYZ[:, [0, 1, 1]] if hues == "opposite" else XYZ[:, [0, 0, 0]]
    if hues == "blue":
        XYZ[:, 2] = np.minimum(3 * XYZ[:, 2] + XYZ[:, 1], 1)
    pixels = Pixels(to_float32(XYZ), np.tile([0.0, 0, 1], (PIXELS, 1)))
    text = (folder("calc_templates") / "interpolate_published.calc").read_text("utf-8")
    text = text.partition("let best =")[0] + "output a b c d e f g h i j = (place, E_squared)\n"
    compiled = compile_template(text, filename="E", constants=published_constants(primaries))
    expected, order = differences_by_n(pixels.XYZ, primaries)
    # Constants are float32 numbers in both.
    for dtype, relative, absolute in ((np.float64, 5e-6, 1e-6), (np.float32, 1e-4, 1e-4)):
        result = pixels.run(compiled, dtype)
        same = np.all(result[:, :5] == np.argsort(order, axis=-1), axis=-1)
        assert same.mean() > 0.99
        E = np.take_along_axis(np.sqrt(np.maximum(result[same, 5:], 0)), order[same], axis=-1)
        np.testing.assert_allclose(E, expected[same], rtol=relative, atol=absolute)


def test_nodes_of_equal_chromaticity_are_taken_in_the_order_of_the_file():
    # Two greys and two colours; the input, darker than all, is nearest to the dark grey alone.
    white = np.array([0.9642, 1.0, 0.8249])
    XYZ = np.array([0.8 * white, 0.2 * white, [0.3, 0.1, 0.05], [0.1, 0.3, 0.05]])
    parameters = np.arange(4)[:, None] + np.full((4, 5), 0.5)
    dark = 0.15 * white
    for order, alone in (([0, 1, 2, 3], False), ([1, 0, 2, 3], True), ([2, 1, 3, 0], True)):
        nodes = tuple(Primary(str(k), tuple(XYZ[k]), tuple(parameters[k])) for k in order)
        primaries = replace(make_primaries("ward", 4), primaries=nodes)
        compiled = chain("interpolate_published", **published_constants(primaries))
        for dtype in (np.float32, np.float64):
            result = Pixels(dark[None], np.array([[0, 0, 1.0]])).run(compiled, dtype)[0, :5]
            expected = interpolate(dark, primaries, method="published")
            np.testing.assert_allclose(result, expected, rtol=1e-6)
            assert bool(result[3] == 1.5) == alone


# Both --------------------------------------------------------------------------------------------------


def methods():
    primaries, slopes = make_primaries(), make_slopes()
    smooth = smooth_constants(primaries, SmoothMap.of(primaries))
    published = published_constants(primaries)
    return {
        "smooth": ("interpolate_smooth", smooth),
        "published": ("interpolate_published", published),
        "published, exponent -4": ("interpolate_published", {**published, "exponent": -4}),
        "published, exponent 4, p 8": ("interpolate_published", {**published, "exponent": 4, "p": 8}),
    }, slopes


@pytest.mark.parametrize("name", methods()[0])
@pytest.mark.parametrize("slope_method", [None, "affine", "published"])
def test_no_finite_input_makes_a_result_that_is_not(name, slope_method):
    (template, constants), slopes = methods()[0][name], methods()[1]
    names = [template]
    if slope_method:
        names.insert(0, "slope_adjust")
        constants = constants | slope_constants(slopes, slope_method)
    compiled = chain(*names, **constants)
    rng = np.random.default_rng(8)
    size = 20_000
    XYZ = rng.choice([0.0, 1, 1, -1], (size, 3)) * 4 * rng.uniform(0, 1, (size, 3))
    small = rng.random(size) < 0.3
    XYZ[small] *= 10 ** rng.uniform(-20, 0, (small.sum(), 1))
    XYZ[:4] = [[0, 0, 0], [4, -4, 1e-15], [-4, -4, -4], [4, 4, 4]]
    # Beside the nodes, by the last digit of a float32.
    nodes = make_primaries().XYZ
    XYZ[4:13] = nodes
    XYZ[13:22] = np.nextafter(np.float32(nodes), np.float32(1))
    normals = rng.choice([0.0, 1, -1], (size, 3)) * 4 * rng.uniform(0, 1, (size, 3))
    for dtype in (np.float32, np.float64):
        result = Pixels(to_float32(XYZ), to_float32(normals)).run(compiled, dtype)
        assert np.all(np.isfinite(result))
        assert np.all(result[:, :3] >= 0)
        assert np.all(result[:, 3:7] > 0)
        if not slope_method:
            np.testing.assert_array_equal(result[:, 7:], to_float32(normals))


def test_black_and_impossible_colours_are_the_references():
    primaries = make_primaries()
    XYZ = np.array(
        [[0, 0, 0], [0.5, -0.1, 0.2], [-0.5, -0.1, -0.2], [1e-6, 0, 0], [0.25, -0.25, 0], [2, 3, 4.0]]
    )
    pixels = Pixels(to_float32(XYZ), np.tile([0.0, 0, 1], (len(XYZ), 1)))
    result = pixels.run(chain("interpolate_published", **published_constants(primaries)))[:, :7]
    np.testing.assert_allclose(result, interpolate(pixels.XYZ, primaries, method="published"), rtol=1e-10)
    assert np.all(result[0, :3] == 0)
    assert np.all(result[0, 3:] > 0)
    smooth = pixels.run(chain("interpolate_smooth", **smooth_constants(primaries, SmoothMap.of(primaries))))
    np.testing.assert_allclose(smooth[:, :7], interpolate(pixels.XYZ, primaries), rtol=1e-5, atol=1e-6)


def test_adjustment_and_interpolation_are_one_program(knee):
    primaries, slopes = make_primaries(), make_slopes()
    pixels, solved = make_pixels(primaries), solve(primaries)
    adjusted = slope_adjust(pixels.XYZ, slope_angle(pixels.normals), slopes)
    for name, constants, expected in (
        ("smooth", smooth_constants(primaries, solved), solved.parameters(adjusted)),
        ("published", published_constants(primaries), interpolate(adjusted, primaries, method="published")),
    ):
        compiled = chain("slope_adjust", f"interpolate_{name}", **slope_constants(slopes), **constants)
        assert compiled.inputs == CHANNELS
        np.testing.assert_allclose(pixels.run(compiled)[:, :7], expected, rtol=1e-9, atol=1e-10)
        np.testing.assert_array_equal(pixels.run(compiled)[:, 7:], pixels.normals)


def test_operators_and_time_to_compile():
    # Every 8-byte operator counts, on the longest path, with nine nodes, five slopes and BRDF1.
    primaries, slopes = make_primaries(), make_slopes()
    smooth = smooth_constants(primaries, SmoothMap.of(primaries))
    published = published_constants(primaries)
    start = time.perf_counter()
    counts = {
        "slope, affine": chain("slope_adjust", **slope_constants(slopes)).executed,
        "slope, published": chain("slope_adjust", **slope_constants(slopes, "published")).executed,
        "smooth": chain("interpolate_smooth", **smooth).executed,
        "published": chain("interpolate_published", **published).executed,
        "slope + smooth": chain(
            "slope_adjust", "interpolate_smooth", **slope_constants(slopes), **smooth
        ).executed,
        "slope + published": chain(
            "slope_adjust", "interpolate_published", **slope_constants(slopes), **published
        ).executed,
    }  # fmt: skip
    seconds = time.perf_counter() - start
    print(counts, f"{seconds:.2f} s")
    limits = {
        "slope, affine": 91, "slope, published": 122, "smooth": 155, "published": 617,
        "slope + smooth": 244, "slope + published": 707,
    }  # fmt: skip
    assert all(counts[name] <= limits[name] for name in limits), counts
    assert seconds < 3


@pytest.mark.parametrize("slope_method", [None, "affine", "published"])
@pytest.mark.parametrize("method", ["smooth", "published"])
def test_the_reference_implementation_agrees(method, slope_method, tmp_path):
    primaries = make_primaries()
    (template, constants), slopes = methods()[0][method], methods()[1]
    names = [template]
    if slope_method:
        names.insert(0, "slope_adjust")
        constants = constants | slope_constants(slopes, slope_method)
    compiled = chain(*names, **constants)
    tags = {
        "A2M0": MultiProcess.of(Calculator(6, len(compiled.outputs), compiled.program)),
        "mcta": TagArray.of_texts(compiled.outputs),
        "desc": Mluc.of("colour"),
        "cprt": Mluc.of("none"),
    }
    header = Header(device_class="mid ", colour_space="nc0006", mcs=f"mc{len(compiled.outputs):04x}")
    write_profile(Profile(header, tags), tmp_path / "mid.icc")
    pixels = make_pixels(primaries)
    pixels.XYZ[:9] = primaries.XYZ
    pixels.XYZ[9:13] = [[0, 0, 0], [0.5, -0.1, 0.2], [-0.5, -0.1, -0.2], [2, 3, 4]]
    pixels.normals[:13] = [0, 0, 1]
    with iccdev.IccCmm() as cmm:
        cmm.attach(str(tmp_path / "mid.icc"), lut_type=iccdev.LutType.MCS)
        cmm.begin()
        theirs = cmm.apply_ndarray(np.hstack([pixels.XYZ, pixels.normals]).astype(np.float32))
    ours = pixels.run(compiled, np.float32)
    apart = np.any(abs(ours - theirs) > 2e-5, axis=-1)
    print(f"{method}, slope {slope_method}: {apart.sum()} of {PIXELS} pixels apart")
    assert apart.sum() <= (2 if method == "published" else 0)
    np.testing.assert_allclose(ours[~apart], theirs[~apart], rtol=0, atol=2e-5)
