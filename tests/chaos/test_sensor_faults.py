"""Tests that the robot stops, names the sensor and later resumes when sensor data fail."""

from __future__ import annotations

import math

import pytest

from chefbot.control.waiting_state import WAIT_TIMEOUT
from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_SUCCEEDED
from tests.chaos.sensor_fault_drive import (
    CONTACT,
    ROBOTS,
    TITLES,
    SensorFaultDrive,
    box_offset,
    drive_with_fault,
    sensors_of,
    straight_free_starts,
)

STOP_TIME, STANDSTILL_TIME = 0.5, 0.55
"""Seconds from the fault to the last twist that is not zero, and until the robot stands."""
CASES = [(robot, sensor) for robot in ROBOTS for sensor in sensors_of(ROBOTS[robot])]
FAULTS = ["stop", "freeze"]
MANY_DRIVES = 20


def check(robot: str, sensor: str, fault: str, drives: list[int], seed: int) -> None:
    """Check in each drive that the robot stops in time and the goal stays active with the sensor named."""
    starts = straight_free_starts("hotel", max(drives) + 1, seed)
    for i in drives:
        outcome = drive_with_fault(ROBOTS[robot], starts[i], fault, sensor, box_offset(i), seed + i)
        assert outcome.contact <= CONTACT and outcome.stopped_after <= STOP_TIME, (i, outcome)
        assert outcome.stood_after <= STANDSTILL_TIME, (i, outcome)
        assert TITLES[sensor] in outcome.description and outcome.status == 0, (i, outcome)


@pytest.mark.rotated("sensor faults during a goal")
@pytest.mark.slow
@pytest.mark.parametrize(("robot", "sensor"), CASES)
@pytest.mark.parametrize("fault", FAULTS)
def test_robot_stops_before_the_box(robot: str, sensor: str, fault: str) -> None:
    check(robot, sensor, fault, [FAULTS.index(fault)], seed=3)


@pytest.mark.long
@pytest.mark.parametrize(("robot", "sensor"), CASES)
@pytest.mark.parametrize("fault", FAULTS)
def test_robot_stops_before_the_box_in_twenty_drives(robot: str, sensor: str, fault: str) -> None:
    check(robot, sensor, fault, list(range(MANY_DRIVES)), seed=1)


@pytest.mark.rotated("sensor faults during a goal")
@pytest.mark.slow
@pytest.mark.parametrize("fault", ["late", "half_blind"])
def test_late_data_and_a_half_blind_lidar_stop_the_robot(fault: str) -> None:
    check("lidar", "scan", fault, [0], seed=3)


def drive_at_full_speed(robot: str = "lidar", profile: str = "real") -> SensorFaultDrive:
    drive = SensorFaultDrive(ROBOTS[robot], straight_free_starts("hotel", 1, 5)[0], profile=profile)
    drive.accelerate_to_full_speed()
    return drive


@pytest.mark.rotated("sensor faults during a goal")
@pytest.mark.slow
@pytest.mark.parametrize("profile", ["real", "perfect"])
@pytest.mark.parametrize("fault", FAULTS)
def test_the_goal_resumes_when_the_sensor_recovers(fault: str, profile: str) -> None:
    """The perfect profile has no noise, so that a frozen scan looks like one of a scene in which nothing moves."""
    drive = drive_at_full_speed(profile=profile)
    drive.inject(fault, "scan")
    drive.run(12.0)
    assert drive.wait_reason and not drive.status, "waiting for the sensor is not to be reported as stuck"
    drive.inject("none", "scan")
    drive.run(10.0)
    assert drive.status == STATUS_SUCCEEDED and not drive.wait_reason and not drive.contact


@pytest.mark.rotated("sensor faults during a goal")
@pytest.mark.slow
def test_alternating_sensor_faults_are_each_named() -> None:
    drive = drive_at_full_speed("chefbot_lidar")
    drive.inject("stop", "scan")
    drive.run(1.0)
    assert TITLES["scan"] in drive.wait_reason
    drive.inject("freeze", "depth")
    drive.inject("none", "scan")
    drive.run(1.5)
    assert TITLES["depth"] in drive.wait_reason
    drive.inject("none", "depth")
    drive.run(10.0)
    assert drive.status == STATUS_SUCCEEDED and not drive.wait_reason


@pytest.mark.rotated("sensor faults during a goal")
@pytest.mark.slow
def test_a_permanent_sensor_fault_aborts_the_goal_and_is_named() -> None:
    drive = drive_at_full_speed()
    drive.inject("stop", "scan")
    drive.run(WAIT_TIMEOUT + 2.0)
    (outcome,) = drive.topic("follow_path/_action/get_result")
    assert outcome.status == STATUS_ABORTED and TITLES["scan"] in outcome.result.error_msg
    assert math.isclose(drive.simulation.truth().v, 0.0, abs_tol=0.01)
