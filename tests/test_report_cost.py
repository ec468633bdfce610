"""What accuracy costs: ways, errors, regions and recommendations.  No test depends on the clock."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import colour
import numpy as np
import pytest
from conftest import ROOT

from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.models import MODELS, NORMAL, evaluate
from iccbrdf.brdf.primaries import Primaries, Primary, read_primaries
from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build.literal import literal_mvis
from iccbrdf.build.recipe import Recipe
from iccbrdf.build.spans import Directions
from iccbrdf.build.table import GRIDS
from iccbrdf.cmm import link
from iccbrdf.demo import landscape
from iccbrdf.errors import UsageError
from iccbrdf.images import Block, Place
from iccbrdf.planning import Planning
from iccbrdf.report.cost import (
    Cost,
    CostReport,
    Errors,
    differences,
    measure,
    measure_image,
    pareto,
    recommend,
)
from iccbrdf.report.cost_plots import plot_errors, plot_front
from iccbrdf.report.cost_runs import enlarged, shrunk
from iccbrdf.report.cost_scene import CostScene, sample_scene
from iccbrdf.report.cost_tables import markdown, text
from iccbrdf.report.cost_ways import PLAIN, REFERENCE, Way, ways
from iccbrdf.scene import environment

PRINTER = ROOT / "profiles" / "fogra39_gloss"
PRIMARIES = read_primaries(PRINTER / "primaries.json")
PRINT = Recipe(PRIMARIES, read_slopes(PRINTER / "slopes.json"))
TINTS = Recipe(read_primaries(ROOT / "profiles" / "landscape" / "primaries.json"))
ENV = environment("50,180", "10,0", ())
WHITE = PRIMARIES.white
PNG = b"\x89PNG\r\n\x1a\n"


class Picture:
    """An array as an image source."""

    def __init__(self, data, names, samples="device"):
        self.data, self.names, self.samples = np.asarray(data, np.float32), names, samples
        self.height, self.width, self.channels = self.data.shape

    def places(self):
        yield Place(0, 0, self.height, self.width)

    def read(self, place):
        y, x, height, width = place
        return Block(y, x, self.data[y : y + height, x : x + width])


@cache
def print_images():
    """Small parts of the demo's print, with black, white and steep ground: as XYZ, and as parameters."""
    scene = landscape(TINTS.primaries)
    part = (slice(600, 1000, 10), slice(300, 620, 10))
    return {
        "XYZ": Planning(Picture(scene.xyz.device[part], scene.xyz.names), PRINT),
        "BRDF": Planning(Picture(scene.brdf.device[part], scene.brdf.names), TINTS),
    }


@cache
def reports() -> dict[str, CostReport]:
    """The ways that need no plan, but for large tables, for either kind of image."""

    def quick(way):
        return way.tolerance is None and (way.grid in (None, 9, 17) or way.version == 4)

    return {
        kind: measure_image(planning, ENV, only=quick, runs=1) for kind, planning in print_images().items()
    }


def by_name(kind: str) -> dict[str, Cost]:
    return {cost.way.name: cost for cost in reports()[kind].costs}


def scene_of(kind: str) -> CostScene:
    return sample_scene(print_images()[kind], ENV)


# Ways --------------------------------------------------------------------------------------------------


def test_ways_to_a_proof_of_colours_cover_every_axis():
    found = ways(PRINT, is_colour=True)
    assert found[0] == REFERENCE
    assert PLAIN in found
    assert len({way.name for way in found}) == len(found)
    assert {way.axis for way in found} == {
        "number type", "effects", "interpolation", "tables", "model", "formulas", "output", "resolution",
    }  # fmt: skip
    assert {(way.grid, way.lookup) for way in found if way.grid and way.version == 5} == {
        (grid, lookup) for grid in GRIDS for lookup in ("multilinear", "tetrahedral")
    }
    assert [way.name for way in found if not way.same_answer] == ["published interpolation"]
    published = ways(replace(PRINT, interpolation="published"), is_colour=True)
    assert [way.name for way in published if not way.same_answer] == ["smooth interpolation"]


def test_ways_that_there_are_not():
    axes = {way.axis for way in ways(TINTS, is_colour=False)}
    assert not axes & {"interpolation", "tables"}
    ward = Recipe(read_primaries(ROOT / "profiles" / "ward_painting" / "primaries.json"))
    assert "model" not in {way.axis for way in ways(ward, is_colour=False)}
    other_exponent = replace(PRINT, interpolation="published", exponent=1.0)
    assert "tables" not in {way.axis for way in ways(other_exponent, is_colour=True)}


