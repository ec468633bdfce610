"""Which template holds a model, and how it is set up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Model:
    """`title` for people; `template`, a file in calc_templates; `effects` and `choices` it sets itself."""

    title: str
    template: str
    effects: Mapping[str, bool] = field(default_factory=dict)
    has_refractive_index: bool = False
    choices: Mapping[str, str] = field(default_factory=dict)
    matte_parameters: int = 3
    """So many of its parameters, from the first on, matter without the effect `specular`."""


MODELS = {
    "brdf1": Model("Cook-Torrance 2023, BRDF1", "cook_torrance.calc", {"chromatic_roughness": False}, True),
    "brdf2": Model("Cook-Torrance 2023, BRDF2", "cook_torrance.calc", {}, True, {"brdf": "brdf2"}),
    "cook_torrance_2020": Model("Cook-Torrance 2020", "cook_torrance_2020.calc", matte_parameters=4),
    "ward": Model("isotropic Ward 2020", "ward.calc"),
}
"""The models by the name that a primaries file gives."""
