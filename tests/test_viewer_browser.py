"""Pages in a headless browser: the picture is the interpreter's, and the controls do what they say."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
from conftest import ROOT
from test_painting import CHANNELS, read_painting
from viewer_examples import Opened, headless_browser, open_page

import iccbrdf
from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.calc.graph import Graph
from iccbrdf.calc.operators import OPERATORS
from iccbrdf.calc.schedule import schedule
from iccbrdf.cmm import standard_XYZ
from iccbrdf.demo import landscape
from iccbrdf.icc.header import D50
from iccbrdf.images import Block, create_tiff, open_tiff
from iccbrdf.images.showing import Showing, display_profile, srgb
from iccbrdf.viewer import Print, make_display, make_page, read_print
from iccbrdf.viewer.glsl import function_body
from iccbrdf.viewer.image import NOT_FINITE, Layer
from iccbrdf.viewer.page import shader
from iccbrdf.viewer.programs import ARGUMENTS, RESULTS, Program

PROFILES = ROOT / "profiles"
CHAINS = {
    "demo": ("landscape/mid.icc", "landscape/mvis.icc"),
    "colours": ("fogra39_gloss/colour-mid.icc", "landscape/mvis.icc"),
    "tables": ("fogra39_gloss/table-mid.icc", "fogra39_gloss/mvis.icc"),
    "painting": ("ward_painting/mid.icc", "ward_painting/mvis.icc"),
}
STRIDE = 14
"""Of the pixels that are compared, both ways: they come from all over the image."""
LIGHT = {"litX": -0.6, "litY": 0.2, "litZ": 0.8, "vueX": 0.1, "vueY": -0.3, "vueZ": 0.9}


def scenes() -> list[dict[str, float]]:
    """Twenty lights and views: all around, grazing, in the mirror direction, opposite to each other."""
    angles = [((15 + 7 * k, 47 * k), (11 * k % 70, 130 * k)) for k in range(10)]
    angles += [((89.5, 20 * k), (88 - 9 * k, 200 - 35 * k)) for k in range(4)]
    angles += [((t, 90), (t, 270)) for t in (0, 40, 80)]
    vectors = [(direction(*light), direction(*view)) for light, view in angles]
    vectors.append((np.array([0.6, 0, 0.8]), np.array([-0.6, 0, -0.8])))
    vectors.append((np.array([1.0, 0, 0]), np.array([-1.0, 0, 0])))
    vectors.append((1e3 * direction(30, 45), 1e-3 * direction(60, 300)))
    return [dict(zip(LIGHT, map(float, np.concatenate(pair)), strict=True)) for pair in vectors]


@dataclass
class Case:
    """A page, and what it is compared with."""

    page: Opened
    shown: Print
    profiles: list[Path]

    def __post_init__(self) -> None:
        self.height, self.width = self.shown.size
        self.quantised = np.stack([layer.decoded() for layer in self.shown.layers], axis=-1)

    def expected(self, env: dict[str, float], quantised: np.ndarray | None = None) -> np.ndarray:
        """XYZ under D50 by the interpreter, what is no number as 0."""
        transform = iccbrdf.link(
            self.profiles, samples="real", channels=self.shown.chain.channels, env=env, backend="interpreter"
        )
        XYZ = transform(self.quantised if quantised is None else quantised)
        mvis = iccbrdf.read_profile(self.profiles[-1])
        return np.nan_to_num(standard_XYZ(mvis)(XYZ), posinf=1e6, neginf=-1e6)

    def measured(self, env: dict[str, float], without: tuple[str, ...] = ()) -> np.ndarray:
        return self.page.measure(env, self.width, self.height, without)

    def picture(self) -> np.ndarray:
        """What is to be seen on the screen."""
        self.page.run("proof.settled()")
        return imagecodecs.png_decode(self.page.tab.screenshot())[..., :3].astype(int)


def image_of(name: str, folder: Path, data: Path | None) -> Path:
    """A TIFF of some of the pixels, with ones in its first row that make trouble."""
    if name == "painting":
        pixels, names = read_painting(data / "painting"), CHANNELS
    else:
        scene = landscape(read_primaries(PROFILES / "landscape" / "primaries.json"))
        image = scene.brdf if name == "demo" else scene.xyz
        pixels, names = image.device, image.names
    samples = "device" if name == "tables" else "real"
    if name in ("demo", "colours"):
        matrix = iccbrdf.read_profile(PROFILES / CHAINS[name][0])["A2M0"].elements[0]
        pixels = pixels * np.diag(matrix.matrix) + matrix.offset
    pixels = pixels[::STRIDE, ::STRIDE].astype(np.float32)
    if samples == "real":
        normal = names.index("n.x")
        pixels[0, 0, :] = np.nan
        pixels[0, 1, 0] = np.nan
        pixels[0, 2, normal] = np.nan
        pixels[0, 3, normal:] = 0  # no direction at all
        pixels[0, 4, normal:] = 0, 0, -1
        pixels[0, 5, normal:] = 0.8, 0, 0.6
        pixels[0, 6, :normal] = 0
        pixels[0, 7, 1] = np.inf
    path = folder / f"{name}.tif"
    with create_tiff(path, *pixels.shape[:2], names, samples=samples, dtype="float32") as sink:
        sink.write(Block(0, 0, pixels))
    return path


@pytest.fixture(scope="module")
def browser():
    with headless_browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def cases(browser, tmp_path_factory):
    """Pages by name, made and opened when they are first asked for."""
    folder = tmp_path_factory.mktemp("pages")
    made: dict[str, Case] = {}

    def case(name: str, data: Path | None = None) -> Case:
        if name not in made:
            profiles = [PROFILES / profile for profile in CHAINS[name]]
            with open_tiff(image_of(name, folder, data)) as source:
                shown = read_print(source, [iccbrdf.read_profile(p) for p in profiles], source.names, {})
            path = folder / f"{name}.html"
            path.write_text(make_page(shown, make_display("srgb"), name), encoding="utf-8")
            # A small window, since the picture in it is not looked at, costs little.
            window = {"width": 900, "height": 600} if name == "demo" else {"width": 360, "height": 200}
            page = open_page(browser, path, viewport=window)
            made[name] = Case(page, shown, profiles[1 if shown.run_now else 0 :])
        return made[name]

    return case


@pytest.fixture
def demo(cases) -> Case:
    """The demo's page as it was when it was opened."""
    case = cases("demo")
    case.page.tab.set_viewport_size({"width": 900, "height": 600})
    case.page.tab.keyboard.press("r")
    return case


