"""Causes over time: durations, and the one that holds now."""

from __future__ import annotations

import msgspec
import numpy as np

from chefbot.causes.history import CauseHistory, distinct_spans
from chefbot.causes.reports import DETOUR, END, FAILURE, SLOW, STOP
from chefbot.msgs.chefbot_msgs import Cause, PresentCauses
from chefbot.msgs.std_msgs import Header


def cause(number: int, kind: str, seconds: int) -> Cause:
    return Cause(Header.of(seconds * 1_000_000_000, "map"), number, kind, sentence=f"{kind} {number}")


def test_the_newest_of_the_severest_active_causes_is_present() -> None:
    history = CauseHistory([cause(1, DETOUR, 1), cause(2, STOP, 2), cause(3, SLOW, 3), cause(4, STOP, 4)])
    assert history.sentence == "stop 4"
    history.process(cause(4, END, 5))
    assert history.sentence == "stop 2"
    history.process(cause(2, END, 6))
    assert history.sentence == "detour 1"
    history.process(cause(5, FAILURE, 7))
    assert history.sentence == "detour 1"  # a failure does not last
    assert [span.duration for span in history.spans] == [None, 4.0, None, 1.0, 0.0]


def test_a_lost_end_follows_from_the_list_of_those_that_hold() -> None:
    history = CauseHistory([cause(1, DETOUR, 1), cause(2, STOP, 2), cause(3, SLOW, 9)])

    def process(ids: list[int], seconds: int) -> None:
        header = Header.of(seconds * 1_000_000_000, "")
        for end in history.lost_ends(PresentCauses(header, ids=np.array(ids, np.uint32))):
            history.process(end)

    process([1, 2], 10)  # the list may be older than the newest cause
    assert history.sentence == "stop 2"
    process([1], 11)
    assert history.sentence == "detour 1"
    assert [span.duration for span in history.spans] == [None, 9.0, None]
    process([], 20)
    assert history.present is None


def test_nothing_is_present_in_the_beginning() -> None:
    assert CauseHistory().present is None and CauseHistory().sentence == ""
    assert CauseHistory([cause(9, END, 1)]).spans == []


def test_causes_of_a_restarted_robot_are_added() -> None:
    history = CauseHistory([cause(1, STOP, 1), cause(2, SLOW, 2), cause(2, END, 3)], size=4)
    for again in (cause(1, DETOUR, 10), cause(2, STOP, 11), cause(1, END, 12)):
        history.process(again)
    assert [span.cause.sentence for span in history.spans] == ["stop 1", "slow 2", "detour 1", "stop 2"]
    assert [span.duration for span in history.spans] == [9.0, 1.0, 2.0, None]
    history.process(cause(3, SLOW, 13))
    assert [span.cause.id for span in history.spans] == [2, 1, 2, 3]


def test_the_oldest_go_first() -> None:
    history = CauseHistory((cause(number, STOP, number) for number in range(1, 30)), size=5)
    assert [span.cause.id for span in history.spans] == [25, 26, 27, 28, 29]


def test_one_cause_of_two_nodes_is_one_span() -> None:
    slow, stop, later = cause(1, SLOW, 1), cause(2, STOP, 1), cause(3, SLOW, 9)
    reports = [msgspec.structs.replace(one, sentence="The lidar is blind.") for one in (slow, stop, later)]
    history = CauseHistory([*reports, cause(1, END, 3), cause(2, END, 4)])
    assert [span.cause.id for span in distinct_spans(history.spans)] == [2, 3]


def test_different_sentences_stay_apart() -> None:
    history = CauseHistory([cause(1, SLOW, 1), cause(2, STOP, 1)])
    assert distinct_spans(history.spans) == history.spans
