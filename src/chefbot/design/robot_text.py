"""Values of a robot file changed in its text, so that its order, units and comments stay as a person wrote them."""

from __future__ import annotations

import re
from typing import NamedTuple

import yaml

from chefbot.errors import UserError

_COMMENT = re.compile(r"[ \t]*#[^\n]*")
COMMENT_COLUMN = 30


class Change(NamedTuple):
    """A new value of the key that `path` leads to, as text of YAML, and a comment that says why ('' for none)."""

    path: tuple[str, ...]
    text: str
    comment: str = ""


def changed(text: str, changes: list[Change]) -> str:
    """`text` with the changes made, one after the other. UserError for a key that the file does not have.

    A section that becomes a name (`motor: pololu_37d_70`) loses its inner lines; a comment behind a changed value
    goes, as it spoke of the old one.
    """
    for change in changes:
        text = _change(text, change)
    return text


def headed(text: str, lines: list[str]) -> str:
    """`text` with `lines` as the comment at its top instead of the comment that it had there."""
    rest = text.split("\n")
    while rest and (rest[0].startswith("#") or not rest[0].strip()):
        rest.pop(0)
    return "\n".join([*(f"# {line}".rstrip() for line in lines), *rest])


def holds(text: str, path: tuple[str, ...]) -> bool:
    """Whether the file has the key."""
    return _find(yaml.compose(text, Loader=yaml.SafeLoader), path) is not None


def _change(text: str, change: Change) -> str:
    found = _find(yaml.compose(text, Loader=yaml.SafeLoader), change.path)
    if found is None:
        raise UserError(f"the robot file has no {'.'.join(change.path)!r} to change; write it there first")
    key, value = found
    begin, end = key.end_mark.index, _last_index(value)
    tail = text[end:]
    comment = _COMMENT.match(tail)
    if comment:
        tail = tail[comment.end() :]
    line = f": {change.text}"
    at_line_end = tail[:1] in ("", "\n")
    if change.comment and at_line_end:
        column = begin - (text.rfind("\n", 0, begin) + 1)
        line += " " * max(2, COMMENT_COLUMN - column - len(line)) + f"# {change.comment}"
    return text[:begin] + line + tail


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
