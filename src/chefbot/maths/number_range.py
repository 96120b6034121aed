"""Ranges of numbers that a seed draws from."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from numpy.random import Generator

from chefbot.errors import ChefbotError, name_hint


class NumberRange(NamedTuple):
    """The range of a number, from which a seed draws it. whole: whether it is a count."""

    low: float
    high: float
    unit: str
    meaning: str
    whole: bool = False

    def draw(self, rng: Generator) -> float:
        """Draw a number, uniformly, to three decimals."""
        if self.whole:
            return int(rng.integers(int(self.low), int(self.high) + 1))
        return round(float(rng.uniform(self.low, self.high)), 3)

    def check(self, what: str, value: float, error: type[ChefbotError]) -> None:
        """Raise `error` for a value outside the range; `what` names the number in its sentence."""
        if not self.low <= value <= self.high or (self.whole and value != int(value)):
            kind = "a whole number" if self.whole else "a number"
            unit = f" {self.unit}" if self.unit else ""
            raise error(f"{what} is {value:g}; it must be {kind} from {self.low:g} to {self.high:g}{unit}")


def check_name(what: str, name: str, names: Iterable[str], error: type[ChefbotError]) -> None:
    """Raise `error`, with the nearest name, for the name of a number that `what` does not have."""
    if name not in names:
        raise error(f"{what} has no number {name!r}{name_hint(name, names)}")
