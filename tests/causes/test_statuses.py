"""Causes in the statuses of nodes: begun once, ended once."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import pytest

from chefbot.causes.reports import DETOUR, END, FAILURE, STOP
from chefbot.causes.statuses import CANCELLED, StatusReports
from chefbot.delivery.status_messages import left_out, not_served, not_taken
from chefbot.msgs.chefbot_msgs import (
    BatteryStatus,
    Cause,
    DeliveryStatus,
    EmergencyStopStatus,
    NavigationStatus,
)
from chefbot.safety.stop_latch import ESTOP_RESTORED, ESTOP_STATE_UNKNOWN, PRESSED, PRESSED_BY_TOPIC


def facts(reports: list[Cause]) -> list[tuple[str, str, str]]:
    return [(report.kind, report.node, report.check) for report in reports]


def navigation(reports: StatusReports, *statuses: tuple[str, int, str]) -> list[list[tuple[str, str, str]]]:
    return [
        facts(reports.navigation(NavigationStatus(state=state, recoveries=count, reason=reason), 1))
        for state, count, reason in statuses
    ]


def test_each_recovery_begins_and_ends_once() -> None:
    recovery, end = (STOP, "navigator", "recovery"), (END, "navigator", "recovery")
    assert navigation(
        StatusReports(),
        ("idle", 0, ""),
        ("driving", 0, ""),
        ("recovering", 1, "No collision-free command."),
        ("recovering", 1, "No collision-free command."),
        ("recovering", 2, "No collision-free command."),
        ("waiting", 2, "The lidar sends nothing."),
        ("driving", 2, ""),
        ("idle", 2, ""),
    ) == [[], [], [recovery], [], [end, recovery], [], [end], []]


def test_an_aborted_goal_is_a_failure_but_a_cancelled_one_is_not() -> None:
    statuses = StatusReports()
    aborted = navigation(statuses, ("driving", 0, ""), ("idle", 8, "No path."), ("idle", 8, "No path."))
    assert aborted == [[], [(FAILURE, "navigator", "goal aborted")], []]
    cancelled = navigation(statuses, ("driving", 0, ""), ("idle", 0, CANCELLED), ("driving", 0, ""))
    at_once = [(STOP, "navigator", "cancelled goal"), (END, "navigator", "cancelled goal")]
    assert cancelled[1:] == [at_once, []]


def test_a_goal_that_the_explorer_cancels_is_no_cause() -> None:
    statuses = StatusReports()
    statuses.exploring = True
    assert navigation(statuses, ("driving", 0, ""), ("idle", 0, CANCELLED)) == [[], []]
    aborted = navigation(statuses, ("driving", 0, ""), ("idle", 0, "No path."))
    assert aborted == [[], [(FAILURE, "navigator", "goal aborted")]]
    statuses.exploring = False
    assert navigation(statuses, ("driving", 0, ""), ("idle", 0, CANCELLED))[1]


def test_lost_localization_is_its_own_root() -> None:
    (report,) = navigation(StatusReports(), ("recovering", 0, "Localization lost; rotating."))[0]
    assert report == (STOP, "navigator", "localization")


def test_the_emergency_stop_begins_and_ends() -> None:
    statuses = StatusReports()
    active = EmergencyStopStatus(active=True, description="Pressed in the web UI.")
    (begun,) = statuses.emergency_stop(active, 5)
    assert begun.sentence == "Emergency stop: pressed in the web UI." and begun.header.stamp.ns == 5
    assert statuses.emergency_stop(active, 6) == []
    assert facts(statuses.emergency_stop(EmergencyStopStatus(), 7)) == [(END, "base", "emergency stop")]
    assert statuses.emergency_stop(EmergencyStopStatus(), 8) == []


@pytest.mark.parametrize("description", [PRESSED, PRESSED_BY_TOPIC, ESTOP_RESTORED, ESTOP_STATE_UNKNOWN])
def test_a_stop_that_names_itself_is_not_named_twice(description: str) -> None:
    active = EmergencyStopStatus(active=True, description=description)
    (begun,) = StatusReports().emergency_stop(active, 5)
    assert begun.sentence == description


def test_why_a_goal_was_aborted_continues_the_sentence() -> None:
    statuses = StatusReports()
    statuses.navigation(NavigationStatus(state="driving"), 1)
    (aborted,) = statuses.navigation(NavigationStatus(state="idle", reason="The goal lies outside."), 2)
    assert aborted.sentence == "The goal was aborted: the goal lies outside."


def test_a_battery_that_sends_the_robot_home_is_reported_once() -> None:
    statuses = StatusReports()
    levels = [("ok", 0.5), ("return", 0.2), ("return", 0.19), ("park", 0.1), ("ok", 0.9)]
    reports = [
        facts(statuses.battery(BatteryStatus(level=name, charge=charge), 1)) for name, charge in levels
    ]
    check = ("battery", "battery charge")
    assert reports == [[], [(DETOUR, *check)], [], [(END, *check), (STOP, *check)], [(END, *check)]]


def test_each_place_that_is_skipped_is_a_failure() -> None:
    statuses = StatusReports()
    one = DeliveryStatus(state="driving", skipped_reasons=("table 3: no path.",))
    (skipped,) = statuses.delivery(one, 1)
    assert (skipped.kind, skipped.sentence) == (FAILURE, "table 3: no path.")
    assert statuses.delivery(one, 2) == []
    failed = DeliveryStatus(
        state="failed", skipped_reasons=("table 3: no path.",), description="No path home."
    )
    assert facts(statuses.delivery(failed, 3)) == [(FAILURE, "delivery", "delivery")]
    statuses.delivery(one, 4)
    known = msgspec.structs.replace(failed, description="table 3: no path.")
    assert statuses.delivery(known, 5) == [], "it was reported when it happened"
    assert statuses.delivery(DeliveryStatus(state="loading"), 4) == []  # a new round has none yet


@pytest.mark.parametrize("by_person", [left_out, not_taken, not_served])
def test_what_persons_decide_is_no_failure_of_the_robot(by_person: Callable[[str], str]) -> None:
    statuses = StatusReports()
    reasons = (by_person("table_3"),)
    assert statuses.delivery(DeliveryStatus(state="driving", skipped_reasons=reasons), 1) == []
    ended = DeliveryStatus(state="failed", skipped_reasons=reasons, description=reasons[0])
    assert statuses.delivery(ended, 2) == []


def test_a_lost_process_stops_the_robot_until_it_is_back() -> None:
    statuses = StatusReports()
    assert facts(statuses.lost_process("slam", 1)) == [(STOP, "supervisor", "heartbeat")]
    assert facts(statuses.lost_process("", 2)) == [(END, "supervisor", "heartbeat")]
    assert statuses.lost_process("", 3) == []
