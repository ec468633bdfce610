"""Which template holds a model, and how it is set up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Model:
    """`title` for people; `template`, a file in calc_templates; `effects` that the model itself sets."""

    title: str
    template: str
    effects: Mapping[str, bool] = field(default_factory=dict)
    has_refractive_index: bool = False


MODELS = {
    "brdf1": Model("Cook-Torrance 2023, BRDF1", "cook_torrance.calc", {"chromatic_roughness": False}, True),
    "brdf2": Model("Cook-Torrance 2023, BRDF2", "cook_torrance.calc", {"chromatic_roughness": True}, True),
    "cook_torrance_2020": Model("Cook-Torrance 2020", "cook_torrance_2020.calc"),
    "ward": Model("isotropic Ward 2020", "ward.calc"),
}
"""The models by the name that a primaries file gives."""
