"""Validation of messages from other processes and devices, with the same rules at every interface."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from chefbot.msgs.chefbot_msgs import ObstacleScan, WheelTicks
from chefbot.msgs.idl.errors import InvalidMessageError
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
"""Maximum magnitude of a number in a message whose type gives no other bounds."""
MAX_TEXT, MAX_ELEMENTS, MAX_NUMBERS = 10_000, 10_000, 1_000_000
"""Maximum lengths of a string, of an array of messages or strings and of an array of numbers, for types that give no
other ones."""


def check(message: Message) -> None:
    """Check a message and all nested messages; InvalidMessageError if a rule of its type is broken.

    Numbers and arrays of fixed size (covariances) must be finite and within their bounds, strings and arrays not
    longer than allowed, and all rules of the type must hold.
    """
    kind = type(message)
    for name, check_field in _checks(kind):
        check_field(getattr(message, name), name)
    for rule in kind.RULES:
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
    return bool(_checks(kind) or kind.RULES)


@cache
def _checks(kind: type[Message]) -> tuple[tuple[str, Callable[[Any, str], None]], ...]:
    """Return the fields of a type that need a check, with the check; most types have none."""
    checks = [(field.name, _check_of(kind, field)) for field in fields_of(kind)]
    return tuple((name, check) for name, check in checks if check is not None)


def _check_of(kind: type[Message], field: MessageField) -> Callable[[Any, str], None] | None:
    if field.message is not None and not field.is_array:
        needless = (kind, field.name) in MAY_BE_UNSET or not _has_rules(field.message)
        return None if needless else _check_nested
    if field.message is not None or field.element == "string" or (field.is_array and not field.fixed_size):
        nested = field.message is not None and _has_rules(field.message)
        return partial(_check_length, limit=max_length_of(kind, field), nested=nested)
    if field.is_array:
        return _check_array if field.element.startswith("float") else None
    if not field.element.startswith("float") and field.name not in kind.BOUNDS:
        return None  # an integer has the bounds of its type
    low, high = kind.BOUNDS.get(field.name, (-MAX_ABS_VALUE, MAX_ABS_VALUE))
    return partial(_check_number, low=low, high=high, may_be_nan=kind in MAY_BE_NAN)


def max_length_of(kind: type[Message], field: MessageField) -> int:
    """Return the maximum length of a string or of an array of variable length."""
    if field.name in kind.MAX_LENGTHS:
        return kind.MAX_LENGTHS[field.name]
    if field.message is not None or (field.element == "string" and field.is_array):
        return MAX_ELEMENTS
    return MAX_TEXT if field.element == "string" else MAX_NUMBERS


def _check_number(value: float, name: str, *, low: float, high: float, may_be_nan: bool) -> None:
    if low <= value <= high:
        return
    if not math.isfinite(value):
        if may_be_nan:
            return
        raise InvalidMessageError(f"{name} is {value}")
    if (low, high) == (-MAX_ABS_VALUE, MAX_ABS_VALUE):
        raise InvalidMessageError(f"{name} is {value:.6g}, which no measure is")
    raise InvalidMessageError(f"{name} is {value:.6g}, it must lie between {low:g} and {high:g}")


def _check_array(value: Any, name: str) -> None:
    if not np.all(np.isfinite(value)):
        raise InvalidMessageError(f"{name} holds a number that is not finite")
    if np.abs(value).max() > MAX_ABS_VALUE:
        raise InvalidMessageError(f"{name} holds {np.abs(value).max():.6g}, which no measure is")


def _check_length(value: Any, name: str, *, limit: int, nested: bool) -> None:
    """Check the length of a string or an array, the strings of an array, and its messages if `nested`."""
    if len(value) > limit:
        unit = "characters" if isinstance(value, str) else "elements"
        raise InvalidMessageError(f"{name} has {len(value)} {unit}, at most {limit} can be used")
    if nested:
        for message in value:
            _check_nested(message, name)
    elif isinstance(value, tuple) and any(isinstance(text, str) and len(text) > MAX_TEXT for text in value):
        raise InvalidMessageError(f"{name} holds a text of more than {MAX_TEXT} characters")


def _check_nested(value: Message, name: str) -> None:
    try:
        check(value)
    except InvalidMessageError as error:
        raise InvalidMessageError(f"{name}.{error}") from None
