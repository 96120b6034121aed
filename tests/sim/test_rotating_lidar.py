"""Tests the rays of a lidar that rotates while the robot moves, and the revolution that is swept in parts."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.sim.lidar import CARRIED_DISTANCE, MAX_STEP, RotatingLidar, SweptScan
from chefbot.sim.rays import lidar_angles
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import load_world

ROBOT, ROOM = load_robot("chefbot_lidar"), load_world("room")
SECOND = 1_000_000_000
AHEAD = np.zeros(1)


@pytest.fixture(scope="module")
def sim() -> Simulation:
    return Simulation(ROBOT, ROOM)


def at(sim: Simulation, pose: SE2) -> RotatingLidar:
    """Return the lidar of a robot that has stood at a pose for long."""
    sim.kidnap(pose)
    return RotatingLidar(sim, 0)


def ranges_at(sim: Simulation, pose: SE2, bearings: np.ndarray) -> np.ndarray:
    return at(sim, pose).measure(bearings, np.zeros(len(bearings), np.int64))


def times(*seconds: float) -> np.ndarray:
    return np.round(np.array(seconds) * SECOND).astype(np.int64)


def test_on_the_way_to_a_wall_ranges_shrink_evenly(sim: Simulation) -> None:
    rotating = at(sim, SE2(0.5, 0.0, 0.0))
    sim.kidnap(SE2(1.1, 0.0, 0.0))
    rotating.follow(SECOND)
    share = np.linspace(0.0, 1.0, 41)
    ranges = rotating.measure(np.zeros(41), times(*share))
    far, near = (float(ranges_at(sim, SE2(x, 0.0, 0.0), AHEAD)[0]) for x in (0.5, 1.1))
    assert far - near == pytest.approx(0.6, abs=1e-4)
    assert ranges == pytest.approx(far - 0.6 * share, abs=MAX_STEP)


def test_in_a_revolution_each_ray_has_the_heading_of_its_time(sim: Simulation) -> None:
    rotating = at(sim, SE2(0.5, 0.3, 0.1))
    sim.kidnap(SE2(0.5, 0.3, 0.3))
    rotating.follow(SECOND)
    share, bearings = np.linspace(0.0, 1.0, 9), np.linspace(-0.6, 0.6, 9)
    ranges = rotating.measure(bearings, times(*share))
    for k in range(9):
        expected = ranges_at(sim, SE2(0.5, 0.3, 0.1 + 0.2 * share[k]), bearings[k : k + 1])
        assert ranges[k] == pytest.approx(expected[0], rel=0.02)


def test_the_poses_around_a_time_count(sim: Simulation) -> None:
    places, far = [0.5, 0.6, 0.8, 1.1, 1.5, 2.0], float(ranges_at(sim, SE2(0.5, 0.0, 0.0), AHEAD)[0])
    rotating = at(sim, SE2(places[0], 0.0, 0.0))
    for k, x in enumerate(places[1:], 1):
        sim.kidnap(SE2(x, 0.0, 0.0))
        rotating.follow(k * SECOND)
    for time in (2.0, 2.5, 3.3, 4.9, 5.0):
        range_ = float(rotating.measure(AHEAD, times(time))[0])
        assert range_ == pytest.approx(far - np.interp(time, range(6), places) + 0.5, abs=1e-3)


def test_no_ray_lies_between_two_places_of_a_carried_robot(sim: Simulation) -> None:
    near, far = SE2(2.0, 0.0, 0.0), SE2(2.0 - 1.1 * CARRIED_DISTANCE, 0.0, 0.0)
    rotating = at(sim, far)
    sim.kidnap(near)
    rotating.follow(SECOND)
    expected = float(ranges_at(sim, near, AHEAD)[0])
    assert rotating.measure(np.zeros(3), times(0.0, 0.5, 1.0)) == pytest.approx([expected] * 3)


def test_the_own_body_is_that_of_the_nearest_beam(sim: Simulation) -> None:
    rotating = at(sim, SE2(0.5, 0.0, 0.0))
    lidar, own = rotating.lidar, rotating.caster.own_body
    assert np.isfinite(own).any() and np.isinf(own).any()
    angles, step = lidar_angles(lidar), lidar.angle_increment
    for shift in (0.0, 0.4 * step, -0.4 * step, 2.0 * math.pi):
        assert np.array_equal(rotating.rays_at(angles + shift)[1], own)
    ranges = rotating.measure(angles, np.zeros(len(angles), np.int64))
    assert (ranges <= own).all() and (ranges[np.isfinite(own)] < 1.0).all()


def test_beside_the_field_of_view_no_own_body_is_known() -> None:
    lidar = msgspec.structs.replace(ROBOT.sensors.lidar, field_of_view=math.radians(180.0))
    robot = msgspec.structs.replace(ROBOT, sensors=msgspec.structs.replace(ROBOT.sensors, lidar=lidar))
    rotating = RotatingLidar(Simulation(robot, ROOM), 0)
    assert not rotating.lidar.full_turn
    assert np.isinf(rotating.rays_at(np.array([math.pi, -2.5, 2.5]))[1]).all()


def test_rays_are_unit_vectors_in_the_plane_of_the_lidar(sim: Simulation) -> None:
    rays, _ = at(sim, SE2(0.5, 0.0, 0.0)).rays_at(np.array([0.0, math.pi / 2, -math.pi / 2]))
    yaw = ROBOT.sensors.lidar.mount.yaw
    c, s = math.cos(yaw), math.sin(yaw)
    assert rays == pytest.approx(np.array([[c, s, 0.0], [-s, c, 0.0], [s, -c, 0.0]]), abs=1e-9)


def test_no_bearings_give_no_ranges(sim: Simulation) -> None:
    empty = np.zeros(0)
    assert at(sim, SE2(0.5, 0.0, 0.0)).measure(empty, empty.astype(np.int64)).shape == (0,)


def test_a_real_lidar_is_noisy_by_its_data_sheet() -> None:
    rotating = RotatingLidar(Simulation(ROBOT, ROOM, "real", seed=1), 0)
    ranges = rotating.measure(np.zeros(400), np.zeros(400, np.int64))
    assert ranges.std() == pytest.approx(ROBOT.sensors.lidar.noise, rel=0.15)


@pytest.mark.parametrize("parts", [1, 3, 10])
def test_the_parts_of_a_revolution_measure_each_beam_once(sim: Simulation, parts: int) -> None:
    rotating = at(sim, SE2(0.5, 0.0, 0.0))
    sweep, expected = SweptScan(rotating, parts), sim.lidar()
    for revolution in range(2):
        for part in range(parts):
            now = (revolution * parts + part + 1) * SECOND // (10 * parts)
            rotating.follow(now)
            found = sweep.add(now - SECOND // (10 * parts), now)
            assert (found is None) == (part < parts - 1)
    assert found is not None and found.dtype == np.float32
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_a_revolution_begins_behind_and_goes_clockwise(sim: Simulation) -> None:
    rotating = at(sim, SE2(0.5, 0.0, 0.0))
    sweep, angles = SweptScan(rotating, 4), lidar_angles(rotating.lidar)
    quarters = [angles[beams] for beams in sweep._beams]
    assert all((np.diff(quarter) < 0.0).all() for quarter in quarters), "clockwise"
    for k, quarter in enumerate(quarters):
        assert quarter.max() <= math.pi * (1.0 - 0.5 * k) + 1e-6
        assert quarter.min() >= math.pi * (0.5 - 0.5 * k) - 1e-6
    assert sweep.first_share == pytest.approx((math.pi - angles[0]) / (2.0 * math.pi))


def test_first_beams_of_a_moving_robot_are_from_its_pose_then(sim: Simulation) -> None:
    start, end = SE2(0.5, 0.0, 0.0), SE2(0.6, 0.0, 0.0)
    still = [to_finite(ranges_at(sim, pose, lidar_angles(ROBOT.sensors.lidar))) for pose in (start, end)]
    rotating = at(sim, start)
    sweep = SweptScan(rotating, 1)
    sim.kidnap(end)
    rotating.follow(SECOND // 10)
    swept = sweep.add(0, SECOND // 10)
    assert swept is not None
    beams = len(swept)
    last, first = slice(1, beams // 20), slice(-beams // 20, None)
    assert np.median(np.abs(swept[last] - still[1][last])) < 0.012
    assert np.median(np.abs(swept[first] - still[0][first])) < 0.012


def to_finite(ranges: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(ranges), ranges, 99.0)
