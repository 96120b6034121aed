"""The watch over localization: no drive of more than 0.5 m on a pose that nobody confirms."""

from __future__ import annotations

import pytest

from chefbot.control.localization_watch import MAX_UNCONFIRMED_DISTANCE, SILENT, LocalizationWatch
from chefbot.control.waiting_state import LOST, MAX_POSE_AGE_NS
from chefbot.control.waiting_state import SILENT as NOTHING_SENT
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.std_msgs import Header


def status(localized: bool) -> LocalizationStatus:
    return LocalizationStatus(Header(), localized)


def at(x: float) -> SE2:
    return SE2(x, 0.0, 0.0)


def test_without_localization_there_is_nothing_to_lose() -> None:
    watch = LocalizationWatch()
    assert not any(watch.reason(None, at(0.3 * i), None, 0) for i in range(10))


def test_a_lost_robot_stands_at_once() -> None:
    watch = LocalizationWatch()
    assert watch.reason(status(False), at(0.0), None, 0) == LOST
    assert not watch.reason(status(True), at(0.0), None, 0)


@pytest.mark.parametrize("step", [0.02, 0.1])
def test_a_silent_localization_stops_the_robot(step: float) -> None:
    watch, fine = LocalizationWatch(), status(True)
    distances = [i * step for i in range(100)]
    stops = next(x for x in distances if watch.reason(fine, at(x), None, 0))
    assert MAX_UNCONFIRMED_DISTANCE < stops <= MAX_UNCONFIRMED_DISTANCE + 2.0 * step
    assert watch.reason(fine, at(stops), None, 0) == SILENT.format(MAX_UNCONFIRMED_DISTANCE)
    assert not watch.reason(status(True), at(stops), None, 0)


def test_updates_along_the_path_keep_the_robot_driving() -> None:
    watch, last = LocalizationWatch(), status(True)
    for i in range(100):
        last = status(True) if i % 5 == 0 else last
        assert not watch.reason(last, at(0.05 * i), None, 0)


def test_standing_and_turning_need_no_updates() -> None:
    watch, fine = LocalizationWatch(), status(True)
    assert not any(watch.reason(fine, SE2(1.0, 2.0, 0.1 * i), None, 0) for i in range(1000))


def test_a_drive_by_teleoperation_does_not_count_afterwards() -> None:
    watch = LocalizationWatch()
    watch.reason(status(True), at(0.0), None, 0)
    assert not watch.reason(status(True), at(5.0), None, 0)


def test_a_localization_whose_transform_is_old_stops_the_robot() -> None:
    watch = LocalizationWatch()
    assert not watch.reason(None, at(0.0), 1, 1 + MAX_POSE_AGE_NS)
    assert watch.reason(None, at(0.0), 1, 2 + MAX_POSE_AGE_NS) == NOTHING_SENT
    assert watch.reason(status(True), at(0.0), 1, 2 + MAX_POSE_AGE_NS) == NOTHING_SENT
