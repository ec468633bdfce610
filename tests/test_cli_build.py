"""iccbrdf build: primaries -> profiles."""

import os

import numpy as np
import pytest
from conftest import comparable

import iccbrdf
from iccbrdf.brdf.geometry import direction
from iccbrdf.resources import folder

PRIMARIES = folder("profiles") / "fogra39_gloss" / "primaries.json"
WARD = folder("profiles") / "ward_painting" / "primaries.json"
SLOPES = PRIMARIES.with_name("slopes.json")
PAIR = ["mid.icc", "mvis.icc", "mvis.txt"]
FILES = [*PAIR, "colour-mid.icc", "colour-mid.txt"]


def samples(channels: int) -> np.ndarray:
    device = np.random.default_rng(1).random((500, channels), np.float32)
    device[:, -3:-1] = device[:, -3:-1] * 0.4 + 0.3
    device[:, -1] = 1
    return device


def transform(path, **options):
    return iccbrdf.link([path / "mid.icc", path / "mvis.icc"], **options)


def environment(light, view) -> dict[str, float]:
    return dict(zip(("litX", "litY", "litZ", "vueX", "vueY", "vueZ"), (*light, *view), strict=True))


def test_text_and_files(run, tmp_path):
    result = run("build", PRIMARIES, "-o", tmp_path / "new" / "out", "--slopes", SLOPES)
    assert (result.code, result.err) == (0, "")
    assert sorted(os.listdir(tmp_path / "new" / "out")) == sorted(FILES)
    assert result.out.startswith("brdf1: 144 operators, at most 142 run for a pixel\n")
    for name in FILES:
        assert str(tmp_path / "new" / "out" / name) in result.out
        made, shipped = tmp_path / "new" / "out" / name, PRIMARIES.with_name(name)
        assert comparable(made.read_bytes()) == comparable(shipped.read_bytes())


def test_json(run, tmp_path):
    result = run("build", PRIMARIES, "-o", tmp_path, "--json")
    assert (result.code, result.err) == (0, "")
    built = result.json
    assert built["schema"] == "iccbrdf.build/1"
    assert built["model"] == "brdf1"
    assert built["effects"] == [
        "specular", "fresnel", "shadowing", "chromatic-specular", "relief", "below-horizon",
        "highlight-range", "interpolation",
    ]  # fmt: skip
    assert built["channels"] == ["kd.X", "kd.Y", "kd.Z", "ks.X", "ks.Y", "ks.Z", "m", "n.x", "n.y", "n.z"]
    assert built["variables"]["litI"] == np.pi
    assert built["files"] == [str(tmp_path / name) for name in FILES]


def test_effects_and_without_say_the_same(run, tmp_path):
    fewer = run("build", PRIMARIES, "-o", tmp_path / "a", "--without", "fresnel, shadowing", "--json").json
    chosen = "specular,chromatic-specular,relief,below-horizon,highlight-range,interpolation"
    run("build", PRIMARIES, "-o", tmp_path / "b", "--effects", chosen.replace("-", "_"))
    assert fewer["effects"] == chosen.split(",")
    assert fewer["executed"] < 134
    assert (tmp_path / "a" / "mvis.icc").read_bytes() == (tmp_path / "b" / "mvis.icc").read_bytes()


def test_no_effects_is_a_flat_diffuser(run, tmp_path):
    built = run("build", PRIMARIES, "-o", tmp_path, "--effects", "", "--json").json
    assert (built["effects"], built["channels"]) == ([], ["kd.X", "kd.Y", "kd.Z"])
    # Lit at 45 degrees with the irradiance pi: kd times the cosine.
    assert transform(tmp_path)([[0.2, 0.4, 0.8]]) == pytest.approx(np.sqrt([[0.02, 0.08, 0.32]]))


def test_profiles_may_do_without_their_source(run, tmp_path):
    assert run("build", PRIMARIES, "-o", tmp_path, "--no-source").code == 0
    for name in ("mid.icc", "mvis.icc", "colour-mid.icc"):
        small, full = iccbrdf.read_profile(tmp_path / name), iccbrdf.read_profile(PRIMARIES.with_name(name))
        assert "bsrc" in full
        assert "bsrc" not in small
        assert len(small.to_bytes()) < len(full.to_bytes())


