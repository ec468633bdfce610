"""iccbrdf plan and iccbrdf build --for."""

from __future__ import annotations

import os

import numpy as np
import pytest
from scene_examples import LANDSCAPE, PRINTER, scenes

import iccbrdf
from iccbrdf.build.effects import EFFECTS
from iccbrdf.images import Block, create_tiff, open_tiff
from iccbrdf.resources import folder

PRIMARIES = folder("profiles") / "landscape" / "primaries.json"
GLOSS = ("specular", "fresnel", "shadowing", "chromatic-specular")


@pytest.fixture
def image(tmp_path):
    """A function that writes one of the scenes to a file."""

    def write(name, **options):
        _, scene = scenes()[name]
        path = tmp_path / f"{name.replace(' ', '_')}.tif"
        settings = {"samples": scene.samples, **options}
        with create_tiff(path, scene.height, scene.width, scene.names, **settings) as sink:
            sink.write(Block(0, 0, scene.data))
        return path

    return write


def by_effect(plan):
    return {entry["effect"]: entry for entry in plan["effects"]}


def test_a_plan_as_json(run, image):
    path = image("relief matte")
    result = run("plan", path, "--primaries", PRIMARIES, "--light", "50,180", "--json")
    assert (result.code, result.err) == (0, "")
    plan = result.json
    assert plan["schema"] == "iccbrdf.plan/1"
    assert (plan["image"], plan["kind"], plan["tolerance"]) == (str(path), "BRDF", 0)
    effects = by_effect(plan)
    assert list(effects) == [name for name in EFFECTS if name in effects]
    assert [name for name in effects if not effects[name]["called_for"]] == [*GLOSS, "highlight-range"]
    assert plan["without"] == list(GLOSS)
    assert (plan["bound"], plan["exact"], plan["check"]["max_delta_E_CIE2000"]) == (0, True, 0)
    assert plan["check"]["lights"] == 1
    relief = effects["relief"]
    assert relief["bound"] > 1
    assert len(relief["place"]) == 2
    assert plan["executed"]["reduced"] < plan["executed"]["full"] / 1.8
    assert set(plan["seconds"]) == {"reading", "decoding", "bounding"}
    assert 0 < plan["share_of_bounding"] < 1


def test_a_plan_from_profiles_is_that_from_what_they_are_made_of(run, image, tmp_path):
    path = image("relief matte")
    scene = ("--light", "50,180", "--json")
    expected = run("plan", path, "--primaries", PRIMARIES, *scene).json
    pair = ("-p", PRIMARIES.with_name("mid.icc"), "-p", PRIMARIES.with_name("mvis.icc"))
    found = run("plan", path, *pair, *scene).json
    assert found["profiles"] == [str(PRIMARIES.with_name(name)) for name in ("mid.icc", "mvis.icc")]
    assert (found["primaries"], found["lacking"]) == (None, [])
    for key in ("kind", "effects", "without", "bound", "exact", "check", "executed"):
        assert found[key] == expected[key]
    # What the profiles state about light and view holds, and what they leave out is told.
    build = ("build", PRIMARIES, "-o", tmp_path, "--without", "relief,shadowing", "--light", "50,180")
    assert run(*build).code == 0
    pair = ("-p", tmp_path / "mid.icc", "-p", tmp_path / "mvis.icc")
    fewer = run("plan", path, *pair, "--json").json
    assert (fewer["effects"], fewer["without"]) == (expected["effects"], expected["without"])
    assert fewer["lacking"] == ["relief"]
    assert "the profiles lack what is called for: relief" in run("plan", path, *pair).out


def test_a_plan_from_a_colour_mid(run, image):
    path = image("relief in XYZ")
    pair = ("-p", PRINTER / "colour-mid.icc", "-p", PRINTER / "mvis.icc")
    plan = run("plan", path, *pair, "--light", "30,0", "--json").json
    assert plan["kind"] == "XYZ"
    assert by_effect(plan)["slope"]["called_for"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "give the profiles that the image is for (-p MID -p MVIS), or --primaries"),
        (("--primaries", PRIMARIES, "-p", PRIMARIES.with_name("mvis.icc")), "or --primaries"),
        (("-p", PRINTER / "table-mid.icc", "-p", PRINTER / "mvis.icc"), "(--primaries)"),
        (("-p", PRINTER / "mid.icc", "-p", PRINTER / "mvis.icc", "--slopes", PRIMARIES), "--slopes"),
        (("-p", PRINTER / "mid.icc"), "found no MVIS"),
    ],
)
def test_what_a_plan_is_made_of_is_said_once(run, image, options, message):
    result = run("plan", image("flat matte"), *options)
    assert (result.code, result.out) == (2, "")
    assert message in result.err


