"""Walls at small angles and behind doors, whose visible pieces move as the robot does, are not people."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.glass_scans import ANGLES, PERIOD, post, scan_of, wall

from chefbot.maths.se2 import SE2
from chefbot.people.observation import observe_scan
from chefbot.people.params import PeopleTrackerParams
from chefbot.people.segmentation import find_segments
from chefbot.people.tracker import PeopleTracker

Floats = NDArray[np.float64]
DOOR = 0.3
"""Width of the gap in the wall at x = 1, m; the wall behind it is at x = 1.6."""


def before_door(y: float, behind: Floats) -> Floats:
    """Return the ranges (360,) from (0, y) to the wall with a gap about y = 0, or to what is behind it."""
    pose = SE2(0.0, y, 0.0)
    front = np.minimum(
        wall(pose, 1.0, glass=False, end=-DOOR / 2.0), wall(pose, 1.0, glass=False, start=DOOR / 2.0)
    )
    return np.minimum(front, behind)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("speed", [0.2, 0.35])
def test_walls_of_a_corridor_with_a_door_are_not_people(speed: float, seed: int) -> None:
    """Far away each beam gives a point of its own, which moves along the wall as the robot drives."""
    tracker, rng = PeopleTracker(PeopleTrackerParams()), np.random.default_rng(seed)
    for step in range(round(3.0 / (speed * PERIOD))):
        pose = SE2(0.0, -3.0 + speed * PERIOD * step, math.pi / 2.0)
        sides = [wall(pose, 0.6, glass=False, end=0.0), wall(pose, 0.6, glass=False, start=0.9)]
        sides += [wall(pose, x, glass=False) for x in (-0.7, 2.0)]
        ranges = np.min(sides, axis=0) + rng.normal(0.0, 0.01, len(ANGLES))
        tracker.update(observe_scan(scan_of(pose, ranges, step), pose), step * PERIOD, None)
        assert not tracker.people


def test_somebody_behind_a_door_is_reported() -> None:
    tracker, reported, pose = PeopleTracker(PeopleTrackerParams()), 0, SE2(0.0, 0.0, 0.0)
    for step in range(30):
        y = 0.6 - 0.5 * PERIOD * step
        legs = np.minimum(post(pose, 1.4, y, 0.06), post(pose, 1.4, y + 0.2, 0.06))
        ranges = before_door(0.0, np.minimum(wall(pose, 1.6, glass=False), legs))
        tracker.update(observe_scan(scan_of(pose, ranges, step), pose), step * PERIOD, None)
        reported += bool(tracker.people)
    assert reported > 3


def test_a_gap_hides_both_ends_of_what_is_behind_it() -> None:
    pose = SE2(0.0, 0.0, 0.0)
    scan = scan_of(pose, before_door(0.0, wall(pose, 1.6, glass=False)), 0)
    segments = find_segments(observe_scan(scan, pose))
    ahead = np.abs(np.arctan2(segments.centre[:, 1], segments.centre[:, 0])) < math.radians(10.0)
    assert segments.through_gap[ahead].tolist() == [True] and not segments.through_gap[~ahead].any()
