"""A piece of a wall that is seen through a door moves as the robot does, and is nobody; a person behind one is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.glass_scans import PERIOD, post, scan_of, wall

from chefbot.maths.se2 import SE2
from chefbot.people.observation import observe_scan
from chefbot.people.params import PeopleTrackerParams
from chefbot.people.segmentation import find_segments
from chefbot.people.tracker import PeopleTracker

Floats = NDArray[np.float64]
DOOR = 0.5
"""Width of the gap in the wall at x = 1, m; the wall behind it is at x = 3."""


def before_door(y: float, behind: Floats) -> Floats:
    """Return the ranges (360,) from (0, y) to the wall with a gap about y = 0, or to what is behind it."""
    pose = SE2(0.0, y, 0.0)
    front = np.minimum(
        wall(pose, 1.0, glass=False, end=-DOOR / 2.0), wall(pose, 1.0, glass=False, start=DOOR / 2.0)
    )
    return np.minimum(front, behind)


@pytest.mark.parametrize("speed", [0.2, 0.5])
def test_a_wall_behind_a_door_is_nobody(speed: float) -> None:
    tracker = PeopleTracker(PeopleTrackerParams())
    for step in range(round(1.6 / (speed * PERIOD))):
        pose = SE2(0.0, 0.8 - speed * PERIOD * step, 0.0)
        ranges = before_door(pose.y, wall(pose, 3.0, glass=False))
        tracker.update(observe_scan(scan_of(pose, ranges, step), pose), step * PERIOD, None)
        assert not tracker.people


def test_somebody_behind_a_door_is_reported() -> None:
    tracker, reported, pose = PeopleTracker(PeopleTrackerParams()), 0, SE2(0.0, 0.0, 0.0)
    for step in range(30):
        y = 0.6 - 0.5 * PERIOD * step
        legs = np.minimum(post(pose, 1.8, y, 0.06), post(pose, 1.8, y + 0.2, 0.06))
        ranges = before_door(0.0, np.minimum(wall(pose, 3.0, glass=False), legs))
        tracker.update(observe_scan(scan_of(pose, ranges, step), pose), step * PERIOD, None)
        reported += bool(tracker.people)
    assert reported > 3


def test_a_gap_hides_both_ends_of_what_is_behind_it() -> None:
    pose = SE2(0.0, 0.0, 0.0)
    scan = scan_of(pose, before_door(0.0, wall(pose, 3.0, glass=False)), 0)
    segments = find_segments(observe_scan(scan, pose))
    ahead = np.abs(np.arctan2(segments.centre[:, 1], segments.centre[:, 0])) < math.radians(10.0)
    assert segments.through_gap[ahead].tolist() == [True] and not segments.through_gap[~ahead].any()
