"""Slopes files and the adjustment of flat colours by them: hand-computed figures, ends, continuity."""

import copy
import json
import subprocess
import sys
from pathlib import Path

import colour
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iccbrdf.brdf.geometry import direction
from iccbrdf.brdf.slopes import (
    Slope,
    Slopes,
    published_jumps,
    read_slopes,
    slope_adjust,
    slope_angle,
    write_slopes,
)
from iccbrdf.errors import InputError, UsageError
from iccbrdf.resources import folder

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = folder("profiles") / "fogra39_gloss" / "slopes.json"
TWO_DEGREES = "CIE 1931 2 Degree Standard Observer"
FLOAT32 = st.floats(allow_nan=False, allow_infinity=False, width=32)

CONTENTS = {
    "schema": "iccbrdf-slopes",
    "version": 1,
    "illuminant": "D50",
    "observer": TWO_DEGREES,
    "white": [0.9642, 1, 0.8249],
    "geometry": "0:45",
    "source": "a test",
    "slopes": [
        {"angle": 0, "W": [0.82, 0.85, 0.70], "B": [0.02, 0.03, 0.02]},
        {"angle": 20, "W": [0.75, 0.80, 0.65], "B": [0.03, 0.04, 0.03]},
        {"angle": 40, "W": [0.65, 0.70, 0.60], "B": [0.04, 0.05, 0.05]},
    ],
}


def written(path: Path, contents: object) -> Path:
    path.write_text(json.dumps(contents), encoding="utf-8")
    return path


@pytest.fixture
def slopes(tmp_path) -> Slopes:
    return read_slopes(written(tmp_path / "s.json", CONTENTS))


def grey_slopes() -> Slopes:
    """The figures that show the jumps: Wf = .85, Bf = .03, Ws = .70, Bs = .05."""
    flat, steep = Slope(0, (0.85,) * 3, (0.03,) * 3), Slope(30, (0.70,) * 3, (0.05,) * 3)
    return Slopes("E", TWO_DEGREES, (1.0, 1.0, 1.0), "0:45", "figures", (flat, steep))


def test_every_field_is_read(slopes) -> None:
    assert (slopes.illuminant, slopes.observer, slopes.white) == ("D50", TWO_DEGREES, (0.9642, 1, 0.8249))
    assert (slopes.geometry, slopes.source) == ("0:45", "a test")
    assert slopes.angles.tolist() == [0, 20, 40]
    assert slopes.W[1].tolist() == [0.75, 0.80, 0.65]
    assert slopes.B[2].tolist() == [0.04, 0.05, 0.05]


def test_white_of_the_illuminant_is_the_default(tmp_path) -> None:
    contents = {key: value for key, value in CONTENTS.items() if key != "white"}
    found = read_slopes(written(tmp_path / "s.json", contents))
    assert found.white == pytest.approx((0.9642, 1, 0.8249), abs=3e-4)


def test_linear_between_slopes_and_held_beyond(slopes) -> None:
    Ws, Bs = slopes.at([[10, 20], [35, 70]])
    assert Ws.shape == Bs.shape == (2, 2, 3)
    assert Ws[0, 0] == pytest.approx([0.785, 0.825, 0.675])
    assert Bs[1, 0] == pytest.approx([0.0375, 0.0475, 0.045])
    assert Ws[1, 1].tolist() == [0.65, 0.70, 0.60]
    assert slopes.beyond([[10, 20], [40, 70]]).tolist() == [[False, False], [False, True]]


def test_angle_of_normals_of_any_length() -> None:
    angles = np.array([0, 1e-7, 1e-3, 15, 60, 90, 120, 180])
    lengths = np.array([1e-30, 1, 1e30])[:, np.newaxis, np.newaxis]
    found = slope_angle(lengths * direction(angles, 217))
    # The arc cosine would be 1e-6 degrees off at 1e-3 degrees, and 0 at 1e-7.
    assert found == pytest.approx(np.tile(angles, (3, 1)), rel=1e-13)
    assert slope_angle([0, 0, 0]) == 0


