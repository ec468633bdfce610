"""The papers' experiments on simulated prints: their tables, and which orderings hold."""

import itertools
from dataclasses import replace

import colour
import numpy as np
import pytest
from report_examples import TESTS, simulated, small, write

from iccbrdf.brdf.interpolation import interpolate
from iccbrdf.brdf.primaries import Primaries
from iccbrdf.brdf.slopes import slope_adjust
from iccbrdf.errors import InputError
from iccbrdf.report import Ordering, evaluate_print, orderings, read_print, tables
from iccbrdf.report import evaluation as module
from iccbrdf.report.papers import significant_difference
from iccbrdf.report.print_data import at_45_0
from iccbrdf.report.tables import Row, Table, histograms, ranked


@pytest.fixture(scope="module")
def print_data():
    return small(simulated())


@pytest.fixture(scope="module", autouse=True)
def fits_once():
    """The same readings are fitted once, however many evaluations they are part of."""
    done, fit = {}, module.fit

    def remembered(XYZ, light, view, white, **options):
        key = XYZ.tobytes(), light.tobytes(), view.tobytes(), tuple(white), tuple(options.items())
        if key not in done:
            done[key] = fit(XYZ, light, view, white, **options)
        return done[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "fit", remembered)
        yield


@pytest.fixture(scope="module")
def evaluation(print_data):
    return evaluate_print(print_data)


def table(evaluation, title):
    (found,) = (each for each in tables(evaluation) if title in each.title)
    return {row.label: row for row in found.rows}, found


@pytest.mark.parametrize("seed", range(8))
def test_orderings_of_the_papers(seed):
    claims = {claim.name: claim for claim in orderings(evaluate_print(simulated(seed)))}
    for name in (
        "diffuse mean: CD < RMSE",
        "diffuse max: CD < RMSE",
        "near-specular mean: CD < RMSE",
        "specular mean: RMSE < CD",
        "mean: BRDF2 no large gain",
        "diffuse mean: AIB < IB",
        "mean: AIB < IB",
        "2020 mean: Cook-Torrance < Ward",
    ):
        assert claims[name].holds, claims[name]


def test_an_ordering_without_figures_is_open():
    assert Ordering("a", 1.0, 2.0).holds is True
    assert Ordering("a", 2.0, 2.0).holds is False
    unknown = Ordering("a", np.nan, 2.0)
    assert unknown.holds is None
    assert unknown.to_dict() == {"name": "a", "lower": None, "upper": 2.0, "holds": None}


def test_flat_against_slope_by_hand(print_data, evaluation):
    found = evaluation.slope_colours
    assert found.patches == ("White", "C", "M", "Y", "CM", "CY", "MY", "K", *TESTS)
    assert found.angles.tolist() == [30, 60]
    # White and K are what the adjustment is made from.
    np.testing.assert_allclose(found.after[:, [0, 7]], 0, atol=1e-6)
    flat = at_45_0(print_data.tests)[0]
    slopes = print_data.slopes
    printed = at_45_0(slopes)[slopes.keys.index(("C40", 60.0))]
    colours = print_data.colours
    C = (colours.W[2] - colours.B[2]) / (colours.W[0] - colours.B[0])
    adjusted = C * (flat - colours.B[0]) + colours.B[2]
    xy = np.array(colours.white)[:2] / sum(colours.white)
    for XYZ, ours in ((flat, found.before), (adjusted, found.after)):
        Lab = [colour.XYZ_to_Lab(each, xy) for each in (XYZ, printed)]
        assert ours[1, 8] == pytest.approx(colour.delta_E(*Lab, method="CIE 2000"), rel=1e-8)


def test_both_eighth_nodes(evaluation):
    assert evaluation.models["ward"].primaries.measurements.patches[-1] == "CMY"
    assert evaluation.fits.measurements.patches[-1] == "K"
    assert evaluation.models["ward"].tests.measurements.patches == TESTS[:3]


