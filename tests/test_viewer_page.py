"""The viewer without a browser: image coding, graphs and their texts, the page, the command."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from conftest import ROOT
from proof_examples import PRIMARIES, bump, nodes, write_height, write_lab

import iccbrdf
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.build import build_pair
from iccbrdf.calc.graph import Graph
from iccbrdf.calc.schedule import schedule
from iccbrdf.errors import InputError, UnsupportedError, UsageError
from iccbrdf.images import Block, create_tiff, open_tiff
from iccbrdf.viewer import Start, make_display, make_page, read_folder, read_print
from iccbrdf.viewer.chain import defaults, digits_kept, graphs, whole_chain
from iccbrdf.viewer.cost import cost
from iccbrdf.viewer.glsl import FUNCTIONS, function_body, functions_for, literal
from iccbrdf.viewer.image import NOT_FINITE, layers, reduced
from iccbrdf.viewer.javascript import literal as js_literal
from iccbrdf.viewer.page import shader
from iccbrdf.viewer.programs import make_programs

PROFILES = ROOT / "profiles"
DEMO = [PROFILES / "landscape" / name for name in ("mid.icc", "mvis.icc")]
COLOURS = [PROFILES / "fogra39_gloss" / name for name in ("colour-mid.icc", "mvis.icc")]
NAMES = ("kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m", "n.x", "n.y", "n.z")


def write_image(path, pixels, names=NAMES, samples="device", dtype="float32"):
    with create_tiff(path, *pixels.shape[:2], names, samples=samples, dtype=dtype) as sink:
        sink.write(Block(0, 0, pixels.astype(np.float32)))
    return path


@pytest.fixture
def image(tmp_path):
    """A BRDF image of 6 x 5 pixels, device values."""
    return write_image(tmp_path / "brdf.tif", np.random.default_rng(1).random((6, 5, 10)))


def shown_of(image, profiles, **options):
    with open_tiff(image) as source:
        return read_print(source, [iccbrdf.read_profile(p) for p in profiles], source.names, {}, **options)


# The image ---------------------------------------------------------------------------------------------


def unpacked(text, height, width):
    """What the page does, in other words."""
    planes = np.frombuffer(gzip.decompress(base64.b64decode(text)), np.uint8).reshape(2, height, width)
    differences = planes[0].astype(np.uint16) + (planes[1].astype(np.uint16) << 8)
    return np.cumsum(differences, axis=1, dtype=np.uint16)


def test_codes_come_back_from_their_packing():
    samples = np.random.default_rng(0).normal(size=(7, 9, 2))
    for layer in layers(samples, ("a", "b")):
        assert (unpacked(layer.packed(), 7, 9) == layer.codes).all()


def test_samples_keep_sixteen_bits():
    samples = np.random.default_rng(0).uniform(-0.3, 1.7, (50, 60, 1)).astype(np.float32)
    (layer,) = layers(samples, "a")
    assert abs(layer.decoded() - samples[..., 0]).max() <= 0.51 * 2.0 / 65533


@pytest.mark.parametrize("samples", [[0.0, 0.5, -1.0], [5.0, 5.0, 5.0], [0.0, 0.0, 0.0], [-3.0, -2.0, 0.0]])
def test_0_and_the_ends_are_exact(samples):
    (layer,) = layers(np.array(samples).reshape(1, 3, 1), "a")
    assert layer.decoded()[0] == pytest.approx(samples, rel=2e-5)
    assert (layer.decoded()[0][np.array(samples) == 0] == 0).all()


def test_what_is_not_finite_has_a_code_of_its_own():
    (layer,) = layers(np.array([[[0.5], [np.nan], [np.inf], [1.0]]]), "a")
    assert (layer.codes[0] == NOT_FINITE).tolist() == [False, True, True, False]
    assert layer.has_gaps
    assert np.isnan(layer.decoded()[0, 1:3]).all()


def test_a_channel_without_numbers():
    (layer,) = layers(np.full((2, 2, 1), np.nan), "a")
    assert (layer.codes == NOT_FINITE).all()


@pytest.mark.parametrize(
    ("most", "divisor", "size"),
    [(35, 1, (7, 5)), (34, 2, (4, 3)), (6, 3, (3, 2)), (5, 4, (2, 2)), (1, 7, (1, 1))],
)
def test_large_images_become_means(tmp_path, most, divisor, size):
    pixels = np.random.default_rng(3).random((7, 5, 10)).astype(np.float32)
    with open_tiff(write_image(tmp_path / "a.tif", pixels)) as source:
        small, found = reduced(source, lambda block: block, 10, most)
    assert (found, small.shape[:2]) == (divisor, size)
    for y, x in np.ndindex(size):
        cell = pixels[y * divisor : (y + 1) * divisor, x * divisor : (x + 1) * divisor]
        assert small[y, x] == pytest.approx(cell.reshape(-1, 10).mean(axis=0), rel=1e-6)


def test_means_leave_out_what_is_not_finite(tmp_path):
    pixels = np.ones((4, 4, 10), np.float32)
    pixels[0, 0] = np.nan
    pixels[2:, 2:] = np.inf
    with open_tiff(write_image(tmp_path / "a.tif", pixels)) as source:
        small, _ = reduced(source, lambda block: block, 10, 4)
    assert (small[0] == 1).all()
    assert np.isnan(small[1, 1]).all()


# Graphs and their texts --------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [0.1, -2.5, 1e-38, 3.4e38, -0.0, 16777217.0, np.pi])
def test_a_literal_is_the_number_to_the_bit(value):
    for text in (literal(value), js_literal(float(np.float32(value)))):
        number = np.float32(float(text.strip("()")))
        assert number.tobytes() == np.float32(value).tobytes()


def test_literals_of_what_is_not_finite_are_bits():
    assert literal(np.inf) == "uintBitsToFloat(0x7f800000u)"
    assert js_literal(-np.inf) == "(-Infinity)"


def body_of(graph, **options):
    return function_body(schedule(graph, 2), ["result"] * len(graph.outputs), "u", **options)


def test_what_glsl_cannot_say_is_named():
    graph = Graph(dtype=np.float32)
    graph.outputs = (graph.add("curve", [graph.input(0)], detail="any"),)
    with pytest.raises(UnsupportedError, match="'curve' cannot be written in GLSL"):
        body_of(graph)


def test_a_condition_is_a_boolean_and_a_select_takes_a_side():
    graph = Graph(dtype=np.float32)
    a, b = graph.input(0), graph.input(1)
    graph.outputs = (graph.add("select", [graph.apply("lt", a, b), a, b]),)
    body = body_of(graph)
    assert "bool v2 = v0 < v1;" in body
    assert "(v2 ? v0 : v1)" in body


def test_nan_is_followed_where_there_are_gaps_alone():
    graph = Graph(dtype=np.float32)
    a, b = graph.input(0), graph.input(1)
    graph.outputs = (graph.apply("mul", a, a), graph.apply("mul", b, b))
    assert "isGap" not in body_of(graph)
    body = body_of(graph, gaps=[1])
    assert "isGap(1, at)" in body
    assert "isGap(0, at)" not in body
    assert "result = n3 ? 0.0 : v3;" in body


def test_a_minimum_where_nan_may_be_has_one_condition():
    """Shaders with conditions in conditions took drivers ten times as long to compile."""
    graph = Graph(dtype=np.float32)
    a, b = graph.input(0), graph.input(1)
    graph.outputs = (graph.apply("vmin", a, b), graph.apply("vmax", b, a))
    body = body_of(graph, gaps=[0, 1])
    assert body.count("?") == 4  # two of them where the outputs are assigned
    assert "(!(n0 || n1) && v0 < v1 ? v0 : v1)" in body
    assert "(!(n1 || n0) && v1 > v0 ? v1 : v0)" in body


def test_digits_that_nobody_sees_are_not_cut_off():
    primaries = read_primaries(PROFILES / "landscape" / "primaries.json")
    plain, exact = (build_pair(primaries, geometry=geometry) for geometry in ("plain", "exact"))
    counts = []
    for pair in (plain, exact):
        chain = whole_chain([pair.mid, pair.mvis], None, "device", {})
        counts.append(sum(make_programs(chain).whole.nodes.values()))
        assert "3.072e+03" not in make_programs(chain).whole.body
    assert counts[0] < counts[1] < 1.5 * counts[0]
    graph = Graph(dtype=np.float32)
    x = graph.input(0)
    cut = {c: graph.apply("sub", graph.apply("add", x, graph.const(c)), graph.const(c)) for c in (3.0, 2**23)}
    assert digits_kept(graph, cut[3.0]) is x
    assert digits_kept(graph, cut[2**23]) is None  # that is how programs round to whole numbers


def test_functions_come_with_those_that_they_call():
    text = functions_for("float v = sine(a);")
    assert text.index("float wave(") < text.index("float sine(")
    assert "angle(" not in text
    for name, definition in FUNCTIONS.items():
        assert f" {name}(" in definition


def chain_of(profiles, names=None, samples="device"):
    return whole_chain([iccbrdf.read_profile(path) for path in profiles], names, samples, {})


def test_effects_make_shorter_programs():
    programs = make_programs(chain_of(COLOURS))
    assert programs.effects == ("relief", "gloss", "gloss-colour", "slope-colour")
    whole = programs.whole.operations
    for effect in programs.effects:
        assert programs.programs[programs.of[effect,]].operations < whole
    # On a flat print no colour depends on the slope.
    assert programs.of[("relief",)] == programs.of[("relief", "slope-colour")]


def test_effects_that_a_print_does_not_have_are_not_offered():
    ward = [PROFILES / "ward_painting" / name for name in ("mid.icc", "mvis.icc")]
    assert make_programs(chain_of(ward)).effects == ("relief", "gloss")


def test_defaults_are_those_of_the_program():
    found = defaults(graphs(chain_of(DEMO)).display)
    assert found["litI"] == pytest.approx(np.pi)
    assert (found["litX"], found["litZ"]) == pytest.approx((-np.sqrt(0.5), np.sqrt(0.5)))
    assert found["vueZ"] == 1


def test_device_values_are_decoded_before_the_page(image):
    chain = chain_of(DEMO)
    mid = iccbrdf.link(DEMO[:1])
    with open_tiff(image) as source:
        (block,) = source.blocks()
    assert chain.convert(block.data) == pytest.approx(mid(block.data), rel=1e-6, abs=1e-6)


def test_channels_that_a_reduced_mid_does_not_take():
    pair = build_pair(read_primaries(PRIMARIES), without=["specular"], device=NAMES)
    chain = whole_chain([pair.mid, pair.mvis], None, "device", {})
    pixels = np.random.default_rng(1).random((20, 10)).astype(np.float32)
    real = iccbrdf.link([pair.mid, pair.mvis], samples="real", channels=NAMES)
    device = iccbrdf.link([pair.mid, pair.mvis], channels=NAMES)
    assert real(chain.convert(pixels)) == pytest.approx(device(pixels), rel=1e-6)


def test_a_mid_with_tables_is_run_now(tmp_path):
    profiles = [PROFILES / "fogra39_gloss" / name for name in ("table-mid.icc", "mvis.icc")]
    pixels = np.full((2, 3, 6), 0.4)
    path = write_image(tmp_path / "xyz.tif", pixels, ("X", "Y", "Z", "n.x", "n.y", "n.z"))
    shown = shown_of(path, profiles)
    assert shown.chain.channels == NAMES
    assert "curve" in shown.run_now
    assert shown_of(path, COLOURS).run_now is None


def test_profiles_that_know_no_light_are_refused(tmp_path):
    path = write_image(tmp_path / "brdf.tif", np.zeros((2, 2, 10)))
    with pytest.raises((InputError, UsageError), match=r"light|XYZ"):
        shown_of(path, DEMO[:1])


# The page ----------------------------------------------------------------------------------------------


def test_the_shader_leaves_no_precision_to_the_device(image):
    """Phones compute in 16 bits where they may; a desktop would not show it."""
    shown = shown_of(image, DEMO)
    for display in (make_display("srgb"), make_display("display-p3")):
        for program in shown.programs.programs:
            text = shader(program, shown.layers, display)
            assert not re.search(r"\b(lowp|mediump)\b", text)
            for kind in ("float", "int", "usampler2DArray", "sampler3D"):
                assert f"precision highp {kind};" in text
            for line in re.findall(r"^\s*(?:uniform|out|in) .*$", text, re.MULTILINE):
                assert " highp " in line or " int " in line or " bool " in line, line
            assert not re.search(r"\b[A-Z]{4,}\b", re.sub(r"//.*|\b(SCALE|ZERO)\b", "", text))


class Parts(HTMLParser):
    """The scripts, styles and meta elements of a page, and what it refers to."""

    def __init__(self, text):
        super().__init__()
        self.inside, self.texts, self.policy, self.links = None, {}, None, []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.inside = (tag, attributes.get("type")) if tag in ("script", "style") else None
        if attributes.get("http-equiv") == "Content-Security-Policy":
            self.policy = attributes["content"]
        self.links += [v for k, v in attrs if k in ("src", "href")]

    def handle_data(self, data):
        if self.inside:
            self.texts[self.inside] = self.texts.get(self.inside, "") + data

    def handle_endtag(self, tag):
        self.inside = None


@pytest.fixture
def page(image):
    return make_page(shown_of(image, DEMO), make_display("srgb"), "A </title> & <b>print</b>")


def test_a_page_runs_its_own_script_alone(page):
    parts = Parts(page)
    assert parts.policy.startswith("default-src 'none';")
    for kind in (("script", "module"), ("style", None)):
        digest = base64.b64encode(hashlib.sha256(parts.texts[kind].encode()).digest()).decode()
        assert f"'sha256-{digest}'" in parts.policy
    assert "unsafe" not in parts.policy
    assert parts.links == ["data:,"]
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "")
    assert "https://" not in page


def test_a_title_stays_text(page):
    assert "<b>print</b>" not in page
    assert json.loads(Parts(page).texts["script", "application/json"])["title"] == "A </title> & <b>print</b>"


def test_a_page_starts_as_it_is_told(image):
    start = Start(auto_lamp=True, soft_highlights=True, exposure=2.0)
    page = make_page(shown_of(image, DEMO), make_display("srgb"), "a", start)
    values = json.loads(Parts(page).texts["script", "application/json"])
    assert values["start"] == {"auto": True, "soft": True, "exposure": 1.0}


def test_the_same_print_gives_the_same_page(image, page):
    assert make_page(shown_of(image, DEMO), make_display("srgb"), "A </title> & <b>print</b>") == page


def test_the_cost_is_counted(image):
    shown = shown_of(image, DEMO)
    display = make_display("srgb")
    found = cost(shown, display)
    laptop = found["laptop_1080p"]
    each = found["operations_a_pixel"] + found["operations_of_the_display"]
    assert laptop["operations_a_frame"] == 1920 * 1080 * each
    assert found["operations_without"]["gloss"] < found["operations_a_pixel"]
    assert found["nodes_a_pixel"]["exp"] == 1
    assert laptop["frames_a_second"] > 60


# The command -------------------------------------------------------------------------------------------


def test_view(run, image, tmp_path):
    page = tmp_path / "proof.html"
    result = run("view", image, "-p", DEMO[0], "-p", DEMO[1], "-o", page, "--light", "60,180", "--json")
    assert result.code == 0, result.err
    assert result.json["schema"] == "iccbrdf.view/1"
    assert result.json["bytes"] == page.stat().st_size
    assert result.json["divisor"] == 1
    values = json.loads(Parts(page.read_text(encoding="utf-8")).texts["script", "application/json"])
    assert values["light"] == pytest.approx([-np.sin(np.pi / 3), 0, 0.5])
    assert (values["title"], values["size"]) == ("brdf", "5 × 6 pixels")


def test_view_makes_large_images_smaller_and_says_so(run, image, tmp_path):
    page = tmp_path / "proof.html"
    result = run("view", image, "-p", DEMO[0], "-p", DEMO[1], "-o", page, "--max-pixels", "10")
    assert "3 x 3 pixels, each the mean of 2 x 2" in result.out
    assert "shown at 1 : 2" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([], 2, "say by which profiles"),
        (["-p", DEMO[0], "-p", DEMO[1], "--display", "srbg"], 3, "srgb"),
        (["-p", DEMO[0]], 2, "gives XYZ or Lab"),
        (["-p", DEMO[0], "-p", DEMO[1], "--env", "litQ=1"], 2, "litQ"),
        (["-p", DEMO[0], "-p", DEMO[1], "--max-pixels", "4000001"], 2, "max-pixels"),
    ],
)
def test_view_refuses(run, image, tmp_path, arguments, code, message):
    page = tmp_path / "proof.html"
    result = run("view", image, "-o", page, *arguments)
    assert result.code == code
    assert message in result.err
    assert not page.exists()


def test_view_overwrites_nothing_unless_asked(run, image, tmp_path):
    page = tmp_path / "proof.html"
    page.write_text("mine")
    arguments = ("view", image, "-p", DEMO[0], "-p", DEMO[1], "-o", page)
    assert run(*arguments).code == 2
    assert page.read_text() == "mine"
    assert run(*arguments, "--force").code == 0


@pytest.fixture
def proof_folder(run, tmp_path):
    """What `iccbrdf proof` makes of a small job."""
    write_lab(tmp_path / "job.tif", np.resize(nodes(), (8, 9, 3)))
    relief = write_height(tmp_path / "relief.png", bump(8, 9))
    result = run(
        "proof", tmp_path / "job.tif", "--primaries", PRIMARIES, "--height", tmp_path / "relief.png",
        "--relief", f"{relief}mm", "--pixel-pitch", "1mm", "--light", "60,90", "--reference-white", "flat",
        "--highlights", "roll-off", "--keep", "flat", "-o", tmp_path / "out",
    )  # fmt: skip
    assert result.code == 0, result.err
    return tmp_path / "out"


def test_a_folder_of_a_proof_says_how_it_is_seen(run, proof_folder, tmp_path):
    page = tmp_path / "proof.html"
    result = run("view", proof_folder, "-o", page, "--json")
    assert result.code == 0, result.err
    assert result.json["channels"] == ["X", "Y", "Z", "n.x", "n.y", "n.z"]
    values = json.loads(Parts(page.read_text(encoding="utf-8")).texts["script", "application/json"])
    assert values["title"] == "job"
    assert values["light"] == pytest.approx([0, np.sin(np.pi / 3), 0.5], abs=1e-6)
    assert values["start"] == {"auto": True, "soft": True, "exposure": 0.0}
    assert values["intensity"] == pytest.approx(np.pi)


def test_a_folder_without_a_kept_image_says_what_to_do(proof_folder):
    (proof_folder / "flat.tif").unlink()
    with pytest.raises(InputError, match="--keep flat"):
        read_folder(proof_folder)


def test_a_folder_that_is_no_proof(tmp_path):
    with pytest.raises(InputError, match=r"proof\.json: cannot be read"):
        read_folder(tmp_path)
    (tmp_path / "proof.json").write_text('{"job": 1}')
    with pytest.raises(InputError, match="is not the log of a proof"):
        read_folder(tmp_path)
