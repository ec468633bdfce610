"""Directional appearance in ICC.2 profiles.

>>> import iccbrdf
>>> transform = iccbrdf.link(["mid.icc", "mvis.icc"], env={"litX": 0.5})     # doctest: +SKIP
>>> XYZ = transform(brdf_image)                                              # doctest: +SKIP

What stands here is the public face; the modules behind it are imported when a name is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iccbrdf.errors import (
    IccBrdfError,
    IccBrdfWarning,
    InputError,
    InputWarning,
    LimitError,
    LinkError,
    ProfileError,
    ProfileWarning,
    UnsupportedError,
    UsageError,
    VariableError,
)
from iccbrdf.lazy import lazy_names

if TYPE_CHECKING:
    from iccbrdf.cmm import Transform, link, named_colours
    from iccbrdf.icc import Profile, read_profile, write_profile

__version__ = "0.1.0"

_LAZY = {
    "Profile": "iccbrdf.icc",
    "Transform": "iccbrdf.cmm",
    "link": "iccbrdf.cmm",
    "named_colours": "iccbrdf.cmm",
    "read_profile": "iccbrdf.icc",
    "write_profile": "iccbrdf.icc",
}

__all__ = [
    "IccBrdfError",
    "IccBrdfWarning",
    "InputError",
    "InputWarning",
    "LimitError",
    "LinkError",
    "Profile",
    "ProfileError",
    "ProfileWarning",
    "Transform",
    "UnsupportedError",
    "UsageError",
    "VariableError",
    "__version__",
    "link",
    "named_colours",
    "read_profile",
    "write_profile",
]


__getattr__ = lazy_names(__name__, _LAZY)


def __dir__() -> list[str]:
    return __all__
