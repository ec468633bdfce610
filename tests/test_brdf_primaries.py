"""Primaries files: the shipped examples, reading and writing, and what is said about wrong ones."""

import copy
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import SHARED

from iccbrdf.brdf.geometry import planar
from iccbrdf.brdf.models import MODELS, evaluate
from iccbrdf.brdf.primaries import read_primaries, white_of, write_primaries
from iccbrdf.errors import InputError, UsageError
from iccbrdf.json_text import to_json
from iccbrdf.resources import folder

ROOT = Path(__file__).resolve().parent.parent
DATA = SHARED / "data"
EXAMPLES = [folder("profiles") / name / "primaries.json" for name in ("fogra39_gloss", "ward_painting")]

CONTENTS = {
    "schema": "iccbrdf-primaries",
    "version": 1,
    "model": "brdf1",
    "refractive_index": 1.4,
    "illuminant": "D65",
    "observer": "CIE 1964 10 Degree Standard Observer",
    "white": [0.948, 1, 1.073],
    "geometry": "45:0",
    "source": "a test",
    "encoding": {"kd": 1.25, "m": 0.5},
    "primaries": [
        {
            "name": "White",
            "XYZ": [0.8, 0.9, 0.7],
            "parameters": {"kd": [0.7, 0.8, 1.2], "ks": [0.1, 0.2, 0.3], "m": 0.2},
        },
        {
            "name": "C",
            "CMYK": [100, 0, 0, 0],
            "XYZ": [0.1, 0.2, 0.5],
            "parameters": {"kd": [0.1, 0.2, 0.5], "ks": [0.1, 0.2, 0.3], "m": 0.25},
        },
    ],
}


def written(path: Path, contents: object) -> Path:
    path.write_text(json.dumps(contents), encoding="utf-8")
    return path


def test_every_field_is_read(tmp_path) -> None:
    primaries = read_primaries(written(tmp_path / "p.json", CONTENTS))
    assert (primaries.model, primaries.refractive_index) == ("brdf1", 1.4)
    assert (primaries.illuminant, primaries.observer) == ("D65", "CIE 1964 10 Degree Standard Observer")
    assert primaries.white == (0.948, 1, 1.073)
    assert (primaries.geometry, primaries.source) == ("45:0", "a test")
    assert primaries.encoding == {"kd": 1.25, "ks": 1, "m": 0.5}
    assert primaries.scales.tolist() == [1.25, 1.25, 1.25, 1, 1, 1, 0.5]
    assert [primary.name for primary in primaries.primaries] == ["White", "C"]
    assert [primary.CMYK for primary in primaries.primaries] == [None, (100, 0, 0, 0)]
    assert primaries.XYZ.tolist() == [[0.8, 0.9, 0.7], [0.1, 0.2, 0.5]]
    assert primaries.parameters.tolist() == [
        [0.7, 0.8, 1.2, 0.1, 0.2, 0.3, 0.2],
        [0.1, 0.2, 0.5, 0.1, 0.2, 0.3, 0.25],
    ]


def test_optional_fields_have_defaults(tmp_path) -> None:
    contents = copy.deepcopy(CONTENTS)
    for key in ("refractive_index", "white", "encoding"):
        del contents[key]
    contents["primaries"][0]["parameters"]["kd"][2] = 1
    primaries = read_primaries(written(tmp_path / "p.json", contents))
    assert primaries.refractive_index == 1.5
    assert primaries.scales.tolist() == [1] * 7
    # ASTM E308, table 5, D65 and 10 degrees, 10 nm.
    assert primaries.white == pytest.approx((0.94811, 1, 1.07304), abs=2e-5)


def test_white_of_the_connection_space() -> None:
    assert white_of("D50", "CIE 1931 2 Degree Standard Observer") == pytest.approx(
        (0.9642, 1, 0.8249), abs=3e-4
    )


