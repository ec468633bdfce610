"""What profiles say they are made of: it compiles to the program that they hold, and is the recipe again."""

from __future__ import annotations

from dataclasses import replace

import iccdev
import numpy as np
import pytest
from scene_examples import LANDSCAPE, PAINTING, PRINT, PRINTER, recipe_of

import iccbrdf
from iccbrdf.build import MODELS, build_colour_mid
from iccbrdf.build.effects import chosen_effects
from iccbrdf.build.literal import literal_mvis
from iccbrdf.build.recipe import Recipe
from iccbrdf.build.recipe import recipe_of as recipe_of_profiles
from iccbrdf.build.source import left_out, recompiled, with_effects
from iccbrdf.calc import encode_ops
from iccbrdf.errors import InputError, ProfileError, UsageError
from iccbrdf.icc import Calculator, Profile
from iccbrdf.icc.source_tag import SIGNATURE, Source, read_source


def calculators(profile):
    """The programs of a file, and what their source compiles to, as bytes."""
    profile = Profile.from_bytes(profile.to_bytes())
    found = list(read_source(profile).found_in(profile))
    stored = [e for tag in ("A2M0", "M2B0") for e in getattr(profile.get(tag), "elements", ())]
    assert len(found) == sum(isinstance(element, Calculator) for element in stored)
    return [(encode_ops(calc.program), encode_ops(recompiled(source).program)) for calc, source in found]


@pytest.mark.parametrize("model", MODELS)
def test_every_model_compiles_to_the_same_bytes_again(model):
    recipe = recipe_of(model)
    some = [name for name in chosen_effects(model) if name not in ("slope", "interpolation")][::2]
    scene = replace(recipe, variables={"litX": 0.1, "litZ": 1 / 3})
    for pair in (recipe.pair(), recipe.pair(some), scene.pair()):
        assert calculators(pair.mid) == []
        ((stored, again),) = calculators(pair.mvis)
        assert stored == again
    if model != "brdf2":
        ((stored, again),) = calculators(literal_mvis(recipe.pair(), model)[0])
        assert stored == again


@pytest.mark.parametrize("interpolation", ["smooth", "published"])
@pytest.mark.parametrize("without", [(), ("slope",), ("interpolation",), ("slope", "specular", "relief")])
def test_every_colour_mid_compiles_to_the_same_bytes_again(interpolation, without):
    recipe = replace(PRINT, interpolation=interpolation, slope_method="published", exponent=0.7)
    mid = recipe.colour_mid(without).mid
    ((stored, again),) = calculators(mid)
    assert stored == again
    assert gone(mid) == tuple(name for name in ("slope", "interpolation") if name in without)


def test_the_tag_does_not_change_what_is_computed(tmp_path):
    paths = []
    for with_source in (True, False):
        recipe = replace(PRINT, with_source=with_source)
        for name, profile in (("mid", recipe.colour_mid().mid), ("mvis", recipe.pair().mvis)):
            assert (SIGNATURE in profile) is with_source
            paths.append(tmp_path / f"{name}-{with_source}.icc")
            iccbrdf.write_profile(profile, paths[-1])
            assert iccdev.validate_profile(profile.to_bytes()).status == iccdev.ValidationStatus.OK
    device = np.random.default_rng(1).uniform(0.1, 0.9, (50, 6)).astype(np.float32)
    ours, theirs = [], []
    for chain in (paths[:2], paths[2:]):
        ours.append(iccbrdf.link(chain)(device))
        cmm = iccdev.IccCmm()
        for path in chain:
            cmm.attach(path, intent=1, lut_type=iccdev.LutType.MCS)
        cmm.begin()
        theirs.append(cmm.apply_ndarray(device))
    assert np.array_equal(*ours)
    assert np.array_equal(*theirs)


def same(found: Recipe, expected: Recipe) -> bool:
    """Whether two recipes make the same profiles, but for the tag."""
    made = [
        [p.to_bytes() for p in (r.pair().mid, r.pair().mvis, r.colour_mid().mid)]
        for r in (replace(found, with_source=False), replace(expected, with_source=False))
    ]
    return made[0] == made[1]


def test_the_recipe_is_in_the_profiles():
    recipe = replace(
        PRINT,
        interpolation="published",
        slope_method="published",
        p=1.5,
        exponent=0.5,
        fresnel_angle="alpha",
        variables={"litI": 2.0},
    )
    found = recipe_of_profiles([recipe.colour_mid().mid, recipe.pair().mvis])
    assert same(found, recipe)
    assert found.primaries.primaries == PRINT.primaries.primaries
    assert not same(recipe_of_profiles([PRINT.colour_mid().mid, PRINT.pair().mvis]), recipe)


def test_the_recipe_of_a_pair_is_without_the_primaries():
    encoding = {"kd": 1.5, "ks": 0.25, "m": 0.5}
    other = replace(LANDSCAPE, encoding=encoding, illuminant="A", white=(1.1, 1, 0.35))
    pair = Recipe(other).pair(["fresnel", "relief"])
    found = recipe_of_profiles([pair.mid, pair.mvis])
    assert found.primaries.primaries == ()
    assert gone(pair.mvis) == ("fresnel", "relief")
    full = Recipe(other, with_source=False).pair()
    again = replace(found, with_source=False).pair()
    assert [p.to_bytes() for p in (full.mid, full.mvis)] == [p.to_bytes() for p in (again.mid, again.mvis)]
    with pytest.raises(InputError, match="0 primaries, expected 4 to 16"):
        found.colour_mid()


