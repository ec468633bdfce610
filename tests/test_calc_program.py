"""Programs as bytes and text: hand-written hex, both ways, and what is refused."""

import struct

import pytest
from calc_programs import random_program

from iccbrdf.calc.program import (
    MAX_NESTING,
    Op,
    Temporary,
    decode_ops,
    encode_ops,
    listing,
    nest,
    parse,
    signature,
    signature_name,
)
from iccbrdf.calc.verify import verify
from iccbrdf.errors import LimitError, ProfileError

# Text and the bytes it stands for: four of the signature, four of the operand.
BYTES = {
    "1": "64617461 3f800000",
    "-2.5e-1": "64617461 be800000",
    "in(1,2)": "696e2020 00010001",
    "out(3)": "6f757420 00030000",
    "copy(2,3)": "636f7079 00010002",
    "sum(3)": "73756d20 00010000",
    "flip": "666c6970 00000000",
    "flip(3)": "666c6970 00010000",
    "pop(2)": "706f7020 00010000",
    "posd(3,2)": "706f7364 00020001",
    "rotl(3,2)": "726f746c 00020001",
    "max(4)": "6d617820 00020000",
    "solv(3,3)": "736f6c76 00020002",
    "tran(1,2)": "7472616e 00000001",
    "gama(2)": "67616d61 00010000",
    "env(ab)": "656e7620 61622020",
    "env(666f6f20)": "656e7620 666f6f20",
    "tput(7)": "74707574 00070000",
    "clut(2)": "636c7574 00020000",
    "tXYZ": "7458595a 00000000",
    "pi": "70692020 00000000",
    "+INF -INF NaN": "2b494e46 00000000 2d494e46 00000000 4e614e20 00000000",
    "1 if{2 3 add out(0)} else{4 out(1)}": """64617461 3f800000 69662020 00000004 656c7365 00000002
        64617461 40000000 64617461 40400000 61646420 00000000 6f757420 00000000
        64617461 40800000 6f757420 00010000""",
    "1 sel case{5 out(0)} case{6 out(0)} dflt{7 out(0)}": """64617461 3f800000 73656c20 00000000
        63617365 00000002 63617365 00000002 64666c74 00000002 64617461 40a00000 6f757420 00000000
        64617461 40c00000 6f757420 00000000 64617461 40e00000 6f757420 00000000""",
}


@pytest.mark.parametrize(("text", "expected"), BYTES.items())
def test_text_and_bytes(text, expected):
    program = parse(text)
    assert encode_ops(program) == bytes.fromhex(expected)
    assert decode_ops(bytes.fromhex(expected), "here") == program
    assert parse(listing(program)) == program


def test_unused_bits_survive_decoding():
    data = bytes.fromhex("70692020 deadbeef 73696e20 0001ffff 3f3f3f3f 00000001 00010203 ffffffff")
    program = decode_ops(data, "here")
    assert program[1] == Op("sin", 0x0001FFFF)
    assert encode_ops(program) == data


def test_partial_operation_is_refused():
    with pytest.raises(ProfileError, match="A2M0: 9 bytes of operations, expected a multiple of 8"):
        decode_ops(bytes(9), "A2M0")


def test_operand_views():
    op = Op("in", 0x00020003)
    assert (op.s, op.t) == (2, 3)
    assert Op("data", 0x3FC00000).value == 1.5
    assert signature("ab") == 0x61622020
    assert signature_name(0x61622020) == "ab"


@pytest.mark.parametrize("seed", range(200))
def test_random_programs_survive_text_and_bytes(seed):
    program = random_program(seed)
    verify(program, 4, 5)
    assert parse(listing(program)) == program
    assert decode_ops(encode_ops(program), "here") == program


@pytest.mark.parametrize(
    "bits", [0x00000001, 0x7F7FFFFF, 0x3DCCCCCD, 0x80000000, 0x7FC00001, 0xFF800000, 0x3F800001, 0x00800000]
)
def test_every_float32_survives_text(bits):
    assert parse(listing((Op("data", bits),))) == (Op("data", bits),)


def test_listing_shows_short_numbers_and_no_defaults():
    text = "{ 0.1 1e-7 sin(1) sum(2) copy(1,1) copy(1,2) in[0,1] % comment\n env(litX) out(0,3) 1 out(0) }"
    expected = "0.1 1e-07 sin sum copy copy(1,2) in(0) env(litX) out(0,3)\n1 out(0)\n"
    assert listing(parse(text)) == expected