def test_one_roughness_of_three_is_another_answer_and_three_of_one_are_not():
    assert Way("", "model", model="brdf2").same_answer
    assert not Way("", "model", model="brdf1").same_answer


def test_advice_is_given_for_what_can_be_had():
    advice = {way.name: way.advice for way in ways(PRINT, is_colour=True)}
    assert advice["float32"] == "iccbrdf build PRIMARIES -o DIR"
    assert advice["effects within 0.5"] == "iccbrdf build PRIMARIES -o DIR --for SCENE --tolerance 0.5"
    assert advice["table 17 trilinear"].startswith("iccbrdf build PRIMARIES -o DIR --table 17, then")
    assert "tetrahedral" in advice["table 17 tetrahedral"]
    assert advice["float64"] == "iccbrdf apply --double"
    for name in ("float64 reference", "literal formulas", "BRDF2", "parameters at 1/2"):
        assert advice[name] is None
    built = {way.name for way in ways(PRINT, is_colour=True) if way.is_built}
    assert built == {
        "float32", *(f"table {grid} trilinear" for grid in GRIDS),
        *(f"effects within {tolerance}" for tolerance in ("0", "0.5", "2")),
    }  # fmt: skip


# The scene ---------------------------------------------------------------------------------------------


def test_the_exact_result_is_that_of_the_profiles_in_float64():
    for kind, planning in print_images().items():
        scene = scene_of(kind)
        transform = link(planning.built().chain, env=ENV, dtype="float64", channels=scene.names)
        found, exact = transform(scene.tiles), scene.exact(scene.tiles)
        np.testing.assert_allclose(found, exact, rtol=2e-6, atol=1e-7)  # constants are float32 in profiles
        assert exact.max() > 0.3


def test_real_samples_mean_the_same_as_device_values():
    device = scene_of("BRDF")
    scales = np.array([*TINTS.primaries.scales, 2, 2, 2])
    offsets = np.array([0] * 7 + [-1] * 3)
    real = replace(device, samples="real", tiles=(device.tiles * scales + offsets).astype(np.float32))
    np.testing.assert_allclose(real.exact(real.tiles), device.exact(device.tiles), rtol=1e-4, atol=1e-6)


def test_channels_that_an_image_lacks_are_those_of_the_profiles():
    """An image of kd alone is a flat print without gloss."""
    device = scene_of("BRDF")
    bare = replace(device, names=("kd.X", "kd.Y", "kd.Z"), tiles=device.tiles[..., :3])
    kd = device.tiles[..., :3].astype(float) * TINTS.primaries.scales[:3]
    np.testing.assert_allclose(bare.exact(bare.tiles), kd * np.cos(np.radians(50)), rtol=1e-6)


def test_regions_are_told_by_the_angle_to_the_half_vector_in_units_of_m():
    m = 0.2
    light, view = direction(30, 0), direction(30, 180)  # half vector: z
    angles = np.degrees(np.arctan(m * np.array([0, 0.99, 1.01, 2.99, 3.01, 5])))
    normals = direction(angles, 70)
    pixels = np.concatenate([np.tile([0.3] * 3 + [0.1] * 3 + [m], (6, 1)), normals], axis=1)
    scene = CostScene(
        Recipe(PRIMARIES), (*MODELS["brdf1"].channels, *NORMAL), "real",
        dict(zip(("litX", "litY", "litZ", "vueX", "vueY", "vueZ"), (*light, *view), strict=True)),
        pixels[np.newaxis, np.newaxis].astype(np.float32), ((0, 0),), (1, 6),
    )  # fmt: skip
    assert scene.regions(scene.tiles).tolist() == [[[2, 2, 1, 1, 0, 0]]]


def test_a_sample_has_the_pixels_of_its_places_and_is_the_same_every_time():
    data = np.zeros((200, 150, 6), np.float32)
    data[..., 0], data[..., 1] = np.mgrid[0:200, 0:150] / 200
    planning = Planning(Picture(data, ("X", "Y", "Z", *NORMAL)), PRINT)
    sample = sample_scene(planning, ENV, pixels=5 * 64 * 64)
    assert sample.tiles.shape == (5, 64, 64, 6)
    assert (sample.pixels, sample.is_whole) == (5 * 64 * 64, False)
    for (y, x), tile in zip(sample.places, sample.tiles, strict=True):
        assert np.array_equal(tile, data[y : y + 64, x : x + 64])
    assert sample_scene(planning, ENV, pixels=5 * 64 * 64).places == sample.places
    whole = sample_scene(planning, ENV)
    assert whole.is_whole
    covered = np.zeros((200, 150), bool)
    for y, x in whole.places:
        covered[y : y + 64, x : x + 64] = True
    assert covered.all()


