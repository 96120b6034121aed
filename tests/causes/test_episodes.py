"""Episodes: one report when something begins, changes or ends, however often it is found."""

from __future__ import annotations

from chefbot.causes.episodes import HOLD_NS, MIN_CHANGE_NS, SAME_PLACE_DISTANCE, Episodes
from chefbot.causes.reports import END, SLOW, STOP, MarkedPlace, make_report
from chefbot.msgs.chefbot_msgs import Cause

CYCLE = 50_000_000


def found(kind: str = STOP, check: str = "twists", x: float = 1.0) -> Cause:
    return make_report(kind, check, f"{kind} by {check}.", MarkedPlace("lidar", "odom", x, 0.0, 5))


def kinds(reports: list[Cause]) -> list[str]:
    return [report.kind for report in reports]


def test_what_is_found_in_each_cycle_is_reported_once() -> None:
    episodes = Episodes()
    reports = [episodes.update("motion", found(), cycle * CYCLE) for cycle in range(40)]
    assert [kinds(due) for due in reports if due] == [[STOP]]


def test_single_cycles_without_it_do_not_end_it() -> None:
    episodes = Episodes()
    end = 0
    for cycle in range(40):
        end += len(episodes.update("motion", found() if cycle % 3 else None, cycle * CYCLE))
    assert end == 1
    last = 38 * CYCLE
    assert episodes.update("motion", None, last + HOLD_NS - 1) == []
    (ended,) = episodes.update("motion", None, last + HOLD_NS)
    assert ended.kind == END and ended.check == "twists"
    assert episodes.update("motion", None, last + 2 * HOLD_NS) == []


def test_a_stop_after_a_slow_down_never_waits() -> None:
    episodes = Episodes()
    episodes.update("motion", found(SLOW), 0)
    assert kinds(episodes.update("motion", found(STOP), CYCLE)) == [END, STOP]
    assert episodes.update("motion", found(SLOW), 2 * CYCLE) == []  # back to slow waits
    assert kinds(episodes.update("motion", found(SLOW), CYCLE + MIN_CHANGE_NS)) == [END, SLOW]


def test_another_place_is_another_episode() -> None:
    episodes = Episodes()
    episodes.update("motion", found(x=1.0), 0)
    assert episodes.update("motion", found(x=1.0 + 0.9 * SAME_PLACE_DISTANCE), MIN_CHANGE_NS) == []
    assert kinds(episodes.update("motion", found(x=1.0 + 1.1 * SAME_PLACE_DISTANCE), 2 * MIN_CHANGE_NS)) == [
        END,
        STOP,
    ]


def test_what_has_to_last_is_reported_late_or_never() -> None:
    episodes = Episodes()
    assert episodes.update("motion", found(SLOW), 0, 500) == []
    assert episodes.update("motion", None, 400) == []
    assert episodes.update("motion", found(SLOW), 450, 500) == []
    assert kinds(episodes.update("motion", found(SLOW), 950, 500)) == [SLOW]


def test_subjects_do_not_disturb_each_other() -> None:
    episodes = Episodes()
    assert kinds(episodes.update("motion", found(), 0)) == [STOP]
    assert kinds(episodes.update("path", found(SLOW, "path"), 0)) == [SLOW]
    assert sorted(report.check for report in episodes.end_all()) == ["path", "twists"]
    assert episodes.end_all() == []
