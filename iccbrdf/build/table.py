"""The map from XYZ to parameters as tables, for systems that run no calculator and where speed is all.

Two profiles hold it.  A version 4 output profile, which any ICC CMM reads: from its connection space to
device channels that are the parameters in the encoding of the binding MID; in 16 bits (B2A) and, as these
are coarse, in floating point (B2D).  And a version 5 MID whose calculator looks up gloss and the offset
kd - XYZ.

The axes of all tables are cube roots of X, Y, Z as in `smooth_interpolation`, from 0 to `HEADROOM` times the
perfect diffuser; colours beyond are held there.  Gloss is interpolated in its logarithm or near it, and kd
in its cube root where there is no calculator to add the offset.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from iccbrdf.brdf.geometry import Array
from iccbrdf.brdf.interpolation import InterpolationMethod, interpolate
from iccbrdf.brdf.models import NORMAL, find_model
from iccbrdf.brdf.primaries import Primaries
from iccbrdf.brdf.slopes import Slopes
from iccbrdf.brdf.smooth_interpolation import DIFFUSE, GLOSS, GLOSS_FLOOR, KNEE
from iccbrdf.build.models import MODELS
from iccbrdf.build.power import Power, cube, near_exponential, quantised, root
from iccbrdf.build.private_tags import IMAGE_TAG, SLOPES_TAG, image_encoding
from iccbrdf.build.profiles import COPYRIGHT, decoding, ranges, text_tags
from iccbrdf.build.slope_adjustment import check_slopes, slope_adjustment
from iccbrdf.build.table_error import TableError, measure
from iccbrdf.build.viewing import viewing
from iccbrdf.calc.elements import apply
from iccbrdf.calc.program import parse
from iccbrdf.errors import UsageError
from iccbrdf.icc import (
    D50,
    XYZ,
    Calculator,
    Clut,
    ColorantTable,
    Curve,
    CurveSet,
    ExtendedClut,
    FormulaSegment,
    Header,
    LutAToB,
    LutBToA,
    Matrix,
    Mluc,
    MultiProcess,
    NumberArray,
    Profile,
    SegmentedCurve,
)

GRIDS = (9, 17, 33, 65)
"""Points an axis."""

HEADROOM = 1.1
"""Where the axes end, in units of the perfect diffuser; papers with optical brighteners come close to 1."""

_PCS_RANGE = 65535 / 32768
"""XYZ that the largest 16-bit value of the connection space stands for."""

_IDENTITY = Curve()


@dataclass(frozen=True)
class Tables:
    """Both profiles of one map and grid, and how far they are from the map."""

    profile: Profile
    mid: Profile
    errors: tuple[TableError, ...]

    @property
    def report(self) -> str:
        """For people."""
        return "\n\n".join(map(str, self.errors)) + "\n"

    @property
    def files(self) -> dict[str, bytes]:
        """What is written to a folder, by file name."""
        return {
            "table-v4.icc": self.profile.to_bytes(),
            "table-mid.icc": self.mid.to_bytes(),
            "tables.txt": self.report.encode(),
        }


def build_tables(
    primaries: Primaries,
    *,
    method: InterpolationMethod = "smooth",
    grid: int = 33,
    slopes: Slopes | None = None,
    slope_method: str = "affine",
) -> Tables:
    """Build `build_table_profile` and `build_table_mid`, which see."""
    profile, profile_error = build_table_profile(primaries, method=method, grid=grid)
    mid, mid_error = build_table_mid(
        primaries, method=method, grid=grid, slopes=slopes, slope_method=slope_method
    )
    return Tables(profile, mid, (profile_error, mid_error))


@dataclass(frozen=True)
class _Nodes:
    """The exact map at the nodes of a table."""

    axis: Power
    scale: Array
    """Factors that take X, Y, Z to the axis's 0..1, shape (3,)."""
    XYZ: Array
    """Shape (grid, grid, grid, 3)."""
    parameters: Array
    """Shape (grid, grid, grid, k); gloss not below `GLOSS_FLOOR`, for it is about to be a logarithm."""


