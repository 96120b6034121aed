"""A finding: a fault of a robot with its numbers, the key to change and a suggested value."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Literal, NamedTuple

import msgspec

from chefbot.robot.errors import RobotFileError
from chefbot.robot.spec import Robot
from chefbot.robot.validation import check_buildable, check_geometry

Severity = Literal["error", "warning"]
_INDEXED = re.compile(r"(\w+)\[(\d+)\]")
SEARCH_OFFSETS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 30, 35, 40, 50, 60, 70, 80, 90, 100, 120, 150)
"""Range of the search for a valid length, mm."""


class Finding(NamedTuple):
    """A fault of a robot in SI units; `have` should be at least, or at most, `bound`."""

    severity: Severity
    rule: str
    subject: str
    """Names of the parts."""
    sentence: str
    have: float
    bound: float
    unit: str
    at_least: bool
    key: str
    value: str
    """Suggested value of `key` in the notation of a robot file; empty if no single value suffices."""


class Bound(NamedTuple):
    """A figure of the robot and its minimum."""

    have: float
    minimum: float
    unit: str

    @property
    def broken(self) -> bool:
        """Return whether the figure is below the minimum by more than rounding."""
        return self.have < self.minimum - 1e-9 * max(1.0, abs(self.minimum))


def below(
    rule: str, subject: str, sentence: str, bound: Bound, key: str, value: str, severity: Severity = "error"
) -> Iterator[Finding]:
    """Return the finding if the figure is below its bound, else nothing."""
    if bound.broken:
        yield Finding(
            severity, rule, subject, sentence, bound.have, bound.minimum, bound.unit, True, key, value
        )


def mm_up(metres: float) -> str:
    """Return the length in metres rounded up to millimetres: `mm_up(0.0801) == "81 mm"`."""
    return f"{math.ceil(1000.0 * metres - 1e-6)} mm"


def mm_down(metres: float) -> str:
    """Return the length in metres rounded down to millimetres, with the unit."""
    return f"{math.floor(1000.0 * metres + 1e-6)} mm"


def value_at(robot: Robot, key: str) -> Any:
    """Return the number at a key of the robot file, such as `value_at(robot, "equipment[0].place.x")`."""
    value: Any = robot
    for name, index in _steps(key):
        value = getattr(value, name) if index is None else getattr(value, name)[index]
    return value


def with_value(robot: Robot, key: str, value: Any) -> Robot:
    """Return the robot with another value at `key`."""
    changed: Robot = _replaced(robot, _steps(key), value)
    return changed


def _steps(key: str) -> list[tuple[str, int | None]]:
    steps: list[tuple[str, int | None]] = []
    for word in key.split("."):
        match = _INDEXED.fullmatch(word)
        steps.append((match[1], int(match[2])) if match else (word, None))
    return steps


def _replaced(value: Any, steps: list[tuple[str, int | None]], new: Any) -> Any:
    if not steps:
        return new
    (name, index), rest = steps[0], steps[1:]
    inner = getattr(value, name)
    if index is None:
        return msgspec.structs.replace(value, **{name: _replaced(inner, rest, new)})
    items = tuple(_replaced(item, rest, new) if i == index else item for i, item in enumerate(inner))
    return msgspec.structs.replace(value, **{name: items})


def nearest_valid_length(
    robot: Robot, keys: Iterable[str], is_valid: Callable[[Robot], bool]
) -> tuple[str, str]:
    """The first of the keys, and the length nearest to its present one, with which the robot is good.

    ("", "") where there is none within the last of SEARCH_OFFSETS.
    """
    for key in keys:
        for value in _outwards(float(value_at(robot, key))):
            candidate = with_value(robot, key, value)
            if has_solids(candidate) and is_valid(candidate) and is_possible(candidate):
                return key, f"{1000.0 * value:.6g} mm"
    return "", ""


def _outwards(present: float) -> Iterator[float]:
    """Integer millimetres around the present value, the nearest first."""
    start = round(1000.0 * present)
    for away in SEARCH_OFFSETS:
        yield (start + away) / 1000.0
        yield (start - away) / 1000.0


def has_solids(robot: Robot) -> bool:
    """Return whether all lengths are positive and holes leave material, so that solids exist."""
    return _passes(robot, check_geometry)


def is_possible(robot: Robot) -> bool:
    """Return whether the robot passes the validation of a robot file."""
    return _passes(robot, check_buildable)


def _passes(robot: Robot, look: Callable[[Robot, str], None]) -> bool:
    try:
        msgspec.convert(msgspec.to_builtins(robot), Robot)
        look(robot, "")
    except (RobotFileError, msgspec.ValidationError):
        return False
    return True
