"""Primaries and slopes -> the colour MID: from XYZ and normals straight to BRDF parameters.

Its device channels are the XYZ of the flat print, as the ICC's u1.15, and the normal; its calculator
adjusts XYZ to the slope and interpolates the parameters between the primaries.  A private tag holds the
encoding of the binding MID, so that the BRDF image itself can be written.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iccbrdf.brdf.interpolation import InterpolationMethod, interpolate
from iccbrdf.brdf.models import MODELS as SCIENCE
from iccbrdf.brdf.models import NORMAL
from iccbrdf.brdf.primaries import Primaries, check_nodes, encoding_of, entries_of
from iccbrdf.brdf.slopes import Slopes, published_jumps
from iccbrdf.brdf.slopes import entries_of as slope_entries_of
from iccbrdf.brdf.smooth_interpolation import SmoothMap
from iccbrdf.build.effects import chosen_effects, effect_names
from iccbrdf.build.models import MODELS
from iccbrdf.build.private_tags import IMAGE_TAG, SLOPES_TAG, image_encoding
from iccbrdf.build.profiles import decoding, device_channels, ranges, text_tags
from iccbrdf.build.slope_adjustment import TEMPLATE, check_slopes, slope_constants
from iccbrdf.build.source import LEFT_OUT, calculator_source, source_tags
from iccbrdf.calc import Compiled, compile_chain
from iccbrdf.calc import listing as program_listing
from iccbrdf.errors import UsageError, nearest
from iccbrdf.icc import Calculator, ColorantTable, Header, MultiProcess, NumberArray, Profile
from iccbrdf.resources import folder

INTERPOLATIONS = ("smooth", "published")
SLOPE_METHODS = ("affine", "published")
DEVICE = ("X", "Y", "Z", *NORMAL)
"""What a colour MID takes, used or not."""


@dataclass(frozen=True)
class ColourMid:
    """A colour MID and its listing."""

    mid: Profile
    listing: str
    compiled: Compiled
    effects: Mapping[str, bool]
    """The effects that this program holds, by name."""

    @property
    def files(self) -> dict[str, bytes]:
        """What is written to a folder, by file name."""
        return {
            "colour-mid.icc": self.mid.to_bytes(),
            "colour-mid.txt": self.listing.encode(),
        }


def build_colour_mid(
    primaries: Primaries,
    *,
    interpolation: str = "smooth",
    slopes: Slopes | None = None,
    slope_method: str = "affine",
    p: float = 2.0,
    exponent: float = -1.0,
    effects: Collection[str] | None = None,
    without: Collection[str] = (),
    reference: ArrayLike | None = None,
    device: Sequence[str] | None = None,
    note: str = "",
    with_source: bool = True,
) -> ColourMid:
    """Build the colour MID of a set of primaries.

    Parameters
    ----------
    primaries
        4 to 16 nodes with their XYZ and parameters.
    interpolation
        `smooth`, continuous in XYZ, or `published`, with its choice of the number of nodes.
    slopes
        White and black printed on slopes; None: no slope adjustment.
    slope_method
        `affine` or `published`.
    p, exponent
        Norm of the chromaticity distance and exponent of the weights, for `published`.
    effects
        Names of the effects to simulate (`iccbrdf.build.effects`); default: all.  Without `interpolation` the
        gloss is that of one colour, without `specular` and `relief` an MVIS without these is served.
    without
        Names of effects to leave out.
    reference
        XYZ of the colour whose gloss holds without `interpolation`; default: the mean of the primaries.
    device
        Device channels, where an image has more than the effects call for; default: no more.
    note
        What the description says besides.
    with_source
        Whether the profile holds what it is made from (`iccbrdf.icc.source_tag`).

    Raises
    ------
    InputError
        Nodes too few, too many or too close; slopes measured under other conditions than the primaries.
    UsageError
        A method or an effect is unknown, `p` or `exponent` is out of range, `slope` is asked for without
        `slopes`, or `device` lacks a channel.
    """
    for value, valid, what in (
        (interpolation, INTERPOLATIONS, "interpolation"),
        (slope_method, SLOPE_METHODS, "slope method"),
    ):
        if value not in valid:
            raise UsageError(f"{what} {value!r} is unknown: {nearest(value, valid)}")
    if not (1 <= p <= 8 and 0 < abs(exponent) <= 4):
        raise UsageError(f"p {p:g}, exponent {exponent:g}: expected p in 1..8, exponent in -4..4 and not 0")
    check_nodes(primaries)
    if slopes is not None:
        check_slopes(primaries, slopes)
    if slopes is None and effects is not None and "slope" in effect_names(effects):
        raise UsageError("the effect 'slope' is asked for, but there are no slopes, which it needs")
    chosen = chosen_effects(primaries.model, effects, without)
    recipe = {
        "model": primaries.model,
        "illuminant": primaries.illuminant,
        "observer": primaries.observer,
        "white": list(primaries.white),
        "encoding": encoding_of(primaries),
        "primaries": entries_of(primaries),
        **({"slopes": slope_entries_of(slopes), "slope_method": slope_method} if slopes is not None else {}),
        "interpolation": interpolation,
        **({"p": p, "exponent": exponent} if interpolation == "published" else {}),
        LEFT_OUT: [name for name in ("slope", "interpolation") if not chosen[name]],
    }
    if not chosen["slope"]:
        slopes = None
    model = MODELS[primaries.model]
    used = len(SCIENCE[primaries.model].channels) if chosen["specular"] else model.matte_parameters
    if chosen["interpolation"]:
        names = [f"interpolate_{interpolation}.calc"]
        constants = _nodes(primaries, interpolation, p, exponent, used)
    else:
        names = ["interpolate_constant.calc"]
        colour = np.mean(primaries.XYZ, axis=0) if reference is None else np.asarray(reference, np.float64)
        method: InterpolationMethod = "published" if interpolation == "published" else "smooth"
        parameters = interpolate(colour, primaries, method=method, p=p, exponent=exponent)
        constants = {
            "brdf": primaries.model,
            "white": primaries.white,
            "offset": parameters[:3] - colour,
            "gloss": parameters[3 : max(used, 4)],
        }
    if slopes is not None:
        names.insert(0, TEMPLATE)
        constants |= slope_constants(slopes, slope_method)
    templates = folder("calc_templates")
    texts = [((templates / name).read_text(encoding="utf-8"), name) for name in names]
    switches = {name: chosen[name] for name in ("specular", "relief")}
    compiled = compile_chain(texts, constants=constants, effects=switches)
    adjustment = f"{slope_method} slope adjustment" if slopes is not None else "no slope adjustment"
    means = f"{interpolation} interpolation" if chosen["interpolation"] else "one gloss"
    title = f"{model.title}, {means}, {adjustment}{note}"
    mid = _mid(compiled, title, primaries, slopes, device_channels(device, compiled.inputs))
    if with_source:
        mid = mid.replace(tags=source_tags(recipe, calculator_source(compiled, "A2M0", 1)))
    return ColourMid(
        mid=mid,
        listing="\n".join(_lines(compiled, title, slopes)) + "\n",
        compiled=compiled,
        effects={"slope": slopes is not None, "interpolation": chosen["interpolation"]},
    )


def _nodes(primaries: Primaries, interpolation: str, p: float, exponent: float, used: int) -> dict[str, Any]:
    """The constants of the interpolation templates, for the first `used` of the parameters."""
    constants: dict[str, Any] = {"brdf": primaries.model, "white": primaries.white}
    if interpolation == "smooth":
        solved = SmoothMap.of(primaries)
        return constants | {
            "coded_nodes": solved.nodes,
            "coefficients": solved.coefficients[:, :used],
            "constant_terms": solved.constant[:used],
        }
    return constants | {
        "node_XYZ": primaries.XYZ,
        "node_kd": primaries.parameters[:, :3],
        # A table has a column at least.
        "node_gloss": primaries.parameters[:, 3 : max(used, 4)],
        "p": p,
        "exponent": exponent,
    }


def _mid(
    compiled: Compiled, title: str, primaries: Primaries, slopes: Slopes | None, device: Sequence[str]
) -> Profile:
    """Device -> real by a matrix, real -> parameters by the program."""
    n_device, n_in, n_out = len(device), len(compiled.inputs), len(compiled.outputs)
    decode = decoding(compiled.inputs, ranges(compiled.inputs, {}), device)
    program = Calculator(inputs=n_in, outputs=n_out, program=compiled.program)
    header = Header(device_class="mid ", colour_space=f"nc{n_device:04x}", mcs=f"mc{n_out:04x}")
    tags = {
        **text_tags(f"Colour MID for {title}", compiled.outputs),
        "clrt": ColorantTable.of(device),
        "A2M0": MultiProcess(n_device, n_out, (decode, program)),
        IMAGE_TAG: image_encoding(compiled.outputs, primaries),
    }
    if slopes is not None:
        tags[SLOPES_TAG] = NumberArray("fl32", slopes.angles)
    return Profile(header, tags)


def _lines(compiled: Compiled, title: str, slopes: Slopes | None) -> Iterator[str]:
    yield title
    yield ""
    yield "Colour MID (tag A2M0): each device channel in 0..1 becomes the real value"
    for channel, (low, high) in zip(compiled.inputs, ranges(compiled.inputs, {}), strict=True):
        yield f"  {channel:<4} = {low:g} + {high - low:.9g} * device"
    yield f"and the program's outputs are the multiplex channels {' '.join(compiled.outputs)}"
    if slopes is not None:
        yield ""
        yield "Slopes: by how much the published equations jump where the colour becomes white or black"
        jumps = published_jumps(slopes, slopes.angles)
        for angle, white, black in zip(slopes.angles, jumps.white_dE, jumps.black_dE, strict=True):
            yield f"  {angle:>4g} degrees: CIEDE2000 {white:.3f} at white, {black:.3f} at black"
    yield ""
    yield (
        f"Program: {len(compiled.program)} operators, of which at most {compiled.executed} are executed "
        "for a pixel"
    )
    yield ""
    yield from compiled.documentation.splitlines()
    yield ""
    yield program_listing(compiled.program, compiled.temporaries)
