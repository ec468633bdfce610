"""A print's profiles as one graph, from the channels of its image to XYZ, whole or with effects left out.

The image comes in real values, so that a surface can be told to be flat: the graph starts where a MID has
decoded its device channels.  Effects are left out by what the channels between MID and MVIS say, so that it
works with any model that has the channels.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from iccbrdf.brdf.models import NORMAL
from iccbrdf.calc.decoding import decoding_of
from iccbrdf.calc.exact_passes import EXACT_PASSES
from iccbrdf.calc.graph import Graph, Node
from iccbrdf.calc.passes import neutral, optimise, uniform
from iccbrdf.cmm import Transform, link, standard_XYZ
from iccbrdf.cmm.arrange import without_decoding
from iccbrdf.cmm.conditions import conditions
from iccbrdf.cmm.stages import stages
from iccbrdf.cmm.steps import LabToXYZ, Step
from iccbrdf.errors import UsageError
from iccbrdf.icc import Profile

Array = npt.NDArray[Any]
Convert = Callable[[Array], Array]

RELIEF, GLOSS, GLOSS_COLOUR, SLOPE_COLOUR = EFFECTS = ("relief", "gloss", "gloss-colour", "slope-colour")
"""What a page may leave out: the normals (the print is flat), specular reflection, a specular reflection
that for X and Z is another than for Y, and the change of colours on slopes."""

_UP = dict(zip(NORMAL, (0.0, 0.0, 1.0), strict=True))
_XYZ = ("X", "Y", "Z")


@dataclass(frozen=True)
class Chain:
    """What maps the page's image to XYZ.

    Attributes
    ----------
    channels
        Names of the image's channels, which hold real values.
    convert
        From pixels as the file has them, (..., channels of the file), to those channels.
    before, multiplex, after
        The steps of the MIDs, the names of the channels that they give, and the steps of the MVIS.
    mvis
        The last profile.
    variables, env
        The run-time variables that the steps read, and the values of those that are set.
    """

    channels: tuple[str, ...]
    convert: Convert
    before: tuple[Step, ...]
    multiplex: tuple[str, ...]
    after: tuple[Step, ...]
    mvis: Profile
    variables: tuple[str, ...]
    env: Mapping[str, float]

    @property
    def white(self) -> tuple[float, float, float]:
        """XYZ of the white under the MVIS's own conditions."""
        return conditions(self.mvis).white


def whole_chain(
    profiles: Sequence[Profile],
    names: Sequence[str] | None,
    samples: str,
    env: Mapping[str, float],
    intent: str = "relative",
) -> Chain:
    """The chain of MID and MVIS, or of an MVIS alone, for an image of channels `names`.

    `names` is None for an image with the first profile's channels; `samples` as the image has them.  Raises
    as `iccbrdf.link`; LinkError also where the first profile does not begin by decoding its channels one by
    one, UsageError where the chain does not end on XYZ or Lab.
    """
    channels, convert = _decoding(profiles[0], names, samples, intent)
    transform = link(profiles, samples="real", channels=channels, env=env, intent=intent)
    before: tuple[Step, ...] = ()
    multiplex = channels
    if len(profiles) > 1:
        mid = link(profiles[:-1], samples="real", channels=channels, intent=intent)
        before, multiplex = mid.steps, mid.channels_out
    return _chain(transform, profiles[-1], convert, before, multiplex)


def brdf_chain(
    profiles: Sequence[Profile],
    names: Sequence[str] | None,
    samples: str,
    env: Mapping[str, float],
    intent: str = "relative",
) -> Chain:
    """As `whole_chain`, with the MID run now: the page's image is the BRDF image.

    For MIDs that a page cannot compute.  Raises UsageError where there is none.
    """
    if len(profiles) < 2:
        raise UsageError(f"{profiles[0].source} stands alone, expected a MID before it")
    mid = link(profiles[:-1], samples=samples, channels=names, intent=intent)
    transform = link(profiles[-1:], channels=mid.channels_out, env=env, intent=intent)
    return _chain(transform, profiles[-1], mid, (), mid.channels_out)


def _chain(
    transform: Transform,
    mvis: Profile,
    convert: Convert,
    before: tuple[Step, ...],
    multiplex: tuple[str, ...],
) -> Chain:
    if transform.channels_out not in (_XYZ, ("L*", "a*", "b*")):
        raise UsageError(
            f"{mvis.source} gives {', '.join(transform.channels_out)}; the last profile of a page gives "
            "XYZ or Lab, as an MVIS does"
        )
    return Chain(
        channels=transform.channels_in,
        convert=convert,
        before=before,
        multiplex=multiplex,
        after=transform.steps[len(before) :],
        mvis=mvis,
        variables=transform.variables,
        env=transform.env,
    )


