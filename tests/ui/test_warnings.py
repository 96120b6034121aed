"""The warnings on the page: which diagnostics are shown to the operator, and in which order."""

from __future__ import annotations

from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.std_msgs import Header
from chefbot.ui.display.message_conversion import DIAGNOSTICS_AGE_NS, RecentDiagnostics

SECOND = 1_000_000_000


def received(recent: RecentDiagnostics, seconds: int, *statuses: tuple[int, str, str, str]) -> None:
    rows = tuple(DiagnosticStatus(level, name, text, hardware) for level, name, text, hardware in statuses)
    recent.update(DiagnosticArray(Header(), rows), seconds * SECOND)


def test_warnings_keep_their_places_when_they_are_repeated() -> None:
    recent, shown = RecentDiagnostics(), set[tuple[str, ...]]()
    for second in range(6):
        first, then = ("board", "wire") if second % 2 else ("wire", "board")
        for name in (first, then):
            received(recent, second, (WARN, name, f"{name} is late", ""))
        shown.add(recent.warnings(second * SECOND + 1))
    assert shown == {("Board: board is late", "Wire: wire is late")}


def test_two_processes_do_not_end_each_others_warnings() -> None:
    recent = RecentDiagnostics()
    received(recent, 1, (WARN, "wire", "too slow", "/physics"))
    received(recent, 1, (OK, "wire", "nothing", "/main"))
    received(recent, 1, (WARN, "wire", "too slow", "/page"))
    assert recent.warnings(2 * SECOND) == ("Wire: too slow",), "each sentence once"
    received(recent, 2, (OK, "wire", "nothing", "/physics"))
    received(recent, 2, (OK, "wire", "nothing", "/page"))
    assert recent.warnings(2 * SECOND) == ()


def test_a_warning_that_is_not_repeated_ends() -> None:
    recent = RecentDiagnostics()
    received(recent, 1, (WARN, "board", "silent", "port"))
    assert recent.warnings(SECOND + DIAGNOSTICS_AGE_NS - 1) and not recent.warnings(
        SECOND + DIAGNOSTICS_AGE_NS
    )


def test_a_blind_sensor_is_one_warning_whoever_reports_it() -> None:
    recent = RecentDiagnostics()
    received(recent, 1, (WARN, "obstacle sensors", "The lidar is silent", ""))
    received(recent, 1, (WARN, "collision monitor", "The lidar is silent", ""))
    assert recent.warnings(SECOND) == ("Collision monitor: The lidar is silent",)


def test_a_message_without_a_subject_is_shown_of_each_device() -> None:
    recent = RecentDiagnostics()
    received(recent, 1, (WARN, "lidar", "no data", ""), (WARN, "board", "no data", ""))
    assert recent.warnings(SECOND) == ("Board: no data", "Lidar: no data")