def test_light_and_view_become_the_defaults(run, tmp_path):
    scene = ["--light", "60,90", "--view", "0.1,0,0.9", "--env", "litI=2"]
    built = run("build", PRIMARIES, "-o", tmp_path, *scene, "--json").json
    light, view = direction(60, 90), np.array([0.1, 0, 0.9])
    assert [built["variables"][f"lit{axis}"] for axis in "XYZ"] == pytest.approx(light, abs=1e-7)
    env = {**environment(light, view), "litI": 2.0}
    plain = transform(PRIMARIES.parent, env=env, dtype="float64")
    device = samples(10)
    assert transform(tmp_path, dtype="float64")(device) == pytest.approx(plain(device), rel=1e-5)


def test_fresnel_angle_alpha_is_reciprocal(run, tmp_path):
    assert run("build", PRIMARIES, "-o", tmp_path, "--fresnel-angle", "alpha").code == 0
    device = samples(10)
    device[:, :3] = 0  # the specular term alone
    normals = 2 * device[:, -3:].astype(np.float64) - 1
    light, view = (0.6, 0.0, 0.8), (0.0, 0.1, np.sqrt(0.99))
    for profiles, reciprocal in ((tmp_path, True), (PRIMARIES.parent, False)):
        forth, back = (
            transform(profiles, env=environment(*vectors), dtype="float64")(device)
            / (normals @ vectors[0])[:, None]
            for vectors in ((light, view), (view, light))
        )
        assert np.allclose(forth, back, rtol=1e-9) is reciprocal


def test_the_exact_geometry_changes_only_what_is_grazed(run, tmp_path):
    assert run("build", PRIMARIES, "-o", tmp_path, "--geometry", "exact").code == 0
    device = samples(10)
    normals = 2 * device[:, -3:].astype(np.float64) - 1
    light, view = np.array([-0.6, 0, 0.8]), np.array([0.9, 0.1, 0.3])
    env = environment(light, view)
    plain, exact = (transform(profiles, env=env)(device) for profiles in (PRIMARIES.parent, tmp_path))
    cosines = normals @ np.column_stack([light, view / np.linalg.norm(view)])
    cosines /= np.linalg.norm(normals, axis=1, keepdims=True)
    grazed = cosines.min(axis=1) < 1 / 16
    assert np.array_equal(plain[~grazed], exact[~grazed])
    assert not np.array_equal(plain[grazed], exact[grazed])
    # What is left of the plain one's errors at random is small.
    np.testing.assert_allclose(plain, exact, rtol=1e-3)


@pytest.mark.parametrize(
    ("primaries", "options", "code", "message"),
    [
        (PRIMARIES, ["--without", "fresnell"], 2, "has no effect 'fresnell': did you mean 'fresnel'?"),
        (PRIMARIES, ["--effects", "specular,Shadowin"], 2, "did you mean 'shadowing'?"),
        (PRIMARIES, ["--effects", "specular", "--without", "fresnel"], 2, "give one of them"),
        (WARD, ["--fresnel-angle", "alpha"], 2, "isotropic Ward 2020 has no Fresnel term"),
        (PRIMARIES, ["--env", "litQ=1"], 2, "no run-time variable 'litQ': did you mean 'litZ'?"),
        (PRIMARIES, ["--light", "60"], 2, "expected ZENITH,AZIMUTH"),
        (PRIMARIES.with_name("primarys.json"), [], 3, "primarys.json: cannot be read"),
        (PRIMARIES.with_name("mid.icc"), [], 3, "is not a JSON file"),
        (PRIMARIES.parent, [], 3, "cannot be read"),
    ],
)
def test_errors_leave_no_folder(run, tmp_path, primaries, options, code, message):
    result = run("build", primaries, "-o", tmp_path / "out", *options, "--json")
    assert result.code == result.json["exit_code"] == code
    assert message in result.json["error"]
    assert "Traceback" not in result.err
    assert os.listdir(tmp_path) == []


