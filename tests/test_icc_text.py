import json

import numpy as np
from icc_examples import a_mid, an_mvis

from iccbrdf.calc.program import listing
from iccbrdf.icc import Header, NumberArray, Profile, Utf8, describe, to_dict


def test_dict_of_an_mvis():
    profile = Profile.from_bytes(an_mvis().to_bytes(), "a.icc")
    data = to_dict(profile)
    assert data["source"] == "a.icc"
    assert data["header"]["mcs"] == "mc0002"
    assert data["header"]["size"] == len(profile.to_bytes())
    tag = data["tags"]["mcta"]
    assert tag["offset"] == profile.tag_offset("mcta")
    assert tag["size"] == len(profile.tag_data("mcta"))
    assert [item["text"] for item in tag["items"]] == ["kd.X", "kd.Y"]
    assert data["tags"]["svcn"]["observer_table"] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
    assert data["tags"]["mdv "]["values"] == [65535, 0]
    element = data["tags"]["M2B0"]["elements"][0]
    assert element["signature"] == "matf"
    assert (element["inputs"], element["outputs"]) == (2, 3)
    assert element["matrix"] == [[1, 0], [0, 1], [0.5, 0.5]]
    assert json.loads(json.dumps(data, allow_nan=False)) == data


def test_programs_are_listed_by_the_caller():
    calculator = to_dict(a_mid(), listing=listing)["tags"]["A2M0"]["elements"][2]
    assert calculator["program"] == listing(a_mid()["A2M0"].elements[2].program).splitlines()
    assert to_dict(a_mid())["tags"]["A2M0"]["elements"][2]["program"] == {"operations": 7}


def test_long_arrays_are_summarised():
    profile = Profile(Header(device_class="mid "), {"long": NumberArray("fl32", np.arange(100) / 10)})
    assert to_dict(profile, longest=3)["tags"]["long"]["values"] == {
        "shape": [100],
        "minimum": 0,
        "maximum": 9.9,
        "first": [0, 0.1, 0.2],
    }


def test_numbers_that_JSON_has_not():
    profile = Profile(
        Header(device_class="mid "), {"odd ": NumberArray("fl64", [np.nan, np.inf, -np.inf, 0.1])}
    )
    assert to_dict(profile)["tags"]["odd "]["values"] == ["NaN", "Infinity", "-Infinity", 0.1]


def test_text():
    profile = Profile.from_bytes(a_mid().to_bytes(), "a.icc")
    lines = describe(profile, listing=listing).splitlines()
    assert "  colour_space      nc0002" in lines
    assert f"    offset            {profile.tag_offset('A2M0')}" in lines
    assert "        text              A MID" in lines
    assert any(line.strip().startswith("in(0,2) mtx(0)") for line in lines)


def test_a_malformed_tag_is_shown_as_such():
    data = bytearray(Profile(Header(device_class="mid "), {"desc": Utf8("a"), "cprt": Utf8("b")}).to_bytes())
    data[164] = 0xFF
    profile = Profile.from_bytes(bytes(data), "a.icc")
    assert to_dict(profile)["tags"]["desc"]["error"].startswith("a.icc: tag desc (utf8): byte offset 164: ")
    assert to_dict(profile)["tags"]["cprt"]["text"] == "b"
    assert "error" in describe(profile)


def test_text_from_a_profile_moves_no_terminal():
    profile = Profile(Header(device_class="mid "), {"desc": Utf8("a\x1b[2J\nb")})
    assert "    text              'a\\x1b[2J\\nb'" in describe(profile).splitlines()
