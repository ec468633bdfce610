"""Profiles to XML and back, and what the XML says."""

import warnings

import numpy as np
import pytest
import xml_examples
from icc_examples import a_mid, an_mvis, conformance_profiles
from lxml import etree
from xml_examples import HEADER, a_profile, document, transform

from iccbrdf.errors import ProfileWarning, UnsupportedError
from iccbrdf.icc import (
    ELEMENTS,
    TAGS,
    XYZ,
    CurveSet,
    Header,
    Matrix,
    Mluc,
    MultiProcess,
    NumberArray,
    Profile,
    Unknown,
    read_profile,
)
from iccbrdf.icc.xml import profile_from_xml, profile_to_xml, read_xml
from iccbrdf.resources import folder

OURS = sorted(folder("profiles").rglob("*.icc"))


def there_and_back(profile):
    """The profile read from its XML, which nothing is to be wrong with."""
    return profile_from_xml(profile_to_xml(profile), strict=True)


def find(profile, path):
    return etree.fromstring(profile_to_xml(profile)).find(path)


@pytest.mark.parametrize("path", OURS, ids=[f"{p.parent.name}/{p.name}" for p in OURS])
def test_our_profiles_come_back_byte_for_byte(path):
    assert there_and_back(read_profile(path)).to_bytes() == path.read_bytes()


def test_there_are_profiles_of_ours():
    assert len(OURS) >= 9


def test_version_2_profiles_keep_their_tags(shared_data):
    for path in sorted((shared_data / "icc").iterdir()):
        profile = read_profile(path)
        back = there_and_back(profile)
        assert back.header == profile.header or back.header.size != profile.header.size
        for signature in profile:
            if profile[signature].signature != "mft2":  # XML leaves out bytes behind the last curve
                assert back.tag_data(signature) == profile.tag_data(signature)


@pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")
def test_profiles_of_the_reference_tools_keep_their_programs():
    for name, data in conformance_profiles():
        profile = Profile.from_bytes(data, name)
        back = there_and_back(profile)
        for signature in profile:
            assert back[signature] == profile[signature], name


@pytest.mark.parametrize("profile", [a_mid(), an_mvis()], ids=["mid", "mvis"])
def test_profiles_made_in_memory(profile):
    assert there_and_back(profile).to_bytes() == profile.to_bytes()


@pytest.mark.parametrize("name", xml_examples.TAGS)
def test_every_tag_type_and_element(name):
    tag = xml_examples.TAGS[name]
    data = profile_to_xml(a_profile(abcd=tag))
    assert b"PrivateType" not in data or "unknown" in name or "nested" in name
    back = profile_from_xml(data, strict=True)["abcd"]
    if "not finite" in name or name == "fl32":
        # Equal but for the bits of a NaN, which XML has no words for.
        assert type(back) is type(tag)
        mine, theirs = np.frombuffer(tag.to_bytes(), ">f4"), np.frombuffer(back.to_bytes(), ">f4")
        np.testing.assert_array_equal(mine, theirs)
    else:
        assert back.to_bytes() == tag.to_bytes()


def test_every_signature_has_an_example():
    tags = {tag.signature for tag in xml_examples.TAGS.values()}
    assert tags >= set(TAGS.classes)
    assert {element.signature for element in xml_examples.ELEMENTS.values()} >= set(ELEMENTS.classes)


HEADER_OF_EVERYTHING = Header(
    device_class="mlnk", colour_space="nc000a", pcs="Lab ", mcs="mc0003", version=(5, 1, 2),
    subclass_version=(0x12, 0x34), created=(1999, 12, 31, 23, 59, 58), flags=0xABCD000F,
    rendering_intent=3, illuminant=(0.95, 1, 1.09), attributes=0x1234567800000FF5, cmm="abc ",
    platform="APPL", manufacturer="a<b&", model="\x00\x01\xff:", creator="ICC ", device_subclass="sub ",
    spectral_pcs="rs001f", spectral_range=(380, 780.5), spectral_steps=31,
    bispectral_range=(300, 400), bispectral_steps=3, reserved=b"\1\2\3\4",
)  # fmt: skip


@pytest.mark.parametrize("header", [HEADER_OF_EVERYTHING, Header(device_class="mntr", rendering_intent=7)])
def test_header(header):
    profile = Profile(header, {})
    assert there_and_back(profile).to_bytes() == profile.to_bytes()


def test_shared_tags_stay_shared():
    text, matrix = Mluc.of("a"), MultiProcess.of(Matrix.of(np.eye(3)))
    profile = a_profile(desc=text, cprt=text, priv=matrix, A2B0=matrix, oth_=matrix)
    data = profile_to_xml(profile)
    assert data.count(b"MatrixElement ") == 1
    assert b'SameAs="profileDescriptionTag"' in data
    assert b'SameAs="PrivateTag" SameAsSignature="priv"' in data
    assert profile_from_xml(data).to_bytes() == profile.to_bytes()


