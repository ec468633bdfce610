"""Findings tell where they are, none hides another, and nothing makes the check fail or take long."""

import numpy as np
import pytest
from cmm_examples import program
from icc_examples import a_mid, an_mvis, conformance_profiles, shared
from test_icc_hostile import mutations
from validate_examples import named, sound_mid, sound_mvis, tag_patched, version_4

from iccbrdf.calc import compile_template
from iccbrdf.calc.program import Op, parse
from iccbrdf.errors import IccBrdfError
from iccbrdf.icc import (
    XYZ,
    Calculator,
    CurveSet,
    FormulaSegment,
    Matrix,
    MultiProcess,
    Profile,
    SampledCalculatorCurve,
    SegmentedCurve,
)
from iccbrdf.resources import folder
from iccbrdf.validate import CHECKS, RULES, Finding, Place, validate
from iccbrdf.validate.variables import VARIABLES, nearest_variable

MVIS = folder("profiles") / "fogra39_gloss" / "mvis.icc"


def findings(profile):
    return validate(profile.to_bytes() if isinstance(profile, Profile) else profile, "x.icc").findings


def only(profile, rule):
    found = [one for one in findings(profile) if one.rule.id == rule]
    assert len(found) == 1
    return found[0]


def program_in(elements):
    """A MID whose elements these are."""
    return sound_mid(A2M0=MultiProcess(2, 2, tuple(elements)))


# Places --------------------------------------------------------------------------------------------------


def test_an_operation_is_placed_at_its_bytes():
    profile = sound_mvis(M2B0=program("in(0,2) in(0) out(0,3) env(litx) pop pop", 2, 3))
    found = only(profile, "PRG-004")
    assert profile.to_bytes()[found.place.offset :].startswith(b"env litx")
    assert found.place.text == "tag M2B0, element 0 (calc)"
    assert found.place.tag == "M2B0"
    assert found.message == "op 3 (env(litx)): did you mean 'litX'?"


def test_operations_of_calculators_inside_others_are_placed_at_their_bytes():
    inner = Calculator(2, 2, parse("{ env(vuey) pop pop in(0,2) out(0,2) }"))
    outer = Calculator(2, 2, parse("{ in(0,2) elem(1) out(0,2) }"), (Matrix.of(np.eye(2)), inner))
    profile = program_in([Matrix.of(np.eye(2)), outer])
    found = only(profile, "PRG-004")
    assert profile.to_bytes()[found.place.offset :].startswith(b"env vuey")
    assert found.place.text == "tag A2M0, element 1 (calc), sub-element 1 (calc)"


def test_operations_of_calculator_curves_are_placed_at_their_bytes():
    straight = SegmentedCurve((), (FormulaSegment(0, (1, 1, 0, 0)),))
    curve = SampledCalculatorCurve(4, 0, 1, 0, Calculator(1, 1, parse("{ env(LITX) pop pop in(0) out(0) }")))
    profile = program_in([CurveSet((straight, curve))])
    found = only(profile, "PRG-004")
    assert profile.to_bytes()[found.place.offset :].startswith(b"env LITX")
    assert found.place.text == "tag A2M0, element 0 (cvst), curve 1 (clcf)"


def test_a_refused_operation_is_placed_at_its_bytes():
    profile = sound_mvis(M2B0=program("in(0,2) add(3) out(0,3)", 2, 3))
    found = only(profile, "PRG-001")
    assert profile.to_bytes()[found.place.offset :].startswith(b"add ")
    assert "stack underflow: found 2 entries, expected 6" in found.message


def test_header_fields_are_placed_at_their_bytes():
    data = bytearray(sound_mid().to_bytes())
    data[67] = 9
    found = [one for one in findings(bytes(data)) if one.rule.id == "HDR-012"]
    assert [one.place.offset for one in found] == [64]


# Leniency ------------------------------------------------------------------------------------------------


