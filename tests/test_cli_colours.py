"""iccbrdf colours."""

import numpy as np
import pytest

from iccbrdf.icc import (
    Header,
    Member,
    NamedColour,
    NamedColours,
    NumberArray,
    Profile,
    TagArray,
    TagStruct,
    Utf8,
    write_profile,
)


def colours(*values):
    return Member("pcs ", NumberArray("fl32", np.array(values, float)))


@pytest.fixture
def ink_file(tmp_path):
    items = (
        TagStruct("tnt0", (colours(95, 1, -2),)),
        TagStruct("nmcl", (Member("name", Utf8("Red")), colours(50, 60, 30))),
        TagStruct("nmcl", (Member("name", Utf8("Deep: red")), colours(30, 50, 20))),
    )
    header = Header(device_class="nmcl", colour_space="", pcs="Lab ")
    path = tmp_path / "inks.icc"
    write_profile(Profile(header, {"ncl2": TagArray("nmcl", items)}), path)
    return str(path)


def test_names(ink_file, run):
    listed = run("colours", "-p", ink_file)
    assert (listed.code, listed.out) == (0, "Red\nDeep: red\n")
    assert run("colours", "-p", ink_file, "--json").json["names"] == ["Red", "Deep: red"]


def test_values(ink_file, run):
    shown = run("colours", "-p", ink_file, "Red", "Deep: red:0.5")
    assert shown.out.splitlines() == [
        "colour\ttint\tL*\ta*\tb*",
        "Red\t1\t50\t60\t30",
        "Deep: red\t0.5\t62.5\t25.5\t9",
    ]
    assert run("colours", "-p", ink_file, "Red:0", "--json").json == {
        "schema": "iccbrdf.colours/1",
        "channels": ["L*", "a*", "b*"],
        "colours": [{"name": "Red", "tint": 0.0, "values": [95.0, 1.0, -2.0]}],
    }


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ("Redd", "no colour 'Redd': did you mean 'Red'?"),
        ("Red:1.5", "'Red:1.5': tint: found '1.5', expected a number from 0 to 1"),
        ("Red:x", "'Red:x': tint: found 'x', expected a number from 0 to 1"),
    ],
)
def test_complaints(ink_file, run, asked, message):
    result = run("colours", "-p", ink_file, asked)
    assert result.code == 2
    assert message in result.err


def test_full_strength_alone(tmp_path, run):
    table = NamedColours((NamedColour("Red", (32640, 32768, 32768)),))
    path = tmp_path / "old.icc"
    header = Header(device_class="nmcl", colour_space="RGB ", pcs="Lab ", version=(4, 3, 0))
    write_profile(Profile(header, {"ncl2": table}), path)
    assert run("colours", "-p", path, "Red").out.splitlines()[1] == "Red\t1\t50\t0\t0"
    refused = run("colours", "-p", path, "Red:0.5")
    assert (refused.code, "'Red:0.5': found a tint, but the profile tells full" in refused.err) == (2, True)
