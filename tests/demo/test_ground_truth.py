"""The true map that a demo is compared with lies in the frame that begins at the robot's start."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.demo.summary import ground_truth_map
from chefbot.maths.grid import OCCUPIED
from chefbot.robot.load import load_robot
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.load import load_any_world

ROBOT = load_robot("chefbot_lidar")


@pytest.mark.parametrize("yaw", [0.0, 0.5, math.pi / 2])
def test_the_true_map_turns_with_the_start(yaw: float) -> None:
    world = load_any_world("room", ROBOT, f"[0.5, 0.2, {yaw}]")
    plan, truth = floor_plan(world, ROBOT.sensors.lidar.mount.z), ground_truth_map(world, ROBOT)
    rows, columns = np.nonzero(plan.cells == OCCUPIED)
    walls = np.array([plan.centre(row, column) for row, column in zip(rows, columns, strict=True)])
    x, y = world.start.inverse().apply(walls).T
    near = [truth.values(x + dx, y + dy, 0) for dx in (-0.02, 0.0, 0.02) for dy in (-0.02, 0.0, 0.02)]
    assert (np.max(near, axis=0) == OCCUPIED).mean() > 0.99
