"""Bounds of what may stop the wheels: a value that is not a number is refused as one out of range."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from chefbot.safety.params import CollisionMonitorParams, DriveBaseParams
from chefbot.safety.velocity_limiter import VelocityLimiterParams

SAFE_RANGES: list[tuple[type[msgspec.Struct], str, float, float, float]] = [
    (VelocityLimiterParams, "timeout", 0.05, 0.3, 0.5),
    (DriveBaseParams, "teleop_hold", 0.0, 1.0, 10.0),
    (DriveBaseParams, "ultrasonic_margin", 0.0, 0.04, 1.0),
    (CollisionMonitorParams, "margin", 0.0, 0.02, 1.0),
    (CollisionMonitorParams, "side_margin", 0.0, 0.01, 1.0),
    (CollisionMonitorParams, "slow_margin", 0.0, 0.02, 1.0),
    (CollisionMonitorParams, "slowdown_ratio", 0.05, 0.5, 1.0),
    (CollisionMonitorParams, "obstacle_memory_time", 5.0, 60.0, 600.0),
    (CollisionMonitorParams, "ground_memory_time", 1.0, 30.0, 60.0),
]
"""What the owner of a robot can set, from where to where, and what holds if he sets nothing."""


@pytest.mark.parametrize(("kind", "key", "low", "usual", "high"), SAFE_RANGES)
def test_bounds_are_part_of_the_range(
    kind: type[msgspec.Struct], key: str, low: float, usual: float, high: float
) -> None:
    assert getattr(kind(), key) == usual
    for value in (low, high):
        assert getattr(msgspec.convert({key: value}, kind), key) == value
    nonsense: list[Any] = [float("nan"), float("inf"), float("-inf"), "1", None]
    for value in [low - 0.01, high + 0.01, *nonsense]:
        with pytest.raises(msgspec.ValidationError, match=key):
            msgspec.convert({key: value}, kind)


def test_an_unknown_key_is_refused_also_inside() -> None:
    for data in ({"teleop": 1.0}, {"limiter": {"time_out": 0.3}}, {"limiter": {"timeout": 0.51}}):
        with pytest.raises(msgspec.ValidationError):
            msgspec.convert(data, DriveBaseParams)


def test_every_sensor_of_the_robot_has_to_send() -> None:
    assert DriveBaseParams().monitor.optional_sensors == ()
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"optional_sensors": ["gyro"]}, CollisionMonitorParams)
