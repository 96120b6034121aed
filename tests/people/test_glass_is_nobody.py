"""What glass returns of a scan moves along with the robot, and is taken for nobody."""

from __future__ import annotations

import math

import pytest
from tests.support.glass_scans import PERIOD, drive, post, scan_of, wall

from chefbot.costmap.glass_detection import GlassDetector
from chefbot.people.observation import observe_scan
from chefbot.people.params import PeopleTrackerParams
from chefbot.people.tracker import PeopleTracker


def scans_with_people(what: str, *, filtered: bool) -> int:
    """Return after how many scans of a drive, from its second second on, somebody is reported."""
    tracker, detector, reported = PeopleTracker(PeopleTrackerParams()), GlassDetector(), 0
    for step, pose in enumerate(drive(0.3, 2.4)):
        glass = wall(pose, 0.8, glass=True)
        walker = post(pose, 1.5, 0.8 * PERIOD * step - 0.5, 0.12)
        scan = scan_of(pose, glass if what == "glass" else walker, step)
        seen = detector.without_glass(pose, scan, math.inf) if filtered else scan
        tracker.update(observe_scan(seen, pose), step * PERIOD, None)
        reported += bool(tracker.people) and step * PERIOD >= 2.0
    return reported


def test_without_the_filter_glass_is_somebody() -> None:
    assert scans_with_people("glass", filtered=False)


def test_glass_is_nobody() -> None:
    assert scans_with_people("glass", filtered=True) == 0


@pytest.mark.parametrize("filtered", [False, True])
def test_somebody_who_walks_is_reported(filtered: bool) -> None:
    assert scans_with_people("walker", filtered=filtered) > 20
