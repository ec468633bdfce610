"""Primaries -> a binding MID and the MVIS it goes with, as profile objects.

The MID decodes device channels, all within 0..1, into the model's multiplex channels; the MVIS holds the
model as a calculator program.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from iccbrdf.brdf.primaries import Primaries
from iccbrdf.build.listing import listing
from iccbrdf.build.models import MODELS, Model
from iccbrdf.build.profiles import Range, decoding, ranges, text_tags
from iccbrdf.build.viewing import Viewing, viewing
from iccbrdf.calc import Compiled, compile_template
from iccbrdf.errors import UsageError, nearest
from iccbrdf.icc import XYZ, Calculator, Header, MultiProcess, NumberArray, Profile
from iccbrdf.resources import folder


@dataclass(frozen=True)
class Pair:
    """A MID, the MVIS it goes with, and a listing of both for people."""

    mid: Profile
    mvis: Profile
    listing: str
    compiled: Compiled

    @property
    def files(self) -> dict[str, bytes]:
        """What is written to a folder, by file name."""
        return {
            "mid.icc": self.mid.to_bytes(),
            "mvis.icc": self.mvis.to_bytes(),
            "mvis.txt": self.listing.encode(),
        }


def build_pair(
    primaries: Primaries,
    *,
    effects: Collection[str] | None = None,
    without: Collection[str] = (),
    fresnel_angle: str | None = None,
    variables: Mapping[str, float] | None = None,
) -> Pair:
    """Build the profiles of the model, the viewing conditions and the encoding that `primaries` states.

    Parameters
    ----------
    primaries
        As `iccbrdf.brdf.read_primaries` gives them.
    effects
        Names of the effects to simulate; default: all that the model has.
    without
        Names of effects to leave out.
    fresnel_angle
        `theta_i` (as printed) or `alpha` (between half vector and view: reciprocal); default: `theta_i`.
    variables
        Values of run-time variables that hold where the CMM's environment sets none.

    Raises
    ------
    UsageError
        An effect or a variable is unknown, or `fresnel_angle` is given and there is no Fresnel term.
    """
    variables = variables or {}
    model = MODELS[primaries.model]
    path = folder("calc_templates") / model.template
    constants: dict[str, Any] = {"white": primaries.white}
    if model.has_refractive_index:
        constants["refractive_index"] = primaries.refractive_index
    if fresnel_angle is not None:
        constants["fresnel_angle"] = fresnel_angle
    template = path.read_text(encoding="utf-8")
    declared = compile_template(template, filename=path.name)
    choosable = [name for name in declared.effects if name not in model.effects]
    _check_names("effect", (*(effects or ()), *without), choosable, model)
    _check_names("run-time variable", variables, declared.variables, model)
    chosen = {
        name: name not in without and (declared.effects[name] if effects is None else name in effects)
        for name in choosable
    }
    if fresnel_angle is not None and not chosen.get("fresnel"):
        raise UsageError(f"a Fresnel angle is given, but {model.title} has no Fresnel term or it is left out")
    compiled = compile_template(
        template,
        filename=path.name,
        constants=constants,
        effects={**chosen, **model.effects},
        variables=variables,
    )
    conditions = viewing(primaries.illuminant, primaries.observer, primaries.white)
    limits = ranges(compiled.inputs, primaries.encoding)
    mid = _mid(compiled.inputs, limits, model.title)
    mvis = _mvis(compiled, conditions, model.title)
    return Pair(mid, mvis, listing(model.title, compiled, limits, conditions), compiled)


def _check_names(what: str, names: Iterable[str], valid: Collection[str], model: Model) -> None:
    for name in names:
        if name not in valid:
            raise UsageError(f"{model.title} has no {what} {name!r}: {nearest(name, valid)}")


def _mid(channels: Sequence[str], limits: Sequence[Range], name: str) -> Profile:
    n = len(channels)
    header = Header(device_class="mid ", colour_space=f"nc{n:04x}", mcs=f"mc{n:04x}")
    decode = MultiProcess(n, n, (decoding(limits),))
    return Profile(header, {**text_tags(f"MID for {name}", channels), "A2M0": decode})


def _mvis(compiled: Compiled, conditions: Viewing, name: str) -> Profile:
    n = len(compiled.inputs)
    program = Calculator(inputs=n, outputs=3, program=compiled.program)
    header = Header(device_class="mvis", pcs="XYZ ", mcs=f"mc{n:04x}", illuminant=conditions.white)
    tags: dict[str, Any] = {
        **text_tags(f"MVIS for {name}, {conditions.text}", compiled.inputs),
        "mdv ": NumberArray("fl32", np.array(compiled.defaults)),
        "wtpt": XYZ.of(*conditions.white),
        "M2B0": MultiProcess(n, 3, (program,)),
    }
    if conditions.svcn is not None:
        tags |= {
            "svcn": conditions.svcn,
            "c2sp": conditions.to_standard(),
            "s2cp": conditions.from_standard(),
        }
    return Profile(header, tags)
