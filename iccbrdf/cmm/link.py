"""Profiles -> a Transform.

The rules are those of ICC.2: multiplex channels are routed by name, connection spaces meet under common
viewing conditions, rendering intents choose among the tags.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from iccbrdf.cmm.arrange import arranged, without_decoding
from iccbrdf.cmm.effects import Choice, check, choice, substitution
from iccbrdf.cmm.environment import checked_environment
from iccbrdf.cmm.execution import BACKENDS
from iccbrdf.cmm.join import at_the_end, join
from iccbrdf.cmm.resolve import INTERPOLATIONS
from iccbrdf.cmm.stages import INTENTS, Stage, stages
from iccbrdf.cmm.steps import Process, Step
from iccbrdf.cmm.transform import MAX_COST, Transform
from iccbrdf.errors import UsageError, nearest
from iccbrdf.icc import Profile, read_profile

_NUMBER_TYPES: tuple[type[np.floating[Any]], ...] = (np.float32, np.float64)


def link(
    profiles: Iterable[str | os.PathLike[str] | Profile],
    *,
    env: Mapping[str, float] | None = None,
    backend: str = "auto",
    threads: int = 1,
    intent: str | Sequence[str] = "relative",
    dtype: npt.DTypeLike = np.float32,
    channels: Sequence[str] | None = None,
    samples: str = "device",
    interpolation: str = "multilinear",
    spectral: bool = True,
    conditions: Mapping[int, str | os.PathLike[str] | Profile] | None = None,
    effects: str | Collection[str] = "full",
    without: Collection[str] = (),
    max_cost: float = MAX_COST,
) -> Transform:
    """Link profiles, paths or objects, into one transform.

    Parameters
    ----------
    profiles
        The chain, in order: a MID and an MVIS, either of them alone, or any chain whose spaces meet, of
        versions 2, 4 and 5.  Named colours at the start are taken by their position among `named_colours`
        (cmm/ramps.py) and, from version 5 on, a tint of 0 to 1; at the end they give the nearest one's.
    env
        Run-time variables by name; those not given take the defaults that the programs hold.
    backend
        `auto`: the quickest that can run the chain; or `interpreter`, `numpy`, `llvm` (needs llvmlite:
        `pip install 'iccbrdf[fast]'`).  All give the same numbers within a few units in the last place.
    threads
        Tiles that run at a time.
    intent
        `perceptual`, `relative`, `saturation` or `absolute`; or one of them for each profile.
    dtype
        float32, as a CMM computes, or float64.
    channels
        Names of the channels that the caller has, in the caller's order; default: all the first profile's
        device channels in its order.  A channel that the caller lacks takes the default of the MVIS, which
        needs a first profile that decodes its channels one by one (a matrix, one channel a row).
    samples
        `device`: input is 0..1, as the first profile's device space.  `real`: input is what the device
        values stand for (signed normals, physical parameters); the profile's leading matrix is left out.
        A first profile that starts from multiplex channels or XYZ takes real values in either case.
    interpolation
        Of look-up tables with three inputs: `multilinear`, as ICC's own CMM does in processing elements, or
        `tetrahedral`, which keeps greys between greys.  Others are always multilinear.
    spectral
        Whether profiles that have both take spectra rather than colours to their neighbours, as ICC's own CMM
        does; the results of a last one are spectra then.
    conditions
        By position in the chain, from 0: a profile whose viewing conditions (with its conversions to and from
        D50, and its media white) stand in for those of the profile there.
    effects
        `full`: every pixel runs the whole chain.  `auto`: tiles that have little in them, such as flat or
        matte ones, run only what they call for.  The numbers are the same but for the sign of zeros, or
        where a function other than + - * / and a root takes nothing but constant channels, to a few units in
        the last place.  Or names of effects (`relief`, `specular`, `chromatic-specular`,
        `chromatic-roughness`): the others of these four are left out.
    without
        Names of effects, of these four, to leave out: their multiplex channels take values that do nothing.
    max_cost
        Operators on single numbers that pixels may take in all; the transform refuses more with LimitError.

    Raises
    ------
    ProfileError
        A profile is malformed, or a program in it is unsafe.
    LimitError
        A profile is beyond a limit.
    LinkError
        Two profiles do not fit together, or a channel is nowhere.
    VariableError
        `env` names a variable that no profile reads.
    UnsupportedError
        The back end that is asked for is not installed, or cannot run these profiles; or a profile is of a
        kind that cannot run, such as a colour encoding by a name that is not known here.
    UsageError
        An argument has no such value.
    """
    if isinstance(profiles, (str, os.PathLike, Profile)):
        raise UsageError("profiles: found a single one, expected a sequence, such as [mid, mvis]")
    if not isinstance(profiles, Iterable):
        raise UsageError(f"profiles: found {profiles!r}, expected a sequence, such as [mid, mvis]")
    if channels is not None and (isinstance(channels, str) or not isinstance(channels, Sequence)):
        raise UsageError(f"channels: found {channels!r}, expected a sequence of names")
    if not isinstance(threads, (int, np.integer)) or threads < 1:
        raise UsageError(f"threads is {threads!r}, expected a whole number of at least 1")
    if not isinstance(max_cost, (int, float, np.number)) or not max_cost > 0:
        raise UsageError(f"max_cost is {max_cost!r}, expected a number above 0")
    chain = [p if isinstance(p, Profile) else read_profile(p) for p in profiles]
    if not chain:
        raise UsageError("no profile to link")
    several = isinstance(intent, Sequence) and not isinstance(intent, str)
    intents: list[str] = list(intent) if several else [intent] * len(chain)  # type: ignore[list-item]
    if len(intents) != len(chain):
        raise UsageError(f"intent: found {len(intents)}, expected one, or {len(chain)} for as many profiles")
    for value, valid, what in (
        (backend, BACKENDS, "backend"),
        *((name, INTENTS, "intent") for name in intents),
        (samples, ("device", "real"), "samples"),
        (interpolation, INTERPOLATIONS, "interpolation"),
    ):
        if value not in valid:
            raise UsageError(f"{what} {value!r} is unknown: {nearest(str(value), valid)}")
    if isinstance(without, str) or not all(isinstance(name, str) for name in (*effects, *without)):
        raise UsageError(f"effects: found {effects!r} without {without!r}, expected names")
    chosen = choice(effects, without)
    number_type = _number_type(dtype)

    first, *others = stages(chain, intents, spectral=spectral, stated=_stated(conditions, len(chain)))
    if samples == "real":
        first = without_decoding(first)
    steps: list[Step] = []
    if channels is not None:
        steps, first = arranged(first, tuple(channels))
    check(chosen, [stage.source.names for stage in (first, *others) if stage.source.kind == "mcs"])
    steps += [*at_the_end(first, outward=False), *_without(chosen, first), first.step(interpolation)]
    for before, after in pairwise([first, *others]):
        steps += join(before, after)
        steps += [*_without(chosen, after), after.step(interpolation)]
    last = others[-1] if others else first
    steps += at_the_end(last, outward=True)

    variables = tuple(dict.fromkeys(v for step in steps if isinstance(step, Process) for v in step.variables))
    transform = Transform(
        channels_in=tuple(channels) if channels is not None else first.source.names,
        channels_out=last.destination.names,
        samples_out="device" if last.destination.kind == "device" else "real",
        steps=tuple(steps),
        variables=variables,
        env=checked_environment(env or {}, variables),
        dtype=number_type,
        wanted=backend,
        threads=int(threads),
        adaptive=chosen.adaptive,
        max_cost=float(max_cost),
    )
    if backend != "auto":
        # Asked for by name: whether it can run is said now, not with the first pixel.
        _ = transform.execution
    return transform


def _without(chosen: Choice, stage: Stage) -> list[Step]:
    """What leaves out effects of the channels that a stage starts from."""
    step = substitution(stage.source.names, chosen.left_out) if stage.source.kind == "mcs" else None
    return [] if step is None else [step]


def _stated(
    conditions: Mapping[int, str | os.PathLike[str] | Profile] | None, count: int
) -> dict[int, Profile]:
    for position in conditions or ():
        if position not in range(count):
            raise UsageError(f"conditions: found position {position!r}, expected 0 to {count - 1}")
    return {
        position: profile if isinstance(profile, Profile) else read_profile(profile)
        for position, profile in (conditions or {}).items()
    }


def _number_type(dtype: npt.DTypeLike) -> type[np.floating[Any]]:
    try:
        found = np.dtype(dtype).type
    except (TypeError, ValueError):  # no type at all
        found = None
    for number_type in _NUMBER_TYPES:
        if found is number_type:
            return number_type
    raise UsageError(f"dtype {dtype!r} is unknown: valid are float32 and float64")
