"""The conformance cases: profiles, inputs, run-time variables and outputs of the reference implementation."""

import json
import re
import zipfile

import numpy as np
import pytest
from conftest import SHARED

from iccbrdf.calc import elements
from iccbrdf.calc.interpreter import run
from iccbrdf.calc.program import parse
from iccbrdf.calc.verify import verify, verify_element
from iccbrdf.icc import Profile

ARCHIVE = SHARED / "conformance" / "calculator-cases.zip"
pytestmark = [
    pytest.mark.skipif(not ARCHIVE.exists(), reason=f"no conformance cases at {ARCHIVE}"),
    # The reference tools overstate the size of a calculator's function.
    pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning"),
]

RTOL, ATOL = 2e-5, 2e-6

# Cases that differ on purpose: which pixels, and why.
DIFFERENCES = {
    name: (
        lambda inputs: inputs[:, 1] == 0,
        "a division by zero follows IEEE 754; the version that made these cases answers 0, an earlier one"
        " the IEEE result",
    )
    for name in ("b1_div", "s1_sdiv")
}


def cases():
    if not ARCHIVE.exists():
        return {}
    with zipfile.ZipFile(ARCHIVE) as archive:
        return {case["name"]: case for case in json.loads(archive.read("index.json"))}


CASES = cases()


def pixels(rows):
    """JSON rows as an array; null stands for NaN."""
    return np.array(rows, np.float64)


def check(case, outputs):
    inputs, expected = pixels(case["inputs"]), pixels(case["outputs"])
    found = np.stack([np.broadcast_to(output, len(inputs)) for output in outputs], axis=1)
    meant = np.zeros(len(inputs), bool)
    if case["name"] in DIFFERENCES:
        meant = DIFFERENCES[case["name"]][0](inputs)
        assert not np.allclose(found[meant], expected[meant], equal_nan=True), "no difference any more"
    np.testing.assert_allclose(found[~meant], expected[~meant], rtol=RTOL, atol=ATOL)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", [name for name in CASES if not re.search(r"\w\{", CASES[name]["program"])])
def test_program_text(name, dtype):
    case = CASES[name]
    program = parse(case["program"])
    channels, n_out = pixels(case["inputs"]).T, len(case["outputs"][0])
    verify(program, len(channels), n_out)
    check(case, run(program, list(channels), n_out, env=case["env"], dtype=dtype))


@pytest.mark.parametrize("name", CASES)
def test_profile(name):
    case = CASES[name]
    with zipfile.ZipFile(ARCHIVE) as archive:
        profile = Profile.from_bytes(archive.read(f"{name}.icc"), f"{name}.icc")
    channels = list(pixels(case["inputs"]).T)
    for element in profile["A2M0"].elements:
        verify_element(element)
        channels = elements.apply(element, channels, env=case["env"])
    check(case, channels)


def test_all_cases_are_there():
    assert len(CASES) == 92
    assert set(DIFFERENCES) <= set(CASES)
