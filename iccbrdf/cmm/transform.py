"""A linked chain of profiles, ready to map pixels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from iccbrdf.cmm.adaptive import adaptive_execution
from iccbrdf.cmm.environment import checked_environment
from iccbrdf.cmm.execution import Execution, Tally, execution, parts
from iccbrdf.cmm.steps import Process, Step
from iccbrdf.cmm.threads import spread
from iccbrdf.errors import InputError, LimitError

MAX_COST = 1e14
"""Operators on single numbers for all pixels together, unless the caller allows more: a day on one processor.
The longest program of ours runs within it on a hundred gigapixels."""
LEAST_PIXELS = 1000
"""An operator takes as long to begin as it then takes for so many pixels."""


@dataclass(frozen=True)
class Transform:
    """Maps arrays (..., channels in) to arrays (..., channels out); made by `iccbrdf.link`.

    Values are real ones: XYZ has Y = 1 for the white, L* runs to 100, device channels are in 0..1 and are
    not clipped.  A transform is immutable and pickles.
    """

    channels_in: tuple[str, ...]
    """Names of the input channels, in order."""
    channels_out: tuple[str, ...]
    """Names of the output channels, in order."""
    samples_out: Literal["device", "real"]
    """What the results are: device values, of a chain that ends on a device, or physical ones."""
    steps: tuple[Step, ...]
    variables: tuple[str, ...]
    """Names of the run-time variables that the profiles read."""
    env: Mapping[str, float]
    dtype: type[np.floating[Any]]
    wanted: str
    """The back end that was asked for; `backend` is the one that runs."""
    threads: int
    adaptive: bool = False
    """Whether each tile runs as little of the chain as it calls for (cmm/adaptive.py)."""
    max_cost: float = MAX_COST
    """What `cost` may be at most."""

    @cached_property
    def execution(self) -> Execution:
        """What runs the chain, compiled when first asked for."""
        dtype = np.dtype(self.dtype)
        if self.adaptive:
            return adaptive_execution(self.steps, self.channels_in, dtype, self.wanted)
        return execution(self.steps, len(self.channels_in), dtype, self.wanted)

    def __getstate__(self) -> dict[str, Any]:
        """All but compiled code, which another process makes for itself."""
        return {name: value for name, value in self.__dict__.items() if name != "execution"}

    @property
    def backend(self) -> str:
        """The back end that runs the chain."""
        return self.execution.backend

    def cost(self, pixels: int) -> int:
        """Operators on single numbers that so many pixels take at most, those of elements included.

        Few pixels take as long as LEAST_PIXELS.
        """
        work = sum(step.work if isinstance(step, Process) else 1 for step in self.steps)
        return max(pixels, LEAST_PIXELS) * work

    def check_cost(self, pixels: int) -> None:
        """LimitError where so many pixels, of an array or of a whole image, cost more than `max_cost`."""
        cost = self.cost(pixels)
        if cost > self.max_cost:
            raise LimitError(
                f"{pixels} pixels take {cost:.3g} operations of these profiles' programs, the limit is "
                f"{self.max_cost:.3g}; allow more with --max-cost (max_cost in Python) if that is meant"
            )

    def __call__(self, array: npt.ArrayLike) -> npt.NDArray[np.floating[Any]]:
        """`array` (..., channels in) through the chain, in the dtype of the transform.

        Integers are taken as the numbers that they are: 255 is not 1.  Raises InputError where the array
        holds no real numbers or the channels do not fit, LimitError where it costs more than `max_cost`.
        """
        return self.tallied(array)[0]

    def tallied(self, array: npt.ArrayLike) -> tuple[npt.NDArray[np.floating[Any]], Tally]:
        """As a call; and the number of pixels by the kind of tile that they ran in.

        Kinds other than `full` and `not finite` are those of an adaptive transform.
        """
        try:
            pixels = np.asarray(array)
        except (TypeError, ValueError) as error:
            raise InputError(f"the array cannot be read: {error}") from None
        if pixels.dtype.kind not in "fiu":
            raise InputError(f"the array holds {pixels.dtype}, expected real numbers")
        if pixels.ndim == 0 or pixels.shape[-1] != len(self.channels_in):
            raise InputError(
                f"the array has shape {pixels.shape}, expected (..., {len(self.channels_in)}): "
                + ", ".join(self.channels_in)
            )
        flat = pixels.reshape(-1, len(self.channels_in))
        self.check_cost(len(flat))
        out = np.empty((len(flat), len(self.channels_out)), self.dtype)
        run = self.execution.bind(self.env)

        def quietly(piece: slice) -> Tally:
            # What is infinite or not a number is a result like any other.
            with np.errstate(all="ignore"):
                return run(flat[piece], out[piece])

        tally = sum(spread(quietly, parts(len(flat), self.threads), self.threads), start=Counter[str]())
        return out.reshape(*pixels.shape[:-1], len(self.channels_out)), tally

    def with_env(self, env: Mapping[str, float]) -> Transform:
        """The same chain under other run-time variables; those not named keep their value."""
        changed = replace(self, env={**self.env, **checked_environment(env, self.variables)})
        if "execution" in self.__dict__:
            # Compiled code takes variables as arguments.
            changed.__dict__["execution"] = self.execution
        return changed
