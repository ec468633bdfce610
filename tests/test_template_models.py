"""The shipped models against the papers' equations, typed here as they are printed."""

import itertools

import numpy as np
import pytest

from iccbrdf.calc.compiler import compile_template
from iccbrdf.calc.interpreter import run
from iccbrdf.calc.lower import Settings, lower
from iccbrdf.calc.source import parse
from iccbrdf.resources import folder

MODELS = ("cook_torrance", "cook_torrance_2020", "ward")
PIXELS = 2000


def compiled(model, constants=None, **effects):
    path = folder("calc_templates") / f"{model}.calc"
    return compile_template(path.read_text("utf-8"), filename=path.name, constants=constants, effects=effects)


def unit(v):
    return v / np.sqrt(np.sum(v * v, axis=-1, keepdims=True))


def cosines(n, light, view):
    n, i, v = unit(n), unit(light), unit(view)
    h = unit(i + v)
    return n @ i, n @ v, n @ h, np.full(len(n), v @ h)


def rs(n, light, view, m, refractive_index=None, fresnel_angle="theta_i"):
    """F D G / (pi cos theta_i cos theta_v) as printed; F = 1 without a refractive index."""
    ci, cv, ch, ca = cosines(n, light, view)
    f = 1.0
    if refractive_index:
        r0 = ((1 - refractive_index) / (1 + refractive_index)) ** 2
        f = r0 + (1 - r0) * (1 - {"theta_i": ci, "alpha": ca}[fresnel_angle]) ** 5
    d = np.exp(-((np.tan(np.arccos(ch)) / m) ** 2)) / (m**2 * ch**4)
    g = np.minimum(1, np.minimum(2 * ch * ci / ca, 2 * ch * cv / ca))
    return f * d * g / (np.pi * ci * cv)


class Scene:
    """Random parameters and normals, one light and one view; no vector of unit length."""

    def __init__(self, seed, below=False):
        rng = np.random.default_rng(seed)
        self.kd, self.ks, self.m = rng.random((PIXELS, 3)), rng.random((PIXELS, 3)), rng.random((PIXELS, 3))
        self.m = 0.02 + 0.6 * self.m
        self.light = np.float32([*rng.normal(size=2), rng.uniform(0.4, 2)]).astype(float)
        self.view = np.float32([*rng.normal(size=2), rng.uniform(0.4, 2)]).astype(float)
        spread = 3 if below else 0.3
        self.n = np.stack([*rng.normal(0, spread, (2, PIXELS)), rng.uniform(0.5, 2, PIXELS)], axis=-1)
        if not below:
            ci, cv, _, _ = cosines(self.n, self.light, self.view)
            self.n[(ci < 0.1) | (cv < 0.1)] = unit(self.light) + unit(self.view)
        self.intensity, self.ambient = 2.5, 0.25

    def run(self, program, dtype=np.float64):
        channels = {f"kd.{c}": self.kd[:, k] for k, c in enumerate("XYZ")}
        channels |= {f"Rd.{c}": self.kd[:, k] for k, c in enumerate("XYZ")}
        channels |= {f"ks.{c}": self.ks[:, k] for k, c in enumerate("XYZ")}
        channels |= {f"m.{c}": self.m[:, k] for k, c in enumerate("XYZ")}
        channels |= {f"n.{c}": self.n[:, k] for k, c in enumerate("xyz")}
        channels |= {"ks": self.ks[:, 1], "m": self.m[:, 1]}
        env = {f"lit{c}": self.light[k] for k, c in enumerate("XYZ")}
        env |= {f"vue{c}": self.view[k] for k, c in enumerate("XYZ")}
        env |= {"litI": self.intensity, "ambI": self.ambient}
        outputs = run(program.program, [channels[name] for name in program.inputs], 3, env=env, dtype=dtype)
        return np.stack([np.broadcast_to(value, PIXELS) for value in outputs], axis=-1)

    def literal(self, model, n=None, **settings):
        """The model's equation; `settings` are those of `rs`."""
        n = self.n if n is None else np.broadcast_to(n, self.n.shape)
        ci, cv, ch, _ = (c[:, None] for c in cosines(n, self.light, self.view))
        m = self.m[:, 1]
        if model == "cook_torrance":
            settings = {"refractive_index": MATCHED_INDEX, **settings}
            gloss = rs(n, self.light, self.view, m, **settings)[:, None]
            return self.intensity * ci * (self.kd / np.pi + self.ks * gloss)
        if model == "brdf2":
            gloss = [rs(n, self.light, self.view, self.m[:, k], MATCHED_INDEX) for k in range(3)]
            return self.intensity * ci * (self.kd / np.pi + self.ks * np.stack(gloss, axis=-1))
        ks = self.ks[:, 1:2]
        if model == "cook_torrance_2020":
            gloss = rs(n, self.light, self.view, m)[:, None]
            direct = self.intensity * ci * (ks * gloss + (1 - ks) * self.kd)
            return self.ambient * self.kd + direct
        delta, m = np.arccos(ch), m[:, None]
        lobe = np.exp(-(np.tan(delta) ** 2) / m**2) / (4 * np.pi * m**2 * np.sqrt(ci * cv))
        return self.intensity * ci * (self.kd / np.pi + ks * lobe)


