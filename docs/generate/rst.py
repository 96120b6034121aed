"""Small reStructuredText writers: escaped text, headings, tables and docstrings."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

_CODE = re.compile(r"``?([^`]+)``?")
_SPECIAL = re.compile(r"([\\*_|`<>\[\]{}])")
_ITEM = re.compile(r"^(-|\d+\.) ")


def escape(text: str) -> str:
    """Return plain text with reStructuredText's special characters escaped and `code` spans kept as code."""
    parts: list[str] = []
    position = 0
    for match in _CODE.finditer(text):
        parts += [_plain(text[position : match.start()]), code(match[1])]
        position = match.end()
    return "".join([*parts, _plain(text[position:])])


def _plain(text: str) -> str:
    return _SPECIAL.sub(r"\\\1", text)


def code(text: str) -> str:
    """Return text as inline code that may stand inside a word."""
    one_line = " ".join(text.split())
    if not one_line:
        return ""
    return rf"\ ``{one_line}``\ "


def heading(text: str, mark: str = "=") -> str:
    """Return a heading underlined with `mark`."""
    title = escape(text)
    return f"{title}\n{mark * (len(title) + 4)}\n"


def anchor(name: str) -> str:
    """Return a link target that other pages refer to by `name`."""
    return f".. _{name}:\n"


def table(header: Sequence[str], rows: Iterable[Sequence[str]], widths: str = "auto") -> str:
    """Return a list table; the cells are reStructuredText already."""
    lines = [".. list-table::", "   :header-rows: 1", f"   :widths: {widths}", ""]
    for row in [header, *rows]:
        for index, cell in enumerate(row):
            lines.append(f"   {'* ' if index == 0 else '  '}- {' '.join(cell.split())}")
    return "\n".join([*lines, ""])


def docstring(text: str, indent: str = "") -> str:
    """Return a docstring as paragraphs, lists and blocks of code, each line indented by `indent`."""
    blocks = [_block(block) for block in re.split(r"\n\s*\n", text.strip("\n")) if block.strip()]
    lines = "\n\n".join(blocks).splitlines()
    return "\n".join(indent + line if line else "" for line in lines) + "\n"


def _block(block: str) -> str:
    lines = block.splitlines()
    if all(line.startswith(("    ", "\t")) for line in lines):
        return ".. code-block:: text\n\n" + "\n".join("   " + line[4:] for line in lines)
    if _ITEM.match(lines[0].strip()):
        return "\n".join(f"* {escape(item)}" for item in _items(lines))
    return escape(" ".join(line.strip() for line in lines))


def _items(lines: Sequence[str]) -> list[str]:
    """Return the entries of a list, each joined to one line."""
    items: list[str] = []
    for line in lines:
        if _ITEM.match(line.strip()):
            items.append(_ITEM.sub("", line.strip()))
        else:
            items[-1] += " " + line.strip()
    return items


def write(path: Path, parts: Iterable[str]) -> None:
    """Write a page, unless the file has the same text already, so that Sphinx reads only changed pages."""
    text = "\n".join(parts).rstrip() + "\n"
    if not path.exists() or path.read_text() != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
