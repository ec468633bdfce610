"""What the verifier refuses, and what it measures in sound programs."""

import contextlib
from types import SimpleNamespace

import pytest
from calc_programs import random_program

from iccbrdf.calc.program import MAX_NESTING, Op, parse
from iccbrdf.calc.verify import MAX_CALCULATORS, verify, verify_element
from iccbrdf.errors import LimitError, ProfileError


def element(signature, inputs=1, outputs=1, **fields):
    return SimpleNamespace(signature=signature, inputs=inputs, outputs=outputs, **fields)


def calculator(text, inputs=1, outputs=1, elements=()):
    return element("calc", inputs, outputs, program=parse(text), elements=tuple(elements))


MATRIX = element("matf", 3, 2)
CLUT = element("clut", 2, 1)
EXTENDED = element("xclt", 2, 1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "the program is empty, expected at least one operation"),
        ("in(0) add out(0)", "op 1 (add): stack underflow: found 1 entries, expected 2"),
        ("1 2 add(2)", "op 2 (add(2)): stack underflow: found 2 entries, expected 4"),
        ("1 sum(3)", "stack underflow"),
        ("1 solv(3,3)", "op 1 (solv(3,3)): stack underflow: found 1 entries, expected 12"),
        ("1 solv(65536,65536)", "expected 4295032832"),
        ("if { 1 }", "op 0 (if): stack underflow: found 0 entries, expected 1"),
        ("sel case { 1 }", "op 0 (sel): stack underflow"),
        # the two sides leave one entry and none
        ("1 in(0) if { 2 } else { pop } out(0)", "op 6 (out(0)): stack underflow: found 0 entries"),
        ("in(0) if { 2 } out(0)", "op 3 (out(0)): stack underflow"),
        ("in(0) sel case { 1 } case { } dflt { 2 } out(0)", "out(0)): stack underflow"),
        ("in(0) sel case { 1 } case { 2 } out(0)", "out(0)): stack underflow"),
        ("in(0) if { 1 2 add } else { add }", "op 6 (add): stack underflow: found 0 entries"),
        ("in(2,2) out(0,2)", "op 0 (in(2,2)): reaches input channels up to 3, expected less than 3"),
        ("in(0,3) out(0,3)", "op 1 (out(0,3)): reaches output channels up to 2, expected less than 2"),
        ("tget(65535,2)", "op 0 (tget(65535,2)): reaches temporaries up to 65536, expected less than 65536"),
        ("1 2 tput(65535,2)", "reaches temporaries"),
        ("1 2 tsav(65535,2)", "reaches temporaries"),
        ("in(0) copy(1,65535)", "op 1 (copy(1,65535)): stack overflow: found 65536 entries, expected at"),
        # 65536 more: a 16-bit depth would come round to 1 again
        ("in(0) copy(1,65536)", "stack overflow: found 65537 entries"),
        ("in(0) if { 1 copy(1,65535) pop(65535) } 2 copy(1,65534)", "stack overflow"),
        ("in(0) mtx(3)", "op 1 (mtx(3)): sub-element 3, expected less than 3"),
        ("in(0) mtx(1)", "op 1 (mtx(1)): sub-element 1 is 'clut', expected matf"),
        ("in(0) clut(0)", "sub-element 0 is 'matf', expected clut or xclt"),
        ("in(0) tJab(0)", "sub-element 0 is 'matf', expected XtoJ"),
        ("in(0) fJab(0)", "expected JtoX"),
        ("in(0) curv(0)", "expected cvst"),
        ("in(0) tint(0)", "expected tint"),
        ("in(0) calc(0)", "expected calc"),
        ("in(0) mtx(0)", "op 1 (mtx(0)): stack underflow: found 1 entries, expected 3"),
        ("in(0) elem(0)", "stack underflow"),
        ("in(0,3) mtx(0) out(0,2) pop", "op 3 (pop): stack underflow: found 0 entries"),
    ],
)
def test_refused_text(text, message):
    with pytest.raises(ProfileError) as caught:
        verify(parse(text), 3, 2, [MATRIX, CLUT, EXTENDED])
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("ops", "message"),
    [
        ([("data", 0), ("else", 0)], "op 1: found 'else', expected only directly after 'if'"),
        ([("else", 0)], "op 0: found 'else'"),
        ([("case", 0)], "op 0: found 'case', expected only directly after 'sel' or 'case'"),
        ([("dflt", 0)], "op 0: found 'dflt', expected only directly after 'case'"),
        ([("data", 0), ("sel", 0), ("dflt", 0)], "op 1: 'sel' without a case"),
        ([("data", 0), ("sel", 0)], "op 1: 'sel' without a case"),
        ([("data", 0), ("if", 0), ("case", 0)], "op 2: found 'case'"),
        ([("data", 0), ("sel", 0), ("case", 0), ("else", 0)], "op 3: found 'else'"),
        ([("data", 0), ("if", 2), ("pi", 0)], "the 'if' block has 2 operations, expected at most 1"),
        ([("data", 0), ("if", 0xFFFFFFFF)], "the 'if' block has 4294967295 operations"),
        ([("data", 0), ("if", 0), ("else", 1)], "the 'else' block has 1 operations, expected at most 0"),
        ([("data", 0), ("sel", 0), ("case", 1), ("case", 1), ("pi", 0)], "the 'case' block has 1 operations"),
        ([("data", 0), ("sel", 0), ("case", 0), ("dflt", 1)], "the 'dflt' block has 1 operations"),
        # the inner block fits into the program, but not into the block around it
        ([("data", 0), ("if", 2), ("data", 0), ("if", 1), ("pi", 0)], "op 3: the 'if' block has 1"),
        ([("abcd", 0)], "op 0: no operator 'abcd'"),
        ([("SIN", 0)], "no operator 'SIN': did you mean 'sin'?"),
    ],
)
def test_refused_operations(ops, message):
    with pytest.raises(ProfileError) as caught:
        verify(tuple(Op(*op) for op in ops), 1, 1, where="x.icc, A2M0")
    assert message in str(caught.value)
    assert str(caught.value).startswith("x.icc, A2M0: ")


