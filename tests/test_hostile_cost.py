"""Profiles that ask for more than anybody would give: refused before a pixel is touched, or linked soon."""

import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import tifffile
from cmm_examples import device_profile, matrix

from iccbrdf.calc.exact_passes import EXACT_PASSES
from iccbrdf.calc.graph import Graph
from iccbrdf.calc.lift import MAX_MOVES, lift_element
from iccbrdf.calc.passes import optimise
from iccbrdf.calc.program import Op, parse
from iccbrdf.calc.verify import MAX_WORK, verify, verify_element
from iccbrdf.calc.work import element_work
from iccbrdf.cmm import MAX_COST, link
from iccbrdf.errors import LimitError, UnsupportedError, UsageError
from iccbrdf.icc import (
    Calculator,
    Clut,
    CurveSet,
    FormulaSegment,
    MultiProcess,
    Profile,
    SampledCalculatorCurve,
    SegmentedCurve,
    write_profile,
)
from iccbrdf.icc.reader import MAX_OPERATIONS

THREE = "in(0,3) out(0,3)"


def number(value):
    return Op("data", int.from_bytes(struct.pack(">f", value), "big"))


def calculator(text, elements=(), channels=3):
    return Calculator(channels, channels, parse("{ " + text + " }"), elements)


def doubled(times, element=None):
    """A calculator that applies itself, so to say, 2^times times: a few hundred bytes."""
    element = element or calculator("in(0,3) sin(3) cos(3) out(0,3)")
    for _ in range(times):
        element = calculator("in(0,3) calc(0) calc(0) out(0,3)", [element])
    return element


def scanner(*elements):
    return device_profile("scnr", A2B0=MultiProcess.of(*elements))


# What a pixel takes --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "work"),
    [
        ("in(0) sin out(0)", 3),
        ("in(0,3) sin(3) out(0,3)", 3 + 3 + 1),
        ("in(0,3) in(0,3) add(3) out(0,3)", 3 + 3 + 3 + 1),
        ("in(0) copy(1,8) sum(9) out(0)", 1 + 9 + 4 + 1),
        ("1 2 3 4 5 6 solv(2,2) out(0) pop", 6 + 6 * 2 + 1 + 1),
        ("in(0) if { 1 } else { 2 } out(0)", 1 + 2 + 1 + 1),
    ],
)
def test_work_of_operations_counts_numbers(text, work):
    assert verify(parse("{ " + text + " }"), 3, 3).work == work


def test_work_of_elements():
    inner = calculator("in(0,3) sin(3) out(0,3)")
    (checked,) = verify_element(calculator("in(0,3) calc(0) calc(0) out(0,3)", [inner]))
    assert (checked.executed, checked.work) == (4 + 2 * 3, 3 + 2 * (3 + 7) + 1)
    assert element_work(Clut(np.zeros((2,) * 8 + (3,), np.float32)), []) == 2**8 * (8 + 3)
    assert element_work(matrix(np.eye(3)).elements[0], []) == 12
    curve = SimpleNamespace(signature="clcf", size=1 << 20)
    assert element_work(SimpleNamespace(signature="cvst", curves=[curve], outputs=1), [32]) == 4 + 1 + 64 * 32


def test_one_operation_on_many_numbers_is_many():
    """Each operation reads or makes 65,535 numbers; 2^24 of them would be a million million."""
    element = calculator("in(0) copy(1,65000) sum(65001) out(0)")
    with pytest.raises(LimitError, match=f"operations on more than {MAX_WORK} numbers"):
        verify_element(doubled(12, element))


def test_one_element_in_many_places_is_added_up():
    element = doubled(16)
    with pytest.raises(LimitError, match="operations on more than"):
        link([device_profile("scnr", A2B0=MultiProcess(3, 3, (element,) * 200))])


# Cost ----------------------------------------------------------------------------------------------------


def test_what_would_take_days_is_refused():
    transform = link([scanner(doubled(20))])
    assert transform.cost(1) == transform.cost(1000) > 1000 * 2**23
    # As if there were 200 million pixels.
    pixels = np.broadcast_to(np.float32(0.5), (200_000_000, 3))
    with pytest.raises(LimitError, match=r"200000000 pixels take .* the limit is 1e\+14; .*max_cost"):
        transform(pixels)


def test_honest_work_is_not():
    from iccbrdf.resources import folder

    here = folder("profiles") / "fogra39_gloss"
    transform = link([here / "colour-mid.icc", here / "mvis.icc"])
    assert 300_000 < transform.cost(1000) < 2_000_000
    transform.check_cost(50_000_000_000)


def test_the_limit_is_the_users():
    profile = scanner(calculator(THREE))
    transform = link([profile], max_cost=8000)
    assert transform(np.zeros((2000, 3))).shape == (2000, 3)
    with pytest.raises(LimitError):
        transform(np.zeros((2001, 3)))
    assert link([profile]).max_cost == MAX_COST
    for wrong in (0, -1, np.nan, "much", None):
        with pytest.raises(UsageError, match="max_cost"):
            link([profile], max_cost=wrong)


