"""The text language of calculators in XML: what names and macros stand for."""

import iccdev
import numpy as np
import pytest
from xml_examples import a_profile, document

from iccbrdf.calc.program import Temporary, parse
from iccbrdf.errors import InputError, LimitError, ProfileError, ProfileWarning, UsageError
from iccbrdf.icc import (
    Calculator,
    CompressedUtf8,
    Header,
    Matrix,
    Mluc,
    MultiProcess,
    Profile,
    SignatureTag,
    TagArray,
    Utf8,
    write_profile,
)
from iccbrdf.icc.source_tag import MAX_TEXT, SIGNATURE, CalculatorSource, Source, read_source
from iccbrdf.icc.xml import language, profile_from_xml, profile_to_xml, read_xml


def calculator(inside, inputs=3, outputs=3, attributes="", **options):
    """The calculator with these elements inside."""
    data = document(
        "<AToB0Tag><multiProcessElementType>"
        f'<MultiProcessElements InputChannels="{inputs}" OutputChannels="{outputs}">\n'
        f'<CalculatorElement InputChannels="{inputs}" OutputChannels="{outputs}" {attributes}>{inside}'
        "</CalculatorElement></MultiProcessElements></multiProcessElementType></AToB0Tag>"
    )
    return profile_from_xml(data, "a.xml", strict=True, **options)["A2B0"].elements[0]


def program(text, declarations="", **options):
    return calculator(f"{declarations}<MainFunction>{text}</MainFunction>", **options).program


NAMES = 'InputNames="a b[2]" OutputNames="X Y Z"'
VARIABLES = (
    '<Variables><Declare Name="v" Position="4" Size="3"/><Declare Name="w"/>'
    '<Declare Name="rgb" Size="5">r g[2] b</Declare></Variables>'
)


@pytest.mark.parametrize(
    ("text", "means"),
    [
        ("{ in{a} out{Z} }", "in(0) out(2)"),
        ("{ in{b} out{Y,2} }", "in(1,2) out(1,2)"),
        ("{ in{b[1]} out{X} }", "in(2) out(0)"),
        ("{ in{a,3} out{X[1],2} }", "in(0,3) out(1,2)"),
        ("{ tget{v} tput{v[1]} tsav{v[1,2]} }", "tget(4,3) tput(5) tsav(5,2)"),
        # The first free slot is after the highest with a position; then in the order of use.
        ("{ tget{rgb.g} tget{w} tget{rgb} tget{rgb.b[0]} }", "tget(8,2) tget(12) tget(7,5) tget(10)"),
        ("{in(0)tget(1)}", None),
        ("{ in tget out 1 in (2) }", "in(0) tget(0) out(0) 1 in(2)"),
        ("{ 1 if{2 out(0)}else{3 out(0)} }", "1 if {2 out(0)} else {3 out(0)}"),
        ("{ 1 % a comment with tget{nothing}\n ; another\n / a third #m\n out(0) }", "1 out(0)"),
        ("{ 1e999 -1e999 -nan }", "data(7f800000) data(ff800000) data(ffc00000)"),
    ],
)
def test_names(text, means):
    found = program(text, VARIABLES, attributes=NAMES)
    assert found == parse(means or text)


MACROS = """<Macros>
  <Macro Name="twice">2 mul</Macro>
  <Macro Name="four">call{twice} #twice</Macro>
  <Macro Name="scale" Local="offset factor[2]">
    tput{@offset} tget{@factor[1]} call{inner} tget{@factor}</Macro>
  <Macro Name="inner" Local="x">tput{@x}</Macro>
</Macros>"""


@pytest.mark.parametrize(
    ("text", "means"),
    [
        ("{ 3 call{four} out(0) }", "3 2 mul 2 mul out(0)"),
        ("{ 3 #four out(0) }", "3 2 mul 2 mul out(0)"),
        # A macro's own slots begin after all variables, those of a macro that it calls after its own.
        ("{ call{scale} tget{w} call{inner} }",
         "tput(8) tget(10) tput(11) tget(9,2) tget(7) tput(8)"),
    ],
)  # fmt: skip
def test_macros(text, means):
    assert program(text, VARIABLES + MACROS, attributes=NAMES) == parse(means)


