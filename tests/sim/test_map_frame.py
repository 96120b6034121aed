"""The frame `map` of a floor plan and of the simulator's ground truth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.launcher.session import session, start
from chefbot.maths.grid import FREE, OCCUPIED
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.nav_msgs import Odometry
from chefbot.proving.simulated_run import with_simulator_params
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Publication
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.world import load_world

ROBOT = load_robot("chefbot_lidar")
HEIGHT = ROBOT.sensors.lidar.mount.z
FRAMES = [SE2(0.5, -0.3, 0.0), SE2(0.0, 0.0, math.pi / 2), SE2(-1.0, 0.7, 2.2)]


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("value", [OCCUPIED, FREE])
def test_a_floor_plan_lies_in_the_frame_given(frame: SE2, value: int) -> None:
    world = load_world("room")
    plain, framed = floor_plan(world, HEIGHT), floor_plan(world, HEIGHT, frame=frame)
    rows, columns = np.nonzero(plain.cells == value)
    cells = np.array([plain.centre(row, column) for row, column in zip(rows, columns, strict=True)])
    x, y = frame.inverse().apply(cells).T
    offsets = (-0.04, 0.0, 0.04)  # cells of two grids do not coincide
    near = [framed.values(x + dx, y + dy, 0) == value for dx in offsets for dy in offsets]
    assert np.any(near, axis=0).mean() > 0.99


def test_the_frame_of_the_world_is_the_default() -> None:
    world = load_world("room")
    plain, framed = floor_plan(world, HEIGHT), floor_plan(world, HEIGHT, frame=IDENTITY)
    assert (plain.cells == framed.cells).all()
    assert (plain.origin_x, plain.origin_y) == (framed.origin_x, framed.origin_y)


def first_truth(map_frame: str) -> SE2:
    """Return the first ground truth of a robot that starts at (1, 0.5, 0.7) in the empty world."""
    arguments = {
        "world": "empty",
        "start": "[1.0, 0.5, 0.7]",
        "people": "0",
        "wire": "off",
        "headless": "true",
    }
    accepted = load_launch("gmapping_demo").args
    launch = load_launch("gmapping_demo", {k: v for k, v in arguments.items() if k in accepted})
    poses: list[SE2] = []

    def note(publication: Publication) -> None:
        if publication.topic == "ground_truth" and isinstance(publication.message, Odometry):
            poses.append(publication.message.pose.pose.se2)

    with session(ROBOT, 1, "simulation", 0.0, None) as system:
        system.loop.add_observer(note)
        start(system, with_simulator_params(launch, {"map_frame": map_frame}))
        system.loop.run(until_ns=1_000_000_000, until=lambda: bool(poses))
    return poses[0]


@pytest.mark.parametrize(
    ("map_frame", "expected"), [("world", SE2(1.0, 0.5, 0.7)), ("auto", SE2(0.0, 0.0, 0.0))]
)
def test_ground_truth_begins_at_the_start_or_in_the_world(map_frame: str, expected: SE2) -> None:
    assert tuple(first_truth(map_frame)) == pytest.approx(tuple(expected), abs=0.01)
