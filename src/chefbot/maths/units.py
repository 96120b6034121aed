"""Quantities with units, as a person writes them, to plain SI numbers. The only place that knows units."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from chefbot.errors import UserError

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_UNIT = r"[A-Za-z°µμΩ%]+(?:(?:\^|\*\*)-?[0-9])?"
_QUANTITY = re.compile(rf"\s*{_NUMBER}\s*(?P<unit>{_UNIT}(?:(?:\s*[*/]\s*|\s+){_UNIT})*)?\s*")
_LONGEST = 60
"""Characters; with the form above this keeps sums such as 9**9**9 away from the evaluation of units."""


@cache
def _registry() -> Any:
    import pint  # takes half a second, and only files that people write need it

    return pint.UnitRegistry()


def to_si(text: str, unit: str) -> float:
    """`to_si("9 cm", "m") == 0.09`. `kg cm` is read as a torque where one is wanted, as data sheets write it.

    Raises UserError that says what is wrong, without the place: the caller knows that.
    """
    import pint

    parts = _QUANTITY.fullmatch(text) if len(text) <= _LONGEST else None
    if parts is None:
        raise UserError(f"{text[:_LONGEST]!r} is not a quantity; write a number and a unit, as in '1 {unit}'")
    if parts["unit"] is None and unit:
        raise UserError(f"{text!r} has no unit, write it with one, as in '1 {unit}'")
    wanted = text.replace("kg cm", "kgf cm") if unit == "N m" else text
    try:
        return float(_registry().Quantity(wanted).to(unit).magnitude)
    except pint.DimensionalityError:
        raise UserError(f"{text!r} is not a quantity in {unit}") from None
    except (pint.PintError, AttributeError, ValueError, OverflowError):
        raise UserError(
            f"{text!r} is not a quantity that I can read; write a number and a unit of {unit}"
        ) from None
