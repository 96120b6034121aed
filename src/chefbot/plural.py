"""Numbers of things in the output of commands."""

from __future__ import annotations


def number_of(count: int, noun: str) -> str:
    """Return '1 place', '2 places': the count with the noun in the right number."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