def matrix(name, value):
    attribute = f'Name="{name}"' if name else ""
    return (
        f'<MatrixElement {attribute} InputChannels="1" OutputChannels="1"><MatrixData>{value}</MatrixData>'
        "</MatrixElement>"
    )


def test_sub_elements_without_a_name_come_first_then_the_others_as_they_are_used():
    names = {"late": 1, "": 2, "unused": 3, "soon": 4}
    elements = "".join(matrix(name, value) for name, value in names.items()) + matrix("", 5)
    element = calculator(
        f"<SubElements>{elements}</SubElements>"
        "<MainFunction>{ 1 mtx{soon} elem{late} mtx{soon} mtx(0) out(0) }</MainFunction>"
    )
    assert [e.matrix[0, 0] for e in element.elements] == [2, 5, 4, 1]
    assert element.program == parse("1 mtx(2) elem(3) mtx(2) mtx(0) out(0)")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{\n in{c} }", "a.xml:3: <MainFunction>: no input channel 'c': valid are a, b"),
        ("{ in{X} }", "a.xml:2: <MainFunction>: no input channel 'X'"),
        ("{ in{b[1],2} }", r"in\{b\[1\],2\}: found inputs 2 to 3, expected up to 2"),
        ("{ out{Z,2} }", "found outputs 2 to 3, expected up to 2"),
        ("{ in{a[0,2]} }", r"expected name, name\[first\] or name\[first\],count"),
        ("{ tget{vv} }", "no variable 'vv': did you mean 'v'"),
        ("{ tget{rgb.h} }", "no member of 'rgb' 'h': "),
        ("{ tget{v[2,2]} }", r"tget\{v\[2,2\]\}: found 2 to 3, expected up to 2"),
        ("{ tget{@x} }", "expected a macro around it"),
        ("{ tget{v}out(0) }", r"found 'tget\{v\}out\(0\)', expected operator\{name\} between blanks"),
        ("{ tgett{v} }", "line 2, column 3: no operator 'tgett': did you mean 'tget'"),
        ("{ call{m} }", "no macro 'm': "),
        ("{ mtx{m} }", "no sub-element 'm': there are none"),
        ("{\n\n sqrtt }", "line 4, column 2: no operator 'sqrtt': did you mean 'sqrt'"),
        ("{ 1 ", "line 2, column 5: the text ends inside a block"),
        ("{ 1 } 2", "expected the end of the program"),
    ],
)
def test_what_is_not_declared(text, message):
    with pytest.raises(ProfileError, match=message):
        program(text, VARIABLES, attributes=NAMES)


@pytest.mark.parametrize(
    ("declarations", "message"),
    [
        ('<Variables><Declare Name="1a"/></Variables>', "Name: found '1a', expected letters, digits and _"),
        ('<Variables><Declare Name="a"/><Declare Name="a"/></Variables>', "'a', which is declared"),
        ('<Variables><Declare Name="a">b b</Declare></Variables>', "found 'b' twice"),
        ('<Variables><Declare Name="a" Size="65537"/></Variables>', "found 65537 slots, expected"),
        ('<Macros><Macro Name="m">1</Macro><Macro Name="m">2</Macro></Macros>', "'m', which is declared"),
        ('<Macros><Macro Name="m"> </Macro></Macros>', "macro 'm': found no text"),
        ('<Macros><Macro Name="m">call{m}</Macro></Macros>', "macro 'm' calls itself, by way of m"),
        ('<Macros><Macro Name="m">#n</Macro><Macro Name="n">call{m}</Macro></Macros>', "by way of m n"),
        ("<Imports><Import Filename='a.xml'/></Imports>", "expected none without a folder to read from"),
        ("<SubElements><MatrixElment/></SubElements>", "no processing element: did you mean 'MatrixElement'"),
    ],
)
def test_declarations_that_are_wrong(declarations, message):
    with pytest.raises(ProfileError, match=message):
        program("{ #m }", declarations)