def test_curves_that_are_one_are_written_once():
    curve = xml_examples.SAMPLED
    data = profile_to_xml(a_profile(A2B0=MultiProcess.of(CurveSet((curve, curve, curve)))))
    assert data.count(b"<SingleSampledCurve ") == 1
    assert data.count(b'<DuplicateCurve Index="0"/>') == 2


# What is written is what the ICC's tools read --------------------------------------------------------


def test_floats_stand_in_data_and_fixed_points_in_array():
    for signature, name in [("fl16", "Data"), ("fl32", "Data"), ("fl64", "Data"), ("sf32", "Array")]:
        tag = NumberArray(signature, [1, 2])
        (holder,) = find(a_profile(mdv_=tag), "Tags/materialDefaultValuesTag")
        assert [child.tag for child in holder] == [name]


def test_numbers_are_words_that_the_reference_reads():
    """Its reader takes digits, signs, points, e, n and a, and reads `inf` as 0."""
    tag = NumberArray("fl32", [0.1, -0.0, 1e-20, np.inf, -np.inf, np.nan])
    text = find(a_profile(mdv_=tag), ".//Data").text
    assert text.split() == ["0.1", "-0", "1e-20", "1e999", "-1e999", "nan"]
    assert set("".join(text.split())) <= set("0123456789.+-ena")


def test_constants_of_programs_that_no_decimal_tells():
    text = find(a_profile(A2B0=xml_examples.TAGS["element calc everything"]), ".//MainFunction").text
    for word in ("1e999", "-1e999", "-nan", "data(7fc00001)", "-0", "0.30000004", "+INF", "env(00ff0001)"):
        assert word in text.split()


def test_unknown_tags_have_their_reserved_bytes_in_the_data():
    private = find(a_profile(abcd=Unknown("what", b"\0\0\0\7", b"\1\2")), "Tags/PrivateTag")
    assert private.get("TagSignature") == "abcd"
    assert private[0].tag == "PrivateType"
    assert private[0].get("type") == "what"
    assert private[0][0].text.split() == ["000000070102"]


def test_unknown_elements_have_their_type_under_both_names():
    tag = MultiProcess.of(xml_examples.ELEMENTS["unknown"])
    element = find(a_profile(A2B0=tag), ".//UnknownElement")
    assert element.get("type") == element.get("Type") == "what"
    assert element.get("Reserved") == "258"


def test_names_that_the_reference_knows():
    profile = a_profile(H2S2=XYZ.of(1, 1, 1), mcta=xml_examples.TAGS["tary"])
    assert [tag.tag for tag in find(profile, "Tags")] == ["HTSB2Tag", "materialTypeArrayTag"]


def test_what_xml_cannot_hold_is_refused():
    with pytest.raises(UnsupportedError, match=r"<copyrightTag> .* <LocalizedText>: found 'a\\x01'"):
        profile_to_xml(a_profile(cprt=Mluc.of("a\x01")))


# What the ICC's tools write, and people -----------------------------------------------------------------