def test_listing_indents_long_blocks():
    text = "in(0) if { " + "1 2 add tput(3) " * 5 + "} else { 4 } out(0)"
    assert listing(parse(text)) == "in(0) if {\n" + "  1 2 add tput(3)\n" * 5 + "} else { 4 } out(0)\n"


def test_a_listing_names_what_is_stored():
    text = "1 if { 2 tput(3) } else { 4 tsav(0,3) } 5 tput(7) tput(6,2) out(0)"
    names = (Temporary("a", 0, 2), Temporary("half", 3), Temporary("% odd", 6), Temporary("line\nend", 7))
    found = listing(parse(text), names)
    assert found == (
        "1 if {\n  2 tput(3)  % half\n} else {\n  4 tsav(0,3)  % a\n} 5 tput(7)\ntput(6,2)  % % odd\nout(0)\n"
    )
    assert parse(found) == parse(text)


def test_comments_blanks_and_names():
    text = "{\tin(0) ; one\n/ two\r\n% three }\n mtx{ first } clut{second} mtx (3) out[0] }"
    expected = [Op("in"), Op("mtx", 5 << 16), Op("clut", 0), Op("mtx", 3 << 16), Op("out")]
    assert list(parse(text, {"first": 5, "second": 0})) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("in(0)\n  sqr out(0)", "line 2, column 3: no operator 'sqr': did you mean 'sqrt'?"),
        ("1,5", "found '1,5', expected a number"),
        ("0x10", "found '0x10', expected a number"),
        ("1e50", "expected a number that float32 holds"),
        ("sum(1)", "'sum' has the argument '1', expected an integer from 2 to 65537"),
        ("copy(0)", "expected an integer from 1 to 65536"),
        ("in(65536)", "expected an integer from 0 to 65535"),
        ("in(a)", "'in' has the argument 'a', expected an integer"),
        ("in", "'in' has no argument, expected in(index)"),
        ("sin(1,2)", "'sin' has 2 arguments, expected at most 1"),
        ("pi(1)", "'pi' takes no argument, found '1'"),
        ("env(abcde)", "'env' has the argument abcde, expected 1 to 4 characters or 8 hex digits"),
        ("data(1)", "'data' has the argument 1, expected 8 hex digits"),
        ("mtx{one}", "no sub-element 'one': did you mean 'on'?"),
        ("else { 1 }", "found 'else' out of place"),
        ("1 if 2", "found '2', expected '{'"),
        ("1 if", "found the end of the text, expected '{'"),
        ("1 if { 2", "the text ends inside a block, expected '}'"),
        ("1 sel dflt { 2 }", "expected 'case' directly after 'sel'"),
        ("{ 1 } 2", "column 7: found '2', expected the end of the program"),
        ("1 }", "found '}', expected the end of the program"),
        ("1 { 2 }", "found '{', expected an operator"),
        ("1 if { { 2 } }", "found '{', expected an operator"),
        ("in(0))", "found ')', expected an operator or a number"),
    ],
)
def test_text_is_refused(text, message):
    with pytest.raises(ProfileError) as caught:
        parse(text, {"on": 0})
    assert message in str(caught.value)


def test_nesting_of_text_is_limited():
    deep = MAX_NESTING
    assert len(parse("1 if { " * deep + "}" * deep)) == 2 * deep
    with pytest.raises(LimitError, match="nested more than 64 deep"):
        parse("1 if { " * (deep + 1) + "}" * (deep + 1))


def test_blocks_of_a_program():
    block = nest(parse("1 if { 2 if { 3 } } else { 4 } 5 sel case { 6 } case { } 7"))
    assert [(step.op.name, step.position, step.heads) for step in block] == [
        ("data", 0, 1), ("if", 1, 2), ("data", 7, 1), ("sel", 8, 3), ("data", 12, 1),
    ]  # fmt: skip
    outer, choice = block[1], block[3]
    (inside,) = outer.branches[0][1].branches
    assert (inside[0].position, inside[0].op.value) == (5, 3)
    assert outer.otherwise[0].op.value == 4
    assert [len(branch) for branch in choice.branches] == [1, 0]
    assert choice.otherwise is None


def test_broken_blocks_have_no_listing():
    with pytest.raises(ProfileError, match="op 0: found 'else'"):
        listing((Op("else", 0),))
    with pytest.raises(ProfileError, match="no operator 'abcd'"):
        listing((Op("abcd", 0),))


def test_data_operands_are_big_endian_floats():
    assert encode_ops(parse("0.3"))[4:] == struct.pack(">f", 0.3)