def test_published_figures_and_their_jumps() -> None:
    slopes = grey_slopes()

    def published(T: float) -> float:
        return slope_adjust(np.full(3, T), 30, slopes, method="published")[1]

    # By hand: C = .65 / .82 = .792683, (.85 - .03 C) .70 / .85 + .05 C = .720050, and so on.
    assert published(0.85) == pytest.approx(0.70)
    assert published(0.85 - 1e-9) == pytest.approx(0.720050, abs=1e-6)
    assert published(0.03) == pytest.approx(0.0458537, abs=1e-6)
    assert published(0.03 + 1e-9) == pytest.approx(0.0447561, abs=1e-6)
    assert published(0.90) == pytest.approx(0.90 * 0.70 / 0.85)
    assert published(0.01) == pytest.approx(0.0258537, abs=1e-6)

    jumps = published_jumps(slopes, 30)
    assert jumps.white_XYZ == pytest.approx([published(0.85 - 1e-12) - published(0.85)] * 3, abs=1e-10)
    assert jumps.black_XYZ == pytest.approx([published(0.03 + 1e-12) - published(0.03)] * 3, abs=1e-10)
    for found, ends in (
        (jumps.white_dE, (0.85, 0.85 - 1e-12)),
        (jumps.black_dE, (0.03, 0.03 + 1e-12)),
    ):
        Lab = [colour.XYZ_to_Lab(np.full(3, published(T)), colour.XYZ_to_xy([1, 1, 1])) for T in ends]
        assert found == pytest.approx(colour.delta_E(*Lab, method="CIE 2000"), abs=1e-8)


def test_published_compares_by_luminance_alone(slopes) -> None:
    # X and Z above the white's, Y just below: the middle formula for all three.
    T = np.array([0.95, 0.849, 0.9])
    Wf, Bf, (Ws, Bs) = slopes.W[0], slopes.B[0], slopes.at(20)
    C = (Ws - Bs) / (Wf - Bf)
    found = slope_adjust(T, 20, slopes, method="published")
    assert found == pytest.approx((T - C * Bf) * Ws / Wf + C * Bs, rel=1e-14)


def test_jumps_have_the_shape_of_the_angles_and_vanish_on_the_flat(slopes) -> None:
    jumps = published_jumps(slopes, slopes.angles)
    assert jumps.white_XYZ.shape == jumps.black_XYZ.shape == (3, 3)
    assert jumps.white_dE.shape == jumps.black_dE.shape == (3,)
    assert jumps.white_XYZ[0] == pytest.approx([0, 0, 0], abs=1e-16)
    assert jumps.black_dE[0] == pytest.approx(0, abs=1e-12)
    assert np.all(jumps.white_dE[1:] > 0.1)


@pytest.mark.parametrize("angle", [0, 7.5, 20, 33, 40, 80])
def test_affine_gives_the_measured_patches(slopes, angle) -> None:
    Ws, Bs = slopes.at(angle)
    assert slope_adjust(slopes.W[0], angle, slopes) == pytest.approx(Ws, abs=1e-15)
    assert slope_adjust(slopes.B[0], angle, slopes) == pytest.approx(Bs, abs=1e-15)


@pytest.mark.parametrize("method", ["affine", "published"])
def test_nothing_changes_on_the_flat(slopes, method) -> None:
    XYZ = np.random.default_rng(3).uniform(0, 1, (1000, 3))
    assert slope_adjust(XYZ, 0, slopes, method=method) == pytest.approx(XYZ, abs=1e-15)


def largest_step(slopes: Slopes, method: str, steps: int) -> float:
    """Largest step of T' along a straight line from below the black to above the white."""
    T = np.linspace([0.005, 0.01, 0.005], [0.9, 0.95, 0.8], steps + 1)
    return float(np.max(np.abs(np.diff(slope_adjust(T, 30, slopes, method=method), axis=0))))


def test_affine_is_continuous_and_published_is_not(slopes) -> None:
    assert largest_step(slopes, "affine", 10_000) == pytest.approx(
        largest_step(slopes, "affine", 1000) / 10, rel=1e-6
    )
    jump = np.abs(published_jumps(slopes, 30).white_XYZ).max()
    assert jump > 0.01
    assert largest_step(slopes, "published", 10_000) == pytest.approx(jump, abs=2e-4)


def test_affine_is_continuous_in_the_angle(slopes) -> None:
    found = slope_adjust([0.3, 0.4, 0.2], np.linspace(0, 50, 50_001), slopes)
    assert np.abs(np.diff(found, axis=0)).max() < 1e-5


