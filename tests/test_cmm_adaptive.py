"""Chains that run on each tile as little as it calls for; effects that are left out by their channels."""

import pickle

import numpy as np
import pytest
from cmm_examples import mid, mvis, program
from conftest import ROOT

from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.build import build_pair
from iccbrdf.build.effects import EFFECTS
from iccbrdf.cmm import link
from iccbrdf.cmm.adaptive import PIECE, TILE, Adaptive
from iccbrdf.cmm.effects import SUBSTITUTES
from iccbrdf.errors import UsageError
from iccbrdf.icc import NumberArray, read_profile

PROFILES = ROOT / "profiles"
BRDF1 = [read_profile(PROFILES / "fogra39_gloss" / name) for name in ("mid.icc", "mvis.icc")]
COLOUR = [read_profile(PROFILES / "fogra39_gloss" / name) for name in ("colour-mid.icc", "mvis.icc")]
WARD = [read_profile(PROFILES / "ward_painting" / name) for name in ("mid.icc", "mvis.icc")]
CHAINS = {"brdf1": BRDF1, "colour": COLOUR, "ward": WARD}
RELATIVE = 2e-6


def linked(chain, **options):
    options = {"backend": "numpy", "samples": "real", **options}
    return link(chain, effects="full", **options), link(chain, effects="auto", **options)


