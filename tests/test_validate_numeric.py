"""The static check of numbers: what our templates are proven of, and what is found in programs that fail."""

import re
import shutil

import numpy as np
import pytest
from cmm_examples import matrix, mid, mvis, program
from test_brdf_interpolation import fogra39, random_primaries
from test_icc_hostile import mutations
from validate_examples import sound_mid, sound_mvis

from iccbrdf.brdf.slopes import read_slopes
from iccbrdf.build import MODELS, build_colour_mid, build_pair, colour_mid
from iccbrdf.calc import ranges
from iccbrdf.calc.program import parse
from iccbrdf.icc import (
    Calculator,
    Clut,
    CurveSet,
    FormulaSegment,
    MultiProcess,
    NumberArray,
    SampledCalculatorCurve,
    SegmentedCurve,
)
from iccbrdf.resources import folder
from iccbrdf.validate import check_numeric, validate
from iccbrdf.validate.numeric import multiplex_ranges, only_mid
from iccbrdf.validate.subject import open_subject

PROFILES = sorted(folder("profiles").glob("*/*.icc"))


def numeric(profile, ranges=None, mid=None):
    """The findings of the check about a profile."""
    return list(check_numeric(open_subject(profile.to_bytes(), "p.icc"), ranges, mid=mid))


def ids(findings):
    return [found.rule.id for found in findings]


def calculated(text, inputs=2, outputs=3, elements=()):
    """A transform of one calculator."""
    return MultiProcess(
        inputs, outputs, (Calculator(inputs, outputs, tuple(parse(text)), elements=tuple(elements)),)
    )


def found_in(text, ranges=None, **tags):
    """The findings about an MVIS with channels kd and m that runs this program."""
    return numeric(sound_mvis(M2B0=program(text, 2, 3), **tags), ranges)


# Our own ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", PROFILES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_shipped_profiles_pass(path):
    subject = open_subject(path.read_bytes(), path.name)
    beside = open_subject((path.parent / "mid.icc").read_bytes(), "mid.icc")
    assert list(check_numeric(subject)) == []
    assert list(check_numeric(subject, mid=beside)) == []


@pytest.mark.parametrize("model", MODELS)
def test_models_pass_with_all_effects_and_without_each(model):
    chosen = build_pair(random_primaries(model)).effects
    for left_out in (None, *(name for name, on in chosen.items() if on and name != "below-horizon")):
        pair = build_pair(random_primaries(model), without=[left_out] if left_out else [])
        assert numeric(pair.mvis) == [], left_out
        assert numeric(pair.mid) == [], left_out


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("left_out", [None, "relief", "specular", "shadowing"])
def test_the_exact_geometry_passes(model, left_out):
    if left_out is None or left_out in build_pair(random_primaries(model)).effects:
        without = [left_out] if left_out else []
        assert numeric(build_pair(random_primaries(model), without=without, geometry="exact").mvis) == []


@pytest.mark.parametrize("model", ["brdf1", "brdf2"])
def test_the_reciprocal_fresnel_angle_passes(model):
    assert numeric(build_pair(random_primaries(model), fresnel_angle="alpha").mvis) == []


def test_models_without_their_horizon_do_not_pass():
    pair = build_pair(random_primaries("ward"), without=["below-horizon", "relief"])
    assert "NUM-001" in ids(numeric(pair.mvis))


SLOPES = read_slopes(folder("profiles") / "fogra39_gloss" / "slopes.json")


@pytest.mark.parametrize(
    ("slope_method", "options"),
    [
        ("affine", {}),
        ("published", {}),
        (None, {"interpolation": "published"}),
        ("published", {"interpolation": "published"}),
        ("affine", {"interpolation": "published", "exponent": 1}),
        ("published", {"interpolation": "published", "exponent": -4, "p": 3}),
        ("affine", {"interpolation": "published", "p": 8}),
    ],
)
def test_colour_mids_pass(slope_method, options):
    slopes = SLOPES if slope_method else None
    made = build_colour_mid(fogra39(), slopes=slopes, slope_method=slope_method or "affine", **options)
    assert numeric(made.mid) == []


