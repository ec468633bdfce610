"""Interpolation in look-up tables of any number of channels, on planar values."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.calc.meanings import Value, where
from iccbrdf.errors import UsageError


@dataclass(frozen=True, eq=False)
class TetrahedralTable:
    """A look-up table of three channels that is interpolated in tetrahedra; what linking makes of a `clut`.

    table: float32, shape (g_1, g_2, g_3, outputs), over 0..1.  No file holds this element.
    """

    table: npt.NDArray[np.floating[Any]]

    signature = "clut in tetrahedra"
    inputs = 3

    def __post_init__(self) -> None:
        if self.table.ndim != 4:
            raise UsageError(f"TetrahedralTable: found {self.table.ndim - 1} channels, expected 3")

    @property
    def outputs(self) -> int:
        return int(self.table.shape[-1])


def clip(x: Value) -> Value:
    """Into 0..1, NaN to 0."""
    one = x.dtype.type(1)
    return where(x > 0, np.minimum(x, one), x.dtype.type(0))


def multilinear(table: npt.NDArray[Any], channels: Sequence[Value]) -> list[Value]:
    """The sum over all corners of a pixel's cell, each weighted by the part that lies opposite of it."""
    dtype, outputs = channels[0].dtype, table.shape[-1]
    nodes = table.reshape(-1, outputs)
    cell, axes = _cells(table, channels)
    corners = [((0, 1 - fraction), (stride, fraction)) for stride, fraction in axes]
    totals: list[Value] = [np.asarray(dtype.type(0))[()]] * outputs
    for corner in itertools.product(*corners):
        weight = reduce(np.multiply, (part for _, part in corner))
        values = nodes[cell + sum(step for step, _ in corner)].astype(dtype, copy=False)
        totals = [total + weight * values[..., j] for j, total in enumerate(totals)]
    return totals


def tetrahedral(table: npt.NDArray[Any], channels: Sequence[Value]) -> list[Value]:
    """Barycentric in one of six tetrahedra of the cell, which meet in the diagonal from its first corner.

    From the first corner to the last the path steps along the channel with the largest fraction first
    (J. M. Kasson, W. Plouffe, S. I. Nin: A tetrahedral interpolation technique for color space conversion,
    SPIE 1909, 1993).  Greys are interpolated between greys alone.
    """
    dtype, outputs = channels[0].dtype, table.shape[-1]
    nodes = table.reshape(-1, outputs)
    cell, axes = _cells(table, channels)
    fractions: Value = np.stack(np.broadcast_arrays(*(fraction for _, fraction in axes)))
    order = np.argsort(-fractions, axis=0, kind="stable")
    steps: Value = np.array([stride for stride, _ in axes])[order]
    sorted_fractions: Value = np.take_along_axis(fractions, order, axis=0)
    corner = np.broadcast_to(cell, fractions.shape[1:])
    bounds = [dtype.type(1), *sorted_fractions, dtype.type(0)]
    totals: list[Value] = [np.asarray(dtype.type(0))[()]] * outputs
    for index, (upper, lower) in enumerate(itertools.pairwise(bounds)):
        if index:
            corner = corner + steps[index - 1]
        values = nodes[corner].astype(dtype, copy=False)
        totals = [total + (upper - lower) * values[..., j] for j, total in enumerate(totals)]
    return totals


def _cells(table: npt.NDArray[Any], channels: Sequence[Value]) -> tuple[Value, list[tuple[int, Value]]]:
    """The number of a cell's first node, and for each channel its step to the next node and the way there."""
    dtype = channels[0].dtype
    cell: Value = np.asarray(0)
    axes = []
    stride = int(np.prod(table.shape[:-1]))
    for x, count in zip(channels, table.shape[:-1], strict=True):
        stride //= count
        position = clip(x) * dtype.type(count - 1)
        left = np.minimum(np.floor(position), dtype.type(count - 2))
        cell = cell + left.astype(np.intp) * stride
        axes.append((stride, position - left))
    return cell, axes
