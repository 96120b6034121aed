"""Numbers from outside that no part of the robot could work with: not finite where a measure is meant."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from chefbot.msgs.base import Message
from chefbot.msgs.fields import FieldType, fields_of
from chefbot.msgs.sensor_msgs import BatteryState, Range
from chefbot.wire.errors import WireError

MAY_BE_UNKNOWN: tuple[type[Message], ...] = (BatteryState, Range)
"""These say "not measured" with NaN and "nothing there" with infinity (REP-117). So do lists such as a scan's
ranges, which are never looked at here."""


def check_finite(message: Message) -> None:
    """WireError that names the field if a number or a fixed array (a covariance) is NaN or infinite."""
    for name, check in _checks(type(message)):
        check(getattr(message, name), name)


@cache
def _checks(kind: type[Message]) -> tuple[tuple[str, Callable[[Any, str], None]], ...]:
    """What has to be looked at in messages of a type; nothing for most."""
    if kind in MAY_BE_UNKNOWN:
        return ()
    found = [(one.name, _check_of(one)) for one in fields_of(kind)]
    return tuple((name, check) for name, check in found if check is not None)


def _check_of(field: FieldType) -> Callable[[Any, str], None] | None:
    if field.message is not None:
        if not _checks(field.message):
            return None
        return _all if field.is_array else _one
    if not field.element.startswith("float"):
        return None
    if field.is_array:
        return _array if field.fixed_size else None
    return _number


def _number(value: float, name: str) -> None:
    if not math.isfinite(value):
        raise WireError(f"{name} is {value}")


def _array(value: Any, name: str) -> None:
    if not np.all(np.isfinite(value)):
        raise WireError(f"{name} holds a number that is not finite")


def _one(value: Message, name: str) -> None:
    try:
        check_finite(value)
    except WireError as error:
        raise WireError(f"{name}.{error}") from None


def _all(values: tuple[Message, ...], name: str) -> None:
    for value in values:
        _one(value, name)