@pytest.mark.parametrize("interpolation", ["smooth", "published"])
@pytest.mark.parametrize("count", [4, 5, 16])
def test_colour_mids_pass_whatever_their_nodes(interpolation, count):
    primaries = random_primaries(count=count)
    assert numeric(build_colour_mid(primaries, interpolation=interpolation, slopes=SLOPES).mid) == []


@pytest.mark.parametrize(
    ("interpolation", "count", "options", "guard", "operator"),
    [
        ("published", 4, {"p": 8}, ("clamp(chromaticity, -1e4, 1e4)", "chromaticity"), "gama"),
        ("smooth", 16, {}, ("min(logarithms, 40)", "logarithms"), "exp"),
    ],
)
def test_colour_mids_without_their_guards_do_not(
    monkeypatch, tmp_path, interpolation, count, options, guard, operator
):
    copy = tmp_path / "calc_templates"
    shutil.copytree(folder("calc_templates"), copy)
    template = copy / f"interpolate_{interpolation}.calc"
    text = template.read_text("utf-8")
    assert guard[0] in text
    template.write_text(text.replace(*guard), "utf-8")
    monkeypatch.setattr(colour_mid, "folder", {"calc_templates": copy}.__getitem__)
    monkeypatch.setattr(ranges, "MAX_TRIALS", 2000)  # there is no proof to be found
    primaries = random_primaries(count=count)
    made = build_colour_mid(primaries, interpolation=interpolation, slopes=SLOPES, **options)
    pattern = rf"op \d+ \({operator}\(\d+\)\) may overflow"
    assert any(re.match(pattern, found.message) for found in numeric(made.mid))


def test_shipped_profiles_pass_at_the_command_line(run):
    place = folder("profiles") / "ward_painting"
    result = run("validate", "--numeric", place / "mid.icc", place / "mvis.icc", "--json")
    assert result.code == 0
    # The note of the private tag that holds the source.
    rules = [[found["rule"] for found in file["findings"]] for file in result.json["files"]]
    assert rules == [["TAG-009"], ["TAG-009"]]


# Findings -----------------------------------------------------------------------------------------------

BROKEN = [
    ("NUM-001", "1 in(0) abs div copy(1,2) out(0,3)", 3, "abs(kd)", "max(x, 2e-38)"),
    (
        "NUM-001",
        "1 in(0) 0.5 sub div copy(1,2) out(0,3)",
        4,
        "(kd - 0.5)",
        "divide only where abs(x) > 2e-38",
    ),
    ("NUM-002", "in(0) 3 sub sqrt copy(1,2) out(0,3)", 3, "(kd - 3)", "max(x, 0)"),
    ("NUM-002", "in(1) ln copy(1,2) out(0,3)", 1, "m", "max(x, 2e-38)"),
    ("NUM-003", "in(0) 30 mul exp copy(1,2) out(0,3)", 3, "(kd * 30)", "min(x, 88)"),
    ("NUM-003", "1e30 in(0) abs 1e-9 add div copy(1,2) out(0,3)", 5, "(abs(kd) + 1e-09)", "max(x, 3e-9)"),
    ("NUM-004", "+INF copy(1,2) out(0,3)", None, "inf", ""),
]


@pytest.mark.parametrize(("rule", "text", "position", "operand", "guard"), BROKEN)
def test_findings_name_operation_operand_range_and_guard(rule, text, position, operand, guard):
    (found,) = found_in(text)
    assert found.rule.id == rule
    if position is None:
        assert "give an output that is not finite" in found.message
        return
    assert f"op {position} (" in found.message
    assert f"x = {operand} is within " in found.message
    assert found.message.endswith(f"smallest guard: {guard}")
    # The place is the operation's own eight bytes.
    data = sound_mvis(M2B0=program(text, 2, 3)).to_bytes()
    name = re.search(r"op \d+ \((\w+)", found.message)[1]
    assert data[found.place.offset :][:4].decode().strip() == name