def test_an_image_is_refused_as_a_whole(run, tmp_path):
    """Though each of its blocks would be within the limit."""
    profile = tmp_path / "a.icc"
    write_profile(scanner(calculator(THREE)), profile)
    image = tmp_path / "a.tif"
    tifffile.imwrite(image, np.zeros((300, 400, 3), np.uint8), photometric="rgb")
    arguments = ["apply", image, "-p", profile, "-o", tmp_path / "b.tif"]
    result = run(*arguments, "--max-cost", "479999")
    assert result.code == 4
    assert "120000 pixels take 4.8e+05 operations" in result.err
    assert not (tmp_path / "b.tif").exists()
    assert run(*arguments, "--max-cost", "480000").code == 0


# Linking -------------------------------------------------------------------------------------------------


def test_samples_of_a_curve_by_a_long_program():
    inner = Calculator(1, 1, (Op("in", 0), *[Op("sin")] * 300, Op("out", 0)))
    curves = CurveSet((SampledCalculatorCurve(1 << 20, 0, 1, 0, inner),))
    with pytest.raises(LimitError, match="1048576 samples of a curve by a program of 302 operations"):
        verify_element(curves)


def test_passes_end():
    """Each round of passes finds one thing to do: x^0 is 1, 1 - 1 is 0, x^0 is 1, ..."""
    step = (Op("in", 0), Op("flip"), Op("pow"), number(1), Op("sub"))
    element = Calculator(1, 1, (number(0), *step * 1500, Op("in", 0), Op("add"), Op("out", 0)))
    graph = Graph(dtype=np.float32)
    graph.outputs = tuple(lift_element(graph, element, [graph.input(0)]))
    _, reports = optimise(graph, EXACT_PASSES)
    assert 10 < len(reports) < 200


def test_lifting_counts_elements_together():
    element = Calculator(1, 1, (*(Op("in", 0), Op("sin"), Op("pop")) * 10_000, Op("in", 0), Op("out", 0)))
    graph = Graph(dtype=np.float32)
    channels = [graph.input(0)]
    channels = lift_element(graph, element, channels)
    once = graph.moves
    assert once > 40_000
    channels = lift_element(graph, element, channels)
    assert graph.moves == 2 * once
    graph.moves = MAX_MOVES - once + 1
    with pytest.raises(UnsupportedError, match="takes too long to make"):
        lift_element(graph, element, channels)


def test_curves_of_many_segments_are_not_compiled_by_llvm():
    pytest.importorskip("llvmlite", reason="llvmlite is not installed")
    points = np.linspace(0, 1, 1001)[1:-1].astype(np.float32).tolist()
    curve = SegmentedCurve(points, tuple(FormulaSegment(0, (1 + i / 999, 1, 0, 0)) for i in range(1000)))
    profile = scanner(CurveSet((curve,) * 3))
    with pytest.raises(UnsupportedError, match="more than 30000 instructions"):
        link([profile], backend="llvm")
    transform = link([profile])
    assert transform.backend == "numpy"
    # In the middle of a segment the curve is x^(1 + i / 999).
    assert transform([0.5005] * 3)[0] == pytest.approx(0.5005 ** (1 + 500 / 999), rel=1e-6)


def test_operations_of_a_tag_have_a_limit():
    inner = Calculator(1, 1, (Op("in", 0), *[Op("noop")] * MAX_OPERATIONS, Op("out", 0)))
    data = scanner(calculator("in(0) calc(0) copy(1,2) out(0,3)", [inner])).to_bytes()
    with pytest.raises(LimitError, match="more operations in one tag than the limit of 262144"):
        Profile.from_bytes(data)["A2B0"]


WORST = {
    "sums": (Op("in", 0), *(o for i in range(9_000) for o in (number(i), Op("add"))), Op("out", 0)),
    "values": (
        *(o for i in range(4_900) for o in (Op("in", 0), number(i), Op("mul"), Op("sin"))),
        Op("sum", 4_898 << 16),
        Op("out", 0),
    ),
    "noops": (*[Op("noop")] * 50_000, Op("in", 0), Op("out", 0)),
}
"""Programs that are as long as graphs may be, and one of many operations."""

# The most memory that the process itself held: what getrusage tells starts at its parent's.
_LINK = """
import sys
from pathlib import Path
import iccbrdf
transform = iccbrdf.link([sys.argv[1]])
transform([[0.5, 0.5, 0.5]])
status = open("/proc/self/status").read()
print(int(status.split("VmHWM:")[1].split()[0]) / 1024)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory is read from /proc")
@pytest.mark.parametrize("name", WORST)
def test_the_worst_that_is_accepted_links_in_little_memory(tmp_path, name):
    inner = Calculator(1, 1, WORST[name])
    outer = calculator("in(0) calc(0) copy(1,2) out(0,3)", [inner])
    write_profile(scanner(outer), tmp_path / "a.icc")
    out = subprocess.run(
        [sys.executable, "-c", _LINK, tmp_path / "a.icc"], capture_output=True, text=True, check=True
    ).stdout
    assert float(out) < 500