@pytest.mark.parametrize(("height", "width", "tile"), [(3, 70, (3, 64)), (10, 64, (8, 64)), (1, 1, (1, 1))])
def test_narrow_images_make_narrow_tiles(height, width, tile):
    planning = Planning(Picture(np.full((height, width, 6), 0.5), ("X", "Y", "Z", *NORMAL)), PRINT)
    assert sample_scene(planning, ENV).tiles.shape[1:3] == tile


# Errors ------------------------------------------------------------------------------------------------


def test_differences_are_CIEDE2000_as_displays_show_the_results():
    rng = np.random.default_rng(1)
    one, other = rng.uniform(0.05, 0.9, (2, 4, 5, 3))
    xy = colour.XYZ_to_xy(np.array(WHITE))
    expected = colour.delta_E(*(colour.XYZ_to_Lab(v, xy) for v in (one, other)), method="CIE 2000")
    np.testing.assert_allclose(differences(one, other, WHITE), expected, rtol=1e-5)
    lost = np.array([[np.nan, 0.2, 0.3]])
    assert differences(lost, [[0, 0.2, 0.3]], WHITE)[0] == 0
    assert differences([[np.inf] * 3], [[0.5] * 3], WHITE)[0] > 50


def test_statistics_of_errors():
    errors = Errors.of(np.arange(101, dtype=np.float32))
    assert (errors.pixels, errors.mean, errors.p95, errors.max) == (101, 50, 95, 100)
    none = Errors.of(np.zeros(0, np.float32))
    assert none.pixels == 0
    assert np.isnan(none.mean)


def test_smaller_images_are_means_and_larger_ones_are_interpolated():
    tiles = np.arange(2 * 8 * 4 * 1, dtype=np.float32).reshape(2, 8, 4, 1)
    assert shrunk(tiles, 4).ravel().tolist() == [
        part.mean() for tile in tiles for part in (tile[:4], tile[4:])
    ]
    ramp = np.tile(np.arange(4, dtype=np.float32).reshape(1, 4, 1, 1), (1, 1, 2, 1))
    column = enlarged(ramp, 2)[0, :, 0, 0]
    assert column.tolist() == [0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3]
    assert enlarged(ramp, 4).shape == (1, 16, 8, 1)
    assert np.all(enlarged(np.full((1, 2, 2, 3), 7, np.float32), 4) == 7)


# Measured ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["XYZ", "BRDF"])
def test_number_types_err_as_little_as_they_can(kind):
    found = by_name(kind)
    assert found["float64 reference"].errors.max == 0
    assert found["float64"].errors.max < 1e-4 < 100 * found["float32"].errors.max
    assert found["float32"].errors.max < 1e-2
    assert found["tile by tile"].errors.max < 1e-2
    assert found["literal formulas"].errors.max < 1e-2
    assert found["BRDF2"].errors.max < 1e-2
    assert found["BRDF2"].operators > found["float32"].operators


def test_tables_come_nearer_with_their_size_and_adjust_to_slopes():
    found = by_name("XYZ")
    assert found["table 9 trilinear"].errors.max < 1
    for lookup in ("trilinear", "tetrahedral"):
        small, large = (found[f"table {grid} {lookup}"] for grid in (9, 17))
        assert small.errors.mean > 2 * large.errors.mean > 0
        assert small.profile_bytes < large.profile_bytes
        assert small.operators == large.operators < found["float32"].operators
    assert found["float32"].errors.mean < found["v4 table 33, 16 bits"].errors.mean < 0.05
    assert found["published interpolation"].errors.max > 1


@pytest.mark.parametrize("kind", ["XYZ", "BRDF"])
def test_outputs_err_by_their_levels(kind):
    found = by_name(kind)
    eight, sixteen, XYZ = (found[name].errors for name in ("8-bit sRGB", "16-bit sRGB", "16-bit XYZ"))
    assert found["float32"].errors.max < sixteen.p95 < 0.02 < eight.p95 < 2
    assert found["float32"].errors.mean < XYZ.mean < 0.05


