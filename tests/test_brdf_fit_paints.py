"""Two paints that were really measured: the Cornell Program of Computer Graphics' gonioreflectometer."""

import numpy as np
import pytest

from iccbrdf.brdf.fit import fit
from iccbrdf.brdf.fit_problem import Problem
from iccbrdf.brdf.models import MODELS
from iccbrdf.measure import read_measurements

PAINTS = ("garnet_red", "krylon_blue")
MODELS_COMPARED = ("ward", "cook_torrance_2020", "brdf1")


@pytest.fixture(scope="module")
def fits(shared_data):
    """By paint and model: the result and CIEDE2000 and log10 ratio of Y at each geometry."""
    found = {}
    for paint in PAINTS:
        data = read_measurements(shared_data / "paint" / f"{paint}.brdf")
        data = data.select(geometries=np.maximum(data.theta_i, np.abs(data.theta_r)) <= 70 + 1e-6)
        for model in MODELS_COMPARED:
            result = fit(data.XYZ, data.light, data.view, data.white, model=model)
            white = np.array(data.white)
            problem = Problem(
                MODELS[model], data.XYZ, data.light, data.view, white, "rms CIEDE2000", 1.5, False
            )
            fitted = problem.predict(result.parameters)
            difference = problem.colour_differences(problem.XYZ, fitted)[0]
            found[paint, model] = result, difference, np.log10(data.XYZ[0, :, 1] / fitted[0, :, 1])
    return found


@pytest.mark.parametrize("paint", PAINTS)
def test_luminance_fits(fits, paint):
    result, difference, ratio = fits[paint, "brdf1"]
    assert len(difference) == 1001
    assert np.median(np.abs(ratio)) <= 0.09
    assert result.agreement == 1


@pytest.mark.parametrize("model", ["brdf1", "cook_torrance_2020"])
@pytest.mark.parametrize("paint", PAINTS)
def test_cook_torrance_is_better_than_ward(fits, paint, model):
    cook_torrance, ward = fits[paint, model][1], fits[paint, "ward"][1]
    assert cook_torrance.mean() < ward.mean()
    assert np.quantile(cook_torrance, 0.9) < np.quantile(ward, 0.9)


@pytest.mark.parametrize("paint", PAINTS)
def test_not_flagged(fits, paint):
    result = fits[paint, "brdf1"][0]
    assert result.flags == ((),)
    untested = [found.check.name for found in result.findings[0] if found.value is None]
    assert untested == ["retro-reflection"]
