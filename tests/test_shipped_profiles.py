"""The profiles that lie in profiles/ are what the build makes of the primaries beside them."""

from __future__ import annotations

import make_profiles
import numpy as np
import pytest
from conftest import ROOT, comparable

import iccbrdf
from iccbrdf.brdf.models import MODELS as SCIENCE
from iccbrdf.brdf.primaries import ILLUMINANTS, OBSERVERS
from iccbrdf.build import MODELS, viewing
from iccbrdf.icc import Profile

EXAMPLES = sorted(ROOT.glob("profiles/*/primaries.json"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.parent.name)
def test_rebuilt_byte_for_byte(path):
    made = make_profiles.files(path)
    assert {"mid.icc", "mvis.icc", "mvis.txt"} <= set(made)
    for name, data in made.items():
        if not name.startswith("table"):
            shipped = (path.parent / name).read_bytes()
            assert comparable(shipped) == comparable(data), f"{name}: run `make profiles`"
    assert {p.name for p in path.parent.iterdir()} - set(made) <= {"primaries.json", "slopes.json"}


@pytest.mark.parametrize("name", ["table-mid.icc", "table-v4.icc"])
def test_tables_rebuilt(name):
    """Their numbers come out of a maths library's logarithms: to 1e-6, 16-bit ones to a step."""
    folder = ROOT / "profiles" / "fogra39_gloss"
    shipped = iccbrdf.read_profile(folder / name)
    made = Profile.from_bytes(make_profiles.files(folder / "primaries.json")[name])
    assert list(shipped) == list(made)
    clut = {
        "table-mid.icc": lambda p: p["A2M0"].elements[1].elements[2].table,
        "table-v4.icc": lambda p: p["B2D0"].elements[-2].table,
    }[name]
    assert np.abs(clut(shipped) - clut(made)).max() < 1e-6
    if name == "table-v4.icc":
        assert np.abs(shipped["B2A0"].clut.table - made["B2A0"].clut.table).max() < 1.1 / 65535


def test_all_examples_are_there():
    assert {path.parent.name for path in EXAMPLES} == {"fogra39_gloss", "landscape", "ward_painting"}


def test_every_model_of_the_science_can_be_built():
    assert set(MODELS) == set(SCIENCE)
    assert {name for name, model in MODELS.items() if model.has_refractive_index} == {
        name for name, model in SCIENCE.items() if model.has_fresnel
    }


def test_all_conditions_of_primaries_can_be_stated():
    assert set(viewing.ILLUMINANTS) == set(ILLUMINANTS)
    assert set(viewing.OBSERVERS) == set(OBSERVERS)
