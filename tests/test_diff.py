"""iccbrdf diff: what must change for one profile to become another."""

import json
from dataclasses import replace

import numpy as np
import pytest
from cmm_examples import WHITE, matrix, mid, mvis, program
from validate_examples import laid_out, sound_mid, sound_mvis, tag_patched, tags_of

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.calc import listing
from iccbrdf.cmm.agreement import agreement
from iccbrdf.errors import LinkError
from iccbrdf.icc import (
    Clut,
    CompressedUtf8,
    CurveSet,
    FormulaSegment,
    Matrix,
    Mluc,
    MultiProcess,
    NumberArray,
    Profile,
    SegmentedCurve,
    Unknown,
)
from iccbrdf.icc.compare import compare


def differences(a, b):
    return compare(a, b, listing=listing)


def only(a, b):
    (found,) = differences(a, b)
    return found


def transforming(*elements):
    return sound_mid(A2M0=MultiProcess(2, 2, elements))


def test_a_profile_equals_itself():
    assert differences(sound_mvis(), sound_mvis()) == []


def test_layout_does_not_count():
    """Order of the tags, padding, size and profile ID follow from how the file is written."""
    profile = sound_mvis()
    data = laid_out(profile.header, [*reversed(tags_of(profile).items())]) + bytes(4)
    other = Profile.from_bytes((len(data)).to_bytes(4, "big") + data[4:])
    assert other.to_bytes() != profile.to_bytes()
    assert differences(profile, other) == []


def test_header_fields():
    profile = sound_mid()
    found = only(profile, profile.replace(header=replace(profile.header, rendering_intent=3)))
    assert (found.place, found.change, found.message) == ("header, rendering_intent", "changed", "1 -> 3")
    assert found.data == {"a": 1, "b": 3}


def test_tags_added_and_removed():
    profile = sound_mvis()
    added, removed = (
        only(profile, profile.replace(tags={"lumi": NumberArray("fl32", [1])})),
        only(profile, profile.replace(remove=["wtpt"])),
    )
    assert (added.place, added.change, added.message) == ("tag lumi", "added", "12 bytes")
    assert (removed.place, removed.change, removed.message) == ("tag wtpt", "removed", "20 bytes")


def test_texts():
    found = only(sound_mid(), sound_mid(desc=Mluc.of("Another example")))
    assert found.place == "tag desc, texts[0], text"
    assert found.message == "'An example' -> 'Another example'"


def test_matrices():
    found = only(transforming(Matrix.of([[1, 2], [3, 4]])), transforming(Matrix.of([[1, 2.5], [3.25, 4]])))
    assert found.place == "tag A2M0, elements[0] (matf), matrix"
    assert found.message == "2 of 4 numbers differ, by at most 0.5"
    assert found.data == {"differing": 2, "of": 4, "largest": 0.5}


def test_numbers_that_are_not_finite():
    first, second = ([np.nan, np.inf, 1, 2], [np.nan, 5, 1, 2.5])
    found = only(sound_mvis(zzzz=NumberArray("fl32", first)), sound_mvis(zzzz=NumberArray("fl32", second)))
    assert found.message == "2 of 4 numbers differ, by at most 0.5; 1 are not finite on one side"
    assert found.data["largest"] == 0.5


def test_shapes_of_tables():
    found = only(transforming(Clut(np.zeros((2, 2, 2)))), transforming(Clut(np.zeros((2, 3, 2)))))
    assert found.message == "shape (2, 2, 2) -> (2, 3, 2)"


def test_parameters_of_curves():
    def curves(gamma):
        curve = SegmentedCurve((), (FormulaSegment(0, (gamma, 1, 0, 0)),))
        return transforming(CurveSet((curve, SegmentedCurve((), (FormulaSegment(0, (1, 1, 0, 0)),)))))

    found = only(curves(2), curves(2.5))
    assert found.place == "tag A2M0, elements[0] (cvst), curves[0] (curf), segments[0] (parf), parameters"
    assert found.message.endswith("1 of 4 numbers differ, by at most 0.5")


def test_elements_added_removed_and_of_another_type():
    one, two = Matrix.of(np.eye(2)), Matrix.of(np.eye(2) * 2)
    added = only(transforming(one), transforming(one, two))
    assert (added.place, added.change) == ("tag A2M0, elements[1] (matf)", "added")
    assert only(transforming(one, two), transforming(one)).change == "removed"
    other = only(transforming(one), transforming(Clut(np.zeros((2, 2, 2)))))
    assert (other.place, other.message) == ("tag A2M0, elements[0] (matf)", "matf -> clut")


