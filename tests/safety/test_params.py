"""Bounds of what may stop the wheels: a value that is no number is refused as one out of range."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from chefbot.safety.params import DriveBaseParams


@pytest.mark.parametrize(
    ("key", "low", "high"), [("teleop_hold", 0.0, 10.0), ("ultrasonic_margin", 0.0, 1.0)]
)
def test_bounds_are_part_of_the_range(key: str, low: float, high: float) -> None:
    for value in (low, high):
        assert getattr(msgspec.convert({key: value}, DriveBaseParams), key) == value
    wrong: list[Any] = [low - 0.01, high + 0.01, float("nan"), float("inf"), float("-inf"), "1", None]
    for value in wrong:
        with pytest.raises(msgspec.ValidationError, match=key):
            msgspec.convert({key: value}, DriveBaseParams)


def test_an_unknown_key_is_refused_also_inside() -> None:
    for data in ({"teleop": 1.0}, {"limiter": {"time_out": 0.3}}, {"limiter": {"timeout": 0.51}}):
        with pytest.raises(msgspec.ValidationError):
            msgspec.convert(data, DriveBaseParams)
