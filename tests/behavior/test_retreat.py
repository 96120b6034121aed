"""Retreat along the track: far enough to see the place again, never farther than the track leads."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.behavior.retreat import MAX_RETREAT, SPACING, RecentTrack, Retreat, sight_distance
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot

SECOND = 1_000_000_000


def driven(poses: list[SE2], step_ns: int = SECOND // 5) -> RecentTrack:
    track = RecentTrack()
    for i, pose in enumerate(poses):
        track.add(pose, i * step_ns)
    return track


def end_of(robot: SE2, retreat: Retreat) -> SE2:
    """Return the pose after a retreat."""
    turned = SE2(robot.x, robot.y, robot.yaw + retreat.turn)
    return turned @ SE2(-retreat.distance, 0.0, 0.0) @ SE2(0.0, 0.0, retreat.turn_to_place)


def straight(length: float, heading: float = 0.0) -> list[SE2]:
    return [SE2(0.0, 0.0, heading) @ SE2(0.05 * i, 0.0, 0.0) for i in range(round(length / 0.05) + 1)]


def test_it_backs_straight_until_the_place_is_in_sight() -> None:
    poses = straight(1.0)
    retreat = driven(poses).retreat(poses[-1], 1.2, 0.0, 0.6)
    assert retreat == pytest.approx((0.0, 0.4, 0.0), abs=0.051)


@given(st.floats(0.03, 0.2), st.floats(0.0, 0.2))
def test_a_retreat_ends_between_two_poses_of_the_track(spacing: float, phase: float) -> None:
    """The longest retreat is hardly longer than one to the sight distance; a fast robot's poses pass both."""
    track = driven([SE2(spacing * i, 0.0, 0.0) for i in range(round(1.0 / spacing))])
    robot = SE2(1.0 + min(phase, spacing), 0.0, 0.0)
    retreat = track.retreat(robot, robot.x + 0.18, 0.0, 0.62)
    assert retreat is not None and retreat.distance == pytest.approx(0.445, abs=0.0051)


def test_a_robot_that_has_turned_first_turns_to_its_track() -> None:
    poses = straight(1.0)
    robot = SE2(1.0, 0.0, -1.2)
    retreat = driven(poses).retreat(robot, 1.1, -0.1, 0.6)
    assert retreat is not None and retreat.turn == pytest.approx(1.2)


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.floats(0.0, 0.3), st.floats(-3.1, 3.1))
def test_afterwards_it_faces_the_place_from_afar(
    heading: float, yaw: float, near: float, bearing: float
) -> None:
    poses = straight(1.0, heading)
    robot = poses[-1]._replace(yaw=yaw)
    x, y = robot.x + near * math.cos(bearing), robot.y + near * math.sin(bearing)
    retreat = driven(poses).retreat(robot, x, y, 0.6)
    if retreat is None:  # only if the robot had driven past the place
        assert all(math.hypot(x - p.x, y - p.y) < 0.6 or robot.distance(p) > MAX_RETREAT for p in poses)
        return
    place = end_of(robot, retreat).between(SE2(x, y, 0.0))
    assert math.hypot(place.x, place.y) >= 0.6 - 1e-9
    assert math.atan2(place.y, place.x) == pytest.approx(0.0, abs=1e-6)
    assert 0.0 < retreat.distance <= MAX_RETREAT


def test_there_is_none_if_the_place_is_far_or_the_track_short() -> None:
    poses = straight(1.0)
    assert driven(poses).retreat(poses[-1], 1.7, 0.0, 0.6) is None
    assert driven(straight(0.2)).retreat(poses[4], 0.4, 0.0, 0.6) is None
    assert RecentTrack().retreat(SE2(0.0, 0.0, 0.0), 0.2, 0.0, 0.6) is None


def test_ground_that_was_covered_long_ago_is_not_a_track() -> None:
    track = driven(straight(1.0))
    robot = straight(1.0)[-1]
    track.add(robot, 20 * SECOND)
    assert track.retreat(robot, 1.2, 0.0, 0.6) is not None
    track.add(robot, 40 * SECOND)
    assert track.retreat(robot, 1.2, 0.0, 0.6) is None


def test_a_robot_that_stands_adds_nothing() -> None:
    track = RecentTrack()
    for i in range(1000):
        track.add(SE2(0.9 * SPACING * (i % 2), 0.0, 0.0), i)
    assert track.retreat(SE2(0.0, 0.0, 0.0), 0.1, 0.0, 0.1 + SPACING / 2) is None


def test_the_camera_sees_what_is_farther_than_its_minimum_range() -> None:
    camera = load_robot("chefbot").sensors.depth_camera
    assert camera is not None
    assert camera.mount.x + camera.range_min < sight_distance(camera) < 2.0 * MAX_RETREAT