def test_types_of_tags():
    found = only(sound_mid(zzzz=Mluc.of("a")), sound_mid(zzzz=NumberArray("fl32", [1])))
    assert (found.place, found.message) == ("tag zzzz", "mluc -> fl32")


def test_bytes_of_unknown_types():
    first, second = (sound_mid(zzzz=Unknown("zzzz", bytes(4), data)) for data in (b"abcd", b"abxdef"))
    found = only(first, second)
    assert (found.place, found.message) == ("tag zzzz, data", "4 -> 6 bytes, alike up to byte 2")


def test_compressed_texts_by_lines():
    first, second = (sound_mid(zzzz=CompressedUtf8.of(text)) for text in ("a\nb\nc\n", "a\nB\nc\n"))
    found = only(first, second)
    assert (found.place, found.message) == ("tag zzzz", "3 -> 3 lines")
    assert found.lines[2:] == ("@@ -1,3 +1,3 @@", " a", "-b", "+B", " c")


def test_compressed_json_by_keys():
    def source(**recipe):
        return sound_mid(bsrc=CompressedUtf8.of(json.dumps({"recipe": recipe, "same": [1, {"a": None}]})))

    nodes = [{"name": "Cyan", "XYZ": [0.1, 0.2, 0.3]}, {"name": "Red", "XYZ": [0.3, 0.2, 0.1]}]
    first = source(index=1.5, without=[], table=[[1, 2], [3, 4]], nodes=nodes, gone=True)
    nodes = [nodes[0], {"name": "Red", "XYZ": [0.3, 0.25, 0.1]}, {"name": "Blue"}]
    second = source(index=1.6, without=["gloss"], table=[[1, 2], [3.5, 4]], nodes=nodes, new={})
    assert [(d.place, d.change, d.message) for d in differences(first, second)] == [
        ("tag bsrc, recipe, index", "changed", "1.5 -> 1.6"),
        ("tag bsrc, recipe, without", "changed", "[] -> ['gloss']"),
        ("tag bsrc, recipe, table", "changed", "1 of 4 numbers differ, by at most 0.5"),
        (
            "tag bsrc, recipe, nodes[1], XYZ",
            "changed",
            "[0.3, 0.2, 0.1] -> [0.3, 0.25, 0.1], 1 of 3 numbers differ, by at most 0.05",
        ),
        ("tag bsrc, recipe, nodes[2]", "added", "{'name': 'Blue'}"),
        ("tag bsrc, recipe, gone", "removed", "True"),
        ("tag bsrc, recipe, new", "added", "{}"),
    ]


@pytest.mark.parametrize("data", [b"no zlib", CompressedUtf8.of("[" * 100_000).data])
def test_compressed_texts_that_cannot_be_read(data):
    found = only(sound_mid(bsrc=CompressedUtf8.of("{}")), sound_mid(bsrc=CompressedUtf8(data)))
    assert found.place == "tag bsrc"


def test_programs():
    first = sound_mvis(M2B0=program("in(0,2) add 0.5 mul copy(1,2) out(0,3)", 2, 3))
    second = sound_mvis(M2B0=program("in(0,2) mul 0.5 mul copy(1,2) out(0,3)", 2, 3))
    found = only(first, second)
    assert found.place == "tag M2B0, elements[0] (calc), program"
    assert found.message == "6 -> 6 operations; add 1 -> 0, mul 1 -> 2"
    assert found.data == {"operations": [6, 6], "operators": {"add": [1, 0], "mul": [1, 2]}}
    assert found.lines[2:] == (
        "@@ -1 +1 @@",
        "-in(0,2) add 0.5 mul copy(1,2) out(0,3)",
        "+in(0,2) mul 0.5 mul copy(1,2) out(0,3)",
    )


def test_sub_elements_of_programs():
    first, second = (
        sound_mvis(M2B0=program("in(0,2) mtx(0) out(0,3)", 2, 3, (Matrix.of(np.ones((3, 2)) * factor),)))
        for factor in (1, 3)
    )
    found = only(first, second)
    assert found.place == "tag M2B0, elements[0] (calc), elements[0] (matf), matrix"
    assert found.data["largest"] == 2