@pytest.mark.parametrize(
    ("profiles", "error", "message"),
    [
        (lambda: [replace(PRINT, with_source=False).pair().mid], UsageError, r"tag bsrc.*\(--primaries\)"),
        (lambda: [iccbrdf.read_profile(PRINTER / "table-mid.icc")], UsageError, "table-mid.icc: does not"),
        (lambda: [PRINT.pair().mid], UsageError, "found no MVIS"),
        (lambda: [PRINT.pair().mvis], UsageError, "found no MID"),
        (lambda: [PRINT.pair().mid, PAINTING.pair().mvis], UsageError, "its model is not that of"),
        (lambda: with_recipe({"model": "brdf3"}), ProfileError, "tag bsrc: unknown model 'brdf3'"),
        (lambda: with_recipe({"white": [1, 1]}), ProfileError, "white has 2 numbers, expected 3"),
        (lambda: with_recipe({"variables": {"litI": "2"}}), ProfileError, "litI is \"2\", expected a number"),
        (lambda: with_recipe({"fresnel_angle": 1}), ProfileError, "fresnel_angle is 1, expected a text"),
        (lambda: with_recipe({"geometry": "exakt"}), ProfileError, "unknown geometry 'exakt': did you mean"),
    ],
)
def test_profiles_without_a_recipe_are_refused(profiles, error, message):
    with pytest.raises(error, match=message):
        recipe_of_profiles(profiles())


def with_recipe(changes):
    """A pair that both say the same wrong thing."""
    pair = PRINT.pair()
    recipe = {**read_source(pair.mvis).recipe, **changes}
    return [p.replace(tags={SIGNATURE: Source((), recipe).tag()}) for p in (pair.mid, pair.mvis)]


def gone(profile):
    return left_out(read_source(profile).recipe)


def test_effects_left_out_that_are_none_do_not_count():
    assert left_out({"without": ["gloss", 1, "relief"]}) == ("relief",)
    assert left_out({"without": 1}) == left_out({}) == ()


def test_effects_of_programs_can_be_switched():
    """As if they had been built so, off and on again; what a program does not know is told."""
    full, fewer = PRINT.pair(), PRINT.pair(["fresnel", "below-horizon"])
    chain = [full.mid, full.mvis]
    (mid, mvis), known = with_effects(chain, {"fresnel": False, "below-horizon": False, "slope": False})
    assert mid is full.mid
    assert known == {"fresnel", "below-horizon"}
    assert mvis.tag_data("M2B0") == fewer.mvis.tag_data("M2B0")
    assert read_source(mvis) == read_source(fewer.mvis)
    (again,), _ = with_effects([mvis], {"fresnel": True, "below-horizon": True})
    assert again.tag_data("M2B0") == full.mvis.tag_data("M2B0")
    assert gone(again) == ()
    (same,), _ = with_effects([full.mvis], {"fresnel": True})
    assert same is full.mvis
    assert with_effects([replace(PRINT, with_source=False).pair().mvis], {"fresnel": False})[1] == set()


def test_the_angle_of_a_fresnel_term_that_is_left_out_is_kept():
    recipe = replace(PRINT, fresnel_angle="alpha")
    fewer = recipe.pair(["fresnel"]).mvis
    assert fewer.tag_data("M2B0") == PRINT.pair(["fresnel"]).mvis.tag_data("M2B0")
    assert recipe_of_profiles([recipe.pair().mid, fewer]).fresnel_angle == "alpha"
    (again,), _ = with_effects([fewer], {"fresnel": True})
    assert again.tag_data("M2B0") == recipe.pair().mvis.tag_data("M2B0")


def test_the_geometry_goes_along():
    recipe = replace(PRINT, geometry="exact")
    full, fewer = recipe.pair(), recipe.pair(["shadowing"])
    assert recipe_of_profiles([full.mid, full.mvis]).geometry == "exact"
    assert "geometry" not in read_source(PRINT.pair().mvis).recipe
    (again,), _ = with_effects([fewer.mvis], {"shadowing": True})
    assert again.tag_data("M2B0") == full.mvis.tag_data("M2B0") != PRINT.pair().mvis.tag_data("M2B0")
    with pytest.raises(UsageError, match="no geometry is named 'exakt': did you mean 'exact'"):
        replace(PRINT, geometry="exakt").pair()


def test_a_stale_source_switches_nothing():
    mvis, other = PRINT.pair().mvis, PRINT.pair(["shadowing"]).mvis
    stale = mvis.replace(tags={"M2B0": other["M2B0"]})
    with pytest.raises(ProfileError, match="does not compile to the program of tag M2B0"):
        with_effects([stale], {"fresnel": False})


def test_names_of_values_stand_where_they_are_stored():
    mid = build_colour_mid(PRINT.primaries, slopes=PRINT.slopes)
    names = [temporary.name for temporary in mid.compiled.temporaries]
    assert names == ["weights", "u", "distances", "f"]
    assert "tput(8,3)  % u\n" in mid.listing
