"""Tests when beams of the lidar clear obstacles that the depth camera has marked."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.buildings.world_file import Chair
from chefbot.costmap.conversions import ObstacleMarking, costmap_message, mark_laser, mark_obstacles
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.maths.costs import FREE, LETHAL, UNKNOWN, Costmap
from chefbot.maths.footprint import disc
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.load import load_robot
from chefbot.robot.scan_plane import plane_of
from chefbot.scan.camera import CameraModel
from chefbot.scan.drop_offs import FloorLimits
from chefbot.scan.obstacle_scan import ObstacleScanner, ObstacleScanParams
from chefbot.sim.cameras.capture import OPTICAL, Capture
from chefbot.sim.cameras.depth_camera import DepthRenderer
from chefbot.sim.world.furniture import chair_shapes, person_shapes
from chefbot.sim.world.shapes import SimulatedShape, shape_arrays

ORIGIN = SE2(0.0, 0.0, 0.0)
PLANE = 0.205
"""Height of the lidar's plane above the floor, metres."""
DISTANCE = 1.51
"""Distance of the obstacle, metres; the camera measures no floor around it, so that only the lidar can clear it."""


def obstacle(bottom: float, top: float, metres: float = DISTANCE) -> ObstacleScan:
    """Return an obstacle scan with one obstacle straight ahead between two heights in metres, without floor."""
    arrays = [np.array([value], np.float32) for value in (metres, np.inf, 0.0, bottom, top)]
    return ObstacleScan(
        angle_min=0.0, angle_increment=0.01, range_max=8.0, **dict(zip(FIELDS, arrays, strict=True))
    )


FIELDS = ("ranges", "clear_from", "clear_to", "bottom", "top")


def scan(metres: float) -> LaserScan:
    """Return a laser scan with one beam straight ahead."""
    return LaserScan(angle_increment=0.01, range_max=8.0, ranges=np.array([metres], np.float32))


def cost_after(first: ObstacleScan, metres: float, plane: float = PLANE) -> int:
    """Return the cost at the obstacle of `first` after a laser beam of `metres` in its direction."""
    costs = LayeredCostmap(CostmapParams(inflation_radius=0.0, track_unknown=False), disc(0.16), rolling=True)
    mark_obstacles(costs, ORIGIN, first, ObstacleMarking(plane, 1.4, 0.2))
    assert costs.update().at(DISTANCE, 0.01) == LETHAL
    mark_laser(costs, ORIGIN, scan(metres))
    return costs.update().at(DISTANCE, 0.01)


@pytest.mark.parametrize("metres", [2.5, math.inf])
def test_a_person_who_left_is_cleared_by_laser_beams(metres: float) -> None:
    assert cost_after(obstacle(0.04, 0.6), metres) == FREE


@pytest.mark.parametrize("metres", [DISTANCE, 1.0, math.nan])
def test_a_person_who_may_still_be_there_is_not_cleared(metres: float) -> None:
    assert cost_after(obstacle(0.04, 0.6), metres) == LETHAL


@given(st.floats(0.03, 0.6), st.floats(0.0, 0.5), st.floats(0.5, 8.0))
def test_obstacles_outside_the_laser_plane_are_not_cleared(
    bottom: float, height: float, metres: float
) -> None:
    in_laser_plane = bottom < PLANE < bottom + height
    assert in_laser_plane or cost_after(obstacle(bottom, bottom + height), metres) == LETHAL


@pytest.mark.parametrize(("bottom", "top"), [(0.04, PLANE + 0.02), (PLANE - 0.02, 0.6)])
def test_obstacles_missed_while_pitching_are_not_cleared(bottom: float, top: float) -> None:
    assert cost_after(obstacle(bottom, top), math.inf) == LETHAL


def test_an_obstacle_of_unknown_height_is_not_cleared() -> None:
    nothing = np.empty(0, np.float32)
    assert (
        cost_after(msgspec.structs.replace(obstacle(0.04, 0.6), bottom=nothing, top=nothing), math.inf)
        == LETHAL
    )


def test_without_a_level_plane_nothing_is_cleared() -> None:
    camera = load_robot("chefbot")
    depth_camera = camera.sensors.depth_camera
    assert depth_camera is not None
    assert plane_of(camera) == depth_camera.mount.z
    tilted = msgspec.structs.replace(
        depth_camera, mount=msgspec.structs.replace(depth_camera.mount, pitch=0.2)
    )
    sensors = msgspec.structs.replace(camera.sensors, depth_camera=tilted)
    plane = plane_of(msgspec.structs.replace(camera, sensors=sensors))
    assert cost_after(obstacle(0.04, 0.6), math.inf, plane) == LETHAL


