"""Conversion of quantities with units to SI numbers; the only place that handles units."""

from __future__ import annotations

import re
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from chefbot.errors import ChefbotError

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_UNIT = r"[A-Za-z°µμΩ%]+(?:(?:\^|\*\*)-?[0-9])?"
_QUANTITY = re.compile(rf"\s*{_NUMBER}\s*(?P<unit>{_UNIT}(?:(?:\s*[*/]\s*|\s+){_UNIT})*)?\s*")
DEFINITIONS = Path(__file__).with_name("units.txt")
OHM_SIGN = "\u2126"
"""The ohm sign of data sheets, for which Unicode recommends the letter omega."""
_MAX_LENGTH = 60
"""Maximum number of characters; with the pattern above it keeps expressions like 9**9**9 from evaluation."""


@cache
def _registry() -> Any:
    import pint  # imported late: it takes a third of a second, and only files written by users need it

    return pint.UnitRegistry(DEFINITIONS)


class UnitError(ChefbotError):
    """A text that is not a quantity in the unit that is expected."""


@lru_cache(maxsize=4096)  # a robot file has 120 quantities, which pint parses in 50 ms
def to_si(text: str, unit: str) -> float:
    """Convert a quantity with a unit to a number: `to_si("9 cm", "m") == 0.09`.

    Where a torque is expected, `kg cm` is read as kgf cm, as data sheets write it. Raise UnitError with what
    is wrong, without the location: the caller knows it.
    """
    import pint

    text = text.replace(OHM_SIGN, "Ω")
    _check_form(text, unit)
    normalized = text.replace("kg cm", "kgf cm") if unit == "N m" else text
    try:
        return float(_registry().Quantity(normalized).to(unit).magnitude)
    except pint.DimensionalityError:
        raise UnitError(f"{text!r} is not a quantity in {unit}") from None
    except (pint.PintError, AttributeError, ValueError, OverflowError):
        raise UnitError(f"{text!r} is not a valid quantity; write a number and a unit of {unit}") from None


def _check_form(text: str, unit: str) -> None:
    parts = _QUANTITY.fullmatch(text) if len(text) <= _MAX_LENGTH else None
    if parts is None:
        raise UnitError(
            f"{text[:_MAX_LENGTH]!r} is not a quantity; write a number and a unit, as in '1 {unit}'"
        )
    if parts["unit"] is None and unit:
        raise UnitError(f"{text!r} has no unit, write it with one, as in '1 {unit}'")
