"""Profiles -> a Transform: routing by channel name, connection spaces and conditions, environment."""

from iccbrdf.cmm.execution import BACKENDS, Tally
from iccbrdf.cmm.link import link
from iccbrdf.cmm.ramps import named_colours
from iccbrdf.cmm.stages import INTENTS
from iccbrdf.cmm.standard import standard_XYZ
from iccbrdf.cmm.transform import MAX_COST, Transform

__all__ = ["BACKENDS", "INTENTS", "MAX_COST", "Tally", "Transform", "link", "named_colours", "standard_XYZ"]
