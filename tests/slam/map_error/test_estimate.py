"""The error of a map is estimated from its scans: small for true poses, and it grows with the real one."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.stats import spearmanr

from chefbot.errors import ScanError
from chefbot.maths.se2 import SE2
from chefbot.slam.map_error.estimate import MapErrorEstimate, estimate_map_error
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import Session

ANGLES = np.linspace(-math.pi, math.pi, 360, endpoint=False).astype(np.float32)
REACH, NOISE = 12.0, 0.01


@pytest.fixture
def seen():
    """Return a function: `seen(world, poses)` gives the session of scans from true poses."""

    def scan_all(world, poses: list[SE2], seed: int = 1) -> Session:
        rng, scans = np.random.default_rng(seed), []
        for k, pose in enumerate(poses):
            ranges = world.ranges(pose, ANGLES, REACH) + NOISE * rng.normal(size=len(ANGLES)).astype(
                np.float32
            )
            scans.append(RecordedScan(0.2 * k, ANGLES, ranges, pose, pose))
        return Session.of(scans, [True] * len(scans), REACH, None)

    return scan_all


@pytest.fixture
def two_laps(ring, drive, seen) -> tuple[list[SE2], Session]:
    """True poses and scans of two laps round the ring, 20 cm apart."""
    poses = drive(2.0, 0.2)
    return poses, seen(ring, poses)


def estimate(session: Session, poses: list[SE2]) -> MapErrorEstimate:
    return estimate_map_error([session], poses, 0.0)


def test_true_poses_have_a_small_error(two_laps) -> None:
    poses, session = two_laps
    found = estimate(session, poses)
    assert found.error < 0.05 and found.worst.error < 0.1
    assert found.compared > 0.95


@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(offset=st.floats(0.1, 0.3), bearing=st.floats(-math.pi, math.pi))
def test_a_second_lap_beside_the_first_contradicts(two_laps, offset: float, bearing: float) -> None:
    poses, session = two_laps
    half, shift = len(poses) // 2, SE2(offset * math.cos(bearing), offset * math.sin(bearing), 0.0)
    found = estimate(session, poses[:half] + [shift @ pose for pose in poses[half:]])
    assert 0.3 * offset < found.contradiction < 1.5 * offset
    assert found.worst.cause == "passes contradict each other"


def test_the_error_ranks_maps_as_their_real_error_does(two_laps) -> None:
    poses, session = two_laps
    real, estimated = [], []
    for seed in range(1, 30, 2):
        rng = np.random.default_rng(seed)
        bent = drifted(poses, float(np.exp(rng.uniform(math.log(0.003), math.log(0.1)))), rng)
        real.append(rms_error(bent, poses))
        estimated.append(estimate(session, bent).error)
    assert spearmanr(real, estimated)[0] > 0.8


def drifted(poses: list[SE2], noise: float, rng: np.random.Generator) -> list[SE2]:
    """Return the poses by odometry whose turns and heading drift."""
    drift, moved = noise * rng.normal(size=2), [poses[0]]
    for before, after in pairwise(poses):
        step = before.between(after)
        moved.append(moved[-1] @ SE2(step.x, step.y, step.yaw * (1.0 + drift[0]) + 0.2 * drift[1] * step.x))
    return moved


def rms_error(poses: list[SE2], truth: list[SE2]) -> float:
    """Return the root mean square error after alignment, m."""
    a, b = (np.array([pose.x + 1j * pose.y for pose in path]) for path in (poses, truth))
    turn = np.vdot(a - a.mean(), b - b.mean())
    return float(np.sqrt(np.mean(np.abs((a - a.mean()) * turn / abs(turn) - (b - b.mean())) ** 2)))


def test_a_bare_corridor_may_drift(corridor, seen, two_laps) -> None:
    poses = [SE2(x, 0.0, 0.0) for x in np.arange(-12.0, 12.0, 0.2).tolist()]
    found = estimate(seen(corridor, poses), poses)
    assert found.drift > 3 * estimate(two_laps[1], two_laps[0]).drift
    assert found.worst.cause == "no loop closure or feature holds it"


@pytest.mark.parametrize("motion", [SE2(3.0, -40.0, 0.0), SE2(0.0, 0.0, 2.0), SE2(-7.0, 1.0, -3.0)])
def test_the_frame_of_the_map_does_not_count(two_laps, motion: SE2) -> None:
    poses, session = two_laps
    here, there = estimate(session, poses), estimate(session, [motion @ pose for pose in poses])
    assert there.drift == pytest.approx(here.drift, rel=0.1)
    assert there.contradiction == pytest.approx(here.contradiction, abs=0.01)


def test_drives_of_one_map_are_compared(ring, drive, seen) -> None:
    first, second = drive(1.0, 0.2), drive(1.0, 0.3)
    sessions = [seen(ring, first), seen(ring, second, seed=2)]
    good = estimate_map_error(sessions, first + second, 0.0)
    beside = estimate_map_error(sessions, first + [SE2(0.2, 0.1, 0.0) @ pose for pose in second], 0.0)
    assert good.error < 0.05 < 0.1 < beside.contradiction


def test_a_correction_of_all_ranges_counts(two_laps) -> None:
    poses, session = two_laps
    assert estimate_map_error([session], poses, 0.3).contradiction > estimate(session, poses).contradiction


def test_a_map_without_motion_is_refused(ring, seen) -> None:
    poses = [SE2(1.4, 1.3, 0.0)] * 5
    with pytest.raises(ScanError, match="has stood, or only turned"):
        estimate(seen(ring, poses), poses)


def test_a_map_of_a_few_returns_is_refused() -> None:
    """As of a robot that sees a bit of one wall, and then nothing."""
    poses, blind = [SE2(1.5 * k, 0.0, 0.0) for k in range(4)], np.full(len(ANGLES), np.inf, np.float32)
    ahead = np.abs(ANGLES) < 0.05
    wall = np.where(ahead, 2.0 / np.cos(ANGLES), np.inf).astype(np.float32)
    scans = [RecordedScan(0.2 * k, ANGLES, blind if k else wall, pose, pose) for k, pose in enumerate(poses)]
    with pytest.raises(ScanError, match="too little of any wall"):
        estimate(Session.of(scans, [True] * len(scans), REACH, None), poses)


def test_poses_whose_scans_were_lost_are_reported(two_laps) -> None:
    poses, session = two_laps
    with pytest.raises(ScanError, match=f"{len(poses)} poses has only {len(poses) - 1} scans"):
        estimate(session.with_used(len(poses) - 1), poses)
