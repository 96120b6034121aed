"""Quantities with units, as a person writes them, to plain SI numbers. The only place that knows units."""

from __future__ import annotations

from functools import cache
from typing import Any

from chefbot.errors import UserError


@cache
def _registry() -> Any:
    import pint  # takes half a second, and only files that people write need it

    return pint.UnitRegistry()


def to_si(text: str, unit: str) -> float:
    """`to_si("9 cm", "m") == 0.09`. `kg cm` is read as a torque where one is wanted, as data sheets write it.

    Raises UserError that says what is wrong, without the place: the caller knows that.
    """
    import pint

    wanted = text.replace("kg cm", "kgf cm") if unit == "N m" else text
    try:
        quantity = _registry().Quantity(wanted)
        if quantity.unitless and unit:
            raise UserError(f"{text!r} has no unit, write it with one, as in '1 {unit}'")
        return float(quantity.to(unit).magnitude)
    except pint.DimensionalityError:
        raise UserError(f"{text!r} is not a quantity in {unit}") from None
    except (pint.UndefinedUnitError, pint.errors.DefinitionSyntaxError, AssertionError):
        raise UserError(
            f"{text!r} is not a quantity that I can read; write a number and a unit of {unit}"
        ) from None
    except (
        ValueError,
        TypeError,
        AttributeError,
        OverflowError,
        SyntaxError,
        ZeroDivisionError,
        RecursionError,
    ):
        raise UserError(f"{text!r} is not a quantity; write a number and a unit, as in '1 {unit}'") from None
