"""A result with its calculation: the formula in symbols, the same with numbers, and its source."""

from __future__ import annotations

import re
from typing import NamedTuple

from chefbot.design.export.xacro_expression import evaluate, math_names

_WORD = re.compile(r"\b[A-Za-z_]\w*\b")
_FUNCTIONS = math_names()
RULE = "next "
"""First word of what is chosen from a list by a rule, not evaluated."""
MIN_DIGITS, MAX_DIGITS = 5, 17
"""Significant digits of a printed number; 17 give any float exactly."""
RELATIVE_ERROR = 1e-3
"""Permitted error of the printed calculation."""
NEGLIGIBLE_SHARE = 1e-3
"""Share of the largest symbol below which a result counts as zero."""


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
        """Return the formula with numbers filled in; it evaluates to `value` with three digits.

        Numbers have five digits, or more where five are too few: in a difference of nearly equal terms, or just
        above the step of a ceil.
        """
        if self.formula.startswith(RULE):
            return self._with_digits(MIN_DIGITS)
        digits = next((n for n in range(MIN_DIGITS, MAX_DIGITS) if self._is_precise(n)), MAX_DIGITS)
        return self._with_digits(digits)

    def _with_digits(self, digits: int) -> str:
        def number(word: re.Match[str]) -> str:
            value = self.symbols.get(word[0])
            if value is None:
                return word[0]
            return f"{value:.{digits}g}" if value >= 0.0 else f"({value:.{digits}g})"

        return _WORD.sub(number, self.formula)

    def _is_precise(self, digits: int) -> bool:
        """Whether the formula evaluates to `value`, or to nothing beside its largest term, with so many digits."""
        rounded = {name: float(f"{value:.{digits}g}") for name, value in self.symbols.items()}
        evaluated = evaluate(self.formula.replace("^", "**"), _FUNCTIONS | rounded)
        largest = max((abs(value) for value in self.symbols.values()), default=0.0)
        return abs(evaluated - self.value) <= RELATIVE_ERROR * max(
            abs(self.value), NEGLIGIBLE_SHARE * largest
        )


def calculated(name: str, value: float, unit: str, formula: str, source: str, **symbols: float) -> Result:
    """Return a Result; the symbols of the formula are given by name."""
    return Result(name, value, unit, formula, symbols, source)
