"""The report of a blocked path: its place is an obstacle or a standing person, not somebody who walks."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.causes.blocked_path import BLOCKED, blocked_path_report
from chefbot.causes.reports import STOP
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import Cause, FindBlockage_Result, Quantity
from chefbot.msgs.geometry_msgs import Point


def report(people: tuple[int, ...], stood: float, sensor: str = "lidar") -> Cause:
    found = FindBlockage_Result(
        blocked=True,
        people=np.array(people, np.uint32),
        point=Point(2.0, 1.0),
        sensor=sensor,
        marked_at=Time.of(5),
    )
    return blocked_path_report(STOP, BLOCKED, "Waiting.", (Quantity("stood", stood, "s"),), found)


@pytest.mark.parametrize(
    ("people", "stood", "located"), [((), 0.0, True), ((3,), 4.0, True), ((3,), 0.0, False)]
)
def test_the_place_is_what_stays_there(people: tuple[int, ...], stood: float, located: bool) -> None:
    assert report(people, stood).located == located


def test_a_located_report_has_cell_sensor_and_time_of_the_mark() -> None:
    found = report((3,), 4.0)
    assert (found.point.x, found.point.y, found.header.frame_id) == (2.0, 1.0, "map")
    assert found.sensor == "lidar" and found.marked_at.ns == 5
    assert (found.kind, found.check, found.numbers[0].value) == (STOP, BLOCKED, 4.0)


def test_a_path_without_a_mark_has_no_place() -> None:
    assert not report((), 0.0, sensor="").located
