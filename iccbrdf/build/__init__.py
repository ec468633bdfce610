"""Templates and parameters -> MID and MVIS profiles."""

from iccbrdf.build.colour_mid import (
    INTERPOLATIONS,
    SLOPE_METHODS,
    ColourMid,
    build_colour_mid,
    last_slope,
)
from iccbrdf.build.models import MODELS
from iccbrdf.build.pair import Pair, build_pair

__all__ = [
    "INTERPOLATIONS",
    "MODELS",
    "SLOPE_METHODS",
    "ColourMid",
    "Pair",
    "build_colour_mid",
    "build_pair",
    "last_slope",
]
