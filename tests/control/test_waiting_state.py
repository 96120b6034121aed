"""The waiting state: each reason is reported once, and the timeout counts the time since the last motion."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.waiting_state import (
    LOST,
    MAX_POSE_AGE_NS,
    SILENT,
    WAIT_TIMEOUT,
    WaitingState,
    lost_reason,
)
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.std_msgs import Header


def test_localization_is_lost_only_if_there_is_one() -> None:
    assert not lost_reason(None, None, 0) and not lost_reason(LocalizationStatus(Header(), True), None, 0)
    assert lost_reason(LocalizationStatus(Header(), False), None, 0) == LOST


def test_localization_that_sends_no_pose_is_named() -> None:
    now_ns = 100 * MAX_POSE_AGE_NS
    assert not lost_reason(None, now_ns - MAX_POSE_AGE_NS, now_ns)
    assert lost_reason(None, now_ns - MAX_POSE_AGE_NS - 1, now_ns) == SILENT
    assert not lost_reason(None, now_ns + 1, now_ns)  # post-dated


@given(st.lists(st.sampled_from(["", "No scan.", LOST]), max_size=40))
def test_a_notice_comes_with_each_change_and_only_then(reasons: list[str]) -> None:
    waiting, previous = WaitingState(), ""
    for reason in reasons:
        if reason:
            waiting.wait(reason, 0.1)
        else:
            waiting.resume()
        notice = waiting.new_notice()
        assert bool(notice) == (reason != previous)
        assert not notice or reason in notice
        assert not waiting.new_notice() and waiting.reason == reason
        previous = reason


def test_the_timeout_adds_up_over_reasons_and_resuming_resets_it() -> None:
    waiting = WaitingState()
    for _ in range(2):
        assert not waiting.wait("No scan.", WAIT_TIMEOUT / 2)
        assert LOST in waiting.wait(LOST, WAIT_TIMEOUT / 2)
        waiting.resume()