def test_methods_reach_interpolation_and_slopes(print_data, monkeypatch):
    used = []

    def spy_interpolate(XYZ, primaries: Primaries, *, method):
        used.append((method, len(primaries.primaries), primaries.model, len(XYZ)))
        return interpolate(XYZ, primaries, method=method)

    def spy_adjust(XYZ, angles, slopes, *, method):
        used.append(method)
        return slope_adjust(XYZ, angles, slopes, method=method)

    monkeypatch.setattr(module, "interpolate", spy_interpolate)
    monkeypatch.setattr(module, "slope_adjust", spy_adjust)
    evaluate_print(print_data, interpolation="published", slope_method="published")
    assert sorted(map(str, used)) == [
        "('published', 8, 'brdf1', 8)",
        "('published', 8, 'brdf1', 8)",
        "('published', 8, 'cook_torrance_2020', 3)",
        "('published', 8, 'ward', 3)",
        "published",
        "published",
    ]


def test_interpolation_at_a_node_is_its_fit(print_data):
    XYZ = print_data.tests.XYZ.copy()
    XYZ[0] = print_data.primaries.XYZ[print_data.primaries.patches.index("C")]
    data = replace(print_data, tests=replace(print_data.tests, XYZ=XYZ))
    for found in evaluate_print(data).models.values():
        optimised, interpolated = (found.tests.XYZ(source)[0] for source in ("optimised", "interpolated"))
        np.testing.assert_allclose(interpolated, optimised, rtol=1e-4)


def test_wilcoxon_by_all_signs(evaluation):
    # The exact test: how many of all signs of the differences give a sum of ranks as far out.
    IB, AIB = (np.nanmean(evaluation.slopes.differences(name), axis=1) for name in ("IB", "AIB"))
    ranks = np.argsort(np.argsort(np.abs(IB - AIB))) + 1
    positive = ranks[IB > AIB].sum()
    observed = min(positive, ranks.sum() - positive)
    signs = np.array(list(itertools.product([0, 1], repeat=len(ranks))))
    sums = signs @ ranks
    p = np.mean(np.minimum(sums, ranks.sum() - sums) <= observed)
    assert evaluation.wilcoxon.pairs == 8
    assert evaluation.wilcoxon.statistic == observed
    assert evaluation.wilcoxon.p == pytest.approx(p)


def test_tables_have_the_papers_figures_at_their_angles(evaluation):
    found, _ = table(evaluation, "Table I:")
    assert found["before, mean"].paper == (2.35, 4.86)
    found, _ = table(evaluation, "Table 1:")
    assert found["Ward interpolated"].paper == (0.62, 2.03)
    found, _ = table(evaluation, "Table II:")
    assert found["BRDF1 CD all"].paper == (5.67, 2.78, 3.80, None, None, None)
    found, shown = table(evaluation, "Table IV")
    assert found["AIB"].paper == (3.95, 3.84, 14.23)
    assert "(14.23)" in str(shown)


def test_tables_say_what_the_appearances_hold(evaluation):
    found, _ = table(evaluation, "Table IV")
    IB = evaluation.slopes.differences("IB")
    np.testing.assert_allclose(found["IB"].ours, [IB.mean(), np.median(IB), IB.max()])
    found, _ = table(evaluation, "Table III")
    steep = IB[[slope == 60 for _, slope in evaluation.slopes.measurements.keys]]
    assert max(found["60 degrees IB"].ours[3:]) == pytest.approx(steep.max())
    found, _ = table(evaluation, "Table 1:")
    Y = evaluation.models["ward"].tests
    at_60 = (Y.measurements.theta_i == 60) & (Y.measurements.theta_r == -60)
    error = (Y.XYZ("optimised") - Y.XYZ("measured"))[:, at_60, 1]
    assert found["Ward optimised"].ours[-1] == pytest.approx(np.sqrt(np.mean(error**2)))
    counts = histograms(evaluation.slopes)
    assert sum(counts["AIB"]) == sum(counts["IB"]) == IB.size
    assert counts["IB"][2] == np.count_nonzero((IB >= 1) & (IB < 1.5))


