"""What a goniometer has measured of a set of patches."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iccbrdf.brdf.geometry import Array, direction
from iccbrdf.errors import UsageError

_IN_PLANE = np.sin(np.radians(0.01))
"""A viewer that stands less than this out of the plane of incidence, a hundredth of a degree, is in it."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """
    Reflectance of patches in a list of geometries; what was not measured is not a number (NaN).

    Angles follow the papers: `theta_r` is signed, positive on the lamp's side, so that the mirror direction
    is `theta_r = -theta_i` and the viewer that looks along the light `theta_r = theta_i`.  Away from the
    plane of incidence, `phi` is the azimuth by which the viewer's plane is turned from it, counter-clockwise
    seen from above, more than -90 up to 90: in the plane it is 0, and the sign of `theta_r` alone says which
    side the viewer stands on.  All angles are to the surface's own normal, on a slope too.

    Raises
    ------
    UsageError
        Arrays whose shapes do not go together, or a patch (name and slope) that stands twice or
        has a name with blanks around it, which no text table would bring back.
    """

    patches: tuple[str, ...]
    """Names; a name may stand once for each slope."""
    theta_i: Array
    """Angle of incidence in degrees, 0 <= theta_i < 90, shape (geometries,)."""
    theta_r: Array
    """Angle of the viewer in degrees, -90 < theta_r < 90, shape (geometries,)."""
    phi: Array
    """Azimuth of the viewer in degrees, -90 < phi <= 90, shape (geometries,)."""
    XYZ: Array
    """Pi times the BRDF, weighted to XYZ, Y = 1 for the perfect diffuser; (patches, geometries, 3)."""
    illuminant: str
    observer: str
    white: tuple[float, ...]
    """XYZ of the perfect diffuser, Y = 1."""
    source: str
    cmyk: Array | None = None
    """Inks in per cent, (patches, 4)."""
    slopes: Array | None = None
    """Slope of each patch in degrees, 0 for flat, (patches,)."""
    wavelengths: Array | None = None
    """In nm, ascending, (wavelengths,)."""
    spectra: Array | None = None
    """Pi times the BRDF, (patches, geometries, wavelengths)."""
    notes: tuple[str, ...] = ()
    """What the reader left out, averaged or computed."""

    def __post_init__(self) -> None:
        p, g = len(self.patches), len(self.theta_i)
        w = 0 if self.wavelengths is None else len(self.wavelengths)
        for name, array, shape in (
            ("theta_i", self.theta_i, (g,)),
            ("theta_r", self.theta_r, (g,)),
            ("phi", self.phi, (g,)),
            ("XYZ", self.XYZ, (p, g, 3)),
            ("cmyk", self.cmyk, (p, 4)),
            ("slopes", self.slopes, (p,)),
            ("spectra", self.spectra, (p, g, w)),
        ):
            if array is not None and array.shape != shape:
                raise UsageError(f"{name} has the shape {array.shape}, expected {shape}")
        keys = set()
        for name, slope in self.keys:
            if not name or name != " ".join(name.split()):
                raise UsageError(f"the patch {name!r} has a name that is empty or has blanks to spare")
            if (name, slope) in keys:
                raise UsageError(f"the patch {name!r} on the slope {slope:g} stands twice, expected once")
            keys.add((name, slope))

    @property
    def keys(self) -> list[tuple[str, float]]:
        """Name and slope of each patch; what has no slope is flat."""
        slopes = [0.0] * len(self.patches) if self.slopes is None else self.slopes.tolist()
        return list(zip(self.patches, slopes, strict=True))

    @property
    def light(self) -> Array:
        """Unit vectors to the lamp, which stands on the left, (geometries, 3): `planar(-theta_i)`."""
        return direction(self.theta_i, 180)

    @property
    def view(self) -> Array:
        """Unit vectors to the viewer, (geometries, 3): `planar(-theta_r)` in the plane of incidence."""
        return direction(self.theta_r, 180 + self.phi)

    @property
    def in_plane(self) -> NDArray[np.bool_]:
        """Where light, normal and viewer lie in one plane, (geometries,)."""
        inside: NDArray[np.bool_] = (np.abs(self.view[:, 1]) < _IN_PLANE) | (self.theta_i == 0)
        return inside

    def select(self, patches: ArrayLike | None = None, geometries: ArrayLike | None = None) -> Measurements:
        """
        Return some of the patches in some of the geometries.

        Parameters
        ----------
        patches, geometries
            Masks or indices along the two axes; all by default.

        Examples
        --------
        >>> flat = measurements.select(patches=measurements.slopes == 0)      # doctest: +SKIP
        """
        p = np.arange(len(self.patches))[... if patches is None else np.asarray(patches)]
        g = np.arange(len(self.theta_i))[... if geometries is None else np.asarray(geometries)]
        return replace(
            self,
            patches=tuple(self.patches[k] for k in p),
            theta_i=self.theta_i[g],
            theta_r=self.theta_r[g],
            phi=self.phi[g],
            XYZ=self.XYZ[np.ix_(p, g)],
            cmyk=None if self.cmyk is None else self.cmyk[p],
            slopes=None if self.slopes is None else self.slopes[p],
            spectra=None if self.spectra is None else self.spectra[np.ix_(p, g)],
        )


def canonical(theta_r: Array, phi: Array) -> tuple[Array, Array]:
    """
    Return angles (...) in degrees with -90 < phi <= 90, so that phi is 0 in the plane of incidence.

    A viewer at the azimuth 180 stands on the other side: theta_r changes its sign and phi becomes 0.

    Examples
    --------
    >>> canonical(np.array([30.0, 30.0]), np.array([0.0, 180.0]))
    (array([ 30., -30.]), array([0., 0.]))
    """
    turn = np.where((phi > -180) & (phi <= 180), phi, 180 - (180 - phi) % 360)
    behind = (turn > 90) | (turn <= -90)
    # A sum with +0 turns -0 into 0.
    return np.where(behind, -theta_r, theta_r) + 0.0, turn - np.where(behind, 180 * np.sign(turn), 0.0) + 0.0


def report(measurements: Measurements) -> dict[str, Any]:
    """Return what was read, ready for JSON: counts, ranges, viewing conditions and the reader's notes."""
    measured = np.isfinite(measurements.XYZ).all(axis=-1)
    Y = measurements.XYZ[..., 1]
    return {
        "patches": list(measurements.patches),
        "slopes": None if measurements.slopes is None else np.unique(measurements.slopes).tolist(),
        "geometries": len(measurements.theta_i),
        "in_plane": int(measurements.in_plane.sum()),
        "theta_i": np.unique(measurements.theta_i.round(3)).tolist(),
        "theta_r": _range(measurements.theta_r),
        "phi": _range(measurements.phi),
        "measured": int(measured.sum()),
        "missing": int(measured.size - measured.sum()),
        "Y": _range(Y[np.isfinite(Y)]),
        "wavelengths": None if measurements.wavelengths is None else _range(measurements.wavelengths),
        "illuminant": measurements.illuminant,
        "observer": measurements.observer,
        "source": measurements.source,
        "notes": list(measurements.notes),
    }


