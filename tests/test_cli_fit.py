"""iccbrdf fit: measurements -> primaries."""

import json

import numpy as np
import pytest
from fit_examples import BRDF1, measured

from iccbrdf.brdf.geometry import planar
from iccbrdf.brdf.primaries import read_primaries

CYAN = [0.15, 0.23, 0.52, 0.2, 0.21, 0.17, 0.25]
THETAS = [(i, r) for i in (15, 30, 45, 60) for r in range(-65, 31, 5) if abs(r - i) > 15]
TWO_DEGREES = "CIE 1931 2 Degree Standard Observer"
DECLARED = (
    "-d", "angles=degree", "-d", "view_angles=lamp", "-d", "quantity=reflectance", "-d", "scale=1",
    "-d", "illuminant=D50", "-d", f"observer={TWO_DEGREES}", "-d", "source=a test",
)  # fmt: skip


def write_table(path, patches, thetas=THETAS):
    """A table of reflectances of patches, given by name and parameters."""
    theta_i, theta_r = np.array(thetas, dtype=float).T
    lines = ["patch,theta_i,theta_r,X,Y,Z"]
    for name, parameters in patches.items():
        XYZ = measured(parameters, planar(theta_i), planar(theta_r))
        for i, r, row in zip(theta_i, theta_r, XYZ, strict=True):
            lines.append(f"{name},{i},{r}," + ",".join(repr(value) for value in row.tolist()))
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def table(tmp_path):
    return write_table(tmp_path / "table.csv", {"White": BRDF1, "Cyan": CYAN})


def test_primaries_file(run, table, tmp_path):
    result = run("fit", table, "-o", tmp_path / "p.json", *DECLARED)
    assert (result.code, result.err) == (0, "")
    primaries = read_primaries(tmp_path / "p.json")
    np.testing.assert_allclose(primaries.parameters, [BRDF1, CYAN], rtol=1e-6)
    assert [primary.name for primary in primaries.primaries] == ["White", "Cyan"]
    assert (primaries.model, primaries.refractive_index, primaries.geometry) == ("brdf1", 1.5, "45:0")
    assert (primaries.illuminant, primaries.observer) == ("D50", TWO_DEGREES)
    assert primaries.source == "a test. Fitted: rms CIEDE2000 of the same quantity, least_squares."
    assert primaries.encoding == {"kd": 1, "ks": 1, "m": 1}
    standard = measured([BRDF1, CYAN], planar([45.0]), planar([0.0]))[:, 0]
    np.testing.assert_allclose(primaries.XYZ, standard, rtol=1e-6)


def test_text(run, table, tmp_path):
    text = run("fit", table, "-o", tmp_path / "p.json", *DECLARED).out
    assert "geometries   68, 68 in the plane of incidence" in text
    assert "brdf1, rms CIEDE2000, least_squares, refractive index 1.5; XYZ at 45:0" in text
    assert "Cyan   kd.X 0.15±0%  kd.Y 0.23±0%" in text
    assert "same quantity  mean CIEDE2000 diffuse 0.00, near-specular 0.00, specular 0.00" in text
    assert "as published   mean CIEDE2000 diffuse" in text
    assert "100% of the starts reach the best" in text
    assert text.endswith(f"no fit is flagged\n  -> {tmp_path / 'p.json'}\n")


def test_json(run, table, tmp_path):
    result = run("fit", table, "-o", tmp_path / "p.json", "--json", *DECLARED).json
    assert result["schema"] == "iccbrdf.fit/1"
    assert result["table"]["patches"] == ["White", "Cyan"]
    white = result["patches"][0]
    assert white["parameters"]["ks.Y"] == pytest.approx(0.22, rel=1e-6)
    low, high = white["intervals"]["ks.Y"]
    assert low == pytest.approx(0.22, rel=1e-6)
    assert high == pytest.approx(0.22, rel=1e-6)
    assert set(white["mean_CIEDE2000"]) == {"diffuse", "near-specular", "specular"}
    untested = [found["check"] for found in white["findings"] if found["value"] is None]
    assert untested == ["retro-reflection"]
    assert result["quantities"]["same quantity"]["diffuse"] < 1e-6
    assert result["quantities"]["as published"]["diffuse"] > 1
    assert [solver["solver"] for solver in result["solvers"]] == ["least_squares"]
    assert (result["flagged"], result["files"]) == ([], [str(tmp_path / "p.json")])


def test_strict(run, tmp_path):
    table = write_table(tmp_path / "table.csv", {"White": BRDF1, "Mirror": [*BRDF1[:6], 0.02]})
    loose = run("fit", table, "-o", tmp_path / "a.json", *DECLARED)
    assert loose.code == 0
    assert "FLAG narrow lobe: 0.382, expected at least 1" in loose.out
    assert "1 of 2 fits must not be trusted" in loose.out
    strict = run("fit", table, "-o", tmp_path / "b.json", "--strict", "--json", *DECLARED)
    assert strict.code == 1
    assert strict.json["flagged"] == ["Mirror"]
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    good = run("fit", table, "-o", tmp_path / "c.json", "--strict", "--patches", "White", *DECLARED)
    assert good.code == 0
    assert [primary.name for primary in read_primaries(tmp_path / "c.json").primaries] == ["White"]


