"""Write docs/repomap.md: a line for each file, which is the first one of its documentation.

python tools/make_repomap.py
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("calc_templates", "iccbrdf", "tools", "tests")
"""Folders told, in this order, with those in them."""
COMMENT = re.compile(r"\s*(?:#|//|/\*|<!--)\s*(.+?)\s*(?:\*/|-->)?$")


def first_line(path: Path) -> str:
    """The first line of a file's documentation, "" where it has none."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return (ast.get_docstring(ast.parse(text)) or "").split("\n\n")[0].replace("\n", " ")
    for line in text.splitlines()[:3]:
        comment = COMMENT.match(line)
        if comment:
            return comment[1]
    return ""


def repomap() -> str:
    """The whole text."""
    lines = [
        "# A line for each file",
        "",
        "Made by `tools/make_repomap.py` of what the files say of themselves.",
    ]
    for top in FOLDERS:
        paths = [p for p in (ROOT / top).rglob("*") if p.suffix in (".py", ".calc", ".lark", ".js", ".css",
                 ".html", ".glsl") and "__pycache__" not in p.parts]  # fmt: skip
        for folder in sorted({path.parent for path in paths}):
            lines += ["", f"## {folder.relative_to(ROOT)}/", ""]
            for path in sorted(p for p in paths if p.parent == folder):
                told = first_line(path)
                if told:
                    lines.append(f"- `{path.name}` {told}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    (ROOT / "docs" / "repomap.md").write_text(repomap(), encoding="utf-8")