def report_text(measurements: Measurements) -> str:
    """Return the report as lines for people."""
    found = report(measurements)
    slopes, wavelengths = found["slopes"], found["wavelengths"]
    lines = [
        f"patches      {len(found['patches'])}: {_some(found['patches'])}",
        *([f"slopes       {_numbers(slopes)} degrees"] if slopes else []),
        f"geometries   {found['geometries']}, {found['in_plane']} in the plane of incidence",
        f"  theta_i    {_numbers(found['theta_i'])} degrees",
        f"  theta_r    {_span(found['theta_r'])} degrees, phi {_span(found['phi'])}",
        f"readings     {found['measured']}, {found['missing']} missing; Y {_span(found['Y'])}",
        *([f"wavelengths  {_span(wavelengths)} nm"] if wavelengths else []),
        f"conditions   {found['illuminant']}, {found['observer']}",
        f"source       {found['source']}",
        *(f"note         {note}" for note in found["notes"]),
    ]
    return "\n".join(lines)


def _range(values: Array) -> list[float] | None:
    return [float(values.min()), float(values.max())] if values.size else None


def _span(limits: list[float] | None) -> str:
    return "none" if limits is None else f"{limits[0]:.5g} to {limits[1]:.5g}"


def _numbers(values: list[float]) -> str:
    return _some([f"{value:g}" for value in values])


def _some(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 12 else ", ".join(names[:11]) + ", ..."