def test_a_table_top_stays_when_the_laser_passes_between_legs() -> None:
    costs = LayeredCostmap(CostmapParams(inflation_radius=0.0, track_unknown=False), disc(0.16), rolling=True)
    mark_obstacles(costs, ORIGIN, obstacle(0.41, 0.45), ObstacleMarking(PLANE, 1.4, 0.2))
    mark_obstacles(
        costs, ORIGIN, obstacle(0.04, 0.45), ObstacleMarking(PLANE, 1.4, 0.2)
    )  # the leg, in the same cell
    mark_laser(costs, ORIGIN, scan(3.0))
    assert costs.update().at(DISTANCE, 0.01) == LETHAL


ROBOT = load_robot("chefbot_lidar")


class SimulatedCamera:
    """The depth camera of the robot with lidar, with the noise and faults of the real profile."""

    def __init__(self) -> None:
        camera = ROBOT.sensors.depth_camera
        assert camera is not None
        self.pose = SE2(camera.mount.x, 0.0, 0.0)
        self._height = camera.mount.z
        self._renderer = DepthRenderer(camera, "real", 2)
        top = overall_height(ROBOT) + 0.05
        floor = FloorLimits.of(ROBOT, camera, ObstacleScanParams().pitch_tolerance)
        self._scanner = ObstacleScanner(
            CameraModel.of(camera), camera.mount, top, floor, ObstacleScanParams()
        )
        self._frames = 0

    def mark(self, costs: LayeredCostmap, shapes: list[SimulatedShape]) -> None:
        """Mark the obstacles in one image of the shapes, which are in base_link."""
        position = np.array([self.pose.x, 0.0, self._height])
        frame = self._renderer.frame(Capture(position, OPTICAL, shape_arrays(shapes)), self._frames)
        self._frames += 1
        now = self._scanner.scan(frame.depth)
        step = float(self._scanner.angle_increment)
        message = ObstacleScan(angle_min=self._scanner.angle_min, angle_increment=step, range_max=8.0)
        arrays = dict(
            zip(FIELDS, (now.obstacles, now.clear_from, now.clear_to, now.bottom, now.top), strict=True)
        )
        mark_obstacles(
            costs, self.pose, msgspec.structs.replace(message, **arrays), ObstacleMarking.of(ROBOT, 1.4)
        )


def lethal_cells_left(groups: list[list[SimulatedShape]]) -> list[int]:
    """Return for each group of shapes how many cells stay lethal after a laser scan without it."""
    camera = SimulatedCamera()
    beams = np.full(3600, np.inf, np.float32)
    empty_scan = LaserScan(angle_min=-math.pi, angle_increment=math.pi / 1800, range_max=8.0, ranges=beams)
    counts = []
    for shapes in groups:
        costs = LayeredCostmap(CostmapParams(inflation_radius=0.0), disc(0.16), rolling=True)
        camera.mark(costs, shapes)
        mark_laser(costs, ORIGIN, empty_scan)
        counts.append(int((costs.update().cells == LETHAL).sum()))
    return counts


def random_poses(count: int, near: float, far: float) -> list[SE2]:
    """Return poses in front of the robot at distances from `near` to `far` metres."""
    rng = np.random.default_rng(8)
    polar = zip(
        rng.uniform(near, far, count), rng.uniform(-0.5, 0.5, count), rng.uniform(-3, 3, count), strict=True
    )
    return [SE2(0.07 + d * math.cos(a), d * math.sin(a), yaw) for d, a, yaw in polar]


@pytest.mark.slow
def test_people_who_came_close_are_cleared_completely() -> None:
    people = [
        [shape.transformed(pose) for shape in person_shapes(1)] for pose in random_poses(200, 0.35, 0.7)
    ]
    assert np.count_nonzero(lethal_cells_left(people)) <= 2, "of 200; measured: none"


def test_chair_seats_are_kept() -> None:
    chair = chair_shapes(Chair(x=0.0, y=0.0), "chair")
    chairs = [[shape.transformed(pose) for shape in chair] for pose in random_poses(40, 0.9, 1.5)]
    assert min(lethal_cells_left(chairs)) >= 3


def test_unknown_cells_are_minus_one_in_the_message() -> None:
    """nav_msgs/OccupancyGrid defines this value; known cells have the percentages of Nav2's translation table."""
    cells = np.array([[FREE, 1, 2, 127, LETHAL - 2, LETHAL - 1, LETHAL, UNKNOWN]], np.uint8)
    message = costmap_message(Header(), Costmap(cells, 0.05, 0.0, 0.0))
    assert message.data.tolist() == [0, 1, 1, 49, 98, 99, 100, -1]
