"""Text in xacro's expressions: methods of texts and dictionaries, and formatting, each with a bound on its result.

Python's own formatting reaches attributes of its arguments, and fills any width with spaces; here a format has plain
fields and widths below 1000.
"""

from __future__ import annotations

import re
import string
from collections.abc import Callable
from typing import Any

from chefbot.design.errors import DesignError

MAX_STRING = 100_000
"""Characters of a text that an expression may make."""
MAX_FIELDS, MAX_WIDTH = 100, 999
_SPEC = re.compile(r"(?:.?[<>=^])?[ +-]?#?0?\d{0,3}[,_]?(?:\.\d{1,2})?[bcdeEfFgGnosxX%]?")
_FIELD = re.compile(r"\d{0,3}|[A-Za-z]\w*")
_PERCENT = re.compile(r"%(?:\(\w+\))?[-+ #0]*\d{0,3}(?:\.\d{1,2})?[diouxXeEfFgGcrs%]")


class RefusedError(DesignError):
    """An expression that is more than arithmetic; the text is a sentence."""


def filled(form: str, values: Any) -> str:
    """Return `form % values`. Raises RefusedError for a form with widths from elsewhere, or very wide."""
    if len(_PERCENT.findall(form)) > MAX_FIELDS or "%" in _PERCENT.sub("", form):
        raise RefusedError(f"'{form:.40}' is not a plain format; widths have up to three digits")
    return form % values


def formatted(value: Any, spec: str) -> str:
    """Return `value` in Python's format specification, as in f'{value:.3f}'. Raises RefusedError for a wide one."""
    if not _SPEC.fullmatch(spec):
        raise RefusedError(f"':{spec:.40}' is not a plain format; widths have up to three digits")
    return format(value, spec)


def _format(form: str, *values: Any, **named: Any) -> str:
    parts = list(string.Formatter().parse(form))
    for _, field, spec, conversion in parts:
        plain = field is None or (_FIELD.fullmatch(field) and _SPEC.fullmatch(spec or ""))
        if not plain or conversion not in (None, "s", "r"):
            raise RefusedError(f"'{form:.40}' is not a plain format; it has fields without attributes")
    if len(parts) > MAX_FIELDS:
        raise RefusedError(f"'{form:.40}' has more than {MAX_FIELDS} fields")
    return form.format(*values, **named)


def _replace(text: str, old: str, new: str, count: int = -1) -> str:
    _check_length(len(text) + text.count(old) * len(new))
    return text.replace(old, new, count)


def _join(text: str, parts: Any) -> str:
    parts = list(parts)
    _check_length(sum(len(part) + len(text) for part in parts))
    return text.join(parts)


def _zfill(text: str, width: int) -> str:
    _check_length(width)
    return text.zfill(width)


def _check_length(length: int) -> None:
    if length > MAX_STRING:
        raise RefusedError(f"a text is longer than {MAX_STRING} characters")


_PLAIN = (
    "split", "rsplit", "splitlines", "strip", "lstrip", "rstrip", "lower", "upper", "capitalize", "title",
    "startswith",
    "endswith", "find", "rfind", "index", "count", "partition", "rpartition", "isdigit", "isalpha", "isalnum",
    "removeprefix", "removesuffix",
)  # fmt: skip
TEXT_METHODS: dict[str, Callable[..., Any]] = {
    **{name: getattr(str, name) for name in _PLAIN},
    "format": _format,
    "replace": _replace,
    "join": _join,
    "zfill": _zfill,
}
"""Methods of a text that an expression may call; their results are not much longer than the text."""
DICT_METHODS: dict[str, Callable[..., Any]] = {
    "keys": lambda given: list(given.keys()),
    "values": lambda given: list(given.values()),
    "items": lambda given: list(given.items()),
    "get": lambda given, key, other=None: given.get(key, other),
}
"""Methods of a dictionary that an expression may call; they return lists."""
