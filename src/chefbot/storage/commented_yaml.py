"""Changes of YAML files that people edit, too: comments and whatever has not changed are kept."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.error import YAMLError
from ruamel.yaml.scalarstring import DoubleQuotedScalarString
from yaml.nodes import ScalarNode
from yaml.resolver import Resolver

from chefbot.config import ConfigError
from chefbot.storage.atomic_files import write_atomic

LINE_WIDTH = 200
"""Characters up to which an entry stays on one line of the file."""
Entries = Mapping[str, CommentedMap]
"""Entries of a section by name, each as it is written."""
TEXT_TAG = "tag:yaml.org,2002:str"


def write_section(
    path: Path, what: str, section: str, entries: Entries, known: Entries, empty: CommentedMap
) -> None:
    """Write the entries into a section of the file atomically.

    what: kind of file, for errors; known: the entries that the file has; empty: content of a new file. Raises
    ConfigError for a file that the parser that keeps comments does not accept.
    """
    yaml = YAML()
    yaml.width, yaml.preserve_quotes = LINE_WIDTH, True
    file = _loaded(path, what, yaml) if path.is_file() else empty
    written = file[section]
    for name in [name for name in written if name not in entries]:
        del written[name]
    for name, entry in entries.items():
        if name not in known:
            written[_text(name)] = entry
            _update(entry, entry, CommentedMap())
        elif known[name] != entry:
            _update(written[name], entry, known[name])
    stream = io.BytesIO()
    yaml.dump(file, stream)
    write_atomic(path, stream.getvalue())


def _update(written: CommentedMap, entry: CommentedMap, known: CommentedMap) -> None:
    """Give an entry of the file these fields, and only these; a field that has not changed stays as it is written."""
    for key in [key for key in written if key not in entry]:
        del written[key]
    written.update({key: _text(value) for key, value in entry.items() if known.get(key) != value})


def _text(value: object) -> object:
    """Return a text in quotes if the loader, which follows YAML 1.1, would read another type, as of `yes` or 1:30."""
    if not isinstance(value, str):
        return value
    tag = Resolver().resolve(ScalarNode, value, (True, False))  # type: ignore[no-untyped-call]
    return value if tag == TEXT_TAG else DoubleQuotedScalarString(value)


def _loaded(path: Path, what: str, yaml: YAML) -> CommentedMap:
    try:
        content: CommentedMap = yaml.load(path.read_bytes())
    except YAMLError as error:  # it keeps comments, and reads a little less than the loader
        raise ConfigError(f"{what} {path} cannot be changed: {_problem(error)}") from None
    return content


def _problem(error: YAMLError) -> str:
    """Return in one line what the parser does not accept, as a tab between two words."""
    problem, mark = getattr(error, "problem", None), getattr(error, "problem_mark", None)
    return f"{problem or 'it is not plain YAML'}{f' in line {mark.line + 1}' if mark else ''}"
