"""Tags in XML wherever they stand: in a profile, in a structure, in an array; and tags as bytes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from iccbrdf.errors import nearest
from iccbrdf.icc.composite import Member, TagStruct
from iccbrdf.icc.layout import shown
from iccbrdf.icc.reader import Reader
from iccbrdf.icc.tags import TAGS, TagArray, Unknown
from iccbrdf.icc.xml.forms import Form, Forms, Part, Seen
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.tag_names import ARRAYS, MEMBERS, STRUCTURES
from iccbrdf.icc.xml.values import HEX_LINES, SIGNATURE, Codec, signature_bytes, signature_text

_SIGNATURES = "TagSignature"
_PRIVATE = "PrivateType"
_FOUR_BYTES = Codec(signature_bytes, signature_text)
_NULL = "NullTag"
"""An array position that holds nothing, for which the ICC's dialect has no element."""


def _read_bytes(node: Node, signature: bytes) -> Any:
    """The tag whose bytes after its type signature stand in an element."""
    data = node.child("UnknownData")
    content = node.value(HEX_LINES, data.text if data is not None else "")
    return TAGS.read(Reader(signature + content, node.source, f"line {node.line}"))


def _write_bytes(out: Target, record: Any) -> None:
    out.child("UnknownData").write(HEX_LINES.write(record.to_bytes()[4:]))


class BytesForm(Form):
    """A tag type that has a name in the dialect, but whose content stands there as bytes.

    The ICC's tools do not write the attribute `type`, without which they lose the type when they read.
    """

    def read(self, node: Node) -> Any:
        node.expect(("type", "reserved"), ("UnknownData",))
        return _read_bytes(node, signature_bytes(self.signature))

    def write(self, out: Target, record: Any) -> None:
        out.set("type", SIGNATURE.write(self.signature))
        _write_bytes(out, record)


class _TypeForms(Forms):
    """The forms of tag types, and that of a tag as bytes, whether its type has a record or not."""

    def read(self, node: Node) -> Any:
        if node.name != _PRIVATE:
            return super().read(node)
        node.expect(("type", "reserved"), ("UnknownData",))
        return _read_bytes(node, node.value(_FOUR_BYTES, node.get("type"), "type"))

    def write(self, out: Target, record: Any) -> None:
        if not isinstance(record, Unknown):
            super().write(out, record)
            return
        private = out.child(_PRIVATE)
        private.set("type", SIGNATURE.write(record.signature))
        _write_bytes(private, record)


TYPE_FORMS = _TypeForms("tag type")


