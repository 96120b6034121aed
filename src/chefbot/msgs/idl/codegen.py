"""Functions made once for each message type: straight lines of Python instead of loops over its definition."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Source:
    """Python text of a function `f`, with the objects that it names."""

    def __init__(self, head: str, **names: Any) -> None:
        self._lines = [head]
        self._names: dict[str, Any] = names

    def add(self, *lines: str) -> None:
        """Lines of the function's body."""
        self._lines.extend("    " + line for line in lines)

    def name(self, value: Any) -> str:
        """What the text calls an object by."""
        key = f"c{len(self._names)}"
        self._names[key] = value
        return key

    def compile(self) -> Callable[..., Any]:
        """The function."""
        exec("\n".join(self._lines), self._names)  # text made from our own definitions only
        made: Callable[..., Any] = self._names["f"]
        return made
