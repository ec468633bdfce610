"""What fuzzing and looking for trouble have found, each as the smallest change to something sound."""

import io
import json
import os
import struct
from dataclasses import replace

import numpy as np
import pytest
import tifffile
from cmm_examples import device_profile
from fuzz import seeds
from fuzz.watch import time_limit

import iccbrdf
from iccbrdf.brdf import records
from iccbrdf.brdf.primaries import read_primaries
from iccbrdf.calc import compile_template
from iccbrdf.calc.program import Op
from iccbrdf.cmm.environment import checked_environment
from iccbrdf.errors import (
    InputError,
    LimitError,
    ProfileError,
    UnsupportedError,
    VariableError,
    nearest,
)
from iccbrdf.icc import (
    TAGS,
    XYZ,
    Calculator,
    Clut,
    Curve,
    EmbeddedProfile,
    ExtendedClut,
    MultiProcess,
    NumberArray,
    Profile,
    TagArray,
    Utf8,
    describe,
    reader,
    text,
)
from iccbrdf.icc.compare import compare
from iccbrdf.icc.layout import Record
from iccbrdf.icc.xml import forms, language, node, profile_from_xml, profile_to_xml
from iccbrdf.images import height_to_normals, normals, open_tiff, read_height_map, read_normal_map
from iccbrdf.images.exr import open_exr
from iccbrdf.images.exr_header import check_header
from iccbrdf.measure import declarations, parse_declarations, read_declarations, read_measurements, tables
from iccbrdf.proof import job
from iccbrdf.proof.colour_in import ColourIn
from iccbrdf.proof.log import earlier
from iccbrdf.resources import folder
from iccbrdf.validate import validate
from iccbrdf.viewer import read_folder

PRIMARIES = folder("profiles") / "fogra39_gloss" / "primaries.json"
DEEP = "[" * 5000


def test_numbers_of_16_bits_are_described_without_a_warning():
    profile = device_profile("scnr", meta=NumberArray("fl16", [0.1, 65504.0, -2.0]))
    for options in ({}, {"legacy": "1.13"}):
        with np.printoptions(**options):
            assert "[0.099975586, 65504.0, -2.0]" in describe(profile)


def a_tiff_that_goes_round():
    """The directory that follows the first is the first."""
    file = io.BytesIO()
    tifffile.imwrite(file, np.zeros((4, 5), np.uint8), photometric="minisblack")
    data = bytearray(file.getvalue())
    (first,) = struct.unpack_from("<I", data, 4)
    (entries,) = struct.unpack_from("<H", data, first)
    struct.pack_into("<I", data, first + 2 + 12 * entries, first)
    return data


def test_directories_of_a_tiff_that_go_round(tmp_path):
    """The reading of them never ended."""
    (tmp_path / "a.tif").write_bytes(a_tiff_that_goes_round())
    with pytest.raises(LimitError, match=r"a\.tif: more than 64 images in one file"):
        open_tiff(tmp_path / "a.tif")


@pytest.mark.parametrize("tag", [256, 257, 278])
def test_a_tiff_whose_size_is_a_fraction(tmp_path, tag):
    """Width, height or rows of a strip as a double."""
    data = a_tiff_that_goes_round()
    (first,) = struct.unpack_from("<I", data, 4)
    (entries,) = struct.unpack_from("<H", data, first)
    struct.pack_into("<I", data, first + 2 + 12 * entries, 0)
    places = range(first + 2, first + 2 + 12 * entries, 12)
    (place,) = (at for at in places if struct.unpack_from("<H", data, at) == (tag,))
    struct.pack_into("<HHII", data, place, tag, 12, 1, len(data))
    (tmp_path / "a.tif").write_bytes(data + struct.pack("<d", 2.5))
    with pytest.raises(InputError, match=r"a\.tif: (damaged|not a readable) TIFF"):
        open_tiff(tmp_path / "a.tif")


