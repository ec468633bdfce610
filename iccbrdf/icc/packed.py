"""Tag types that carry data of other formats: compressed texts, and images of surfaces."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

from iccbrdf.errors import LimitError, ProfileError, UsageError
from iccbrdf.icc.fields import F32, U32, Bytes, tag_layout
from iccbrdf.icc.layout import Field, Record
from iccbrdf.icc.tags import TAGS

MAX_TEXT = 64 << 20
"""Bytes of a compressed text when it is unpacked."""

FORMATS = ("PNG", "TIFF")
"""Image formats by their number."""


class _Compressed(Record):
    """What the two compressed texts share: `data` is the zlib stream as it stands."""

    data: bytes

    @property
    def text(self) -> str:
        """The text; ProfileError where the data is no compressed UTF-8, LimitError beyond MAX_TEXT bytes."""
        return self.unpacked(MAX_TEXT)

    def unpacked(self, most: int) -> str:
        """The text, which may have so many bytes; errors as those of `text`."""
        unpacker = zlib.decompressobj()
        try:
            plain = unpacker.decompress(self.data, most)
        except zlib.error as error:
            raise ProfileError(f"{self.signature}: the text cannot be unpacked: {error}") from None
        if unpacker.unconsumed_tail:
            raise LimitError(f"{self.signature}: more than {most} bytes of text when unpacked")
        if not unpacker.eof:
            raise ProfileError(f"{self.signature}: the compressed text ends before its end")
        try:
            return plain.decode("utf-8").rstrip("\0")
        except UnicodeDecodeError as error:
            raise ProfileError(f"{self.signature}: the text is no UTF-8: {error.reason}") from None


def _compress(text: str) -> bytes:
    try:
        return zlib.compress(text.encode("utf-8"), 9)
    except (AttributeError, UnicodeEncodeError):
        raise UsageError(f"found {text!r}, expected text") from None


@TAGS.add("zut8")
@dataclass(frozen=True, eq=False)
class CompressedUtf8(_Compressed):
    """utf8ZipType: compressed UTF-8 text."""

    data: bytes

    signature = "zut8"
    layout = tag_layout(signature, Field("data", Bytes()))

    @classmethod
    def of(cls, text: str) -> CompressedUtf8:
        """The tag of a text."""
        return cls(_compress(text))


@TAGS.add("zxml")
@dataclass(frozen=True, eq=False)
class CompressedXml(_Compressed):
    """zipXmlType: compressed XML, such as CxF."""

    data: bytes

    signature = "zxml"
    layout = tag_layout(signature, Field("data", Bytes()))

    @classmethod
    def of(cls, text: str) -> CompressedXml:
        """The tag of a text."""
        return cls(_compress(text))


@TAGS.add("ZXML")
@dataclass(frozen=True, eq=False)
class VendorXml(CompressedXml):
    """The same under the signature that X-Rite gives it, in tags for CxF."""

    data: bytes

    signature = "ZXML"
    layout = tag_layout(signature, Field("data", Bytes()))


@TAGS.add("ehim")
@dataclass(frozen=True, eq=False)
class HeightImage(Record):
    """embeddedHeightImageType: the relief of a surface as an image file (tag `smap`).

    seamless : 1 if the image may be repeated side by side
    format : 0 PNG, 1 TIFF
    lowest, highest : heights in metres of the least and of the greatest pixel value
    image : the file
    """

    seamless: int
    format: int
    lowest: float
    highest: float
    image: bytes

    signature = "ehim"
    layout = tag_layout(
        signature,
        Field("seamless", U32),
        Field("format", U32, valid=range(len(FORMATS))),
        Field("lowest", F32),
        Field("highest", F32),
        Field("image", Bytes()),
    )


@TAGS.add("enim")
@dataclass(frozen=True, eq=False)
class NormalImage(Record):
    """embeddedNormalImageType: the normals of a surface as an image file (tag `smap`).

    Red and green stand for x and y in -1..1, blue for z in 0..1.  The fields are those of `HeightImage`.
    """

    seamless: int
    format: int
    image: bytes

    signature = "enim"
    layout = tag_layout(
        signature,
        Field("seamless", U32),
        Field("format", U32, valid=range(len(FORMATS))),
        Field("image", Bytes()),
    )
