"""XML that was made to break readers: nothing but the documented errors leaves, and soon."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
import xml_examples
from click.testing import CliRunner
from icc_examples import a_mid
from xml_examples import HEADER, a_profile, document, transform

from iccbrdf.cli.icc import command as icc_command
from iccbrdf.cli.xml import command as xml_command
from iccbrdf.errors import (
    InputError,
    LimitError,
    ProfileError,
    UnsupportedError,
    UsageError,
)
from iccbrdf.icc import TagArray, Utf8, read_profile
from iccbrdf.icc.xml import node, profile_from_xml, profile_to_xml, read_xml
from iccbrdf.resources import folder

ONE = 'InputChannels="1" OutputChannels="1"'
MVIS = folder("profiles") / "fogra39_gloss" / "mvis.icc"


def laughs(name):
    """Entities, each ten times the one before, of which `name` stands for 10^11 words."""
    rest = "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in pairwise("abcdefghijkl"))
    return f'<!DOCTYPE x [<!ENTITY a "ha">{rest}<!ENTITY {name} "&l;">]>'


PASSWORDS = 'SYSTEM "file:///etc/passwd"'
XINCLUDE = "http://www.w3.org/2001/XInclude"


def text(content):
    return f"<copyrightTag><textType><TextData>{content}</TextData></textType></copyrightTag>"


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (document(text("&m;"), before=laughs("m")), LimitError),
        (document('<PrivateTag TagSignature="&m;"/>', before=laughs("m")), LimitError),
        (document("", before=laughs("m")), ProfileError),
        (document(text("&x;"), before=f"<!DOCTYPE x [<!ENTITY x {PASSWORDS}>]>"), ProfileError),
        (document("", before=f"<!DOCTYPE x [<!ENTITY % x {PASSWORDS}> %x;]>"), ProfileError),
        (document("", before='<!DOCTYPE x SYSTEM "http://127.0.0.1:9/x.dtd">'), ProfileError),
        (document(text("&x;")), InputError),
        (document(f'<x:include xmlns:x="{XINCLUDE}" href="/etc/passwd"/>'), ProfileError),
        (b"<a>" * 100_000, LimitError),
        (document(text("a" * 10_100_000)), LimitError),
    ],
)
def test_xml_at_its_worst(data, error):
    with pytest.raises(error):
        profile_from_xml(data)


@pytest.mark.parametrize(
    "data", [b"", b"\0" * 100, b"<a", b"PNG", b'<?xml version="1.0" encoding="none"?><a/>']
)
def test_what_is_no_xml(data):
    with pytest.raises(InputError, match=r"a\.xml:1: "):
        profile_from_xml(data, "a.xml")


def nested_arrays(depth):
    inner = "<utf8Type><TextData>a</TextData></utf8Type>"
    for _ in range(depth):
        items = f"<ArraySignature>tary</ArraySignature><ArrayTags>{inner}</ArrayTags>"
        inner = f"<tagArrayType>{items}</tagArrayType>"
    return document(f"<metaDataTag>{inner}</metaDataTag>")


def test_nesting_has_the_limit_of_the_binary_form():
    assert profile_from_xml(nested_arrays(31))["meta"].signature == "tary"
    with pytest.raises(LimitError, match="nested deeper than the limit of 32"):
        profile_from_xml(nested_arrays(32))


def test_nested_calculators_have_a_limit():
    element = f"<CalculatorElement {ONE}><MainFunction>{{ 1 out(0) }}</MainFunction></CalculatorElement>"
    for _ in range(40):
        element = (
            f"<CalculatorElement {ONE}><SubElements>{element}</SubElements>"
            "<MainFunction>{ 1 out(0) }</MainFunction></CalculatorElement>"
        )
    with pytest.raises(LimitError, match="<CalculatorElement>: nested deeper"):
        profile_from_xml(transform(element, 1, 1))


@pytest.mark.parametrize(
    ("elements", "message"),
    [
        ('<CLutElement InputChannels="16" OutputChannels="65535"><GridGranularity/></CLutElement>',
         "no attribute 'GridGranularity'"),
        ('<CLutElement InputChannels="16" OutputChannels="65535" GridGranularity="255">'
         "<TableData>1</TableData></CLutElement>", "found 1 numbers, expected 20946727875413668"),
        ('<CLutElement InputChannels="3" OutputChannels="3" GridGranularity="1">'
         "<TableData>1 1 1</TableData></CLutElement>", "expected 1 to 16 inputs of 2 to 255 grid points"),
        ('<MatrixElement InputChannels="4294967296" OutputChannels="3"/>', "found '4294967296'"),
        (f'<MatrixElement InputChannels="{"9" * 5000}" OutputChannels="3"/>', "InputChannels: found '9999"),
        ('<MatrixElement InputChannels="-1" OutputChannels="3"/>', "InputChannels: found '-1'"),
        ('<MatrixElement InputChannels="3" OutputChannels="3"><MatrixData>1 2</MatrixData></MatrixElement>',
         r"<MatrixData>: found 2 numbers, expected 9 \(3 x 3\)"),
        (f'<MatrixElement {ONE}><MatrixData>1e39</MatrixData></MatrixElement>',
         "found 1e[+]39, which float32 cannot hold"),
        ('<MatrixElement InputChannels="2" OutputChannels="2"><MatrixData InvertMatrix="true">1 1 1 1'
         "</MatrixData></MatrixElement>", "expected a matrix that has an inverse"),
        ('<MatrixElement InputChannels="1" OutputChannels="2"><MatrixData InvertMatrix="true">1 1'
         "</MatrixData></MatrixElement>", "expected a matrix that has an inverse"),
        (f'<CurveSetElement {ONE}><DuplicateCurve Index="0"/></CurveSetElement>',
         "Index: found '0', expected less than 0"),
        ('<CurveSetElement InputChannels="2" OutputChannels="2"><SingleSampledCurve FirstEntry="0" '
         'LastEntry="1">0 1</SingleSampledCurve></CurveSetElement>', "inputs: found 2, expected 1"),
        (f'<CurveSetElement {ONE}><SingleSampledCurve FirstEntry="nan" '
         'LastEntry="1">0 1</SingleSampledCurve></CurveSetElement>', "expected finite ones that increase"),
        ('<EmissionObserverElement InputChannels="2" OutputChannels="3">'
         '<Wavelengths start="1e9" end="1" steps="2"/>'
         "<WhiteData>1 1</WhiteData></EmissionObserverElement>", "expected a number in the range of 16-bit"),
        (f'<TintArrayElement {ONE}/>', "found 0 elements in it, expected one"),
        (f'<UnknownElement type=\"matf\" {ONE}>00</UnknownElement>', "line 1"),
        (f'<UnknownElement type=\"abcde\" {ONE}/>', "type: found 'abcde'"),
        (f'<UnknownElement type=\"abcd\" {ONE}>0</UnknownElement>', "pairs of hexa"),
    ],
)  # fmt: skip
def test_elements_that_contradict(elements, message):
    data = transform(elements, 1, 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(ProfileError, match=f"a.xml:1: .*{message}|a.xml: .*{message}"):
            profile_from_xml(data, "a.xml")


@pytest.mark.parametrize(
    ("tags", "error", "message"),
    [
        ("<copyrihtTag/>", ProfileError, "a.xml:1: <copyrihtTag>: no tag type"),
        ("<utf8Typ/>", ProfileError, "no tag type: did you mean 'utf8Type'"),
        ("<copyrightTag/>", ProfileError, "found 0 elements in it, expected one tag type"),
        ('<PrivateTag TagSignature="abcde"/>', ProfileError, "found 'abcde', expected up to four characters"),
        ("<PrivateTag/>", ProfileError, "no attribute 'TagSignature'"),
        ('<copyrightTag SameAs="profileDescriptionTag"/>', ProfileError, "SameAs: no tag 'desc' before it"),
        ("<utf8Type><TextData>a</TextData></utf8Type>", ProfileError, "no <TagSignature> found in it"),
        ('<copyrightTag><PrivateType type="ui16"><UnknownData>0000000001</UnknownData></PrivateType>'
         "</copyrightTag>", ProfileError, "no whole number of ui16 values"),
        ("<metaDataTag><XYZArrayType><XYZNumber X='1' Y='nan' Z='1'/></XYZArrayType></metaDataTag>",
         ProfileError, "found nan, expected -32768"),
        (f"<metaDataTag><uInt8ArrayType><Array>{'9' * 100_000}</Array></uInt8ArrayType></metaDataTag>",
         ProfileError, "expected an integer from 0 to 255"),
        ("<metaDataTag><uInt8ArrayType><Array>nan</Array></uInt8ArrayType></metaDataTag>",
         ProfileError, "found nan, expected an integer"),
        ("<metaDataTag><uInt8ArrayType><Array>1 two</Array></uInt8ArrayType></metaDataTag>",
         ProfileError, "found 'two', expected a number"),
        ("<copyrightTag><textType><TextData>€</TextData></textType></copyrightTag>",
         ProfileError, "expected latin-1 text"),
        ("<redTRCTag><curveType><Curve IdentitySize='99999999'/></curveType></redTRCTag>",
         ProfileError, "IdentitySize: found 99999999, expected 1 to 65536"),
        ("<copyrightTag><utf8Type><TextData File='/etc/passwd'/></utf8Type></copyrightTag>",
         ProfileError, "found the file name '/etc/passwd', expected none"),
    ],
)  # fmt: skip
def test_tags_that_are_wrong(tags, error, message):
    with pytest.raises(error, match=message):
        profile_from_xml(document(tags), "a.xml")


def header(more):
    return HEADER.replace("</Header>", f"{more}</Header>")


@pytest.mark.parametrize(
    ("found", "message"),
    [
        ("<Header/>", "no <ProfileDeviceClass> found in it"),
        ("", "no <Header> found in it"),
        (header("<ProfileVersion>five</ProfileVersion>"), "found 'five'"),
        (header("<RenderingIntent>Relativ</RenderingIntent>"), "did you mean 'Relative'"),
        (header('<ProfileFlags VendorFlags="xyz"/>'), "VendorFlags: found 'xyz'"),
        (header('<ProfileFlags EmbeddedInFile="yes"/>'), "EmbeddedInFile: found 'yes'"),
        (header("<CreationDateTime>2020</CreationDateTime>"), "found '2020'"),
    ],
)
def test_headers_that_are_wrong(found, message):
    with pytest.raises(ProfileError, match=message):
        profile_from_xml(document("", found), "a.xml")


def matrix_of_file(attribute, name):
    return transform(f'<MatrixElement {ONE}><MatrixData {attribute}="{name}"/></MatrixElement>', 1, 1)


@pytest.mark.parametrize("attribute", ["Filename", "File"])
def test_files_outside_the_folder_are_not_read(tmp_path, attribute):
    (tmp_path / "secret.txt").write_text("1")
    inside = tmp_path / "inside"
    inside.mkdir()
    path = inside / "a.xml"
    path.write_bytes(matrix_of_file(attribute, "../secret.txt"))
    with pytest.raises(ProfileError, match=f"'../secret.txt', expected one inside {inside}"):
        read_xml(path)
    path.write_bytes(matrix_of_file(attribute, "secret.txt"))
    assert read_xml(path, folder=tmp_path)["A2B0"].elements[0].matrix == [[1]]


def test_a_document_and_its_files_have_a_limit(tmp_path, monkeypatch):
    (tmp_path / "large.txt").write_text("1 " * 1000)
    path = tmp_path / "a.xml"
    path.write_bytes(matrix_of_file("File", "large.txt"))
    monkeypatch.setattr(node, "MAX_BYTES", 1000)
    with pytest.raises(LimitError, match=r"large\.txt: an XML file and the files it names exceed 1000 bytes"):
        read_xml(path)
    monkeypatch.setattr(node, "MAX_BYTES", 100)
    with pytest.raises(LimitError, match=r"a\.xml: an XML file"):
        read_xml(path)
    with pytest.raises(LimitError, match="larger than the limit of 100 bytes"):
        profile_from_xml(path.read_bytes())


def test_shared_parts_of_shared_parts_do_not_fill_the_memory(monkeypatch):
    tag = Utf8("a" * 1000)
    for _ in range(3):
        tag = TagArray("tary", (tag,) * 20)
    monkeypatch.setattr(node, "MAX_BYTES", 100_000)
    with pytest.raises(LimitError, match="the XML exceeds the limit of 100000 characters"):
        profile_to_xml(a_profile(meta=tag))


def test_text_that_xml_readers_refuse_is_not_written():
    with pytest.raises(LimitError, match="10100000 characters, but XML readers take 10000000 at most"):
        profile_to_xml(a_profile(meta=Utf8("a" * 10_100_000)))


def mutations(data, count):
    """Copies of XML with a few characters, words or pieces changed."""
    random = np.random.default_rng(7)
    words = [b"0", b"-1", b"65536", b"99999999999", b"nan", b"1e999", b"", b"<", b"&", b"{", b"}", b"(",
             b"\xff", b"a", b"<utf8Type/>", b"#m", b"tget{v}", b"[1]", b'"']  # fmt: skip
    for _ in range(count):
        changed = bytearray(data)
        for _ in range(random.integers(1, 4)):
            start = int(random.integers(len(changed)))
            length = int(random.choice([0, 1, 1, 3, 40]))
            changed[start : start + length] = words[random.integers(len(words))]
        yield bytes(changed)


def read(data):
    """Whether it is a profile; raises what is none of the documented errors."""
    try:
        return bool(profile_from_xml(data).to_bytes())
    except (InputError, ProfileError, UnsupportedError, LimitError):
        return False


@pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")
def test_random_changes_raise_nothing_else():
    tags = {f"t{i:03}": tag for i, tag in enumerate(xml_examples.TAGS.values())}
    whole = profile_to_xml(a_profile(**tags, A2B0=a_mid()["A2M0"]))
    sound = sum(read(data) for data in mutations(whole, 150))
    assert 3 < sound < 140


# The commands --------------------------------------------------------------------------------------------


def run(command, *arguments):
    return CliRunner().invoke(command, [str(a) for a in arguments], standalone_mode=False)


def test_there_and_back_on_the_command_line(tmp_path):
    xml, icc = tmp_path / "a.xml", tmp_path / "a.icc"
    result = run(xml_command, MVIS, "-o", xml)
    assert result.exception is None
    assert str(xml) in result.output
    result = run(icc_command, xml, "-o", icc, "--json")
    assert result.exception is None
    assert '"schema": "iccbrdf.icc/1"' in result.output
    assert icc.read_bytes() == MVIS.read_bytes()


def test_nothing_is_overwritten_unless_asked(tmp_path):
    xml, icc = tmp_path / "a.xml", tmp_path / "a.icc"
    run(xml_command, MVIS, "-o", xml)
    icc.write_text("mine")
    for command, source, target in ((icc_command, xml, icc), (xml_command, MVIS, xml)):
        before = target.read_bytes()
        assert isinstance(run(command, source, "-o", target).exception, UsageError)
        assert target.read_bytes() == before
        assert run(command, source, "-o", target, "--force").exception is None
    assert read_profile(icc) == read_profile(MVIS)


def test_nothing_is_left_behind_an_error(tmp_path):
    xml = tmp_path / "a.xml"
    xml.write_text("<IccProfile/>")
    assert isinstance(run(icc_command, xml, "-o", tmp_path / "a.icc").exception, ProfileError)
    assert isinstance(run(icc_command, tmp_path / "none.xml", "-o", tmp_path / "a.icc").exception, InputError)
    assert isinstance(run(xml_command, xml, "-o", tmp_path / "b.xml").exception, ProfileError)
    assert [path.name for path in tmp_path.iterdir()] == ["a.xml"]


def test_strict_on_the_command_line(tmp_path):
    xml = tmp_path / "a.xml"
    xml.write_bytes(document("", header("<Other/>")))
    with pytest.warns(UserWarning, match="<Other>: ignored in <Header>"):
        assert run(icc_command, xml, "-o", tmp_path / "a.icc").exception is None
    assert isinstance(run(icc_command, xml, "-o", tmp_path / "b.icc", "--strict").exception, ProfileError)
