"""Cliff sensors forbid driving towards what they see no floor at."""

from __future__ import annotations

import math

import pytest

from chefbot.board.sensors import cliff_messages
from chefbot.msgs.sensor_msgs import Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.safety.cliff_stop import READING_TIMEOUT_NS, CliffStop

ROBOT = load_robot("chefbot_cliff")
FRONT, LEFT, RIGHT, REAR = 1, 2, 4, 8


def stop_with(cliffs: int, stamp_ns: int = 0) -> CliffStop:
    stop = CliffStop(ROBOT)
    for message in cliff_messages(stamp_ns, cliffs, ROBOT):
        assert isinstance(message, Range) and message.radiation_type == Range.INFRARED
        assert message.min_range == message.max_range and math.isinf(message.range)
        stop.process(message)
    return stop


@pytest.mark.parametrize(
    ("cliffs", "forward", "backward"),
    [
        (0, 0.3, -0.2),
        (FRONT, 0.0, -0.2),
        (LEFT, 0.0, -0.2),
        (RIGHT, 0.0, -0.2),
        (REAR, 0.3, 0.0),
        (15, 0.0, 0.0),
    ],
)
def test_a_cliff_stops_motion_in_its_direction(cliffs: int, forward: float, backward: float) -> None:
    stop = stop_with(cliffs)
    assert (stop.limit(0.3, 1), stop.limit(-0.2, 1)) == (forward, backward)
    assert stop.limit(0.0, 1) == 0.0


def test_the_reason_names_sensor_and_direction() -> None:
    assert (
        stop_with(REAR).reason(-0.1, 1)
        == "Cliff sensor cliff_3 sees no floor: the robot does not drive backward."
    )
    assert stop_with(REAR).reason(0.1, 1) == ""
    assert "cliff_1 sees no floor" in stop_with(LEFT).reason(0.1, 1)


@pytest.mark.parametrize(("age_ns", "v"), [(READING_TIMEOUT_NS, 0.3), (READING_TIMEOUT_NS + 1, 0.0)])
def test_a_silent_sensor_counts_as_a_cliff(age_ns: int, v: float) -> None:
    stop = stop_with(0)
    assert stop.limit(0.3, age_ns) == v
    assert ("sends nothing" in stop.reason(0.3, age_ns)) == (v == 0.0)
    assert CliffStop(ROBOT).limit(0.3, 0) == 0.0


def test_a_notice_is_made_once() -> None:
    stop = stop_with(FRONT)
    assert stop.new_notice(0.3, 1) and not stop.new_notice(0.3, 2) and not stop.new_notice(0.0, 3)
    for message in cliff_messages(4, 0, ROBOT):
        assert isinstance(message, Range)
        stop.process(message)
    assert stop.new_notice(0.3, 5) == ""
    for message in cliff_messages(6, FRONT, ROBOT):
        assert isinstance(message, Range)
        stop.process(message)
    assert stop.new_notice(0.3, 7)


def test_a_robot_without_cliff_sensors_is_not_limited() -> None:
    stop = CliffStop(load_robot("chefbot"))
    stop.process(Range(range=math.inf))
    assert stop.limit(0.3, 10**12) == 0.3


def test_a_reading_from_the_future_does_not_show_floor() -> None:
    """A sensor whose clock is an hour ahead would otherwise see floor for an hour after its last reading."""
    stop = stop_with(0, stamp_ns=3_600 * 10**9)
    assert stop.limit(0.3, 10**9) == 0.0
    assert (
        stop.reason(0.3, 10**9)
        == "Cliff sensor cliff_0 sends readings from the future: the robot does not drive forward."
    )
    ahead = stop_with(0, stamp_ns=10**9 + 100_000_000)
    assert ahead.limit(0.3, 10**9) == 0.3, "clocks of two computers differ a little"


def test_a_fifth_of_a_second_without_readings_is_a_cliff() -> None:
    assert stop_with(0).limit(0.3, 200_000_000) == 0.3 and stop_with(0).limit(0.3, 200_000_001) == 0.0


@pytest.mark.parametrize("distance", [math.nan, math.inf])
def test_a_reading_without_a_distance_does_not_show_floor(distance: float) -> None:
    stop = stop_with(0)
    frame = "cliff_1_link"
    stop.process(Range(Header.of(0, frame), Range.INFRARED, 0.1, 0.05, 0.05, distance))
    assert stop.limit(0.3, 1) == 0.0 and stop.limit(-0.2, 1) == -0.2


@pytest.mark.parametrize(("distance", "v"), [(0.05, 0.0), (0.0499, 0.3), (-math.inf, 0.3)])
def test_floor_is_nearer_than_the_range_of_the_sensor(distance: float, v: float) -> None:
    stop = stop_with(0)
    stop.process(Range(Header.of(0, "cliff_1_link"), Range.INFRARED, 0.1, 0.05, 0.05, distance))
    assert stop.limit(0.3, 1) == v


def test_a_standing_robot_gets_no_new_reason() -> None:
    """At a cliff behind it, standing is neither driving backward nor a reason for a notice, nor an end of one."""
    stop = stop_with(REAR)
    assert stop.new_notice(0.0, 1) == "" and stop.new_notice(-0.1, 2)
    assert stop.new_notice(0.0, 3) == "" and stop.new_notice(-0.1, 4) == "", "it was reported already"
