"""The one table of rules: what is checked, how grave a breach is, and the clause or the fact behind it.

Ids are stable: a rule that is given up leaves a gap.  The first three letters name the area: HDR header,
PID profile ID, TAB tag table, TAG tags and their types, REQ required tags, TXT texts, MCS multiplex channels,
MPE processing elements, PRG calculator programs, REF behaviour of the reference implementation that a
portable profile avoids, SRC the private tag of what programs are compiled from, NUM numbers, where that check
is asked for, PCC viewing conditions, LNK a MID with an MVIS, ALL the check itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

Severity: TypeAlias = Literal["error", "warning", "note"]
"""error: malformed, or a requirement is broken on which others rely.  warning: legal or tolerated, but likely
a mistake, or trouble for some reader.  note: worth knowing."""

SEVERITIES: tuple[Severity, ...] = ("error", "warning", "note")
"""Gravest first."""


@dataclass(frozen=True)
class Rule:
    """`text` says what a sound profile does; `basis` is the clause or the fact behind it."""

    id: str
    severity: Severity
    text: str
    basis: str


_REFERENCE = "reference implementation (iccDEV)"
_NUMERIC = "IEEE 754, interval analysis of the program"

_ROWS = (
    Rule("HDR-001", "error", "The file holds a header of 128 bytes, signed acsp.", "ICC.2, 7.2"),
    Rule("HDR-002", "error", "The header's size is that of the file, or less.", "ICC.2, 7.2"),
    Rule("HDR-003", "warning", "Nothing follows the size that the header states.", "ICC.2, 7.2"),
    Rule("HDR-004", "warning", "The size is a multiple of 4 (from version 4 on).", "ICC.1:2010, 7.2.2"),
    Rule("HDR-005", "error", "The major version is 2, 4 or 5.", "ICC.2, 7.2"),
    Rule("HDR-006", "error", "The device class is one of the version.", "ICC.2, 7.2; ICC.1:2010, 7.2.5"),
    Rule("HDR-007", "error", "The data colour space is known, and has channels.", "ICC.2, 7.2"),
    Rule("HDR-008", "warning", "An MVIS or MLNK, which has no device side, has no data colour space.",
         "ICC.2, 7.2"),
    Rule("HDR-009", "error", "The connection space fits the class.", "ICC.2, 7.2; ICC.1:2010, 7.2.7"),
    Rule("HDR-010", "error", "MID, MVIS and MLNK have a multiplex space mcNNNN with channels.", "ICC.2, 7.2"),
    Rule("HDR-011", "warning", "Reserved bytes and reserved flags are zero.",
         "ICC.2, 7.2; ICC.1:2010, 7.2.19"),
    Rule("HDR-012", "error", "The rendering intent is 0 to 3.", "ICC.2, 7.2; ICC.1:2010, 7.2.15"),
    Rule("HDR-013", "error", "The illuminant is D50; in version 5 any XYZ above 0, or for a MID zeros.",
         "ICC.2, 7.2; ICC.1:2010, 7.2.16"),
    Rule("HDR-014", "warning", "The date of creation exists.", "ICC.2, 7.2; dateTimeNumber"),
    Rule("HDR-015", "warning", "The platform is 0, APPL, MSFT, SGI, SUNW or TGNT.", "ICC.2, 7.2"),
    Rule("HDR-016", "error", "A spectral connection space has a range of wavelengths with as many steps.",
         "ICC.2, 7.2"),
    Rule("HDR-017", "warning", "The flag that asks for a multiplex subset stands in a profile with a "
         "multiplex space.", "ICC.2, 7.2"),

    Rule("PID-001", "error", "The profile ID is the MD5 of the profile.", "ICC.2, 7.2; ICC.1:2010, 7.2.18"),
    Rule("PID-002", "note", "The profile ID is computed (from version 4 on).", "ICC.1:2010, 7.2.18"),

    Rule("TAB-001", "error", "The tag table lies in the file.", "ICC.2, 7.3"),
    Rule("TAB-002", "error", "There are no more tags than this library takes.", "limit of this library"),
    Rule("TAB-003", "error", "Every signature comes once.", "ICC.2, 7.3"),
    Rule("TAB-004", "error", "Tags lie in the file, behind the tag table.", "ICC.2, 7.3"),
    Rule("TAB-005", "error", "Tags begin at multiples of 4 bytes.", "ICC.2, 7.3; ICC.1:2010, 7.1.2"),
    Rule("TAB-006", "error", "Tags share all their bytes or none.", "ICC.2, 7.3"),
    Rule("TAB-007", "error", "Tags have 8 bytes or more: a type and four reserved ones.", "ICC.2, 7.3"),
    Rule("TAB-008", "warning", "Between tags there are at most three bytes, zeros.", "ICC.1:2010, 7.1.2"),

    Rule("TAG-001", "error", "A tag can be decoded.", "clause of its type in ICC.2, 10, or ICC.1:2010, 10"),
    Rule("TAG-002", "error", "A tag asks for no more than this library gives.", "limit of this library"),
    Rule("TAG-003", "warning", "A tag can be decoded without tolerance.", "clause of its type"),
    Rule("TAG-004", "note", "The tag's type is known here; the content of others is not checked.",
         "scope of this library"),
    Rule("TAG-005", "error", "The tag is of a type that its signature allows.",
         "ICC.2, 9.2; ICC.1:2010, 9.2"),
    Rule("TAG-006", "warning", "The four bytes after a tag's type are zero.", "ICC.2, 10; ICC.1:2010, 10"),
    Rule("TAG-007", "warning", "The tag belongs to the profile's class.", "ICC.2, 8"),
    Rule("TAG-008", "warning", "A signature that is no registered one is not close to one either.",
         "ICC.2, 9.2"),
    Rule("TAG-009", "note", "The tag is a registered one; others read only by agreement.", "ICC.2, 9.2"),
    Rule("TAG-010", "error", "A profile inside a tag can be read.", "ICC.2, 7"),
    Rule("TAG-011", "warning", "A number that stands for a choice is a listed one.",
         "ICC.1:2010, 10.2, 10.6, 10.12, 10.28; ICC.1:2001-04, 6.5.15"),
    Rule("TAG-012", "warning", "The order of colorants names each device channel once.", "ICC.1:2010, 10.3"),
    Rule("TAG-013", "error", "Named colours have a value for each device channel, or none.",
         "ICC.1:2010, 10.15"),
    Rule("TAG-014", "warning", "Named colours differ in their names.", "ICC.1:2010, 10.15"),

    Rule("REQ-001", "error", "There are a description and a copyright (tags desc, cprt).",
         "ICC.2, 8.2; ICC.1:2010, 8.2"),
    Rule("REQ-002", "error", "There is a media white (tag wtpt) where the class asks for it.",
         f"ICC.1:2010, 8.2; {_REFERENCE}: MVIS with a connection space"),
    Rule("REQ-003", "error", "There is a transform that the class asks for.",
         "ICC.2, 8; ICC.1:2010, 8.3 to 8.9"),
    Rule("REQ-004", "error", "MID, MVIS and MLNK name their multiplex channels (tag mcta).", "ICC.2, 8"),
    Rule("REQ-005", "error", "There are the further tags that the class asks for.", "ICC.1:2010, 8.3 to 8.9"),
    Rule("REQ-006", "note", "An MVIS has defaults for channels that a MID lacks (tag mdv).", "ICC.2, 9.2"),

    Rule("TXT-001", "warning", "Texts say something.", "purpose of the tag"),
    Rule("TXT-002", "warning", "Languages are two small letters, countries two capitals or none.",
         "ICC.1:2010, 10.13; ISO 639-1, ISO 3166-1"),
    Rule("TXT-003", "warning", "Texts hold no control characters but tab and end of line.",
         "purpose of the tag"),
    Rule("TXT-004", "warning", "A text comes once in each language.", "ICC.1:2010, 10.13"),
    Rule("TXT-005", "warning", "Text of textType and textDescriptionType is 7-bit ASCII.",
         "ICC.1:2010, 10.22; ICC.1:2001-04, 6.5.17"),

    Rule("MCS-001", "error", "The multiplex channel names are a tag array of UTF-8 texts.", "ICC.2, 9.2.85"),
    Rule("MCS-002", "error", "There are as many names as the header's multiplex space has channels.",
         "ICC.2, 9.2.85"),
    Rule("MCS-003", "error", "Every multiplex channel name comes once.", "ICC.2, 9.2.85"),
    Rule("MCS-004", "warning", "The array type of the names is 'utf8', though the standard says 'mcta'.",
         f"ICC.2, 9.2.85; {_REFERENCE} refuses to link 'mcta'"),
    Rule("MCS-005", "error", "The array type of the names is 'utf8' or 'mcta'.", "ICC.2, 9.2.85"),
    Rule("MCS-006", "warning", "Names are not empty, have no blanks around them, differ by more than case.",
         "channels are matched byte by byte"),
    Rule("MCS-007", "error", "Multiplex defaults are ui08, ui16, fl16, fl32 or fl64.",
         f"ICC.2, 9.2; {_REFERENCE}"),
    Rule("MCS-008", "error", "There is a default for each multiplex channel.", f"ICC.2, 9.2; {_REFERENCE}"),
    Rule("MCS-009", "error", "Multiplex defaults are finite.", "they reach every pixel"),

    Rule("MPE-001", "error", "A transform has the channels of the spaces that the header states.",
         "ICC.2, 9.2; 10.2.17"),
    Rule("MPE-002", "error", "An element takes as many channels as the one before it gives.",
         "ICC.2, 10.2.17"),
    Rule("MPE-003", "error", "An element can be decoded.", "ICC.2, 11.2"),
    Rule("MPE-004", "warning", "There is at least one element.", "ICC.2, 10.2.17"),
    Rule("MPE-005", "warning", "Elements are of types known here; a CMM ignores a transform with others.",
         "ICC.2, 10.2.17"),
    Rule("MPE-006", "warning", "The four bytes after an element's type are zero.", "ICC.2, 11.2"),
    Rule("MPE-007", "error", "An element has channels on both sides.", "ICC.2, 11.2"),
    Rule("MPE-008", "warning", "Numbers of matrices, tables and curves are finite.",
         "they reach every pixel"),
    Rule("MPE-009", "warning", "A matrix is stored with all its coefficients and offsets.", "ICC.2, 11.2"),

    Rule("PRG-001", "error", "A program is sound: known operators, no stack underflow, indices in range.",
         "ICC.2, 11.2.1"),
    Rule("PRG-002", "warning", "The size of a calculator's function is what its operations take.",
         f"ICC.2, 11.2.1; {_REFERENCE}: its writer overstates it, its reader may refuse it"),
    Rule("PRG-003", "note", "A program reads no run-time variable whose value is fixed (true, ndef).",
         "ICC.2, 11.2.1"),
    Rule("PRG-004", "warning", "A run-time variable is not a misspelling of a known one.",
         f"names of the README; {_REFERENCE} runs a misspelt one without a word"),
    Rule("PRG-005", "warning", "Names of run-time variables are printable ASCII, blanks at the end.",
         "callers must be able to name them"),
    Rule("PRG-006", "note", "A program reads all its input channels.", "what a program is for"),
    Rule("PRG-007", "warning", "A program writes all its outputs on every path.",
         f"ICC.2, 11.2.1; {_REFERENCE}: an output that is not written is undefined"),
    Rule("PRG-008", "warning", "A program writes temporaries before it reads them, on every path.",
         f"ICC.2, 11.2.1; {_REFERENCE}: the value of an earlier pixel may show"),
    Rule("PRG-009", "warning", "No literal makes an operation fail for every pixel: division by 0, root or "
         "logarithm of what has none.", "IEEE 754"),
    Rule("PRG-010", "note", "A program leaves nothing on its stack.", "ICC.2, 11.2.1: leftovers are ignored"),
    Rule("PRG-011", "note", "A program applies all its sub-elements.", "what a program is for"),

    Rule("REF-001", "warning", "No operators of ICC.2:2023 (noop, scnt, vxor), which older readers refuse.",
         _REFERENCE),
    Rule("REF-002", "warning", "solv is used for 3 x 3 only.",
         f"{_REFERENCE}: other shapes give zeros or fail"),
    Rule("REF-003", "warning", "No block that is empty at the end of a sequence.",
         f"{_REFERENCE}: 'else' gives -1 on all outputs, 'case' and 'dflt' are refused"),

    Rule("SRC-001", "warning", "The tag of what a profile is made from (bsrc) can be read.",
         "iccbrdf.icc.source_tag: XML and plans are without names and recipe otherwise"),
    Rule("SRC-002", "warning", "What a program is said to be made from compiles to that program, and to its "
         "names.", "what the tag is for"),

    Rule("NUM-001", "error", "No operation divides by 0 for any input in the declared ranges.", _NUMERIC),
    Rule("NUM-002", "error", "No operation is given what it has no result for, as a root is of a negative "
         "number.", _NUMERIC),
    Rule("NUM-003", "error", "No operation overflows float32, or the 32 bits of an integer.", _NUMERIC),
    Rule("NUM-004", "error", "Every output is finite.", _NUMERIC),
    Rule("NUM-005", "warning", "The numbers of every transform can be examined.", "limit of this library"),

    Rule("PCC-001", "error", "Observer and illuminant are listed ones, custom ones come with their tables.",
         "ICC.2, 10.2.21"),
    Rule("PCC-002", "error", "Wavelengths increase; tables are finite; the illuminant's XYZ is above 0.",
         "ICC.2, 10.2.21"),
    Rule("PCC-003", "warning", "The header's illuminant is that of the viewing conditions, with Y = 1.",
         "ICC.2, 7.2"),
    Rule("PCC-004", "warning", "Conditions other than D50 and 2 degrees come with transforms from and to "
         "them (c2sp, s2cp).", "ICC.2, 9.2: no link with profiles of other conditions otherwise"),
    Rule("PCC-005", "warning", "A header illuminant other than D50 comes with viewing conditions (tag svcn).",
         f"{_REFERENCE} takes D50 without them"),
    Rule("PCC-006", "warning", "c2sp takes the illuminant to D50, s2cp D50 to the illuminant.", "ICC.2, 9.2"),
    Rule("PCC-007", "error", "The media white is one XYZ above 0.", "ICC.2, 9.2; ICC.1:2010, 9.2.34"),

    Rule("LNK-001", "error", "A MID and an MVIS link.", "ICC.2, 8; MCS connection"),
    Rule("LNK-002", "warning", "A channel that the MID lacks has no near namesake there.",
         "channels are matched byte by byte"),
    Rule("LNK-003", "note", "The MID gives all channels that the MVIS takes; others take their default.",
         "ICC.2, 9.2 (tag mdv)"),
    Rule("LNK-004", "note", "The MVIS takes all channels that the MID gives; others are dropped.",
         "ICC.2, MCS connection"),
    Rule("LNK-005", "warning", "A profile that asks for a subset has the same order of names as the other.",
         f"{_REFERENCE} compares names by position, and may crash"),

    Rule("ALL-001", "error", "There are few enough findings to list.", "limit of this library"),
)  # fmt: skip

RULES: Mapping[str, Rule] = {rule.id: rule for rule in _ROWS}
"""Rule by id."""