def test_the_same_macro_twice_is_one():
    macros = '<Macros><Macro Name="m">1</Macro><Macro Name="m">1</Macro></Macros>'
    assert program("{ #m }", macros) == parse("1")


def test_a_calculator_has_a_function():
    with pytest.raises(ProfileError, match=r"a.xml:2: <CalculatorElement>: no <MainFunction> found in it"):
        calculator("")


def test_macros_that_grow_endlessly_are_stopped(monkeypatch):
    monkeypatch.setattr(language, "MAX_WORDS", 1000)
    macros = "".join(f'<Macro Name="m{i}">{f"#m{i - 1} " * 10 if i else "1"}</Macro>' for i in range(12))
    with pytest.raises(LimitError, match="macros stand for more than 1000 words"):
        program("{ #m11 }", f"<Macros>{macros}</Macros>")


def test_macros_that_call_one_another_deeply_are_stopped():
    macros = "".join(f'<Macro Name="m{i}">{f"#m{i - 1}" if i else "1"}</Macro>' for i in range(66))
    assert program("{ #m63 }", f"<Macros>{macros}</Macros>") == parse("1")
    with pytest.raises(LimitError, match="more than 64 macros that call one another"):
        program("{ #m65 }", f"<Macros>{macros}</Macros>")


# Imports ---------------------------------------------------------------------------------------------------

IMPORTED = f"""<IccCalcImport><Imports><Import Filename="more.xml"/></Imports>
<SubElements>{matrix("half", 0.5)}</SubElements>
<Variables><Declare Name="v"/></Variables>
<Macros><Macro Name="m">mtx{{half}} tput{{v}}</Macro></Macros></IccCalcImport>"""
MORE = """<IccCalcImport><Imports><Import Filename="first.xml"/></Imports>
<Variables><Declare Name="w"/></Variables></IccCalcImport>"""
IMPORTS = "<Imports><Import Filename='first.xml'/><Import Filename='first.xml'/></Imports>"


def test_imports_bring_declarations_once(tmp_path):
    (tmp_path / "first.xml").write_text(IMPORTED)
    (tmp_path / "more.xml").write_text(MORE)
    element = calculator(
        f"{IMPORTS}<MainFunction>{{ tget{{w}} #m }}</MainFunction>", folder=tmp_path
    )
    assert element.program == parse("tget(0) mtx(0) tput(1)")
    assert element.elements == (Matrix.of([[0.5]]),)


@pytest.mark.parametrize(
    ("imported", "error", "message"),
    [
        (None, InputError, "first.xml: cannot be read: No such file"),
        ("<IccProfile/>", ProfileError, "first.xml:1: <IccProfile>: expected <IccCalcImport>"),
        ("no XML", InputError, "first.xml:1: .*expected an XML file"),
        (f"<IccCalcImport><SubElements>{matrix('', 1)}</SubElements></IccCalcImport>",
         ProfileError,
         "first.xml:1: <MatrixElement>: no attribute 'Name', expected one for an imported"),
        ('<IccCalcImport><Variables><Declare Name="v" Position="1"/></Variables></IccCalcImport>',
         ProfileError, "Position: expected none for an imported variable"),
        ('<IccCalcImport><Macros><Macro Name="m">\n1 tget{u}</Macro></Macros></IccCalcImport>',
         ProfileError, "first.xml:2: <Macro>: no variable 'u': "),
    ],
)  # fmt: skip
def test_errors_in_imports_are_errors(tmp_path, imported, error, message):
    if imported is not None:
        (tmp_path / "first.xml").write_text(imported)
    with pytest.raises(error, match=message):
        program("{ #m }", IMPORTS, folder=tmp_path)


@pytest.mark.parametrize(
    "name", ["../secret.xml", "{outside}/secret.xml", "link.xml", "folder/../../secret.xml"]
)
def test_imports_stay_in_the_folder(tmp_path, name):
    inside = tmp_path / "inside"
    (inside / "folder").mkdir(parents=True)
    (tmp_path / "secret.xml").write_text("<IccCalcImport/>")
    (inside / "link.xml").symlink_to(tmp_path / "secret.xml")
    imports = f"<Imports><Import Filename='{name.format(outside=tmp_path)}'/></Imports>"
    with pytest.raises(ProfileError, match=f"expected one inside {inside}"):
        program("{ 1 }", imports, folder=inside)