def test_a_broken_tag_hides_no_other():
    profile = sound_mvis(
        mcta=named("kd", "kd"),
        wtpt=XYZ.of(0, 0, 0),
        M2B0=program("in(0,2) env(litx) pop 0 div out(0,2)", 2, 3),
    )
    data = tag_patched(profile, "desc", 12, b"\0\0\0\5")  # the size of its records
    fired = {one.rule.id for one in findings(data)}
    assert {"TAG-001", "MCS-003", "PCC-007", "PRG-004", "PRG-007", "PRG-009"} <= fired


def test_a_broken_element_hides_no_other():
    """The matrix cannot be decoded, and the channels do not fit: the program behind is still checked."""
    calculator = Calculator(2, 2, parse("{ env(litx) pop pop in(0,2) out(0,2) }"))
    profile = program_in([Matrix.of(np.eye(2)), calculator])
    data = tag_patched(profile, "A2M0", 32 + 8, b"\0\5")  # inputs of the matrix
    assert {one.rule.id for one in findings(data)} == {"MPE-002", "MPE-003", "PRG-004"}


def test_an_unsound_program_hides_no_other():
    unsound = Calculator(2, 2, parse("{ in(0,2) add(4) out(0,2) }"))
    profile = program_in([unsound, Calculator(2, 2, parse("{ env(litx) pop pop in(0,2) out(0,2) }"))])
    assert {one.rule.id for one in findings(profile)} == {"PRG-001", "PRG-004"}


def test_a_calculator_with_an_unsound_one_inside_has_one_finding():
    inner = Calculator(2, 2, parse("{ in(0,2) add(4) out(0,2) }"))
    outer = Calculator(2, 2, parse("{ in(0,2) calc(0) out(0,2) }"), (inner,))
    assert [one.rule.id for one in findings(program_in([outer]))] == ["PRG-001"]


def test_tags_that_share_their_bytes_have_their_findings_once():
    shared_tag = program("in(0,2) out(0,2)", 2, 3)
    assert only(sound_mvis(M2B0=shared_tag, M2B1=shared_tag), "PRG-007").place.tag == "M2B0"


# Programs ------------------------------------------------------------------------------------------------


def fired_by(text, elements=()):
    return {one.rule.id for one in findings(sound_mvis(M2B0=program(text, 2, 3, elements)))}


@pytest.mark.parametrize(
    "text",
    [
        "in(0) if { 1 tput(0) } else { 2 tput(0) } tget(0) in(0,2) out(0,3)",
        "in(0) sel case { 1 tput(0) } dflt { 2 tput(0) } tget(0) in(0,2) out(0,3)",
        "in(0) tsav(3) tget(3) in(1) out(0,3)",
        "in(0,2) add if { 1 out(0) 1 out(1,1) 1 out(2) } else { 1 2 3 out(0,3) }",
    ],
)
def test_what_every_path_writes_is_written(text):
    assert fired_by(text) == set()


@pytest.mark.parametrize(
    ("text", "fires"),
    [
        ("in(0,2) 1 0 div(2) out(0,2) 1 out(2)", True),  # the second divisor
        ("in(0,2) 0 1 sub(2) out(0,2) 1 out(2)", False),
        ("in(0,2) 0 sdiv(2) out(0,2) 1 out(2)", True),
        ("0 in(0) div in(0,2) out(0,3)", False),  # zero is divided
        ("0 in(0) mod in(0,2) out(0,3)", False),
        ("in(0) 0 mod in(0,2) out(0,3)", True),
        ("in(0,2) 0 ln out(0,3)", True),
        ("in(0,2) 0 sqrt out(0,3)", False),
        ("in(0,2) -1 log out(0,3)", True),
        ("in(0,2) 1.5 acos out(0,3)", True),
        ("in(0,2) 1 asin out(0,3)", False),
        ("in(0,2) in(0) if { 1 0 div } else { 1 } out(0,3)", True),
    ],
)
def test_literals_at_fault(text, fires):
    assert ("PRG-009" in fired_by(text)) is fires


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("litx", "litX"),
        ("LITX", "litX"),
        ("litW", "litX"),
        ("liXt", "litX"),
        ("lit", "litX"),
        ("vueI", "vueX"),
        ("ambi", "ambI"),
        ("litX", None),
        ("gain", None),
        ("l1tx", "litX"),
        ("tilX", None),
    ],
)
def test_misspelt_variables(name, known):
    assert nearest_variable(name) == known


