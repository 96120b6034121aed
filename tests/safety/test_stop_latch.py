"""The emergency stop latch: only a release on request releases it, and a restart keeps it."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus
from chefbot.msgs.std_msgs import Header
from chefbot.safety.stop_latch import (
    BOARD_BACK,
    BOARD_LOST,
    ESTOP_RESTORED,
    ESTOP_STATE_UNKNOWN,
    PRESSED,
    PRESSED_BY_TOPIC,
    RELEASED,
    TIPPED_OVER,
    StopDecision,
    StopLatch,
)

EVENTS = st.lists(st.tuples(st.sampled_from(["request", "confirm"]), st.booleans()), max_size=30)


def expected(active: bool, kind: str, pressed: bool) -> bool:
    return pressed or (active and kind == "confirm")


@given(EVENTS)
def test_after_any_events_it_is_active_until_a_requested_release(events: list[tuple[str, bool]]) -> None:
    latch, active = StopLatch(), False
    for now_ns, (kind, pressed) in enumerate(events):
        getattr(latch, kind)(pressed, now_ns)
        active = expected(active, kind, pressed)
        assert latch.active == latch.status.active == active


@given(EVENTS)
def test_each_press_stops_the_base_and_keeps_its_time(events: list[tuple[str, bool]]) -> None:
    latch, pressed_ns = StopLatch(), 0
    for now_ns, (kind, pressed) in enumerate(events, start=1):
        before = latch.active
        decision = getattr(latch, kind)(pressed, now_ns)
        if latch.active and not before:
            pressed_ns = now_ns
        assert latch.status.pressed_at.ns == pressed_ns
        assert (decision is not None and decision.halt) == (latch.active and not before)
        assert decision is None or decision.status is latch.status


@given(EVENTS)
def test_its_own_messages_change_nothing(events: list[tuple[str, bool]]) -> None:
    latch = StopLatch()
    for now_ns, (kind, pressed) in enumerate(events):
        getattr(latch, kind)(pressed, now_ns)
        status = latch.status
        assert latch.confirm(latch.active, now_ns) is None and latch.status is status


def test_a_release_by_another_publisher_is_overridden() -> None:
    latch = StopLatch()
    latch.request(True, 5)
    decision = latch.confirm(False, 7)
    assert decision is not None and decision.status is latch.status
    assert decision.status.active and not decision.halt


@pytest.mark.parametrize(
    ("kind", "pressed", "sentence"),
    [("request", True, PRESSED), ("confirm", True, PRESSED_BY_TOPIC), ("request", False, RELEASED)],
)
def test_the_status_names_the_cause(kind: str, pressed: bool, sentence: str) -> None:
    latch = StopLatch()
    if not pressed:
        latch.request(True, 1)
    decision = getattr(latch, kind)(pressed, 2)
    assert decision.status.description == sentence and decision.status.header.stamp.ns == 2
    assert not decision.notice


@pytest.mark.parametrize("active", [True, False])
def test_a_restored_state_holds(active: bool) -> None:
    latch = StopLatch()
    decision = latch.restore(EmergencyStopStatus(Header(), active, False, Time(3), "before"), 10_000_000_000)
    assert latch.active == active and latch.status.pressed_at.sec == 3
    assert (decision is not None) == active
    if decision is not None:
        assert decision.halt and decision.notice == decision.status.description == ESTOP_RESTORED


def test_an_unknown_state_after_a_restart_counts_as_pressed() -> None:
    decision = StopLatch().restore_unknown(4)
    assert decision.halt and decision.status.active and decision.status.pressed_at.ns == 4
    assert decision.notice == ESTOP_STATE_UNKNOWN


def test_it_is_held_while_the_board_is_lost() -> None:
    latch = StopLatch()
    assert latch.regain_board(1) is None  # at the start
    lost = latch.lose_board(2)
    assert lost is not None and lost.halt and lost.notice == BOARD_LOST and latch.status.pressed_at.ns == 2
    assert latch.lose_board(3) is None
    refused = latch.request(False, 4)
    assert refused is not None and refused.status.active and refused.notice == BOARD_LOST and not refused.halt
    back = latch.regain_board(5)
    assert back is not None and not back.halt and not latch.active and back.notice == BOARD_BACK
    assert latch.regain_board(6) is None


@pytest.mark.parametrize("press", [StopLatch.request, StopLatch.confirm])
def test_a_press_while_it_is_held_counts(press: Callable[[StopLatch, bool, int], object]) -> None:
    latch = StopLatch()
    latch.lose_board(1)
    assert press(latch, True, 2) is not None
    assert latch.regain_board(3) is None and latch.active
    latch.request(False, 4)
    assert not latch.active


def test_a_lost_board_changes_nothing_for_a_pressed_stop() -> None:
    latch = StopLatch()
    latch.request(True, 1)
    assert latch.lose_board(2) is None and latch.regain_board(3) is None and latch.active


def test_a_restored_release_does_not_release_a_new_press() -> None:
    """The state from before a restart may come after somebody has pressed; the press counts."""
    released = EmergencyStopStatus(Header(), False, False, Time(3), "before")
    for stop in (lambda latch: latch.request(True, 7), lambda latch: latch.lose_board(7)):
        latch = StopLatch()
        stop(latch)
        assert latch.restore(released, 9) is None and latch.active and latch.status.pressed_at.ns == 7


# -- a robot that tips over


def test_a_robot_that_tips_over_is_stopped_until_a_release() -> None:
    latch = StopLatch()
    decision = latch.tip_over(5)
    assert decision is not None and decision.halt and decision.notice == TIPPED_OVER
    assert latch.active and not latch.status.held and latch.status.pressed_at.ns == 5
    assert latch.status.description == TIPPED_OVER
    assert latch.tip_over(6) is None and latch.regain_board(7) is None and latch.active
    latch.get_upright()
    assert latch.active
    assert latch.request(False, 8) is not None and not latch.active


def test_a_release_while_it_lies_is_refused() -> None:
    """Also of a stop that was pressed before the fall."""
    for pressed in (False, True):
        latch = StopLatch()
        if pressed:
            latch.request(True, 4)
        latch.tip_over(5)
        before = latch.status
        assert latch.request(False, 6) == StopDecision(before, False, TIPPED_OVER) and latch.active
        latch.get_upright()
        assert latch.request(False, 7) is not None and not latch.active


def test_a_release_of_a_stop_that_is_not_active_has_no_effect() -> None:
    """As when the stop was released before a wrong accusation of the IMU was known."""
    latch = StopLatch()
    assert latch.request(False, 1) is None and not latch.active


def test_a_fall_while_the_board_is_lost_outlasts_it() -> None:
    latch = StopLatch()
    latch.lose_board(1)
    assert latch.tip_over(2) is not None and latch.regain_board(3) is None
    assert latch.active and not latch.status.held