@pytest.mark.parametrize(
    "text",
    [
        "1 in(0) 2e-38 vmax div copy(1,2) out(0,3)",
        "in(0) 0.5 sub abs 2e-38 gt if { 1 in(0) 0.5 sub div } else { 0 } copy(1,2) out(0,3)",
        "in(0) 3 sub 0 vmax sqrt copy(1,2) out(0,3)",
        "in(1) 2e-38 vmax ln copy(1,2) out(0,3)",
        "in(0) 30 mul 88 vmin exp copy(1,2) out(0,3)",
        "in(0) 1 gt if { in(0) ln } else { 0 } copy(1,2) out(0,3)",
        "in(0) rond sel case { 1 } case { 2 } dflt { in(0) 5 add } copy(1,2) out(0,3)",
    ],
)
def test_guarded_programs_pass(text):
    assert found_in(text) == []


def test_a_vector_operation_is_one_finding():
    assert ids(found_in("in(0,2) 1 in(0,2) 1 div(3) out(0,3)")) == ["NUM-001"]


def test_operations_of_nested_calculators_are_found_at_their_own_place():
    inner = Calculator(1, 1, tuple(parse("1 in(0) div out(0)")))
    element = Calculator(2, 3, tuple(parse("in(0) calc(0) copy(1,2) out(0,3)")), elements=(inner,))
    (found,) = numeric(sound_mvis(M2B0=MultiProcess(2, 3, (element,))))
    assert "element 0 (calc), sub-element 0 (calc)" in found.place.text
    assert found.message.startswith("op 2 (div) may divide by 0")


def test_curves_are_named_by_their_element():
    root = SegmentedCurve((), (FormulaSegment(0, (0.5, 1, 0, 0)),))
    process = MultiProcess(2, 2, (CurveSet((root, root)),))
    profile = mid(
        ("kd", "m"),
        A2M0=MultiProcess(2, 2, (matrix([[1, 0], [0, 1]], [-0.5, 0]).elements[0], *process.elements)),
    )
    (found,) = numeric(profile)
    assert found.rule.id == "NUM-002"
    assert "element 1 (cvst)" in found.place.text


def test_what_the_interpreter_alone_runs_is_told_of():
    inner = Calculator(1, 1, tuple(parse("in(0) env(litX) pop mul out(0)")))
    curves = CurveSet((SampledCalculatorCurve(9, 0.0, 1.0, 0, inner),))
    profile = sound_mvis(M2B0=calculated("in(0) curv(0) copy(1,2) out(0,3)", 2, 3, [curves]))
    (found,) = numeric(profile)
    assert found.rule.id == "NUM-005"
    assert "run-time variables" in found.message


def test_unsound_programs_are_left_to_their_own_rule():
    profile = sound_mvis(M2B0=program("add out(0,3)", 2, 3))
    report = validate(profile.to_bytes(), checks=(check_numeric,))
    assert report.findings == ()


def test_whatever_a_file_holds_is_examined_or_left_alone():
    for path in (PROFILES[0], folder("profiles") / "ward_painting" / "mvis.icc"):
        for data in mutations(path.read_bytes(), 25, 5):
            validate(data, checks=(check_numeric,))


# Declared ranges ----------------------------------------------------------------------------------------


def test_channels_alone_reach_four_and_their_default():
    assert found_in("1 in(0) 4.5 sub div copy(1,2) out(0,3)") == []
    assert ids(found_in("1 in(0) 3.5 sub div copy(1,2) out(0,3)")) == ["NUM-001"]
    far = NumberArray("fl32", [5.0, 0.5])
    profile = mvis(("kd", "m"), defaults=far, M2B0=program("1 in(0) 4.5 sub div copy(1,2) out(0,3)", 2, 3))
    assert ids(numeric(profile)) == ["NUM-001"]