def scene(names, pixels, *, flat, matte, seed=0):
    """Real values: a relief of up to 20 degrees, or flat; glossy or not."""
    rng = np.random.default_rng(seed)
    image = rng.uniform(0.05, 0.9, (pixels, len(names)))
    normal = np.column_stack([rng.uniform(-0.2, 0.2, (pixels, 2)), np.ones(pixels)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for i, name in enumerate(names):
        if name.startswith("n."):
            axis = "xyz".index(name[2])
            image[:, i] = float(axis == 2) if flat else normal[:, axis]
        if matte and name.startswith("ks"):
            image[:, i] = 0
    return image.astype(np.float32)


def assert_close(one, other):
    """Equal to `RELATIVE`, NaN and infinities included."""
    np.testing.assert_allclose(one, other, rtol=RELATIVE, atol=0)


@pytest.mark.parametrize("chain", CHAINS)
@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize("matte", [True, False])
def test_each_kind_of_tile_gives_the_numbers_of_the_whole_chain(chain, flat, matte):
    full, auto = linked(CHAINS[chain])
    image = scene(full.channels_in, 3000, flat=flat, matte=matte)
    for env in ({}, {"litX": 0.9, "litY": 0.2, "litZ": 0.1}, {"vueX": -0.5, "litZ": 0.0}, {"litZ": -1.0}):
        assert_close(auto.with_env(env)(image), full.with_env(env)(image))


@pytest.mark.parametrize(
    ("flat", "matte", "kind"),
    [
        (True, True, "n constant, ks 0"),
        (True, False, "n constant"),
        (False, True, "ks 0"),
        (False, False, "full"),
    ],
)
def test_tiles_are_of_the_kind_that_they_look(flat, matte, kind):
    _, auto = linked(BRDF1)
    image = scene(auto.channels_in, TILE + 300, flat=flat, matte=matte)
    assert auto.tallied(image)[1] == {kind: len(image)}


def test_every_random_light_and_view_gives_the_numbers_of_the_whole_chain():
    full, auto = linked(BRDF1)
    rng = np.random.default_rng(5)
    images = [scene(full.channels_in, 600, flat=f, matte=m) for f in (0, 1) for m in (0, 1)]
    for _ in range(50):
        names = ("litX", "litY", "litZ", "vueX", "vueY", "vueZ")
        env = dict(zip(names, rng.normal(size=6), strict=True))
        for image in images:
            assert np.array_equal(auto.with_env(env)(image), full.with_env(env)(image))


def test_a_corner_is_of_its_kind_where_the_rest_is_of_another():
    full, auto = linked(BRDF1)
    names = full.channels_in
    image = scene(names, 64 * 1024, flat=False, matte=False).reshape(64, 1024, -1)
    image[:, :512] = scene(names, 64 * 512, flat=True, matte=True).reshape(64, 512, -1)
    results, tally = auto.tallied(image)
    assert np.array_equal(results, full(image))
    assert tally == {"n constant, ks 0": 64 * 512, "full": 64 * 512}


def test_constants_may_differ_from_piece_to_piece():
    full, auto = linked(BRDF1)
    image = scene(full.channels_in, TILE, flat=True, matte=False)
    half = TILE // 2
    image[half:, 7:10] = 0.6, 0.0, 0.8
    results, tally = auto.tallied(image)
    assert np.array_equal(results, full(image))
    assert tally == {"n constant": TILE}
    image[:, 7] = np.repeat(np.linspace(0, 0.3, TILE // PIECE), PIECE)
    results, tally = auto.tallied(image)
    assert np.array_equal(results, full(image))
    # A kernel for so few pixels would take longer than it spares.
    assert tally == {"full": TILE}


def test_one_glossy_pixel_in_a_matte_image_is_not_lost():
    full, auto = linked(BRDF1)
    image = scene(full.channels_in, 2 * TILE, flat=True, matte=True)
    image[:, 6] = 0.1
    env = {"litX": 0.0, "litZ": 1.0}
    for place in (0, 5, PIECE - 1, TILE - 1, TILE + 77, 2 * TILE - 1):
        glossy = image.copy()
        glossy[place, 3] = 0.5
        results = auto.with_env(env)(glossy)
        assert np.array_equal(results, full.with_env(env)(glossy))
        assert results[place, 0] > 1.5 * auto.with_env(env)(image)[place, 0]


def test_one_channel_of_three_that_is_0_is_not_taken_for_all():
    full, auto = linked(BRDF1)
    image = scene(full.channels_in, 1000, flat=True, matte=False)
    image[:, 4] = 0
    results, tally = auto.tallied(image)
    assert np.array_equal(results, full(image))
    assert tally == {"n constant": 1000}


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 3e38, -0.0])
@pytest.mark.parametrize("channel", [0, 3, 6, 7, 9])
def test_what_is_no_number_comes_out_as_in_the_whole_chain(value, channel):
    full, auto = linked(BRDF1)
    for pixels in (700, TILE):
        image = scene(full.channels_in, pixels, flat=True, matte=True)
        image[300, channel] = value
        whole = image.copy()
        whole[:, channel] = value
        for each in (image, whole):
            np.testing.assert_array_equal(auto(each), full(each))


@pytest.mark.parametrize("normal", [(1, 0, 0), (0, 0, 0), (0.6, 0, -0.8), (1, 0, 1e-8)])
def test_normals_at_and_below_the_horizon(normal):
    full, auto = linked(BRDF1)
    for matte in (True, False):
        image = scene(full.channels_in, 900, flat=True, matte=matte)
        image[:, 7:] = normal
        assert np.array_equal(auto(image), full(image))


def test_encoded_images_are_of_the_same_kinds():
    full, auto = linked(BRDF1, samples="device")
    image = scene(full.channels_in, 1000, flat=True, matte=True)
    image[:, 7:] = (image[:, 7:] + 1) / 2
    results, tally = auto.tallied(image)
    assert np.array_equal(results, full(image))
    assert tally == {"n constant, ks 0": 1000}
    # 16 bits have no 0: the normal is as constant.
    image[:, 7:9] = np.float32(32768 / 65535)
    results, tally = auto.tallied(image)
    assert np.array_equal(results, full(image))
    assert tally == {"n constant, ks 0": 1000}


def test_pixels_of_one_colour_are_interpolated_once():
    full, auto = linked(COLOUR)
    image = scene(full.channels_in, 1000, flat=False, matte=False)
    image[:500] = image[0]
    results, tally = auto.tallied(image[:512])
    assert set(tally) == {"full"}
    results, tally = auto.tallied(image[:500])
    assert_close(results, full(image[:500]))
    assert set(tally) == {"n constant, X, Y, Z constant"}


def test_profiles_of_others_are_specialised_too():
    """A gain g, an offset o and a mask k between two profiles that know nothing of ours."""
    names = ("g", "o", "k", "a.1", "a.2")
    text = " ".join(
        f"in(3) exp in(4) exp mul sin in(0) mul in(1) {op} in(2) div out({i})"
        for i, op in enumerate(("add", "sub", "mul"))
    )
    chain = [mid(names), mvis(names, M2B0=program(text, 5, 3))]
    full, auto = linked(chain, samples="device", dtype=np.float64)
    assert isinstance(auto.execution, Adaptive)
    rng = np.random.default_rng(3)
    kinds = set()
    for constant in [(), (3, 4), (0,), (2,), (1, 2), (0, 3, 4), (0, 1, 2, 3, 4)]:
        image = rng.uniform(-1, 1, (1000, 5))
        image[:, list(constant)] = rng.choice([0.0, 0.5, -1.0], len(constant))
        results, tally = auto.tallied(image)
        np.testing.assert_allclose(results, full(image), rtol=1e-14)
        kinds |= set(tally)
    assert len(kinds) > 2


def test_the_sign_of_a_zero_that_is_divided_by_is_kept():
    names = ("a.1", "b.1")
    heavy = "in(0) exp in(0) sin mul in(0) cos mul in(0) 0.3 pow mul in(0) tan mul "
    chain = [mvis(names, M2B0=program(heavy + "1 in(1) div add copy(1,2) out(0,3)", 2, 3))]
    full, auto = linked(chain, samples="device")
    image = np.full((1000, 2), 0.5, np.float32)
    image[:, 1] = np.where(np.arange(1000) % 3, 0.0, -0.0)
    results = auto(image)
    np.testing.assert_array_equal(results, full(image))
    assert np.isinf(results).all()
    assert {*np.sign(results[:, 0])} == {1.0, -1.0}


def test_threads_and_pickles():
    full, auto = linked(BRDF1)
    image = scene(full.channels_in, 5 * TILE + 9, flat=True, matte=True)
    image[2 * TILE :, 3] = 0.2
    threaded = pickle.loads(pickle.dumps(linked(BRDF1, threads=4)[1]))
    results, tally = threaded.tallied(image)
    assert np.array_equal(results, full(image))
    assert tally == auto.tallied(image)[1]
    assert tally.total() == len(image)


def test_there_are_few_kinds_and_few_kernels():
    _, auto = linked(BRDF1)
    rng = np.random.default_rng(0)
    for seed in range(30):
        image = scene(auto.channels_in, 500, flat=seed % 2, matte=seed % 3, seed=seed)
        image[:, 6] *= rng.uniform(0, 4)
        auto.with_env({"litX": float(rng.normal()), "litZ": float(rng.normal())})(image)
    kinds = auto.execution.kinds
    assert 1 <= len(kinds) <= 8
    assert all(len(kind.specials) <= 3 for kind in kinds.values())


def test_passes_report_what_they_did():
    _, auto = linked(BRDF1)
    auto(scene(auto.channels_in, 500, flat=True, matte=True))
    kind = next(k for k in auto.execution.kinds.values() if k.name == "n constant, ks 0")
    assert kind.reports[0].name == "hold channels"
    assert dict(kind.reports[0].changes) == {"constant channel": 3, "channel that is 0": 3}
    folding = kind.specials[0].reports[0]
    assert folding.name == "fold what is decided"
    assert folding.after < 0.7 * folding.before
    assert {"product with 0", "sum with 0"} <= dict(folding.changes).keys()


def test_the_interpreter_runs_everything():
    image = scene(BRDF1_NAMES, 300, flat=True, matte=True)
    auto = link(BRDF1, effects="auto", samples="real", backend="interpreter")
    assert auto.tallied(image)[1] == {"full": 300}


BRDF1_NAMES = ("kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m", "n.x", "n.y", "n.z")


def test_llvm_gives_the_numbers_of_the_whole_chain():
    pytest.importorskip("llvmlite")
    full, auto = linked(COLOUR, backend="llvm")
    kinds = set()
    for flat in (True, False):
        image = scene(full.channels_in, TILE, flat=flat, matte=False)
        image[: TILE // 2, :3] = 0.3
        results, tally = auto.tallied(image)
        assert_close(results, full(image))
        kinds |= set(tally)
    # A flat print alone spares less than it takes to look.
    assert kinds == {"full", "n constant, X, Y, Z constant"}


# Effects that are left out -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def primaries():
    return {
        "brdf1": read_primaries(PROFILES / "fogra39_gloss" / "primaries.json"),
        "ward": read_primaries(PROFILES / "ward_painting" / "primaries.json"),
    }


def test_the_effects_are_those_of_the_build():
    assert list(SUBSTITUTES) == list(EFFECTS)


@pytest.mark.parametrize("effect", ["relief", "specular", "chromatic-specular"])
@pytest.mark.parametrize("backend", ["interpreter", "numpy"])
def test_an_effect_left_out_by_channels_is_that_left_out_of_the_program(effect, backend, primaries):
    image = scene(BRDF1_NAMES, 400, flat=False, matte=False)
    pair = build_pair(primaries["brdf1"], without=[effect])
    reduced = link([pair.mid, pair.mvis], samples="real", backend=backend)
    columns = [BRDF1_NAMES.index(name) for name in reduced.channels_in]
    wanted = reduced(image[:, columns])
    full = build_pair(primaries["brdf1"])
    options = {"samples": "real", "backend": backend}
    found = link([full.mid, full.mvis], without=[effect], **options)(image)
    np.testing.assert_allclose(found, wanted, rtol=RELATIVE)
    # It does something.
    assert not np.allclose(found, link([full.mid, full.mvis], **options)(image), rtol=1e-3)
    auto = link([full.mid, full.mvis], without=[effect], effects="auto", **options)
    assert_close(auto(image), found)


def test_chromatic_roughness_is_that_of_Y():
    names = ("m.X", "m.Y", "m.Z")
    chain = [mid(names), mvis(names)]
    pixel = [[0.1, 0.2, 0.3]]
    np.testing.assert_array_equal(
        link(chain, without=["chromatic_roughness"])(pixel), np.full((1, 3), np.float32(0.2))
    )


def test_names_say_what_to_have():
    image = scene(BRDF1_NAMES, 300, flat=False, matte=False)
    options = {"samples": "real", "backend": "numpy"}
    kept = link(BRDF1, effects=["relief", "chromatic-specular"], **options)(image)
    assert np.array_equal(
        kept, link(BRDF1, without=["specular", "chromatic-roughness"][:1], **options)(image)
    )
    all_four = link(BRDF1, effects=[name for name, c in SUBSTITUTES.items() if c], **options)(image)
    assert np.array_equal(all_four, link(BRDF1, **options)(image))


def test_a_channel_that_comes_from_a_default_is_left_out_too():
    chain = [
        mid(("kd.X", "kd.Y", "kd.Z")),
        mvis(
            ("kd.X", "kd.Y", "kd.Z", "n.z"),
            defaults=NumberArray("fl32", np.array([0, 0, 0, 0.5])),
            M2B0=program("in(0,3) in(3) smul(3) out(0,3)", 4, 3),
        ),
    ]
    pixel = [[0.2, 0.4, 0.6]]
    np.testing.assert_array_equal(link(chain)(pixel), np.float32([[0.1, 0.2, 0.3]]))
    np.testing.assert_array_equal(link(chain, without=["relief"])(pixel), np.float32([[0.2, 0.4, 0.6]]))


@pytest.mark.parametrize("effect", ["fresnel", "below-horizon", "highlight_range", "slope"])
def test_an_effect_of_a_program_is_one_for_build(effect):
    with pytest.raises(UsageError, match="iccbrdf build --without " + effect.replace("_", "-")):
        link(BRDF1, without=[effect])


def test_unknown_names_are_refused():
    with pytest.raises(UsageError, match=r"'releif': .*relief"):
        link(BRDF1, effects=["releif"])
    with pytest.raises(UsageError, match=r"effects 'fast' is unknown: .*auto"):
        link(BRDF1, effects="fast")
    with pytest.raises(UsageError, match="expected names"):
        link(BRDF1, without="relief")


def test_gloss_in_one_channel_is_not_left_out_by_halves():
    with pytest.raises(UsageError, match=r"specular cannot be left out here.*ks\.X"):
        link(WARD, effects=["relief"])
    with pytest.raises(UsageError, match="chromatic-roughness cannot be left out"):
        link(BRDF1, without=["chromatic-roughness"])
