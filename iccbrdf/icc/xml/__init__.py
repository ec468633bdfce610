"""Profiles in the ICC's XML dialect, IccXML: written, and read with all limits on."""

from iccbrdf.icc.xml.document import profile_from_xml, profile_to_xml, read_xml
from iccbrdf.icc.xml.node import MAX_BYTES

__all__ = ["MAX_BYTES", "profile_from_xml", "profile_to_xml", "read_xml"]