@pytest.mark.parametrize(
    "text",
    [
        "1 2 0 if { 5 } out(0,2)",
        "in(0) if { } else { }",
        "in(0) sel case { 1 } dflt { 2 } out(0)",
        "5 copy(1,65534) tput(0,65535)",
        "tget(65535) pop",
        "in(0,2) clut(1) in(0,2) clut(2) in(0,2) elem(1)",
    ],
)
def test_accepted(text):
    verify(parse(text), 3, 2, [MATRIX, CLUT, EXTENDED])


def test_measures():
    checked = verify(parse("in(0,3) env(litX) if { 1 2 add tput(6) } else { } env(a) pop(2) 7 out(0)"), 3, 1)
    # in env if else (1 2 add tput) env pop 7 out
    assert checked.executed == 12
    assert checked.operations == 12
    assert checked.max_depth == 6
    assert checked.temporaries == 7
    assert checked.environment == {"litX", "a"}
    assert checked.nesting == 1


def test_longest_path_of_a_selection():
    # in sel case case dflt, then the longest block, then out
    checked = verify(parse("in(0) sel case { 1 } case { 1 2 add } dflt { 3 4 5 pop(2) } out(0)"), 1, 1)
    assert checked.executed == 5 + 4 + 1
    assert verify(parse("7 in(0) sel case { } case { 1 add } out(0)"), 1, 1).executed == 2 + 3 + 2 + 1


def test_calculators_in_calculators_are_checked():
    inner = calculator("in(0) sum(2) out(0)")
    for text in ("in(0) calc(0) out(0)", "in(0) out(0)"):
        with pytest.raises(ProfileError, match="calculator, sub-element 0: op 1"):
            verify(parse(text), 1, 1, [inner])
    curves = element("cvst", curves=[SimpleNamespace(signature="clcf", size=9, calculator=inner)])
    with pytest.raises(ProfileError, match="stack underflow"):
        verify(parse("in(0) curv(0) out(0)"), 1, 1, [curves])
    with pytest.raises(ProfileError, match="A2M0 element 2: op 1"):
        verify_element(inner, where="A2M0 element 2")
    assert verify_element(MATRIX) == ()


def test_measures_include_applied_calculators():
    inner = calculator("env(litZ) pop in(0) copy(1,9) tput(0,10) tget(0) out(0)")
    checked = verify(parse("in(0) calc(0) calc(0) out(0)"), 1, 1, [inner])
    assert checked.executed == 4 + 2 * 7
    assert checked.operations == 4 + 7
    assert (checked.max_depth, checked.temporaries, checked.environment) == (11, 10, {"litZ"})
    assert checked.nesting == 1


def test_a_hundred_thousand_nested_ifs_are_refused_quietly():
    count = 100_000
    deep = tuple(op for i in range(count) for op in (Op("data", 0), Op("if", 2 * (count - 1 - i))))
    with pytest.raises(LimitError, match="nested more than 64 deep"):
        verify(deep, 1, 1)


def test_a_hundred_thousand_ifs_in_a_row_are_fine():
    assert verify((Op("data", 0), Op("if", 0)) * 100_000, 1, 1).executed == 200_000


def test_nesting_of_calculators_is_limited():
    inner = calculator("in(0) out(0)")
    for _ in range(MAX_CALCULATORS):
        inner = calculator("in(0) calc(0) out(0)", elements=[inner])
    assert verify(inner.program, 1, 1, inner.elements).nesting == MAX_CALCULATORS
    with pytest.raises(LimitError, match="calculators are nested more than 32 deep"):
        verify(parse("in(0) calc(0) out(0)"), 1, 1, [inner])


def test_blocks_and_calculators_share_one_nesting_limit():
    inner = calculator("1 if { " * 40 + "}" * 40)
    text = "in(0) " + "1 if { " * (MAX_NESTING - 41) + "calc(0)" + " }" * (MAX_NESTING - 41) + " out(0)"
    assert verify(parse(text), 1, 1, [inner]).nesting == MAX_NESTING
    with pytest.raises(LimitError, match="blocks and calculators are nested more than 64 deep"):
        verify(parse(f"in(0) 1 if {{ {text} }}"), 1, 1, [inner])


def test_shared_calculators_cannot_multiply_time():
    inner = calculator("in(0) out(0)")
    for _ in range(30):
        inner = calculator("in(0) calc(0) calc(1) out(0)", elements=[inner, inner])
    with pytest.raises(LimitError, match="a pixel may execute more than 16777216 operations"):
        verify(inner.program, 1, 1, inner.elements)


def test_calculator_curves_have_a_limited_size():
    curve = SimpleNamespace(signature="clcf", size=1 << 32, calculator=calculator("in(0) out(0)"))
    with pytest.raises(LimitError, match="4294967296 samples of a curve, expected at most 1048576"):
        verify_element(element("cvst", curves=[curve]))


@pytest.mark.parametrize("seed", range(100))
def test_random_programs_broken_at_random_never_crash(seed):
    program = list(random_program(seed))
    program[seed % len(program)] = Op("if", seed)
    with contextlib.suppress(ProfileError):
        verify(tuple(program), 4, 5)
