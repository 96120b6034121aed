"""Whether a message from outside can be worked with; the same rules at every border of the robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from chefbot.msgs.chefbot_msgs import ObstacleScan, WheelTicks
from chefbot.msgs.constraints import RULES, Rule
from chefbot.msgs.idl.fields import FieldType, fields_of
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import BatteryState, Image, Imu, LaserScan, Range
from chefbot.msgs.tf2_msgs import TFMessage

MAY_BE_UNKNOWN: tuple[type[Message], ...] = (BatteryState, Range)
"""These say "not measured" with NaN and "nothing there" with infinity (REP-117). So do lists such as a scan's
ranges, whose numbers are never looked at here."""
MAY_BE_UNSET = {(Imu, "orientation")}
"""Drivers of gyros leave it at zero."""
MEASURED = (Image, Imu, LaserScan, ObstacleScan, Odometry, Range, WheelTicks)
"""Their stamps say when something was measured."""
AHEAD_NS = 5_000_000_000
"""Such a stamp, and that of a moving transform, may lie so far in the future: clocks differ, some nodes post-date."""
LARGEST = 1e12
"""No measure that a robot is told is larger."""


class InvalidMessageError(ValueError):
    """Names the field and says what is wrong with it."""


def check(message: Message) -> None:
    """InvalidMessageError if the message breaks a rule of its type, or of one that it holds.

    Numbers and fixed arrays (covariances) are finite, and what `rules.RULES` says holds.
    """
    kind = type(message)
    for name, check_field in _checks(kind):
        check_field(getattr(message, name), name)
    for rule in RULES.get(kind, ()):
        _apply(rule, message)


def check_stamp(message: Message, now_ns: int) -> None:
    """InvalidMessageError if it was measured, or is a transform that holds, further ahead of `now_ns` than AHEAD_NS.

    A single transform from the future would hide all that come after it; an echo from there would never be old.
    """
    ahead_ns = _newest(message, now_ns) - now_ns
    if ahead_ns > AHEAD_NS:
        raise InvalidMessageError(
            f"stamp is {ahead_ns / 1e9:.6g} s ahead of the robot's clock; set both clocks by the same source"
        )


def _newest(message: Any, now_ns: int) -> int:
    if isinstance(message, TFMessage):
        return max((one.header.stamp.ns for one in message.transforms), default=now_ns)
    measured = isinstance(message, MEASURED)
    return int(message.header.stamp.ns) if measured else now_ns


def _apply(rule: Rule, message: Message) -> None:
    wrong = rule(message)
    if wrong:
        raise InvalidMessageError(wrong)


@cache
def _has_rules(kind: type[Message]) -> bool:
    return bool(_checks(kind)) or kind in RULES


@cache
def _checks(kind: type[Message]) -> tuple[tuple[str, Callable[[Any, str], None]], ...]:
    """What has to be looked at in the fields of a type; nothing for most."""
    found = [(one.name, _check_of(kind, one)) for one in fields_of(kind)]
    return tuple((name, check) for name, check in found if check is not None)


def _check_of(kind: type[Message], field: FieldType) -> Callable[[Any, str], None] | None:
    if field.message is not None:
        if (kind, field.name) in MAY_BE_UNSET or not _has_rules(field.message):
            return None
        return _all if field.is_array else _one
    if not field.element.startswith("float") or kind in MAY_BE_UNKNOWN:
        return None
    if field.is_array:
        return _array if field.fixed_size else None
    return _number


def _number(value: float, name: str) -> None:
    if not math.isfinite(value):
        raise InvalidMessageError(f"{name} is {value}")
    if abs(value) > LARGEST:
        raise InvalidMessageError(f"{name} is {value:.6g}, which no measure is")


def _array(value: Any, name: str) -> None:
    if not np.all(np.isfinite(value)):
        raise InvalidMessageError(f"{name} holds a number that is not finite")


def _one(value: Message, name: str) -> None:
    try:
        check(value)
    except InvalidMessageError as error:
        raise InvalidMessageError(f"{name}.{error}") from None


def _all(values: tuple[Message, ...], name: str) -> None:
    for value in values:
        _one(value, name)
