"""Tests graph SLAM as a whole on simulated drives, and on damaged input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chefbot.errors import ChefbotError, OdometryError, ScanError
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.graph_slam import GraphSlam
from chefbot.slam.graph.params import GraphSlamParams


def map_drive(world, truth, odom, angles, noise=0.01, offset=0.0, seed=1, params=None) -> GraphSlam:
    """Return the mapper after a drive; the laser adds `offset` m and noise to each range."""
    slam = GraphSlam(params or GraphSlamParams(submap_travel=5.0))
    rng = np.random.default_rng(seed)
    for pose, wheel in zip(truth, odom, strict=True):
        ranges = world.ranges(pose, angles, 20.0) + rng.normal(offset, noise, len(angles)).astype(np.float32)
        slam.update(angles, ranges, wheel)
    slam.finish()
    return slam


def worst_error(slam: GraphSlam, truth, used) -> float:
    start = truth[0].inverse()
    return max(
        math.hypot((start @ truth[k]).x - pose.x, (start @ truth[k]).y - pose.y)
        for k, pose in zip(used, slam.trajectory(), strict=True)
    )


@pytest.mark.rotated("recordings")
@pytest.mark.slow
def test_a_drive_round_a_ring_closes(ring, drive, odometry, angles) -> None:
    truth = drive(2)
    wheels = odometry(truth, 2, 0.05, 0.05, 0.02)
    slam = GraphSlam(GraphSlamParams(submap_travel=5.0))
    rng = np.random.default_rng(2)
    used = []
    for k, (pose, wheel) in enumerate(zip(truth, wheels, strict=True)):
        ranges = ring.ranges(pose, angles, 20.0) + rng.normal(0.0, 0.01, len(angles)).astype(np.float32)
        if slam.update(angles, ranges, wheel):
            used.append(k)
    end = truth[0].between(truth[-1])
    assert wheels[-1].distance(end) > 1.0, "odometry alone is far off"
    slam.finish()
    assert slam.closures()
    assert worst_error(slam, truth, used) < 0.05
    assert slam.pose.distance(end) < 0.05
    grid = slam.map()
    assert grid.at(0.0, 0.0) < 25
    wall = truth[0].inverse() @ SE2(6.0, 0.0, 0.0)
    assert max(grid.at(wall.x + dx, wall.y + dy) for dx in (-0.05, 0, 0.05) for dy in (-0.05, 0, 0.05)) > 65


@pytest.mark.slow
def test_the_same_scans_give_the_same_map(ring, drive, odometry, angles) -> None:
    truth = drive(1)
    wheels = odometry(truth, 3, 0.05, 0.05)
    first, second = (map_drive(ring, truth, wheels, angles) for _ in range(2))
    assert first.trajectory() == second.trajectory()
    assert (first.map().cells == second.map().cells).all()


@pytest.mark.slow
def test_an_offset_of_all_ranges_is_found(ring, drive, odometry, angles) -> None:
    truth = drive(2)
    wheels = odometry(truth, 4, 0.03, 0.03)
    assert map_drive(ring, truth, wheels, angles).range_offset == pytest.approx(0.0, abs=0.01)
    assert map_drive(ring, truth, wheels, angles, offset=0.06).range_offset == pytest.approx(-0.06, abs=0.015)


def test_odometry_that_jumps_is_stated_and_survived(ring, drive, odometry, angles) -> None:
    truth = drive(1)[:40]
    wheels = odometry(truth, 5, 0.01, 0.01)
    slam = GraphSlam(GraphSlamParams())
    for pose, wheel in zip(truth[:20], wheels[:20], strict=True):
        slam.update(angles, ring.ranges(pose, angles, 20.0), wheel)
    before, reset = slam.pose, SE2(5000.0, 0.0, 1.0)
    with pytest.raises(OdometryError, match="reset"):
        slam.update(angles, ring.ranges(truth[19], angles, 20.0), reset @ wheels[19])
    assert slam.pose.distance(before) < 1e-6
    for pose, wheel in zip(truth[20:], wheels[20:], strict=True):
        slam.update(angles, ring.ranges(pose, angles, 20.0), reset @ wheel)
    assert slam.pose.distance(truth[0].between(truth[-1])) < 0.1


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
@pytest.mark.slow
def test_damaged_scans_never_break_the_mapper(ring, drive, data) -> None:
    slam = GraphSlam(GraphSlamParams(submap_travel=1.0, linear_update=0.05))
    value = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0, 0.001, 2.5, 79.0, 1000.0, 1e30])
    for pose in drive(1)[:25:2]:
        beams = data.draw(st.integers(0, 40))
        angles = np.linspace(-2.0, 2.0, beams).astype(np.float32)
        ranges = ring.ranges(pose, angles, 20.0) if beams else np.zeros(0, np.float32)
        for k in data.draw(st.lists(st.integers(0, max(beams - 1, 0)), max_size=40)):
            if beams:
                ranges[k] = data.draw(value)
        try:
            slam.update(angles, ranges, pose)
        except ChefbotError as error:
            assert str(error)
    slam.finish()
    assert all(math.isfinite(v) for pose in slam.trajectory() for v in pose)
    assert slam.map().cells.size


def test_implausible_input_is_refused_in_a_sentence(angles) -> None:
    slam = GraphSlam(GraphSlamParams())
    with pytest.raises(OdometryError, match="implausible"):
        slam.update(angles, angles, SE2(math.nan, 0.0, 0.0))
    with pytest.raises(ScanError, match="one for each beam"):
        slam.update(angles, angles[:-1], SE2(0.0, 0.0, 0.0))


def test_before_the_first_scan_the_map_is_unknown() -> None:
    slam = GraphSlam(GraphSlamParams(), initial=SE2(1.0, 2.0, 0.3))
    assert slam.trajectory() == [] and slam.closures() == []
    assert slam.pose == pytest.approx(SE2(1.0, 2.0, 0.3))
    assert slam.map().cells.tolist() == [[-1]]
    slam.finish()


def are_used(slam: GraphSlam, world, angles, poses) -> list[bool]:
    """Return for scans at poses, with perfect odometry, which were used."""
    return [slam.update(angles, world.ranges(pose, angles, 20.0), pose) for pose in poses]


def test_a_scan_is_used_after_enough_motion(ring, angles) -> None:
    start, params = SE2(3.0, 1.3, 0.0), GraphSlamParams(linear_update=0.5, angular_update=0.3)
    ahead = [start @ SE2(x, 0.0, 0.0) for x in (0.0, 0.3, 0.49, 0.51, 0.9, 1.02)]
    assert are_used(GraphSlam(params), ring, angles, ahead) == [True, False, False, True, False, True]
    turns = [start @ SE2(0.0, 0.0, yaw) for yaw in (0.0, -0.29, -0.31, 0.0)]
    assert are_used(GraphSlam(params), ring, angles, turns) == [True, False, True, True]
    back_and_forth = [start @ SE2(x, 0.0, 0.0) for x in (0.0, 0.4, 0.0, 0.4)]
    assert are_used(GraphSlam(params), ring, angles, back_and_forth) == [True, False, False, False]


def test_other_parameters_count_from_the_next_scan_on(ring, angles) -> None:
    slam, start = GraphSlam(GraphSlamParams(linear_update=0.5)), SE2(3.0, 1.3, 0.0)
    assert are_used(slam, ring, angles, [start, start @ SE2(0.3, 0.0, 0.0)]) == [True, False]
    slam.retune(GraphSlamParams(linear_update=0.2))
    assert are_used(slam, ring, angles, [start @ SE2(0.31, 0.0, 0.0)]) == [True]


def test_between_scans_the_pose_follows_odometry(ring, angles, drive) -> None:
    slam, odom = (
        GraphSlam(GraphSlamParams(linear_update=2.0), initial=SE2(5.0, 6.0, 0.7)),
        SE2(-3.0, 2.0, 1.0),
    )
    first, *rest = drive(1)[:8]
    slam.update(angles, ring.ranges(first, angles, 20.0), odom)
    before = slam.map_T_odom
    for pose in rest:
        motion = first.between(pose)
        assert not slam.update(angles, ring.ranges(pose, angles, 20.0), odom @ motion)
        assert slam.map_T_odom == before
        assert slam.pose == pytest.approx(SE2(5.0, 6.0, 0.7) @ motion)
    assert slam.trajectory() == [pytest.approx(SE2(5.0, 6.0, 0.7))]


@pytest.mark.parametrize("far", [math.inf, 25.0, 30.0])
def test_without_any_return_the_path_is_that_of_odometry(angles, far: float) -> None:
    slam = GraphSlam(GraphSlamParams(submap_travel=1.0), initial=SE2(1.0, -2.0, 0.5))
    odom = [SE2(0.3 * k, 0.1 * k, 0.2 * k) for k in range(12)]
    for pose in odom:
        assert slam.update(angles, np.full(len(angles), far, np.float32), pose, range_max=25.0)
    slam.finish()
    expected = [SE2(1.0, -2.0, 0.5) @ pose for pose in odom]
    assert [tuple(pose) for pose in slam.trajectory()] == [pytest.approx(tuple(pose)) for pose in expected]
    assert slam.closures() == [] and slam.range_offset == 0.0
    assert slam.map().at(*expected[0][:2]) < 25, "the beams clear the floor"


@pytest.mark.parametrize("mount", [IDENTITY, SE2(0.25, -0.1, 0.6), SE2(-0.3, 0.0, math.pi)])
def test_the_mount_of_the_laser_does_not_matter(ring, drive, odometry, angles, mount: SE2) -> None:
    truth = drive(1)[:60]
    slam, wheels = GraphSlam(GraphSlamParams(), sensor=mount), odometry(truth, 6, 0.05, 0.05, 0.03)
    for pose, wheel in zip(truth, wheels, strict=True):
        slam.update(angles, ring.ranges(pose @ mount, angles, 20.0), wheel)
    slam.finish()
    end = truth[0].between(truth[-1])
    assert wheels[-1].distance(end) > 0.2
    assert slam.pose.distance(end) < 0.05
