"""Tables of measurements: formats, declarations, and the errors that name what is missing."""

from dataclasses import fields, replace
from pathlib import Path

import colour
import numpy as np
import pytest

from iccbrdf.brdf.colour_difference import XYZ_to_Lab
from iccbrdf.brdf.geometry import planar
from iccbrdf.errors import InputError, LimitError, UsageError
from iccbrdf.measure import (
    Measurements,
    parse_declarations,
    read_declarations,
    read_measurements,
    reader,
    report,
    report_text,
    under,
    write_measurements,
)
from iccbrdf.measure.colorimetry import Lab_to_XYZ, weights

D50_2 = {"illuminant": "D50", "observer": "CIE 1931 2 Degree Standard Observer"}
FACTORS = {"angles": "degree", "view_angles": "lamp", "quantity": "reflectance", "scale": 1, **D50_2}
GAIN = 1 / np.cos(np.radians(60))

TABLE = """patch,theta_i,theta_r,X,Y,Z
white,60,-60,2,2.5,1.5
white,60,0,0.8,0.85,0.7
black,60,0,0.02,0.021,0.018
"""

CGATS = b"""CTI3   # the kind of file\r
\r
ORIGINATOR "A # in quotes is no comment"\r
# KEYWORD "COMMENTED_OUT"\r
NUMBER_OF_FIELDS 8   # SAMPLE_ID and the rest\r
BEGIN_DATA_FORMAT\r
SAMPLE_ID CMYK_C CMYK_M CMYK_Y CMYK_K LAB_L LAB_A LAB_B\r
END_DATA_FORMAT\r
NUMBER_OF_SETS 2\r
BEGIN_DATA\r
"A 1" 0 0 0 0 95.00 0.00 -2.00\r
# between the rows\r
"A 2" 0 100 0 0 48.00 74.00 -3.00   # magenta\r
END_DATA\r
"""


