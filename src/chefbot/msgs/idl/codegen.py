"""Code generation: a straight-line Python function per message type, without loops over its definition."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class FunctionSource:
    """The source text of a function `f`, with the objects that it refers to."""

    def __init__(self, head: str, **names: Any) -> None:
        self._lines = [head]
        self._names: dict[str, Any] = names

    def add(self, *lines: str) -> None:
        """Append lines to the function's body."""
        self._lines.extend("    " + line for line in lines)

    def name(self, value: Any) -> str:
        """Return a name by which the source can refer to an object."""
        key = f"c{len(self._names)}"
        self._names[key] = value
        return key

    def compile(self) -> Callable[..., Any]:
        """Compile the source and return the function."""
        exec("\n".join(self._lines), self._names)  # the text comes from our own definitions only
        function: Callable[..., Any] = self._names["f"]
        return function