def build_table_mid(
    primaries: Primaries,
    *,
    method: InterpolationMethod = "smooth",
    grid: int = 33,
    slopes: Slopes | None = None,
    slope_method: str = "affine",
) -> tuple[Profile, TableError]:
    """Build the MID that looks the parameters up, and measure it on the flat print.

    Its device channels are X, Y, Z, n.x, n.y, n.z, encoded as those of the colour MID; kd follows XYZ beyond
    the end of the table too.

    Parameters
    ----------
    primaries
        4 to 16 nodes with their XYZ and parameters.
    method
        `smooth` or `published`; the latter jumps, and no table comes near to it everywhere.
    grid
        One of `GRIDS`.
    slopes, slope_method
        As of `build_colour_mid`: a program adjusts XYZ to the slope before it is looked up.

    Raises
    ------
    InputError
        Nodes too few, too many or too close; slopes measured under other conditions than the primaries.
    UsageError
        An unknown method or grid.
    """
    if slopes is not None:
        check_slopes(primaries, slopes)
    nodes = _nodes(primaries, method, grid)
    names = find_model(primaries.model).channels
    k = len(names)
    offset = nodes.parameters[..., DIFFUSE] - nodes.XYZ
    table = np.concatenate([offset, np.log(nodes.parameters[..., GLOSS])], axis=-1)
    program = parse(
        f"{{ in(0,3) mtx(0) curv(1) clut(2) exp({k - 3}) out(3,{k - 3})"
        f" in(0,3) add(3) 0 0 0 vmax(3) out(0,3) in(3,3) out({k},3) }}"
    )
    elements = (Matrix.of(np.diag(nodes.scale)), CurveSet((nodes.axis.clipped,) * 3), Clut(table))
    calculator = Calculator(6, k + 3, program, elements)
    adjustment = [] if slopes is None else [slope_adjustment(slopes, slope_method)]
    channels_in, channels_out = (*"XYZ", *NORMAL), (*names, *NORMAL)
    profile = Profile(
        Header(device_class="mid ", colour_space="nc0006", mcs=f"mc{k + 3:04x}"),
        {
            **text_tags(f"Colour MID for {_title(primaries, method, grid)}", channels_out),
            "clrt": ColorantTable.of(channels_in),
            IMAGE_TAG: image_encoding(channels_out, primaries),
            **({} if slopes is None else {SLOPES_TAG: NumberArray("fl32", slopes.angles)}),
            "A2M0": MultiProcess.of(
                decoding(channels_in, ranges(channels_in, {}), channels_in), *adjustment, calculator
            ),
        },
    )

    def looked_up(XYZ: Array) -> Array:
        return np.stack(apply(calculator, [*XYZ.T, 0, 0, 1])[:k], axis=-1)

    return profile, measure(primaries, method, grid, {"A2M0": looked_up})


def build_table_profile(
    primaries: Primaries, *, method: InterpolationMethod = "smooth", grid: int = 33
) -> tuple[Profile, TableError]:
    """Build the version 4 output profile, and measure it.

    Its device channels are the model's parameters, 0..1 by the primaries' encoding; colours that exceed it
    are out of gamut (gamt) and clipped.  Backwards (A2B), a colour is its kd.

    All intents hold the same map, for the media white is stated to be the perfect diffuser.  Take a
    colorimetric one: to the perceptual and the saturation intent of version 4 profiles, CMMs add a black
    point compensation.  Little CMS, in 16 bits, needs cmsFLAGS_NOOPTIMIZE: it would replace all by a table
    of its own with linear axes.

    Parameters and errors are those of `build_table_mid`.
    """
    nodes = _nodes(primaries, method, grid)
    names = find_model(primaries.model).channels
    conditions = viewing(primaries.illuminant, primaries.observer, primaries.white)
    to_d50 = _matrix(conditions.to_standard())
    to_axes = nodes.scale[:, np.newaxis] * _matrix(conditions.from_standard())
    device = nodes.parameters / primaries.scales
    codings = _codings(device, primaries)
    look_up = _LookUp.of(nodes.axis, to_axes, device, codings)
    processes = _processes(nodes.axis, to_axes, device, codings)
    backwards = _backwards(to_d50 * primaries.scales[DIFFUSE], len(names))
    tags: dict[str, Any] = {
        "desc": Mluc.of(_title(primaries, method, grid)),
        "cprt": Mluc.of(COPYRIGHT),
        "wtpt": XYZ.of(*D50),
        "clrt": ColorantTable.of(names),
        **dict.fromkeys(("A2B0", "A2B1", "A2B2"), backwards),
        **dict.fromkeys(("B2A0", "B2A1", "B2A2"), look_up.tag),
        **dict.fromkeys(("B2D0", "B2D1", "B2D2", "B2D3"), processes),
        "gamt": look_up.gamut(np.where(np.any(device > 1, axis=-1), 1.0, 0.0)),
    }
    if conditions.svcn is not None:
        tags["chad"] = NumberArray("sf32", to_d50.reshape(-1))
    header = Header(device_class="prtr", version=(4, 4, 0), colour_space=f"{len(names):X}CLR", pcs="XYZ ")

    def in_16_bits(XYZ: Array) -> Array:
        return look_up(XYZ @ to_d50.T / _PCS_RANGE) * primaries.scales

    def in_floating_point(XYZ: Array) -> Array:
        channels: Any = (XYZ @ to_d50.T).T
        for element in processes.elements:
            channels = apply(element, channels)
        return np.stack(channels, axis=-1) * primaries.scales

    maps = {"B2A0": in_16_bits, "B2D0": in_floating_point}
    return Profile(header, tags), measure(primaries, method, grid, maps)