def test_a_count_of_thousands_of_digits(tmp_path):
    path = tmp_path / "a.brdf"
    path.write_text("9" * 5000 + "\n400 500\n")
    with pytest.raises(InputError, match="expected the number of wavelengths"):
        read_measurements(path)


def test_patch_names_with_blanks_that_nobody_sees(tmp_path):
    """Such a name was refused as if the call were wrong, not the file."""
    kind, _, text = seeds.tables()[0].partition(b"\n")
    path = tmp_path / f"a.{kind.decode()}"
    path.write_bytes(text.replace(b"paper,", "paper\u00a0 \x1c,".encode()))
    assert read_measurements(path).patches == ("paper", "cyan")
    path.write_bytes(text.replace(b"paper,", "\u00a0,".encode()))
    with pytest.raises(InputError, match="the name of the patch is empty"):
        read_measurements(path)


def test_toml_nested_deeply(tmp_path):
    """The reader of TOML calls itself for each bracket."""
    path = tmp_path / "a.toml"
    path.write_text(f"image = {DEEP}")
    with pytest.raises(InputError, match="is not TOML"):
        job.read_job(path)
    with pytest.raises(InputError, match="is not TOML"):
        read_declarations(path)
    assert parse_declarations([f"source={DEEP}"]) == {"source": DEEP}
    table = tmp_path / "a.csv"
    table.write_text(f'# schema = "iccbrdf-measurements"\n# version = {DEEP}\npatch,X,Y,Z\np,1,1,1\n')
    with pytest.raises(InputError, match="is not TOML"):
        read_measurements(table)


def test_ends_of_xml_segments_beyond_float32():
    (data,) = (xml for xml in seeds.xml() if xml.count(b'Start="0.25"') == 1)
    with pytest.raises(ProfileError, match="Start: found '1e39', expected a number that float32 holds"):
        profile_from_xml(data.replace(b'Start="0.25"', b'Start="1e39"'))


def test_elements_and_attributes_of_xml_have_a_limit(monkeypatch):
    (data, *_) = seeds.xml()
    monkeypatch.setattr(node, "MAX_MARKS", data.count(b"<") + data.count(b"="))
    profile_from_xml(data)
    for more in (b"<a/>", b"<!-- = -->"):
        with pytest.raises(LimitError, match="more elements and attributes than the limit"):
            profile_from_xml(data.replace(b"<Header>", b"<Header>" + more))


@pytest.mark.parametrize("encoding", ["UTF-7", "utf-7-imap", "JAVA", "C99", ""])
def test_xml_in_encodings_that_hide_its_signs(encoding):
    """Of "+ADw-a/+AD4-" nobody counted the sign that begins an element."""
    head = b'<?xml version="1.0"  encoding = "%s"?>' % encoding.encode()
    with pytest.raises(InputError, match=f"found the encoding '{encoding}'; expected an XML file in UTF-8"):
        profile_from_xml(head + b"<IccProfile>+ADw-a/+AD4-</IccProfile>")


@pytest.mark.parametrize("encoding", ["utf-8", "UTF-16", "ISO-8859-1", "windows-1252"])
def test_xml_in_other_encodings(encoding):
    text = seeds.xml()[0].decode()
    declared = text.replace(text[: text.index("?>")], f'<?xml version="1.0" encoding="{encoding}"', 1)
    assert profile_from_xml(declared.encode(encoding)) == profile_from_xml(text.encode())


def test_files_have_a_size_at_most(tmp_path, monkeypatch):
    text, toml = tmp_path / "a.csv", tmp_path / "a.toml"
    text.write_text("patch,X\n" + "p,1\n" * 100)
    toml.write_text('source = "x"\n')
    for module, read, path in (
        (records, read_primaries, PRIMARIES),
        (tables, read_measurements, text),
        (declarations, read_declarations, toml),
        (job, job.read_job, toml),
    ):
        monkeypatch.setattr(module, "MAX_BYTES", path.stat().st_size - 1)
        with pytest.raises(LimitError, match=f"{path.name}: larger than the limit of "):
            read(path)