R0 = float(np.float32(0.04))
MATCHED_INDEX = (1 + np.sqrt(R0)) / (1 - np.sqrt(R0))
"""The refractive index whose R0 is what a program holds for 1.5: 0.04 as a float32."""


@pytest.mark.parametrize("model", [*MODELS, "brdf2"])
@pytest.mark.parametrize("seed", range(5))
def test_models_are_the_papers_equations(model, seed):
    scene = Scene(seed)
    program = compiled("cook_torrance", chromatic_roughness=True) if model == "brdf2" else compiled(model)
    expected = scene.literal(model)
    # The literal form loses digits in cos theta_h, not the program: 2e-16 / m^2.
    np.testing.assert_allclose(scene.run(program), expected, rtol=1e-11)
    np.testing.assert_allclose(scene.run(program, np.float32)[scene.m[:, 1] > 0.05], expected[
        scene.m[:, 1] > 0.05], rtol=2e-5 if model == "brdf2" else 1e-5)  # fmt: skip


@pytest.mark.parametrize("model", MODELS)
def test_below_the_horizon_of_light_or_viewer_everything_is_exactly_0(model):
    scene = Scene(11, below=True)
    scene.ambient = 0
    ci, cv, _, _ = cosines(scene.n, scene.light, scene.view)
    result = scene.run(compiled(model))
    dark = (ci <= 0) | (cv <= 0)
    assert 0.2 < dark.mean() < 0.8
    assert np.all(result[dark] == 0)
    assert np.all(result[~dark] > 0)
    assert np.all(np.isfinite(scene.run(compiled(model), np.float32)))


def test_ambient_light_stays_where_only_the_lamp_is_below_the_horizon():
    scene = Scene(12, below=True)
    ci, cv, _, _ = cosines(scene.n, scene.light, scene.view)
    result = scene.run(compiled("cook_torrance_2020"))
    unlit = (ci <= 0) & (cv > 0)
    assert 0.05 < unlit.mean() < 0.95
    np.testing.assert_allclose(result[unlit], scene.ambient * scene.kd[unlit], rtol=1e-15)
    assert np.all(result[cv <= 0] == 0)


def test_brdf1_takes_at_most_150_operators():
    # Every 8-byte operator counts, on the longest path: defaults of the environment, lit pixel.
    full = compiled("cook_torrance")
    switches = {name: on for name, on in full.effects.items() if name != "chromatic_roughness"}
    assert all(switches.values())
    assert full.executed <= 150
    assert full.inputs == ("kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m", "n.x", "n.y", "n.z")


