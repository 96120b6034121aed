"""What the flat scan and the depth camera together say of a place that somebody has left."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.buildings.world_file import Chair
from chefbot.costmap.conversions import costmap_message, mark_laser, mark_obstacles, plane_of
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.costs import FREE, LETHAL, UNKNOWN, Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.load import load_robot
from chefbot.scan.camera import CameraModel
from chefbot.scan.obstacle_scan import ObstacleScanner, ObstacleScanParams
from chefbot.sim.capture import OPTICAL, Capture
from chefbot.sim.depth_camera import DepthRenderer
from chefbot.sim.world.furniture import chair_shapes, person_shapes
from chefbot.sim.world.shapes import SimulatedShape, shape_arrays

HERE = SE2(0.0, 0.0, 0.0)
PLANE = 0.205
"""Metres above the floor at which the lidar of these tests looks."""
METRES = 1.51
"""To what the camera sees; it is blind to the floor around it, which it therefore cannot clear."""


def seen(bottom: float, top: float, metres: float = METRES) -> ObstacleScan:
    """One thing straight ahead, between these heights, and no floor."""
    one = [np.array([value], np.float32) for value in (metres, np.inf, 0.0, bottom, top)]
    return ObstacleScan(
        angle_min=0.0, angle_increment=0.01, range_max=8.0, **dict(zip(FIELDS, one, strict=True))
    )


FIELDS = ("ranges", "clear_from", "clear_to", "bottom", "top")


def scan(metres: float) -> LaserScan:
    """One beam straight ahead."""
    return LaserScan(angle_increment=0.01, range_max=8.0, ranges=np.array([metres], np.float32))


def after(first: ObstacleScan, metres: float, plane: float = PLANE) -> int:
    """Cost where the camera saw `first`, once the flat scan has looked there `metres` far."""
    costs = LayeredCostmap(CostmapParams(inflation_radius=0.0, track_unknown=False), 0.16, rolling=True)
    mark_obstacles(costs, HERE, first, plane)
    assert costs.update().at(METRES, 0.01) == LETHAL
    mark_laser(costs, HERE, scan(metres))
    return costs.update().at(METRES, 0.01)


@pytest.mark.parametrize("metres", [2.5, math.inf])
def test_a_person_who_left_is_cleared_by_laser_beams(metres: float) -> None:
    assert after(seen(0.04, 0.6), metres) == FREE


@pytest.mark.parametrize("metres", [METRES, 1.0, math.nan])
def test_a_person_who_may_still_be_there_is_not_cleared(metres: float) -> None:
    assert after(seen(0.04, 0.6), metres) == LETHAL


@given(st.floats(0.03, 0.6), st.floats(0.0, 0.5), st.floats(0.5, 8.0))
def test_obstacles_outside_the_laser_plane_are_not_cleared(
    bottom: float, height: float, metres: float
) -> None:
    stands_in_it = bottom < PLANE < bottom + height
    assert stands_in_it or after(seen(bottom, bottom + height), metres) == LETHAL


@pytest.mark.parametrize(("bottom", "top"), [(0.04, PLANE + 0.02), (PLANE - 0.02, 0.6)])
def test_obstacles_missed_while_pitching_are_not_cleared(bottom: float, top: float) -> None:
    assert after(seen(bottom, top), math.inf) == LETHAL


def test_an_obstacle_of_unknown_height_is_not_cleared() -> None:
    nothing = np.empty(0, np.float32)
    assert after(msgspec.structs.replace(seen(0.04, 0.6), bottom=nothing, top=nothing), math.inf) == LETHAL


def test_without_a_level_plane_nothing_is_cleared() -> None:
    camera = load_robot("chefbot")
    eye = camera.sensors.depth_camera
    assert eye is not None
    assert plane_of(camera) == eye.mount.z
    tilted = msgspec.structs.replace(eye, mount=msgspec.structs.replace(eye.mount, pitch=0.2))
    sensors = msgspec.structs.replace(camera.sensors, depth_camera=tilted)
    plane = plane_of(msgspec.structs.replace(camera, sensors=sensors))
    assert after(seen(0.04, 0.6), math.inf, plane) == LETHAL


def test_a_table_top_stays_when_the_laser_passes_between_legs() -> None:
    costs = LayeredCostmap(CostmapParams(inflation_radius=0.0, track_unknown=False), 0.16, rolling=True)
    mark_obstacles(costs, HERE, seen(0.41, 0.45), PLANE)
    mark_obstacles(costs, HERE, seen(0.04, 0.45), PLANE)  # the leg, in the same cell
    mark_laser(costs, HERE, scan(3.0))
    assert costs.update().at(METRES, 0.01) == LETHAL


ROBOT = load_robot("chefbot_lidar")


class Eye:
    """The lidar robot's camera at its place, with a real one's faults, and a costmap of what it sees."""

    def __init__(self) -> None:
        camera = ROBOT.sensors.depth_camera
        assert camera is not None
        self.foot = SE2(camera.mount.x, 0.0, 0.0)
        self._height = camera.mount.z
        self._renderer = DepthRenderer(camera, "real", 2)
        top = overall_height(ROBOT) + 0.05
        self._scanner = ObstacleScanner(CameraModel.of(camera), camera.mount, top, ObstacleScanParams())
        self._frames = 0

    def look(self, costs: LayeredCostmap, things: list[SimulatedShape]) -> None:
        """One image of them, in the frame of the robot."""
        place = np.array([self.foot.x, 0.0, self._height])
        frame = self._renderer.frame(Capture(place, OPTICAL, shape_arrays(things)), self._frames)
        self._frames += 1
        now = self._scanner.scan(frame.depth)
        step = float(self._scanner.angle_increment)
        message = ObstacleScan(angle_min=self._scanner.angle_min, angle_increment=step, range_max=8.0)
        arrays = dict(
            zip(FIELDS, (now.obstacles, now.clear_from, now.clear_to, now.bottom, now.top), strict=True)
        )
        mark_obstacles(costs, self.foot, msgspec.structs.replace(message, **arrays), plane_of(ROBOT))


def left_of(things: list[list[SimulatedShape]]) -> list[int]:
    """Cells that stay lethal of each when it has gone and the lidar has looked all round."""
    eye = Eye()
    beams = np.full(3600, np.inf, np.float32)
    all_round = LaserScan(angle_min=-math.pi, angle_increment=math.pi / 1800, range_max=8.0, ranges=beams)
    counts = []
    for one in things:
        costs = LayeredCostmap(CostmapParams(inflation_radius=0.0), 0.16, rolling=True)
        eye.look(costs, one)
        mark_laser(costs, HERE, all_round)
        counts.append(int((costs.update().cells == LETHAL).sum()))
    return counts


def places(count: int, near: float, far: float) -> list[SE2]:
    """Poses before the robot, by one seed."""
    rng = np.random.default_rng(8)
    polar = zip(
        rng.uniform(near, far, count), rng.uniform(-0.5, 0.5, count), rng.uniform(-3, 3, count), strict=True
    )
    return [SE2(0.07 + d * math.cos(a), d * math.sin(a), yaw) for d, a, yaw in polar]


def test_people_who_came_close_are_cleared_completely() -> None:
    people = [[shape.transformed(pose) for shape in person_shapes(1)] for pose in places(200, 0.35, 0.7)]
    assert np.count_nonzero(left_of(people)) <= 2, "of 200; measured: none"


def test_chair_seats_are_kept() -> None:
    chair = chair_shapes(Chair(x=0.0, y=0.0), "chair")
    chairs = [[shape.transformed(pose) for shape in chair] for pose in places(40, 0.9, 1.5)]
    assert min(left_of(chairs)) >= 3


def test_unknown_cells_are_minus_one_in_the_message() -> None:
    """As nav_msgs/OccupancyGrid has it; known ones are percentages."""
    cells = np.array([[FREE, LETHAL - 1, LETHAL, UNKNOWN]], np.uint8)
    message = costmap_message(Header(), Costmap(cells, 0.05, 0.0, 0.0))
    assert message.data.tolist() == [0, 99, 100, -1]
