"""A print as one HTML file: its image, its profiles as programs, and the controls, all in it.

The page asks for nothing over the network, which its content security policy forbids, and runs no script
but the one that this module hashes.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from iccbrdf.errors import InputError, LinkError, UnsupportedError
from iccbrdf.files import as_text
from iccbrdf.icc import Profile
from iccbrdf.images import ImageSource
from iccbrdf.scene import LIGHT, VIEW
from iccbrdf.viewer.chain import Chain, brdf_chain, defaults, graphs, whole_chain
from iccbrdf.viewer.display import NODES, Display
from iccbrdf.viewer.glsl import functions_for, literal
from iccbrdf.viewer.image import Layer, layers, reduced
from iccbrdf.viewer.programs import Program, Programs, make_programs

MAX_PIXELS = 4_000_000
"""Of a page: some 70 MB and three seconds to open; browsers are slow to read longer texts."""

_SCRIPTS = ("data.js", "pads.js", "readout.js", "renderer.js", "page.js")
_INTENSITY = "litI"


@dataclass(frozen=True)
class Print:
    """What a page shows, before it is text."""

    chain: Chain
    layers: list[Layer]
    programs: Programs
    divisor: int
    """By what the image was made smaller."""
    original: tuple[int, int]
    """Height and width of the image."""
    run_now: str | None
    """Why the MID was run when the page was made, where it was."""

    @property
    def size(self) -> tuple[int, int]:
        """Height and width of the page's image."""
        height, width = self.layers[0].codes.shape
        return height, width


@dataclass(frozen=True)
class Start:
    """What is set when the page is opened, besides light and view.

    Attributes
    ----------
    auto_lamp
        Whether the lamp is the brighter the lower it stands, so that a flat print stays as bright.
    soft_highlights
        Whether highlights are rolled off (iccbrdf.images.showing) instead of clipped.
    exposure
        Factor on XYZ.
    """

    auto_lamp: bool = False
    soft_highlights: bool = False
    exposure: float = 1.0


def read_print(
    source: ImageSource,
    profiles: Sequence[Profile],
    names: Sequence[str] | None,
    env: Mapping[str, float],
    *,
    intent: str = "relative",
    max_pixels: int = MAX_PIXELS,
) -> Print:
    """The image of `source` with its profiles.

    Parameters
    ----------
    profiles
        A MID and an MVIS, or an MVIS alone, which takes the image's channels.
    names
        Of the image's channels; None for those of the first profile.
    env
        Run-time variables that the page starts with.
    max_pixels
        Above which the image is made smaller.

    Raises
    ------
    UnsupportedError
        The MVIS holds what GLSL cannot say.
    InputError
        The profiles know no light.
    LinkError, ProfileError, UsageError
        As `iccbrdf.link`.
    """
    run_now = None
    try:
        chain = whole_chain(profiles, names, source.samples, env, intent)
        programs = make_programs(chain)
    except (UnsupportedError, LinkError) as error:
        if len(profiles) < 2:
            raise
        run_now = str(error)
        chain = brdf_chain(profiles, names, source.samples, env, intent)
        programs = make_programs(chain)
    if not set(LIGHT) & set(chain.variables):
        raise InputError(
            f"{chain.mvis.source}: reads no run-time variable for the light ({', '.join(LIGHT)}): "
            "there is nothing to move"
        )
    image, divisor = reduced(source, chain.convert, len(chain.channels), max_pixels)
    coded = layers(image, chain.channels)
    gaps = [k for k, layer in enumerate(coded) if layer.has_gaps]
    if gaps:
        programs = make_programs(chain, gaps)
    return Print(chain, coded, programs, divisor, (source.height, source.width), run_now)


def make_page(shown: Print, display: Display, title: str, start: Start | None = None) -> str:
    """The text of the page."""
    values = _page(shown, display, title, start or Start())
    page = _without_tags(json.dumps(values, separators=(",", ":")))
    style = _file("page.css")
    script = "\n".join([_functions(shown.programs), *map(_file, _SCRIPTS)])
    policy = (
        f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    parts = {
        "policy": policy,
        "title": html.escape(as_text(title)),
        "style": style,
        "page": page,
        "layers": "".join(f'<i data-codes="{layer.packed()}"></i>' for layer in shown.layers),
        "script": script,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _file("page.html"))


def shader(program: Program, coded: Sequence[Layer], display: Display) -> str:
    """The fragment shader of a program."""
    parts = {
        "ARGUMENTS": str(max(1, program.arguments)),
        "CHANNELS": str(len(coded)),
        "SCALES": ", ".join(literal(layer.scale) for layer in coded),
        "ZEROS": ", ".join(str(layer.zero) for layer in coded),
        "FUNCTIONS": functions_for(program.body),
        "BODY": program.body,
        "DISPLAY": display.function.strip(),
    }
    return re.sub(r"\b(" + "|".join(parts) + r")\b", lambda found: parts[found[1]], _file("shader.glsl"))


def _page(shown: Print, display: Display, title: str, start: Start) -> dict[str, Any]:
    chain, (height, width) = shown.chain, shown.size
    known = {**defaults(graphs(chain).display), **chain.env}
    return {
        "title": title,
        "width": width,
        "height": height,
        "size": _size_text(shown),
        "about": _about(shown, display),
        "channels": chain.channels,
        "multiplex": chain.multiplex,
        "scales": [layer.scale for layer in shown.layers],
        "zeros": [layer.zero for layer in shown.layers],
        "white": chain.white,
        "variables": chain.variables,
        "env": dict(chain.env),
        "light": [known.get(name, 0.0) for name in LIGHT],
        "view": [known.get(name, 0.0) for name in VIEW] if VIEW[2] in known else [0, 0, 1],
        "intensity": known.get(_INTENSITY) if _INTENSITY in chain.variables else None,
        "start": {
            "auto": start.auto_lamp,
            "soft": start.soft_highlights,
            "exposure": math.log2(start.exposure),
        },
        "effects": shown.programs.effects,
        "of": {",".join(without): index for without, index in _every_choice(shown.programs)},
        "programs": [
            {"shader": shader(program, shown.layers, display), "operations": program.operations}
            for program in shown.programs.programs
        ],
        "display": {"canvas": display.canvas, "table": display.table, "nodes": NODES},
    }


def _every_choice(programs: Programs) -> list[tuple[list[str], int]]:
    return [(sorted(without), index) for without, index in programs.of.items()]


def _size_text(shown: Print) -> str:
    height, width = shown.original
    text = f"{width} × {height} pixels"
    return text if shown.divisor == 1 else f"{text}, shown at 1 : {shown.divisor}"


def _about(shown: Print, display: Display) -> str:
    text = f"Display: {display.name}. {shown.programs.whole.operations} operations a pixel."
    if shown.divisor > 1:
        height, width = shown.size
        text += f" Each pixel is the mean of {shown.divisor} × {shown.divisor}: {width} × {height} in all."
    return text


def _functions(programs: Programs) -> str:
    entries = (f"{{ uniforms: {p.uniforms},\npixel: {p.pixel} }}" for p in programs.programs)
    return "const FUNCTIONS = [\n" + ",\n".join(entries) + "\n];"


def _file(name: str) -> str:
    return (files("iccbrdf.viewer") / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _without_tags(text: str) -> str:
    """JSON that no HTML parser takes for the end of its element."""
    return text.replace("<", "\\u003c")
