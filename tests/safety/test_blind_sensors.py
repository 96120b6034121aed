"""A sensor without data is blind, except where an obstacle is known that is nearer than it measures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.support.obstacle_sensors import (
    BINS,
    CELL,
    COSTS,
    FIRST,
    NOTHING,
    PERIOD_NS,
    ROBOT,
    STANDING,
    STEP,
    arc,
    blind_camera,
    costs_of,
    half_covered,
    lidar_at,
    looking,
    never,
    obstacles,
    points,
    run,
    scan,
)

from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.std_msgs import Header
from chefbot.safety.known_obstacles import MarkedCells, RememberedPoints
from chefbot.safety.obstacle_sensors import (
    BLIND,
    BLIND_LIDAR,
    HIDDEN,
    ObstacleSensors,
)


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.0, 0.0, 0.0), (0.1, -0.05, 2.0), (-0.1, 0.08, -3.0)])
def test_a_wall_nearer_than_the_lidar_measures_is_no_fault(x: float, y: float, yaw: float) -> None:
    """As long as it is known, be it as remembered points or as marked cells, where the lidar has no data."""
    sensors, sensor = ObstacleSensors(lidar_at(x, y, yaw)), SE2(x, y, yaw)
    now_ns = run(sensors, 8) + 1
    sensors.process_scan(half_covered(now_ns), now_ns, STANDING)
    assert sensors.fault(now_ns, STANDING, NOTHING) == BLIND_LIDAR
    assert sensors.fault(now_ns, STANDING, points(arc(sensor, 0.15))) == ""
    assert sensors.fault(now_ns, STANDING, points(arc(sensor, 0.15, -math.pi / 2, 0.0))) == BLIND_LIDAR
    assert sensors.fault(now_ns, STANDING, points(arc(sensor, 0.15, 0.0, 0.6))) == BLIND_LIDAR, "most is not"
    pose = SE2(0.4, -0.3, 2.0)
    wall = np.vstack([arc(pose @ sensor, distance) for distance in (0.1, 0.125, 0.15)])
    assert sensors.fault(now_ns, STANDING, MarkedCells(costs_of(wall), pose)) == ""
    assert sensors.fault(now_ns, STANDING, MarkedCells(costs_of(wall), STANDING)) == BLIND_LIDAR
    unplaced = MarkedCells(costs_of(wall), None)
    assert sensors.fault(now_ns, None, unplaced) == BLIND_LIDAR
    assert unplaced.explain(np.zeros(3), sensor, 1.0).tolist() == [False] * 3
    assert sensors.health(now_ns, STANDING, NOTHING).message == BLIND_LIDAR


@pytest.mark.parametrize(("gap", "explained"), [(-0.002, True), (0.002, False)])
def test_a_wall_that_the_lidar_would_measure_explains_nothing(gap: float, explained: bool) -> None:
    """Beyond its minimum range, four deviations of its noise and a margin of 5 cm."""
    robot = lidar_at(0.0, 0.0, 0.0)
    lidar = robot.sensors.lidar
    assert lidar is not None
    wall = arc(STANDING, lidar.range_min + 4.0 * lidar.noise + 0.05 + gap)
    sensors = ObstacleSensors(robot)
    now_ns = run(sensors, 8) + 1
    sensors.process_scan(half_covered(now_ns), now_ns, STANDING)
    assert (sensors.fault(now_ns, STANDING, points(wall)) == "") == explained


def test_a_lidar_that_sees_nothing_at_all_is_blind_beside_a_wall() -> None:
    """As a cover over all of it, or one of which all returns vanish at once."""
    sensors = ObstacleSensors(lidar_at(0.0, 0.0, 0.0))
    now_ns = run(sensors, 8) + 1
    for ranges in (-np.inf, np.inf):
        sensors.process_scan(scan(now_ns, ranges), now_ns, STANDING)
        assert sensors.fault(now_ns, STANDING, points(arc(STANDING, 0.15))) == BLIND_LIDAR


def test_a_lidar_that_sees_needs_no_known_obstacles() -> None:
    sensors = ObstacleSensors(lidar_at(0.0, 0.0, 0.0))
    assert sensors.fault(0, STANDING, RememberedPoints(never, CELL)) != ""
    assert sensors.fault(run(sensors, 8), STANDING, RememberedPoints(never, CELL)) == ""


# -- a blind camera


@pytest.mark.parametrize(
    ("x", "y", "yaw"), [(0.1, 0.0, 0.0), (-0.1, 0.0, math.pi), (0.0, 0.1, 2.0), (0.05, -0.1, -3.0)]
)
def test_a_known_wall_explains_a_blind_camera_wherever_it_looks(x: float, y: float, yaw: float) -> None:
    """A wall nearer than the camera measures, known from the memory; elsewhere it explains nothing."""
    sensors = blind_camera(looking(x, y, yaw))
    bearings = yaw + FIRST + STEP * np.arange(BINS)
    wall = np.column_stack([x + 0.5 * np.cos(bearings), y + 0.5 * np.sin(bearings)])
    assert sensors.blind_ahead(NOTHING) == BLIND
    assert sensors.blind_ahead(points(wall)) == ""
    assert sensors.blind_ahead(points(np.array([[2.0 * x, 2.0 * y]]) - wall)) == BLIND, (
        "the wall is behind it"
    )
    far = np.array([x, y]) + 2.0 * (wall - np.array([x, y]))
    assert sensors.blind_ahead(points(far)) == BLIND, "at a metre the camera would measure it"
    assert sensors.blind_ahead(points(wall[: BINS // 4])) == BLIND, "of one quarter only"


@pytest.mark.parametrize("distance", [0.25, 0.4, 0.55])
def test_a_point_in_each_cell_explains_a_wall(distance: float) -> None:
    """Wherever in its cell the point is; a point in every fourth cell leaves half of the wall unexplained."""
    sensors, rng = blind_camera(looking(0.0, 0.0, 0.0)), np.random.default_rng(3)
    cells = np.arange(-0.4, 0.4, CELL)
    for _ in range(20):
        wall = np.column_stack([np.full(len(cells), distance), cells + rng.uniform(0.0, CELL, len(cells))])
        assert sensors.blind_ahead(points(wall)) == ""
    assert sensors.blind_ahead(points(wall[::4])) == BLIND


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("count", "at", "explained"), [
    (4, 0.0, True), (4, 3.0, True), (4, -0.4, True),
    (5, 0.0, False), (5, 0.4, False), (5, 0.6, True), (7, 6.0, False),
])  # fmt: skip
def test_a_few_directions_are_explained_each(sign: float, count: int, at: float, explained: bool) -> None:
    """By one point in the direction `at`, counted from the first one, of a scan in either sense."""
    first, step = sign * 3.0, sign * 0.1  # it looks backwards, across the bearing where angles jump
    silent = np.full(count, np.inf, np.float32)
    sensors = ObstacleSensors(looking(0.0, 0.0, 0.0))
    sensors.process_obstacles(
        ObstacleScan(Header.of(0, "camera"), first, step, 8.0, silent, silent, np.zeros(count, np.float32)),
        0,
        STANDING,
    )
    bearing = first + at * step
    point = 0.4 * np.array([[math.cos(bearing), math.sin(bearing)]])
    assert (sensors.blind_ahead(points(point, 0.4 * math.tan(0.35))) == "") == explained


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_person_who_comes_in_from_the_side_stops_the_robot(sign: float) -> None:
    """Nearer than the camera measures, in a tenth of its view; a wall that is known there explains it."""
    sensors = ObstacleSensors(looking(0.0, 0.0, 0.0))
    for k, hidden in enumerate((0, 16)):
        seen = obstacles((k + 1) * PERIOD_NS)
        at = slice(0, hidden) if sign < 0.0 else slice(BINS - hidden, BINS)
        seen.ranges[at], seen.clear_to[at] = np.inf, 0.0
        sensors.process_obstacles(seen, (k + 1) * PERIOD_NS, STANDING)
    assert sensors.blind_ahead(NOTHING) == HIDDEN == sensors.blind_ahead(MarkedCells(COSTS, STANDING))
    bearings = sign * (FIRST + STEP * np.arange(16))
    wall = 0.4 * np.column_stack([np.cos(bearings), -np.sin(bearings)])
    assert sensors.blind_ahead(points(wall)) == ""
    assert sensors.blind_ahead(points(wall * (1.0, -1.0))) == HIDDEN, "it is on the other side"


@pytest.mark.parametrize(("gap", "explained"), [(-0.005, True), (0.005, False)])
def test_nearer_than_the_camera_measures_at_the_edge_of_its_view(gap: float, explained: bool) -> None:
    """A tenth of a metre beyond its minimum range along the optical axis, at half of the field of view."""
    camera = ROBOT.sensors.depth_camera
    assert camera is not None
    limit = (camera.range_min + 0.1) / math.cos(camera.field_of_view / 2)
    bearings = FIRST + STEP * np.arange(BINS)
    wall = (limit + gap) * np.column_stack([np.cos(bearings), np.sin(bearings)])
    assert (blind_camera(looking(0.0, 0.0, 0.0)).blind_ahead(points(wall)) == "") == explained


def test_a_camera_that_sees_needs_no_other_sensor() -> None:
    sensors = ObstacleSensors(ROBOT)
    assert sensors.blind_ahead(NOTHING) == "" == sensors.blind_ahead(MarkedCells(COSTS, None))
    run(sensors, 1)
    assert (
        sensors.blind_ahead(RememberedPoints(never, CELL))
        == ""
        == sensors.blind_ahead(MarkedCells(COSTS, None))
    )


@pytest.mark.parametrize("count", [0, 1])
def test_an_obstacle_scan_of_nothing_is_blind(count: int) -> None:
    """Without directions, or with a single one, as a broken driver may send them."""
    sensors, array = ObstacleSensors(looking(0.0, 0.0, 0.0)), np.full(count, np.inf, np.float32)
    none = ObstacleScan(Header.of(0, "camera"), 0.0, 0.0, 8.0, array, array, np.zeros(count, np.float32))
    sensors.process_obstacles(none, 0, STANDING)
    assert sensors.blind_ahead(points(np.array([[0.3, 0.0]]))) == (BLIND if count == 0 else "")
    assert sensors.blind_ahead(points(np.array([[0.3, 3.0], [-0.3, 0.0]]))) == BLIND
    assert sensors.blind_ahead(NOTHING) == BLIND


def room(robot_x: float, robot_y: float, yaw: float, distance: float) -> Costmap:
    """Return a costmap of 4 m in which an arc around a pose, half a radian to each side, is lethal."""
    return costs_of(arc(SE2(robot_x, robot_y, yaw), distance, -0.6, 0.6))


def test_a_marked_wall_explains_a_blind_camera() -> None:
    """The costmap is in odom: the wall has to be where the camera looks from where the robot is."""
    pose = SE2(0.4, -0.3, 2.0)
    for camera_yaw in (0.0, math.pi):
        sensors = blind_camera(looking(0.1, 0.0, camera_yaw))
        eye = pose @ SE2(0.1, 0.0, camera_yaw)
        for near in (0.4, 0.425, 0.45, 0.475):
            assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw, near), pose)) == "", (
                "a cell thick"
            )
        assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw, 1.2), pose)) == BLIND, (
            "it would be measured"
        )
        assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw + math.pi, 0.4), pose)) == BLIND, (
            "it is behind"
        )
        assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw, 0.4), None)) == BLIND, (
            "nobody knows where it is"
        )
        assert sensors.blind_ahead(MarkedCells(room(eye.x, eye.y, eye.yaw, 0.4), SE2(0.0, 1.0, 0.0))) == BLIND