def test_what_is_not_measured_is_no_figure():
    made = Table("title", ("a", "b"), (Row("row", (1.234, np.nan), (None, 2.0)),))
    assert made.to_dict()["rows"] == [{"label": "row", "ours": [1.234, None], "paper": [None, 2.0]}]
    assert str(made).splitlines()[-1].split() == ["row", "1.23", "-", "(2.00)"]
    assert ranked([3.0, np.nan, 1.0, 2.0]) == [2, 3, 0]


def test_rule_of_significance():
    assert [significant_difference(level) for level in (0, 4.99, 5, 10, 10.01)] == [1, 1, 2, 2, None]


def test_rule_in_the_tables(evaluation):
    _, found = table(evaluation, "Table I:")
    before, after = found.rows[0].ours, found.rows[1].ours
    assert before[1] < 5
    assert before[1] - after[1] > 1 > before[0] - after[0]
    assert found.notes == ("no significant difference: 30 degrees; after significantly better: 60 degrees.",)


def test_files_give_the_same(print_data, evaluation, tmp_path):
    write(print_data, tmp_path)
    read = read_print(tmp_path)
    assert [str(each) for each in tables(evaluate_print(read))] == [str(each) for each in tables(evaluation)]


def without(table, name):
    return table.select([p for p, patch in enumerate(table.patches) if patch != name])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (lambda d: {"primaries": without(d.primaries, "CMY")}, "primaries: no patch 'CMY' on the slope 0"),
        (lambda d: {"slopes": without(d.slopes, "K40")}, "slopes: no patch 'K40' on the slope 30"),
        (lambda d: {"tests": d.tests.select([3])}, "tests: found no patch without K"),
        (lambda d: {"tests": replace(d.tests, cmyk=None)}, "tests: found no patch without K"),
        (
            lambda d: {"tests": d.tests.select(None, d.tests.theta_i == 60)},
            "tests: found no readings at 45:0",
        ),
        (
            lambda d: {"tests": d.tests.select(None, d.tests.theta_r > -20)},
            "tests: found no readings in a mirror direction",
        ),
        (lambda d: {"tests": replace(d.tests, XYZ=-d.tests.XYZ)}, "'C40' on the slope 0 has the XYZ"),
        (lambda d: {"tests": replace(d.tests, white=(0.95, 1.0, 1.09))}, "tests: found D50"),
        (lambda d: {"tests": replace(d.tests, illuminant="D65")}, "tests: found D65, .*expected D50"),
        (lambda d: {"colours": replace(d.colours, slopes=d.colours.slopes[:1])}, "no slope but the flat"),
    ],
)
def test_data_that_do_not_suffice(print_data, changes, message):
    with pytest.raises(InputError, match=message):
        replace(print_data, **changes(print_data))


def test_errors_name_the_folder_and_the_file(print_data, tmp_path):
    with pytest.raises(InputError, match=r"primaries\.csv"):
        read_print(tmp_path)
    with pytest.raises(InputError, match="is no folder"):
        read_print(tmp_path / "none")
    write(print_data, tmp_path)
    lines = (tmp_path / "primaries.csv").read_text().splitlines()
    kept = [line for line in lines if not line.startswith("CMY,")]
    (tmp_path / "primaries.csv").write_text("\n".join(kept))
    with pytest.raises(InputError, match=f"^{tmp_path}: primaries: no patch 'CMY'"):
        read_print(tmp_path)


def test_missing_readings_are_left_out(print_data, evaluation):
    tests = print_data.tests
    XYZ = tests.XYZ.copy()
    # Of the first patch nothing in the mirror directions, of the second one reading.
    XYZ[0, tests.theta_i == -tests.theta_r] = np.nan
    XYZ[1, 0] = np.nan
    found, _ = table(
        evaluate_print(replace(print_data, tests=replace(tests, XYZ=XYZ, spectra=None, wavelengths=None))),
        "Table 1:",
    )
    whole, _ = table(evaluation, "Table 1:")
    ours, before = (np.array(rows["Ward optimised"].ours) for rows in (found, whole))
    assert np.isfinite(ours).all()
    assert not np.array_equal(ours, before)