def test_both_solvers_beside_each_other(run, table, tmp_path):
    options = ("--compare", "--starts", "1", "--patches", "White", "--objective", "mean-CIEDE2000", "--json")
    fast, slow = run("fit", table, "-o", tmp_path / "p.json", *options, *DECLARED).json["solvers"]
    assert (fast["solver"], slow["solver"]) == ("least_squares", "nelder_mead")
    assert fast["seconds"] < slow["seconds"]
    assert fast["mean CIEDE2000"] < 1e-6
    assert slow["mean CIEDE2000"] < 1e-2


def test_as_published(run, table, tmp_path):
    result = run("fit", table, "-o", tmp_path / "p.json", "--as-published", "--json", *DECLARED).json
    assert result["as_published"]
    assert result["patches"][0]["objective"] > 1
    assert result["quantities"]["same quantity"]["diffuse"] < 1e-6
    assert "I as published" in read_primaries(tmp_path / "p.json").source


def test_refractive_index(run, table, tmp_path):
    free = run("fit", table, "-o", tmp_path / "a.json", "--refractive-index", "free", "--json", *DECLARED)
    assert free.json["refractive_index"] == 1.5
    run("fit", table, "-o", tmp_path / "b.json", "--refractive-index", "1.6", *DECLARED)
    assert read_primaries(tmp_path / "b.json").refractive_index == 1.6
    wrong = run("fit", table, "-o", tmp_path / "c.json", "--refractive-index", "1,5", *DECLARED)
    assert (wrong.code, "found '1,5'" in wrong.err) == (2, True)
    options = ("--model", "ward", "--refractive-index", "1.5")
    none = run("fit", table, "-o", tmp_path / "c.json", *options, *DECLARED)
    assert (none.code, "ward has none" in none.err) == (2, True)


def test_geometry_nearest_to_the_standard_and_scales(run, tmp_path):
    thetas = [(i, r) for i in (20, 35, 50, 65) for r in range(-62, 30, 4) if abs(r - i) > 12]
    table = write_table(tmp_path / "table.csv", {"White": [1.1, 1.2, 0.9, 1.7, 1.7, 1.7, 0.3]}, thetas)
    run("fit", table, "-o", tmp_path / "p.json", "--max-angle", "60", *DECLARED)
    primaries = read_primaries(tmp_path / "p.json")
    assert primaries.geometry == "50:-2, the measured geometry nearest to 45:0"
    assert primaries.encoding == {"kd": 1.25, "ks": 2, "m": 1}


def test_parameters_at_their_bounds_make_a_file(run, tmp_path):
    table = write_table(tmp_path / "table.csv", {"Mirror": [*BRDF1[:3], 40, 40, 40, 0.25]})
    result = run("fit", table, "-o", tmp_path / "p.json", *DECLARED)
    assert result.code == 0
    assert "FLAG at a bound" in result.out
    primaries = read_primaries(tmp_path / "p.json")
    assert (primaries.parameters[0, 4], primaries.encoding["ks"]) == (10, 10)


def test_what_is_left_out_is_reported(run, tmp_path):
    rows = write_table(tmp_path / "flat.csv", {"White": BRDF1}, [*THETAS, (75, 0), (30, -72)]).read_text()
    head, *lines = rows.splitlines()
    tilted = [f"{line},{slope}" for slope in (0, 30) for line in lines]
    table = tmp_path / "table.csv"
    table.write_text("\n".join([f"{head},slope", *tilted]) + "\n")
    text = run("fit", table, "-o", tmp_path / "p.json", *DECLARED).out
    assert "note         1 patches on slopes left out" in text
    assert "note         2 geometries beyond 70 degrees left out" in text
    assert len(read_primaries(tmp_path / "p.json").primaries) == 1


def test_errors(run, table, tmp_path):
    output = tmp_path / "p.json"
    undeclared = run("fit", table, "-o", output)
    assert (undeclared.code, "is not declared" in undeclared.err) == (3, True)
    unknown = run("fit", table, "-o", output, "--patches", "Whit", *DECLARED)
    assert (unknown.code, "did you mean 'White'?" in unknown.err) == (2, True)
    for option in ("--max-angle", "--repeat-scatter"):
        endless = run("fit", table, "-o", output, option, "nan", *DECLARED)
        assert (endless.code, "not a finite number" in endless.err) == (2, True)
    few = write_table(tmp_path / "few.csv", {"White": BRDF1}, THETAS[:7])
    refused = run("fit", few, "-o", output, *DECLARED)
    assert (refused.code, "patch White was measured in 7 geometries" in refused.err) == (3, True)
    assert not output.exists()
    output.write_text("mine")
    assert run("fit", table, "-o", output, *DECLARED).code == 2
    assert output.read_text() == "mine"
    assert run("fit", table, "-o", output, "--force", *DECLARED).code == 0
    assert json.loads(output.read_text())["schema"] == "iccbrdf-primaries"


def test_declarations_from_a_file(run, table, tmp_path):
    toml = tmp_path / "declarations.toml"
    toml.write_text(
        'angles = "degree"\nview_angles = "lamp"\nquantity = "reflectance"\nscale = 1\n'
        f'illuminant = "D65"\nobserver = "{TWO_DEGREES}"\n'
    )
    result = run("fit", table, "-o", tmp_path / "p.json", "--declarations", toml, "-d", "illuminant=D50")
    assert result.code == 0
    assert read_primaries(tmp_path / "p.json").illuminant == "D50"