def test_known_variables_are_those_of_the_templates():
    names = set()
    for path in folder("calc_templates").glob("*.calc"):
        try:
            names.update(compile_template(path.read_text(encoding="utf-8"), filename=path.name).variables)
        except IccBrdfError:
            continue  # one that asks for constants, and reads no variable
    assert names == set(VARIABLES)


@pytest.mark.parametrize(
    ("text", "fires"),
    [
        ("in(0,2) in(0) out(0,3) in(0) if { 1 pop } else { }", True),
        ("in(0) if { 1 pop } else { } in(0,2) in(0) out(0,3)", False),
        ("in(0,2) in(0) out(0,3) in(0) if { }", False),
        ("in(0,2) in(0) out(0,3) in(0) sel case { 1 pop } case { }", True),
        ("in(0,2) in(0) out(0,3) in(0) sel case { } dflt { 1 pop }", False),
    ],
)
def test_empty_last_blocks(text, fires):
    assert ("REF-003" in fired_by(text)) is fires


# Robustness ----------------------------------------------------------------------------------------------


def readable(data):
    """Can a strict reader decode every tag?"""
    try:
        profile = Profile.from_bytes(data)
        for signature in profile:
            profile[signature]
    except IccBrdfError:
        return False
    return True


@pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")
@pytest.mark.parametrize("make", [a_mid, an_mvis, sound_mvis, version_4])
def test_what_cannot_be_read_has_an_error(make):
    """Whatever a strict reader refuses is an error here, and nothing raises."""
    for data in mutations(make().to_bytes(), 250, seed=3):
        report = validate(data)
        assert all(line.isprintable() for line in report.lines())
        assert readable(data) or not report.passed


def test_profiles_of_the_reference_tools_have_no_error():
    for name, data in conformance_profiles():
        assert validate(data, name).passed, name


@pytest.mark.parametrize("name", ["sRGB.icm", "DisplayP3.icm", "ISOcoated_v2_300_bas.icc"])
def test_profiles_of_versions_2_and_4_in_use(name):
    report = validate(shared(f"data/icc/{name}").read_bytes(), name)
    assert report.count("error") == report.count("warning") == 0


@pytest.mark.parametrize("data", [b"", b"\x89PNG\r\n", bytes(200), b"a" * 4096])
def test_what_is_no_profile_has_one_finding(data):
    assert [one.rule.id for one in findings(data)] == ["HDR-001"]


def test_large_programs():
    """Many operations read thousands of temporaries, more open blocks: work in proportion, one finding."""
    read = [Op("tget", 0xFFE), Op("pop", 0xFFE << 16)] * 1_000
    blocks = [Op("data"), Op("if", 0)] * 5_000
    ops = (*read, *blocks, *parse("in(0,2) 0 out(0,3)"))
    profile = sound_mvis(M2B0=MultiProcess.of(Calculator(2, 3, ops)))
    assert [one.rule.id for one in findings(profile)] == ["PRG-008"]


def test_elements_that_share_their_bytes_are_examined_once():
    calculator = Calculator(2, 2, parse("{ env(litx) pop pop in(0,2) out(0,2) }"))
    profile = program_in([calculator] * 5000)
    assert [one.rule.id for one in findings(profile)] == ["PRG-004"]


# Reports -------------------------------------------------------------------------------------------------