def test_no_longer_than_they_were():
    # A rise is a worse compiler or a richer model: to be seen, not to be found out later.
    counts = {model: compiled(model).executed for model in MODELS}
    counts["brdf2"] = compiled("cook_torrance", chromatic_roughness=True).executed
    limits = {"cook_torrance": 142, "cook_torrance_2020": 139, "ward": 107, "brdf2": 147}
    assert all(counts[model] <= limits[model] for model in limits), counts


@pytest.mark.parametrize(
    ("model", "names", "gloss"),
    [
        ("cook_torrance", ("kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m"), (0, 0, 0)),
        ("cook_torrance_2020", ("Rd.X", "Rd.Y", "Rd.Z", "ks", "m"), (0,)),
        ("ward", ("Rd.X", "Rd.Y", "Rd.Z", "ks", "m"), (0,)),
    ],
)
def test_channels_and_the_default_print_a_flat_matte_perfect_diffuser(model, names, gloss):
    program = compiled(model)
    white = (0.9642, 1.0, 0.8249)
    assert program.inputs == (*names, "n.x", "n.y", "n.z")
    assert program.defaults == (*white, *gloss, 0.3, 0, 0, 1)
    assert program.outputs == ("X", "Y", "Z")
    outputs = run(program.program, program.defaults, 3, env={"litX": 0.0, "litZ": 1.0}, dtype=np.float64)
    np.testing.assert_allclose(np.array(outputs, float), white, rtol=1e-15)
    at_45 = run(program.program, program.defaults, 3, dtype=np.float64)
    np.testing.assert_allclose(np.array(at_45, float), np.array(white) * np.sqrt(0.5), rtol=1e-15)


@pytest.mark.parametrize("model", MODELS)
def test_every_combination_of_effects_is_a_model(model):
    path = folder("calc_templates") / f"{model}.calc"
    template = parse(path.read_text("utf-8"), path.name)
    effects = compiled(model).effects
    for switches in itertools.product((True, False), repeat=len(effects)):
        chosen = dict(zip(effects, switches, strict=True))
        lowered = lower([template], Settings(effects=chosen))
        assert lowered.effects == chosen
        assert lowered.outputs == ["X", "Y", "Z"]


@pytest.mark.parametrize("model", MODELS)
def test_leaving_out_an_effect_makes_a_shorter_program_that_runs(model):
    scene = Scene(3)
    full = compiled(model)
    for effect, on in full.effects.items():
        program = compiled(model, **{effect: not on})
        # One roughness or gloss for X, Y and Z saves a channel, but no operator; a limit costs some.
        shorter = program.executed < full.executed or effect.startswith(("chromatic", "highlight"))
        assert shorter, effect
        assert np.all(np.isfinite(scene.run(program)))


def test_effects_of_cook_torrance_leave_out_what_they_name():
    scene = Scene(5)
    diffuse = scene.run(compiled("cook_torrance", specular=False))
    ci, cv, ch, ca = (c[:, None] for c in cosines(scene.n, scene.light, scene.view))
    np.testing.assert_allclose(diffuse, scene.intensity * ci * scene.kd / np.pi, rtol=1e-13)

    gloss = scene.literal("cook_torrance") - diffuse
    f = R0 + (1 - R0) * (1 - ci) ** 5
    g = np.minimum(1, np.minimum(2 * ch * ci / ca, 2 * ch * cv / ca))
    assert g.min() < 0.9
    for effect, expected in (
        ("fresnel", diffuse + gloss / f),
        ("shadowing", diffuse + gloss / g),
        ("chromatic_specular", diffuse + gloss / scene.ks * scene.ks[:, 1:2]),
    ):
        result = scene.run(compiled("cook_torrance", **{effect: False}))
        np.testing.assert_allclose(result, expected, rtol=1e-10, err_msg=effect)
        assert np.max(abs(result - diffuse - gloss)) > 1e-3
    assert compiled("cook_torrance", chromatic_specular=False).inputs[3:5] == ("ks.Y", "m")


