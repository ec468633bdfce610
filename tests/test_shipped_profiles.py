"""The profiles that lie in profiles/ are what the build makes of the primaries beside them."""

from __future__ import annotations

import make_profiles
import pytest
from conftest import ROOT

from iccbrdf.brdf.models import MODELS as SCIENCE
from iccbrdf.brdf.primaries import ILLUMINANTS, OBSERVERS
from iccbrdf.build import MODELS, viewing

EXAMPLES = sorted(ROOT.glob("profiles/*/primaries.json"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.parent.name)
def test_rebuilt_byte_for_byte(path):
    made = make_profiles.files(path)
    assert {"mid.icc", "mvis.icc", "mvis.txt"} <= set(made)
    for name, data in made.items():
        assert (path.parent / name).read_bytes() == data, f"{name}: run `make profiles`"
    assert {p.name for p in path.parent.iterdir()} - set(made) <= {"primaries.json", "slopes.json"}


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
