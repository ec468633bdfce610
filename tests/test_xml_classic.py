"""The tag types of versions 2 and 4 in XML, in the words of the ICC's writer where these are not ours."""

import warnings

import numpy as np
import pytest
import xml_examples
from xml_examples import a_profile, document

from iccbrdf.errors import ProfileError, ProfileWarning
from iccbrdf.icc import NamedColour, NamedColours, SparseMatrix, SparseMatrixArray, TextDescription, Utf8
from iccbrdf.icc.xml import profile_from_xml, profile_to_xml

TAGS = xml_examples.TAGS

WRITTEN_BY_THE_ICC = {
    "meas numbers": """<measurementType>
      <StandardObserver>3</StandardObserver>
      <MeasurementBacking X="0.000000000000" Y="0.000000000000" Z="0.000000000000"/>
      <Geometry>Unknown Geometry '9'</Geometry>
      <Flare>Unknown Flare '16384'</Flare>
      <StandardIlluminant>Unknown Illuminant '99</StandardIlluminant>
    </measurementType>""",
    "chrm": """<chromaticityType>
      <Colorant>ITU-R BT.709</Colorant>
        <Channel x="0.639999389648f" y="0.330001831055"/>
        <Channel x="0.300003051758f" y="0.600006103516"/>
        <Channel x="0.149993896484f" y="65535.500000000000"/>
    </chromaticityType>""",
    "rcs2 short": """<responseCurveSet16Type>
      <CountOfChannels>1</CountOfChannels>
      <ResponseCurve MeasUnitSignature="DIN with polarizing filter">
          <ChannelResponses X="1.000000000000" Y="1.000000000000" Z="1.000000000000" >
            <Measurement DeviceCode="0" MeasValue="0.000000000000"/>
            <Measurement DeviceCode="9" MeasValue="2.500000000000"/>
          </ChannelResponses>
        </ResponseCurve>
    </responseCurveSet16Type>""",
    "crdi": """<crdInfoType>
      <UnknownData>
       000000000000000a5072696e7465722031000000000261000000000262000000
       000100000000026400
      </UnknownData>
    </crdInfoType>""",
    "psid": """<profileSequenceIdentifierType>
      <ProfileSequenceId>
       <ProfileIdDesc id="000102030405060708090A0B0C0D0E0F">
      <LocalizedText LanguangeCountry="enUS">a &amp; b</LocalizedText>
       </ProfileIdDesc>
       <ProfileIdDesc id="00000000000000000000000000000000">
       </ProfileIdDesc>
      </ProfileSequenceId>
    </profileSequenceIdentifierType>""",
    "smat": """<sparseMatrixArrayType>
      <SparseMatrixArray outputChannels="36" matrixType="4">
       <SparseMatrix rows="3" cols="3">
        <SparseRow> <ColIndices> 1 </ColIndices> <ColData> 0.333333343267 </ColData> </SparseRow>
        <SparseRow> <ColIndices> </ColIndices> <ColData> </ColData> </SparseRow>
        <SparseRow>
         <ColIndices> 0 2 </ColIndices>
         <ColData> 2.000000000000 -1.000000000000 </ColData>
        </SparseRow>
       </SparseMatrix>
       <SparseMatrix rows="2" cols="1">
        <SparseRow> <ColIndices> </ColIndices> <ColData> </ColData> </SparseRow>
        <SparseRow> <ColIndices> </ColIndices> <ColData> </ColData> </SparseRow>
       </SparseMatrix>
      </SparseMatrixArray>
    </sparseMatrixArrayType>""",
    "ZXML": f"""<ZIPXmlType>
      <UnknownData>
       {TAGS["ZXML"].to_bytes()[4:].hex()}
      </UnknownData>
    </ZIPXmlType>""",
}


def tag_of(text):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return profile_from_xml(document(f'<PrivateTag TagSignature="abcd">{text}</PrivateTag>'))["abcd"]


@pytest.mark.parametrize("name", WRITTEN_BY_THE_ICC)
def test_what_icc_to_xml_writes(name):
    assert tag_of(WRITTEN_BY_THE_ICC[name]) == TAGS[name]