def write(tmp_path: Path, text: str | bytes, name: str = "table.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def read(tmp_path: Path, text: str | bytes, name: str = "table.csv", **declarations) -> Measurements:
    return read_measurements(write(tmp_path, text, name), **declarations)


def assert_same(a: Measurements, b: Measurements) -> None:
    for field in fields(Measurements):
        if field.name != "notes":
            x, y = getattr(a, field.name), getattr(b, field.name)
            assert np.array_equal(x, y, equal_nan=True) if isinstance(x, np.ndarray) else x == y, field.name


# --- tables in long form


def test_rows_become_patches_and_geometries(tmp_path):
    found = read(tmp_path, TABLE, **FACTORS)
    assert found.patches == ("white", "black")
    assert (found.theta_i.tolist(), found.theta_r.tolist()) == ([60, 60], [-60, 0])
    assert found.XYZ[0].tolist() == [[2, 2.5, 1.5], [0.8, 0.85, 0.7]]
    assert np.isnan(found.XYZ[1, 0]).all()
    assert found.XYZ[1, 1].tolist() == [0.02, 0.021, 0.018]
    assert found.white == pytest.approx((0.9642, 1, 0.8251), abs=1e-4)
    assert (found.cmyk, found.slopes, found.spectra) == (None, None, None)


def test_frame_of_light_and_view(tmp_path):
    found = read(tmp_path, TABLE, **FACTORS)
    np.testing.assert_allclose(found.light, [planar(-60), planar(-60)], atol=1e-15)
    np.testing.assert_allclose(found.view, [planar(60), planar(0)], atol=1e-15)


def test_byte_order_mark_crlf_tabs_and_comments(tmp_path):
    text = "\ufeff# of Monday\r\n\r\n" + TABLE.replace(",", "\t").replace("\n", "\r\n")
    assert_same(
        read(tmp_path, text, "table.tsv", source="s", **FACTORS),
        read(tmp_path, TABLE, source="s", **FACTORS),
    )


@pytest.mark.parametrize(
    ("quantity", "scale", "factor"),
    [("brdf", None, np.pi), ("reflectance", 1, 1.0), ("reflectance", 100, 0.01), ("radiance", 1, GAIN)],
)
def test_quantities(tmp_path, quantity, scale, factor):
    declared = {**FACTORS, "quantity": quantity, "scale": scale}
    found = read(tmp_path, TABLE, **{key: value for key, value in declared.items() if value is not None})
    np.testing.assert_allclose(found.XYZ[0, 1], np.array([0.8, 0.85, 0.7]) * factor, rtol=1e-12)


def test_radians(tmp_path):
    text = "patch,theta_i,theta_r,X,Y,Z\nwhite,0.7853981633974483,-0.5235987755982988,1,1,1\n"
    found = read(tmp_path, text, **{**FACTORS, "angles": "radian"})
    assert found.theta_i == pytest.approx(45)
    assert found.theta_r == pytest.approx(-30)


def test_viewing_angles_positive_on_the_mirror_side(tmp_path):
    found = read(tmp_path, TABLE, **{**FACTORS, "view_angles": "mirror"})
    assert found.theta_r.tolist() == [60, 0]


def test_azimuths(tmp_path):
    rows = [(45, 90, 30, 270), (45, 0, 30, 360), (45, 0, 30, 170), (45, 0, 30, 90), (45, 0, 30, -100)]
    text = "patch,theta_i,phi_i,theta_r,phi,X,Y,Z\n" + "".join(
        f"p,{','.join(map(str, row))},1,1,1\n" for row in rows
    )
    found = read(tmp_path, text, **{**FACTORS, "view_angles": "azimuth"})
    assert found.theta_r.tolist() == [-30, 30, -30, 30, -30]
    assert found.phi.tolist() == [0, 0, -10, 90, 80]
    assert found.in_plane.tolist() == [True, True, False, False, False]
    # The angle between light and viewer does not depend on how the azimuth is written.
    light, view = np.radians(45), np.radians(30)
    turn = np.radians([row[3] - row[1] for row in rows])
    cosines = np.cos(light) * np.cos(view) + np.sin(light) * np.sin(view) * np.cos(turn)
    np.testing.assert_allclose(np.sum(found.light * found.view, axis=1), cosines, atol=1e-15)


def test_names_of_columns(tmp_path):
    text = TABLE.replace("theta_i", "Inc").replace("patch", "Sample").replace("X,Y,Z", "r,g,b")
    columns = {"theta_i": "Inc", "patch": "Sample", "X": "r", "Y": "g", "Z": "b"}
    assert_same(
        read(tmp_path, text, columns=columns, source="s", **FACTORS),
        read(tmp_path, TABLE, source="s", **FACTORS),
    )


def test_repeats_are_averaged_and_unknown_columns_reported(tmp_path):
    text = "patch,theta_i,theta_r,X,Y,Z,Operator\np,45,0,1,2,3,Ann\np,45,0,2,4,n/a,Bob\n"
    found = read(tmp_path, text, **FACTORS)
    assert found.XYZ.tolist() == [[[1.5, 3, 3]]]
    assert found.notes == ("1 repeated readings averaged", "columns left out: Operator")


def test_slopes_and_inks(tmp_path):
    text = (
        "patch,slope,CMYK_C,CMYK_M,CMYK_Y,CMYK_K,theta_i,theta_r,X,Y,Z\n"
        "C,0,100,0,0,0,45,0,1,1,1\nC,30,100,0,0,0,45,0,2,2,2\n"
    )
    found = read(tmp_path, text, **FACTORS)
    assert found.patches == ("C", "C")
    assert found.slopes.tolist() == [0, 30]
    assert found.cmyk.tolist() == [[100, 0, 0, 0]] * 2
    steep = found.select(patches=found.slopes == 30)
    assert (steep.patches, steep.XYZ.tolist()) == (("C",), [[[2, 2, 2]]])


# --- spectra


def spectral_table(name: str = "{:g}") -> str:
    wavelengths = np.arange(400, 701, 10)
    names = ",".join(name.format(nm) for nm in wavelengths)
    values = ",".join(f"{0.3 + 0.2 * np.sin(nm / 40):.6f}" for nm in wavelengths)
    return f"patch,theta_i,theta_r,{names}\np,45,0,{values}\n"


@pytest.mark.filterwarnings("ignore::colour.utilities.ColourRuntimeWarning")
def test_spectra_agree_with_colour_science(tmp_path):
    declared = {key: FACTORS[key] for key in ("angles", "view_angles", "quantity", "scale")}
    found = read(tmp_path, spectral_table(), **declared)
    assert (found.illuminant, found.observer) == ("D65", "CIE 1964 10 Degree Standard Observer")
    distribution = colour.SpectralDistribution(found.spectra[0, 0], found.wavelengths)
    cmfs = colour.MSDS_CMFS[found.observer]
    illuminant = colour.SDS_ILLUMINANTS["D65"]
    integrated = colour.sd_to_XYZ(distribution, cmfs, illuminant, method="Integration") / 100
    np.testing.assert_allclose(found.XYZ[0, 0], integrated, rtol=1e-12)
    by_astm = colour.sd_to_XYZ(distribution, cmfs, illuminant, method="ASTM E308") / 100
    np.testing.assert_allclose(found.XYZ[0, 0], by_astm, atol=1e-4)


@pytest.mark.parametrize("name", ["{:g}nm", "nm{:g}", "SPECTRAL_NM{:g}", "R{:g}", "{:.1f}"])
def test_usual_names_of_spectral_columns(tmp_path, name):
    found = read(tmp_path, spectral_table(name), **FACTORS)
    assert found.wavelengths.tolist() == list(range(400, 701, 10))


def test_spectral_prefix(tmp_path):
    text = spectral_table("beta({:g}").replace("beta(", "b.")
    assert read(tmp_path, text, spectral_prefix="b.", **FACTORS).spectra.shape == (1, 1, 31)
    with pytest.raises(InputError, match=r"expected X, Y, Z"):
        read(tmp_path, text, **FACTORS)
    with pytest.raises(InputError, match=r"no column is named 'c\.' and a wavelength"):
        read(tmp_path, text, spectral_prefix="c.", **FACTORS)


def test_spectra_that_do_not_span_the_visible(tmp_path):
    lines = [line.split(",") for line in spectral_table().splitlines()]
    text = "\n".join(",".join(line[:20]) for line in lines)
    with pytest.raises(InputError, match=r"run from 400 to 560 nm .* expected 400 to 700"):
        read(tmp_path, text, **FACTORS)


@pytest.mark.parametrize("step", [5, 10, 20])
def test_perfect_diffuser_is_white(step):
    sums = weights(np.arange(400, 701, step), **D50_2).sum(axis=0)
    np.testing.assert_allclose(sums, [0.9642, 1, 0.8251], atol=1e-4)


def test_another_illuminant(tmp_path):
    found = read(tmp_path, spectral_table(), **FACTORS)
    again = under(under(found, "D65", "CIE 1964 10 Degree Standard Observer"), **D50_2)
    np.testing.assert_allclose(again.XYZ, found.XYZ, rtol=1e-14)
    with pytest.raises(UsageError, match="hold no spectra"):
        under(read(tmp_path, TABLE, **FACTORS), "A", D50_2["observer"])


def test_Lab_back_to_XYZ():
    XYZ = np.array([[0.5, 0.4, 0.3], [0.001, 0.002, 0.0005], [0.96, 1, 0.82]])
    white = (0.9642, 1, 0.8249)
    np.testing.assert_allclose(Lab_to_XYZ(XYZ_to_Lab(XYZ, white), white), XYZ, rtol=1e-13)


# --- CGATS


def test_cgats_with_comments_crlf_and_only_Lab(tmp_path):
    found = read(tmp_path, CGATS, "t.ti3", geometry="45:0", quantity="reflectance", **D50_2)
    assert found.patches == ("A 1", "A 2")
    assert found.cmyk.tolist() == [[0, 0, 0, 0], [0, 100, 0, 0]]
    assert (found.theta_i.tolist(), found.theta_r.tolist()) == ([45], [0])
    # FOGRA39's own XYZ of the two.
    figures = [[0.8448, 0.8762, 0.7457], [0.3303, 0.1679, 0.1501]]
    np.testing.assert_allclose(found.XYZ[:, 0], figures, atol=2e-4)
    assert "XYZ computed from CIELAB" in found.notes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"SETS 2", b"SETS 3", r"line 9: NUMBER_OF_SETS is 3, found 2"),
        (b"FIELDS 8", b"FIELDS 9", r"line 5: NUMBER_OF_FIELDS is 9, found 8"),
        (b"95.00 0.00 -2.00", b"95.00 0.00", r"line 11: found 7 fields, expected 8"),
        (b"95.00", b"ninety", r"line 11: LAB_L is 'ninety', expected a finite number"),
        (b"END_DATA\r\n", b"", r"BEGIN_DATA has no end: the file is cut off"),
        (b"BEGIN_DATA", b"START", r"no BEGIN_DATA"),
        (b"CMYK_K", b"CMYK_C", r"the column 'CMYK_C' stands twice"),
        (b"0 100 0 0", b"0 101 0 0", r"line 13: CMYK is \[0\.0, 101\.0"),
        (b"LAB_B", b"LAB_X", r"no column 'LAB_B', and columns\.LAB_B is not declared: did you mean 'LAB_"),
    ],
)
def test_malformed_cgats(tmp_path, old, new, message):
    assert old in CGATS
    with pytest.raises(InputError, match=message):
        read(tmp_path, CGATS.replace(old, new), "t.ti3", geometry="45:0", quantity="reflectance", **D50_2)


