"""Tests the refinement of a matched pose: its equations by brute force, its optimum, and what the prior decides."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.refinement import SURFACE_NOISE, linearized, refine
from chefbot.slam.graph.surface_grid import CELL, SurfaceGrid

SMALL = st.floats(-0.12, 0.12)
WITH_WORLD = settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
START = SE2(3.0, 1.3, 0.2)
NARROWEST = 0.06
"""Width of the robust kernel at the end, m."""


def grid_of(*scans) -> SurfaceGrid:
    """Return the surfaces of scans, given with their poses."""
    grid = SurfaceGrid(10_000_000)
    for features, pose in scans:
        grid.add(features.outline, pose.array())
    return grid


def refined(scan, grid: SurfaceGrid, start, prior, information, beams: float = 60.0):
    return refine(
        scan.points,
        scan.normals,
        np.array(start, np.float64),
        np.array(prior, np.float64),
        information,
        beams,
        grid.slot,
        grid.totals,
        grid.origin,
    )


def means_of(*scans) -> tuple[np.ndarray, np.ndarray]:
    """Return the cells (m, 2) in which points of scans lie, and the means (m, 2) of those in each."""
    placed = [pose.apply(features.outline.astype(float)) for features, pose in scans]
    points = np.concatenate(placed)
    cells, number = np.unique(np.floor(points / CELL).astype(int), axis=0, return_inverse=True)
    totals = np.zeros((len(cells), 2))
    np.add.at(totals, number.reshape(-1), points)
    return cells, totals / np.bincount(number.reshape(-1))[:, None]


def paired(scan, pose, scale: float, cells, means) -> list[tuple[int, np.ndarray, np.ndarray, float]]:
    """Return number, mean, direction and weight of the points whose cell is within two of that of a mean."""
    turn = SE2(0.0, 0.0, float(pose[2]))
    placed, normals = SE2.of(pose).apply(scan.points.astype(float)), turn.apply(scan.normals.astype(float))
    found = []
    for i, point in enumerate(placed):
        around = (np.abs(cells - np.floor(point / CELL)) <= 2).all(axis=1)
        if not around.any():
            continue
        mean = min(means[around].tolist(), key=lambda one: math.dist(one, point))
        if math.dist(mean, point) > 3.0 * scale:
            continue
        if normals[i].any():
            found.append((i, np.array(mean), normals[i], 1.0))
        else:
            found += [(i, np.array(mean), axis, 0.25) for axis in np.eye(2)]
    return found


def distances(scan, pairs, pose) -> np.ndarray:
    placed = SE2.of(pose).apply(scan.points.astype(float))
    return np.array([direction @ (placed[i] - mean) for i, mean, direction, _ in pairs])


def equations(scan, pairs, pose, scale: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the normal equations by differences, with Geman and McClure's weights, and the sum of these."""
    rows = [
        distances(scan, pairs, pose + step) - distances(scan, pairs, pose - step) for step in 1e-6 * np.eye(3)
    ]
    jacobian, r = np.array(rows).T / 2e-6, distances(scan, pairs, pose)
    weights = np.array([share for *_, share in pairs]) * (scale**2 / (scale**2 + r**2)) ** 2
    return (jacobian.T * weights) @ jacobian, (jacobian.T * weights) @ r, float(weights.sum())


@WITH_WORLD
@given(x=SMALL, y=SMALL, yaw=SMALL, seed=st.integers(0, 99))
def test_the_equations_are_those_of_brute_force(ring, features_at, x, y, yaw, seed) -> None:
    moved = SE2(0.3, 0.1, 0.2)
    surfaces = (features_at(ring, START, 0.01, seed), SE2(0.1, -0.2, 0.3))
    scan, pose = features_at(ring, START @ moved, 0.01, seed + 1), moved.array() + np.array([x, y, yaw])
    grid = grid_of(surfaces)
    h, g, inliers = linearized(scan.points, scan.normals, pose, 0.1, grid.slot, grid.totals, grid.origin)
    expected = equations(scan, paired(scan, pose, 0.1, *means_of(surfaces)), pose, 0.1)
    assert h == pytest.approx(expected[0], rel=1e-3, abs=1e-3)
    assert g == pytest.approx(expected[1], rel=1e-3, abs=1e-3)
    assert inliers == pytest.approx(expected[2], rel=1e-4)


@WITH_WORLD
@given(
    x=SMALL, y=SMALL, yaw=SMALL, deviation=st.floats(0.01, 0.3), beams=st.sampled_from([20.0, 60.0, 1000.0])
)
def test_at_the_result_scan_and_prior_balance(ring, features_at, x, y, yaw, deviation, beams) -> None:
    moved = SE2(0.3, 0.1, 0.2)
    surfaces = (features_at(ring, START, 0.005, 1), SE2(0.0, 0.0, 0.0))
    scan, prior = features_at(ring, START @ moved, 0.005, 2), moved.array() + np.array([x, y, yaw])
    information = np.eye(3) / deviation**2
    pose, scan_information, share = refined(scan, grid_of(surfaces), prior, prior, information, beams)
    h, g, weights = equations(scan, paired(scan, pose, NARROWEST, *means_of(surfaces)), pose, NARROWEST)
    per_point = min(1.0, beams / len(scan.points)) / SURFACE_NOISE**2
    assert scan_information == pytest.approx(per_point * h, rel=0.2, abs=0.02 * per_point * h.max())
    assert share == pytest.approx(weights / len(scan.points), abs=0.05)
    left = np.linalg.solve(per_point * h + information, per_point * g + information @ (pose - prior))
    assert np.abs(left).max() < 0.003, "one more step hardly moves"


@WITH_WORLD
@given(x=SMALL, y=SMALL, yaw=SMALL)
def test_a_scan_is_put_where_it_was_taken(ring, features_at, x, y, yaw) -> None:
    moved = SE2(0.3, 0.1, 0.2)
    grid = grid_of((features_at(ring, START), SE2(0.0, 0.0, 0.0)))
    scan, start = features_at(ring, START @ moved), moved.array() + np.array([x, y, yaw])
    pose, _, share = refined(scan, grid, start, moved.array(), np.eye(3))
    assert pose == pytest.approx(moved.array(), abs=0.02)
    assert share > 0.5


def test_a_certain_prior_is_kept(ring, features_at) -> None:
    grid = grid_of((features_at(ring, START), SE2(0.0, 0.0, 0.0)))
    prior = np.array([0.1, -0.1, 0.05])
    pose, _, _ = refined(features_at(ring, START), grid, np.zeros(3), prior, np.eye(3) * 1e12)
    assert pose == pytest.approx(prior, abs=1e-5)


@pytest.mark.parametrize("away", [(100.0, 0.0, 0.0), (0.0, -100.0, 3.0), (3.0, 30.0, 0.0)])
def test_beyond_all_surfaces_the_prior_decides(ring, features_at, away) -> None:
    grid = grid_of((features_at(ring, START), SE2(0.0, 0.0, 0.0)))
    pose, information, share = refined(features_at(ring, START), grid, away, away, np.eye(3))
    assert pose == pytest.approx(away)
    assert share == 0.0 and not information.any()


def test_more_points_than_beams_do_not_add_information(ring, features_at) -> None:
    scan = features_at(ring, START)
    grid = grid_of((scan, SE2(0.0, 0.0, 0.0)))
    few, many = (refined(scan, grid, np.zeros(3), np.zeros(3), np.eye(3), n)[1] for n in (20.0, 60.0))
    assert many == pytest.approx(3.0 * few, rel=0.02, abs=1.0)
    assert np.linalg.eigvalsh(few).min() > 0.0
