"""Numbers on the command line, as NAME=VALUE."""

from __future__ import annotations

import math

from chefbot.errors import UserError


def given_numbers(texts: list[str], example: str) -> dict[str, float]:
    """Return the numbers of `--set` by name; `example` is a valid one, for the sentence of a UserError."""
    given = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            given[name] = float(value)
        except ValueError:
            raise UserError(f"--set {text:.60}: give a name and a number, as --set {example}") from None
        if not math.isfinite(given[name]):
            raise UserError(f"--set {text:.60}: give a finite number")
    return given
