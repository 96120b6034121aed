"""Edits of values in the text of a robot file that keep its order, units and comments."""

from __future__ import annotations

import re
from typing import NamedTuple

import yaml

from chefbot.errors import UserError

_COMMENT = re.compile(r"[ \t]*#[^\n]*")
COMMENT_COLUMN = 30


class Change(NamedTuple):
    """A new value of the key at `path`, as YAML text, and a comment ('' for none)."""

    path: tuple[str, ...]
    text: str
    comment: str = ""


def changed(text: str, changes: list[Change]) -> str:
    """Return `text` with the changes, one after the other; a missing key is added.

    A section that becomes a name (`motor: pololu_37d_70`) loses its inner lines; the comment behind a changed
    value is removed, because it belongs to the old one.
    """
    for change in changes:
        text = _change(text, change)
    return text


def headed(text: str, lines: list[str]) -> str:
    """Return `text` with `lines` in place of the comment at its top."""
    rest = text.split("\n")
    while rest and (rest[0].startswith("#") or not rest[0].strip()):
        rest.pop(0)
    return "\n".join([*(f"# {line}".rstrip() for line in lines), *rest])


def value_of(text: str, path: tuple[str, ...]) -> str | None:
    """Return the text of the key's value, None if the file does not have it."""
    found = _find(_composed(text), path)
    return str(found[1].value) if found and isinstance(found[1], yaml.ScalarNode) else None


def _composed(text: str) -> yaml.MappingNode:
    node = yaml.compose(text, Loader=yaml.SafeLoader)
    if not isinstance(node, yaml.MappingNode):
        raise UserError("the robot file is not a list of sections")
    return node


def _change(text: str, change: Change) -> str:
    """Replace the value, or add the key to the deepest existing section of its path."""
    root = _composed(text)
    found = _find(root, change.path)
    if found is not None:
        return _replaced(text, found, change)
    for depth in range(len(change.path) - 1, 0, -1):
        section = _find(root, change.path[:depth])
        if section is not None and isinstance(section[1], yaml.MappingNode) and section[1].value:
            return _added(text, section[1], change, depth)
    return text.rstrip("\n") + "\n\n" + _block(change.path, change, 0) + "\n"


def _replaced(text: str, found: tuple[yaml.Node, yaml.Node], change: Change) -> str:
    begin, end = found[0].end_mark.index, _last_index(found[1])
    tail = text[end:]
    comment = _COMMENT.match(tail)
    if comment:
        tail = tail[comment.end() :]
    line = f": {change.text}"
    if tail[:1] in ("", "\n"):
        line += _remark(change, begin - (text.rfind("\n", 0, begin) + 1) + len(line))
    return text[:begin] + line + tail


def _added(text: str, section: yaml.MappingNode, change: Change, depth: int) -> str:
    """The rest of the path behind the section's last entry."""
    rest = change.path[depth:]
    end = _last_index(section.value[-1][1])
    if section.flow_style:
        inner = change.text
        for key in reversed(rest[1:]):
            inner = f"{{{key}: {inner}}}"
        return f"{text[:end]}, {rest[0]}: {inner}{text[end:]}"
    line_end = text.find("\n", end)
    line_end = len(text) if line_end < 0 else line_end
    return text[:line_end] + "\n" + _block(rest, change, section.start_mark.column) + text[line_end:]


def _block(path: tuple[str, ...], change: Change, indent: int) -> str:
    lines = [f"{' ' * (indent + 2 * i)}{key}:" for i, key in enumerate(path)]
    lines[-1] += f" {change.text}"
    lines[-1] += _remark(change, len(lines[-1]))
    return "\n".join(lines)


def _remark(change: Change, column: int) -> str:
    return " " * max(2, COMMENT_COLUMN - column) + f"# {change.comment}" if change.comment else ""


def _find(node: yaml.Node | None, path: tuple[str, ...]) -> tuple[yaml.Node, yaml.Node] | None:
    """Nodes of the key and of its value."""
    if not isinstance(node, yaml.MappingNode):
        return None
    for key, value in node.value:
        if key.value == path[0]:
            return (key, value) if len(path) == 1 else _find(value, path[1:])
    return None


def _last_index(node: yaml.Node) -> int:
    """Where the node's text ends, without the comments and empty lines that follow a block."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _last_index(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)
