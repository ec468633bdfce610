"""JSON that people read, too."""

from __future__ import annotations

import json


def to_json(value: object, indent: str = "") -> str:
    """
    Return JSON that reads well: what fits on a line of 100 characters stands on one.

    The same value gives the same text; numbers are written with as many digits as bring them back exactly.
    """
    line = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if len(indent) + len(line) <= 100 or not isinstance(value, dict | list):
        return line
    inner = indent + "  "
    if isinstance(value, dict):
        items = [
            f"{json.dumps(key, ensure_ascii=False)}: {to_json(item, inner)}" for key, item in value.items()
        ]
        start, end = "{}"
    else:
        items = [to_json(item, inner) for item in value]
        start, end = "[]"
    return f"{start}\n{inner}" + f",\n{inner}".join(items) + f"\n{indent}{end}"
