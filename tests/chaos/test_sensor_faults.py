"""A sensor that is silent, frozen, late or half blind: the robot stands, says which one it is, and goes on later."""

from __future__ import annotations

import math

import pytest

from chefbot.control.waiting_state import WAIT_TIMEOUT
from chefbot.msgs.action_msgs import STATUS_ABORTED, STATUS_SUCCEEDED
from tests.chaos.driven_blind import (
    CONTACT,
    ROBOTS,
    TITLES,
    BlindDrive,
    drive_into,
    free_ways,
    sensors_of,
    side_of,
)

STAND = 0.5
"""Seconds from the fault to the last twist but zero."""
CASES = [(robot, sensor) for robot in ROBOTS for sensor in sensors_of(ROBOTS[robot])]
FAULTS = ["stop", "freeze"]
PLACES = 20


def check(robot: str, sensor: str, fault: str, places: list[int], seed: int) -> None:
    ways = free_ways("hotel", max(places) + 1, seed)
    for place in places:
        outcome = drive_into(ROBOTS[robot], ways[place], fault, sensor, side_of(place), seed + place)
        assert outcome.contact <= CONTACT and outcome.stood_after <= STAND, (place, outcome)
        assert TITLES[sensor] in outcome.description and outcome.status == 0, (place, outcome)


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "sensor"), CASES)
@pytest.mark.parametrize("fault", FAULTS)
def test_robot_stops_before_the_box(robot: str, sensor: str, fault: str) -> None:
    check(robot, sensor, fault, [FAULTS.index(fault)], seed=3)


@pytest.mark.long
@pytest.mark.parametrize(("robot", "sensor"), CASES)
@pytest.mark.parametrize("fault", FAULTS)
def test_robot_stops_before_the_box_at_twenty_places(robot: str, sensor: str, fault: str) -> None:
    check(robot, sensor, fault, list(range(PLACES)), seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["late", "half_blind"])
def test_late_data_and_a_half_blind_lidar_stop_the_robot(fault: str) -> None:
    check("lidar", "scan", fault, [0], seed=3)


def at_full_speed(robot: str = "lidar", profile: str = "real") -> BlindDrive:
    drive = BlindDrive(ROBOTS[robot], free_ways("hotel", 1, 5)[0], profile=profile)
    drive.go_at_full_speed()
    return drive


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["real", "perfect"])
@pytest.mark.parametrize("fault", FAULTS)
def test_the_order_resumes_when_the_sensor_recovers(fault: str, profile: str) -> None:
    """Also where no noise tells a frozen sensor from one before which nothing moves."""
    drive = at_full_speed(profile=profile)
    drive.fault(fault, "scan")
    drive.run(12.0)
    assert drive.standing and not drive.status, "it waits, and that is not to be stuck"
    drive.fault("none", "scan")
    drive.run(10.0)
    assert drive.status == STATUS_SUCCEEDED and not drive.standing and not drive.contact


@pytest.mark.slow
def test_alternating_sensor_faults_are_each_named() -> None:
    drive = at_full_speed("chefbot_lidar")
    drive.fault("stop", "scan")
    drive.run(1.0)
    assert TITLES["scan"] in drive.standing
    drive.fault("freeze", "depth")
    drive.fault("none", "scan")
    drive.run(1.5)
    assert TITLES["depth"] in drive.standing
    drive.fault("none", "depth")
    drive.run(10.0)
    assert drive.status == STATUS_SUCCEEDED and not drive.standing


@pytest.mark.slow
def test_a_permanent_sensor_fault_aborts_the_order_and_is_named() -> None:
    drive = at_full_speed()
    drive.fault("stop", "scan")
    drive.run(WAIT_TIMEOUT + 2.0)
    (outcome,) = drive.topic("follow_path/_action/get_result")
    assert outcome.status == STATUS_ABORTED and TITLES["scan"] in outcome.result.error_msg
    assert math.isclose(drive.simulation.truth().v, 0.0, abs_tol=0.01)
