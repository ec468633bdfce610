"""From XYZ under D50 to the levels of a display, as GLSL: sRGB and Display P3 by formula, others by a table.

What the page shows is what `iccbrdf.images.showing` shows with highlights clipped.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass

import numpy as np

from iccbrdf.icc import XYZ, Profile
from iccbrdf.images.little_cms import from_XYZ
from iccbrdf.images.showing import DISPLAYS, display_profile
from iccbrdf.viewer.glsl import literal

CANVAS = {"srgb": "srgb", "display-p3": "display-p3"}
"""What browsers call the displays that need no profile."""

NODES = 49
"""Of the table along each axis: 0.9 MB, and within a level or so of what Little CMS computes."""

# ROMM RGB (ISO 22028-2), D50: its corners lie around all colours that can be printed, and 1, 1, 1 is white.
_ROMM_TO_XYZ = np.array([[0.7977, 0.1352, 0.0313], [0.2880, 0.7119, 0.0001], [0.0, 0.0, 0.8249]])
_CODED = 1 / 2.2


@dataclass(frozen=True)
class Display:
    """How a page shows XYZ.

    Attributes
    ----------
    name
        For people.
    canvas
        The colour space of the page's canvas.
    function
        GLSL: `vec3 shown(vec3 xyz)`, from XYZ to levels in 0..1.
    table
        Base64 of half floats, NODES^3 x 4, that `function` reads from the texture `table`; or None.
    operations
        Arithmetic for a pixel, in additions.
    """

    name: str
    canvas: str
    function: str
    table: str | None
    operations: int


def make_display(display: str) -> Display:
    """The display of that name, or of the profile of that path.

    Raises as `iccbrdf.images.showing.display_profile`.
    """
    profile = display_profile(display)
    if display in DISPLAYS:
        return Display(display, CANVAS[display], _by_formula(profile), None, operations=15 + 3 * 18)
    function = _FUNCTION.format(prepare=_matrix(np.linalg.inv(_ROMM_TO_XYZ), "wide"), show=_LOOKED_UP)
    return Display(display, "srgb", function, _table(profile), operations=15 + 3 * 12 + 30)


_FUNCTION = """
{prepare}
vec3 shown(vec3 xyz) {{
  {show}
}}
"""
_LOOKED_UP = f"""vec3 coded = pow(clamp(wide(xyz), 0.0, 1.0), vec3({literal(_CODED)}));
  return textureLod(table, (coded * {NODES - 1}.0 + 0.5) / {NODES}.0, 0.0).rgb;"""
_CURVE = """vec3 linear = clamp(own(xyz), 0.0, 1.0);
  vec3 curved = 1.055 * pow(max(linear, 1e-3), vec3(1.0 / 2.4)) - 0.055;
  return mix(12.92 * linear, curved, step(0.0031308, linear));"""


def _by_formula(profile: Profile) -> str:
    columns = [profile[tag] for tag in ("rXYZ", "gXYZ", "bXYZ")]
    matrix = np.array([column.values[0] for column in columns if isinstance(column, XYZ)]).T
    return _FUNCTION.format(prepare=_matrix(np.linalg.inv(matrix), "own"), show=_CURVE)


def _matrix(matrix: np.ndarray, name: str) -> str:
    # GLSL's matrices go column by column.
    numbers = ", ".join(literal(v) for v in matrix.T.ravel().tolist())
    return f"vec3 {name}(vec3 xyz) {{ return mat3({numbers}) * xyz; }}"


def _table(profile: Profile) -> str:
    axis = np.linspace(0, 1, NODES) ** (1 / _CODED)
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    xyz = np.stack([red, green, blue], axis=-1).reshape(NODES, -1, 3) @ _ROMM_TO_XYZ.T
    levels = from_XYZ(xyz, profile).clip(0, 1)
    texels = np.concatenate([levels, np.ones_like(levels[..., :1])], axis=-1).astype("<f2")
    return base64.b64encode(texels.tobytes()).decode("ascii")