@pytest.mark.parametrize("model", MODELS)
def test_without_relief_the_print_is_flat(model):
    scene = Scene(6)
    program = compiled(model, relief=False)
    assert not {"n.x", "n.y", "n.z"} & set(program.inputs)
    np.testing.assert_allclose(scene.run(program), scene.literal(model, n=np.array([0.0, 0, 1])), rtol=1e-10)


@pytest.mark.parametrize("model", MODELS)
def test_without_the_horizon_test_lit_pixels_are_the_same(model):
    scene = Scene(7)
    np.testing.assert_array_equal(scene.run(compiled(model, below_horizon=False)), scene.run(compiled(model)))


def test_fresnel_angle_and_refractive_index_are_set_by_the_build():
    scene = Scene(8)
    program = compiled("cook_torrance", {"fresnel_angle": "alpha"})
    np.testing.assert_allclose(
        scene.run(program), scene.literal("cook_torrance", fresnel_angle="alpha"), rtol=1e-11
    )
    program = compiled("cook_torrance", {"refractive_index": 3})  # R0 = 1/4 is exact
    np.testing.assert_allclose(
        scene.run(program), scene.literal("cook_torrance", refractive_index=3), rtol=1e-11
    )


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("seed", range(4))
def test_no_finite_input_makes_a_result_that_is_not(model, seed):
    rng = np.random.default_rng(seed)
    program = compiled(model)

    def extreme(low, high, *shape):
        """Zeros, and both signs, from 10^low to 10^high."""
        return rng.choice([0.0, 1, 1, -1], shape) * 10 ** rng.uniform(low, high, shape)

    for _ in range(100):
        light, view = extreme(-15, 15, 3), extreme(-15, 15, 3)
        if rng.random() < 0.3:
            # Light and viewer nearly opposite, both just above the surface.
            view = -light * np.float32(1 + 1e-7) + extreme(-12, -5, 3)
        env = dict(zip(("litX", "litY", "litZ", "vueX", "vueY", "vueZ"), [*light, *view], strict=True))
        channels = []
        for name in program.inputs:
            low, high = (-15, 15) if name.startswith("n.") else (-6, 6) if name == "m" else (-6, 2)
            values = extreme(low, high, 64)
            channels.append(values if name.startswith("n.") else abs(values))
        for value in run(program.program, channels, 3, env=env):
            assert np.all(np.isfinite(value))
            assert np.all(value >= 0) or model == "cook_torrance_2020"


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("zero", ["lit", "vue", "n."])
def test_a_vector_without_a_direction_is_black(model, zero):
    program = compiled(model)
    env = {f"{zero}{c}": 0.0 for c in "XYZ"} if zero != "n." else {}
    channels = [0.0 if name.startswith(zero) else 0.5 for name in program.inputs]
    assert [float(value) for value in run(program.program, channels, 3, env=env)] == [0, 0, 0]


def test_roughness_is_held_where_the_lobe_is_still_a_number():
    # At the mirror direction D = 1/m^2: held at 1e-4, it is 1e8 for every smaller m.
    program = compiled("cook_torrance")
    channels = dict(zip(program.inputs, program.defaults, strict=True)) | {"ks.Y": 1.0}
    peaks = []
    for m in (1e-4, 1e-6, 0.0, -1.0):
        env = {"vueX": 1.0, "vueZ": 1.0, "litX": -1.0, "litZ": 1.0}
        peaks.append(float(run(program.program, list((channels | {"m": m}).values()), 3, env=env)[1]))
    assert len(set(peaks)) == 1
    cos45 = np.sqrt(0.5)
    f = 0.04 + 0.96 * (1 - cos45) ** 5
    assert peaks[0] == pytest.approx(cos45 + f * 1e8 / cos45, rel=1e-4)
