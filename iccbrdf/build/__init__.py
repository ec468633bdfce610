"""Templates and parameters -> MID and MVIS profiles."""

from typing import TYPE_CHECKING

from iccbrdf.build.private_tags import image_link, last_slope
from iccbrdf.lazy import lazy_names

if TYPE_CHECKING:
    from iccbrdf.build.colour_mid import INTERPOLATIONS, SLOPE_METHODS, ColourMid, build_colour_mid
    from iccbrdf.build.models import MODELS
    from iccbrdf.build.pair import Pair, build_pair
    from iccbrdf.build.table import GRIDS, Tables, build_tables

# Running a profile needs what it says beside its transform, but not what builds one.
__getattr__ = lazy_names(
    __name__,
    {
        "GRIDS": "iccbrdf.build.table",
        "INTERPOLATIONS": "iccbrdf.build.colour_mid",
        "MODELS": "iccbrdf.build.models",
        "SLOPE_METHODS": "iccbrdf.build.colour_mid",
        "ColourMid": "iccbrdf.build.colour_mid",
        "Pair": "iccbrdf.build.pair",
        "Tables": "iccbrdf.build.table",
        "build_colour_mid": "iccbrdf.build.colour_mid",
        "build_pair": "iccbrdf.build.pair",
        "build_tables": "iccbrdf.build.table",
    },
)

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
