"""The messages of msgspec's validation as sentences for the owner of a file."""

from __future__ import annotations

import re
from collections.abc import Callable

import msgspec

KINDS = {
    "int": "a whole number",
    "float": "a number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a section with keys",
    "null": "empty",
}
GIVEN = {**KINDS, "float": "a decimal number"}
BOUNDS = {">=": "at least", ">": "above", "<=": "at most", "<": "below"}
PARTS = {"array": "entries", "str": "characters", "object": "keys"}

_RULES: tuple[tuple[str, Callable[[re.Match[str]], str]], ...] = (
    (r"Expected `([^`]+)`, got `([^`]+)`", lambda m: f"must be {_kinds(m[1])}, not {GIVEN.get(m[2], m[2])}"),
    (r"Expected `(\w+)[^`]*` of length (>=|<=) (\d+)",
     lambda m: f"must have {BOUNDS[m[2]]} {m[3]} {PARTS[m[1]]}"),
    (r"Expected `(\w+)[^`]*` of length (\d+), got (\d+)",
     lambda m: f"must have {m[2]} {PARTS[m[1]]}, not {m[3]}"),
    (r"Expected `[^`]+` (>=|>|<=|<) (\S+)", lambda m: f"must be {BOUNDS[m[1]]} {m[2]}"),
    (r"Expected `str[^`]*` matching regex '(.*)'", lambda m: f"must be a text of the form {m[1]}"),
    (r"Invalid enum value '?(.*?)'?", lambda m: f"unknown value {m[1]!r}"),
    (r"Object missing required field `(\w+)`", lambda m: f"the key {m[1]!r} is missing"),
)  # fmt: skip
"""Patterns of whole messages, and their sentences; the first that fits counts."""


def validation_error_text(error: msgspec.ValidationError) -> str:
    """Return what is wrong with a content, after the key that it is at."""
    message, _, path = str(error).partition(" - at `$")
    key = path.rstrip("`").lstrip(".")
    return f"{key + ': ' if key else ''}{validation_text(message)}"


def validation_text(message: str) -> str:
    """Return a message of msgspec, without its path, in plain English; one that is not known as it is."""
    for pattern, sentence in _RULES:
        if match := re.fullmatch(pattern, message):
            return sentence(match)
    return message


def _kinds(union: str) -> str:
    return " or ".join(KINDS.get(kind, kind) for kind in union.split(" | "))
