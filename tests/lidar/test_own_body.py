"""What a lidar sees of its own robot is not a range, and everything else stays one."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.lidar.own_body import MARGIN, OwnBody
from chefbot.maths.footprint import Footprint, disc
from chefbot.robot.load import load_robot
from chefbot.robot.sensors import Lidar
from chefbot.sim.lidar_scans import SimulatedScans
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import load_world

ROBOT = load_robot("chefbot_lidar")
assert ROBOT.sensors.lidar is not None
LIDAR = ROBOT.sensors.lidar
RECTANGLE = Footprint(0.2, 0.36, ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)))


def mounted(x: float, y: float, yaw: float) -> Lidar:
    mount = msgspec.structs.replace(LIDAR.mount, x=x, y=y, yaw=yaw)
    return msgspec.structs.replace(LIDAR, mount=mount, beams=90)


def is_inside(x: np.ndarray, y: np.ndarray, footprint: Footprint, padding: float) -> np.ndarray:
    if not footprint.corners:
        return np.asarray(np.hypot(x, y) <= footprint.circumscribed_radius + padding)
    return np.asarray((np.abs(x) <= 0.3 + padding) & (np.abs(y) <= 0.2 + padding))


@pytest.mark.parametrize("footprint", [disc(0.25), RECTANGLE])
@given(x=st.floats(-0.5, 0.5), y=st.floats(-0.5, 0.5), yaw=st.floats(-3.2, 3.2), far=st.floats(0.0, 1.2))
def test_ranges_that_end_within_the_footprint_are_unknown(
    footprint: Footprint, x: float, y: float, yaw: float, far: float
) -> None:
    """Also for a lidar that stands out from the robot, which sees it from outside."""
    lidar = mounted(x, y, yaw)
    bearings = lidar.angle_min + lidar.angle_increment * np.arange(lidar.beams) + yaw
    ends = x + far * np.cos(bearings), y + far * np.sin(bearings)
    kept = ~np.isnan(OwnBody(lidar, footprint).without(np.full(lidar.beams, far), 0.0))
    assert not kept[is_inside(*ends, footprint, MARGIN - 1e-6)].any()
    assert kept[~is_inside(*ends, footprint, MARGIN + 1e-6)].all()


def test_what_is_not_a_range_stays_as_it_is() -> None:
    body = OwnBody(LIDAR, ROBOT.footprint)
    ranges = np.full(LIDAR.beams, 0.1, np.float32)
    ranges[:4] = math.nan, math.inf, 2.0, 0.05
    result = body.without(ranges, 0.08)
    assert result.dtype == np.float32 and np.isnan(result[0]) and result[1] == math.inf
    assert (result[2], result[3]) == (np.float32(2.0), np.float32(0.05))
    assert np.isnan(result[4:]).all()
    assert body.without(ranges, 0.2) is ranges, "its own shortest range is above"


@pytest.mark.parametrize("mode", ["snapshot", "sweep", "ld19"])
def test_poles_before_a_lidar_are_not_obstacles(mode: str) -> None:
    near = msgspec.structs.replace(LIDAR, range_min=0.02)
    sensors = msgspec.structs.replace(ROBOT.sensors, lidar=near)
    robot = msgspec.structs.replace(ROBOT, sensors=sensors)
    simulation = Simulation(robot, load_world("room"))
    scans = SimulatedScans(simulation, mode, 0, 50)
    found = [scan for step in range(1, 40) for scan in scans.advance(step * 20_000_000)]
    assert found, "a scan within 0.8 s"
    ranges = found[-1].ranges
    assert not (ranges < robot.circumscribed_radius).any()
    assert 10 < np.isnan(ranges).sum() < 60, "the poles hide a part of the room"
