"""Checks of the header, field by field, and of the profile ID."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import datetime

from iccbrdf.errors import nearest
from iccbrdf.icc import D50, MCS_SUBSET, Header, channel_count, compute_profile_id
from iccbrdf.icc.header import SIZE
from iccbrdf.validate.findings import Finding, Place, finding
from iccbrdf.validate.subject import Subject

_CLASSES = {
    2: ("scnr", "mntr", "prtr", "link", "spac", "abst", "nmcl"),
    4: ("scnr", "mntr", "prtr", "link", "spac", "abst", "nmcl"),
    5: ("scnr", "mntr", "prtr", "link", "spac", "abst", "nmcl", "cenc", "mid ", "mlnk", "mvis"),
}
"""Device classes by major version."""
MULTIPLEX = ("mid ", "mlnk", "mvis")
"""Classes that have a multiplex space."""
_NAMED = "nmcl"
"""The class of named colours: in version 5 without a device space unless they have device values."""
_ENCODING = "cenc"
"""The class of colour encodings, which names one and may leave out what follows from the name."""
_PLATFORMS = ("", "APPL", "MSFT", "SGI ", "SUNW", "TGNT")
_RESERVED_FLAGS = 0xFFF0
_LAST_FIELDS = 100
"""Where the fields begin that version 5 has added; reserved in versions 2 and 4."""

# Byte offsets of the fields that are looked at (ICC.2, 7.2).
_AT = {
    "size": 0, "version": 8, "device class": 12, "colour space": 16, "connection space": 20, "date": 24,
    "platform": 40, "flags": 44, "rendering intent": 64, "illuminant": 68, "profile ID": 84,
    "spectral connection space": 100, "multiplex space": 116, "reserved bytes": 124,
}  # fmt: skip


def check_header(subject: Subject) -> Iterator[Finding]:
    """The fields, one by one and against the file."""
    header = subject.header
    if header is None:
        return
    yield from _size(header, len(subject.data))
    if subject.version not in _CLASSES:
        yield _found("HDR-005", "version", f"found major version {subject.version}, expected 2, 4 or 5")
    yield from _class_and_spaces(header)
    yield from _conditions(header)
    yield from _small_fields(header, subject.data)


def check_profile_id(subject: Subject) -> Iterator[Finding]:
    """The checksum of the profile."""
    header = subject.header
    if header is None or subject.version < 4 or header.size > len(subject.data):
        return
    if not any(header.profile_id):
        yield _found("PID-002", "profile ID", "found zeros: changes of the file cannot be noticed")
    elif header.profile_id != compute_profile_id(subject.data):
        expected = compute_profile_id(subject.data).hex()
        yield _found("PID-001", "profile ID", f"found {header.profile_id.hex()}, expected {expected}")


def field_place(field: str) -> Place:
    """Where a field of the header is, named in words."""
    return Place(f"header, {field}", _AT[field])


def _found(rule: str, field: str, message: str) -> Finding:
    return finding(rule, field_place(field), message)


def _size(header: Header, size: int) -> Iterator[Finding]:
    if not SIZE + 4 <= header.size <= size:
        message = f"found {header.size}, expected {SIZE + 4} to the {size} of the file"
        yield _found("HDR-002", "size", message)
    elif header.size < size:
        yield _found("HDR-003", "size", f"found {size - header.size} bytes more in the file, expected none")
    if header.version[0] >= 4 and header.size % 4:
        yield _found("HDR-004", "size", f"found {header.size}, expected a multiple of 4")


def _class_and_spaces(header: Header) -> Iterator[Finding]:
    device_class, version = header.device_class, header.version[0]
    classes = _CLASSES.get(version, _CLASSES[5])
    if device_class not in classes:
        message = f"found {device_class!r}: {nearest(device_class, classes)}"
        yield _found("HDR-006", "device class", message)
        return
    if device_class in ("mvis", "mlnk"):
        if header.colour_space:
            yield _found("HDR-008", "colour space", f"found {header.colour_space!r}, expected zeros")
    elif not channel_count(header.colour_space) and (
        header.colour_space or device_class != _NAMED or version < 5
    ):
        message = f"found {header.colour_space!r}, expected a colour space with channels, such as 'RGB '"
        yield _found("HDR-007", "colour space", message)
    yield from _connection_space(header)
    if device_class in MULTIPLEX or header.mcs:
        if not header.mcs.startswith("mc") or not channel_count(header.mcs):
            message = f"found {header.mcs!r}, expected mc and a channel count, such as 'mc000a'"
            yield _found("HDR-010", "multiplex space", message)
    elif header.mcs_subset and version >= 5:
        yield _found("HDR-017", "flags", f"found bit {MCS_SUBSET.bit_length() - 1} set, and no such space")


def _connection_space(header: Header) -> Iterator[Finding]:
    pcs = header.pcs
    if header.spectral_pcs and header.version[0] >= 5:
        yield from _spectral(header)
    if header.device_class == "link":
        if not channel_count(pcs):
            message = f"found {pcs!r}, expected a colour space with channels, such as 'CMYK'"
            yield _found("HDR-009", "connection space", message)
    elif header.device_class == "mid ":
        if pcs:
            yield _found("HDR-009", "connection space", f"found {pcs!r}, expected zeros for a MID")
    elif header.device_class != "mlnk" and pcs not in ("XYZ ", "Lab "):
        left_out = header.spectral_pcs or header.device_class == _ENCODING
        if pcs or not left_out or header.version[0] < 5:
            yield _found("HDR-009", "connection space", f"found {pcs!r}, expected 'XYZ ' or 'Lab '")


def _spectral(header: Header) -> Iterator[Finding]:
    first, last = header.spectral_range
    channels = channel_count(header.spectral_pcs)
    if not (math.isfinite(first) and math.isfinite(last) and first < last):
        message = f"found wavelengths from {first:g} to {last:g} nm, expected ones that increase"
        yield _found("HDR-016", "spectral connection space", message)
    # Other kinds than reflectance, transmittance and emission have further ranges.
    if header.spectral_pcs[:2] in ("rs", "ts", "es") and header.spectral_steps != channels:
        message = f"found {header.spectral_steps} steps, expected {channels} by {header.spectral_pcs!r}"
        yield _found("HDR-016", "spectral connection space", message)


def _conditions(header: Header) -> Iterator[Finding]:
    if header.rendering_intent > 3:
        yield _found("HDR-012", "rendering intent", f"found {header.rendering_intent}, expected 0 to 3")
    found = header.illuminant
    written = " ".join(f"{v:g}" for v in found)
    if header.version[0] >= 5:
        # A profile that knows no connection space may leave it out.
        left_out = not any(found) and header.device_class in ("mid ", "mlnk", "link", _ENCODING)
        if not left_out and min(found) <= 0:
            yield _found("HDR-013", "illuminant", f"found XYZ {written}, expected numbers above 0")
    elif max(abs(a - b) for a, b in zip(found, D50, strict=True)) > 1e-4:
        yield _found("HDR-013", "illuminant", f"found XYZ {written}, expected that of D50, 0.9642 1 0.8249")


def _small_fields(header: Header, data: bytes) -> Iterator[Finding]:
    try:
        datetime(*header.created)
    except ValueError as error:
        numbers = " ".join(map(str, header.created))
        yield _found("HDR-014", "date", f"found {numbers}, which is no date and time: {error}")
    if header.platform not in _PLATFORMS:
        message = f"found {header.platform!r}: {nearest(header.platform, _PLATFORMS[1:])}"
        yield _found("HDR-015", "platform", message)
    if header.flags & _RESERVED_FLAGS:
        message = f"found {header.flags:#010x}, expected zeros in the bits 4 to 15"
        yield _found("HDR-011", "flags", message)
    start = _AT["reserved bytes"] if header.version[0] >= 5 else _LAST_FIELDS
    if any(data[start:SIZE]):
        message = f"found {data[start:SIZE].hex()}, expected zeros in version {header.version[0]}"
        yield finding("HDR-011", field_place("reserved bytes").at(start), message)