def test_a_part_in_many_places_counts_each_time(monkeypatch):
    """To describe it, and to encode its text, took what no memory holds."""
    array = TagArray("utf8", (Utf8("x" * 4000),) * 1000)
    record = b"enUS" + struct.pack(">II", 4000, 16 + 12 * 1000)
    texts = b"mluc\0\0\0\0" + struct.pack(">II", 1000, 12) + record * 1000 + b"\0x" * 2000
    monkeypatch.setattr(reader, "MAX_NUMBERS", 1_000_999)
    assert len(TAGS.read(reader.Reader(texts, "a.icc", "tag desc")).texts) == 1000
    monkeypatch.setattr(reader, "MAX_NUMBERS", 999_999)
    for data in (array.to_bytes(), texts):
        with pytest.raises(LimitError, match="more numbers in one tag than the limit of 999999"):
            TAGS.read(reader.Reader(data, "a.icc", "tag desc"))
    programs = MultiProcess.of(*(Calculator(1, 1, (Op("in", 0),) * 1000, ()),) * 263)
    with pytest.raises(LimitError, match="more operations in one tag than the limit of 262144"):
        TAGS.read(reader.Reader(programs.to_bytes(), "a.icc", "tag A2B0"))


def test_all_tags_together_have_a_limit(monkeypatch):
    """A thousand tags of as many parts as one may have took gigabytes."""
    tags = {f"t{i:03}": TagArray("utf8", tuple(Utf8(f"{i} {j}") for j in range(20))) for i in range(5)}
    data = device_profile("scnr", **tags).to_bytes()
    monkeypatch.setattr(reader, "MAX_PARTS", 40)
    profile = Profile.from_bytes(data)
    for signature in ("t000", "t001", "t002", "t003", "t003"):
        assert len(profile[signature].items) == 20
    for _ in range(2):
        with pytest.raises(LimitError, match=r"t004.*more parts in one profile than the limit of 80"):
            profile["t004"]
    assert {f.rule.id for f in validate(data).findings if "more parts" in f.message} == {"TAG-002"}


def test_numbers_that_are_read_one_by_one_count_more(monkeypatch):
    triples = device_profile("scnr", wtpt=XYZ(((1, 1, 1),) * 100), t000=Curve((7,) * 100)).to_bytes()
    monkeypatch.setattr(reader, "MAX_NUMBERS", 3199)
    for signature in ("wtpt", "t000"):
        with pytest.raises(LimitError, match="more numbers in one tag than the limit of 3199"):
            Profile.from_bytes(triples)[signature]


def test_tags_that_overlap_are_examined_once():
    """Each of a thousand tags might hold all of the file."""
    rows = range(1024)
    start = 132 + 12 * len(rows)
    table = b"".join(struct.pack(">4sII", b"t%03x" % i, start + 4 * i, 99_000 - 4 * i) for i in rows)
    body = (b"utf8" * 2).ljust(99_000, b"x")
    head = replace(device_profile("scnr").header, size=start + len(body)).to_bytes()
    data = head + struct.pack(">I", len(rows)) + table + body
    with time_limit(5):
        found = [f for f in validate(data).findings if f.rule.id == "TAG-002"]
    assert len(found) >= 50
    assert "overlap and hold more than the file" in found[0].message


def test_what_is_shown_of_a_profile_has_a_limit(monkeypatch):
    """Tags share their data, and each of them shows it."""
    shared = Utf8("x" * 3000)
    profile = device_profile("scnr", **{f"t{i:03}": shared for i in range(9)})
    monkeypatch.setattr(text, "MAX_CHARACTERS", 10_000)
    shown = describe(profile)
    assert shown.count("x" * 3000) == 3
    assert shown.count("not shown: with it there are more than 10000 characters") == 6