class NamedTags:
    """Tags that have a signature in what holds them, a profile or a structure.

    names: signature by element name.  private: the element for a signature without a name.
    """

    def __init__(self, names: Mapping[str, str], private: str) -> None:
        self.names = names
        self.private = private
        self.name_of = {signature: name for name, signature in reversed(list(names.items()))}

    def read(self, node: Node) -> dict[str, Any]:
        """The tags in an element, by signature; one object where several share it."""
        tags: dict[str, Any] = {}
        for child in node:
            if child.name in self.names or child.name == self.private:
                signatures, tag = [self._signature(child)], self._named(child, tags)
            else:
                signatures, tag = self._legacy(child)
            for signature in signatures:
                if signature in tags:
                    child.warn(f"a second tag {shown(signature)!r} is ignored")
                tags.setdefault(signature, tag)
        return tags

    def _signature(self, node: Node) -> str:
        return self.names.get(node.name) or _signature(node, node.get(_SIGNATURES))

    def _named(self, node: Node, tags: Mapping[str, Any]) -> Any:
        node.expect((_SIGNATURES, "SameAs", "SameAsSignature"), None)
        if "SameAs" not in node.attributes:
            children = list(node)
            if len(children) != 1:
                raise node.error(f"found {len(children)} elements in it, expected one tag type")
            return TYPE_FORMS.read(children[0])
        same = node.get("SameAs")
        signature = self.names.get(same) or _signature(node, node.get("SameAsSignature"))
        if signature not in tags:
            raise node.error(f"SameAs: no tag {signature!r} before it: {nearest(signature, tags)}")
        return tags[signature]

    @staticmethod
    def _legacy(node: Node) -> tuple[list[str], Any]:
        """The older form: the tag type outside, the signatures inside."""
        signatures = [_signature(c, c.text) for c in node if c.name == _SIGNATURES]
        if not signatures and node.name not in (*TYPE_FORMS.by_name, _PRIVATE):
            TYPE_FORMS.read(node)  # which says that there is no such name
        if not signatures:
            raise node.error(f"no <{_SIGNATURES}> found in it, expected one or more")
        return signatures, TYPE_FORMS.read(node.hiding(_SIGNATURES))

    def write(self, out: Target, tags: Mapping[str, Any]) -> None:
        """Put tags into an element; one that is there already is written as a reference to it."""
        first: dict[int, str] = {}
        for signature, tag in tags.items():
            child = out.child(self.name_of.get(signature, self.private))
            if signature not in self.name_of:
                child.set(_SIGNATURES, SIGNATURE.write(signature))
            if id(tag) in first:
                same = first[id(tag)]
                child.set("SameAs", self.name_of.get(same, self.private))
                if same not in self.name_of:
                    child.set("SameAsSignature", SIGNATURE.write(same))
            else:
                first[id(tag)] = signature
                TYPE_FORMS.write(child, tag)


def _signature(node: Node, text: str) -> str:
    return str(node.value(SIGNATURE, text))


class _Members(Part):
    """The type of a structure, as text or as the element around its members, and the members."""

    children = ("StructureSignature", "MemberTags", *STRUCTURES)

    def read(self, node: Node, seen: Seen) -> None:
        wrapper = node.child(*STRUCTURES)
        if wrapper is not None:
            wrapper.expect((), ("MemberTags",))
            seen["type"] = STRUCTURES[wrapper.name]
        else:
            signature = node.required("StructureSignature")
            seen["type"] = _signature(signature, signature.text)
        members = (wrapper or node).required("MemberTags")
        tags = NamedTags(MEMBERS.get(seen["type"], {}), "PrivateSubTag").read(members)
        seen["members"] = tuple(Member(signature, tag) for signature, tag in tags.items())

    def write(self, out: Target, record: TagStruct) -> None:
        out.child("StructureSignature").write(SIGNATURE.write(record.type))
        # Without names: the ICC's tools know these only inside the elements that they misspell.
        members = NamedTags({}, "PrivateSubTag")
        members.write(out.child("MemberTags"), {m.signature: m.value for m in record.members})


class _Items(Part):
    """The type of an array, as text or as the element around its items, and the items."""

    children = ("ArraySignature", "ArrayTags", *ARRAYS)

    def read(self, node: Node, seen: Seen) -> None:
        wrapper = node.child(*ARRAYS)
        if wrapper is not None:
            wrapper.expect((), ("ArrayTags",))
            seen["array_type"] = ARRAYS[wrapper.name]
        else:
            signature = node.required("ArraySignature")
            seen["array_type"] = _signature(signature, signature.text)
        items = (wrapper or node).required("ArrayTags")
        seen["items"] = tuple(None if i.name == _NULL else TYPE_FORMS.read(i) for i in items)

    def write(self, out: Target, record: TagArray) -> None:
        out.child("ArraySignature").write(SIGNATURE.write(record.array_type))
        items = out.child("ArrayTags")
        for item in record.items:
            if item is None:
                items.child(_NULL)
            else:
                TYPE_FORMS.write(items, item)


TYPE_FORMS.add(
    Form("tagStructType", TagStruct, _Members(), aliases=("tagStructureType",)),
    Form("tagArrayType", TagArray, _Items()),
)
