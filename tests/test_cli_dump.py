"""iccbrdf dump: what a profile holds."""

import pytest

from iccbrdf.calc import listing, parse
from iccbrdf.icc import CompressedUtf8, read_profile, write_profile
from iccbrdf.icc.source_tag import read_source
from iccbrdf.resources import folder

MVIS = folder("profiles") / "fogra39_gloss" / "mvis.icc"


def test_text_shows_header_tags_and_program(run):
    result = run("dump", MVIS)
    assert (result.code, result.err) == (0, "")
    lines = [line.strip() for line in result.out.splitlines()]
    assert "device_class      mvis" in lines
    for tag in ("desc", "mcta", "mdv", "wtpt", "M2B0"):
        assert tag in lines
    profile = read_profile(MVIS)
    program = profile["M2B0"].elements[0].program
    (calculator,) = read_source(profile).calculators
    for line in listing(program, calculator.temporaries).splitlines():
        assert line.strip() in lines


def test_json(run):
    result = run("dump", MVIS, "--json")
    assert (result.code, result.err) == (0, "")
    dumped = result.json
    assert dumped["schema"] == "iccbrdf.dump/1"
    assert dumped["header"]["device_class"] == "mvis"
    assert dumped["tags"]["wtpt"]["size"] == 20
    program = read_profile(MVIS)["M2B0"].elements[0].program
    lines = dumped["tags"]["M2B0"]["elements"][0]["program"]
    assert parse("\n".join(lines)) == program
    assert [line.split("% ")[1] for line in lines if "%" in line][:3] == ["n i", "v", "cos_i cos_v"]


def test_what_a_profile_is_compiled_from_comes_back(run):
    template = (folder("calc_templates") / "cook_torrance.calc").read_text().splitlines()
    lines = run("dump", MVIS).out.splitlines()
    source = [line.removeprefix("  ") for line in lines[lines.index("source of tag M2B0, element 0") + 1 :]]
    start = source.index("cook_torrance.calc:") + 1
    assert source[start : start + len(template)] == template
    assert "inputs kd.X kd.Y kd.Z ks.X ks.Y ks.Z m n.x n.y n.z" in source
    assert {"outputs X Y Z", "fresnel_angle = theta_i", "white = 0.9642 1 0.8249"} <= set(source)
    assert {"fresnel = on", "chromatic_roughness = off"} <= set(source)
    assert "litX = -0.707107 where it is not set" in source
    made_from = run("dump", MVIS, "--json").json["made_from"]
    assert made_from["calculators"][0]["templates"][0]["source"][:-1] == template
    assert made_from["recipe"]["refractive_index"] == 1.5


def test_a_source_that_cannot_be_read_hinders_nothing(run, tmp_path):
    path = tmp_path / "odd.icc"
    write_profile(read_profile(MVIS).replace(tags={"bsrc": CompressedUtf8.of("{")}), path)
    result = run("dump", path)
    assert result.code == 0
    assert "tag bsrc: " in result.err
    assert "source of" not in result.out


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read: No such file"),
        (b"", "byte offset 0"),
        (b"\x89PNG" + bytes(200), "byte offset"),
        (MVIS.read_bytes()[:700], "byte offset"),
    ],
)
def test_unreadable_files(run, tmp_path, content, message):
    path = tmp_path / "odd.icc"
    if content is not None:
        path.write_bytes(content)
    result = run("dump", path, "--json")
    assert result.code == result.json["exit_code"] == 3
    assert f"{path}: " in result.err
    assert message in result.err
    assert "Traceback" not in result.err


def test_folder(run, tmp_path):
    assert run("dump", tmp_path).code == 3


def test_damaged_tag_is_shown_beside_the_sound_ones(run, tmp_path):
    data = bytearray(MVIS.read_bytes())
    offset = read_profile(MVIS).tag_offset("mcta")
    data[offset + 12 : offset + 16] = b"\xff\xff\xff\xff"  # the number of its items
    path = tmp_path / "odd.icc"
    path.write_bytes(data)
    result = run("dump", path, "--json")
    assert result.code == 0
    assert "mcta" in result.json["tags"]["mcta"]["error"]
    assert result.json["tags"]["mdv "]["signature"] == "fl32"