def test_first_table_of_several(tmp_path):
    found = read(tmp_path, CGATS + CGATS, "t.ti3", geometry="45:0", quantity="reflectance", **D50_2)
    assert len(found.patches) == 2
    assert found.notes[0] == "1 more tables of the file were left out"


# --- declarations


@pytest.mark.parametrize("key", ["angles", "view_angles", "quantity", "scale", "illuminant", "observer"])
def test_missing_declarations_are_named(tmp_path, key):
    declared = {name: value for name, value in FACTORS.items() if name != key}
    with pytest.raises(InputError, match=rf"table\.csv: {key} is not declared, expected "):
        read(tmp_path, TABLE, **declared)


def test_missing_geometry(tmp_path):
    with pytest.raises(InputError, match=r"columns\.theta_i or geometry is not declared"):
        read(tmp_path, CGATS, "t.ti3", quantity="reflectance", **D50_2)


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ({"angels": "degree"}, "unknown key 'angels': did you mean 'angles'"),
        ({"angles": "degrees"}, "unknown angles 'degrees': did you mean 'degree'"),
        ({"observer": "2"}, "unknown observer '2'"),
        ({"scale": 0}, "scale is 0, expected a number"),
        ({"geometry": "45:0"}, "geometry is declared, but the table has columns of angles"),
        ({"columns": {"theta": "Inc"}}, "columns: unknown name 'theta': did you mean 'theta_"),
        ({"columns": {"theta_i": "theta_in"}}, "no column 'theta_in', declared as theta_i: did you mean"),
        ({"format": "xlsx"}, "unknown format 'xlsx'"),
        ({"delimiter": '"'}, "delimiter is .*, expected one character"),
        ({"white": (1, 1)}, "white has 2 numbers, expected 3"),
        ({"delimiter": ";;"}, "delimiter is ';;', expected one character"),
    ],
)
def test_wrong_declarations(tmp_path, declared, message):
    with pytest.raises(InputError, match=message):
        read(tmp_path, TABLE, **{**FACTORS, **declared})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("theta_i,", "theta_in,", r"no column 'theta_i', .*: did you mean 'theta_in'"),
        ("patch", "Sample", r"no column 'patch' or 'SAMPLE_NAME' or 'SAMPLE_ID'"),
        ("X,Y,Z", "X,Y,W", r"no column 'Z' or 'XYZ_Z'"),
        ("X,Y,Z", "R,G,B", r"found the columns patch, theta_i, theta_r, R, G, B, expected X, Y, Z"),
        ("60,-60", "95,-60", r"line 2: theta_i is 95 degrees, expected 0 to less than 90"),
        ("60,-60", "60,-90", r"line 2: theta_r is -90 degrees"),
        ("60,-60", ",-60", r"line 2: theta_i is nan degrees"),
        ("0.021", "inf", r"line 4: Y is 'inf', expected a finite number"),
        ("black", "", r"line 4: the name of the patch is empty"),
        ("0.02,0.021", "0.021", r"line 4: found 5 fields, expected 6"),
        ("black", '"black', r"line 4: found 1 fields, expected 6"),
    ],
)
def test_malformed_tables(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message):
        read(tmp_path, TABLE.replace(old, new), **FACTORS)


