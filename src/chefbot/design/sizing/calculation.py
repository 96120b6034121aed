"""A result with its working: the formula in symbols, the same with the numbers put in, and where it is from."""

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
    """What stands for each symbol, in SI units, angles in radians."""
    source: str

    @property
    def numbers(self) -> str:
        """The formula with the numbers put in; evaluating it gives `value` to four digits."""
        return _WORD.sub(self._number, self.formula)

    def _number(self, word: re.Match[str]) -> str:
        value = self.symbols.get(word[0])
        if value is None:
            return word[0]
        return f"{value:.5g}" if value >= 0.0 else f"({value:.5g})"


def worked(name: str, value: float, unit: str, formula: str, source: str, **symbols: float) -> Result:
    """A Result; the symbols of the formula are given by name."""
    return Result(name, value, unit, formula, symbols, source)
