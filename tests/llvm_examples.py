"""Running graphs by the LLVM back end, and telling how near its results are."""

import numpy as np
import pytest

from iccbrdf.calc.graph import Graph
from iccbrdf.calc.schedule import schedule, uniform_values

pytest.importorskip("llvmlite", reason="llvmlite is not installed: pip install 'iccbrdf[fast]'")

from iccbrdf.calc.llvm import compile_llvm
from iccbrdf.calc.llvm.target import WIDTHS, host

POSSIBLE = [width for width in WIDTHS if width <= host().lanes]
"""Lanes of the vectors that this processor has."""

SPECIALS = [
    0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 0.49999997, 1.5, -2.5, 2.0, 3.0, -3.0, 7.0, 1e-45, -1e-45, 1.1754942e-38,
    1.1754944e-38, 1e-40, -1e-40, 1e-20, 8388607.5, 16777217.0, 2.0**31, -(2.0**31), 2147483520.0, 1e10,
    88.72283, 88.72284, -87.3, -87.4, -103.9, -104.1, 1e30, -1e30, 3.4028235e38, -3.4028235e38, 8191.9,
    8192.1, np.inf, -np.inf, np.nan, np.pi, np.pi / 2, -np.pi, np.pi / 4, 0.70710678,
]  # fmt: skip


def special_numbers(dtype=np.float32):
    with np.errstate(over="ignore"):
        return np.array(SPECIALS, dtype)


def numbers(count, dtype=np.float32, seed=7):
    """Special numbers, ordinary ones, and any bits."""
    rng = np.random.default_rng(seed)
    size = np.dtype(dtype).itemsize
    bits = np.frombuffer(rng.bytes(count * size), f"u{size}").view(dtype)
    ordinary = [rng.uniform(-1, 1, count), rng.normal(0, 10, count), rng.integers(-9, 9, count) / 2]
    return np.concatenate([special_numbers(dtype), bits, *(part.astype(dtype) for part in ordinary)])


def pairs(count, dtype=np.float32):
    """Two columns: all pairs of special numbers, then others."""
    special = special_numbers(dtype)
    first, second = np.meshgrid(special, special)
    one, other = numbers(count, dtype, 1), numbers(count, dtype, 2)
    return [np.concatenate([first.ravel(), one]), np.concatenate([second.ravel(), other])]


def run(plan, pixels, env=None, width=None):
    out = np.empty((len(pixels), len(plan.graph.outputs)), plan.graph.dtype)
    compile_llvm(plan, width=width).run(pixels, out, uniform_values(plan, env or {}))
    return out


def computed(op, columns, width=None):
    """What an operator gives for columns of numbers; a single number becomes a constant of the graph."""
    arrays = [column for column in columns if np.ndim(column)]
    dtype = arrays[0].dtype.type
    graph = Graph(dtype=dtype)
    inputs = iter(range(len(arrays)))
    nodes = [graph.input(next(inputs)) if np.ndim(column) else graph.number(column) for column in columns]
    graph.outputs = (graph.apply(op, *nodes),)
    return run(schedule(graph, len(arrays)), np.stack(arrays, axis=1), width=width)[:, 0]


def ulps_apart(found, expected):
    """Units in the last place between numbers; without limit where one is NaN, infinite or zero alone."""
    one, other = map(_in_order, (found, expected))
    apart = np.maximum(one, other) - np.minimum(one, other)
    special = ~np.isfinite(expected) | (expected == 0) | ~np.isfinite(found)
    same = (found == expected) & (np.signbit(found) == np.signbit(expected))
    apart = np.where(special & ~same, np.inf, apart.astype(np.float64))
    return np.where(np.isnan(found) & np.isnan(expected), 0.0, apart)


def _in_order(values):
    """Unsigned integers in the order of the numbers, neighbours 1 apart."""
    bits = values.view(f"u{values.itemsize}")
    top = bits.dtype.type(1 << 8 * values.itemsize - 1)
    return np.where(np.signbit(values), top - (bits - top), bits + top)