def test_named_colours_in_each_encoding():
    def read(encoding, colour):
        return tag_of(
            '<namedColor2Type><NamedColors VendorFlag="3" CountOfDeviceCoords="2" Prefix="p" Suffix="s" '
            f'DeviceEncoding="{encoding}">{colour}</NamedColors></namedColor2Type>'
        )

    expected = NamedColours((NamedColour("a", (32768, 16384, 1), (0, 51 * 257)),), 2, "p", "s", 3)
    xyz = '<XYZNamedColor Name="a" X="1" Y="0.5" Z="0.000030517578">0 13107</XYZNamedColor>'
    assert read("int16", xyz) == expected
    lab = '<LabNamedColor Name="a" L="50.196078" a="-64" b="-127.99609375">'
    assert read("int8", lab + "0 51</LabNamedColor>") == expected
    assert read("float", lab.replace("Lab", "") + "0 0.2</NamedColor>") == expected
    with pytest.raises(ProfileError, match="pcs: found 65537, expected 0 to 65535"):
        read("int16", '<XYZNamedColor Name="a" X="2.00003" Y="0" Z="0">0 0</XYZNamedColor>')
    with pytest.raises(ProfileError, match=r"device: found .*, expected 0 to 65535"):
        read("float", xyz.replace("0 13107", "nan 1e999"))
    with pytest.raises(ProfileError, match="DeviceEncoding: found 'int4'"):
        read("int4", "")


def test_matrices_in_full():
    full = '<FullMatrix rows="2" cols="2">{}</FullMatrix>'
    array = f'<SparseMatrixArray outputChannels="9" matrixType="2">{full}</SparseMatrixArray>'
    text = f"<sparseMatrixArrayType>{array}</sparseMatrixArrayType>"
    assert tag_of(text.format("0 1 0.5 0")) == SparseMatrixArray(9, 2, (SparseMatrix.of([[0, 1], [0.5, 0]]),))
    with pytest.raises(ProfileError, match="found 3 numbers, expected 2 x 2"):
        tag_of(text.format("0 1 2"))
    beyond = f'<PrivateTag TagSignature="abcd">{text.format("0 1.25 0.5 -0.125")}</PrivateTag>'
    with pytest.warns(ProfileWarning, match=r"found 1\.25, but integers stand for 0\.\.1"):
        cut = profile_from_xml(document(beyond))["abcd"]
    assert cut == SparseMatrixArray(9, 2, (SparseMatrix(2, 2, [0, 1, 3], [1, 0, 1], [1, 0.5, 0]),))
    assert tag_of(text.replace('"2">', '"4">', 1).format("2 0 0 0")).matrices[0].values == 2


def test_rows_without_entries_are_written_in_full_which_the_icc_reads():
    written = profile_to_xml(a_profile(abcd=TAGS["smat"]))
    assert written.count(b"<FullMatrix ") == 2
    assert b"<SparseRow>" not in written
    written = profile_to_xml(a_profile(abcd=SparseMatrixArray(9, 4, (SparseMatrix.of(np.eye(3)),))))
    assert written.count(b"<SparseRow>") == 3


def test_characters_that_xml_cannot_hold_are_hexadecimal():
    for text in (Utf8("a\x01θ"), TextDescription("a\0b")):
        written = profile_to_xml(a_profile(cprt=text))
        assert b"<HexTextData>" in written
        assert profile_from_xml(written, strict=True)["cprt"] == text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<measurementType/>", "no <StandardObserver> found in it"),
        (
            "<crdInfoType><UnknownData>00000000</UnknownData></crdInfoType>",
            "length of product: found 0 bytes",
        ),
        (WRITTEN_BY_THE_ICC["rcs2 short"].replace(">1<", ">2<"), "found 1 channels, expected 2"),
        (WRITTEN_BY_THE_ICC["psid"].replace("0001", "01"), "id: found 15 bytes, expected 16"),
        (WRITTEN_BY_THE_ICC["smat"].replace(" 0 2 ", " 0 "), "<SparseRow>: found 1 columns and 2 numbers"),
        (WRITTEN_BY_THE_ICC["smat"].replace(" 0 2 ", " 2 0 "), "two of a row that do not increase"),
        ("<embeddedProfileType/>", "no <IccProfile> found in it"),
        (
            "<embeddedProfileType><IccProfile><Header/><Tags/></IccProfile></embeddedProfileType>",
            "no <ProfileDeviceClass> found in it",
        ),
        (
            "<textDescriptionType><TextData>a</TextData><MacScript ScriptCode='0'>"
            + "00" * 68
            + "</MacScript></textDescriptionType>",
            "expected up to 67",
        ),
        (
            "<profileSequenceDescType><ProfileSequence><ProfileDesc/></ProfileSequence></profileSequenceDescType>",
            "no <DeviceManufacturer> found in it",
        ),
    ],
)
def test_what_is_wrong(text, message):
    with pytest.raises(ProfileError, match=message):
        tag_of(text)
