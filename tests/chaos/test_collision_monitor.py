"""Nobody looks, and nothing is hit: teleoperation, dropped boxes and sensors that stop. Seeds are odd, to judge."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.robot.motion_limits import Limits, contact_speed
from tests.chaos.monitored_drive import (
    ALL_ROBOTS,
    CREEP,
    FAULTS,
    PLACES,
    MonitoredDrive,
    can_know,
    dropped_box,
    main_sensor,
    random_teleop,
    request_of,
)
from tests.chaos.sensor_fault_drive import straight_free_starts

ROBOTS = list(ALL_ROBOTS)
CASES = [
    (robot, fault)
    for robot in ROBOTS
    for fault in FAULTS
    if fault == "none" or request_of(fault, ALL_ROBOTS[robot])
]


@pytest.mark.rotated("drives towards obstacles")
@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_random_teleoperation_hits_nothing(robot: str) -> None:
    outcome = random_teleop(ALL_ROBOTS[robot], "workshop", seed=1, segments=9)
    assert outcome.contact == 0.0 and outcome.metres > 0.2, outcome


@pytest.mark.long
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("world", ["hotel", "workshop", "room"])
def test_random_teleoperation_hits_nothing_in_many_drives(robot: str, world: str) -> None:
    for seed in range(1, 85, 2):
        assert random_teleop(ALL_ROBOTS[robot], world, seed).contact == 0.0, seed


@pytest.mark.rotated("drives towards obstacles")
@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_box_ahead_is_not_touched_and_is_named(robot: str) -> None:
    at = straight_free_starts("hotel", 1, 1)[0]
    outcome = dropped_box(ALL_ROBOTS[robot], at, "none", "ahead", 1)
    assert outcome.contact == 0.0
    assert any("sees an obstacle" in reason and "ahead" in reason for reason in outcome.reasons)


@pytest.mark.long
@pytest.mark.parametrize(("robot", "fault"), CASES)
@pytest.mark.parametrize("place", PLACES)
def test_no_box_is_hit_whatever_sensor_fails(robot: str, fault: str, place: str) -> None:
    for seed in (1, 3, 5):
        at = straight_free_starts("hotel", 1, seed)[0]
        outcome = dropped_box(ALL_ROBOTS[robot], at, fault, place, seed)
        if can_know(ALL_ROBOTS[robot], fault, place):
            assert outcome.contact <= CREEP, seed
        else:
            assert outcome.contact <= 1.05 * contact_speed(ALL_ROBOTS[robot]), seed


@pytest.mark.rotated("drives towards obstacles")
@pytest.mark.slow
@pytest.mark.parametrize("robot", ["chefbot", "lidar"])
def test_teleoperation_stops_and_creeps_after_letting_go(robot: str) -> None:
    drive = MonitoredDrive(ALL_ROBOTS[robot], straight_free_starts("hotel", 1, 1)[0])
    speed = Limits.of(drive.system.robot).speed
    drive.hold(speed, 0.0, 3.0)
    began, count = drive.loop.now_ns, len(drive.wheels)
    drive.request_fault(f"stop {main_sensor(drive.system.robot)}")
    drive.hold(speed, 0.0, 2.0)
    zero = next(time for time, turning in drive.wheels[count:] if turning == 0.0)
    assert (zero - began) / 1e6 <= 300.0
    assert all(turning == 0.0 for time, turning in drive.wheels if time >= zero), "the stick is still held"
    drive.run(0.5)
    drive.hold(speed, 0.0, 1.0)
    crept = np.array([turning for _, turning in drive.wheels[-10:]])
    assert 0.0 < crept.max() <= 2.1 * CREEP / drive.system.robot.wheel_radius
    drive.request_fault("none")
    drive.run(1.0)
    drive.hold(speed, 0.0, 2.0)
    assert drive.simulation.truth().v > 0.3 * speed and not drive.contact
    drive.system.stop()
