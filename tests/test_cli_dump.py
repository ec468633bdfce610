"""iccbrdf dump: what a profile holds."""

import pytest

from iccbrdf.calc import listing
from iccbrdf.icc import read_profile
from iccbrdf.resources import folder

MVIS = folder("profiles") / "fogra39_gloss" / "mvis.icc"


def test_text_shows_header_tags_and_program(run):
    result = run("dump", MVIS)
    assert (result.code, result.err) == (0, "")
    lines = [line.strip() for line in result.out.splitlines()]
    assert "device_class      mvis" in lines
    for tag in ("desc", "mcta", "mdv", "wtpt", "M2B0"):
        assert tag in lines
    program = read_profile(MVIS)["M2B0"].elements[0].program
    for line in listing(program).splitlines():
        assert line.strip() in lines


def test_json(run):
    result = run("dump", MVIS, "--json")
    assert (result.code, result.err) == (0, "")
    dumped = result.json
    assert dumped["schema"] == "iccbrdf.dump/1"
    assert dumped["header"]["device_class"] == "mvis"
    assert dumped["tags"]["wtpt"]["size"] == 20
    program = read_profile(MVIS)["M2B0"].elements[0].program
    assert dumped["tags"]["M2B0"]["elements"][0]["program"] == listing(program).splitlines()


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