def _nodes(primaries: Primaries, method: InterpolationMethod, grid: int) -> _Nodes:
    if grid not in GRIDS:
        raise UsageError(f"grid is {grid}, expected {', '.join(map(str, GRIDS))}")
    axis = root(KNEE / HEADROOM)
    scale = 1 / (HEADROOM * np.array(primaries.white))
    along = axis.inverse(np.linspace(0, 1, grid))
    colours = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1) / scale
    parameters = interpolate(colours, primaries, method=method)
    parameters[..., GLOSS] = np.maximum(parameters[..., GLOSS], GLOSS_FLOOR)
    return _Nodes(axis, scale, colours, parameters)


def _title(primaries: Primaries, method: str, grid: int) -> str:
    return f"{MODELS[primaries.model].title}, {method} interpolation, table of {grid} x {grid} x {grid}"


def _matrix(process: MultiProcess) -> Array:
    matrix: Array = process.elements[0].matrix.astype(np.float64)
    return matrix


def _codings(device: Array, primaries: Primaries) -> list[Power]:
    """From what the version 4 tables hold to device values, by channel."""
    largest, least = device.max(axis=(0, 1, 2)), device.min(axis=(0, 1, 2))
    knees = KNEE * np.array(primaries.white) / primaries.scales[DIFFUSE]
    diffuse = [cube(knee, top) for knee, top in zip(knees, largest[DIFFUSE], strict=True)]
    gloss = [near_exponential(*ends) for ends in zip(least[GLOSS], largest[GLOSS], strict=True)]
    return [*diffuse, *gloss]


@dataclass(frozen=True)
class _LookUp:
    """The 16-bit map: what its tag holds, and what a CMM makes of that."""

    matrix: Array
    """From values of the connection space to the axes, shape (3, 3), as a profile stores it."""
    axis: Power
    table: ExtendedClut
    codings: list[Power]

    @classmethod
    def of(cls, axis: Power, to_axes: Array, device: Array, codings: list[Power]) -> _LookUp:
        coded = [coding.inverse(device[..., j]) for j, coding in enumerate(codings)]
        table = ExtendedClut(np.clip(np.stack(coded, axis=-1), 0, 1), encoding=2)
        return cls(quantised(to_axes * _PCS_RANGE), axis, table, codings)

    @property
    def tag(self) -> LutBToA:
        return self._tag(self.table, tuple(coding.parametric for coding in self.codings))

    def gamut(self, outside: Array) -> LutBToA:
        """The tag of a table over the same axes that is 0 within the gamut."""
        return self._tag(ExtendedClut(outside[..., np.newaxis], encoding=3), (_IDENTITY,))

    def _tag(self, table: ExtendedClut, a_curves: tuple[Any, ...]) -> LutBToA:
        return LutBToA(
            b_curves=(_IDENTITY,) * 3,
            matrix=(*self.matrix.reshape(-1), 0, 0, 0),
            m_curves=(self.axis.parametric,) * 3,
            clut=table,
            a_curves=a_curves,
        )

    def __call__(self, values: Array) -> Array:
        """Device values (n, k) for values of the connection space (n, 3), both in 16 bits."""
        on_axes = self.axis(np.clip(_in_16_bits(values) @ self.matrix.T, 0, 1))
        coded = apply(self.table, on_axes.T, dtype=np.float64)
        device = [coding(channel) for coding, channel in zip(self.codings, coded, strict=True)]
        return _in_16_bits(np.stack(device, axis=-1))


def _in_16_bits(values: Array) -> Array:
    rounded: Array = np.rint(np.clip(values, 0, 1) * 65535) / 65535
    return rounded


def _processes(axis: Power, to_axes: Array, device: Array, codings: list[Power]) -> MultiProcess:
    """The map in floating point: kd coded as in 16 bits, gloss as its binary logarithm."""
    coded = [coding.inverse(device[..., j]) for j, coding in enumerate(codings[DIFFUSE])]
    table = np.concatenate([np.stack(coded, axis=-1), np.log2(device[..., GLOSS])], axis=-1)
    power_of_2 = FormulaSegment(2, (1, 2, 1, 0, 0))
    decode = [*(coding.formula for coding in codings[DIFFUSE]), *(power_of_2 for _ in codings[GLOSS])]
    return MultiProcess.of(
        Matrix.of(to_axes),
        CurveSet((axis.clipped,) * 3),
        Clut(table),
        CurveSet(tuple(SegmentedCurve((), (segment,)) for segment in decode)),
    )


def _backwards(to_d50: Array, channels: int) -> LutAToB:
    """Device values to the XYZ of kd, by a table that picks its three channels, and a matrix."""
    corners = np.moveaxis(np.indices((2,) * channels, dtype=np.float64), 0, -1)
    return LutAToB(
        b_curves=(_IDENTITY,) * 3,
        matrix=(*(to_d50 / _PCS_RANGE).reshape(-1), 0, 0, 0),
        m_curves=(_IDENTITY,) * 3,
        clut=ExtendedClut(corners[..., DIFFUSE], encoding=2),
        a_curves=(_IDENTITY,) * channels,
    )
