"""Tests Amcl in a simulated hotel with a 360-degree lidar and with the narrow scan of a depth camera."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from tests.localization.conftest import turn_in_a_twin_room

from chefbot.localization.amcl import Amcl
from chefbot.localization.errors import LocalizationError
from chefbot.localization.params import AmclParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2

Run = tuple[np.ndarray, np.ndarray, np.ndarray]


def follow(
    amcl: Amcl, hotel: Any, sensor: Any, truth: list[SE2], odom: list[SE2], seed: int, world: Any = None
) -> Run:
    """Run a drive and return position error in metres, yaw error in rad, and `converged` after each scan."""
    rng = np.random.default_rng(seed)
    out = []
    for pose, odometry in zip(truth, odom, strict=True):
        amcl.update(sensor.angles, sensor.scan(world or hotel, pose, rng), sensor.range_max, odometry)
        assert np.isfinite(amcl.pose).all() and np.isfinite(amcl.covariance).all()
        out.append((amcl.pose.distance(pose), abs(pose.between(amcl.pose).yaw), amcl.converged))
    errors, yaws, converged = np.array(out).T
    return errors, yaws, converged.astype(bool)


def wrong_start(amcl: Amcl, truth: SE2, seed: int) -> None:
    """Set an initial pose with errors of half a metre and 20 degrees."""
    a = np.random.default_rng(seed).uniform(0, 2 * math.pi)
    side = math.radians(20.0) * (-1) ** seed
    amcl.set_pose(SE2(truth.x + 0.5 * math.cos(a), truth.y + 0.5 * math.sin(a), truth.yaw + side), 0.5, 0.35)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.slow
def test_lidar_tracking_is_within_two_centimetres(hotel: Any, lidar: Any, drives: Any, seed: int) -> None:
    truth, odom = drives.route(seed)
    amcl = Amcl(AmclParams(seed=seed), hotel.grid, lidar.mount)
    wrong_start(amcl, truth[0], seed)
    errors, yaws, converged = follow(amcl, hotel, lidar, truth, odom, seed)
    assert np.median(errors) < 0.02 and errors[40:].max() < 0.04
    assert np.median(yaws) < 0.005
    assert converged[40:].all() and not (converged & (errors > 0.3)).any()
    assert amcl.quality.probability > 0.9


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.slow
def test_a_narrow_depth_scan_tracks_from_a_wrong_start(
    hotel: Any, depth_camera: Any, drives: Any, seed: int
) -> None:
    truth, odom = drives.route(seed)
    amcl = Amcl(AmclParams(seed=seed), hotel.grid, depth_camera.mount)
    wrong_start(amcl, truth[0], seed)
    errors, _, converged = follow(amcl, hotel, depth_camera, truth, odom, seed)
    assert np.median(errors) < 0.04 and np.quantile(errors[40:], 0.95) < 0.08
    assert not (converged & (errors > 0.3)).any()


@pytest.mark.slow
def test_a_replaced_map_keeps_the_pose(hotel: Any, lidar: Any, drives: Any) -> None:
    """A wall is drawn where the robot never sees it, and the map has another size; tracking continues."""
    truth, odom = drives.route(1)
    amcl = Amcl(AmclParams(seed=1), hotel.grid, lidar.mount)
    amcl.set_pose(truth[0], 0.1, 0.1)
    follow(amcl, hotel, lidar, truth[:80], odom[:80], 1)
    before = amcl.pose
    larger = Grid(
        np.pad(hotel.grid.cells, 20, constant_values=-1),
        hotel.grid.resolution,
        hotel.grid.origin_x - 20 * hotel.grid.resolution,
        hotel.grid.origin_y - 20 * hotel.grid.resolution,
    )
    amcl.replace_map(larger)
    assert amcl.pose == pytest.approx(before, abs=0.01), "also between two updates of the filter"
    errors, _, converged = follow(amcl, hotel, lidar, truth[80:], odom[80:], 1)
    assert errors.max() < 0.05 and converged.all()


@pytest.mark.parametrize("start", range(4))
def test_lidar_localizes_globally_among_similar_rooms(
    hotel: Any, lidar: Any, drives: Any, start: int
) -> None:
    truth, odom = drives.from_room(start)
    amcl = Amcl(AmclParams(seed=start), hotel.grid, lidar.mount)
    errors, _, converged = follow(amcl, hotel, lidar, truth, odom, start)
    assert errors[-20:].max() < 0.04 and converged[-1]
    assert not (converged & (errors > 0.5)).any()


@pytest.mark.parametrize("seed", range(3))
def test_two_identical_rooms_keep_both_hypotheses(twin_rooms: Any, lidar: Any, seed: int) -> None:
    for particles in turn_in_a_twin_room(twin_rooms, twin_rooms.grid, lidar, seed):
        left = float(particles.weights[particles.particles[:, 0] < 5.0].sum())
        assert 0.2 < left < 0.8 and not particles.is_narrow


@pytest.mark.slow
def test_a_kidnapped_robot_is_detected_and_relocalized(hotel: Any, lidar: Any, drives: Any) -> None:
    truth, odom = drives.kidnapped(250)
    amcl = Amcl(AmclParams(seed=1), hotel.grid, lidar.mount)
    amcl.set_pose(truth[0], 0.1, 0.1)
    errors, _, converged = follow(amcl, hotel, lidar, truth, odom, 1)
    assert errors[40:249].max() < 0.05
    assert errors[250] > 2.0
    assert errors[350:].max() < 0.1 and converged[350:].all()
    assert (converged[250:] & (errors[250:] > 0.5)).sum() <= 15


@pytest.mark.slow
def test_people_around_the_robot_do_not_disturb_tracking(hotel: Any, lidar: Any, drives: Any) -> None:
    truth, odom = drives.route(2)
    hotel_with_people = dataclasses.replace(
        hotel, segments=np.concatenate([hotel.segments, drives.people(20)])
    )
    amcl = Amcl(AmclParams(seed=2), hotel.grid, lidar.mount)
    amcl.set_pose(truth[0], 0.2, 0.1)
    errors, _, _ = follow(amcl, hotel, lidar, truth, odom, 2, world=hotel_with_people)
    assert np.median(errors) < 0.03 and errors.max() < 0.15


def test_a_wrong_pose_is_reported_as_wrong(hotel: Any, lidar: Any, drives: Any) -> None:
    truth, odom = drives.route(3)
    amcl = Amcl(AmclParams(seed=3, recovery_alpha_slow=0.0), hotel.grid, lidar.mount)
    amcl.set_pose(truth[0] @ SE2(2.5, 0.0, 1.0), 0.1, 0.1)
    errors, _, converged = follow(amcl, hotel, lidar, truth[:40], odom[:40], 3)
    assert errors.min() > 1.0 and not converged.any() and amcl.quality.probability < 0.5


def test_the_same_seed_gives_identical_bytes(hotel: Any, lidar: Any, drives: Any) -> None:
    truth, odom = drives.route(0)
    ends = []
    for seed in (5, 5, 6):
        amcl = Amcl(AmclParams(seed=seed), hotel.grid, lidar.mount)
        follow(amcl, hotel, lidar, truth[:30], odom[:30], 0)
        ends.append(amcl.particles.tobytes() + np.array(amcl.pose).tobytes())
    assert ends[0] == ends[1] and ends[0] != ends[2]


def test_set_pose_draws_the_given_mean_and_deviation(hotel: Any, lidar: Any) -> None:
    amcl = Amcl(AmclParams(min_particles=20_000), hotel.grid, lidar.mount)
    amcl.set_pose(SE2(5.0, 6.0, 3.1), 0.3, 0.2)
    p = amcl.particles
    assert p[:, :2].mean(axis=0) == pytest.approx((5.0, 6.0), abs=0.01)
    assert p[:, :2].std(axis=0) == pytest.approx((0.3, 0.3), rel=0.03)
    off = np.remainder(p[:, 2] - 3.1 + math.pi, 2 * math.pi) - math.pi
    assert off.mean() == pytest.approx(0.0, abs=0.01) and off.std() == pytest.approx(0.2, rel=0.03)
    assert np.all(np.abs(p[:, 2]) <= math.pi)
    assert amcl.weights.sum() == pytest.approx(1.0)
    assert amcl.pose.distance(SE2(5.0, 6.0, 0.0)) < 0.02


@pytest.mark.parametrize("value", [np.inf, np.nan, 0.0, 99.0])
def test_scans_without_returns_only_apply_odometry(hotel: Any, lidar: Any, value: float) -> None:
    amcl = Amcl(AmclParams(), hotel.grid, lidar.mount)
    amcl.set_pose(SE2(5.0, 6.0, 0.0), 0.05, 0.02)
    before = amcl.covariance.trace()
    for k in range(8):
        assert amcl.update(lidar.angles, np.full(360, value), 8.0, SE2(0.2 * k, 0.0, 0.0))
    assert amcl.pose.distance(SE2(6.4, 6.0, 0.0)) < 0.05
    assert amcl.covariance.trace() > before
    assert amcl.weights.sum() == pytest.approx(1.0)


def test_updates_need_motion_except_right_after_start(hotel: Any, lidar: Any) -> None:
    rng = np.random.default_rng(0)
    amcl = Amcl(AmclParams(), hotel.grid, lidar.mount)
    amcl.set_pose(SE2(5.6, 6.0, 0.0), 0.1, 0.1)
    ranges = lidar.scan(hotel, SE2(5.6, 6.0, 0.0), rng)
    assert amcl.update(lidar.angles, ranges, 8.0, SE2(7.0, 1.0, 2.0))
    still = amcl.particles.tobytes()
    assert not amcl.update(lidar.angles, ranges, 8.0, SE2(7.0, 1.0, 2.05))
    assert amcl.particles.tobytes() == still
    between = amcl.pose
    assert amcl.update(lidar.angles, ranges, 8.0, SE2(7.0, 1.0, 2.15))
    assert (amcl.map_T_odom @ SE2(7.0, 1.0, 2.15)).distance(amcl.pose) < 1e-9
    assert between.yaw == pytest.approx(0.05, abs=0.03)


def test_input_errors_name_the_fault(hotel: Any, lidar: Any) -> None:
    with pytest.raises(LocalizationError, match="no free cell"):
        Amcl(AmclParams(), Grid(np.full((4, 4), -1, np.int8), 0.05, 0, 0), lidar.mount)
    with pytest.raises(LocalizationError, match="min_particles"):
        Amcl(AmclParams(min_particles=100, max_particles=50), hotel.grid, lidar.mount)
    with pytest.raises(LocalizationError, match="finite"):
        Amcl(AmclParams(), hotel.grid, lidar.mount).set_pose(SE2(math.nan, 0.0, 0.0))
