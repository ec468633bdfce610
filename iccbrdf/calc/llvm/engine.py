"""Compiling assembly to machine code and calling it."""

from __future__ import annotations

import ctypes
import ctypes.util
import threading
from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

from iccbrdf.calc.llvm.codegen import ENTRY
from iccbrdf.calc.llvm.target import Target, binding

PROGRAMS_KEPT = 32
"""Compiled programs in memory; the least recently used one goes first."""
LARGE = 1 << 18
"""Characters of assembly, some 3,000 nodes, beyond which compiling takes less care: it is done in a quarter
of the time, and the code is a fifth slower."""

_SIGNATURE = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p
)
_LIBRARY = (
    "acos", "asin", "atan", "atan2", "cbrt", "cos", "exp", "fmod", "log", "log10", "pow", "sin", "tan"
)  # fmt: skip
_compiling = threading.Lock()


class Compiled:
    """Machine code; it is freed with this object."""

    def __init__(self, text: str, target: Target) -> None:
        llvm = _initialised()
        machine = llvm.Target.from_default_triple().create_target_machine(
            cpu=target.cpu, features=target.features, opt=0 if len(text) > LARGE else 2
        )
        module = llvm.parse_assembly(text)
        module.triple = machine.triple
        module.data_layout = str(machine.target_data)
        self._engine = llvm.create_mcjit_compiler(module, machine)
        self._engine.finalize_object()
        self.call: Callable[..., None] = _SIGNATURE(self._engine.get_function_address(ENTRY))


def compiled(text: str, target: Target) -> Compiled:
    """The machine code of a program, made once."""
    with _compiling:
        return _compiled(text, target)


@lru_cache(maxsize=PROGRAMS_KEPT)
def _compiled(text: str, target: Target) -> Compiled:
    return Compiled(text, target)


@cache
def _initialised() -> Any:
    llvm = binding()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    library = ctypes.CDLL(ctypes.util.find_library("m") or ctypes.util.find_library("ucrtbase"))
    for name in _LIBRARY:
        llvm.add_symbol(name, ctypes.cast(getattr(library, name), ctypes.c_void_p).value)
    return llvm