def test_a_comparison_has_a_limit(monkeypatch):
    """Tags that share their data are compared one by one."""
    profiles = []
    for character in "xy":
        shared = Utf8(character * 3000)
        profiles.append(device_profile("scnr", **{f"t{i:03}": shared for i in range(9)}))
    assert len(compare(*profiles, listing=str)) == 9
    monkeypatch.setattr("iccbrdf.icc.compare.MAX_WORK", 200_000)
    with pytest.raises(LimitError, match="tag t005, text: to compare it and what is before it takes more"):
        compare(*profiles, listing=str)


def test_numbers_of_a_tag_have_a_limit(monkeypatch):
    """A byte of a table takes four in memory."""
    elements = [ExtendedClut(np.zeros((5, 5, 5, 3), np.float32), 3) for _ in range(3)]
    data = device_profile("scnr", A2B0=MultiProcess.of(*elements)).to_bytes()
    monkeypatch.setattr(reader, "MAX_NUMBERS", 3 * 375)
    Profile.from_bytes(data)["A2B0"]
    monkeypatch.setattr(reader, "MAX_NUMBERS", 3 * 375 - 1)
    with pytest.raises(LimitError, match="more numbers in one tag than the limit of 1124"):
        Profile.from_bytes(data)["A2B0"]


@pytest.mark.parametrize("encoding", range(4))
def test_tables_are_stored_as_before_piece_by_piece(encoding, monkeypatch):
    from iccbrdf.icc import fields

    table = np.random.default_rng(encoding).random((6, 5, 4, 3)).astype(np.float32)
    whole = ExtendedClut(table, encoding)
    monkeypatch.setattr(fields, "_PIECE", 7)
    assert ExtendedClut(table, encoding).to_bytes() == whole.to_bytes()
    scale = (1, 1, 65535, 255)[encoding]
    if scale > 1:
        expected = np.rint(table.astype(np.float64) * scale) / scale
        np.testing.assert_allclose(whole.table, expected, rtol=1e-6)


def test_a_table_that_is_applied_many_times_is_looked_at_few(monkeypatch):
    """Each application compared its bytes with those of all others."""
    made = []
    to_bytes = Record.to_bytes
    monkeypatch.setattr(Record, "to_bytes", lambda self: made.append(self) or to_bytes(self))
    table = np.random.default_rng(0).random((3, 3, 3, 3)).astype(np.float32)
    operations = [Op("in", 2), *(Op("clut", (i % 2) << 16) for i in range(300)), Op("out", 2)]
    element = Calculator(3, 3, tuple(operations), (Clut(table), Clut(table.copy())))
    transform = iccbrdf.link([device_profile("scnr", A2B0=MultiProcess.of(element))], backend="numpy")
    for _ in range(3):
        transform([[0.5, 0.5, 0.5]])
    assert sum(isinstance(record, Clut) for record in made) <= 8


def test_names_in_messages_are_few_short_and_printable():
    """Millions of names were compared one by one, and shown as they were."""
    with time_limit(5):
        found = nearest("xyz", [f"n{i}" for i in range(300_000)])
    assert found.startswith("valid are n0, n1, ")
    assert found.endswith("n99, ...")
    assert nearest("x" * 10**6, ["a" * 10**6, "b\a"]) == "valid are 'b\\x07', ..."
    assert nearest("x", []) == "there are none"
    assert nearest("Cyna", ["Magenta", "Cyan"]) == "did you mean 'Cyan'?"


def test_elements_with_many_attributes():
    """To take them took the square of their number."""
    many = " ".join(f'a{i}="1"' for i in range(50_000))
    with time_limit(5), pytest.raises(LimitError, match="<Header>: more than 256 attributes"):
        profile_from_xml(seeds.xml()[0].replace(b"<Header>", f"<Header {many}>".encode()))


