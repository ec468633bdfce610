"""The back ends that run schedules, and what each needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from iccbrdf.calc.schedule import Schedule
from iccbrdf.errors import UnsupportedError


class Kernel(Protocol):
    """A compiled schedule.  Many threads may run one at a time, each on pixels of its own."""

    def run(
        self, pixels: npt.NDArray[Any], out: npt.NDArray[Any], arguments: Sequence[np.generic]
    ) -> None:
        """
        Compute `out` (n, outputs) from `pixels` (n, channels), rows of the graph's type.

        arguments: the values of the schedule's `arguments` (`schedule.uniform_values`).
        """


def _compile_llvm(plan: Schedule) -> Kernel:
    if find_spec("llvmlite") is None:
        raise UnsupportedError("llvmlite is not installed: pip install 'iccbrdf[fast]'")
    from iccbrdf.calc.llvm import compile_llvm

    kernel: Kernel = compile_llvm(plan)
    return kernel


def _compile_numpy(plan: Schedule) -> Kernel:
    from iccbrdf.calc.numpy_backend import compile_numpy

    return compile_numpy(plan)


def availability() -> dict[str, str]:
    """What stands against each back end, or the versions that it runs with."""
    return {"llvm": _llvm_state(), "numpy": f"NumPy {np.__version__}"}


def _llvm_state() -> str:
    if find_spec("llvmlite") is None:
        return "not there: pip install 'iccbrdf[fast]'"
    import llvmlite

    return f"llvmlite {llvmlite.__version__}"


COMPILERS: Mapping[str, Callable[[Schedule], Kernel]] = {"llvm": _compile_llvm, "numpy": _compile_numpy}
"""The back ends, the quickest first.  A compiler raises UnsupportedError for what it cannot run."""
