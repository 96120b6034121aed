"""The sentences of the collision monitor, and how often they change."""

from __future__ import annotations

import math

import pytest

from chefbot.robot.load import load_robot
from chefbot.safety.monitor_polygons import MonitorPolygons
from chefbot.safety.monitor_text import (
    REPEAT_NS,
    ReasonKeeper,
    SensedPoint,
    direction_text,
    limited_text,
    obstacle_text,
    unseen_text,
)

LIMIT = "the lidar sees an obstacle 0.12 m ahead on the left"


def test_standing_is_stopped_and_moving_is_slowed() -> None:
    assert limited_text(LIMIT, (0.35, 0.0), (0.0, 0.0)) == f"Stopped: {LIMIT}."
    assert limited_text(LIMIT, (0.35, 0.0), (0.1, 0.0)) == f"Slowed: {LIMIT}."
    assert limited_text(LIMIT, (0.0, 0.0), (0.0, 0.0)) == "" == limited_text("", (0.35, 0.0), (0.35, 0.0))


@pytest.mark.parametrize(
    ("bearing", "text"),
    [
        (0, "ahead"),
        (40, "ahead on the left"),
        (90, "on the left"),
        (-135, "behind on the right"),
        (180, "behind"),
    ],
)
def test_directions_are_eighths_of_a_turn(bearing: float, text: str) -> None:
    assert direction_text(math.cos(math.radians(bearing)), math.sin(math.radians(bearing))) == text


def test_unseen_ground_lies_where_the_robot_drives() -> None:
    ends = ("behind", "beside", "ahead of")
    assert [unseen_text(v) for v in (-0.1, 0.0, 0.1)] == [
        f"no sensor has recently seen the ground {end} the robot" for end in ends
    ]


def test_beginning_and_end_of_a_reason_do_not_wait() -> None:
    keeper = ReasonKeeper()
    assert not keeper.changes("", 0)
    assert keeper.changes("a", 1) and not keeper.changes("a", 2)
    assert not keeper.changes("b", REPEAT_NS) and keeper.changes("b", REPEAT_NS + 1)
    assert keeper.changes("", REPEAT_NS + 2) and keeper.sentence == ""


ROUND, RECTANGULAR = load_robot("chefbot"), load_robot("jackal")


@pytest.mark.parametrize(
    ("age", "text"),
    [
        (0.0, "the lidar sees an obstacle 0.25 m ahead"),
        (0.49, "the lidar sees an obstacle 0.25 m ahead"),
        (0.5, "the lidar saw an obstacle 0.25 m ahead, a moment ago"),
        (0.9, "the lidar saw an obstacle 0.25 m ahead, a moment ago"),
        (1.0, "the lidar saw an obstacle 0.25 m ahead, 1 s ago"),
        (7.6, "the lidar saw an obstacle 0.25 m ahead, 8 s ago"),
    ],
)
def test_what_was_seen_earlier_is_named_as_the_past(age: float, text: str) -> None:
    assert obstacle_text(SensedPoint("lidar", 0.4, 0.0, age), MonitorPolygons.of(ROUND, 0.01, 0.02)) == text


def test_distances_are_from_the_skin_and_never_negative() -> None:
    front = RECTANGULAR.footprint.front
    for robot, x, gap in (
        (RECTANGULAR, front + 0.5, "0.50"),
        (ROUND, 0.1, "0.00"),
        (RECTANGULAR, 0.1, "0.00"),
    ):
        text = obstacle_text(SensedPoint("lidar", x, 0.0, 0.0), MonitorPolygons.of(robot, 0.01, 0.02))
        assert text == f"the lidar sees an obstacle {gap} m ahead"


def test_less_than_a_twentieth_of_the_motion_is_standing() -> None:
    """Both turn rate and speed count, in both directions."""
    assert limited_text(LIMIT, (-0.2, 0.6), (-0.01, -0.02)).startswith("Stopped")
    assert limited_text(LIMIT, (-0.2, 0.6), (-0.01, -0.04)).startswith("Slowed")
    assert limited_text(LIMIT, (0.2, -0.6), (0.01, 0.04)).startswith("Slowed")
    assert limited_text(LIMIT, (0.5, -0.5), (0.0, 0.06)).startswith("Slowed")
    assert limited_text(LIMIT, (0.0, 1.0), (0.0, 0.04)).startswith("Stopped")
    assert limited_text(LIMIT, (0.0, 1.0), (0.0, 0.05)).startswith("Slowed")


def test_a_millimetre_a_second_is_driving() -> None:
    sides = [
        unseen_text(v).split("ground ")[1].split(" the robot")[0] for v in (-0.0011, -0.001, 0.0009, 0.001)
    ]
    assert sides == ["behind", "beside", "beside", "ahead of"]


def test_reasons_change_at_most_twice_a_second() -> None:
    keeper, half = ReasonKeeper(), 500_000_000
    assert keeper.changes("a", half) and not keeper.changes("b", 2 * half - 1) and keeper.sentence == "a"
    assert keeper.changes("b", 2 * half) and not keeper.changes("c", 3 * half - 1)


def test_the_first_reason_is_published_at_any_time() -> None:
    """Also when the clock begins at zero, and at once after a reason that has ended."""
    keeper = ReasonKeeper()
    assert keeper.changes("a", 0) and keeper.changes("", 1) and keeper.changes("b", 2)
    assert keeper.changes("b", 3) is False and keeper.changes("c", 3) is False
