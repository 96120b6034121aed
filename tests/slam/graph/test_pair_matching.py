"""Tests the normal equations of pairs of scans against brute force and differences of the residuals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.pair_matching import linearize_pairs
from chefbot.slam.graph.scan_features import ScanFeatures, directions
from chefbot.slam.scan_beams import beams_of

SCALE = 0.1
SMALL = st.floats(-0.08, 0.08)
WITH_WORLD = settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
FULL_TURN = np.linspace(-math.pi, math.pi, 360, endpoint=False).astype(np.float32)


def linearized(scans, poses, scale: float = SCALE, pairs=((0, 1),)):
    """Return the normal equations and the numbers of points of pairs (of, to) of scans at poses."""
    of, to = np.array(pairs, np.int64).T.copy()
    begin = np.concatenate([[0], np.cumsum([len(one.points) for one in scans])]).astype(np.int64)
    return linearize_pairs(
        of,
        to,
        np.array(poses, np.float64),
        np.concatenate([one.points for one in scans]),
        np.concatenate([one.normals for one in scans]),
        np.concatenate([one.bearings for one in scans]),
        begin,
        np.array([one.sensor for one in scans]),
        scale,
    )


def cloud(points, normals=None) -> ScanFeatures:
    """Return features of points (n, 2) that a sensor at the origin sees, by default of no known surface."""
    points = np.asarray(points, np.float32).reshape(-1, 2)
    order = np.argsort(np.arctan2(points[:, 1], points[:, 0]), kind="stable")
    points = points[order]
    normals = np.zeros_like(points) if normals is None else np.asarray(normals, np.float32)[order]
    bearings = np.arctan2(points[:, 1], points[:, 0]).astype(np.float32)
    return ScanFeatures(points, normals, points, 0.0, bearings, np.zeros(2, np.float32), 0.0)


def turned(yaw: float, vectors: np.ndarray) -> np.ndarray:
    c, s = math.cos(yaw), math.sin(yaw)
    return vectors @ np.array([[c, s], [-s, c]])


def paired(a: ScanFeatures, b: ScanFeatures, pose) -> list[tuple[int, int, np.ndarray, float]]:
    """Return by brute force the numbers of corresponding points of b and of a, the direction in which their distance
    counts, and its weight."""
    placed = turned(pose[2], b.points.astype(float)) + pose[:2]
    normals = turned(pose[2], b.normals.astype(float))
    found = []
    for i, point in enumerate(placed):
        distances = np.hypot(*(a.points - point).T)
        j = int(np.argmin(distances))
        known, moved_known = a.normals[j].any(), b.normals[i].any()
        if distances[j] > 0.2 + 0.05 * math.dist(point, a.sensor):
            continue
        if known and moved_known and a.normals[j] @ normals[i] < 0.7:
            continue
        if known or moved_known:
            found.append((i, j, a.normals[j].astype(float) if known else normals[i], 1.0))
        else:
            found += [(i, j, axis, 0.1) for axis in np.eye(2)]
    return found


def residuals(a, b, pairs, variables) -> np.ndarray:
    """Return the distances of pairs with scan b at (x, y, yaw), and an offset added to all ranges."""
    *pose, offset = variables
    points = a.points + offset * directions(a.points, a.sensor).astype(float)
    moved = b.points + offset * directions(b.points, b.sensor).astype(float)
    placed = turned(pose[2], moved) + pose[:2]
    return np.array([normal @ (placed[i] - points[j]) for i, j, normal, _ in pairs])


def assert_equations(a: ScanFeatures, b: ScanFeatures, pose) -> int:
    """Compare the kernel with differences of the residuals of the pairs that brute force finds."""
    h, g, counts = linearized([a, b], [np.zeros(3), pose])
    pairs = paired(a, b, pose)
    at = np.array([*pose, 0.0])
    steps = 1e-6 * np.eye(4)
    rows = [residuals(a, b, pairs, at + step) - residuals(a, b, pairs, at - step) for step in steps]
    jacobian = np.array(rows).T.reshape(-1, 4) / 2e-6
    distances = residuals(a, b, pairs, at)
    weights = np.array([share for *_, share in pairs]) * (SCALE**2 / (SCALE**2 + distances**2)) ** 2
    assert h[0] == pytest.approx((jacobian.T * weights) @ jacobian, rel=1e-4, abs=1e-4)
    assert g[0] == pytest.approx((jacobian.T * weights) @ distances, rel=1e-4, abs=1e-4)
    assert counts[0] == pytest.approx([weights.sum(), len(b.points)], rel=1e-6)
    return len(pairs)


@WITH_WORLD
@given(x=SMALL, y=SMALL, yaw=SMALL, seed=st.integers(0, 99))
def test_the_equations_are_those_of_brute_force(ring, features_at, x, y, yaw, seed) -> None:
    start, moved = SE2(3.0, 1.3, 0.2), SE2(0.3, 0.1, 0.3)
    a, b = features_at(ring, start, 0.01, seed), features_at(ring, start @ moved, 0.01, seed + 1)
    assert assert_equations(a, b, moved.array() + np.array([x, y, yaw])) > 50


@settings(max_examples=50)
@given(
    st.lists(st.tuples(st.floats(0.3, 3.0), st.floats(-3.14, 3.14)), min_size=1, max_size=25),
    st.lists(st.tuples(st.floats(0.3, 3.0), st.floats(-3.14, 3.14)), min_size=1, max_size=25),
    st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
)
@example([(3.0, -3.13), (1.0, 3.09)], [(1.0, -3.09)], (0.0, 0.0, 0.0))
@example([(3.0, 3.13), (1.0, -3.09)], [(1.0, 3.09)], (0.0, 0.0, 0.0))
def test_points_of_no_surface_count_in_both_axes(first, second, pose) -> None:
    a, b = (cloud([(r * math.cos(t), r * math.sin(t)) for r, t in polar]) for polar in (first, second))
    assert_equations(a, b, np.array(pose))


@settings(WITH_WORLD, max_examples=8)
@given(st.floats(-math.pi, math.pi))
def test_a_full_turn_has_no_seam(ring, yaw) -> None:
    def scan(pose: SE2) -> ScanFeatures:
        return ScanFeatures.of(
            beams_of(FULL_TURN, ring.ranges(pose, FULL_TURN, 20.0), IDENTITY, 80.0, 3.0), 40.0
        )

    start, moved = SE2(3.0, 1.3, yaw), SE2(0.1, 0.1, 0.2)
    assert_equations(scan(start), scan(start @ moved), moved.array())


@WITH_WORLD
@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-10.0, 10.0))
def test_the_frame_of_the_map_does_not_matter(ring, features_at, x, y, yaw) -> None:
    poses = [SE2(3.0, 1.3, 0.0), SE2(3.4, 1.4, 0.2)]
    scans = [features_at(ring, pose, 0.01, seed) for seed, pose in enumerate(poses)]
    expected = linearized(scans, poses)
    found = linearized(scans, [SE2(x, y, yaw) @ pose for pose in poses])
    for one, other in zip(expected, found, strict=True):
        assert other == pytest.approx(one, rel=1e-6, abs=1e-6)


@WITH_WORLD
@given(x=SMALL, y=SMALL, yaw=SMALL)
def test_a_few_steps_lead_to_the_true_pose(ring, features_at, x, y, yaw) -> None:
    start, moved = SE2(3.0, 1.3, 0.2), SE2(0.4, -0.2, 0.3)
    scans = [features_at(ring, start), features_at(ring, start @ moved)]
    pose = moved.array() + np.array([x, y, yaw])
    for _ in range(8):
        h, g, _ = linearized(scans, [np.zeros(3), pose])
        pose = pose - np.linalg.solve(h[0, :3, :3], g[0, :3])
    assert pose == pytest.approx(moved.array(), abs=0.01)


def test_both_sides_of_a_thin_wall_are_not_a_pair() -> None:
    x = np.linspace(-0.5, 0.5, 20)
    points, up = np.column_stack([x, np.full(20, -1.0)]), np.tile([0.0, 1.0], (20, 1))
    _, _, counts = linearized([cloud(points, up), cloud(points, up)], np.zeros((2, 3)))
    assert counts.tolist() == [[20.0, 20.0]]
    h, g, counts = linearized([cloud(points, up), cloud(points, -up)], np.zeros((2, 3)))
    assert counts.tolist() == [[0.0, 20.0]] and not h.any() and not g.any()


def test_scans_without_points_give_no_equations() -> None:
    scans = [cloud(np.zeros((0, 2))), cloud([[1.0, 0.0]])]
    h, g, counts = linearized(scans, np.zeros((2, 3)), pairs=[(0, 1), (1, 0), (0, 0)])
    assert counts.tolist() == [[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]]
    assert not h.any() and not g.any()


def test_each_pair_is_linearized_for_itself(ring, features_at) -> None:
    poses = [SE2(3.0 + 0.3 * k, 1.3, 0.1 * k) for k in range(3)]
    scans = [features_at(ring, pose, 0.01, seed) for seed, pose in enumerate(poses)]
    together = linearized(scans, poses, pairs=[(0, 1), (2, 0), (1, 2)])
    for row, (of, to) in enumerate([(0, 1), (2, 0), (1, 2)]):
        alone = linearized([scans[of], scans[to]], [poses[of], poses[to]])
        for one, other in zip(together, alone, strict=True):
            assert np.array_equal(one[row], other[0])