def test_files_that_are_no_tables(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_measurements(tmp_path / "none.csv", **FACTORS)
    with pytest.raises(InputError, match="not a text file"):
        read(tmp_path, b"\x00\x01", **FACTORS)
    with pytest.raises(InputError, match="holds no columns"):
        read(tmp_path, "", **FACTORS)
    with pytest.raises(InputError, match="format is not declared"):
        read(tmp_path, TABLE, "table.dat", **FACTORS)
    with pytest.raises(InputError, match="field larger than field limit"):
        read(tmp_path, f'patch,X\n"{"a" * 200000}\n', **FACTORS)


def test_tables_that_would_fill_the_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(reader, "_MAX_VALUES", 11)
    with pytest.raises(LimitError, match="2 patches x 2 geometries x 3 values"):
        read(tmp_path, TABLE, **FACTORS)


def test_declarations_of_a_toml_file(tmp_path):
    text = 'angles = "radian"\nscale = 100\nsource = 2023-05-01\n[columns]\npatch = "p"\n'
    path = write(tmp_path, text, "t.toml")
    declared = read_declarations(path)
    assert (declared["angles"], declared["scale"], declared["columns"]) == ("radian", 100, {"patch": "p"})
    found = read(
        tmp_path, TABLE.replace("patch", "p"), **{**FACTORS, **declared, "angles": "degree", "scale": 1}
    )
    assert found.source == "2023-05-01"
    with pytest.raises(InputError, match="is not TOML"):
        read_declarations(write(tmp_path, "angles: radian", "t.yaml"))


def test_declarations_of_a_command_line():
    items = ["geometry=45:0", "delimiter=;", "columns.X=tristimulus X", "columns.Y=Y=1", "scale=1.5"]
    assert parse_declarations(items) == {
        "geometry": "45:0", "delimiter": ";", "scale": 1.5, "columns": {"X": "tristimulus X", "Y": "Y=1"}
    }  # fmt: skip
    with pytest.raises(UsageError, match="'angles' is no declaration"):
        parse_declarations(["angles"])


# --- our own files


def example() -> Measurements:
    random = np.random.default_rng(3)
    spectra = random.random((3, 4, 31))
    spectra[1, 2] = np.nan
    return Measurements(
        patches=("#1", 'the "best", of all', "日本"),
        theta_i=np.array([0.0, 45, 1 / 3, 60]),
        theta_r=np.array([-65.0, 0, 30, np.nextafter(60, 0)]),
        phi=np.array([0.0, 90, -89.9, 1e-5]),
        XYZ=np.where(np.arange(3) == 1, np.nan, random.normal(size=(3, 4, 3))),
        white=(0.9642, 1.0, 0.8249),
        source='A "source"\nof two lines, \x7f, \U0001f5a8 and #',
        cmyk=random.random((3, 4)) * 100,
        slopes=np.array([0.0, 15, 1 / 7]),
        wavelengths=np.linspace(400, 700, 31) + 0.25,
        spectra=spectra,
        **D50_2,
    )


def test_round_trip_is_exact(tmp_path):
    whole = example()
    plain = replace(whole, cmyk=None, slopes=None, wavelengths=None, spectra=None, phi=np.zeros(4))
    for name, measurements in (("whole.csv", whole), ("plain.csv", plain)):
        write_measurements(measurements, tmp_path / name)
        back = read_measurements(tmp_path / name)
        assert_same(back, measurements)
        write_measurements(back, tmp_path / f"again_{name}")
        assert (tmp_path / name).read_bytes() == (tmp_path / f"again_{name}").read_bytes()


def test_nothing_is_overwritten(tmp_path):
    path = write(tmp_path, "mine")
    with pytest.raises(UsageError, match="exists already"):
        write_measurements(example(), path)
    assert path.read_text() == "mine"


def test_declarations_that_contradict_the_file(tmp_path):
    write_measurements(example(), tmp_path / "a.csv")
    assert read_measurements(tmp_path / "a.csv", scale=1, illuminant="D50").illuminant == "D50"
    with pytest.raises(InputError, match="illuminant is 'D65', but the file says 'D50'"):
        read_measurements(tmp_path / "a.csv", illuminant="D65")


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ('# schema = "iccbrdf-measurements"\n# version = 2\n', "version is 2, expected 1"),
        ('# schema = "iccbrdf-measurements"\n# version = 1\n# angle = "degree"\n', "unknown key 'angle'"),
        ('# schema = "iccbrdf-measurements"\n# in the morning\n', "header: is not TOML"),
    ],
)
def test_malformed_headers(tmp_path, header, message):
    with pytest.raises(InputError, match=message):
        read(tmp_path, header + TABLE, **FACTORS)


