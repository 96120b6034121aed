"""SI values in the units of data sheets."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from chefbot.maths.units import to_si


class Shown(NamedTuple):
    """A unit to show, and whether it is added to the SI value or replaces it."""

    unit: str
    beside: bool


SHOWN = {
    "N m": Shown("kg cm", True),
    "rad/s": Shown("rpm", True),
    "J": Shown("Wh", False),
    "s": Shown("h", False),
    "m": Shown("mm", False),
    "rad": Shown("deg", False),
}


def amount(value: float, unit: str, digits: int = 3) -> str:
    """Return the value with its unit: `amount(0.675, "N m") == "0.675 N m (6.88 kg cm)"`."""
    shown = SHOWN.get(unit)
    if shown is None:
        return f"{_figure(value, digits)} {unit}".rstrip()
    other = f"{_figure(value / _factor(unit, shown.unit), digits)} {shown.unit}"
    return f"{_figure(value, digits)} {unit} ({other})" if shown.beside else other


def amounts(one: float, other: float, unit: str) -> tuple[str, str]:
    """Return two values as texts, with more than three digits where these would be equal."""
    digits = next((d for d in (3, 4, 5) if amount(one, unit, d) != amount(other, unit, d)), 6)
    return amount(one, unit, digits), amount(other, unit, digits)


@cache
def _factor(unit: str, shown: str) -> float:
    return to_si(f"1 {shown}", unit)


def _figure(value: float, digits: int) -> str:
    is_whole = abs(value) >= 10.0**digits - 0.5  # also what is rounded up to the power of ten
    return f"{value:.0f}" if is_whole else f"{value:.{digits}g}"