def test_gravest_first_then_by_place():
    profile = sound_mvis(
        M2B0=program("in(0) env(litx) env(lity) pop pop pop 0 div out(0)", 2, 3), zzzz=XYZ(())
    )
    report = validate(profile.replace(remove=["cprt"]).to_bytes(), "x.icc")
    severities = [found.rule.severity for found in report.findings]
    assert severities == sorted(severities, key=["error", "warning", "note"].index)
    warnings = [found.place.offset for found in report.findings if found.rule.severity == "warning"]
    assert warnings == sorted(warnings)
    assert set(severities) == {"error", "warning", "note"}


def test_a_further_source_of_findings():
    def check(subject):
        yield Finding(RULES["PRG-009"], Place("nowhere"), f"{len(subject.data)} bytes")

    data = sound_mid().to_bytes()
    assert validate(data, checks=()).findings == ()
    (found,) = validate(data, checks=(*CHECKS, check)).findings
    assert found.text == f"warning PRG-009: nowhere: {len(data)} bytes"


# Command -------------------------------------------------------------------------------------------------


def test_a_sound_file(run):
    result = run("validate", MVIS)
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[0].startswith(f"{MVIS}: note TAG-009: tag bsrc: ")
    assert lines[1:] == [f"{MVIS}: 0 errors, 0 warnings, 1 note"]


def test_findings_as_text_and_json(run, tmp_path):
    path = tmp_path / "odd.icc"
    path.write_bytes(sound_mvis(mcta=named("kd", "kd"), M2B0=program("in(0,2) out(0,2)", 2, 3)).to_bytes())
    result = run("validate", path)
    assert (result.code, result.err) == (1, "")
    lines = result.out.splitlines()
    assert lines[0].startswith(f"{path}: error MCS-003: tag mcta, item 1: byte offset ")
    assert lines[-1] == f"{path}: 1 error, 1 warning, 0 notes"
    result = run("validate", path, "--json")
    assert result.code == 1
    assert result.json["schema"] == "iccbrdf.validate/1"
    assert (result.json["passed"], result.json["errors"], result.json["warnings"]) == (False, 1, 1)
    (report,) = result.json["files"]
    assert report["source"] == str(path)
    first = report["findings"][0]
    assert (first["rule"], first["severity"], first["tag"]) == ("MCS-003", "error", "mcta")
    assert first["offset"] == Profile.from_bytes(path.read_bytes()).tag_offset("mcta")
    assert first["basis"] == RULES["MCS-003"].basis


def test_a_warning_is_no_failure(run, tmp_path):
    path = tmp_path / "odd.icc"
    path.write_bytes(sound_mvis(M2B0=program("in(0,2) out(0,2)", 2, 3)).to_bytes())
    assert run("validate", path).code == 0


def test_a_pair_is_checked_in_either_order(run, tmp_path):
    paths = tmp_path / "mid.icc", tmp_path / "mvis.icc"
    paths[0].write_bytes(sound_mid(mcta=named("kd", "M")).to_bytes())
    paths[1].write_bytes(sound_mvis().to_bytes())
    for order in (paths, paths[::-1]):
        result = run("validate", *order, "--json")
        assert result.code == 0
        found = result.json["pair"]["findings"]
        assert [one["rule"] for one in found] == ["LNK-002", "LNK-004"]
        assert "did you mean 'M'?" in found[0]["message"]
    assert run("validate", *paths, paths[0], "--json").json["pair"] is None


def test_a_malformed_file_is_an_answer_an_unreadable_one_is_none(run, tmp_path):
    path = tmp_path / "odd.icc"
    path.write_bytes(b"\x89PNG" + bytes(200))
    assert run("validate", path).code == 1
    for missing in (tmp_path / "none.icc", tmp_path):
        result = run("validate", path, missing, "--json")
        assert result.code == result.json["exit_code"] == 3
        assert "cannot be read" in result.err


def test_rules_are_listed(run):
    result = run("validate", "--list-rules")
    assert result.code == 0
    assert [line.split()[0] for line in result.out.splitlines()] == list(RULES)
    result = run("validate", "--list-rules", "--json")
    assert [rule["id"] for rule in result.json["rules"]] == list(RULES)


def test_no_file(run):
    assert run("validate").code == 2