def test_what_has_no_bound_is_null(run, image):
    arguments = ("--primaries", PRIMARIES, "--light", "89.9,0", "--json")
    below = by_effect(run("plan", image("relief glossy"), *arguments).json)["below-horizon"]
    assert (below["called_for"], below["bound"]) == (True, None)


def test_a_plan_as_text(run, image):
    arguments = ["--primaries", PRIMARIES, "--light", "50,180", "--tolerance", "0.5"]
    result = run("plan", image("flat glossy"), *arguments)
    assert (result.code, result.err) == (0, "")
    assert "specular             called for: CIEDE2000 up to" in result.out
    assert "relief               no change without it" in result.out
    assert "highlight-range      no change without it; kept, for it costs nothing" in result.out
    assert (
        "leave out: shadowing, relief, below-horizon (the same but for rounding; found 0 on the image)"
        in result.out
    )


def test_an_image_of_xyz_is_planned_for_the_colour_mid(run, image):
    files = ("--primaries", PRINTER / "primaries.json", "--slopes", PRINTER / "slopes.json")
    path = image("relief in XYZ")
    plan = run("plan", path, *files, "--light", "30,0", "--json").json
    assert plan["kind"] == "XYZ"
    effects = by_effect(plan)
    assert effects["slope"]["called_for"]
    assert effects["interpolation"]["called_for"]
    assert "below-horizon" in plan["without"]
    without_slopes = run("plan", path, *files[:2], "--light", "30,0", "--json").json
    assert "slope" not in by_effect(without_slopes)


def test_lights_of_an_animation(run, image):
    """What holds for one light need not hold for all of them."""
    path = image("relief matte")
    arguments = ("plan", path, "--primaries", PRIMARIES, "--json")
    high = run(*arguments, "--light", "10,0").json
    several = run(*arguments, "--lights", "10,0", "--lights", "85,0:85,20").json
    turning = run(*arguments, "--lights", "10,0:10,360").json
    assert "below-horizon" in high["without"]
    assert "below-horizon" in turning["without"]
    assert "below-horizon" not in several["without"]
    assert by_effect(several)["below-horizon"]["light"].startswith("85..85,")
    assert (several["check"]["lights"], turning["check"]["lights"]) == (5, 8)


@pytest.mark.parametrize("samples", ["device", "real"])
def test_profiles_for_an_image(run, image, tmp_path, samples):
    if samples == "device":
        path = image("flat matte")
    else:
        _, scene = scenes()["flat matte"]
        path = tmp_path / "real.tif"
        real = scene.data.copy()
        real[..., :7] *= LANDSCAPE.scales.astype(np.float32)
        real[..., 7:] = (0, 0, 1)
        with create_tiff(path, scene.height, scene.width, scene.names, samples="real") as sink:
            sink.write(Block(0, 0, real))
    out = tmp_path / "out"
    result = run("build", PRIMARIES, "-o", out, "--for", path, "--light", "50,180", "--json")
    assert (result.code, result.err) == (0, "")
    built = result.json
    assert sorted(os.listdir(out)) == ["mid.icc", "mvis.icc", "mvis.txt"]
    assert built["effects"] == ["highlight-range"]
    assert built["plan"]["without"] == [*GLOSS, "relief", "below-horizon"]
    assert built["executed"] <= 33
    text = iccbrdf.read_profile(out / "mvis.icc")["desc"].text
    assert "reduced for a scene: without specular, fresnel" in text
    assert "(no loss)" in text
    # The same picture as by the full profiles, from file to file.
    run("build", PRIMARIES, "-o", tmp_path / "full", "--light", "50,180")
    pictures = []
    for profiles in (out, tmp_path / "full"):
        target = profiles / "xyz.tif"
        chain = ("-p", profiles / "mid.icc", "-p", profiles / "mvis.icc")
        assert run("apply", path, *chain, "-o", target).code == 0
        with open_tiff(target) as source:
            pictures.append(next(iter(source.blocks())).data)
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=2e-6)


