"""Matches of scans say what the walls hold, and no more."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chefbot.calibration.alignment import localize_station, match
from chefbot.calibration.surface import Surface
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

sys.path.insert(0, str(Path(__file__).parent))
from rooms import LIDAR, WALL, WORKSHOP, drum, seen

SEEDS = st.integers(0, 10**6)
LEFT = math.pi / 2


def near(pose: SE2, rng: np.random.Generator, metres: float = 0.05, angle: float = 0.02) -> SE2:
    """A guess."""
    return SE2.of(pose.array() + rng.normal(size=3) * (metres, metres, angle))


@given(SEEDS, st.floats(0.03, 0.12))
@settings(max_examples=15, deadline=None)
def test_one_wall_gives_no_constraint_along_itself(seed: int, slid: float) -> None:
    """Noise makes its normals waver; taken for information, that would hold a stand where it was thought to be."""
    rng = np.random.default_rng(seed)
    surfaces = [Surface(seen(WALL, SE2(x, 0.0, LEFT), rng)) for x in (0.0, 0.1)]
    link = match(0, 1, SE2(0.0, -0.1 + slid, 0.0), surfaces)  # seen from the first, the wall is along y
    assert link is not None
    across, along = 1.0 / np.sqrt(np.maximum(np.diag(link.information)[:2], 1e-6))
    assert across < 0.01
    assert along > 2.0 * slid


@given(SEEDS, st.floats(0.0, 1.5), st.floats(0.0, 1.5), st.floats(-math.pi, math.pi))
@settings(max_examples=40, deadline=None)
def test_alignment_error_is_within_its_reported_covariance(seed: int, x: float, y: float, yaw: float) -> None:
    rng = np.random.default_rng(seed)
    first = SE2(x, y, yaw)
    second = near(first, rng, 0.2, 0.2)
    link = match(
        0, 1, near(first.between(second), rng), [Surface(seen(WORKSHOP, one, rng)) for one in (first, second)]
    )
    assume(link is not None)
    assert link is not None
    truth = first.between(second)
    off = np.array([link.pose.x - truth.x, link.pose.y - truth.y, wrap(link.pose.yaw - truth.yaw)])
    assert off @ link.information @ off < 8.0**2


def test_a_round_object_before_a_wall_does_not_rotate_the_match() -> None:
    """Lines through points of an arc lie inside it, and two places see other parts of it: 4 mrad, were it matched."""
    rng = np.random.default_rng(3)
    room = [*WALL, *drum(0.35, 2.0, 0.2)]
    poses = [SE2(0.0, 1.2, LEFT), SE2(0.1, 1.1, LEFT + 0.05)]
    truth, turned = poses[0].between(poses[1]), []
    for _ in range(6):
        first, second = (Surface(seen(room, pose, rng)) for pose in poses)
        link = match(0, 1, near(truth, rng, 0.01, 0.005), [first, second])
        assert link is not None
        turned.append(wrap(link.pose.yaw - truth.yaw))
    assert abs(float(np.mean(turned))) < 0.0015


def test_lidar_alignment_constrains_x_y_and_yaw() -> None:
    rng = np.random.default_rng(1)
    poses = [SE2(0.2, 0.3, 0.1), SE2(1.0, 0.8, 1.2)]
    surfaces = [Surface(seen(WORKSHOP, pose, rng, LIDAR, 360)) for pose in poses]
    truth = poses[0].between(poses[1])
    link = match(0, 1, near(truth, rng), surfaces)
    assert link is not None
    assert (1.0 / np.sqrt(np.diag(link.information)) < (0.006, 0.006, 0.004)).all()
    assert link.pose.distance(truth) < 0.005


def test_station_is_localized_against_all_earlier_stations() -> None:
    rng = np.random.default_rng(2)
    poses = [SE2(0.0, 0.0, 0.0), SE2(0.6, 0.4, 1.2), SE2(0.5, -0.3, 3.0)]
    surfaces = [Surface(seen(WORKSHOP, pose, rng, LIDAR, 360)) for pose in poses]
    truth = SE2(0.1, -0.05, 0.3)
    guess = SE2(truth.x + 0.06, truth.y - 0.05, truth.yaw + 0.06)
    found = localize_station(Surface(seen(WORKSHOP, truth, rng, LIDAR, 360)), guess, poses, surfaces)
    assert found.distance(truth) < 0.01
    assert found.yaw == pytest.approx(truth.yaw, abs=0.005)
    alone = [Surface(seen(WALL, SE2(0.0, 0.0, LEFT), rng))]
    guess = SE2(0.1, 0.04, LEFT + 0.03)
    found = localize_station(
        Surface(seen(WALL, SE2(0.0, 0.0, LEFT), rng)), guess, [SE2(0.0, 0.0, LEFT)], alone
    )
    assert found.y == pytest.approx(0.0, abs=0.01)
    assert found.x == pytest.approx(guess.x, abs=0.03)
