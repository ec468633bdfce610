"""A whole profile in XML: the outermost element of a document, or what is inside a tag."""

from __future__ import annotations

from typing import Any

from iccbrdf.errors import LimitError, ProfileError, UsageError
from iccbrdf.icc.profile import Profile
from iccbrdf.icc.reader import MAX_DEPTH
from iccbrdf.icc.sequence import EmbeddedProfile
from iccbrdf.icc.xml.composite import TYPE_FORMS, NamedTags
from iccbrdf.icc.xml.forms import Form, Part, Seen
from iccbrdf.icc.xml.header import HEADER
from iccbrdf.icc.xml.node import MAX_PROFILES, Node, Target
from iccbrdf.icc.xml.tag_names import TAG_NAMES

ROOT = "IccProfile"
_TAGS = NamedTags(TAG_NAMES, "PrivateTag")


def read_whole(root: Node) -> Profile:
    """The profile of an <IccProfile>."""
    if root.name != ROOT:
        raise root.error(f"expected <{ROOT}> as the outermost element")
    root.expect((), ("Header", "Tags"))
    header, body = (root.required(name) for name in ("Header", "Tags"))
    found: dict[str, Any] = _TAGS.read(body)
    try:
        return Profile(HEADER.read(header), found, source=root.source)
    except UsageError as error:
        raise body.error(str(error)) from None


def write_whole(out: Target, profile: Profile) -> None:
    """Put a profile into an <IccProfile>."""
    records = {signature: profile[signature] for signature in profile}
    try:
        HEADER.write(out.child("Header"), profile.header)
    except ValueError as error:
        raise ProfileError(f"{profile.source}: header: {error}") from None
    _TAGS.write(out.child("Tags"), records)


class _Embedded(Part):
    """The profile as an element, as in a document of its own."""

    children = (ROOT,)

    def read(self, node: Node, seen: Seen) -> None:
        node.document.profiles += 1
        if node.document.profiles > MAX_PROFILES:
            raise node.error(f"more than {MAX_PROFILES} profiles inside profiles", kind=LimitError)
        seen["data"] = read_whole(node.required(ROOT)).to_bytes()

    def write(self, out: Target, record: EmbeddedProfile) -> None:
        if sum(1 for _ in out.element.iterancestors(ROOT)) == MAX_DEPTH:
            raise out.error(f"profiles are nested deeper than the limit of {MAX_DEPTH}", LimitError)
        out.job.profiles += 1
        if out.job.profiles > MAX_PROFILES:
            raise out.error(f"more than {MAX_PROFILES} profiles inside profiles", LimitError)
        write_whole(out.child(ROOT), record.profile)


TYPE_FORMS.add(Form("embeddedProfileType", EmbeddedProfile, _Embedded()))
