"""The table of effects: names; and each of them, left out of a scene that needs it, changes the picture."""

from __future__ import annotations

import numpy as np
import pytest
from scene_examples import PRINT, environment, names_of, recipe_of

import iccbrdf
from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.models import MODELS
from iccbrdf.build import build_colour_mid, build_pair
from iccbrdf.build.effects import EFFECTS, chosen_effects, effect_names, model_effects
from iccbrdf.errors import UsageError

GLOSSY = {"kd": 0.2, "Rd": 0.2, "ks": 0.3, "ks.X": 0.1, "ks.Z": 0.5, "m": 0.2, "m.X": 0.15, "m.Z": 0.3}
"""A coloured gloss, by channel or else by family."""

PLACES = {
    # normal, zenith of the light in the mirror's plane, zenith of the viewer
    "specular": ((0, 0, 1), -30, 30),
    "fresnel": ((0, 0, 1), -30, 30),
    "shadowing": ((0, 0, 1), -80, 50),
    "chromatic-specular": ((0, 0, 1), -30, 30),
    "chromatic-roughness": ((0, 0, 1), -30, 30),
    "relief": ((0.5, 0, 0.8), -30, 30),
    "below-horizon": ((1, 0, 0.1), -30, 30),
    "highlight-range": ((0, 0, 1), -30, 30),
}
"""A pixel that needs the effect."""


def pixel(model, normal):
    values = [
        *(GLOSSY.get(name, GLOSSY[name.partition(".")[0]]) for name in MODELS[model].channels),
        *normal,
    ]
    return np.array([values])


def XYZ(chain, image, env, **options):
    # Of a pixel or two, which the interpreter has done before anything is compiled.
    transform = iccbrdf.link(chain, dtype="float64", backend="interpreter", **options)
    return transform.with_env({name: env[name] for name in env if name in transform.variables})(image)


@pytest.mark.parametrize(
    ("model", "effect"),
    [(model, name) for model in sorted(MODELS) for name in model_effects(model) if name in PLACES],
)
def test_each_effect_of_an_mvis_changes_the_picture(model, effect):
    normal, light, view = PLACES[effect]
    env = {**environment(direction(light), direction(view)), "litI": 12.0}
    image, recipe = pixel(model, normal), recipe_of(model)
    device = recipe.pair().compiled.inputs
    chains = [
        (pair.mid, pair.mvis) for pair in (recipe.pair(without, device=device) for without in ((), (effect,)))
    ]
    full, without = (XYZ(chain, image, env, samples="real") for chain in chains)
    # Far below the horizon Ward's root, which takes it for lit, is not a number.
    assert not np.allclose(full, without, atol=0.02)
    if effect == "below-horizon":
        assert np.all(full == 0)
    if effect == "highlight-range":
        assert full.max() > 1
        np.testing.assert_allclose(without, [recipe.primaries.white], rtol=1e-6)
    if effect == "relief":
        flat = XYZ(chains[0], pixel(model, (0, 0, 1)), env, samples="real")
        np.testing.assert_allclose(without, flat, rtol=1e-6)
    if effect.startswith("chromatic"):
        # Y is as it was.
        assert without[0, 1] == pytest.approx(full[0, 1], rel=1e-6)


@pytest.mark.parametrize("effect", ["slope", "interpolation"])
def test_each_effect_of_a_colour_mid_changes_the_picture(effect):
    env = environment(direction(-30), direction(30))
    image = np.array([[0.1, 0.2, 0.05, 0.65, 0.5, 0.95], [0.3, 0.2, 0.1, 0.5, 0.5, 1.0]])
    chains = [[PRINT.colour_mid(without).mid, PRINT.pair().mvis] for without in ((), (effect,))]
    full, without = (XYZ(chain, image, env) for chain in chains)
    changed = np.abs(full - without).max(axis=-1)
    assert changed[0] > 0.001
    # On the flat there is no slope.
    assert changed[1] < 1e-6 if effect == "slope" else changed[1] > 0.001


@pytest.mark.parametrize("interpolation", ["smooth", "published"])
def test_without_interpolation_the_reference_colour_is_as_with_it(interpolation):
    primaries = PRINT.primaries
    reference = (0.3, 0.25, 0.2)
    options = {"interpolation": interpolation}
    one, other = (
        iccbrdf.link([mid.mid], samples="real", dtype="float64", backend="interpreter")(
            [[*reference, 0, 0, 1], [0.5, 0.5, 0.4, 0, 0, 1]]
        )
        for mid in (
            build_colour_mid(primaries, **options),
            build_colour_mid(primaries, without=["interpolation"], reference=reference, **options),
        )
    )
    np.testing.assert_allclose(one[0], other[0], rtol=2e-6)
    gloss = slice(3, 7)
    np.testing.assert_allclose(other[0, gloss], other[1, gloss], rtol=1e-12)
    assert np.abs(one[1, gloss] - other[1, gloss]).max() > 0.005


