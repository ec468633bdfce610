"""Primaries -> a binding MID and the MVIS it goes with, as profile objects.

The MID decodes device channels, all within 0..1, into the model's multiplex channels; the MVIS holds the
model as a calculator program.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from iccbrdf.brdf.primaries import Primaries, encoding_of
from iccbrdf.build.effects import EFFECTS, MVIS, chosen_effects
from iccbrdf.build.listing import listing
from iccbrdf.build.models import MODELS, Model
from iccbrdf.build.profiles import Range, decoding, device_channels, ranges, text_tags
from iccbrdf.build.source import LEFT_OUT, calculator_source, source_tags
from iccbrdf.build.viewing import Viewing, viewing
from iccbrdf.calc import Compiled, compile_template
from iccbrdf.errors import UsageError, nearest
from iccbrdf.icc import XYZ, Calculator, ColorantTable, Header, MultiProcess, NumberArray, Profile
from iccbrdf.resources import folder

FRESNEL_ANGLES = ("theta_i", "alpha")
"""Of incidence, or between half vector and view."""
GEOMETRIES = ("plain", "exact")
"""How cosines and half vector are computed (calc/library.calc)."""

PROGRAM_TAG = "M2B0"
"""The tag of an MVIS that holds the model."""


@dataclass(frozen=True)
class Pair:
    """A MID, the MVIS it goes with, and a listing of both for people."""

    mid: Profile
    mvis: Profile
    listing: str
    compiled: Compiled
    effects: Mapping[str, bool]
    """The effects that the MVIS may hold, by name, and whether it does."""

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
    geometry: str = "plain",
    variables: Mapping[str, float] | None = None,
    device: Sequence[str] | None = None,
    note: str = "",
    with_source: bool = True,
) -> Pair:
    """Build the profiles of the model, the viewing conditions and the encoding that `primaries` states.

    Parameters
    ----------
    primaries
        As `iccbrdf.brdf.read_primaries` gives them.
    effects
        Names of the effects to simulate (`iccbrdf.build.effects`); those of the colour MID do nothing here.
        Default: all that the model has.
    without
        Names of effects to leave out.
    fresnel_angle
        `theta_i` (as printed) or `alpha` (between half vector and view: reciprocal); default: `theta_i`.
        Where the Fresnel term is left out, the angle that it has when it is put back.
    geometry
        `exact`: float32 keeps its digits of cosines, and of the half vector, down to the horizon, by three
        times the operators where one of the cosines is below 1/16.  `plain`: an error of 1e-7 / cosine.
    variables
        Values of run-time variables that hold where the CMM's environment sets none.
    device
        Device channels of the MID, where an image has more than the effects call for; default: no more.
    note
        What the descriptions say besides.
    with_source
        Whether the profiles hold what they are made from (`iccbrdf.icc.source_tag`).

    Raises
    ------
    UsageError
        An effect or a variable is unknown, `device` lacks a channel, `geometry` is none of these, or
        `fresnel_angle` is given and the model has no Fresnel term.
    """
    variables = variables or {}
    model = MODELS[primaries.model]
    path = folder("calc_templates") / model.template
    if geometry not in GEOMETRIES:
        raise UsageError(f"no geometry is named {geometry!r}: {nearest(geometry, GEOMETRIES)}")
    constants: dict[str, Any] = {"white": primaries.white, "geometry": geometry, **model.choices}
    if model.has_refractive_index:
        constants["refractive_index"] = primaries.refractive_index
    if fresnel_angle is not None:
        constants["fresnel_angle"] = fresnel_angle
    template = path.read_text(encoding="utf-8")
    declared = compile_template(template, filename=path.name)
    _check_names("run-time variable", variables, declared.variables, model)
    chosen = {
        name: on
        for name, on in chosen_effects(primaries.model, effects, without).items()
        if EFFECTS[name].program == MVIS
    }
    if fresnel_angle is not None and "fresnel" not in chosen:
        raise UsageError(f"a Fresnel angle is given, but {model.title} has no Fresnel term")
    compiled = compile_template(
        template,
        filename=path.name,
        constants=constants,
        effects={**{EFFECTS[name].switch: on for name, on in chosen.items()}, **model.effects},
        variables=variables,
    )
    conditions = viewing(primaries.illuminant, primaries.observer, primaries.white)
    limits = ranges(compiled.inputs, primaries.encoding)
    title = f"{model.title}{note}"
    mid = _mid(compiled.inputs, limits, device_channels(device, compiled.inputs), title)
    mvis = _mvis(compiled, conditions, title)
    if with_source:
        mid = mid.replace(tags=source_tags({"model": primaries.model, "encoding": encoding_of(primaries)}))
        recipe = {
            "model": primaries.model,
            **({"refractive_index": primaries.refractive_index} if model.has_refractive_index else {}),
            "illuminant": primaries.illuminant,
            "observer": primaries.observer,
            "white": list(primaries.white),
            **({"fresnel_angle": fresnel_angle} if fresnel_angle is not None else {}),
            **({"geometry": geometry} if geometry != "plain" else {}),
            "variables": dict(variables),
            LEFT_OUT: [name for name, on in chosen.items() if not on],
        }
        mvis = mvis.replace(tags=source_tags(recipe, calculator_source(compiled, PROGRAM_TAG)))
    return Pair(mid, mvis, listing(title, compiled, limits, conditions), compiled, chosen)


def _check_names(what: str, names: Iterable[str], valid: Collection[str], model: Model) -> None:
    for name in names:
        if name not in valid:
            raise UsageError(f"{model.title} has no {what} {name!r}: {nearest(name, valid)}")


def _mid(channels: Sequence[str], limits: Sequence[Range], device: Sequence[str], name: str) -> Profile:
    n, n_device = len(channels), len(device)
    header = Header(device_class="mid ", colour_space=f"nc{n_device:04x}", mcs=f"mc{n:04x}")
    tags: dict[str, Any] = text_tags(f"MID for {name}", channels)
    if tuple(device) != tuple(channels):
        tags["clrt"] = ColorantTable.of(device)
    decode = decoding(channels, limits, device)
    return Profile(header, {**tags, "A2M0": MultiProcess(n_device, n, (decode,))})


def _mvis(compiled: Compiled, conditions: Viewing, name: str) -> Profile:
    n = len(compiled.inputs)
    program = Calculator(inputs=n, outputs=3, program=compiled.program)
    header = Header(device_class="mvis", pcs="XYZ ", mcs=f"mc{n:04x}", illuminant=conditions.white)
    tags: dict[str, Any] = {
        **text_tags(f"MVIS for {name}, {conditions.text}", compiled.inputs),
        "mdv ": NumberArray("fl32", np.array(compiled.defaults)),
        "wtpt": XYZ.of(*conditions.white),
        PROGRAM_TAG: MultiProcess(n, 3, (program,)),
    }
    if conditions.svcn is not None:
        tags |= {
            "svcn": conditions.svcn,
            "c2sp": conditions.to_standard(),
            "s2cp": conditions.from_standard(),
        }
    return Profile(header, tags)
