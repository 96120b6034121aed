"""A result with its calculation: the formula in symbols, the same with numbers, and its source."""

from __future__ import annotations

import re
from typing import NamedTuple

_WORD = re.compile(r"\b[A-Za-z_]\w*\b")


class Result(NamedTuple):
    """One figure of the design sheet, in SI units."""

    name: str
    value: float
    unit: str
    """SI; empty for a pure number."""
    formula: str
    """Right-hand side in the symbols of `symbols`; `*`, `/`, `^`, and ceil, sqrt, sin, cos, tan."""
    symbols: dict[str, float]
    """Value of each symbol in SI units, angles in radians."""
    source: str

    @property
    def numbers(self) -> str:
        """Return the formula with numbers filled in; it evaluates to `value` with four digits."""
        return _WORD.sub(self._number, self.formula)

    def _number(self, word: re.Match[str]) -> str:
        value = self.symbols.get(word[0])
        if value is None:
            return word[0]
        return f"{value:.5g}" if value >= 0.0 else f"({value:.5g})"


def calculated(name: str, value: float, unit: str, formula: str, source: str, **symbols: float) -> Result:
    """Return a Result; the symbols of the formula are given by name."""
    return Result(name, value, unit, formula, symbols, source)
