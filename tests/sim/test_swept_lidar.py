"""Tests the lidar that turns while the robot moves: what it sees from one place, and a robot that is carried."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.sim.lidar_scans import SNAPSHOT, SWEEP, SimulatedScans
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import load_world

HZ, TICK_NS = 50, 20_000_000


def turn(scans: SimulatedScans, begin: int) -> NDArray[np.float32]:
    """Return the ranges of the next scan from a tick on."""
    for tick in range(begin + 1, begin + HZ):
        if found := scans.advance(tick * TICK_NS):
            return found[-1].ranges
    raise AssertionError("no scan within a second")


@pytest.mark.parametrize("robot", ["chefbot_lidar", "jackal"])
def test_a_standing_robot_sweeps_what_a_snapshot_shows(robot: str) -> None:
    sim = Simulation(load_robot(robot), load_world("room"))
    swept, still = (turn(SimulatedScans(sim, mode, 0, HZ), 0) for mode in (SWEEP, SNAPSHOT))
    assert np.isfinite(still).any()
    np.testing.assert_allclose(swept, still, atol=1e-5)


@pytest.mark.parametrize("away", [50.0, 1e6])
def test_no_ray_is_cast_between_two_places_of_a_carried_robot(away: float) -> None:
    sim = Simulation(load_robot("chefbot_lidar"), load_world("room"))
    scans = SimulatedScans(sim, SWEEP, 0, HZ)
    before = turn(scans, 0)
    (x, y, _), rotation = sim.base_pose()
    home = SE2(x, y, math.atan2(rotation[1, 0], rotation[0, 0]))
    sim.kidnap(SE2(home.x + away, home.y - away, 1.0))
    turn(scans, HZ)
    sim.kidnap(home)
    turn(scans, 2 * HZ)
    np.testing.assert_allclose(turn(scans, 3 * HZ), before, atol=1e-5)