def test_a_byte_order_mark_is_no_obstacle(tmp_path) -> None:
    path = tmp_path / "p.json"
    path.write_bytes(b"\xef\xbb\xbf" + json.dumps(CONTENTS).encode())
    assert read_primaries(path).source == "a test"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.parent.name)
def test_examples_are_written_as_they_were_read(path, tmp_path) -> None:
    copied = tmp_path / "copy.json"
    write_primaries(read_primaries(path), copied)
    assert copied.read_bytes() == path.read_bytes()
    with pytest.raises(UsageError, match="exists already"):
        write_primaries(read_primaries(path), copied)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.parent.name)
def test_examples_give_their_colours_at_45_0(path) -> None:
    primaries = read_primaries(path)
    geometry = ((0, 0, 1), planar(-45), planar(0))
    found = evaluate(primaries.model, primaries.parameters, *geometry, intensity=np.pi * np.sqrt(2))
    assert found == pytest.approx(primaries.XYZ, abs=2e-6)


def test_fogra39_example_holds_the_nine_nodes() -> None:
    primaries = read_primaries(EXAMPLES[0])
    assert " ".join(primary.name for primary in primaries.primaries) == "White C M Y CM CY MY CMY K"
    assert primaries.primaries[1].XYZ == (0.1502, 0.2293, 0.5285)
    # A highlight has the colour of the light.
    ks = MODELS["brdf1"].split(primaries.parameters)[1]
    assert ks / ks[:, 1:2] == pytest.approx(np.tile(primaries.white, (9, 1)), rel=1e-5)


def test_examples_are_what_the_tool_makes(tmp_path) -> None:
    if not DATA.is_dir():
        pytest.skip(f"no published tables at {DATA}")
    tool = [sys.executable, ROOT / "tools" / "make_primaries.py", "--data", DATA, "-o", tmp_path]
    subprocess.run(tool, check=True)
    for path in EXAMPLES:
        assert (tmp_path / path.parent.name / path.name).read_bytes() == path.read_bytes()