@pytest.mark.parametrize("kind", ["XYZ", "BRDF"])
def test_fewer_parameters_err_more_and_more(kind):
    found = by_name(kind)
    half, quarter = (found[f"parameters at 1/{n}"] for n in (2, 4))
    assert 0.01 < half.errors.mean < quarter.errors.mean
    assert quarter.operators <= half.operators <= found["float32"].operators
    assert quarter.noticed > half.noticed > 0


def test_parameters_of_an_even_print_lose_nothing():
    """What does not change from pixel to pixel is interpolated without loss, the relief remaining."""
    scene = scene_of("XYZ")
    tiles = scene.tiles.copy()
    tiles[..., :3] = 0.2
    flat = Planning(print_images()["XYZ"].source, Recipe(PRIMARIES))
    even = replace(scene, recipe=flat.recipe, tiles=tiles)
    report = measure(even, [Way("half", "resolution", reduction=2)], refuse, runs=1, backends=())
    assert report.costs[0].errors.max < 1e-3


def refuse(tolerance):
    raise AssertionError(f"no plan is needed, but one within {tolerance} was asked for")


def test_ways_with_fewer_effects_keep_their_bounds():
    """A matte print under a high light calls for little; plans that leave out the same are not repeated."""
    data = print_images()["BRDF"].source.data.copy()
    data[..., 3:6] = 0.001
    planning = Planning(Picture(data, print_images()["BRDF"].source.names), TINTS)
    report = measure_image(planning, ENV, only=lambda way: way.tolerance is not None, runs=1, backends=())
    assert report.costs
    operators = [cost.operators for cost in report.costs]
    assert operators == sorted(operators, reverse=True)
    assert len(set(operators)) == len(operators)
    for cost in report.costs:
        assert cost.errors.max <= cost.bound + 1e-3
        assert cost.bound <= cost.way.tolerance
    view = Directions.single([direction(10, 0)], ["view"])
    full = planning.plan(Directions.single([direction(50, 180)], ["light"]), view).full
    assert operators[-1] < full.executed


@pytest.mark.parametrize("kind", ["XYZ", "BRDF"])
def test_back_ends_change_no_colours(kind):
    found = reports()[kind].backends
    assert {"interpreter", "numpy"} <= {backend.name for backend in found}
    for backend in found:
        assert backend.max_error < 1e-2
        assert backend.from_first < 1e-3
        assert backend.ns > 0


def test_regions_share_the_pixels_out():
    for report in reports().values():
        for cost in report.costs:
            assert sum(errors.pixels for errors in cost.by_region.values()) == report.scene.pixels
            assert max(e.max for e in cost.by_region.values() if e.pixels) == cost.errors.max
            assert cost.dE.shape == report.scene.tiles.shape[:3]


@pytest.mark.parametrize("model", sorted(MODELS))
def test_literal_programs_are_the_literal_formulas(model):
    names = MODELS[model].channels
    grey = Primary("grey", (0.3,) * 3, (0.3,) * len(names))
    recipe = Recipe(Primaries(model, "D50", PRIMARIES.observer, WHITE, "45:0", "an example", (grey,)))
    mvis, compiled = literal_mvis(recipe.pair(), model)
    assert compiled.inputs == recipe.pair().compiled.inputs
    rng = np.random.default_rng(2)
    parameters = rng.uniform(0.1, 0.6, (200, len(names)))
    n = direction(rng.uniform(0, 60, 200), rng.uniform(0, 360, 200))
    light, view = direction(50, 180), direction(20, 30)
    env = dict(zip(("litX", "litY", "litZ", "vueX", "vueY", "vueZ"), (*light, *view), strict=True))
    found = link([mvis], env=env, dtype="float64")(np.concatenate([parameters, n], axis=1))
    expected = evaluate(model, parameters, n, light, view, form="literal")
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)


# Recommendations -----------------------------------------------------------------------------------------


def cost(name: str, ns: float, error: float, *, mean: float | None = None, way: Way | None = None) -> Cost:
    """A made-up cost of a way that `build` offers, unless another is given."""
    way = way or Way(name, "tables", grid=17)
    errors = Errors(1, mean if mean is not None else error / 10, error / 2, error)
    return Cost(
        way, ns, 0.0, errors, {}, 0.0, 0, None, "numpy", None, lambda tiles: tiles, np.zeros((1, 1, 1))
    )


