"""A simulated robot obeys the zones file beside its map: a ring of two corridors round a block."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from chefbot.launcher.session import session, start
from chefbot.maths.grid import Grid
from chefbot.maths.polygon import contains
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause, NavigationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.msgs.nav_msgs import OccupancyGrid, Odometry
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.storage.map_files import save_map
from chefbot.storage.zones import zones_path

pytestmark = pytest.mark.slow
ROBOT = load_robot("chefbot_lidar")
SECOND = 1_000_000_000
WEST, EAST = SE2(1.2, 3.2, 0.0), SE2(7.8, 3.2, math.pi)
"""Both ends of the ring; the southern corridor is the shorter path between them."""
SOUTH, NORTH = (
    [(4.0, -0.2), (5.0, -0.2), (5.0, 2.4), (4.0, 2.4)],
    [(3.5, 4.6), (5.5, 4.6), (5.5, 7.2), (3.5, 7.2)],
)
SLOW = 0.15


def ring() -> Grid:
    """Return a map of 9 m x 7 m with a block in the middle; both corridors are 2.2 m wide."""
    cells = np.zeros((140, 180), np.int8)
    cells[[0, 1, -2, -1], :] = 100
    cells[:, [0, 1, -2, -1]] = 100
    cells[44:96, 50:130] = 100
    return Grid(cells, 0.05, 0.0, 0.0)


def corners(points: list[tuple[float, float]]) -> str:
    return ", ".join(f"{{x: {x} m, y: {y} m}}" for x, y in points)


class Drives:
    """A robot on the map with a zones file; it records where it was, how fast, and why."""

    def __init__(self, system: NodeContainer) -> None:
        self.system = system
        self.track: list[tuple[float, float, float]] = []
        self.causes: list[Cause] = []
        self.limits: list[float] = []
        self.masks: dict[str, Grid] = {}
        self.idle = True
        system.loop.add_observer(self._observe)

    def _observe(self, one: Publication) -> None:
        if isinstance(one.message, Odometry) and one.topic == "ground_truth":
            pose, v = one.message.pose.pose.se2, one.message.twist.twist.linear.x
            self.track.append((pose.x, pose.y, v))
        elif isinstance(one.message, Cause) and one.topic == "causes":
            self.causes.append(one.message)
        elif isinstance(one.message, SpeedLimit):
            self.limits.append(one.message.speed_limit)
        elif isinstance(one.message, OccupancyGrid) and one.topic.endswith("_filter_mask"):
            self.masks[one.topic] = one.message.grid
        elif isinstance(one.message, NavigationStatus):
            self.idle = one.message.state == "idle"

    def run(self, seconds: float) -> None:
        self.system.loop.run(until_ns=self.system.loop.now_ns + round(seconds * SECOND))

    def drive_to(self, goal: SE2) -> np.ndarray:
        """Drive to a goal, and return the track (n, 3): x, y, forward speed."""
        begin = len(self.track)
        message = PoseStamped(Header.of(self.system.loop.now_ns, "map"), Pose.of(goal))
        self.system.loop.post(
            lambda: self.system.loop.publish("goal_pose", message, "page", from_device=True)
        )
        self.run(3.0)
        for _ in range(120):
            if self.idle:
                break
            self.run(1.0)
        return np.array(self.track[begin:])


def launched(folder: Path, zones: str) -> Iterator[Drives]:
    path = save_map(folder / "ring", ring())
    zones_path(path).write_text(f"version: 1\nzones:\n{zones}")
    arguments = {"world": str(path), "headless": "true", "robot": ROBOT.name, "seed": "5", "people": "0"}
    launch = load_launch("amcl_demo", {**arguments, "start": f"[{WEST.x}, {WEST.y}, {WEST.yaw}]"})
    with session(ROBOT, 5, launch.clock, 0.0, None) as system:
        drives = Drives(system)
        start(system, launch)
        drives.run(3.0)
        yield drives


@pytest.mark.rotated("drives of whole robots")
def test_keep_out_and_slow_zones_are_obeyed(tmp_path: Path) -> None:
    zones = (
        f"  buffet: {{kind: keep_out, corners: [{corners(SOUTH)}]}}\n"
        f"  ramp: {{kind: slow, speed: {SLOW} m/s, corners: [{corners(NORTH)}]}}\n"
    )
    for drives in launched(tmp_path, zones):
        track = drives.drive_to(EAST)
        assert np.hypot(*(track[-1, :2] - EAST[:2])) < 0.3
        # no part of the robot was in the keep-out, whose edges are straight
        assert not any(3.9 < x < 5.1 and y < 2.5 for x, y, _ in track)
        in_slow = np.array([contains(np.array(NORTH), x, y) for x, y, _ in track])
        assert in_slow.any() and track[in_slow, 2].max() < SLOW + 0.03
        assert track[~in_slow, 2].max() > 2.0 * SLOW
        assert min(limit for limit in drives.limits if limit) == SLOW
        sentences = " ".join(cause.sentence for cause in drives.causes)
        assert "because of the keep-out zone buffet" in sentences
        assert "Slow zone ramp limits the speed to 0.15 m/s." in sentences
        assert drives.masks["keepout_filter_mask"].at(4.5, 1.0) == 100
        assert drives.masks["speed_filter_mask"].at(4.5, 6.0) == 100


@pytest.mark.rotated("drives of whole robots")
def test_a_one_way_lane_is_taken_the_right_way(tmp_path: Path) -> None:
    zones = f"  lane: {{kind: one_way, direction: 180 deg, corners: [{corners(SOUTH)}]}}\n"
    for drives in launched(tmp_path, zones):
        out, back = drives.drive_to(EAST), drives.drive_to(WEST)
        assert np.hypot(*(out[-1, :2] - EAST[:2])) < 0.3 and np.hypot(*(back[-1, :2] - WEST[:2])) < 0.3
        assert out[:, 1].max() > 4.8, "eastward it goes round by the north"
        assert back[:, 1].max() < 4.8, "westward it takes the lane"
        sentences = " ".join(cause.sentence for cause in drives.causes)
        assert "because of the one-way lane lane" in sentences