def test_arrays_that_do_not_go_together():
    with pytest.raises(UsageError, match=r"XYZ has the shape \(3, 4, 2\), expected \(3, 4, 3\)"):
        replace(example(), XYZ=np.zeros((3, 4, 2)))
    with pytest.raises(UsageError, match="'a' on the slope 0 stands twice"):
        replace(example(), patches=("a", "a", "b"), slopes=None)
    with pytest.raises(UsageError, match="blanks to spare"):
        replace(example(), patches=("a", " b", "c"))


def test_report(tmp_path):
    found = report(read(tmp_path, TABLE, **FACTORS))
    assert (found["patches"], found["geometries"], found["in_plane"]) == (["white", "black"], 2, 2)
    assert (found["measured"], found["missing"]) == (3, 1)
    assert (found["theta_r"], found["Y"]) == ([-60, 0], [0.021, 2.5])
    text = report_text(read(tmp_path, TABLE, **FACTORS))
    assert "readings     3, 1 missing; Y 0.021 to 2.5" in text


# --- real files


@pytest.mark.parametrize("paint", ["garnet_red", "krylon_blue"])
def test_measured_paints(shared_data, paint):
    path = shared_data / "paint" / f"{paint}.brdf"
    found = read_measurements(path)
    assert found.patches == (paint,)
    assert found.spectra.shape == (1, 1439, 31)
    assert int(found.in_plane.sum()) == 125
    assert np.unique(found.theta_i.round(2)).tolist() == [10, 20, 30, 40, 50, 60, 70, 80]
    # Pi times the BRDF of the first row, straight from the text.
    row = next(line.split() for line in path.read_text().splitlines() if line.startswith(("0.", "1.")))
    assert found.theta_i[0] == pytest.approx(np.degrees(float(row[0])))
    np.testing.assert_allclose(found.spectra[0, 0], np.pi * np.array(row[4:], dtype=float))
    # The gloss lies about the mirror direction or beyond, on the other side than the lamp.
    near = found.in_plane & (found.theta_i < 55)
    brightest = np.flatnonzero(near)[np.argmax(found.XYZ[0, near, 1])]
    assert found.theta_r[brightest] == pytest.approx(-found.theta_i[brightest], abs=12)