def test_imports_are_sought_beside_the_file(tmp_path):
    (tmp_path / "first.xml").write_text("<IccCalcImport/>")
    path = tmp_path / "a.xml"
    data = profile_to_xml(a_profile(A2B0=MultiProcess.of(Calculator(1, 1, parse("1 out(0)")))))
    path.write_bytes(data.replace(b"<MainFunction>", IMPORTS.encode() + b"<MainFunction>"))
    assert read_xml(path)["A2B0"].elements[0].program == parse("1 out(0)")


# The reference runs what we compile ---------------------------------------------------------------------


def test_reference_runs_a_program_with_names_and_macros(tmp_path):
    element = calculator(
        f"""{VARIABLES}<Macros><Macro Name="scaled" Local="k">tput{{@k}} tget{{@k}} smul(3)</Macro></Macros>
        <SubElements><MatrixElement Name="swap" InputChannels="3" OutputChannels="3">
        <MatrixData>0 0 1  0 1 0  1 0 0</MatrixData><ConstantData>0 0 0.125</ConstantData></MatrixElement>
        <CLutElement Name="fill" InputChannels="1" OutputChannels="9"><GridPoints>2</GridPoints>
        <TableData>0 0 0 0 0 0 0 0 0 1 1 1 1 1 1 1 1 1</TableData></CLutElement>
        </SubElements><MainFunction>{{ in{{a,3}} 0.5 call{{scaled}} tput{{v}} tget{{v}} mtx{{swap}}
        out{{X,3}}
        0 if {{ 1 clut{{fill}} pop(9) }} }}</MainFunction>""",
        attributes=NAMES,
    )
    profile = Profile(
        Header(device_class="mid ", colour_space="nc0003", mcs="mc0003"),
        {
            "desc": Mluc.of("names"),
            "cprt": Mluc.of("none"),
            "mcta": TagArray.of_texts(["X", "Y", "Z"]),
            "A2M0": MultiProcess.of(element),
        },
    )
    path = tmp_path / "a.icc"
    write_profile(profile_from_xml(profile_to_xml(profile)), path)
    cmm = iccdev.IccCmm()
    cmm.attach(str(path), lut_type=iccdev.LutType.MCS)
    cmm.begin()
    found = cmm.apply([0.2, 0.4, 0.8])
    np.testing.assert_allclose(found, [0.4, 0.2, 0.1 + 0.125], rtol=2e-6)


# Names travel in a private tag -----------------------------------------------------------------------------

TEXT = "in(0,3) tput(2,3) tget(2,3) tget(3) tget(3,2) tget(1,3) tsav(0) in(2) out(0,2) out(2) out(3,2)"
SOURCE = CalculatorSource(
    tag="A2B0",
    inputs=("kd.X", "kd X", "3D"),
    outputs=("X", "Y", "Z", "a", "b"),
    temporaries=(Temporary("half", 2, 3), Temporary("θ", 0)),
    templates=(("model One\n\ninput kd\n", "model.calc"), ("# -- θ --\n", "b.calc")),
    constants={"table": ((1.0, 2.5), (0.1, -1e-30)), "white": (0.9,), "way": "up"},
    effects={"gloss": True, "relief": False},
    variables={"litI": 3.141592653589793},
)
RECIPE = {"model": "brdf1", "white": [0.9, 1.0, 0.8]}


def with_names(*sources):
    tag = MultiProcess.of(Calculator(3, 5, parse(TEXT)))
    return a_profile(A2B0=tag, **{SIGNATURE: Source(sources, RECIPE).tag()})


def test_names_come_back():
    profile = with_names(SOURCE)
    assert read_source(profile) == Source((SOURCE,), RECIPE)
    assert read_source(Profile.from_bytes(profile.to_bytes())) == Source((SOURCE,), RECIPE)
    back = profile_from_xml(profile_to_xml(profile), strict=True)
    assert read_source(back) == Source((SOURCE,), RECIPE)
    assert back.to_bytes() == profile.to_bytes()