def test_a_pipe_that_a_file_names(tmp_path):
    """The reader waited for ever."""
    os.mkfifo(tmp_path / "a.imp")
    os.mkfifo(tmp_path / "proof.json")
    imports = b'<Imports><Import Filename="a.imp"/></Imports><MainFunction>'
    data = next(xml for xml in seeds.xml() if b"<MainFunction>" in xml and b"<Imports>" not in xml)
    with pytest.raises(InputError, match=r"a\.imp: is not a regular file"):
        profile_from_xml(data.replace(b"<MainFunction>", imports, 1), folder=tmp_path)
    with pytest.raises(InputError, match=r"proof\.json: is not a regular file"):
        read_folder(tmp_path)


def test_main_functions_have_a_limit(monkeypatch):
    """Millions of operations were made, of which a tag may have some hundred thousand."""
    monkeypatch.setattr(language, "MAX_MAIN_WORDS", 20)
    data = next(xml for xml in seeds.xml() if b"<MainFunction>" in xml)
    with pytest.raises(LimitError, match="main functions have more than 20 words"):
        profile_from_xml(data.replace(b"<MainFunction>", b"<MainFunction>" + b" 1 pop" * 11, 1))


def test_profiles_inside_profiles_have_a_limit_in_xml(monkeypatch):
    """Each of many small ones takes as long as a document."""
    inner = device_profile("scnr")
    profile = device_profile("scnr", **{f"t{i:03}": EmbeddedProfile.of(inner) for i in range(3)})
    data = profile_to_xml(profile)
    monkeypatch.setattr("iccbrdf.icc.xml.whole.MAX_PROFILES", 2)
    with pytest.raises(LimitError, match="more than 2 profiles inside profiles"):
        profile_from_xml(data)
    with pytest.raises(LimitError, match="more than 2 profiles inside profiles"):
        profile_to_xml(profile)


def test_numbers_that_xml_does_not_hold_are_not_made_text(monkeypatch):
    """It took a gigabyte to say that they are too many."""
    monkeypatch.setattr(forms, "decimals", None)
    profile = device_profile("scnr", t000=NumberArray("fl32", np.zeros(5_000_001)))
    with pytest.raises(LimitError, match="10000001 characters, but XML readers take 10000000"):
        profile_to_xml(profile)


def test_a_map_of_another_size_is_not_unpacked(tmp_path):
    """A small file that holds 2^28 pixels was unpacked for an image of a few."""
    path = tmp_path / "a.png"
    head = struct.pack(">IIBBBBB", 16384, 16384, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + struct.pack(">I4s", 13, b"IHDR") + head)
    for read in (read_height_map, read_normal_map):
        with pytest.raises(
            InputError, match="the relief has 16384 x 16384 pixels, expected the image's 8 x 4"
        ):
            read(path, size=(4, 8))


def test_normals_are_made_band_by_band(monkeypatch):
    """What came in between took twice the memory of the normals."""
    heights = np.random.default_rng(0).random((23, 7), np.float32)
    whole = height_to_normals(heights, 0.5)
    for pixels in (1, 7, 8, 30, 150):
        monkeypatch.setattr(normals, "_BAND_PIXELS", pixels)
        np.testing.assert_array_equal(height_to_normals(heights, 0.5), whole)


def test_a_predictor_of_floats_on_integers(tmp_path):
    """It was undone as if it were one, to other numbers than the file's."""
    tifffile.imwrite(
        tmp_path / "a.tif", np.zeros((4, 5, 3), np.uint16), compression="deflate", predictor=True
    )
    data = bytearray((tmp_path / "a.tif").read_bytes())
    at = data.index(struct.pack("<HHI", 317, 3, 1)) + 8
    data[at] = 3
    (tmp_path / "a.tif").write_bytes(data)
    with pytest.raises(InputError, match=r"a\.tif: damaged TIFF: predictor 3, of floats, on integers"):
        open_tiff(tmp_path / "a.tif")