def test_folder_that_cannot_be_made(run, tmp_path):
    (tmp_path / "file").write_text("")
    for target in (tmp_path / "file", tmp_path / "file" / "out"):
        result = run("build", PRIMARIES, "-o", target)
        assert (result.code, result.out) == (2, "")
        assert str(target) in result.err


@pytest.mark.parametrize("existing", FILES)
def test_nothing_is_overwritten_unasked(run, tmp_path, existing):
    (tmp_path / existing).write_text("mine")
    result = run("build", PRIMARIES, "-o", tmp_path, "--slopes", SLOPES)
    assert (result.code, result.out) == (2, "")
    assert f"{tmp_path / existing}: exists already" in result.err
    assert os.listdir(tmp_path) == [existing]
    assert (tmp_path / existing).read_text() == "mine"

    assert run("build", PRIMARIES, "-o", tmp_path, "--slopes", SLOPES, "--force").code == 0
    assert sorted(os.listdir(tmp_path)) == sorted(FILES)
    shipped = PRIMARIES.with_name(existing).read_bytes()
    assert comparable((tmp_path / existing).read_bytes()) == comparable(shipped)


def test_all_files_or_none(run, tmp_path):
    run("build", PRIMARIES, "-o", tmp_path, "--without", "fresnel")
    before = (tmp_path / "mvis.icc").read_bytes()
    (tmp_path / "mvis.txt").unlink()
    (tmp_path / "mvis.txt").mkdir()
    result = run("build", PRIMARIES, "-o", tmp_path, "--force")
    assert result.code == 2
    assert "mvis.txt: cannot be written: it is not a regular file" in result.err
    assert sorted(os.listdir(tmp_path)) == sorted(FILES)
    assert (tmp_path / "mvis.icc").read_bytes() == before


def test_fewer_than_four_primaries_make_no_colour_mid(run, tmp_path):
    result = run("build", WARD, "-o", tmp_path / "pair")
    assert (result.code, result.err) == (0, "")
    assert sorted(os.listdir(tmp_path / "pair")) == PAIR
    assert "no colour MID: 1 primaries, 4 are needed" in result.out

    asked = run("build", WARD, "-o", tmp_path / "colour", "--interpolation", "smooth")
    assert (asked.code, asked.out) == (3, "")
    assert "4 to 16" in asked.err
    assert not (tmp_path / "colour").exists()


def test_a_slope_method_needs_slopes(run, tmp_path):
    result = run("build", PRIMARIES, "-o", tmp_path / "out", "--slope-method", "published")
    assert (result.code, result.out) == (2, "")
    assert "--slopes" in result.err


def test_slopes_under_another_light_are_refused(run, tmp_path):
    text = SLOPES.read_text().replace('"D50"', '"D65"')
    (tmp_path / "slopes.json").write_text(text)
    result = run("build", PRIMARIES, "-o", tmp_path / "out", "--slopes", tmp_path / "slopes.json")
    assert (result.code, result.out) == (3, "")
    assert "illuminant: found 'D65', expected that of the primaries, 'D50'" in result.err


def test_tables_and_their_errors(run, tmp_path):
    result = run("build", PRIMARIES, "-o", tmp_path, "--table", "17", "--json")
    assert (result.code, result.err) == (0, "")
    assert {"table-v4.icc", "table-mid.icc", "tables.txt"} <= set(os.listdir(tmp_path))
    v4, mid = result.json["tables"]
    assert set(v4["tags"]) == {"B2A0", "B2D0"}
    assert 0 < mid["tags"]["A2M0"]["kd"]["mean"] < 0.02
    by_table = iccbrdf.link([tmp_path / "table-mid.icc", tmp_path / "mvis.icc"])
    exact = iccbrdf.link([tmp_path / "colour-mid.icc", tmp_path / "mvis.icc"])
    values = np.random.default_rng(2).uniform(0.1, 0.4, (200, 6))
    values[:, 3:] = (0.5, 0.5, 1)
    assert np.abs(by_table(values) / exact(values) - 1).max() < 0.02


def test_tables_hold_the_published_weights_only(run, tmp_path):
    wrong = ["--table", "17", "--interpolation", "published", "--exponent", "1"]
    result = run("build", PRIMARIES, "-o", tmp_path, *wrong)
    assert (result.code, os.listdir(tmp_path)) == (2, [])
