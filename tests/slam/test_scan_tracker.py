"""The pose of a turning sensor by its own scans, where odometry drifts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.scan_tracker import ScanTracker

BEAMS = np.linspace(-math.pi, math.pi, 720, endpoint=False).astype(np.float32)
TURNS = [math.radians(3.7 * step) for step in range(98)]
"""A full turn on the spot, in steps of no whole number of beams."""
START = SE2(1.2, 1.2, 0.0)


def tracked(ring, drift: float, first: SE2 = IDENTITY) -> list[SE2]:  # type: ignore[no-untyped-def]
    """Poses during the turn; odometry measures `drift` too much of each radian."""
    tracker, poses, rng = ScanTracker(8.0), [], np.random.default_rng(3)
    for turn in TURNS:
        ranges = ring.ranges(START @ SE2(0.0, 0.0, turn), BEAMS, 8.0)
        ranges = (ranges + rng.normal(0.0, 0.01, len(BEAMS))).astype(np.float32)
        poses.append(tracker.add(BEAMS, ranges, first @ SE2(0.0, 0.0, (1.0 + drift) * turn), 8.0))
    return poses


@pytest.mark.parametrize(("drift", "bound_deg"), [(0.0, 0.6), (0.05, 4.0), (-0.05, 4.0)])
def test_the_scans_correct_the_odometry(ring, drift: float, bound_deg: float) -> None:  # type: ignore[no-untyped-def]
    """Odometry with that drift ends 18 degrees off."""
    for turn, pose in zip(TURNS, tracked(ring, drift), strict=True):
        assert math.hypot(pose.x, pose.y) < 0.06, "about a cell of the map"
        assert abs(wrap(pose.yaw - turn)) < math.radians(bound_deg)


def test_poses_begin_at_the_first_scan_wherever_odometry_does(ring) -> None:  # type: ignore[no-untyped-def]
    first, *rest = tracked(ring, 0.0, SE2(3.0, -4.0, 2.0))
    assert tuple(first) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert tuple(rest[19]) == pytest.approx((0.0, 0.0, TURNS[20]), abs=0.02)


def test_the_same_scans_give_the_same_poses(ring) -> None:  # type: ignore[no-untyped-def]
    assert np.array_equal(np.array(tracked(ring, 0.05)), np.array(tracked(ring, 0.05)))