def test_lines_of_a_table_have_a_limit(tmp_path):
    """A line of commas alone took ten times its bytes."""
    (tmp_path / "a.csv").write_text("," * tables.MAX_COLUMNS)
    with pytest.raises(LimitError, match="a line has more columns than the limit of 65536"):
        read_measurements(tmp_path / "a.csv")


def test_what_took_the_square_of_its_size(tmp_path):
    """Tables of ten thousands of columns, and keys of ten thousands of parts."""
    names = ",".join(f"c{i}" for i in range(20_000))
    wide, keys, header = tmp_path / "wide.csv", tmp_path / "keys.toml", tmp_path / "header.csv"
    wide.write_text(names + "\n" + ",".join(["1"] * 20_000))
    keys.write_text("a." * 40_000 + "b = 1")
    header.write_text('# schema = "iccbrdf-measurements"\n# ' + "a." * 40_000 + "b = 1\npatch,X\np,1\n")
    with time_limit(5), pytest.raises(InputError):
        read_measurements(wide)
    for read, path in ((job.read_job, keys), (read_declarations, keys), (read_measurements, header)):
        with pytest.raises(LimitError, match="larger than the limit of 65536"):
            read(path)
    keys.write_text("a." * 30_000 + "b = 1")
    with pytest.raises(InputError, match="a key of 100 parts"):
        job.read_job(keys)
    wide.write_text(f"a,{names},a,c7\n" + ",".join(["1"] * 20_003))
    with pytest.raises(InputError, match="the column 'a' stands twice"):
        read_measurements(wide)


def test_numbers_of_toml_that_are_too_long_to_be_shown(tmp_path):
    """A hexadecimal number may have any number of digits, a decimal one of Python 4,300."""
    path, table = tmp_path / "a.toml", tmp_path / "a.csv"
    number = "0x" + "f" * 6000
    path.write_text(f'image = "a"\nprimaries = "b"\nframes = {number}\nscale = {number}\n')
    table.write_text(f'# schema = "iccbrdf-measurements"\n# version = {number}\npatch,X,Y,Z\np,1,1,1\n')
    for read, file in ((job.read_job, path), (read_declarations, path), (read_measurements, table)):
        with pytest.raises(InputError, match="is not TOML: Exceeds the limit"):
            read(file)
    with pytest.raises(VariableError, match="litX': found inf"):
        checked_environment({"litX": 10**5000}, ["litX"])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"1.5", b"0", "exposure is 0.0, expected a number above 0"),
        (b"1.5", b"NaN", "found nan, expected a finite number"),
        (b"4.5", b"1e999", "found inf, expected a finite number"),
        (b"4.5", b"1" + b"0" * 400, "OverflowError"),
        (b"0.25", DEEP.encode(), "RecursionError"),
        (b'"scenes": [', b'"scenes": [[], ', "TypeError"),
    ],
)
def test_logs_of_proofs(tmp_path, old, new, message):
    data = seeds.logs()[0]
    assert old in data
    (tmp_path / "proof.json").write_bytes(data.replace(old, new))
    with pytest.raises(InputError, match=f"proof.json: is not the log of a proof: .*{message}"):
        read_folder(tmp_path)


@pytest.mark.parametrize("new", [b"NaN", b'"much"', b"2", b"null", DEEP.encode()])
def test_logs_that_do_not_say_that_a_job_is_done(tmp_path, new):
    (tmp_path / "flat.tif").touch()
    made = job.make_job({"image": "a.tif", "primaries": "p.json", "output": str(tmp_path)})
    data = seeds.logs()[0]
    for found, is_done in ((data, True), (data.replace(b"0.25", new), False)):
        (tmp_path / "proof.json").write_bytes(found)
        assert (earlier(made, "0") is not None) is is_done