@pytest.mark.parametrize("method", ["affine", "published"])
@given(XYZ=st.tuples(FLOAT32, FLOAT32, FLOAT32), n=st.tuples(FLOAT32, FLOAT32, FLOAT32))
def test_every_pixel_is_finite(method, XYZ, n) -> None:
    angle = slope_angle(n)
    assert 0 <= angle <= 180
    assert np.all(np.isfinite(slope_adjust(XYZ, angle, grey_slopes(), method=method)))


def test_unknown_method_is_named(slopes) -> None:
    with pytest.raises(UsageError, match="unknown slope method 'afine': did you mean 'affine'"):
        slope_adjust([0.1, 0.1, 0.1], 10, slopes, method="afine")
    with pytest.raises(UsageError, match=r"XYZ has the shape \(2,\)"):
        slope_adjust([0.1, 0.1], 10, slopes)


def test_example_is_written_as_it_was_read(tmp_path) -> None:
    copied = tmp_path / "copy.json"
    write_slopes(read_slopes(EXAMPLE), copied)
    assert copied.read_bytes() == EXAMPLE.read_bytes()
    with pytest.raises(UsageError, match="exists already"):
        write_slopes(read_slopes(EXAMPLE), copied)


def test_example_says_that_it_is_computed_and_does_what_it_says() -> None:
    slopes = read_slopes(EXAMPLE)
    assert slopes.source.startswith("Computed, not measured")
    # At 60 degrees the films are half as thick: t is halved, and so is the density.
    Rf, Rs = slopes.W[[0, -1]] / slopes.white
    assert Rs / (1 - Rs) == pytest.approx(Rf / (1 - Rf) / 2, rel=2e-5)
    density = np.log10(slopes.W / slopes.B)
    assert density[-1] == pytest.approx(density[0] / 2, rel=2e-5)


def test_example_is_what_the_tool_makes(shared_data, tmp_path) -> None:
    tool = [sys.executable, ROOT / "tools" / "make_primaries.py", "--data", shared_data, "-o", tmp_path]
    subprocess.run(tool, check=True)
    assert (tmp_path / "fogra39_gloss" / "slopes.json").read_bytes() == EXAMPLE.read_bytes()


DELETE = object()


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (
            ("schema",),
            "iccbrdf-primaries",
            "unknown schema 'iccbrdf-primaries': did you mean 'iccbrdf-slopes'?",
        ),
        (("illuminant",), "D51", "unknown illuminant 'D51'"),
        (("slope",), [], "unknown key 'slope': did you mean 'slopes'?"),
        (("source",), DELETE, "the key 'source' is missing"),
        (("slopes",), [], "slopes is empty, expected at least one object"),
        (("slopes", 0, "angle"), 15, "slope 1: angle is 15, expected 0: the first slope is the flat print"),
        (("slopes", 2, "angle"), 20, "slope 3: angle is 20, expected more than the 20 before it"),
        (("slopes", 2, "angle"), 10, "slope 3: angle is 10, expected more than the 20 before it"),
        (("slopes", 2, "angle"), 91, "slope 3: angle is 91, expected a number from 0 to 90"),
        (("slopes", 1, "angle"), DELETE, "slope 2: the key 'angle' is missing"),
        (
            ("slopes", 0, "B"),
            [0.02, 0.85, 0.02],
            "slope 1: W[1] is 0.85, expected more than B[1], which is",
        ),
        (("slopes", 2, "W", 2), 0.01, "slope 3: W[2] is 0.01, expected more than B[2], which is 0.05"),
        (("slopes", 1, "B", 0), 0, "slope 2: B[0] is 0, expected a number of at least 1e-06"),
        (("slopes", 1, "W", 0), -1, "slope 2: W[0] is -1, expected a number of at least 1e-06"),
        (("slopes", 1, "Ws"), [1, 1, 1], "slope 2: unknown key 'Ws': did you mean 'W'?"),
    ],
)
def test_wrong_entries_are_named(place, value, message, tmp_path) -> None:
    contents = copy.deepcopy(CONTENTS)
    target = contents
    for step in place[:-1]:
        target = target[step]
    if value is DELETE:
        del target[place[-1]]
    else:
        target[place[-1]] = value
    path = written(tmp_path / "s.json", contents)
    with pytest.raises(InputError) as caught:
        read_slopes(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)