DELETE = object()


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (("schema",), DELETE, "the key 'schema' is missing"),
        (("schema",), "iccbrdf-slopes", "unknown schema 'iccbrdf-slopes': did you mean 'iccbrdf-primaries'?"),
        (("version",), 2, "version is 2, expected 1"),
        (("model",), "BRDF1", "unknown model 'BRDF1': did you mean 'brdf1'?"),
        (("model",), 1, "model is 1, expected a text"),
        (("illuminant",), "d50", "unknown illuminant 'd50': did you mean 'D50'?"),
        (("observer",), "2 degrees", "unknown observer '2 degrees': valid are CIE 1931"),
        (("iluminant",), "D50", "unknown key 'iluminant': did you mean 'illuminant'?"),
        (("white",), [1, 1], "white has 2 numbers, expected 3"),
        (("white",), [1, 1, 0], "white[2] is 0, expected a number of at least 0.0001"),
        (("white",), [96.42, 100, 82.49], "white[1] is 100, expected 1, the Y of the perfect diffuser"),
        (("refractive_index",), 0.9, "refractive_index is 0.9, expected a number of at least 1"),
        (("refractive_index",), True, "refractive_index is true, expected a number"),
        (("source",), " ", "source is empty, expected a text"),
        (("encoding", "Kd"), 1, "encoding: unknown key 'Kd': did you mean 'kd'?"),
        (("encoding", "kd"), 0, "encoding: kd is 0, expected a number of at least 0.0001"),
        (("primaries",), [], "primaries is empty, expected at least one object"),
        (("primaries",), {}, "primaries is {}, expected a list of objects"),
        (("primaries", 1), 7, "primary 2: is 7, expected an object"),
        (("primaries", 1, "name"), "White", "primary 2 (White): name 'White' stands twice"),
        (("primaries", 1, "xyz"), [0, 0, 0], "primary 2 (C): unknown key 'xyz': did you mean 'XYZ'?"),
        (("primaries", 1, "XYZ"), DELETE, "primary 2 (C): the key 'XYZ' is missing, expected a list of 3"),
        (("primaries", 1, "XYZ", 0), -0.1, "primary 2 (C): XYZ[0] is -0.1, expected a number of at least"),
        (("primaries", 1, "XYZ", 0), float("nan"), "primary 2 (C): XYZ[0] is NaN"),
        (("primaries", 1, "XYZ", 0), float("inf"), "primary 2 (C): XYZ[0] is Infinity"),
        (("primaries", 1, "XYZ", 0), 10**400, "primary 2 (C): XYZ[0] is 1000"),
        (("primaries", 1, "XYZ", 0), "0.1", 'primary 2 (C): XYZ[0] is "0.1", expected a number'),
        (("primaries", 1, "CMYK", 3), 101, "primary 2 (C): CMYK[3] is 101, expected a number from 0 to 100"),
        (("primaries", 1, "parameters"), DELETE, "primary 2 (C): the key 'parameters' is missing"),
        (
            ("primaries", 1, "parameters", "Rd"),
            1,
            "primary 2 (C), parameters: unknown key 'Rd': did you mean 'kd'?",
        ),
        (
            ("primaries", 1, "parameters", "m"),
            0,
            "primary 2 (C), parameters: m is 0, expected a number from 0.0001 to 0.5",
        ),
        (("primaries", 1, "parameters", "m"), [0.2], "parameters: m is [0.2], expected a number"),
        (("primaries", 1, "parameters", "kd", 1), 1.3, "kd[1] is 1.3, expected a number from 0 to 1.25"),
        (("primaries", 1, "parameters", "ks"), 0.2, "ks is 0.2, expected a list of 3 numbers from 0 to 1"),
    ],
)
def test_wrong_entries_are_named(place, value, message, tmp_path) -> None:
    contents = copy.deepcopy(CONTENTS)
    target = contents
    for step in place[:-1]:
        target = target[step]
    if value is DELETE:
        del target[place[-1]]
    else:
        target[place[-1]] = value
    path = written(tmp_path / "p.json", contents)
    with pytest.raises(InputError) as caught:
        read_primaries(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)


def test_a_refractive_index_that_the_model_does_not_use_is_refused(tmp_path) -> None:
    contents = json.loads(EXAMPLES[1].read_text()) | {"refractive_index": 1.5}
    with pytest.raises(InputError, match="refractive_index is given, but the model ward has none"):
        read_primaries(written(tmp_path / "p.json", contents))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"model = brdf1", "is not a JSON file: Expecting value: line 1"),
        (b"\xff\xfe\xff", "is not a JSON file"),
        (b"[" * 100_000, "is not a JSON file"),
        (b"[1, 2]", "holds [1, 2], expected an object"),
        (b'{"schema": 1, "schema": 2}', "the key 'schema' stands twice"),
    ],
)
def test_files_that_are_no_primaries_are_refused(data, message, tmp_path) -> None:
    path = tmp_path / "p.json"
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        read_primaries(path)
    assert message in str(caught.value)


def test_missing_file_is_named(tmp_path) -> None:
    with pytest.raises(InputError, match=r"none\.json: cannot be read: No such file"):
        read_primaries(tmp_path / "none.json")


def test_layout_of_the_json() -> None:
    short = {"name": "White", "kd": [0.1, 0.2]}
    assert to_json(short) == '{"name": "White", "kd": [0.1, 0.2]}'
    long = {"text": "µ" * 60, "list": [short, short]}
    assert to_json(long) == (
        '{\n  "text": "' + "µ" * 60 + '",\n'
        '  "list": [{"name": "White", "kd": [0.1, 0.2]}, {"name": "White", "kd": [0.1, 0.2]}]\n}'
    )
    assert json.loads(to_json(long)) == long
