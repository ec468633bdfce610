"""The look-up-table tag types as processing elements, so that one kind of transform is left to run.

Every stage of such a table takes and gives 0..1, to which it clips; connection spaces are encoded in it
(ICC.1, 6.3.4 and 10.10 to 10.13).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from iccbrdf.cmm.spaces import Space
from iccbrdf.errors import ProfileError
from iccbrdf.icc import (
    Curve,
    CurveSet,
    ExtendedClut,
    FormulaSegment,
    Lut8,
    Lut16,
    LutAToB,
    LutBToA,
    Matrix,
    MultiProcess,
    ParametricCurve,
    SampledCurve,
    SegmentedCurve,
)

TYPES = (Lut8, Lut16, LutAToB, LutBToA)

Lut: TypeAlias = Lut8 | Lut16 | LutAToB | LutBToA

_IDENTITY = SampledCurve(0, 1, 0, np.array([0.0, 1.0]))

# What 0..1 stands for: factors and offsets.  XYZ is u1Fixed15.
_XYZ = ((65535 / 32768,) * 3, (0.0,) * 3)
_LAB = ((100.0, 255.0, 255.0), (0.0, -128.0, -128.0))
# In lut16Type L* 100 is FF00, a* and b* 0 are 8000, in profiles of every version.
_LAB_16 = (tuple(factor * 65535 / 65280 for factor in _LAB[0]), _LAB[1])


def as_elements(lut: Lut, source: Space, destination: Space, place: str) -> MultiProcess:
    """The same transform between real values of the two spaces; `place` names the tag for messages.

    Raises ProfileError where a parametric curve has no meaning.
    """
    legacy = isinstance(lut, Lut16)
    elements = [
        *_encoded(source, legacy),
        *_stages(lut, source, place),
        *clipped(lut.outputs),
        *_decoded(destination, legacy),
    ]
    return MultiProcess(lut.inputs, lut.outputs, tuple(elements))


def _stages(lut: Lut, source: Space, place: str) -> list[Any]:
    if isinstance(lut, (Lut8, Lut16)):
        matrix = np.reshape(lut.matrix, (3, 3))
        return [
            *([Matrix.of(matrix), *clipped(3)] if source.signature == "XYZ " else []),
            CurveSet(tuple(SampledCurve(0, 1, 0, row) for row in lut.input_tables)),
            ExtendedClut(lut.table, 0),
            CurveSet(tuple(SampledCurve(0, 1, 0, row) for row in lut.output_tables)),
        ]
    matrix_stage = []
    if lut.matrix is not None:
        matrix_stage = [Matrix.of(np.reshape(lut.matrix[:9], (3, 3)), lut.matrix[9:]), *clipped(3)]
    stages = [
        curve_elements(lut.b_curves, f"{place}: B curve"),
        matrix_stage,
        curve_elements(lut.m_curves, f"{place}: M curve"),
        [lut.clut] if lut.clut is not None else [],
        curve_elements(lut.a_curves, f"{place}: A curve"),
    ]
    if isinstance(lut, LutAToB):
        stages.reverse()
    return [element for stage in stages for element in stage]


def clipped(channels: int) -> list[Any]:
    """What keeps channels in 0..1."""
    return [CurveSet((_IDENTITY,) * channels)]


def _encoding(space: Space, legacy: bool) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    if space.kind == "pcs":
        return _XYZ if space.signature == "XYZ " else _LAB_16 if legacy else _LAB
    return None


def _encoded(space: Space, legacy: bool) -> list[Any]:
    """Real values to 0..1."""
    encoding = _encoding(space, legacy)
    if encoding is None:
        return []
    factors, offsets = np.array(encoding)
    return [Matrix.of(np.diag(1 / factors), -offsets / factors)]


def _decoded(space: Space, legacy: bool) -> list[Any]:
    """0..1 to real values."""
    encoding = _encoding(space, legacy)
    return [] if encoding is None else [Matrix.of(np.diag(encoding[0]), encoding[1])]


def curve_elements(
    curves: Sequence[Curve | ParametricCurve | SegmentedCurve] | None, place: str
) -> list[Any]:
    """Curves for channels in 0..1; nothing where there are none."""
    if curves is None:
        return []
    made = CurveSet(tuple(_curve(curve, f"{place} {i}") for i, curve in enumerate(curves)))
    # Samples end at 0 and 1, formulas go on.
    formulas = any(isinstance(curve, SegmentedCurve) for curve in made.curves)
    return [*(clipped(len(curves)) if formulas else []), made]


def _curve(curve: Curve | ParametricCurve | SegmentedCurve, place: str) -> SampledCurve | SegmentedCurve:
    if isinstance(curve, SegmentedCurve):
        return curve
    if isinstance(curve, ParametricCurve):
        return _parametric(curve, place)
    if not curve.entries:
        return _IDENTITY
    if len(curve.entries) == 1:
        return SegmentedCurve((), (power(curve.entries[0] / 256),))
    return SampledCurve(0, 1, 0, np.array(curve.entries) / 65535)


def power(g: float, a: float = 1.0, b: float = 0.0, c: float = 0.0) -> FormulaSegment:
    """(a x + b)^g + c."""
    return FormulaSegment(0, (g, a, b, c))


def _parametric(curve: ParametricCurve, place: str) -> SegmentedCurve:
    """Two segments; the point between them belongs to the upper one, so the break lies just before it."""
    g, a, b, c, d, e, f = (*curve.parameters, *(0.0,) * (7 - len(curve.parameters)))
    if curve.type == 0:
        return SegmentedCurve((), (power(g),))
    if curve.type < 3:
        if not a > 0:
            raise ProfileError(f"{place}: parameter a: found {a:g}, expected above 0")
        at, lower, offset = -b / a, power(1, 0, 0, c), c
    else:
        at, lower, offset = d, power(1, c, 0, f), e
    point = float(np.nextafter(np.float32(at), np.float32(-np.inf)))
    return SegmentedCurve((point,), (lower, power(g, a, b, offset)))
