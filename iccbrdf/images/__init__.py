"""Images in and out: TIFF streams, normal and height maps, PNG for the display."""

from typing import TYPE_CHECKING

from iccbrdf.images.blocks import Block, Place
from iccbrdf.images.in_order import in_order, processors
from iccbrdf.images.record import Samples
from iccbrdf.images.tiff_reader import TiffSource, open_tiff
from iccbrdf.images.tiff_writer import TiffSink, create_tiff
from iccbrdf.images.with_normals import ImageSource, WithNormals
from iccbrdf.lazy import lazy_names

if TYPE_CHECKING:
    from iccbrdf.images.display import PngSink, create_png, srgb_profile, xyz_to_srgb
    from iccbrdf.images.normals import height_to_normals, read_height_map, read_normal_map
    from iccbrdf.images.pictures import read_picture

# From TIFF to TIFF there is no need of codecs and displays.
__getattr__ = lazy_names(
    __name__,
    {
        **dict.fromkeys(("PngSink", "create_png", "srgb_profile", "xyz_to_srgb"), "iccbrdf.images.display"),
        **dict.fromkeys(
            ("height_to_normals", "read_height_map", "read_normal_map"), "iccbrdf.images.normals"
        ),
        "read_picture": "iccbrdf.images.pictures",
    },
)

__all__ = [
    "Block",
    "ImageSource",
    "Place",
    "PngSink",
    "Samples",
    "TiffSink",
    "TiffSource",
    "WithNormals",
    "create_png",
    "create_tiff",
    "height_to_normals",
    "in_order",
    "open_tiff",
    "processors",
    "read_height_map",
    "read_normal_map",
    "read_picture",
    "srgb_profile",
    "xyz_to_srgb",
]
