"""Patches in a list of geometries, measured and as models have them, and the differences between those."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iccbrdf.brdf.colour_difference import XYZ_to_Lab, delta_E_CIE2000
from iccbrdf.brdf.fit_diagnostics import REGIONS, regions
from iccbrdf.brdf.geometry import Array, planar
from iccbrdf.brdf.models import evaluate, find_model
from iccbrdf.measure import Measurements

MEASURED = "measured"
_SPECULAR = REGIONS.index("specular")


@dataclass(frozen=True, eq=False)
class Appearance:
    """XYZ of patches from several sources, one of them `MEASURED`, NaN where not measured."""

    measurements: Measurements
    computed: dict[str, Array]
    """XYZ of models by name, each (patches, geometries, 3)."""

    def select(self, patches: list[int]) -> Appearance:
        """Return some of the patches."""
        computed = {source: XYZ[patches] for source, XYZ in self.computed.items()}
        return Appearance(self.measurements.select(patches), computed)

    @property
    def region(self) -> NDArray[np.intp]:
        """Index in `REGIONS` of each geometry, (geometries,)."""
        return regions(self.measurements.light, self.measurements.view)

    def XYZ(self, source: str) -> Array:
        """Return XYZ (patches, geometries, 3) of a model, or those measured."""
        return self.measurements.XYZ if source == MEASURED else self.computed[source]

    def differences(self, source: str, reference: str = MEASURED) -> Array:
        """Return CIEDE2000 between two sources, NaN where not measured, (patches, geometries)."""
        white = self.measurements.white
        missing = np.asarray(np.isnan(self.measurements.XYZ).any(axis=-1))
        colours = (np.where(missing[..., np.newaxis], white, self.XYZ(name)) for name in (source, reference))
        return np.where(missing, np.nan, delta_E_CIE2000(*(XYZ_to_Lab(XYZ, white) for XYZ in colours)))

    def by_region(self, source: str, reference: str = MEASURED) -> tuple[Array, Array]:
        """Return the mean and the largest CIEDE2000 of all readings in each of `REGIONS`, (3,) each."""
        differences = self.differences(source, reference)
        inside = [differences[:, self.region == region] for region in range(len(REGIONS))]
        return np.array([mean(values) for values in inside]), np.array([largest(values) for values in inside])

    @property
    def mirror_angles(self) -> Array:
        """The angles of incidence in degrees at which the mirror direction was measured, ascending."""
        return np.unique(self.measurements.theta_i[self.region == _SPECULAR])

    def specular_errors(self, source: str, reference: str = MEASURED) -> Array:
        """Return the differences of Y in the mirror directions, (patches, mirror angles)."""
        difference = self.XYZ(source)[..., 1] - self.XYZ(reference)[..., 1]
        at_mirror = self.region == _SPECULAR
        theta_i = self.measurements.theta_i
        return np.stack(
            [
                difference[:, np.flatnonzero(at_mirror & (theta_i == angle))[0]]
                for angle in self.mirror_angles
            ],
            axis=-1,
        )

    def chromaticity(self, source: str, region: str) -> Array:
        """Return the mean x, y of each patch over the readings in a region, (patches, 2)."""
        XYZ = self.XYZ(source)[:, self.region == REGIONS.index(region)]
        xy = XYZ[..., :2] / XYZ.sum(axis=-1, keepdims=True)
        return np.array([[mean(patch[:, 0]), mean(patch[:, 1])] for patch in xy])


def predict(model: str, parameters: Array, measurements: Measurements, *, as_published: bool) -> Array:
    """
    Return what a model gives in the geometries of measurements.

    Parameters
    ----------
    model, parameters
        Key of `MODELS` and its channels, (patches, k).
    measurements
        Their directions to light and viewer are used.
    as_published
        I, its cos theta_i included; otherwise pi times the BRDF.

    Returns
    -------
    XYZ, (patches, geometries, 3).
    """
    intensity = np.full((len(measurements.theta_i), 1), find_model(model).intensity)
    if not as_published:
        intensity /= measurements.light[:, 2:]
    up, light, view = planar(0), measurements.light, measurements.view
    return evaluate(model, parameters[:, np.newaxis], up, light, view, intensity=intensity)


def rms(values: Array) -> float:
    """Return the root mean square of the finite values, NaN where there are none."""
    return float(np.sqrt(mean(values**2)))


def mean(values: Array) -> float:
    """Return the mean of the finite values, NaN where there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else np.nan


def largest(values: Array) -> float:
    """Return the largest finite value, NaN where there is none."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else np.nan
