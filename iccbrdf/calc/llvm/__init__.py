"""The LLVM back end: a schedule as vector code for this processor.

`codegen` writes the schedule as LLVM assembly, one vector of 4 to 16 pixels a node, with elementary functions
of our own (`functions`, `wide`), tables (`lookup`) and turned-over blocks of rows (`rows`); `engine` compiles
it through llvmlite.  Sums, products, quotients, roots and comparisons are the interpreter's bit for bit;
other functions are within a few units in the last place.  `solve` nodes are not supported.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iccbrdf.calc.llvm.codegen import Assembly, assemble
from iccbrdf.calc.llvm.engine import Compiled, compiled
from iccbrdf.calc.llvm.target import host, of_width
from iccbrdf.calc.schedule import Schedule

CONVERTED = 8192
"""Rows that are copied at a time where they are not of the working type and contiguous."""


def compile_llvm(schedule: Schedule, *, width: int | None = None) -> Kernel:
    """
    Compile a schedule for this processor.

    Parameters
    ----------
    schedule
        Of float32 or float64.
    width
        float32 numbers in a vector: 4, 8 or 16; by default as many as the processor's have.

    Raises
    ------
    UnsupportedError
        A node cannot be run (`solve`, and look-up tables of very many corners), or llvmlite is missing.
    UsageError
        The processor has no such vectors.
    """
    target = host() if width is None else of_width(width)
    assembly = assemble(schedule, target)
    return Kernel(schedule, assembly, compiled(assembly.text, target))


class Kernel:
    """A compiled schedule.  Many threads may run one at a time: it does not hold the interpreter lock."""

    def __init__(self, schedule: Schedule, assembly: Assembly, code: Compiled) -> None:
        self._dtype = np.dtype(schedule.graph.dtype)
        self._channels = schedule.channels
        self._lanes = assembly.lanes
        self._tables = assembly.tables
        self._addresses = np.array([table.ctypes.data for table in assembly.tables], np.uintp)
        self._code = code

    def run(self, pixels: NDArray[Any], out: NDArray[Any], arguments: Sequence[np.generic]) -> None:
        """
        Compute `out` (n, outputs) from `pixels` (n, channels) and the values of the schedule's arguments.

        Arrays of the working type whose rows lie one after the other are used where they are; others are
        copied piece by piece.  `out` must not overlap with `pixels`.
        """
        numbers = np.array([float(argument) for argument in arguments], self._dtype)
        if self._direct(pixels) and self._direct(out):
            self._run(pixels, out, numbers)
            return
        for start in range(0, len(pixels), CONVERTED):
            rows = np.ascontiguousarray(pixels[start : start + CONVERTED], self._dtype)
            results = np.empty((len(rows), out.shape[1]), self._dtype)
            self._run(rows, results, numbers)
            out[start : start + CONVERTED] = results

    def _direct(self, rows: NDArray[Any]) -> bool:
        return rows.dtype == self._dtype and rows.flags.c_contiguous and rows.flags.aligned

    def _run(self, pixels: NDArray[Any], out: NDArray[Any], numbers: NDArray[Any]) -> None:
        whole = len(pixels) // self._lanes * self._lanes
        if whole:
            self._call(pixels, out, whole // self._lanes, numbers)
        left = len(pixels) - whole
        if left:
            block = np.zeros((self._lanes, self._channels), self._dtype)
            block[:left] = pixels[whole:]
            results = np.empty((self._lanes, out.shape[1]), self._dtype)
            self._call(block, results, 1, numbers)
            out[whole:] = results[:left]

    def _call(self, pixels: NDArray[Any], out: NDArray[Any], blocks: int, numbers: NDArray[Any]) -> None:
        self._code.call(
            pixels.ctypes.data, out.ctypes.data, blocks, numbers.ctypes.data, self._addresses.ctypes.data
        )
