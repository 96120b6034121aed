"""Tests Gmapping through its public interface on simulated drives and on logs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.support.beam_angles import CAMERA, LIDAR

from chefbot.errors import OdometryError, ScanError
from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam import Gmapping, GmappingParams, run_log, trajectory_tum
from chefbot.slam.carmen import CarmenLogError, parse


def run(world, truth, odom, params=None, angles=LIDAR, sensor=IDENTITY, initial=IDENTITY, near=0.0):
    """Return the mapper after a drive, and the errors of its poses, shape (n, 3)."""
    slam = Gmapping(params or GmappingParams(particles=15), sensor, initial)
    rng, errors = np.random.default_rng(9), []
    for true, wheel in zip(truth, odom, strict=True):
        ranges = world.ranges(true @ sensor, angles, 8.0)
        ranges = ranges + rng.normal(0, 0.01, len(ranges)).astype(np.float32)
        slam.update(angles, np.where(ranges < near, np.float32(np.nan), ranges), wheel)
        errors.append(truth[0].between(true).between(initial.between(slam.pose)))
    return slam, np.array(errors)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_loop_missed_by_odometry_is_closed(ring, drive, odometry, seed: int) -> None:
    truth = drive(1.25)
    odom = odometry(truth, seed, 0.05, 0.05, 0.02)
    drift = np.hypot(*np.array(truth[0].between(truth[-1]).between(odom[-1]))[:2])
    slam, errors = run(ring, truth, odom, GmappingParams(particles=15, seed=seed))
    error = np.hypot(errors[:, 0], errors[:, 1])
    assert drift > 0.6
    assert error.max() < 0.25
    assert error[-1] < 0.1
    assert 0 <= slam.map().at(0.0, 0.0) < 25, "the driven path is mapped as free"


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.slow
def test_a_depth_camera_improves_good_odometry(ring, drive, odometry, seed: int) -> None:
    truth = drive(2.0)
    odom = odometry(truth, seed, 0.02, 0.02, 0.005)
    drift = max(math.hypot(*truth[0].between(t).between(o)[:2]) for t, o in zip(truth, odom, strict=True))
    params = GmappingParams(
        particles=30,
        seed=seed,
        odometry_noise=OdometryNoise(
            translation_from_translation=0.05,
            translation_from_rotation=0.05,
            rotation_from_translation=0.05,
            rotation_from_rotation=0.05,
        ),
    )
    _, errors = run(ring, truth, odom, params, CAMERA, SE2(0.1, 0, 0), near=0.45)
    assert drift > 0.7
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < 0.3


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_bare_corridor_keeps_the_odometry_length(corridor, seed: int) -> None:
    truth = [SE2(x, 0, 0) for x in np.arange(-15, 15, 0.1)]
    slam, errors = run(corridor, truth, truth, GmappingParams(particles=15, seed=seed))
    assert (
        np.abs(errors[:, 0]).max() < 0.04 * 30
    )  # the filter assumes 10 % odometry noise, here it is perfect
    assert np.abs(errors[:, 1]).max() < 0.1
    assert slam.map().width > 500


def test_the_same_seed_repeats_the_map_and_another_differs(ring, drive, odometry) -> None:
    truth = drive(0.5)
    odom = odometry(truth, 1, 0.05, 0.05)

    def outcome(seed: int):
        slam, _ = run(ring, truth, odom, GmappingParams(particles=8, seed=seed))
        return np.array(slam.trajectory()).tobytes(), slam.map().cells.tobytes()

    assert outcome(5) == outcome(5)
    assert outcome(5) != outcome(6)


def test_the_odometry_origin_does_not_matter(ring, drive, odometry) -> None:
    truth = drive(0.25)
    odom = odometry(truth, 1, 0.03, 0.03)
    moved = [SE2(64.0, -32.0, 0.0) @ o for o in odom]
    first, _ = run(ring, truth, odom)
    second, _ = run(ring, truth, moved)
    assert np.array(first.trajectory()) == pytest.approx(np.array(second.trajectory()), abs=0.03)
    assert first.pose == pytest.approx(second.map_T_odom @ moved[-1], abs=0.03)


def test_the_initial_pose_is_the_map_origin(ring) -> None:
    slam = Gmapping(GmappingParams(particles=2), initial=SE2(5, -3, 1))
    assert slam.pose == SE2(5, -3, 1)
    assert slam.update(LIDAR, ring.ranges(SE2(1.3, 1.3, 0), LIDAR, 8.0), SE2(7, 7, 7))
    assert slam.pose == pytest.approx(SE2(5, -3, 1), abs=1e-9)


def test_between_scans_the_pose_follows_odometry(ring) -> None:
    slam, truth = Gmapping(GmappingParams(particles=2)), SE2(1.3, 1.3, 0)
    ranges = ring.ranges(truth, LIDAR, 8.0)
    assert slam.update(LIDAR, ranges, SE2(0, 0, 0))
    frame = slam.map_T_odom
    assert not slam.update(LIDAR, ranges, SE2(0.3, 0, 0.1))
    assert slam.map_T_odom == frame
    assert slam.pose == pytest.approx(SE2(0.3, 0, 0.1), abs=1e-9)
    assert len(slam.trajectory()) == 1
    assert slam.update(LIDAR, ring.ranges(SE2(1.85, 1.3, 0.1), LIDAR, 8.0), SE2(0.55, 0, 0.1))
    assert len(slam.trajectory()) == 2


def test_scans_without_returns_map_nothing() -> None:
    slam = Gmapping(GmappingParams(particles=3))
    nothing = np.full(len(LIDAR), np.nan, np.float32)
    for x in range(5):
        assert slam.update(LIDAR, nothing, SE2(float(x), 0, 0))
    assert (slam.map().cells <= 25).all()
    assert 1 <= slam.neff <= 3 + 1e-9


def test_ranges_at_or_beyond_the_maximum_are_no_returns() -> None:
    slam = Gmapping(GmappingParams(particles=1, clear_range=2.0))
    slam.update(np.zeros(1, np.float32), np.array([8.0], np.float32), SE2(0, 0, 0), range_max=8.0)
    grid = slam.map()
    assert grid.at(1.9, 0) < 25
    assert grid.at(2.2, 0) == -1
    assert (grid.cells < 65).all()


@pytest.mark.parametrize("odom", [SE2(math.nan, 0, 0), SE2(0, math.inf, 0), SE2(1e9, 0, 0), SE2(0, 1e300, 0)])
def test_implausible_odometry_is_rejected(odom: SE2) -> None:
    slam, ranges = Gmapping(GmappingParams(particles=2)), np.ones(len(LIDAR), np.float32)
    slam.update(LIDAR, ranges, SE2(0, 0, 0))
    with pytest.raises(OdometryError, match="check"):
        slam.update(LIDAR, ranges, odom)


def test_an_odometry_jump_is_reported_and_mapping_continues(ring) -> None:
    """A jump and the jump back, as by a message of another publisher; and a jump as after a restart of odometry."""
    slam, ranges = Gmapping(GmappingParams(particles=2)), ring.ranges(SE2(1.3, 1.3, 0), LIDAR, 8.0)
    slam.update(LIDAR, ranges, SE2(0, 0, 0))
    slam.update(LIDAR, ranges, SE2(0.3, 0, 0.1))
    for jump in (SE2(4e5, -1e5, 2.0), SE2(0.3, 0, 0.1), SE2(-200.0, 0, 0)):
        with pytest.raises(OdometryError, match="jumped"):
            slam.update(LIDAR, ranges, jump)
        assert slam.pose == pytest.approx(SE2(0.3, 0, 0.1), abs=1e-6)
    assert slam.update(LIDAR, ring.ranges(SE2(1.85, 1.3, 0.1), LIDAR, 8.0), SE2(-199.45, 0, 0))
    assert slam.pose.distance(SE2(0.85, 0.0, 0.0)) < 0.3
    assert slam.map().width < 500


def test_scans_need_an_angle_for_each_range() -> None:
    with pytest.raises(ScanError, match="angles"):
        Gmapping(GmappingParams()).update(LIDAR, np.ones(3, np.float32), SE2(0, 0, 0))


def test_a_log_gives_stamped_poses_and_a_map() -> None:
    lines = [f"FLASER 4 2 2 2 2 {x} 0 0 {x} 0 0 {10 + x} host 1" for x in (0.0, 0.2, 0.7, 1.4)]
    calls: list[tuple[int, int]] = []
    result = run_log(parse(lines), GmappingParams(particles=2), lambda done, of: calls.append((done, of)))
    assert result.stamps == [10.0, 10.7, 11.4]
    assert result.scans == 4
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]
    rows = [[float(w) for w in row.split()] for row in trajectory_tum(result).splitlines()]
    assert [row[0] for row in rows] == result.stamps
    poses = np.array(result.poses)
    assert np.array(rows)[:, 1:3] == pytest.approx(poses[:, :2], abs=1e-6)
    assert (result.grid.cells == 97).any()


def test_no_return_readings_of_logs_clear_only_nearby_cells() -> None:
    line = "FLASER 4 81.83 2 2 81.91 0 0 0 0 0 0 10 host 1"
    grid = run_log(parse([line]), GmappingParams(particles=1, clear_range=3.0)).grid
    assert grid.at(0, -2.9) < 25
    assert max(grid.width, grid.height) < 5.5 / grid.resolution


def test_a_log_without_scans_is_rejected() -> None:
    with pytest.raises(CarmenLogError, match="no FLASER"):
        run_log([], GmappingParams())