def test_profiles_within_a_tolerance_say_their_bound(run, image, tmp_path):
    arguments = ("--for", image("flat glossy"), "--light", "50,180", "--tolerance", "3", "--json")
    built = run("build", PRIMARIES, "-o", tmp_path, *arguments).json
    plan = built["plan"]
    assert 0 < plan["check"]["max_delta_E_CIE2000"] <= plan["bound"] <= 3
    assert f"CIEDE2000 at most {plan['bound']:.3g}" in iccbrdf.read_profile(tmp_path / "mid.icc")["desc"].text


def test_a_colour_mid_for_an_image(run, image, tmp_path):
    files = (PRINTER / "primaries.json", "--slopes", PRINTER / "slopes.json")
    result = run("build", *files, "-o", tmp_path, "--for", image("relief in XYZ"), "--light", "30,0")
    assert (result.code, result.err) == (0, "")
    assert {"colour-mid.icc", "colour-mid.txt", "mid.icc", "mvis.icc"} <= set(os.listdir(tmp_path))
    assert "leave out: " in result.out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--tolerance", "0.5"], "belong to --for"),
        (["--for", "x.tif", "--without", "fresnel"], "--for chooses the effects"),
        (["--for", "x.tif", "--table", "17"], "--for chooses the effects"),
        (["--tolerance", "-1"], "tolerance"),
        (["--tolerance", "nan"], "tolerance"),
    ],
)
def test_build_options_that_contradict_each_other(run, tmp_path, options, message):
    result = run("build", PRIMARIES, "-o", tmp_path, *options)
    assert result.code == 2
    assert message in result.err
    assert not list(tmp_path.glob("*.icc"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--lights", "1,2:3,4:5,6"], "expected a direction, or two with a colon"),
        (["--lights", "1,0,0:0,1,0"], "expected ZENITH,AZIMUTH"),
        (["--light", "95,0"], "expected -90 to 90"),
        (["--env", "litX=0", "--env", "litZ=0"], "length 0"),
        (["--env", "litQ=1"], "did you mean 'litZ'?"),
        (["--channels", "a,b"], "2 channels are named, the image has 10"),
    ],
)
def test_scenes_that_are_none(run, image, options, message):
    result = run("plan", image("flat matte"), "--primaries", PRIMARIES, *options)
    assert result.code == 2
    assert message in result.err


def test_an_image_of_another_kind(run, tmp_path):
    with create_tiff(tmp_path / "grey.tif", 4, 4, ("grey",), samples="device") as sink:
        sink.write(Block(0, 0, np.zeros((4, 4, 1), np.float32)))
    result = run("plan", tmp_path / "grey.tif", "--primaries", PRIMARIES)
    assert result.code == 3
    assert "'grey'" in result.err


def test_a_view_makes_no_difference_to_profiles_without_gloss(tmp_path, run):
    """Profiles that were reduced to diffuse reflection are applied as any: with light and view."""
    primaries = folder("profiles") / "fogra39_gloss" / "primaries.json"
    image = tmp_path / "image.tif"
    with create_tiff(image, 2, 3, [*"XYZ", "n.x", "n.y", "n.z"], samples="device") as sink:
        sink.write(Block(0, 0, np.full((2, 3, 6), 0.4, np.float32)))
    assert run("build", primaries, "-o", tmp_path / "matte", "--without", "specular,below-horizon").code == 0
    chain = ["-p", tmp_path / "matte" / "colour-mid.icc", "-p", tmp_path / "matte" / "mvis.icc"]
    light = ["--light", "30,0"]
    assert run("apply", image, *chain, "-o", tmp_path / "a.tif", *light).code == 0
    assert run("apply", image, *chain, "-o", tmp_path / "b.tif", *light, "--view", "40,90").code == 0
    assert (tmp_path / "a.tif").read_bytes() == (tmp_path / "b.tif").read_bytes()
    refused = run("apply", image, *chain, "-o", tmp_path / "c.tif", "--env", "vueX=0.1")
    assert refused.code == 2