@pytest.mark.parametrize("method", ["smooth", "published"])
@pytest.mark.parametrize(
    "without", [("specular",), ("relief",), ("specular", "relief"), ("slope", "interpolation")]
)
def test_a_smaller_colour_mid_gives_the_same_channels(method, without):
    image = np.random.default_rng(4).uniform(0.05, 0.4, (50, 6))
    image[:, 3:5], image[:, 5] = 0.5, 1.0
    slopes = None if "slope" in without else PRINT.slopes
    full, small = (
        iccbrdf.link(
            [build_colour_mid(PRINT.primaries, interpolation=method, slopes=slopes, without=left_out,
                              device=("X", "Y", "Z", "n.x", "n.y", "n.z")).mid],
            backend="interpreter",
        )
        for left_out in ((), [name for name in without if name in ("specular", "relief")])
    )  # fmt: skip
    shared = [full.channels_out.index(name) for name in small.channels_out]
    np.testing.assert_allclose(full(image)[:, shared], small(image), rtol=1e-6)
    assert ("m" in small.channels_out) is ("specular" not in without)
    assert ("n.x" in small.channels_out) is ("relief" not in without)


def test_a_print_without_gloss_keeps_the_share_that_is_not_diffuse():
    """In the model of 2020 ks says how much is diffuse, with gloss or without."""
    pair = build_pair(recipe_of("cook_torrance_2020").primaries, without=["specular"])
    assert "ks" in pair.compiled.inputs
    assert "m" not in pair.compiled.inputs


@pytest.mark.parametrize("samples", ["device", "real"])
def test_a_reduced_mid_takes_the_images_of_the_full_one(samples):
    recipe = recipe_of("brdf1")
    names = names_of("brdf1")
    image = pixel("brdf1", (0.1, 0.2, 0.9))[:, ::-1]
    full, matte = (
        (pair.mid, pair.mvis)
        for pair in (recipe.pair(without, device=names) for without in ((), ("specular", "relief")))
    )
    assert iccbrdf.link(matte, samples=samples).channels_in == names
    options = {"channels": names[::-1], "samples": samples}
    light_above = environment((0, 0, 1), (0, 0, 1))
    kd = XYZ(matte, image, light_above, **options)
    np.testing.assert_allclose(kd, [[0.2] * 3], rtol=1e-6)
    assert not np.allclose(XYZ(full, image, light_above, **options), kd, atol=0.01)


def test_names_with_dashes_or_underscores():
    assert effect_names(["chromatic_specular", "below-horizon"]) == ["chromatic-specular", "below-horizon"]
    with pytest.raises(UsageError, match="did you mean 'fresnel'"):
        effect_names(["fresnell"])


def test_models_have_the_effects_that_their_equations_have():
    general = ("specular", "relief", "below-horizon", "highlight-range", "slope", "interpolation")
    assert set(model_effects("ward")) == set(general)
    assert set(model_effects("cook_torrance_2020")) == {*general, "shadowing"}
    assert set(model_effects("brdf1")) == {*general, "shadowing", "fresnel", "chromatic-specular"}
    assert set(model_effects("brdf2")) == set(EFFECTS)


def test_effects_are_chosen_by_what_is_named_or_left_out():
    assert all(chosen_effects("ward").values())
    only = chosen_effects("ward", ["relief"])
    assert [name for name, on in only.items() if on] == ["relief"]
    less = chosen_effects("ward", without=["below_horizon"])
    assert [name for name, on in less.items() if not on] == ["below-horizon"]
    with pytest.raises(UsageError, match="isotropic Ward 2020 has no effect 'fresnel'"):
        chosen_effects("ward", without=["fresnel"])


def test_a_slope_needs_slopes():
    with pytest.raises(UsageError, match="there are no slopes"):
        build_colour_mid(PRINT.primaries, effects=["slope"])


def test_device_channels_must_hold_what_is_needed():
    with pytest.raises(UsageError, match=r"'m' is missing"):
        recipe_of("ward").pair(device=("Rd.X", "Rd.Y", "Rd.Z", "ks"))
