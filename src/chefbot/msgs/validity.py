"""Validation of messages from other processes and devices, with the same rules at every interface."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from chefbot.msgs.chefbot_msgs import ObstacleScan, WheelTicks
from chefbot.msgs.constraints import RULES
from chefbot.msgs.errors import InvalidMessageError
from chefbot.msgs.idl.fields import MessageField, fields_of
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import BatteryState, Image, Imu, LaserScan, Range
from chefbot.msgs.tf2_msgs import TFMessage

MAY_BE_NAN: tuple[type[Message], ...] = (BatteryState, Range)
"""Types in which NaN means "not measured" and infinity "nothing in range" (REP-117).

The same holds for arrays of variable length, such as a scan's ranges, whose numbers are not checked here."""
MAY_BE_UNSET = {(Imu, "orientation")}
"""Fields that drivers may leave at zero, such as the orientation of a gyro."""
STAMPED_MEASUREMENTS = (Image, Imu, LaserScan, ObstacleScan, Odometry, Range, WheelTicks)
"""Types whose stamp is the time of a measurement."""
MAX_FUTURE_NS = 5_000_000_000
"""Maximum time by which the stamp of a measurement or a dynamic transform may lie in the future, ns.

Clocks differ, and some nodes post-date their transforms."""
MAX_ABS_VALUE = 1e12
"""Maximum magnitude of a number in a message."""


def check(message: Message) -> None:
    """Check a message and all nested messages; InvalidMessageError if a rule of its type is broken.

    Numbers and arrays of fixed size (covariances) must be finite, and all rules in `constraints.RULES` must
    hold.
    """
    kind = type(message)
    for name, check_field in _checks(kind):
        check_field(getattr(message, name), name)
    for rule in RULES.get(kind, ()):
        if violation := rule(message):
            raise InvalidMessageError(violation)


def check_stamp(message: Message, now_ns: int) -> None:
    """Check that the stamp of a measurement or transform is not in the future; InvalidMessageError if it is.

    The limit is MAX_FUTURE_NS after `now_ns`. A single transform from the future would hide all later ones; a
    range reading from the future would never expire.
    """
    ahead_ns = _newest_stamp_ns(message, now_ns) - now_ns
    if ahead_ns > MAX_FUTURE_NS:
        raise InvalidMessageError(
            f"stamp is {ahead_ns / 1e9:.6g} s ahead of the robot's clock; set both clocks by the same source"
        )


def _newest_stamp_ns(message: Any, now_ns: int) -> int:
    if isinstance(message, TFMessage):
        return max((transform.header.stamp.ns for transform in message.transforms), default=now_ns)
    measured = isinstance(message, STAMPED_MEASUREMENTS)
    return int(message.header.stamp.ns) if measured else now_ns


@cache
def _has_rules(kind: type[Message]) -> bool:
    return bool(_checks(kind)) or kind in RULES


@cache
def _checks(kind: type[Message]) -> tuple[tuple[str, Callable[[Any, str], None]], ...]:
    """Return the fields of a type that need a check, with the check; most types have none."""
    checks = [(field.name, _check_of(kind, field)) for field in fields_of(kind)]
    return tuple((name, check) for name, check in checks if check is not None)


def _check_of(kind: type[Message], field: MessageField) -> Callable[[Any, str], None] | None:
    if field.message is not None:
        if (kind, field.name) in MAY_BE_UNSET or not _has_rules(field.message):
            return None
        return _check_all_nested if field.is_array else _check_nested
    if not field.element.startswith("float") or kind in MAY_BE_NAN:
        return None
    if field.is_array:
        return _check_array if field.fixed_size else None
    return _check_number


def _check_number(value: float, name: str) -> None:
    if not math.isfinite(value):
        raise InvalidMessageError(f"{name} is {value}")
    if abs(value) > MAX_ABS_VALUE:
        raise InvalidMessageError(f"{name} is {value:.6g}, which no measure is")


def _check_array(value: Any, name: str) -> None:
    if not np.all(np.isfinite(value)):
        raise InvalidMessageError(f"{name} holds a number that is not finite")


def _check_nested(value: Message, name: str) -> None:
    try:
        check(value)
    except InvalidMessageError as error:
        raise InvalidMessageError(f"{name}.{error}") from None


def _check_all_nested(values: tuple[Message, ...], name: str) -> None:
    for value in values:
        _check_nested(value, name)
