"""Edits of values in the text of a robot file that keep its order, units and comments."""

from __future__ import annotations

import io
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import CommentMark, YAMLError
from ruamel.yaml.tokens import CommentToken

from chefbot.design.errors import DesignError

COMMENT_COLUMN = 30


class Change(NamedTuple):
    """A new value of the key at `path`, as YAML text, and a comment ('' for none)."""

    path: tuple[str, ...]
    text: str
    comment: str = ""


def changed(text: str, changes: list[Change]) -> str:
    """Return `text` with the changes, made in order; a missing key is added.

    A section that becomes a name (`motor: pololu_37d_70`) loses its inner lines; the comment behind a changed
    value is removed, because it belongs to the old one.
    """
    yaml = _round_trip()
    root = _loaded(yaml, text)
    for change in changes:
        _change(root, change)
    stream = io.StringIO()
    yaml.dump(root, stream)
    return stream.getvalue()


def headed(text: str, lines: list[str]) -> str:
    """Return `text` with `lines` in place of the comment at its top."""
    rest = text.split("\n")
    while rest and (rest[0].startswith("#") or not rest[0].strip()):
        rest.pop(0)
    return "\n".join([*(f"# {line}".rstrip() for line in lines), *rest])


def value_of(text: str, path: tuple[str, ...]) -> str | None:
    """Return the key's value as text; None if the file does not have the key, or it is a section."""
    value = _loaded(_round_trip(), text)
    for key in path:
        value = value.get(key) if isinstance(value, CommentedMap) else None
    return None if value is None or isinstance(value, CommentedMap | CommentedSeq) else str(value)


def _loaded(yaml: YAML, text: str) -> Any:
    """Return the content of a file with its comments. Raises DesignError for what only other parsers accept."""
    try:
        return yaml.load(text)
    except YAMLError as error:
        line = f" in line {mark.line + 1}" if (mark := getattr(error, "problem_mark", None)) else ""
        problem = getattr(error, "problem", None) or "it is not plain YAML"
        raise DesignError(f"the robot file cannot be changed: {problem}{line}") from None


def _round_trip() -> YAML:
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 10_000  # long lines are not wrapped
    yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml


def _change(root: CommentedMap, change: Change) -> None:
    section, path = root, change.path
    while len(path) > 1 and isinstance(section.get(path[0]), CommentedMap):
        section, path = section[path[0]], path[1:]
    key, value = path[0], _round_trip().load(change.text)
    for name in reversed(path[1:]):
        value = CommentedMap({name: value})
    if section.fa.flow_style():  # {key: value} has no comments of its own
        section[key] = value
        return
    below = ""
    if key in section:
        below = _take_below(section, key)
    elif section is root:
        last = list(root)[-1]
        end = _take_below(root, last).rstrip("\n")
        _append(*_last_entry(root, last), f"{end}\n\n" if end else "\n")
    else:
        below = _take_below(section, list(section)[-1])
    section[key] = value
    section.ca.items.pop(key, None)
    _append(*_last_entry(section, key), below, change.comment)


def _last_entry(holder: Any, key: Any) -> tuple[Any, Any]:
    """Return the innermost last entry of a value: ruamel attaches the lines below the value to it."""
    value = holder[key]
    if not isinstance(value, CommentedMap | CommentedSeq) or value.fa.flow_style() or not value:
        return holder, key
    return _last_entry(value, list(value)[-1] if isinstance(value, CommentedMap) else len(value) - 1)


def _take_below(holder: Any, key: Any) -> str:
    """Remove the empty lines and comments below an entry, without the comment behind it, and return them."""
    holder, key = _last_entry(holder, key)
    slots = holder.ca.items.get(key)
    token = slots and slots[2 if isinstance(holder, CommentedMap) else 0]
    if not token:
        return ""
    behind, _, below = token.value.partition("\n")
    token.value = behind + "\n"
    return str(below)


def _append(holder: Any, key: Any, below: str, comment: str = "") -> None:
    """Add lines below an entry, and a comment behind it if it has none."""
    slot = 2 if isinstance(holder, CommentedMap) else 0
    slots = holder.ca.items.setdefault(key, [None] * 4)
    if slots[slot] is None:
        behind = f"# {comment}" if comment else ""
        slots[slot] = CommentToken(f"{behind}\n{below}", CommentMark(COMMENT_COLUMN), None)
    else:
        slots[slot].value += below