def test_the_cheapest_way_within_a_budget_is_recommended():
    costs = [cost("exact", 100, 0), cost("near", 50, 0.3), cost("far", 20, 3)]
    assert recommend(costs, budget=0.5).way.name == "near"
    assert recommend(costs, budget=5).way.name == "far"
    assert recommend(costs, budget=0.1).way.name == "exact"
    assert recommend(costs, budget=0.2, statistic="p95").way.name == "near"
    assert recommend([cost("near", 50, 0.3)], budget=0.1) is None


def test_of_ways_that_take_as_long_the_most_accurate_is_recommended():
    costs = [cost("coarse", 100, 0.4), cost("fine", 109, 0.1), cost("slow", 111, 0.01)]
    assert recommend(costs, budget=0.5).way.name == "fine"


def test_the_most_accurate_way_within_a_time_is_recommended():
    costs = [cost("exact", 100, 0), cost("near", 50, 0.3), cost("far", 20, 3)]
    assert recommend(costs, ns=60).way.name == "near"
    assert recommend(costs, ns=100).way.name == "exact"
    assert recommend(costs, ns=10) is None


def test_other_answers_and_what_nobody_can_have_are_not_recommended():
    offered = cost("table", 100, 0.2)
    others = [
        cost("", 1, 0, way=REFERENCE),
        cost("", 1, 0, way=Way("literal", "formulas", literal=True)),
        cost("", 1, 0, way=Way("published", "interpolation", interpolation="published")),
    ]
    assert recommend([*others, offered], budget=0.5) is offered


def test_a_recommendation_needs_one_limit():
    for limits in ({}, {"budget": 1.0, "ns": 10.0}):
        with pytest.raises(UsageError, match="not both"):
            recommend([cost("a", 1, 1)], **limits)


def test_the_front_holds_what_nothing_beats():
    a, b, c, d = cost("a", 10, 5), cost("b", 20, 1), cost("c", 30, 2), cost("d", 40, 0)
    tie = cost("tie", 25, 1)
    other = cost("other", 1, 0, way=Way("other", "model", model="brdf1"))
    assert pareto([d, c, tie, other, b, a]) == (a, b, d)
    assert pareto([cost("x", 10, 1, mean=0.5), cost("y", 20, 2, mean=0.1)], "mean")[1].way.name == "y"


# What is shown -------------------------------------------------------------------------------------------


def test_reports_are_json_with_ratios_to_the_reference_and_to_the_fastest():
    report = reports()["XYZ"]
    found = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert len(found["ways"]) == len(report.costs)
    reference, fastest = report.costs[0].ns, min(cost.ns for cost in report.costs)
    for entry in found["ways"]:
        assert entry["to_reference"] == pytest.approx(entry["ns_per_pixel"] / reference)
        assert entry["to_fastest"] == pytest.approx(entry["ns_per_pixel"] / fastest)
        assert set(entry["by_region"]) == {"diffuse", "near-specular", "specular"}
    assert found["exact"] == {
        "by": "float64 reference", "model": "brdf1", "interpolation": "smooth", "slope_method": "affine",
    }  # fmt: skip
    assert found["env"]["litI"] == pytest.approx(np.pi)


def test_tables_have_a_row_for_each_way_and_say_what_is_exact():
    report = reports()["XYZ"]
    shown = text(report).splitlines()
    (head,) = (i for i, line in enumerate(shown) if line.startswith("way "))
    rows = shown[head + 1 : head + 1 + len(report.costs)]
    for entry, row in zip(report.costs, rows, strict=True):
        assert row.startswith(f"{entry.way.name} ")
    assert "Exact is the float64 reference of what was asked for: brdf1, smooth interpolation" in text(report)
    assert any(line.startswith("published interpolation *") for line in shown)
    rows = [line for line in markdown(report).splitlines() if line.startswith("| ")]
    assert len(rows) == len(report.costs) + len(report.backends) + 2
    assert len({row.replace("\\|", "").count("|") for row in rows[: len(report.costs) + 1]}) == 1


def test_pictures():
    report = reports()["XYZ"]
    table = by_name("XYZ")["table 9 trilinear"]
    assert plot_front(report, title="a test", recommended=table, budget=0.5).startswith(PNG)
    assert plot_errors(report, table).startswith(PNG)