def _decoding(
    profile: Profile, names: Sequence[str] | None, samples: str, intent: str
) -> tuple[tuple[str, ...], Convert]:
    """Names of the real channels of an image, and how they are had from its samples."""
    stage = stages([profile], intent)[0]
    own = stage.source.names
    given = own if names is None else tuple(names)
    bare = without_decoding(stage)
    if samples == "real" or bare is stage:
        return given, lambda pixels: pixels
    decoding = decoding_of(stage.process.elements[0])
    if decoding is None or not set(given) <= set(own):
        # A name that the profile does not have is left for `link` to complain about.
        return given, lambda pixels: pixels
    # Channels that go no further stay as they are.
    factors, offsets = np.ones(len(own), np.float32), np.zeros(len(own), np.float32)
    sources = list(decoding.sources)
    factors[sources], offsets[sources] = decoding.factors, decoding.offsets
    order = [own.index(name) for name in given]
    factors, offsets = factors[order], offsets[order]
    return given, lambda pixels: pixels * factors + offsets


# Graphs ------------------------------------------------------------------------------------------------


class Graphs(NamedTuple):
    """Of one chain, with the same nodes."""

    display: Graph
    """From the channels of the image to XYZ under D50, where displays start."""
    pixel: Graph
    """To XYZ under the MVIS's own conditions, and then the multiplex channels."""


def graphs(chain: Chain, without: Collection[str] = ()) -> Graphs:
    """The graphs of a chain without some of its effects.

    Raises UnsupportedError where there is no graph of a step.
    """
    graph = Graph(dtype=np.float32)
    channels, own = _lifted(chain, graph, without)
    standard = _run(standard_XYZ(chain.mvis).steps, graph, own)
    if chain.mvis.header.pcs == "Lab ":
        own = _run([LabToXYZ(chain.white)], graph, own)
    graph.outputs = (*standard, *own, *channels)
    graph, _ = optimise(graph, _PASSES)
    display, pixel = graph.outputs[: len(standard)], graph.outputs[len(standard) :]
    return Graphs(replace(graph, outputs=display), replace(graph, outputs=pixel))


def _lifted(chain: Chain, graph: Graph, without: Collection[str]) -> tuple[list[Node], list[Node]]:
    """Multiplex channels, and what the MVIS makes of them."""
    image = {name: graph.input(i) for i, name in enumerate(chain.channels)}
    flat = {name: graph.number(_UP[name]) if name in _UP else node for name, node in image.items()}
    used = flat if RELIEF in without else image

    def multiplex(of: Mapping[str, Node]) -> dict[str, Node]:
        nodes = _run(chain.before, graph, [of[name] for name in chain.channels])
        return dict(zip(chain.multiplex, nodes, strict=True))

    channels = multiplex(used)
    if SLOPE_COLOUR in without:
        channels |= {name: node for name, node in multiplex(flat).items() if name not in NORMAL}
    if RELIEF in without:
        channels |= {name: graph.number(_UP[name]) for name in NORMAL if name in channels}
    for name in channels:
        family, _, axis = name.partition(".")
        if GLOSS in without and family == "ks":
            channels[name] = graph.number(0)
        elif GLOSS_COLOUR in without and family in ("ks", "m") and axis:
            channels[name] = channels.get(f"{family}.Y", channels[name])
    nodes = list(channels.values())
    return nodes, _run(chain.after, graph, nodes)


def _run(steps: Sequence[Step], graph: Graph, nodes: Sequence[Node]) -> list[Node]:
    for step in steps:
        nodes = step.lift(graph, nodes, finite_inputs=True)
    return list(nodes)


def nothing_of(graph: Graph, node: Node) -> Node | None:
    """0 x and 0 / x are 0: right for finite numbers, which is what is shown."""
    if node.op == "mul" and 0 in (uniform(node.arguments[0]), uniform(node.arguments[1])):
        return graph.number(0)
    if node.op == "div" and uniform(node.arguments[0]) == 0:
        return graph.number(0)
    return None


MOST_CUT_OFF = 4096.0
"""In float32 x + 4096 loses what is below 2^-12 of x, which nobody sees; 2^23 would make whole numbers."""


def digits_kept(graph: Graph, node: Node) -> Node | None:
    """(x + c) - c is x, x - x is 0: how programs cut digits off, which drivers of GPUs do not promise to do.

    Nobody sees what they gain by it near the horizon, and shaders with it take long to compile.
    """
    if node.op != "sub":
        return None
    left, right = node.arguments
    if left is right:
        return graph.number(0)
    cut = uniform(right)
    if cut is None or abs(cut) > MOST_CUT_OFF or left.op != "add" or uniform(left.arguments[1]) != cut:
        return None
    return left.arguments[0]


_PASSES = (*EXACT_PASSES, ("finite numbers", (neutral, nothing_of, digits_kept)))


def defaults(graph: Graph) -> dict[str, float]:
    """The values that hold for run-time variables that are not set, where the graph says so by a constant."""
    found: dict[str, float] = {}
    for node in graph.live():
        if node.op != "select":
            continue
        condition, yes, no = node.arguments
        if condition.op == "defined" and yes.op == "variable" and no.op == "const":
            found[yes.detail] = float(no.detail[0])
    return found
