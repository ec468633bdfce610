"""Images in and out: TIFF streams, normal and height maps, PNG for the display."""

from iccbrdf.images.blocks import Block
from iccbrdf.images.record import Samples
from iccbrdf.images.tiff_reader import TiffSource, open_tiff
from iccbrdf.images.tiff_writer import TiffSink, create_tiff

__all__ = ["Block", "Samples", "TiffSink", "TiffSource", "create_tiff", "open_tiff"]
