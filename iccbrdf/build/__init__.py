"""Templates and parameters -> MID and MVIS profiles."""

from iccbrdf.build.brdf_image import image_link
from iccbrdf.build.colour_mid import (
    INTERPOLATIONS,
    SLOPE_METHODS,
    ColourMid,
    build_colour_mid,
    last_slope,
)
from iccbrdf.build.models import MODELS
from iccbrdf.build.pair import Pair, build_pair
from iccbrdf.build.table import GRIDS, Tables, build_tables

__all__ = [
    "GRIDS",
    "INTERPOLATIONS",
    "MODELS",
    "SLOPE_METHODS",
    "ColourMid",
    "Pair",
    "Tables",
    "build_colour_mid",
    "build_pair",
    "build_tables",
    "image_link",
    "last_slope",
]
