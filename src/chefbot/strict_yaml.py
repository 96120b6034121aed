"""A YAML loader for untrusted files: no anchors, no duplicate keys, no types of Python, not too many values."""

from __future__ import annotations

import pickle
import re
from functools import lru_cache
from typing import Any

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.resolver import Resolver

MAX_NODES = 80_000
"""Maximum number of keys and values; reading as many takes less than a second."""
MAX_DIGITS = 400
"""Maximum length of a number; YAML's 1:59:59:... takes a time that grows with the square of it."""
MAX_TAG_LINES = 10
"""Maximum number of %TAG directives; libyaml compares each with all others."""
_TAG_LINE = re.compile("^%TAG", re.MULTILINE)


class _Strict:
    """Checks of nodes, for a loader of PyYAML."""

    _nodes = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node; no anchors, which can expand exponentially."""
        loader: Any = self
        self._nodes += 1
        if self._nodes > MAX_NODES:
            mark = loader.peek_event().start_mark
            raise yaml.composer.ComposerError(None, None, f"more than {MAX_NODES} keys and values", mark)
        if loader.check_event(yaml.AliasEvent):
            mark = loader.peek_event().start_mark
            raise yaml.composer.ComposerError(None, None, "anchors are not allowed", mark)
        return super().compose_node(parent, index)  # type: ignore[misc]

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """Construct a dict; each key once."""
        loader: Any = self
        keys: set[Any] = set()
        for key_node, _ in node.value:
            key = loader.construct_object(key_node, deep=True)
            if not isinstance(key, (str, int, bool, float)):
                raise yaml.constructor.ConstructorError(
                    None, None, "a key is not a name", key_node.start_mark
                )
            if key in keys:
                raise yaml.constructor.ConstructorError(
                    None, None, f"{key!r} is given twice", key_node.start_mark
                )
            keys.add(key)
        return super().construct_mapping(node, deep)  # type: ignore[misc]

    def construct_yaml_int(self, node: Any) -> int:
        """Construct an integer of a limited length."""
        _check_length(node)
        return super().construct_yaml_int(node)  # type: ignore[misc]

    def construct_yaml_float(self, node: Any) -> float:
        """Construct a float of a limited length."""
        _check_length(node)
        return super().construct_yaml_float(node)  # type: ignore[misc]


def _check_length(node: Any) -> None:
    if len(node.value) > MAX_DIGITS:
        raise yaml.constructor.ConstructorError(
            None, None, f"an impossible number of {len(node.value)} characters", node.start_mark
        )


class _PythonLoader(_Strict, yaml.SafeLoader):
    """The loader where PyYAML has no libyaml; several times slower."""


if yaml.__with_libyaml__:
    from yaml.cyaml import CParser  # type: ignore[attr-defined]

    class _Loader(_Strict, Composer, CParser, SafeConstructor, Resolver):
        """The parser of libyaml under PyYAML's own composer, which can be checked."""

        def __init__(self, text: str) -> None:
            CParser.__init__(self, text)
            Composer.__init__(self)
            SafeConstructor.__init__(self)
            Resolver.__init__(self)
else:
    _Loader = _PythonLoader  # type: ignore[assignment,misc]

for _kind in ("int", "float"):  # PyYAML calls what is registered, not the method of this name
    for _loader in (_PythonLoader, _Loader):
        _loader.add_constructor(f"tag:yaml.org,2002:{_kind}", getattr(_loader, f"construct_yaml_{_kind}"))


def load_strict(text: str) -> Any:
    """Return dicts, lists, numbers and strings. Raises yaml.YAMLError, and ValueError for impossible numbers.

    The texts read last are kept: a launch reads the launches that it includes, and the catalogue, several times.
    """
    return pickle.loads(_pickled(text))


@lru_cache(maxsize=16)
def _pickled(text: str) -> bytes:
    """Return what a text contains, as bytes from which every caller gets values of its own."""
    if len(_TAG_LINE.findall(text)) > MAX_TAG_LINES:
        raise yaml.MarkedYAMLError(problem=f"more than {MAX_TAG_LINES} %TAG directives")
    return pickle.dumps(yaml.load(text, Loader=_Loader))  # type: ignore[arg-type]