def differences(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """CIEDE2000; what is four times as bright as white or more counts as alike."""
    labs = [XYZ_to_Lab(np.clip(XYZ.astype(np.float64), 0, 4), D50) for XYZ in (found, expected)]
    return delta_E_CIE2000(*labs)


def check_picture(case: Case, envs: list[dict[str, float]], *, displayed: bool = True) -> None:
    """Before the display within 0.5 CIEDE2000 of the interpreter, and afterwards within a level of 255."""
    worst, furthest = 0.0, 0
    show = Showing(srgb())
    for env in envs:
        expected = case.expected(env)
        found = case.measured(env)
        assert np.isfinite(found).all()
        worst = max(worst, float(differences(found, expected).max()))
        if displayed:
            levels = case.page.levels(env, case.width, case.height)
            furthest = max(furthest, int(abs(np.rint(show(expected).device * 255) - levels).max()))
    assert worst < 0.5
    assert furthest <= 1
    assert case.page.faults == []


# The picture -------------------------------------------------------------------------------------------


def test_the_software_rasteriser_draws(demo):
    """What is compared here depends on no graphics card."""
    name = demo.page.run(
        "(() => { const { gl } = proof.renderer;"
        "return gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info').UNMASKED_RENDERER_WEBGL); })()"
    )
    assert "SwiftShader" in name


def test_the_demo_is_the_interpreters(cases):
    check_picture(cases("demo"), scenes())


def test_the_painting_is_the_interpreters(cases, shared_data):
    check_picture(cases("painting", shared_data), scenes())


def test_colours_and_normals_are_the_interpreters(cases):
    """The colour MID runs in the page, too."""
    assert cases("colours").shown.run_now is None
    # Compiling so long a program once more takes the software rasteriser seconds.
    check_picture(cases("colours"), scenes()[::4], displayed=False)


def test_a_mid_of_tables_is_run_when_the_page_is_made(cases):
    assert "curve" in cases("tables").shown.run_now
    check_picture(cases("tables"), scenes()[::5])


def test_soft_highlights_are_rolled_off(demo):
    env = {**LIGHT, "litI": 9.0}
    device = Showing(srgb(), highlights="roll-off")(demo.expected(env)).device
    levels = demo.page.levels(env, demo.width, demo.height, soft=True)
    assert abs(np.rint(device * 255) - levels).max() <= 1
    assert abs(levels.astype(int) - demo.page.levels(env, demo.width, demo.height)).max() > 10


def test_a_displays_profile_is_a_table(browser, tmp_path, shared_data):
    path = shared_data / "icc" / "DisplayP3.icm"
    profiles = [PROFILES / profile for profile in CHAINS["demo"]]
    with open_tiff(image_of("demo", tmp_path, None)) as source:
        shown = read_print(source, [iccbrdf.read_profile(p) for p in profiles], source.names, {})
    page = tmp_path / "p3.html"
    page.write_text(make_page(shown, make_display(str(path)), "P3"), encoding="utf-8")
    opened = open_page(browser, page, viewport={"width": 360, "height": 200})
    case = Case(opened, shown, profiles)
    levels = case.page.levels(LIGHT, case.width, case.height)
    expected = Showing(display_profile(path))(case.expected(LIGHT)).device * 255
    # The first row has colours that do not exist.
    error = abs(levels - expected)[1:]
    assert error.max() < 1.5
    assert np.quantile(error, 0.99) < 0.6
    assert case.page.faults == []
    case.page.tab.close()


# Effects -----------------------------------------------------------------------------------------------


def test_without_relief_the_print_is_flat(demo):
    flat = demo.quantised.copy()
    flat[..., -3:] = 0, 0, 1
    found = demo.measured(LIGHT, ("relief",))
    assert differences(found, demo.expected(LIGHT, flat)).max() < 0.01


def test_without_gloss_ks_is_0(demo):
    matt = demo.quantised.copy()
    matt[..., 3:6] = 0
    assert differences(demo.measured(LIGHT, ("gloss",)), demo.expected(LIGHT, matt)).max() < 0.01


def test_without_gloss_colour_ks_is_that_of_Y(demo):
    grey = demo.quantised.copy()
    grey[..., 3:6] = grey[..., 4:5]
    assert differences(demo.measured(LIGHT, ("gloss-colour",)), demo.expected(LIGHT, grey)).max() < 0.01


def test_without_colour_on_slopes_the_normal_only_shades(cases):
    case = cases("colours")
    flat = case.quantised.copy()
    flat[..., 3:] = 0, 0, 1
    names = case.shown.chain.channels
    to_brdf = iccbrdf.link(case.profiles[:1], samples="real", channels=names)
    multiplex = to_brdf(flat)
    multiplex[..., -3:] = case.quantised[..., 3:]
    seen = iccbrdf.link(case.profiles[1:], channels=to_brdf.channels_out, env=LIGHT)(multiplex)
    found = case.measured(LIGHT, ("slope-colour",))
    assert differences(found[1:], seen[1:]).max() < 0.01
    assert differences(found[1:], case.measured(LIGHT)[1:]).max() > 0.5


def test_switches_show_what_effects_cost(demo):
    costs = dict(
        demo.page.run(
            "[...document.querySelectorAll('#effects button')].map("
            "(b) => [b.dataset.effect, b.querySelector('small').textContent])"
        )
    )
    programs = demo.shown.programs
    whole = programs.whole.operations
    for effect in programs.effects:
        less = programs.programs[programs.of[(effect,)]].operations
        assert costs[effect] == f"{round(100 * (whole - less) / whole)} %"


# Functions ---------------------------------------------------------------------------------------------

FUNCTIONS = {
    "exp": (-20, 5), "ln": (-1, 20), "log": (-1, 20), "sin": (-40, 40), "cos": (-40, 40), "atan": (-30, 30),
    "asin": (-1, 1), "acos": (-1, 1), "tan": (-1.4, 1.4), "cbrt": (-30, 30), "rond": (-9, 9), "sign": (-2, 2),
    "flor": (-9, 9), "ceil": (-9, 9), "trnc": (-9, 9), "sqrt": (0, 9), "neg": (-2, 2), "abs": (-2, 2),
    "pow": (-1, 3), "atn2": (-3, 3), "mod": (-7, 7), "vmin": (-2, 2), "vmax": (-2, 2), "eq": (-1, 1),
}  # fmt: skip
"""Each with the range of its first argument; the second one is in -3..3."""
ALLOWED = {"exp": 3e-6, "ln": 1e-6, "log": 1e-6, "pow": 2e-5, "tan": 5e-6}
"""Relative error, from 1 down absolute: what GLSL's exp and log are good for.  All others: 1e-6."""


def spread(low: float, high: float, count: int, seed: int) -> Layer:
    """A channel of numbers from `low` to `high` that float32 holds exactly; the first ones are special."""
    scale = 2.0 ** np.ceil(np.log2((high - low) / 65534))
    zero = round(-low / scale)
    codes = np.random.default_rng(seed).integers(0, int((high - low) / scale), (1, count)) + zero
    codes += round(low / scale)
    codes[0, :4] = zero, zero + round(1 / scale), zero, NOT_FINITE
    codes[0, 4:8] = zero + round(1 / scale), zero, NOT_FINITE, zero
    return Layer("", codes.astype(np.uint16), zero, scale)


@pytest.fixture(scope="module")
def functions(browser, cases, tmp_path_factory):
    """The demo's page with arguments for all functions in the place of its image."""
    layers = [spread(*limits, count=600, seed=k) for k, limits in enumerate(FUNCTIONS.values())]
    layers.append(spread(-3, 3, count=600, seed=99))
    layers[-1].codes[0, :8] = np.roll(layers[-1].codes[0, :8], 2)
    shown = replace(cases("demo").shown, layers=layers)
    path = tmp_path_factory.mktemp("functions") / "page.html"
    path.write_text(make_page(shown, make_display("srgb"), ""), encoding="utf-8")
    return open_page(browser, path, viewport={"width": 360, "height": 200}), layers


@pytest.mark.parametrize("first", range(0, len(FUNCTIONS), 3))
def test_functions_are_the_interpreters(functions, first):
    """Of 0, 1 and NaN, and where there is no result, too."""
    page, layers = functions
    graph = Graph(dtype=np.float32)
    second = len(FUNCTIONS)
    outputs, expected = {}, {}
    for k, name in list(enumerate(FUNCTIONS))[first : first + 3]:
        operator = OPERATORS[name]
        count = operator.pops(0, 0)
        outputs[name] = graph.apply(name, *[graph.input(channel) for channel in (k, second)[:count]])
        values = [layers[channel].decoded()[0] for channel in (k, second)[:count]]
        with np.errstate(all="ignore"):
            expected[name] = np.nan_to_num(operator.function(*values), posinf=1e6, neginf=-1e6)
    graph.outputs = tuple(outputs.values())
    body = function_body(schedule(graph, len(layers)), RESULTS, ARGUMENTS, gaps=range(len(layers)))
    text = shader(Program(body, "", 0, "", {}), layers, make_display("srgb"))
    page.run("(text) => { proof.page.programs[0].shader = text; proof.renderer.programs.delete(0); }", text)
    found = page.measure({}, 600, 1)[0]
    for k, name in enumerate(outputs):
        wanted = np.clip(expected[name], -1e6, 1e6)
        error = abs(found[:, k] - wanted) / np.maximum(abs(wanted), 1)
        worst = int(error.argmax())
        assert error[worst] <= ALLOWED.get(name, 1e-6), (name, worst, found[worst, k], wanted[worst])


# The page ----------------------------------------------------------------------------------------------


def test_moving_the_light_changes_the_picture(demo):
    before = demo.picture()
    assert before[:, :550].std() > 20
    pad = demo.page.tab.locator("#light").bounding_box()
    middle = pad["x"] + pad["width"] / 2, pad["y"] + pad["height"] / 2
    demo.page.tab.mouse.move(*middle)
    demo.page.tab.mouse.down()
    demo.page.tab.mouse.move(middle[0] + pad["width"] * 0.3, middle[1])
    demo.page.tab.mouse.up()
    assert demo.page.tab.locator("#light-value").inner_text() == "41\u00b0 right"
    assert abs(demo.picture() - before)[:, :550].mean() > 10


def test_what_is_drawn_is_what_is_measured(demo):
    """Fitted into the window, left of the panel, the print's mean level is that of its pixels."""
    picture = demo.picture()
    levels = demo.page.levels({}, demo.width, demo.height)
    scale = max(demo.width / (596 * 0.94), demo.height / (600 * 0.94))
    height, width = round(demo.height / scale), round(demo.width / scale)
    top, left = (600 - height) // 2, (596 - width) // 2
    inside = picture[top + 4 : top + height - 4, left + 4 : left + width - 4]
    assert np.allclose(inside.mean(axis=(0, 1)), levels.mean(axis=(0, 1)), atol=3)
    assert (picture[300, 5] == 0x38).all()


@pytest.mark.parametrize(
    ("keys", "expected"), [("ArrowRight", "42\u00b0 left"), ("2", "74\u00b0 right"), ("5", "40\u00b0 top")]
)
def test_keys_move_the_light(demo, keys, expected):
    demo.page.tab.keyboard.press(keys)
    assert demo.page.tab.locator("#light-value").inner_text() == expected


def test_compared_with_the_flat_print(demo):
    demo.page.tab.keyboard.press("r")
    one = demo.picture()
    demo.page.tab.get_by_role("radio", name="Flat").click()
    both = demo.picture()
    assert demo.page.tab.locator("#half-right").inner_text() == "Flat"
    assert abs(both - one)[100:500, 60:280].mean() < 1
    assert abs(both - one)[100:500, 320:540].mean() > 5


def test_two_lights(demo):
    demo.page.tab.keyboard.press("c")
    assert demo.page.tab.locator("#light .knob").count() == 2
    halves = demo.page.run("[0, 1].map((k) => document.querySelectorAll('.half')[k].textContent)")
    assert halves == ["A", "B"]


def test_zoom_and_pan(demo):
    fitted = demo.page.tab.locator("#zoom-value").inner_text()
    demo.page.tab.keyboard.press("+")
    larger = demo.page.tab.locator("#zoom-value").inner_text()
    assert int(larger.split()[0]) == pytest.approx(1.5 * int(fitted.split()[0]), abs=2)
    before = demo.picture()
    demo.page.tab.mouse.move(300, 300)
    demo.page.tab.mouse.down()
    demo.page.tab.mouse.move(330, 300)
    demo.page.tab.mouse.up()
    demo.page.tab.mouse.move(800, 590)
    after = demo.picture()
    moved, same = after[100:500, 130:400], after[100:500, 100:370]
    assert abs(moved - before[100:500, 100:370]).mean() < abs(same - before[100:500, 100:370]).mean() / 2
    demo.page.tab.keyboard.press("0")
    assert demo.page.tab.locator("#zoom-value").inner_text() == fitted


def test_read_out(demo):
    """XYZ, Lab, slope and parameters of a pixel, as the interpreter has them."""
    row, column = 60, 50
    found = demo.page.run(
        "(a) => { const v = proof.pixel(proof.program(), a.env, a.column, a.row);"
        "return { ...v, parameters: Object.fromEntries(v.parameters) }; }",
        {"env": LIGHT, "row": row, "column": column},
    )
    pixel = demo.quantised[row, column].astype(np.float64)
    XYZ = demo.expected(LIGHT)[row, column]
    assert found["xyz"] == pytest.approx(XYZ, rel=1e-5)
    assert found["lab"] == pytest.approx(XYZ_to_Lab(XYZ, D50), abs=1e-3)
    assert found["parameters"]["kd"] == pytest.approx(pixel[:3])
    assert found["parameters"]["m"] == pytest.approx(pixel[6:7])
    normal = pixel[7:] / np.linalg.norm(pixel[7:])
    assert found["slope"]["angle"] == pytest.approx(np.degrees(np.arccos(normal[2])), abs=1e-3)
    demo.page.tab.mouse.move(300, 300)
    assert demo.page.tab.locator("#readout").inner_text().startswith("XYZ")


def test_auto_lamp_keeps_the_flat_print_as_it_is(demo):
    demo.page.tab.get_by_role("radio", name="Flat").click()
    demo.page.tab.get_by_role("switch", name="Auto lamp").click()
    demo.page.tab.locator("[data-effect=gloss]").click()
    demo.page.tab.keyboard.press("4")
    before = demo.picture()[100:500, 320:540]
    demo.page.tab.keyboard.press("1")
    assert abs(demo.picture()[100:500, 320:540] - before).max() <= 1


def test_the_picture_comes_back_after_a_lost_context(demo):
    before = demo.picture()
    demo.page.run(
        "(async () => { globalThis.lose = proof.renderer.gl.getExtension('WEBGL_lose_context');"
        "lose.loseContext(); await new Promise((r) => setTimeout(r, 100)); })()"
    )
    assert "interrupted" in demo.page.tab.locator("#message").inner_text()
    demo.page.run("(async () => { lose.restoreContext(); await new Promise((r) => setTimeout(r, 300)); })()")
    assert demo.page.tab.locator("#message").is_hidden()
    assert abs(demo.picture() - before).mean() < 1
    demo.page.faults.clear()


def test_a_browser_without_webgl_says_so(browser, cases, tmp_path):
    page = open_page_without_webgl(browser, cases("demo"), tmp_path)
    assert "needs WebGL 2" in page.locator("#message").inner_text()
    page.close()


def open_page_without_webgl(browser, case, tmp_path):
    path = tmp_path / "page.html"
    path.write_text(make_page(case.shown, make_display("srgb"), "none"), encoding="utf-8")
    tab = browser.new_page()
    tab.add_init_script("HTMLCanvasElement.prototype.getContext = () => null;")
    tab.goto(path.as_uri())
    tab.evaluate("proof.ready.catch(() => true)")
    return tab


def test_on_a_phone_all_is_within_reach(demo):
    demo.page.tab.set_viewport_size({"width": 390, "height": 844})
    demo.page.run("proof.settled()")
    assert demo.page.run("document.documentElement.scrollWidth") == 390
    for name in ("#picture", "#light", "#view", "#compare"):
        box = demo.page.tab.locator(name).bounding_box()
        assert box["width"] >= 100
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
        assert box["y"] + box["height"] <= 844


def test_nothing_is_amiss(demo):
    """No errors on the console and no requests, after all that."""
    assert demo.page.faults == []
