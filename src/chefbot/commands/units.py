"""SI figures in the units that makers print on their parts."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from chefbot.robot.units import to_si


class Shown(NamedTuple):
    """A unit to show, and whether beside the SI figure or instead of it."""

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


def amount(value: float, unit: str) -> str:
    """`amount(0.675, "N m") == "0.675 N m (6.88 kg cm)"`."""
    shown = SHOWN.get(unit)
    if shown is None:
        return f"{_figure(value)} {unit}".rstrip()
    other = f"{_figure(value / _factor(unit, shown.unit))} {shown.unit}"
    return f"{_figure(value)} {unit} ({other})" if shown.beside else other


@cache
def _factor(unit: str, shown: str) -> float:
    return to_si(f"1 {shown}", unit)


def _figure(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}"
