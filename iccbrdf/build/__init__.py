"""Templates and parameters -> MID and MVIS profiles."""

from iccbrdf.build.models import MODELS
from iccbrdf.build.pair import Pair, build_pair

__all__ = ["MODELS", "Pair", "build_pair"]