def test_cornell_files_that_are_malformed(tmp_path):
    numbers = "# of 2\r\n2\r\n500 600\r\n0.1 0 0.2 3.14 0.01 0.02\r\n0.1 0 0.2 3.14 0.01\r\n"
    with pytest.raises(InputError, match="the last row has 5 numbers, expected 6"):
        read(tmp_path, numbers, "t.brdf")
    with pytest.raises(InputError, match=r"begins with '2\.5', expected the number of wavelengths"):
        read(tmp_path, "2.5 3", "t.brdf")
    with pytest.raises(InputError, match="holds no numbers"):
        read(tmp_path, "# nothing", "t.brdf")


def test_fogra39(shared_data):
    found = read_measurements(
        shared_data / "print" / "FOGRA39L.ti3", geometry="45:0", quantity="reflectance", scale=100, **D50_2
    )
    assert found.XYZ.shape == (1617, 1, 3)
    assert found.cmyk[8].tolist() == [0, 100, 0, 0]
    np.testing.assert_allclose(found.XYZ[8, 0], [0.3303, 0.1679, 0.1501], rtol=1e-12)
    wedge = read_measurements(
        shared_data / "print" / "media-wedge-v3-FOGRA39.csv", geometry="45:0", quantity="reflectance", **D50_2
    )
    np.testing.assert_allclose(wedge.XYZ[5, 0], found.XYZ[8, 0], atol=2e-4)
