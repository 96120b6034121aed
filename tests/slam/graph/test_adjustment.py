"""Tests the joint adjustment: poses, range offset and edges of scans that see the same walls."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.adjustment import Adjustment
from chefbot.slam.graph.edges import Edges
from chefbot.slam.graph.relative_poses import relative
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.scan_beams import beams_of

DEVIATION = np.array([0.1, 0.1, 0.05])


@pytest.fixture
def scans_of(ring, angles):
    """Return a function that gives scans at poses, with ranges that are too long by `error` m and the metres in
    `applied`, in turn, added to them already."""

    def scans(poses, error: float = 0.0, applied=(0.0,)) -> list[ScanFeatures]:
        ranges = [ring.ranges(pose, angles, 20.0) + np.float32(error) for pose in poses]
        beams = [beams_of(angles, one, IDENTITY, 80.0, 3.0) for one in ranges]
        return [ScanFeatures.of(one, 40.0, applied[k % len(applied)]) for k, one in enumerate(beams)]

    return scans


@pytest.fixture
def truth(drive) -> list[SE2]:
    """Poses of a drive along two sides of the ring, a third of a metre apart."""
    return drive(0.5)[::3]


def array(poses: list[SE2]) -> np.ndarray:
    return np.array([pose.array() for pose in poses])


def disturbed(poses: list[SE2], seed: int = 1) -> np.ndarray:
    """Return the poses with errors; the first one stays."""
    noise = np.random.default_rng(seed).uniform(-1.0, 1.0, (len(poses), 3)) * DEVIATION
    noise[0] = 0.0
    return array(poses) + noise


def odometry(poses: np.ndarray, deviation=DEVIATION) -> Callable[[np.ndarray], Edges]:
    """Return a function that gives uncertain edges, which hold each pose to the one before as these are."""
    index = np.arange(len(poses) - 1)
    information = np.tile(np.diag(1.0 / np.square(deviation)), (len(index), 1, 1))
    edges = Edges(index, index + 1, relative(poses[:-1], poses[1:]), information, np.full(len(index), np.inf))
    return lambda _: edges


def errors(found: np.ndarray, true: list[SE2]) -> np.ndarray:
    return np.abs(found - array(true))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_scans_of_the_same_walls_find_their_poses(scans_of, truth, seed: int) -> None:
    start = disturbed(truth, seed)
    adjusted = Adjustment(scans_of(truth)).adjusted(start, odometry(start))
    assert errors(start, truth).max(axis=0) == pytest.approx(DEVIATION, rel=0.2)
    assert errors(adjusted, truth)[:, :2].max() < 0.03
    assert errors(adjusted, truth)[:, 2].max() < 0.01
    assert adjusted[0] == pytest.approx(array(truth)[0]), "the first pose is held"


def test_true_poses_stay_where_they_are(scans_of, truth) -> None:
    adjustment = Adjustment(scans_of(truth))
    adjusted = adjustment.adjusted(array(truth), odometry(array(truth)))
    assert errors(adjusted, truth).max() < 0.01
    assert adjustment.range_offset == pytest.approx(0.0, abs=0.003)


@pytest.mark.parametrize(("error", "applied"), [(0.05, (0.0,)), (-0.04, (0.0,)), (0.05, (0.0, -0.02, -0.05))])
def test_the_offset_of_the_ranges_is_found(scans_of, truth, error: float, applied) -> None:
    start = disturbed(truth)
    adjustment = Adjustment(scans_of(truth, error, applied))
    adjusted = adjustment.adjusted(start, odometry(start))
    assert adjustment.range_offset == pytest.approx(-error, abs=0.008)
    assert errors(adjusted, truth)[:, :2].max() < 0.04


def test_the_ranges_of_a_narrow_sensor_stay_as_they_are(scans_of, truth) -> None:
    adjustment = Adjustment(scans_of(truth, 0.05), calibrates_ranges=False)
    adjustment.adjusted(array(truth), odometry(array(truth)))
    assert adjustment.range_offset == 0.0


def test_scans_without_walls_stay_as_odometry_has_them(scans_of, truth) -> None:
    empty = [ScanFeatures.of(beams_of(*np.zeros((2, 0), np.float32), IDENTITY, 80.0, 3.0), 40.0)] * len(truth)
    poses = disturbed(truth)
    adjustment = Adjustment(empty)
    assert adjustment.adjusted(poses, odometry(poses)) == pytest.approx(poses)
    assert adjustment.range_offset == 0.0


def test_scans_of_different_places_do_not_pull(scans_of, truth) -> None:
    poses = np.array([[200.0 * k, 0.0, 0.0] for k in range(4)])
    adjusted = Adjustment(scans_of(truth[:4])).adjusted(poses, odometry(poses))
    assert adjusted == pytest.approx(poses)


def test_certain_edges_outweigh_the_scans(scans_of, truth) -> None:
    start = disturbed(truth)
    adjusted = Adjustment(scans_of(truth)).adjusted(start, odometry(start, np.full(3, 1e-5)))
    assert adjusted == pytest.approx(start, abs=1e-3)


def test_along_a_corridor_odometry_decides(corridor, angles) -> None:
    truth = [SE2(0.4 * k, 0.1, 0.0) for k in range(8)]
    beams = [beams_of(angles, corridor.ranges(pose, angles, 20.0), IDENTITY, 80.0, 3.0) for pose in truth]
    start = array(truth) + np.outer(np.arange(8), [0.03, 0.02, 0.0])
    adjusted = Adjustment([ScanFeatures.of(one, 40.0) for one in beams]).adjusted(start, odometry(start))
    assert adjusted[:, 0] == pytest.approx(start[:, 0], abs=0.02)
    assert errors(adjusted, truth)[:, 1].max() < 0.02