def test_a_mid_says_what_its_channels_reach():
    narrow = mid(("kd",), A2M0=matrix([[0.5]], [0.25]))
    subject = open_subject(narrow.to_bytes(), "mid.icc")
    assert multiplex_ranges(subject) == {"kd": (0.25, 0.75)}
    profile = sound_mvis(M2B0=program("1 in(0) div 1 in(1) 0.25 sub div add copy(1,2) out(0,3)", 2, 3))
    assert ids(numeric(profile)) == ["NUM-001", "NUM-001"]
    # kd is above 0, and m, which the MID lacks, has its default.
    assert numeric(profile, mid=subject) == []


def test_ranges_by_name():
    text = "1 in(0) div 1 env(litZ) pop div add copy(1,2) out(0,3)"
    assert ids(found_in(text)) == ["NUM-001", "NUM-001"]
    assert ids(found_in(text, {"kd": (0.1, 1)})) == ["NUM-001"]
    assert ids(found_in(text, {"kd": (0.1, 1), "litZ": (0, 1)})) == ["NUM-001"]
    assert found_in(text, {"kd": (0.1, 1), "litZ": (0.1, 1)}) == []


def test_connection_spaces_and_devices():
    text = "1 in(0) 2.5 sub div copy(1,2) out(0,3)"
    assert numeric(sound_mvis(c2sp=calculated(text, 3), s2cp=calculated(text, 3))) == []
    lab = "1 in(1) 100 sub div copy(1,2) out(0,3)"
    assert ids(numeric(sound_mvis(c2sp=calculated(lab, 3), s2cp=calculated(text, 3)))) == []
    device = mid(("kd", "m"), A2M0=calculated("1 in(0,2) 1.5 sub(1) div copy(1,1) out(0,2)", 2, 2))
    assert numeric(device) == []


def test_the_mid_among_files():
    a, b = (sound_mid().to_bytes(), "mid.icc"), (sound_mvis().to_bytes(), "mvis.icc")
    assert only_mid([a, b]).source == "mid.icc"
    assert only_mid([b]) is None
    assert only_mid([a, a, b]) is None


def test_tables_bound_what_they_give():
    table = np.linspace(0.5, 2, 8, dtype=np.float32).reshape(2, 2, 2)
    text = "in(0,2) clut(0) div copy(1,2) out(0,3)"
    assert numeric(sound_mvis(M2B0=calculated(text, 2, 3, [Clut(table)]))) == []
    assert ids(numeric(sound_mvis(M2B0=calculated(text, 2, 3, [Clut(table - 1)])))) == ["NUM-001"]


# The command --------------------------------------------------------------------------------------------


@pytest.fixture
def failing(tmp_path):
    path = tmp_path / "mvis.icc"
    path.write_bytes(sound_mvis(M2B0=program("in(1) in(0) div copy(1,2) out(0,3)", 2, 3)).to_bytes())
    return path


def test_only_asked_for(run, failing):
    assert run("validate", failing).code == 0
    result = run("validate", "--numeric", failing)
    assert result.code == 1
    assert "error NUM-001: tag M2B0, element 0 (calc): byte offset" in result.out
    assert "op 2 (div) may divide by 0: x = kd is within -4 to 4; smallest guard:" in result.out


def test_ranges_at_the_command_line(run, failing):
    assert run("validate", "--numeric", "--range", "kd=0.1:1", failing).code == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--range", "kd=0:1"], "--range is for --numeric"),
        (["--numeric", "--range", "kd=1:0"], "found 'kd=1:0'"),
        (["--numeric", "--range", "kd=0:inf"], "finite numbers"),
        (["--numeric", "--range", "kd"], "found 'kd'"),
        (["--numeric", "--range", "kD=0:1"], "did you mean 'kd'?"),
    ],
)
def test_ranges_that_make_no_sense(run, failing, options, message):
    result = run("validate", *options, failing)
    assert result.code == 2
    assert message in result.err
