"""Tests the match of a scan against a submap: the pose that it finds and the covariance that it gives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.correlation import correlate
from chefbot.slam.graph.submap import FinishedSubmapError, Submap
from chefbot.slam.graph.surface_grid import CELL, SurfaceGrid

SHIFT = st.floats(-0.25, 0.25)


def submap_of(scans) -> Submap:
    """Return a submap of scans, given with their poses."""
    submap = Submap(grid=SurfaceGrid(10_000_000))
    for features, pose in scans:
        submap.insert(features, pose.array())
    return submap


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(x=SHIFT, y=SHIFT, yaw=st.floats(-0.2, 0.2), seed=st.integers(0, 1000))
def test_a_known_shift_is_found(ring, features_at, x: float, y: float, yaw: float, seed: int) -> None:
    start = SE2(3.0, 1.3, 0.1)
    submap = submap_of([(features_at(ring, start, 0.01, seed), SE2(0.0, 0.0, 0.0))])
    true = SE2(0.3, 0.1, 0.2)
    scan = features_at(ring, start @ true, 0.01, seed + 1)
    prior = true.array() + np.array([x, y, yaw])
    match = submap.match(scan, prior, np.diag([0.15, 0.15, 0.1]) ** 2, 60.0)
    assert match.pose == pytest.approx(true.array(), abs=0.03)
    assert match.inliers > 0.5


def test_the_covariance_is_long_along_a_corridor(corridor, features_at) -> None:
    submap = submap_of(
        [(features_at(corridor, SE2(x, 0.1, 0.0), 0.005, 1), SE2(x, 0.1, 0.0)) for x in (0, 1, 2)]
    )
    prior = np.array([2.63, 0.1, 0.0])
    covariance = np.diag([0.1, 0.1, 0.05]) ** 2
    match = submap.match(features_at(corridor, SE2(2.5, 0.1, 0.0), 0.005, 2), prior, covariance, 60.0)
    assert match.information[0, 0] < 5e-3 * match.information[1, 1]
    posterior = np.sqrt(np.diag(np.linalg.inv(np.linalg.inv(covariance) + match.information)))
    assert posterior[0] > 0.06, "along the corridor odometry's uncertainty stays"
    assert posterior[1] < 0.02 and posterior[2] < 0.01, "across it and in heading the walls decide"
    assert match.pose[0] == pytest.approx(2.63, abs=0.06), "odometry carries the pose along the corridor"


def test_a_scan_without_surfaces_keeps_the_prior(ring, features_at) -> None:
    submap = submap_of([(features_at(ring, SE2(3.0, 1.3, 0.0)), SE2(0.0, 0.0, 0.0))])
    empty = features_at(ring, SE2(3.0, 1.3, 0.0), reach=0.01)
    match = submap.match(empty, np.array([1.0, 2.0, 0.5]), np.eye(3), 60.0)
    assert match.pose.tolist() == [1.0, 2.0, 0.5] and match.inliers == 0.0
    assert not match.information.any()


def test_a_finished_submap_is_not_matched(ring, features_at) -> None:
    with pytest.raises(FinishedSubmapError, match="under construction"):
        Submap().match(features_at(ring, SE2(3.0, 1.3, 0.0)), np.zeros(3), np.eye(3), 60.0)


def test_correlation_prefers_the_prior_among_equals() -> None:
    field, origin = np.full((60, 60), 100, np.uint8), np.array([-3.0, -3.0])
    points = np.array([[0.5, 0.0], [0.0, 0.7]], np.float32)
    prior = np.array([0.2, 0.1, 0.3])
    steps = np.array([CELL, 0.05])
    pose, score = correlate(points, prior, np.eye(3), 60.0, np.array([0.3, 0.1]), steps, field, origin)
    assert pose == pytest.approx(prior)
    assert score == pytest.approx(100 / 255)


def test_normals_are_across_the_walls_and_towards_the_sensor(corridor, features_at) -> None:
    features = features_at(corridor, SE2(0.0, 0.0, 0.0))
    known = (features.normals != 0).any(axis=1)
    assert known.mean() > 0.8
    assert np.abs(np.abs(features.normals[known, 1]) - 1.0).max() < 1e-3
    assert (features.normals[known] * features.points[known]).sum(axis=1).max() < 0.0
    assert len(features.outline) > len(features.points), "grazed walls are filled in"


def test_points_are_ordered_whatever_the_mount(ring) -> None:
    from chefbot.slam.graph.scan_features import ScanFeatures
    from chefbot.slam.scan_beams import beams_of

    angles = np.linspace(-math.pi, math.pi, 360, endpoint=False).astype(np.float32)
    ranges = ring.ranges(SE2(3.0, 1.3, 0.0), angles, 20.0)
    upright = ScanFeatures.of(beams_of(angles, ranges, SE2(0.1, 0.0, 0.0), 80.0, 3.0), 40.0)
    inverted = ScanFeatures.of(beams_of(angles[::-1], ranges[::-1], SE2(0.1, 0.0, 0.0), 80.0, 3.0), 40.0)
    assert (np.diff(upright.bearings) >= 0).all() and (np.diff(inverted.bearings) >= 0).all()
    assert np.allclose(np.sort(upright.points, axis=0), np.sort(inverted.points, axis=0), atol=0.1)
