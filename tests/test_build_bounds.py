"""Bounds hold: of each effect on random intervals, and of whole plans on scenes of all kinds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_examples import (
    ImageInMemory,
    environment,
    names_of,
    painting,
    random_directions,
    recipe_of,
    scenes,
    single,
)

import iccbrdf
from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.geometry import direction, unit
from iccbrdf.brdf.models import MODELS, NORMAL
from iccbrdf.build.bounds import (
    CHROMATIC_WEIGHT,
    GROUP,
    Parameters,
    Terms,
    change_of_ways,
    changes_of_effects,
    columns,
    differences,
    geometry,
)
from iccbrdf.build.effects import EFFECTS, MVIS, model_effects
from iccbrdf.build.spans import Directions, Span
from iccbrdf.planning import Planning

SCENES = ("flat matte", "flat glossy", "relief matte", "relief glossy", "relief in XYZ", "painting")
WHITE = (0.9642, 1.0, 0.8249)


@pytest.fixture(scope="module")
def scene(request):
    if request.param == "painting":
        return painting(request.getfixturevalue("shared_data") / "painting")
    return scenes()[request.param]


class Proofs:
    """The XYZ of an image by the effects that are left out, each chain linked once."""

    def __init__(self, recipe, image):
        self.image, self.planning = image, Planning(image, recipe)
        self._linked = {}

    def __call__(self, without, env):
        if without not in self._linked:
            chain = self.planning.built(without).chain
            options = {"channels": self.image.names, "samples": self.image.samples, "backend": "numpy"}
            self._linked[without] = iccbrdf.link(chain, **options)
        transform = self._linked[without]
        known = {name: value for name, value in env.items() if name in transform.variables}
        return transform.with_env(known)(self.image.data).astype(np.float64)


@pytest.fixture(scope="module")
def made():
    """Proofs by the name of their scene, kept for all that is asked of it."""
    return {}


@pytest.fixture
def proofs(name, scene, made):
    """Of one scene."""
    if name not in made:
        made[name] = Proofs(*scene)
    return made[name]


def dE(one, other, white=WHITE):
    return delta_E_CIE2000(XYZ_to_Lab(one, white), XYZ_to_Lab(other, white))


# Whole plans ---------------------------------------------------------------------------------------------


def lights_and_views(name, seed):
    """Random lights, each with a view: 200, or fewer where each takes long."""
    count = 20 if name == "relief in XYZ" else 200
    return zip(random_directions(count, seed), random_directions(count, seed + 1, 75), strict=True)


def several(vectors):
    return Directions.single(vectors, [str(i) for i in range(len(vectors))])


EACH_SCENE = pytest.mark.parametrize(
    ("name", "scene"), [(name, name) for name in SCENES], indirect=["scene"], ids=SCENES
)

# What 200 random lights let some of them do without; relief is of no use to the flat ones.
SPARED = {
    "flat matte": {"specular", "relief", "below-horizon"},
    "flat glossy": {"specular", "relief", "shadowing", "below-horizon"},
    "relief matte": {"specular", "below-horizon"},
    "relief glossy": {"below-horizon"},
    "relief in XYZ": {"below-horizon"},
    "painting": {"below-horizon"},
}


@EACH_SCENE
def test_without_tolerance_the_reduced_proof_is_the_full_one(name, proofs):
    spared = set()
    for light, view in lights_and_views(name, 1):
        decision = proofs.planning.plan(single(light), single(view)).decision
        assert (decision.bound, decision.exact) == (0, True)
        spared |= set(decision.without)
        env = environment(light, view)
        np.testing.assert_allclose(proofs(decision.without, env), proofs((), env), rtol=2e-6, atol=1e-30)
    assert spared >= SPARED[name]


@EACH_SCENE
def test_within_a_tolerance_the_loss_is_within_the_promised_bound(name, scene, proofs):
    recipe, _ = scene
    for light, view in lights_and_views(name, 3):
        decision = proofs.planning.plan(single(light), single(view), tolerance=0.5).decision
        assert decision.bound <= 0.5
        env = environment(light, view)
        lost = dE(proofs((), env), proofs(decision.without, env), recipe.primaries.white).max()
        assert lost <= decision.bound + 1e-4


def test_a_tolerance_spares_what_no_tolerance_does_not():
    recipe, image = scenes()["flat glossy"]
    planning = Planning(image, recipe)
    light = Directions.single([direction(50, 180)], ["50,180"])
    none, some = (planning.plan(light, single((0, 0, 1)), tolerance=t) for t in (0, 3))
    assert "chromatic-specular" not in none.decision.without
    assert "chromatic-specular" in some.decision.without
    finding = next(f for f in none.findings if f.effect == "chromatic-specular")
    assert (finding.called_for, finding.light) == (True, "50,180")
    # Where it says so, the effect is seen.
    proofs, env = Proofs(recipe, image), environment(direction(50, 180), (0, 0, 1))
    lost = dE(proofs((), env), proofs(("chromatic-specular",), env))
    assert 0.01 < lost[finding.place] <= finding.bound
    assert lost.max() <= some.decision.bound <= 3


@pytest.mark.parametrize("name", ["flat glossy", "relief matte", "relief glossy"])
def test_a_range_of_lights_is_planned_for_as_a_whole(name):
    recipe, image = scenes()[name]
    proofs = Proofs(recipe, image)
    view = (0, 0, 1)
    decision = proofs.planning.plan(Directions.between((10, 0), (25, 360)), single(view)).decision
    assert "below-horizon" in decision.without
    rng = np.random.default_rng(5)
    for light in direction(rng.uniform(10, 25, 40), rng.uniform(0, 360, 40)):
        env = environment(light, view)
        np.testing.assert_allclose(proofs(decision.without, env), proofs((), env), rtol=2e-6, atol=1e-30)


@cache
def planning_of(model):
    """Of images with real samples, to be set as its `source`; under ambient light where the model has it."""
    recipe = recipe_of(model)
    if model == "cook_torrance_2020":
        recipe = replace(recipe, variables={"ambI": 0.25})
    return Planning(ImageInMemory(np.zeros((1, 1, len(names_of(model)))), names_of(model), "real"), recipe)


# Single effects --------------------------------------------------------------------------------------------


def random_box(model, seed):
    """Pixels (1, 40, channels) that are alike, from a thousandth to a fifth apart."""
    rng = np.random.default_rng(seed)
    names = names_of(model)
    width = 10.0 ** rng.uniform(-3, -0.7)
    centre = np.array([rng.uniform(0, 0.6) if name[0] == "m" else rng.uniform() for name in names])
    centre[-3:] = unit([*rng.normal(0, 0.3, 2), 0.8])
    pixels = centre + rng.uniform(-width, width, (1, 40, len(names)))
    pixels[..., :-3] = np.maximum(pixels[..., :-3], 0.001)
    return pixels


@cache
def exact_link(model, without):
    chain = planning_of(model).built(without).chain
    return iccbrdf.link(
        chain, channels=names_of(model), samples="real", dtype=np.float64, backend="interpreter"
    )


def exact_XYZ(model, without, pixels, light, view):
    transform = exact_link(model, tuple(without))
    env = {**environment(light, view)}
    return transform.with_env({name: env[name] for name in env if name in transform.variables})(pixels)


def weighted(one, other):
    """The norm of the module, which CIEDE2000 is not above."""
    dL, da, db = np.moveaxis(XYZ_to_Lab(one, WHITE) - XYZ_to_Lab(other, WHITE), -1, 0)
    return np.sqrt(dL**2 + CHROMATIC_WEIGHT * (da**2 + db**2))


def hull(values):
    flat = values.reshape(len(values), -1)
    return Span(flat.min(axis=1, keepdims=True), flat.max(axis=1, keepdims=True))


def spans(vectors):
    return hull(np.moveaxis(vectors, -1, 0))


def bounds_of(model, pixels, lights, view, effects):
    """What the module says of the hull of some pixels and lights, by effect."""
    reflection = planning_of(model).recipe.reflection({})
    channels = dict(zip(names_of(model), np.moveaxis(pixels, -1, 0), strict=True))
    values = columns(reflection, lambda names: np.array([channels[name] for name in names]))
    normal = spans(unit(pixels[..., -3:]))
    light, eye, to_z = spans(lights), spans(view), spans(np.array([0.0, 0.0, 1.0]))
    with np.errstate(all="ignore"):
        terms = Terms(reflection, Parameters(values, hull), geometry(normal, light, eye))
        flat = Terms(reflection, terms.given, geometry(to_z, light, eye))
        off = Parameters(differences(values, values), hull)
        found = changes_of_effects(terms, [effect for effect in effects if effect != "relief"])
        found["relief"] = change_of_ways(terms, flat, off, normal - to_z, light)
        return {name: float(np.max(change.dE)) for name, change in found.items()}


@pytest.mark.parametrize("model", sorted(MODELS))
def test_each_step_is_bounded_over_boxes_of_pixels_and_lights(model):
    effects = [name for name in model_effects(model) if EFFECTS[name].program == MVIS]
    order = [name for name in GROUP if name in effects]
    steps = {name: ((), (name,)) for name in effects}
    steps |= {name: (tuple(order[:i]), tuple(order[: i + 1])) for i, name in enumerate(order)}
    telling = 0
    for seed in range(25):
        pixels = random_box(model, seed)
        view = random_directions(1, 900 + seed, 70)[0]
        jitter = np.random.default_rng(seed).normal(0, 0.02, (2, 3))
        lights = unit(random_directions(1, 500 + seed, 80)[0] + jitter)
        for name, bound in bounds_of(model, pixels, lights, view, effects).items():
            with np.errstate(all="ignore"):
                changes = [
                    weighted(*(exact_XYZ(model, without, pixels, light, view) for without in steps[name]))
                    for light in lights
                ]
            worst = np.max(np.where(np.isnan(changes), np.inf, changes))
            assert worst <= bound + 1e-5, (name, seed, worst, bound)
            telling += 0 < bound < 3 * worst + 0.1
    # Bounds that hold because they say nothing would hold, too.
    assert telling >= 10, telling


def test_the_norm_is_not_below_CIEDE2000():
    rng = np.random.default_rng(8)
    one = rng.uniform((0, -100, -100), (100, 100, 100), (200_000, 3))
    one[::2, 1:] *= 0.05
    # The blue region, where the rotation term is large.
    one[::5] = rng.uniform((20, 0, -60), (60, 30, -20), (40_000, 3))
    other = one + rng.normal(0, 1, one.shape) * 10 ** rng.uniform(-3, 1.3, (len(one), 1))
    dL, da, db = (one - other).T
    norm = np.sqrt(dL**2 + CHROMATIC_WEIGHT * (da**2 + db**2))
    ratio = delta_E_CIE2000(one, other) / norm
    assert 0.75 < ratio.max() <= 1


# Attempts to break them ------------------------------------------------------------------------------------

CHANNEL = st.one_of(st.sampled_from([0.0, 1.0, 1e-6]), st.floats(0, 1, width=32))
NORMALS = st.one_of(
    st.just((0.0, 0.0, 1.0)),
    st.sampled_from([(1.0, 0.0, 0.0), (0.0, -1.0, 1e-7), (0.6, 0.0, -0.8), (0.0, 0.0, 0.0), (3.0, 4.0, 0.1)]),
    st.tuples(*[st.floats(-1, 1, width=32)] * 3),
)
ANGLES = st.one_of(st.floats(0, 60), st.floats(85, 90))
MODEL = st.sampled_from(sorted(MODELS))


@st.composite
def pixel(draw, model):
    """Parameters and a normal, some of them as bad as may be."""
    values = [draw(CHANNEL) for _ in MODELS[model].channels]
    for i, name in enumerate(MODELS[model].channels):
        if name.startswith("m"):
            values[i] = draw(
                st.one_of(st.sampled_from([0.0, 1e-4, 2e-3, 1.0]), st.floats(2**-6, 1, width=32))
            )
    return (*values, *draw(NORMALS))


@st.composite
def hostile(draw):
    """A matte flat image of one colour with a few pixels in it that are not."""
    model = draw(MODEL)
    names = names_of(model)
    base = dict.fromkeys(names, draw(st.floats(2**-10, 1, width=32))) | dict(
        zip(NORMAL, (0, 0, 1), strict=True)
    )
    base |= {name: draw(st.sampled_from([0.0, 1e-4])) for name in names if name.startswith("ks")}
    base |= {name: 0.3 for name in names if name.startswith("m")}
    data = np.tile(np.float32([base[name] for name in names]), (9, 9, 1))
    for _ in range(draw(st.integers(0, 3))):
        data[draw(st.integers(0, 8)), draw(st.integers(0, 8))] = draw(pixel(model))
    return model, ImageInMemory(data, names, "real")


@cache
def linked(model, without):
    built = Planning(
        ImageInMemory(np.zeros((1, 1, len(names_of(model)))), names_of(model), "real"), recipe_of(model)
    )
    return iccbrdf.link(built.built(without).chain, channels=names_of(model), samples="real", backend="numpy")


@settings(max_examples=100, deadline=None)
@given(
    hostile(), ANGLES, st.floats(0, 360), ANGLES, st.floats(0, 360), st.sampled_from([0.0, 0.05, 0.5, 5.0])
)
def test_hostile_scenes_do_not_break_the_bound(scene, zenith, azimuth, zenith_v, azimuth_v, tolerance):
    model, image = scene
    light, view = direction(zenith, azimuth), direction(zenith_v, azimuth_v)
    planning = planning_of(model)
    planning.source = image
    planning.__dict__.pop("_places", None)
    decision = planning.plan(single(light), single(view), tolerance=tolerance).decision
    env = environment(light, view)

    def XYZ(without):
        transform = linked(model, without)
        known = {name: env[name] for name in env if name in transform.variables}
        return transform.with_env(known)(image.data).astype(float)

    full, reduced = XYZ(()), XYZ(decision.without)
    if decision.exact:
        np.testing.assert_allclose(reduced, full, rtol=2e-6, atol=1e-30)
    else:
        assert dE(full, reduced).max() <= decision.bound + 1e-4
