"""The speed limit of a slow zone on a commanded speed."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.safety.speed_limit import fraction_within, too_slow_reason

SPEEDS = st.floats(-1.0, 1.0).filter(lambda v: abs(v) > 1e-3)


@given(SPEEDS, st.floats(0.01, 2.0))
def test_the_fraction_is_the_largest_that_keeps_the_limit(v: float, limit: float) -> None:
    fraction = fraction_within(SpeedLimit(speed_limit=limit), v, 0.5)
    assert abs(v) * fraction == pytest.approx(min(abs(v), limit))


@given(SPEEDS, st.floats(1.0, 100.0))
def test_a_limit_in_percent_is_of_the_maximum_speed(v: float, percent: float) -> None:
    fraction = fraction_within(SpeedLimit(percentage=True, speed_limit=percent), v, 0.5)
    assert abs(v) * fraction == pytest.approx(min(abs(v), 0.005 * percent))


@pytest.mark.parametrize("limit", [None, SpeedLimit(), SpeedLimit(speed_limit=-1.0)])
def test_no_limit_leaves_a_command_as_it_is(limit: SpeedLimit | None) -> None:
    assert fraction_within(limit, 0.3, 0.5) == 1.0


def test_a_robot_that_turns_in_place_is_not_limited() -> None:
    assert fraction_within(SpeedLimit(speed_limit=0.1), 0.0, 0.5) == 1.0


@pytest.mark.parametrize(
    "limit",
    [None, SpeedLimit(), SpeedLimit(speed_limit=0.02), SpeedLimit(percentage=True, speed_limit=4.0)],
)
def test_a_limit_of_two_centimetres_a_second_lets_it_drive(limit: SpeedLimit | None) -> None:
    assert too_slow_reason(limit, 0.5) == ""


@pytest.mark.parametrize(
    "limit", [SpeedLimit(speed_limit=0.0055), SpeedLimit(percentage=True, speed_limit=1.1)]
)
def test_a_limit_too_low_to_drive_is_named(limit: SpeedLimit) -> None:
    assert too_slow_reason(limit, 0.5) == "The speed limit of 5.5 mm/s is too low to drive."