def test_programs_are_written_with_the_names_that_the_dialect_takes():
    text = profile_to_xml(with_names(SOURCE)).decode()
    assert 'InputNames="kd_X kd_X_2 _3D" OutputNames="X Y Z a b"' in text
    comment = text.partition("<!--")[2].partition("-->")[0]
    assert "table = 1 2.5; 0.1 -1e-30\n" in comment
    assert "gloss = on\nrelief = off\n" in comment
    assert "model.calc:\nmodel One\n\ninput kd\n" in comment
    assert '<Declare Name="half" Position="2" Size="3"/>' in text
    assert '<Declare Name="_" Position="0" Size="1"/>' in text
    main = text.partition("<MainFunction>")[2].partition("</MainFunction>")[0].split()
    assert main == [
        "{", "in{kd_X,3}", "tput{half}", "tget{half}", "tget{half[1]}", "tget{half[1,2]}", "tget(1,3)",
        "tsav{_}",
        # The reference holds counted outputs against the number of inputs.
        "in{_3D}", "out{X,2}", "out{Z}", "out(3,2)", "}",
    ]  # fmt: skip


def test_what_the_tag_says_of_other_calculators_changes_nothing():
    others = [
        CalculatorSource("A2B0", element=1, inputs=("a",)),
        CalculatorSource("B2A0", inputs=("a",)),
        CalculatorSource("A2B0", inputs=("a", "b", "c", "d")),
        CalculatorSource("desc", element=-1),
    ]
    assert b"InputNames" not in profile_to_xml(with_names(*others))


def test_a_broken_tag_hinders_nothing():
    profile = a_profile(A2B0=MultiProcess.of(Calculator(1, 1, parse("1 out(0)"))), bsrc=Utf8("{"))
    with pytest.warns(ProfileWarning, match="tag bsrc: .*; programs are written without names"):
        assert b"InputNames" not in profile_to_xml(profile)


@pytest.mark.parametrize(
    "tag",
    [
        SignatureTag("abcd"),
        CompressedUtf8(b"no zlib stream"),
        CompressedUtf8.of("["),
        Utf8("["),
        Utf8("[" * 100_000),
        Utf8("[]"),
        Utf8('{"schema": "other/1"}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": {}}'),
        Utf8('{"schema": "iccbrdf.source/1", "recipe": []}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"constants": {"a": 1}}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"constants": {"a": [[1], 2]}}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"constants": {"a": [NaN]}}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"variables": {"a": true}}]}'),
        Utf8(f'{{"schema": "iccbrdf.source/1", "calculators": [{{"variables": {{"a": 1{"0" * 400}}}}}]}}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"effects": {"a": 1}}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"templates": ["model x"]}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"tag": 1}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"tag": "A2B0", "inputs": [1]}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"temporaries": [["a", 65536, 1]]}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"temporaries": [["a", 0, 2], ["b", 1, 1]]}]}'),
        Utf8('{"schema": "iccbrdf.source/1", "calculators": [{"temporaries": [["a", "0", 2]]}]}'),
    ],
)
def test_a_broken_tag_is_a_profile_error(tag):
    with pytest.raises(ProfileError, match="tag bsrc: "):
        read_source(a_profile(bsrc=tag))


@pytest.mark.parametrize("tag", [CompressedUtf8.of("[" * (MAX_TEXT + 1)), Utf8(" " * (MAX_TEXT + 1))])
def test_a_tag_that_unpacks_to_too_much_is_refused(tag):
    profile = a_profile(A2B0=MultiProcess.of(Calculator(1, 1, parse("1 out(0)"))), bsrc=tag)
    with pytest.raises(LimitError, match=r"tag bsrc: .*more than 131072"):
        read_source(profile)
    with pytest.warns(ProfileWarning, match="programs are written without names"):
        profile_to_xml(profile)


def test_slots_have_one_name():
    with pytest.raises(UsageError, match="found both in slot 1"):
        CalculatorSource("A2B0", temporaries=(Temporary("a", 0, 2), Temporary("b", 1)))
    with pytest.raises(UsageError, match="expected them within 65536 slots"):
        Temporary("a", 65535, 2)
