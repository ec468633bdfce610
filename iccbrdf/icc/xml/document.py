"""A whole profile as an XML document and back."""

from __future__ import annotations

import os
from pathlib import Path

from lxml import etree

from iccbrdf.errors import UsageError
from iccbrdf.icc.profile import Profile
from iccbrdf.icc.source_tag import readable_source
from iccbrdf.icc.xml import calculator, classic, luts, sequence, sparse, tags  # noqa: F401  (they add their forms to the tables)
from iccbrdf.icc.xml.node import Document, Job, Target, parse
from iccbrdf.icc.xml.whole import ROOT, read_whole, write_whole


def profile_to_xml(profile: Profile) -> bytes:
    """The profile as a document that `profile_from_xml` and the ICC's `iccFromXml` read.

    Numbers are written so that they come back the same; a NaN loses what its bits say besides.  Tags of a
    type that this library does not know are written as bytes.  What the private tag of
    `iccbrdf.icc.source_tag` says about channels and temporaries becomes names in the programs.

    Raises
    ------
    ProfileError
        A tag is malformed, or a program is no sequence of known operators.
    UnsupportedError
        The profile holds what XML cannot, such as a control character in a text.
    LimitError
        The document would be too large for XML readers.
    """
    root = etree.Element(ROOT)
    source = readable_source(profile, profile.source)
    names = {id(element): one for element, one in source.found_in(profile)}
    write_whole(Target(root, Job(profile.source, names)), profile)
    etree.indent(root)
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8")) + b"\n"


def profile_from_xml(
    data: bytes,
    source: str = "<xml>",
    *,
    folder: str | os.PathLike[str] | None = None,
    strict: bool = False,
) -> Profile:
    """The profile that a document describes, as `iccToXml` or `profile_to_xml` writes it.

    Parameters
    ----------
    data
        The document.  Its character encoding is the one that it declares.
    source
        Its name in messages.
    folder
        Where the files are that it names (imports, tables, texts, images).  They must lie in this folder or
        below; without it, a document that names a file is refused.
    strict
        Refuse what the ICC's tools pass over without a word: attributes and elements that are not known,
        numbers with something behind them, gaps between the segments of a curve.  Otherwise it is ignored
        with a ProfileWarning.

    Raises
    ------
    InputError
        It is no well-formed XML, or a file that it names cannot be read.
    ProfileError
        It describes no profile: file, line and element, what was found and what was expected.
    LimitError
        It, with the files that it names, is larger or deeper than the limits.
    """
    document = Document(None if folder is None else Path(folder), strict=strict)
    return read_whole(parse(data, source, document))


def read_xml(
    path: str | os.PathLike[str],
    *,
    folder: str | os.PathLike[str] | None = None,
    strict: bool = False,
) -> Profile:
    """Read a document from a file; `folder` is that of the file by default.  Else as `profile_from_xml`."""
    try:
        file = Path(path)
        document = Document(file.parent if folder is None else Path(folder), strict=strict)
    except TypeError as error:
        raise UsageError(f"not the path of an XML file: {error}") from None
    return read_whole(parse(document.read(file), str(path), document))
