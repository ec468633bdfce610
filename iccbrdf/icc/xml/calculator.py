"""The calculator element in XML: declarations, imports, sub-elements and the main function."""

from __future__ import annotations

from typing import Any

from iccbrdf.calc.program import SLOTS, Program, listing, parse
from iccbrdf.errors import LimitError, ProfileError
from iccbrdf.icc.elements import Calculator
from iccbrdf.icc.source_tag import CalculatorSource
from iccbrdf.icc.xml import node as xml
from iccbrdf.icc.xml.elements import CHANNELS, ELEMENT_FORMS
from iccbrdf.icc.xml.forms import Form, Part, Seen
from iccbrdf.icc.xml.language import (
    SIZED_NAMES,
    Declarations,
    Macro,
    Span,
    expand,
    identifiers,
    is_name,
    named,
)
from iccbrdf.icc.xml.node import Node, Target
from iccbrdf.icc.xml.values import U32

MAX_IMPORTS = 64
"""Files that one calculator may import, one by way of another counted too."""

_IMPORTED = ("Imports", "Variables", "Macros", "SubElements")


class _Program(Part):
    """Everything of a calculator but its channel counts."""

    attributes = ("InputNames", "OutputNames")
    children = (*_IMPORTED, "MainFunction")

    def read(self, node: Node, seen: Seen) -> None:
        channels = {"in": int(seen["inputs"]), "out": int(seen["outputs"])}
        declared = Declarations(
            inputs=_names(node, "InputNames", channels["in"]),
            outputs=_names(node, "OutputNames", channels["out"]),
            channels=channels,
        )
        _Reading(declared).declarations(node, imported=False)
        main = node.child("MainFunction")
        if main is None:
            raise node.error("no <MainFunction> found in it, expected one")
        main.expect((), ())
        seen["program"] = _program(main, expand(main, declared))
        seen["elements"] = tuple(declared.elements)

    def write(self, out: Target, record: Calculator) -> None:
        names = out.job.names.get(id(record))
        if names is not None:
            _write_names(out, names)
        if record.elements:
            elements = out.child("SubElements")
            for element in record.elements:
                ELEMENT_FORMS.write(elements, element)
        try:
            text = listing(record.program)
        except ProfileError as error:
            raise out.error(str(error), ProfileError) from None
        out.child("MainFunction").write("{\n" + named(text, names, record.inputs) + "}\n")


def _names(node: Node, attribute: str, channels: int) -> dict[str, Span]:
    names: dict[str, Span] = node.value(SIZED_NAMES, node.attributes.get(attribute, ""), attribute)
    count = sum(span.size for span in names.values())
    if count > channels:
        raise node.error(f"{attribute}: found {count} channels, expected up to {channels}")
    return names


def _program(main: Node, text: str) -> Program:
    try:
        return parse(text)
    except (LimitError, ProfileError) as error:
        raise main.error(str(error).removeprefix("program text, "), kind=type(error)) from None


class _Reading:
    """The declarations of one calculator, gathered from its element and the files that it imports."""

    def __init__(self, declared: Declarations) -> None:
        self.declared = declared
        self.imported: set[str] = set()

    def declarations(self, node: Node, *, imported: bool) -> None:
        """Take up what `node` declares, after what it imports."""
        for name in _IMPORTED:
            child = node.child(name)
            if child is None:
                continue
            child.expect(("Reserved",), None)
            for item in child:
                getattr(self, f"_{name.lower()}")(item, imported)

    def _imports(self, node: Node, imported: bool) -> None:
        self._check(node, "Import", ("Filename",))
        path, data = node.document.named(node, node.get("Filename"))
        if str(path) in self.imported:
            return
        if len(self.imported) == MAX_IMPORTS:
            raise node.error(f"more than {MAX_IMPORTS} imported files", kind=LimitError)
        self.imported.add(str(path))
        root = xml.parse(data, str(path), node.document)
        root.records = node.records
        if root.name != "IccCalcImport":
            raise root.error("expected <IccCalcImport> as the outermost element")
        root.expect((), _IMPORTED)
        self.declarations(root, imported=True)

    def _variables(self, node: Node, imported: bool) -> None:
        self._check(node, "Declare", ("Name", "Size", "Position"))
        name = self._name(node, self.declared.variables)
        members = node.value(SIZED_NAMES, node.text)
        size = max([self._number(node, "Size", 1), 1, *(m.first + m.size for m in members.values())])
        position = self._number(node, "Position", -1)
        if imported and position > 0:
            raise node.error("Position: expected none for an imported variable")
        end = max(position, 0) + size
        if end > SLOTS:
            raise node.error(f"variable {name!r}: found {end} slots, expected up to {SLOTS}")
        self.declared.variables[name] = Span(position, size, members)

    def _macros(self, node: Node, imported: bool) -> None:
        self._check(node, "Macro", ("Name", "Local"))
        known = self.declared.macros.get(node.get("Name"))
        if known is not None and known.text == node.text:
            return
        name = self._name(node, self.declared.macros)
        if not node.text.strip():
            raise node.error(f"macro {name!r}: found no text, expected operators")
        local = node.value(SIZED_NAMES, node.attributes.get("Local", ""), "Local")
        self.declared.macros[name] = Macro(node, node.text, local)

    def _subelements(self, node: Node, imported: bool) -> None:
        if "Name" in node.attributes:
            self.declared.named[self._name(node, self.declared.named)] = ELEMENT_FORMS.read(node)
        elif imported:
            raise node.error("no attribute 'Name', expected one for an imported sub-element")
        else:
            self.declared.elements.append(ELEMENT_FORMS.read(node))

    @staticmethod
    def _check(node: Node, name: str, attributes: tuple[str, ...]) -> None:
        if node.name != name:
            raise node.error(f"expected <{name}> here")
        node.expect(attributes, ())

    @staticmethod
    def _name(node: Node, known: dict[str, Any]) -> str:
        name = node.get("Name")
        if not is_name(name):
            raise node.error(f"Name: found {name!r:.40}, expected letters, digits and _")
        if name in known:
            raise node.error(f"Name: found {name!r}, which is declared already")
        return name

    @staticmethod
    def _number(node: Node, attribute: str, default: int) -> int:
        text = node.attributes.get(attribute)
        return default if text is None else int(node.value(U32, text, attribute))


def _write_names(out: Target, names: CalculatorSource) -> None:
    if names.templates:
        out.comment("\n".join(names.lines()))
    for attribute, channels in (("InputNames", names.inputs), ("OutputNames", names.outputs)):
        if channels:
            out.set(attribute, " ".join(identifiers(channels)))
    if names.temporaries:
        variables = out.child("Variables")
        labels = identifiers([t.name for t in names.temporaries])
        for temporary, label in zip(names.temporaries, labels, strict=True):
            declaration = variables.child("Declare")
            declaration.set("Name", label)
            declaration.set("Position", str(temporary.slot))
            declaration.set("Size", str(temporary.size))


ELEMENT_FORMS.add(Form("CalculatorElement", Calculator, *CHANNELS, _Program()))
