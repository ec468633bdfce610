"""A print job -> proofs: colours in, the relief, lights and views, pictures for a display, and a log.

Follow one pixel: CMYK -> XYZ of the flat print (`colour_in`), with the normal of the relief (`relief`) ->
BRDF parameters, and from them XYZ under each light (`render`) -> the display (`iccbrdf.images.showing`).
"""

from typing import TYPE_CHECKING

from iccbrdf.lazy import lazy_names

if TYPE_CHECKING:
    from iccbrdf.proof.job import SETTINGS, Job, make_job, read_job
    from iccbrdf.proof.make import make_proof

# The settings are needed to show what the command can do, the rest only to do it.
__getattr__ = lazy_names(
    __name__,
    {
        "SETTINGS": "iccbrdf.proof.job",
        "Job": "iccbrdf.proof.job",
        "make_job": "iccbrdf.proof.job",
        "make_proof": "iccbrdf.proof.make",
        "read_job": "iccbrdf.proof.job",
    },
)

__all__ = ["SETTINGS", "Job", "make_job", "make_proof", "read_job"]