def test_what_icc_to_xml_writes():
    """In the words of the ICC's writer: 12 decimals, blanks, CDATA, elements round arrays and structures."""
    data = document(
        """
    <profileDescriptionTag> <multiLocalizedUnicodeType>
      <LocalizedText LanguageCountry="enUS"><![CDATA[A <text>]]></LocalizedText>
    </multiLocalizedUnicodeType> </profileDescriptionTag>

    <materialTypeArrayTag> <tagArrayType>
      <UTF8TextArray> <ArrayTags>
         <utf8Type>
         <TextData><![CDATA[kd.X]]></TextData>
         </utf8Type>

      </ArrayTags> </UTF8TextArray>
    </tagArrayType> </materialTypeArrayTag>

    <brdfMToB0Tag> <tagStructType>
        <brdfTransformStructure> <MemberTags>
          <brdfTypeMbr> <signatureType>
            <Signature>CT10</Signature>
          </signatureType> </brdfTypeMbr>
        </MemberTags> </brdfTransformStructure>
    </tagStructType> </brdfMToB0Tag>

    <PrivateTag TagSignature="abcd"> <PrivateType type="what">
      <UnknownData>
       0000
       0000 0102
      </UnknownData>
    </PrivateType> </PrivateTag>

    <PrivateTag TagSignature="00017F41h" SameAs="PrivateTag"
     SameAsSignature="abcd"/>

    <MToB0Tag> <multiProcessElementType>
      <MultiProcessElements InputChannels="3" OutputChannels="3">
        <MatrixElement InputChannels="3" OutputChannels="3">
          <MatrixData>
            0.100000001490 0.000000000000 0.000000000000
            0.000000000000 1.000000000000 0.000000000000
            0.000000000000 0.000000000000 1.000000000000
          </MatrixData>
        </MatrixElement>
        <ReflectanceCLutElem InputChannels="3" OutputChannels="3" Flags="0">
          <Wavelengths start="400.00000000" end="700.00000000" steps="2"/>
          <WhiteData>
             1.000000000000 1.000000000000
          </WhiteData>
          <GridPoints>2 2 2</GridPoints>
          <TableData>
             0 0 0 0 0 0 0 0
             1 1 1 1 1 1 1 1
          </TableData>
        </ReflectanceCLutElem>
      </MultiProcessElements>
    </multiProcessElementType> </MToB0Tag>
    """,
        header="""<Header>
    <PreferredCMMType></PreferredCMMType>
    <ProfileVersion>5.10</ProfileVersion>
    <ProfileDeviceClass>mvis</ProfileDeviceClass>
    <DataColourSpace></DataColourSpace>
    <PCS>XYZ </PCS>
    <CreationDateTime>2020-2-03T04:05:06</CreationDateTime>
    <ProfileFlags EmbeddedInFile="true" UseWithEmbeddedDataOnly="false" MCSNeedsSubset="true"/>
    <DeviceAttributes ReflectiveOrTransparency="reflective" GlossyOrMatte="matte" MediaPolarity="positive"
     MediaColour="blackAndwhite" VendorSpecific="8000000000000000"/>
    <RenderingIntent>Absolute</RenderingIntent>
    <PCSIlluminant>
      <XYZNumber X="0.964202880859" Y="1.000000000000" Z="0.824905395508"/>
    </PCSIlluminant>
    <ProfileCreator></ProfileCreator>
    <MCS>6D630003h</MCS>
  </Header>""",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        profile = profile_from_xml(data)
    header = profile.header
    assert (header.version, header.mcs, header.flags) == ((5, 1, 0), "mc0003", 0b101)
    assert header.attributes == 1 << 63 | 0b1010
    assert header.created == (2020, 2, 3, 4, 5, 6)
    assert header.illuminant == (0xF6D6 / 65536, 1, 0xD32D / 65536)
    assert profile["desc"].text == "A <text>"
    assert profile["mcta"].texts() == ("kd.X",)
    assert profile["bMB0"].get("type").value == "CT10"
    assert profile["abcd"].data == b"\1\2"
    assert profile["\x00\x01\x7fA"] is profile["abcd"]
    assert profile["M2B0"].elements[0].matrix[0, 0] == np.float32(0.1)
    assert profile["M2B0"].elements[1].signature == "rclt"


def test_older_form_with_signatures_inside():
    profile = profile_from_xml(
        document(
            "<XYZType><TagSignature>wtpt</TagSignature><TagSignature>bkpt</TagSignature>"
            '<XYZNumber X="1" Y="2" Z="3"/></XYZType>'
        )
    )
    assert profile["wtpt"] is profile["bkpt"]
    assert profile["wtpt"].values == ((1, 2, 3),)


def test_sampled_segment_begins_with_a_number_that_is_not_stored():
    profile = profile_from_xml(
        transform(
            """<CurveSetElement InputChannels="1" OutputChannels="1"><SegmentedCurve>
            <FormulaSegment Start="-infinity" End="0" FunctionType="0">1 0 0 3</FormulaSegment>
            <SampledSegment Start="0" End="1">99 5 7</SampledSegment>
            <FormulaSegment Start="1" End="+infinity" FunctionType="0">1 0 0 7</FormulaSegment>
            </SegmentedCurve></CurveSetElement>""",
            1,
            1,
        )
    )
    curve = profile["A2B0"].elements[0].curves[0]
    assert curve.breakpoints == (0, 1)
    np.testing.assert_array_equal(curve.segments[1].values, [5, 7])


def test_matrix_may_be_the_inverse_of_what_is_written():
    profile = profile_from_xml(
        transform(
            '<MatrixElement InputChannels="2" OutputChannels="2"><MatrixData InvertMatrix="true">2 1 0 4'
            "</MatrixData><ConstantData>1 0</ConstantData></MatrixElement>",
            2,
            2,
        )
    )
    np.testing.assert_array_equal(profile["A2B0"].elements[0].matrix, [[0.5, -0.125], [0, 0.25]])


def test_matrix_without_numbers_gives_constants():
    for inputs in (1, 2):
        data = transform(
            f'<MatrixElement InputChannels="{inputs}" OutputChannels="1"><ConstantData>3</ConstantData>'
            "</MatrixElement>",
            inputs,
            1,
        )
        element = profile_from_xml(data)["A2B0"].elements[0]
        assert (element.inputs, element.offset.tolist()) == (inputs, [3])
        assert element.matrix is None or not element.matrix.any()


def test_tables_of_one_number_for_all_inputs_and_identity_curves():
    profile = profile_from_xml(
        document(
            """<AToB0Tag><lut16Type><Channels InputChannels="2" OutputChannels="1"/>
            <BCurves><Curve IdentitySize="3"/><Curve>0 65535 0</Curve></BCurves>
            <CLUT GridGranularity="2"><TableData>0 1 2 65535</TableData></CLUT>
            <ACurves><Curve>0 65535</Curve></ACurves></lut16Type></AToB0Tag>"""
        )
    )
    tag = profile["A2B0"]
    np.testing.assert_allclose(tag.input_tables[0], [0, 32768 / 65535, 1], rtol=1e-7)
    assert tag.table.shape == (2, 2, 1)


def test_numbers_in_files(tmp_path):
    (tmp_path / "text.txt").write_text("0 65535\n0 65535\n")
    np.array([0, 0.5, 1, 1], "<f4").tofile(tmp_path / "numbers.bin")
    (tmp_path / "text of a tag.txt").write_text("ä")
    data = transform(
        """<ExtCLutElement InputChannels="1" OutputChannels="2" StorageType="2"><GridPoints>2</GridPoints>
        <TableData Filename="text.txt" Format="text" FileEncoding="int16"/></ExtCLutElement>
        <CLutElement InputChannels="2" OutputChannels="1"><GridPoints>2 2</GridPoints>
        <TableData File="numbers.bin" Format="binary" Endian="little"/></CLutElement>""",
        1,
        1,
    ).replace(
        b"<Tags>",
        b'<Tags><copyrightTag><utf8Type><TextData File="text of a tag.txt"/></utf8Type></copyrightTag>',
    )
    path = tmp_path / "a.xml"
    path.write_bytes(data)
    profile = read_xml(path)
    first, second = profile["A2B0"].elements
    np.testing.assert_array_equal(first.table, [[0, 1], [0, 1]])
    np.testing.assert_array_equal(second.table[..., 0], [[0, 0.5], [1, 1]])
    assert profile["cprt"].text == "ä"


def test_now_is_no_clock():
    header = HEADER.replace("</Header>", "<CreationDateTime>now</CreationDateTime></Header>")
    assert profile_from_xml(document("", header)).header.created == Header.created


# What the ICC's tools pass over ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("elements", "message"),
    [
        ('<MatrixElement InputChannels="1" OutputChannels="1"><MatrixData>1</MatrixData>\n'
         "<OffsetData>1</OffsetData></MatrixElement>",
         r":2: <OffsetData>: ignored in <MatrixElement>: did you mean 'ConstantData'\?"),
        ('<MatrixElement InputChannels="1" OutputChannels="1"><MatrixData Invert="true">1</MatrixData>'
         "</MatrixElement>", "attribute 'Invert' is ignored: did you mean 'InvertMatrix'"),
        ('<MatrixElement InputChannels="1" OutputChannels="1"><MatrixData>1.5.</MatrixData></MatrixElement>',
         r"<MatrixData>: found '1.5.', read as far as it is a number"),
        ('<CurveSetElement InputChannels="1" OutputChannels="1"><SegmentedCurve>'
         '<FormulaSegment Start="-infinity" End="0" FunctionType="0">1 0 0 3</FormulaSegment>'
         '<FormulaSegment Start="0.5" End="+infinity" FunctionType="0">1 0 0 3</FormulaSegment>'
         "</SegmentedCurve></CurveSetElement>", "Start: found 0.5, expected 0.0, where the one before ends"),
        ('<CalculatorElement InputChannels="1" OutputChannels="1"><MainFunction>{ 1 2 rotl out(0) }'
         "</MainFunction></CalculatorElement>", "rotl has no arguments: the ICC's iccToXml leaves them out"),
    ],
)  # fmt: skip
def test_what_is_ignored_is_warned_about_or_refused(elements, message):
    data = transform(elements, 1, 1)
    with pytest.warns(ProfileWarning, match=message):
        profile_from_xml(data)
    with pytest.raises(Exception, match=message):
        profile_from_xml(data, strict=True)


def test_warnings_come_to_an_end():
    element = (
        '<MatrixElement InputChannels="1" OutputChannels="1" Odd="1">'
        "<MatrixData>1</MatrixData></MatrixElement>"
    )
    with pytest.warns(ProfileWarning) as caught:
        profile_from_xml(transform(element * 50, 1, 1))
    assert len(caught) == 20
    assert "further warnings are not shown" in str(caught[-1].message)
