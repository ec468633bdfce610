"""A short run of all fuzz targets, the same each time, and what hypothesis makes of the formats' structure.

`make fuzz` runs for minutes and follows what it covers.
"""

import json
import random
from importlib.util import find_spec

import pytest
from fuzz.mutations import mutated
from fuzz.report import markdown
from fuzz.targets import OF_FILES, TARGETS, quietly
from fuzz.watch import TooSlow, Watch, time_limit

from iccbrdf.calc.operators import OPERATORS

pytest.importorskip("hypothesis", reason="hypothesis is not installed: pip install 'iccbrdf[dev]'")

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

INPUTS = {
    "profile": 8, "program": 80, "xml": 100, "template": 12, "source": 12, "packed": 200, "page": 24,
    "display": 60, "arguments": 60, "primaries": 40, "slopes": 30, "table": 120, "fit": 16, "tiff": 80,
    "print": 60, "picture": 80, "exr": 150, "job": 250, "log": 200,
}  # fmt: skip
"""How many of each kind, so that all together take seconds."""

briefly = settings(
    max_examples=30,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


HERE = [
    pytest.param(
        name, marks=pytest.mark.skipif(name == "exr" and not find_spec("OpenEXR"), reason="no OpenEXR")
    )
    for name in TARGETS
]


@pytest.mark.parametrize("name", HERE)
def test_seeds_are_sound(name):
    """But for one: no profile links that holds a tag of every type."""
    target = TARGETS[name]
    taken = [quietly(target, data) for data in target.seeds()]
    assert taken.count(False) == (name == "profile")


@pytest.mark.parametrize("name", HERE)
def test_mutations_end_in_the_documented_errors(name, tmp_path):
    target, draw = TARGETS[name], random.Random(4)
    pool = target.seeds()
    watch = Watch(name, target, tmp_path)
    for _ in range(INPUTS[name]):
        watch.run(mutated(draw.choice(pool), target.words, draw))
    assert watch.findings == {}
    # Mutations that are all refused, or all taken, would try little.
    assert 0 < watch.taken < watch.tried


# Structure -----------------------------------------------------------------------------------------------


@st.composite
def operations(draw):
    """Operations that exist, with operands that may be right."""
    name = draw(st.sampled_from(sorted(OPERATORS)))
    few = st.integers(0, 4)
    operand = draw(
        st.one_of(
            few.map(lambda n: n << 16),
            st.tuples(few, few).map(lambda pair: pair[0] << 16 | pair[1]),
            few,
            st.sampled_from([0x3F800000, 0xBF000000, 0x7F800000, 0x7FC00000, 0x6C697458, 0x74727565]),
            st.integers(0, 2**32 - 1),
        )
    )
    return name.encode().ljust(4) + operand.to_bytes(4, "big")


@briefly
@given(st.lists(operations(), min_size=1, max_size=40))
def test_programs_of_any_operators(parts):
    # Values enough for most operators to find what they take.
    start = b"".join(b"in  " + (2).to_bytes(4, "big") for _ in range(6))
    quietly(TARGETS["program"], start + b"".join(parts))


json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(["brdf1", "ward", "reflectance", "D50"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=8,
)


def replaced(value, path, new):
    """A copy of JSON with what is at `path` replaced."""
    if not path:
        return new
    step, *rest = path
    items = value.items() if isinstance(value, dict) else enumerate(value)
    changed = {key: replaced(item, rest, new) if key == step else item for key, item in items}
    return changed if isinstance(value, dict) else list(changed.values())


def paths(value, path=()):
    """The way to every part of JSON."""
    yield path
    if isinstance(value, (dict, list)):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from paths(item, (*path, key))


@pytest.mark.parametrize("name", ["primaries", "slopes", "log"])
def test_json_with_anything_anywhere(name):
    documents = [json.loads(data) for data in TARGETS[name].seeds()]

    @briefly
    @given(st.data())
    def check(data):
        document = data.draw(st.sampled_from(documents))
        path = data.draw(st.sampled_from(list(paths(document))))
        text = json.dumps(replaced(document, list(path), data.draw(json_values)))
        quietly(TARGETS[name], text.encode())

    check()


@pytest.mark.parametrize("name", ["program", "xml", "table", "tiff", "job"])
def test_bytes_of_any_kind(name):
    @briefly
    @given(st.binary(max_size=200))
    def check(data):
        quietly(TARGETS[name], data)

    check()


# The watch -----------------------------------------------------------------------------------------------


class _Wrong:
    words = ()

    def __init__(self, run):
        self.run = run


def test_findings_are_told_once_and_kept(tmp_path):
    def fails(data):
        if data == b"bad":
            raise KeyError("x")
        raise OF_FILES[0]("as documented, but not caught")

    watch = Watch("wrong", _Wrong(fails), tmp_path)
    for data in (b"bad", b"bad", b"good"):
        watch.run(data)
    first, second = watch.findings.values()
    assert (first["times"], second["times"]) == (2, 1)
    assert (tmp_path / first["input"]).read_bytes() == b"bad"
    assert watch.counts()["inputs"] == 3


def test_what_is_too_slow_is_stopped():
    def endless():
        while True:
            pass

    with pytest.raises(TooSlow), time_limit(0.05):
        endless()


def test_a_report_adds_up():
    found = {"KeyError at iccbrdf/a.py:7": {"error": "KeyError('x')", "times": 3}}
    counts = {"inputs": 1000, "taken": 20, "seconds": 60.0, "worst_seconds": 0.5, "worst_memory_mib": 7}
    text = markdown({
        "xml (mutation)": {**counts, "findings": {}},
        "xml (atheris)": {**counts, "worst_seconds": 2.25, "findings": found},
    })  # fmt: skip
    assert "2,000 inputs in 2 minutes" in text
    assert "worst took 2.2 s" in text
    assert "Findings: 1." in text
    assert "| xml (atheris) | 1000 | 20 | 60.0 | 2.25 | 7 | 1 |" in text
    assert "- `xml (atheris): KeyError at iccbrdf/a.py:7`, 3 times: KeyError('x')" in text
    assert text.count("**xml**") == 1


def test_mutations_repeat():
    data, words = bytes(range(100)), (b"word",)
    one, other = random.Random(3), random.Random(3)
    first = [mutated(data, words, one) for _ in range(50)]
    assert first == [mutated(data, words, other) for _ in range(50)]
    assert len(set(first)) > 40
