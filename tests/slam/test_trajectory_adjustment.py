"""The joint adjustment of a mapper's trajectory after the drive: poses, map, and the odometry that it relies on."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from chefbot.errors import ScanError
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.params import GmappingParams
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import Session
from chefbot.slam.trajectory_adjustment import adjusted_map

LIDAR = np.linspace(-math.pi, math.pi, 180, endpoint=False).astype(np.float32)
CAMERA = np.linspace(-0.5, 0.5, 90).astype(np.float32)
PARAMS = GmappingParams()


@pytest.fixture
def session_of(ring):
    """Return a function: a drive with scans of the ring from `truth`, each of which is used, and odometry."""

    def session(truth, odometry, angles=LIDAR, start: SE2 | None = None, error: float = 0.0) -> Session:
        scans = [
            RecordedScan(0.1 * k, angles, ring.ranges(pose, angles, 20.0) + np.float32(error), odom, odom)
            for k, (pose, odom) in enumerate(zip(truth, odometry, strict=True))
        ]
        return Session.of(scans, [True] * len(scans), 20.0, start)

    return session


def bent(truth: list[SE2], turn: float) -> list[SE2]:
    """Return the trajectory of a mapper that turns too far by `turn` rad per metre; the first pose is right."""
    poses = truth[:1]
    for a, b in itertools.pairwise(truth):
        step = a.between(b)
        poses.append(poses[-1] @ SE2(step.x, step.y, step.yaw + turn * math.hypot(step.x, step.y)))
    return poses


def worst(found: list[SE2], truth: list[SE2]) -> float:
    return max(a.distance(b) for a, b in zip(found, truth, strict=True))


@pytest.mark.parametrize("angles", [LIDAR, CAMERA], ids=["lidar", "camera"])
def test_a_bent_trajectory_becomes_straight(session_of, drive, odometry, angles) -> None:
    truth = drive(1.1)[::3]
    drive_of = session_of(truth, odometry(truth, 3, 0.01, 0.01), angles)
    start = bent(truth, 0.005)
    result = adjusted_map([drive_of], start, PARAMS)
    assert worst(start, truth) > 0.5 and worst(result.poses, truth) < 0.12
    assert result.poses[0] == pytest.approx(start[0]), "the frame of the map stays"


def test_a_systematic_error_of_odometry_shortens_no_corridor(corridor) -> None:
    """As that of a robot whose wheels are smaller than its file states, and unequal: the mapper's poses show it."""
    truth = [SE2(0.4 * k, 0.1, 0.0) for k in range(50)]
    odom = [SE2(0.0, 0.1, 0.0)]
    for a, b in itertools.pairwise(truth):
        odom.append(odom[-1] @ SE2(1.1 * a.distance(b), 0.0, 0.01))
    scans = [
        RecordedScan(0.1 * k, LIDAR, corridor.ranges(pose, LIDAR, 20.0), one, one)
        for k, (pose, one) in enumerate(zip(truth, odom, strict=True))
    ]
    drive = Session.of(scans, [True] * len(scans), 20.0, None)
    assert worst(adjusted_map([drive], truth, PARAMS).poses, truth) < 0.2
    again = Session.of(scans, [True] * len(scans), 20.0, truth[0])
    both = adjusted_map([drive, again], [*truth, *truth], PARAMS).poses
    assert worst(both, [*truth, *truth]) < 0.2, "the way from one drive to the other is none of odometry"


def test_a_robot_that_only_turns_shows_no_error_of_distances(session_of) -> None:
    truth = [SE2(1.4, 1.3, 0.3 * k) for k in range(20)]
    assert worst(adjusted_map([session_of(truth, truth)], truth, PARAMS).poses, truth) < 0.02


def test_walls_are_drawn_once(session_of, drive, odometry) -> None:
    truth = drive(1.1)[::3]
    drive_of, start = session_of(truth, odometry(truth, 3, 0.01, 0.01)), bent(truth, 0.01)
    expected = adjusted_map([drive_of], truth, PARAMS).grid
    occupied = int((adjusted_map([drive_of], start, PARAMS).grid.cells > 50).sum())
    assert occupied == pytest.approx(int((expected.cells > 50).sum()), rel=0.1)


def test_only_a_wide_view_shows_the_offset_of_ranges(session_of, drive) -> None:
    truth = drive(1.1)[::3]
    offsets = [
        adjusted_map([session_of(truth, truth, angles, error=0.05)], truth, PARAMS).range_offset
        for angles in (LIDAR, CAMERA)
    ]
    assert offsets[0] == pytest.approx(-0.05, abs=0.01) and offsets[1] == 0.0


def test_another_drive_is_registered_with_the_first(session_of, drive) -> None:
    truth = drive(1.1)[::3]
    first = session_of(truth, truth)
    moved = [IDENTITY @ SE2(3.0, 1.0, 1.0) @ pose for pose in truth]  # another odom frame
    second = session_of(truth, moved, start=truth[0])
    start = [*truth, *(SE2(0.08, -0.06, 0.02) @ pose for pose in truth)]
    assert worst(adjusted_map([first, second], start, PARAMS).poses, [*truth, *truth]) < 0.04


def test_poses_and_scans_must_fit(session_of, drive) -> None:
    truth = drive(0.5)[::3]
    for poses in (truth[:-1], []):
        with pytest.raises(ScanError, match="poses"):
            adjusted_map([session_of(truth, truth)], poses, PARAMS)


def test_returns_that_mark_no_cell_are_registered(session_of, drive, odometry) -> None:
    """As those of a depth camera, whose noise grows with the range."""
    truth = drive(1.1)[::3]
    drive_of, start = session_of(truth, odometry(truth, 3, 0.01, 0.01), CAMERA), bent(truth, 0.005)
    far, near = (adjusted_map([drive_of], start, GmappingParams(max_range=limit)) for limit in (80.0, 2.0))
    assert far.poses == near.poses and (near.grid.cells > 50).sum() < (far.grid.cells > 50).sum()
    unmatched = adjusted_map([drive_of], start, GmappingParams(max_range=2.0, match_range=2.0))
    assert unmatched.poses != near.poses


def test_exact_odometry_outweighs_noisy_ranges(ring, drive, odometry) -> None:
    """As that of a gyro, beside a depth camera: the poses of four drives, on average."""
    truth, errors = drive(1.1)[::3], list[float]()
    for seed in range(4):
        rng, odom = np.random.default_rng(seed), odometry(truth, seed, 0.0005, 0.0005)
        scans = []
        for k, (pose, one) in enumerate(zip(truth, odom, strict=True)):
            ranges = ring.ranges(pose, CAMERA, 20.0) + rng.normal(0.0, 0.05, len(CAMERA))
            scans.append(RecordedScan(0.1 * k, CAMERA, ranges.astype(np.float32), one, one))
        drive_of = Session.of(scans, [True] * len(scans), 20.0, None)
        errors.append(worst(adjusted_map([drive_of], bent(truth, 0.002), PARAMS).poses, truth))
    assert np.mean(errors) < 0.08


def test_a_single_scan_stays(session_of) -> None:
    pose = SE2(1.4, 1.3, 0.0)
    result = adjusted_map([session_of([pose], [pose])], [pose], PARAMS)
    assert result.poses == [pose] and result.grid.at(1.4, 1.3) < 25
