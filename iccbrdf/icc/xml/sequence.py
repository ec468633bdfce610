"""The tag types in XML that say which profiles a device link was made of."""

from __future__ import annotations

from iccbrdf.icc.classic import TextDescription
from iccbrdf.icc.sequence import (
    ProfileDescription,
    ProfileIdentities,
    ProfileIdentity,
    ProfileSequence,
)
from iccbrdf.icc.tags import LocalisedText, Mluc
from iccbrdf.icc.xml.composite import TYPE_FORMS
from iccbrdf.icc.xml.forms import Attribute, Content, Form, Inside, Part, Rows, Seen
from iccbrdf.icc.xml.header import ATTRIBUTES
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.tags import LOCALISED, Language
from iccbrdf.icc.xml.values import HEX, SIGNATURE, choice


class _Text(Part):
    """A text with its tag type."""

    children = ("multiLocalizedUnicodeType", "textDescriptionType")

    def __init__(self, field: str) -> None:
        self.field = field

    def read(self, node: Node, seen: Seen) -> None:
        child = node.child(*self.children)
        seen[self.field] = Mluc(()) if child is None else TYPE_FORMS.read(child)

    def write(self, out: Target, record: ProfileDescription) -> None:
        text: TextDescription | Mluc = getattr(record, self.field)
        TYPE_FORMS.write(out, text)


class _Description(Part):
    """The texts of a profile ID."""

    children = ("LocalizedText",)
    # The ICC's tools write one of these and read the other.
    _rows = Rows(
        "LocalizedText",
        "texts",
        LocalisedText,
        Language("LanguangeCountry", "languageCountry", "LanguageCountry"),
        *LOCALISED[1:],
    )

    def read(self, node: Node, seen: Seen) -> None:
        texts: Seen = {}
        self._rows.read(node, texts)
        seen["description"] = Mluc(texts["texts"])

    def write(self, out: Target, record: ProfileIdentity) -> None:
        self._rows.write(out, record.description)


def _signature(name: str, field: str) -> Inside:
    return Inside(name, Content(field, SIGNATURE), default=lambda seen: {field: ""})


_ALIGNED = choice({0: ("false",), 1: ("true",)})

TYPE_FORMS.add(
    Form(
        "profileSequenceDescType",
        ProfileSequence,
        Attribute("Aligned", "aligned", _ALIGNED, True, omitted=True),
        Inside(
            "ProfileSequence",
            Rows(
                "ProfileDesc",
                "profiles",
                ProfileDescription,
                _signature("DeviceManufacturerSignature", "manufacturer"),
                _signature("DeviceModelSignature", "model"),
                ATTRIBUTES,
                _signature("Technology", "technology"),
                Inside("DeviceManufacturer", _Text("manufacturer_text")),
                Inside("DeviceModel", _Text("model_text")),
            ),
        ),
    ),
    Form(
        "profileSequenceIdentifierType",
        ProfileIdentities,
        Inside(
            "ProfileSequenceId",
            Rows("ProfileIdDesc", "profiles", ProfileIdentity, Attribute("id", "id", HEX), _Description()),
        ),
    ),
)
