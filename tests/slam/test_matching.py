"""Tests that scan matching finds the pose at which a scan fits the map, and keeps odometry where it does not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.slam.conftest import CORRIDOR, RING, World

from chefbot.maths.se2 import SE2
from chefbot.slam.gmapping import create_levels
from chefbot.slam.map_pyramid import HillClimbParams, MapLevel, OdometryPrior
from chefbot.slam.matching import score
from chefbot.slam.params import GmappingParams

ANGLES = np.linspace(-np.pi, np.pi, 360, endpoint=False)
CLIMB = HillClimbParams(0.05, 0.05, 5)
VARIANCE = np.array([0.04, 0.04, 0.04])


def beam_ends(world: World, pose: SE2, reach: float = 8.0) -> np.ndarray:
    """Return the ends of the beams in base_link, metres, shape (n, 2)."""
    r = world.ranges(pose, ANGLES, reach)
    keep = np.isfinite(r)
    return (r[keep, None] * np.column_stack([np.cos(ANGLES[keep]), np.sin(ANGLES[keep])])).astype(np.float32)


def level_of(world: World, poses: list[SE2], reach: float = 8.0) -> MapLevel:
    level = MapLevel(1, 0.05, 0.05, CLIMB, 30.0, 10_000_000)
    level.grow_to(np.array([[-35.0, -5, 0], [35, 15, 0]]), 10.0)
    for pose in poses:
        level.add(level.points(beam_ends(world, pose, reach)), pose.array()[None])
    return level


@settings(max_examples=20)
@given(st.floats(0.8, 1.6), st.floats(0.9, 1.6), st.floats(-3, 3), st.floats(0, 6.28), st.floats(0.05, 0.3))
def test_the_score_is_highest_at_the_true_pose(x, y, yaw, direction, off) -> None:
    world, pose = World.of(RING), SE2(x, y, yaw)
    level = level_of(world, [pose])
    points = level.points(beam_ends(world, pose))

    def fit(dx: float, dy: float, turn: float) -> float:
        local = level._local(np.array([[x + dx, y + dy, yaw + turn]]))[0]
        m = level.maps
        return float(score(points, *local, np.float32(1), m.table[0], m.mean_x, m.mean_y))

    best = fit(0, 0, 0)
    assert best == pytest.approx(len(points), rel=0.05)
    assert best > fit(off * np.cos(direction), off * np.sin(direction), 0)
    assert best > fit(0, 0, off)
    assert best > fit(0, 0, -off)


@settings(max_examples=20)
@given(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2))
def test_a_displaced_start_is_corrected(dx: float, dy: float, turn: float) -> None:
    world, pose = World.of(RING), SE2(1.3, 1.3, 0.3)
    start = (pose @ SE2(dx, dy, turn)).array()[None]
    poses, prior = start, OdometryPrior(start, VARIANCE, start[:, 2])
    for level in create_levels(GmappingParams(particles=1)):
        level.grow_to(start, 10.0)
        level.add(level.points(beam_ends(world, pose)), pose.array()[None])
        poses, _ = level.match(level.points(beam_ends(world, pose)), poses, prior)
    assert poses[0, :2] == pytest.approx(pose[:2], abs=0.015)
    assert poses[0, 2] == pytest.approx(pose.yaw, abs=0.006)


@settings(max_examples=20)
@given(st.floats(-0.25, 0.25), st.floats(-0.08, 0.08))
def test_a_corridor_constrains_the_match_only_across_it(along: float, across: float) -> None:
    world = World.of(CORRIDOR)
    level = level_of(world, [SE2(x, 0, 0) for x in np.arange(-3, 3.1, 0.37)])
    start = np.array([[0.11 + along, across, 0.02]])
    variance = np.array([0.02**2, 0.05**2, 0.05**2])
    poses, _ = level.match(
        level.points(beam_ends(world, SE2(0.11, 0, 0))), start, OdometryPrior(start, variance, np.zeros(1))
    )
    assert abs(poses[0, 0] - start[0, 0]) < 0.04
    assert abs(poses[0, 1]) < 0.015
    assert abs(poses[0, 2]) < 0.006


def test_a_scan_of_unmapped_space_keeps_the_odometry_pose() -> None:
    level = level_of(World.of(RING), [])
    start = np.array([[1.0, 2.0, 0.5]])
    poses, fits = level.match(
        level.points(beam_ends(World.of(RING), SE2(1, 2, 0.5))),
        start,
        OdometryPrior(start, VARIANCE, start[:, 2]),
    )
    assert poses == pytest.approx(start, abs=1e-9)
    assert fits == pytest.approx(0)
