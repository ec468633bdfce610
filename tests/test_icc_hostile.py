"""Files that were made to break readers: nothing but the documented errors leaves, and soon."""

import numpy as np
import pytest
from icc_examples import a_mid, an_mvis, conformance_profiles

from iccbrdf.errors import LimitError, ProfileError, UnsupportedError
from iccbrdf.icc import Calculator, Header, MultiProcess, Profile, TagArray, Utf8, describe

# The reference tools overstate the size of a calculator's function.
pytestmark = pytest.mark.filterwarnings("ignore::iccbrdf.ProfileWarning")


def nested(depth):
    tag = Utf8("a")
    for _ in range(depth):
        tag = TagArray("tary", (tag,))
    return Profile(Header(device_class="mid "), {"deep": tag}).to_bytes()


def test_nesting_has_a_limit():
    assert Profile.from_bytes(nested(32))["deep"].signature == "tary"
    with pytest.raises(LimitError, match="nested deeper than the limit of 32"):
        Profile.from_bytes(nested(33))["deep"]


def test_nested_calculators_have_a_limit():
    element = Calculator(1, 1, ())
    for _ in range(32):
        element = Calculator(1, 1, (), (element,))
    data = Profile(Header(device_class="mid "), {"A2M0": MultiProcess.of(element)}).to_bytes()
    with pytest.raises(LimitError, match="nested deeper"):
        Profile.from_bytes(data)["A2M0"]


def test_shared_parts_of_shared_parts_have_a_limit():
    """A thousand bytes a level would stand for a hundred times as many objects as the level below."""
    tag = Utf8("a")
    for _ in range(6):
        tag = TagArray("tary", (tag,) * 100)
    data = Profile(Header(device_class="mid "), {"deep": tag}).to_bytes()
    assert len(data) < 10_000
    with pytest.raises(LimitError, match="more parts in one tag than the limit of 65536"):
        Profile.from_bytes(data)["deep"]


def mutations(data, count, seed):
    """Copies of `data` with some bytes set, words set to telling values, or ends cut off."""
    random = np.random.default_rng(seed)
    words = [0, 1, 2, 8, 12, 16, 128, 0x7F, 0xFF, 0x100, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF]
    for _ in range(count):
        changed = bytearray(data)
        for _ in range(random.integers(1, 4)):
            kind, at = random.integers(0, 4), int(random.integers(0, len(data)))
            if kind == 0:
                changed[at] = random.integers(0, 256)
            elif kind == 1:
                at -= at % 4
                changed[at : at + 4] = words[random.integers(0, len(words))].to_bytes(4, "big")
            elif kind == 2:
                source = int(random.integers(0, len(data) - 4))
                changed[at : at + 4] = data[source : source + 4]
            else:
                at = 128 + at % (len(data) - 128)
                changed[at : at + 2] = words[random.integers(0, 11)].to_bytes(2, "big")
        if random.integers(0, 8) == 0:
            del changed[int(random.integers(0, len(changed))) :]
        yield bytes(changed)


ALLOWED = (ProfileError, LimitError, UnsupportedError)


def use(data):
    """Read everything and write it back; how many tags could be decoded."""
    try:
        profile = Profile.from_bytes(data)
    except ALLOWED:
        return 0
    assert profile.to_bytes() == data
    decoded = 0
    for signature in profile:
        try:
            value = profile[signature]
        except ALLOWED:
            continue
        decoded += 1
        # What was read, our writer stores so that it reads back as the same.
        again = Profile(Header(device_class="spac"), {signature: value}) if signature.isascii() else profile
        assert Profile.from_bytes(again.to_bytes())[signature] == value
    profile.replace(remove=["desc"]).to_bytes()
    describe(profile)
    return decoded


@pytest.mark.parametrize("make", [a_mid, an_mvis])
def test_mutated_profiles(make):
    assert sum(use(data) for data in mutations(make().to_bytes(), 600, seed=1)) > 500


def test_mutated_profiles_of_the_reference_tools():
    for index, (_, data) in enumerate(conformance_profiles()):
        for changed in mutations(data, 8, seed=index):
            use(changed)
