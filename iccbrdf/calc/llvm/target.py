"""What code is made for: the processor that this is, or a plainer one of its kind."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any

from iccbrdf.errors import UnsupportedError, UsageError

WIDTHS = {4: "x86-64-v2", 8: "x86-64-v3", 16: "x86-64-v4"}
"""Lanes of float32, and the x86 processors that have registers of so many."""

_WIDE = ("avx512f", "avx512bw", "avx512dq", "avx512vl")


@dataclass(frozen=True)
class Target:
    """A processor: `lanes` float32 numbers fit into its vectors; `fma` says whether it has a b + c."""

    cpu: str
    features: str
    lanes: int
    fma: bool


def binding() -> Any:
    """`llvmlite.binding`, imported when first needed.

    Raises
    ------
    UnsupportedError
        llvmlite is not installed.
    """
    try:
        return import_module("llvmlite.binding")
    except ImportError as error:
        raise UnsupportedError(
            "the LLVM back end needs the package llvmlite: pip install 'iccbrdf[fast]'"
        ) from error


@cache
def host() -> Target:
    """The processor that this is."""
    llvm = binding()
    features = llvm.get_host_cpu_features()
    if not _is_x86():
        return Target(llvm.get_host_cpu_name(), features.flatten(), 4, True)
    if all(features.get(name) for name in _WIDE):
        lanes = 16
    else:
        lanes = 8 if features.get("avx2") else 4
    return Target(llvm.get_host_cpu_name(), features.flatten(), lanes, bool(features.get("fma")))


def of_width(lanes: int) -> Target:
    """A processor of this kind with vectors of 4, 8 or 16 float32 numbers: for tests.

    Raises
    ------
    UsageError
        Another width, or one that this processor cannot run.
    """
    widest = host().lanes
    if lanes not in WIDTHS or lanes > widest:
        valid = ", ".join(str(width) for width in WIDTHS if width <= widest)
        raise UsageError(f"vectors of {lanes} numbers, expected {valid}")
    if not _is_x86():
        return host()
    return Target(WIDTHS[lanes], "", lanes, lanes > 4)


def _is_x86() -> bool:
    return platform.machine().lower() in ("x86_64", "amd64")