def test_programs_that_cannot_be_listed_are_counted():
    sound = sound_mvis()
    odd = Profile.from_bytes(tag_patched(sound, "M2B0", sound.tag_data("M2B0").index(b"mul "), b"nul "))
    found = only(sound, odd)
    assert "mul 2 -> 1, nul 0 -> 1" in found.message
    assert found.lines == ()


def test_tags_that_cannot_be_decoded_are_compared_by_their_bytes():
    sound = sound_mid()
    odd = Profile.from_bytes(tag_patched(sound, "mcta", 12, b"\xff"))
    assert only(sound, odd).message == "53 -> 53 bytes, alike up to byte 12"
    assert differences(odd, odd) == []


# Random inputs -------------------------------------------------------------------------------------------


def test_agreement_of_matrices():
    """Of 1 x + 0 y and 1.25 x + 0 y the difference is a quarter of the largest x."""
    found = agreement(
        mid(("a", "b"), matrix(np.eye(2))), mid(("a", "b"), matrix(np.diag([1.25, 1]))), 100_000, seed=1
    )
    assert 0.2499 < found.largest <= 0.25
    assert (found.samples, found.delta_E, found.not_finite) == (100_000, None, 0)


def test_agreement_of_colours():
    first, second = (mvis(("a",), M2B0=matrix(np.outer(WHITE, [factor]))) for factor in (1, 0.9))
    found = agreement(first, second, 1000)
    greys = np.random.default_rng(0).uniform(0, 1, (1000, 1)).astype(np.float32)
    labs = (XYZ_to_Lab(greys * factor * WHITE, WHITE) for factor in (1, 0.9))
    assert found.delta_E == pytest.approx(delta_E_CIE2000(*labs).max(), rel=1e-4)
    assert found.largest == pytest.approx(0.1 * greys.max(), rel=1e-4)


def test_normals_point_to_all_sides():
    process = program("in(0) 0 lt copy(1,2) out(0,3)", 1, 3)
    found = agreement(mvis(("n.x",), M2B0=process), mvis(("n.x",), M2B0=matrix(np.zeros((3, 1)))), 100)
    assert found.largest == 1


def test_agreement_counts_what_is_not_finite():
    first, second = (
        mvis(("a",), M2B0=program(text, 1, 3))
        for text in ("in(0) copy(1,2) out(0,3)", "NaN copy(1,2) out(0,3)")
    )
    assert agreement(first, second, 10).not_finite == 10


def test_other_channels_cannot_agree():
    with pytest.raises(LinkError, match="there is nothing to compare"):
        agreement(mid(("a",)), mid(("b",)), 10)


# Command -------------------------------------------------------------------------------------------------


@pytest.fixture
def files(tmp_path):
    first = sound_mvis(M2B0=program("in(0,2) in(0) out(0,3)", 2, 3))
    second = sound_mvis(M2B0=program("in(0,2) in(1) out(0,3)", 2, 3))
    paths = tmp_path / "a.icc", tmp_path / "b.icc"
    for path, profile in zip(paths, (first, second), strict=True):
        path.write_bytes(profile.to_bytes())
    return paths


def test_equal_files(run, files):
    a, _ = files
    result = run("diff", a, a, "--samples", 10, "--json")
    assert (result.code, result.err) == (0, "")
    assert result.json["schema"] == "iccbrdf.diff/1"
    assert (result.json["equal"], result.json["same_bytes"], result.json["differences"]) == (True, True, [])
    assert result.json["samples"] == {"samples": 10, "largest": 0.0, "delta_E": 0.0, "not_finite": 0}
    assert run("diff", a, a).out == f"{a} and {a} hold the same\n"


def test_different_files(run, files):
    result = run("diff", *files)
    assert (result.code, result.err) == (1, "")
    assert result.out.splitlines() == [
        "~ tag M2B0, elements[0] (calc), program: 3 -> 3 operations",
        "    --- a",
        "    +++ b",
        "    @@ -1 +1 @@",
        "    -in(0,2) in(0) out(0,3)",
        "    +in(0,2) in(1) out(0,3)",
    ]
    result = run("diff", *files, "--json", "--samples", 100)
    assert result.code == 1
    (found,) = result.json["differences"]
    assert found["operators"] == {}
    assert found["lines"][-1] == "+in(0,2) in(1) out(0,3)"
    assert 0.5 < result.json["samples"]["largest"] <= 1


def test_unreadable_files(run, files, tmp_path):
    result = run("diff", files[0], tmp_path / "none.icc", "--json")
    assert result.code == result.json["exit_code"] == 3