def test_file_names_that_are_no_text(run, tmp_path):
    """Bytes in them that are no UTF-8, on the way into documents, which are."""
    name = os.fsdecode(b"caf\xe9")
    rows = seeds.fitted_tables()[0]
    (tmp_path / f"{name}.csv").write_bytes(rows)
    assert run("fit", tmp_path / f"{name}.csv", "-o", tmp_path / "p.json", "--starts", "1").code == 0
    assert "caf?.csv" in read_primaries(tmp_path / "p.json").source
    tifffile.imwrite(tmp_path / f"{name}.tif", np.zeros((2, 3, 10), np.uint8), planarconfig="contig")
    pair = (PRIMARIES.with_name(file) for file in ("mid.icc", "mvis.icc"))
    profiles = [word for path in pair for word in ("-p", path)]
    assert run("view", tmp_path / f"{name}.tif", *profiles, "-o", tmp_path / "a.html").code == 0
    assert "<title>caf?" in (tmp_path / "a.html").read_text(encoding="utf-8")


def test_text_of_json_that_no_file_can_hold(tmp_path):
    data = json.loads(PRIMARIES.read_text())
    data["source"] = "\ud800"
    (tmp_path / "p.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"source is '\\ud800', expected Unicode text"):
        read_primaries(tmp_path / "p.json")


def test_an_embedded_profile_that_is_stored_as_a_number(tmp_path):
    """It was taken for so many bytes, up to 4 GiB of them."""
    path = tmp_path / "a.tif"
    extra = [(34675, "I", 1, 2**32 - 1, True)]
    tifffile.imwrite(path, np.zeros((2, 3), np.uint8), photometric="minisblack", extratags=extra)
    with pytest.raises(InputError, match="the embedded profile is stored as numbers, expected bytes"):
        open_tiff(path)


def test_lab_beyond_float32(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.full((1, 1, 3), 3e38, np.float32), photometric="cielab", metadata=None)
    with ColourIn(path, None, read_primaries(PRIMARIES)) as image:
        (place,) = image.places()
        assert not np.isfinite(image.read(place).data).all()


def test_an_output_that_is_named_twice_at_a_time():
    template = seeds.templates()[-1].decode()
    with pytest.raises(InputError, match="channel 'X' is written by an output already"):
        compile_template(template.replace("output X Y Z", "output X X Z"), filename="a.calc")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"pixelAspectRatio", b"pixelAspectRat\xff\xff", "expected UTF-8"),  # it brought the process down
        (b"kd.X", b"kd.\xff", "expected UTF-8"),
        (b"box2i\0\x10", b"box2i\0\x14", "'dataWindow': found 20 bytes, expected what box2i"),  # so did it
        (b"comments\0string\0", b"comments\0strange\0", None),
        (b"v/1\x01\x02\0", b"v/1\x01\x02\x10", "several parts"),
        (b"chlist\0", b"chlist\0\xff\xff\xff", "cut off"),
        (b"chlist\0\x3c", b"chlist\0\x3b", "'channels': found 59 bytes, expected what chlist"),
        (b"v/1\x01", b"v/2\x01", "cannot be read as OpenEXR"),
    ],
)
def test_headers_of_openexr(tmp_path, old, new, message):
    pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    path, data = tmp_path / "a.exr", seeds.exrs()[0]
    assert old in data
    path.write_bytes(data.replace(old, new))
    if message is None:
        assert open_exr(path).names == ("kd.X", "m", "n.z")
        return
    with pytest.raises((InputError, UnsupportedError), match=message):
        open_exr(path)


def test_headers_of_openexr_have_a_size_at_most(tmp_path):
    path, data = tmp_path / "a.exr", seeds.exrs()[0]
    long = b"a\0string\0" + (2**20).to_bytes(4, "little") + b" " * 2**20
    path.write_bytes(data[:8] + long + data[8:])
    with pytest.raises(LimitError, match="the header is larger than the limit of 1048576 bytes"):
        check_header(path)
