"""Slipping wheels are found by scans that stay the same, and only then."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.support.pillar_room import ANGLES, ranges_at

from chefbot.control.slip_detector import MAX_TRAVEL, MIN_TRAVEL, SlipDetector
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header

MOUNT = SE2(0.1, 0.02, 0.3)
SPEED, PERIOD_NS = 0.3, 100_000_000
Ranges = Callable[[SE2], NDArray[np.float32]]
POSES = st.builds(SE2, x=st.floats(0.0, 2.0), y=st.floats(-1.0, 1.5), yaw=st.floats(-math.pi, math.pi))


def scan_of(ranges: NDArray[np.float32], time_ns: int) -> LaserScan:
    step = 2.0 * math.pi / len(ANGLES)
    return LaserScan(Header.of(time_ns, "laser"), -math.pi, math.pi - step, step, 0.0, 0.1, 0.1, 20.0, ranges)


def drive(
    start: SE2,
    slip: float,
    turn: float = 0.0,
    seconds: float = 3.0,
    ranges: Ranges = ranges_at,
    noise: float = 0.01,
    speed: float = SPEED,
) -> list[bool]:
    """Return for each scan of a drive whether the wheels slipped; slip: share of the travel that is not driven.

    turn: rad/s, as in the odometry, which begins at another pose than the drive.
    """
    rng, detector, truth, odom = np.random.default_rng(1), SlipDetector(), start, SE2(7.0, -3.0, 1.0)
    found = []
    for i in range(round(seconds * 1e9) // PERIOD_NS):
        measured = ranges(truth @ MOUNT) + rng.normal(0.0, noise, len(ANGLES)).astype(np.float32)
        detector.process(scan_of(measured, i * PERIOD_NS), odom, MOUNT)
        found.append(detector.is_slipping)
        step = speed * PERIOD_NS / 1e9
        truth, odom = (
            pose @ SE2(length, 0.0, turn * PERIOD_NS / 1e9)
            for pose, length in ((truth, step * (1.0 - slip)), (odom, step))
        )
    return found


@given(start=POSES, turn=st.floats(-0.5, 0.5))
def test_wheels_that_drive_the_robot_do_not_slip(start: SE2, turn: float) -> None:
    assert not any(drive(start, 0.0, turn, seconds=2.0))


@given(start=POSES, turn=st.floats(-0.5, 0.5))
def test_wheels_that_turn_in_vain_slip(start: SE2, turn: float) -> None:
    found = drive(start, 1.0, turn)
    begin = math.ceil(MIN_TRAVEL / SPEED * 1e9 / PERIOD_NS)
    assert not any(found[:begin])
    assert found[begin + 4] and found[-1]


@pytest.mark.parametrize("slip", [0.0, 1.0])
def test_wheels_that_creep_are_judged(slip: float) -> None:
    """Through a narrow passage the robot creeps; at a board above the sensors it would push on for minutes."""
    found = drive(SE2(0.5, 0.2, 0.4), slip, seconds=10.0, speed=0.04)
    assert any(found) == bool(slip)


def test_the_time_since_which_a_robot_stands_is_known() -> None:
    detector, ranges = SlipDetector(), ranges_at(MOUNT)
    for i in range(30):
        detector.process(scan_of(ranges, i * PERIOD_NS), SE2(0.03 * i, 0.0, 0.0), MOUNT)
        if detector.is_slipping:
            travel = 0.03 * (i - detector.standing_since_ns / PERIOD_NS)
            assert MIN_TRAVEL <= travel < MIN_TRAVEL + 0.04
    assert detector.is_slipping


@pytest.mark.parametrize("slip", [0.0, 0.3, -0.3])
def test_a_share_of_slip_is_left_to_localization(slip: float) -> None:
    assert not any(drive(SE2(0.0, 0.0, 0.4), slip))


def corridor(laser: SE2) -> NDArray[np.float32]:
    """Return the ranges between two walls without an end, 2 m apart."""
    sine = np.sin(ANGLES + laser.yaw)
    with np.errstate(divide="ignore"):
        return (np.where(sine > 0, 1.0 - laser.y, -1.0 - laser.y) / sine).astype(np.float32)


@pytest.mark.parametrize("slip", [0.0, 1.0])
def test_a_corridor_without_features_shows_nothing(slip: float) -> None:
    assert not any(drive(SE2(0.0, 0.0, 0.0), slip, ranges=corridor))


def beside_a_walker(laser: SE2) -> NDArray[np.float32]:
    """Return the ranges of a room in which a person of half a metre walks 1 m ahead of the robot."""
    ranges = ranges_at(laser)
    ahead = np.abs(np.arctan2(np.sin(ANGLES + MOUNT.yaw), np.cos(ANGLES + MOUNT.yaw))) < 0.25
    ranges[ahead] = np.minimum(ranges[ahead], 1.0)
    return ranges


def test_a_person_who_walks_ahead_is_not_a_standstill() -> None:
    assert not any(drive(SE2(0.0, -1.0, 0.0), 0.0, ranges=beside_a_walker))


def test_a_jump_of_the_odometry_is_not_a_slip() -> None:
    detector, ranges = SlipDetector(), ranges_at(MOUNT)
    for i in range(40):
        odom = SE2(2.0 * MAX_TRAVEL if i > 20 else 0.0, 0.0, 0.0)
        detector.process(scan_of(ranges, i * PERIOD_NS), odom, MOUNT)
        assert not detector.is_slipping


def test_a_reset_forgets_the_slip() -> None:
    detector, ranges = SlipDetector(), ranges_at(MOUNT)
    slipping = []
    for i in range(30):
        detector.process(scan_of(ranges, i * PERIOD_NS), SE2(0.03 * i, 0.0, 0.0), MOUNT)
        slipping.append(detector.is_slipping)
        if i == 20:
            detector.reset()
            assert not detector.is_slipping
    assert slipping[20] and not any(slipping[21:])


@pytest.mark.parametrize("increment", [0.0, 1e-30])
def test_a_scan_in_one_direction_shows_nothing(increment: float) -> None:
    detector = SlipDetector()
    for i in range(30):
        header = Header.of(i * PERIOD_NS, "laser")
        scan = LaserScan(header, 0.0, 0.0, increment, 0.0, 0.1, 0.1, 20.0, np.ones(180, np.float32))
        detector.process(scan, SE2(0.03 * i, 0.0, 0.0), MOUNT)
        assert not detector.is_slipping


@pytest.mark.parametrize("ranges", [np.full(180, np.nan), np.full(180, np.inf), np.zeros(180), np.zeros(0)])
def test_scans_without_ranges_show_nothing(ranges: NDArray[np.float64]) -> None:
    detector = SlipDetector()
    for i in range(30):
        detector.process(scan_of(ranges.astype(np.float32), i * PERIOD_NS), SE2(0.03 * i, 0.0, 0.0), MOUNT)
        assert not detector.is_slipping
