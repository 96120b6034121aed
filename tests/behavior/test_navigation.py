"""The navigator's decisions: recoveries, relocalization, feedback and status."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.behavior.navigation_progress import FEEDBACK_PERIOD_NS, NavigationProgress, NavigationState
from chefbot.behavior.relocalization import (
    LOCALIZED_UPDATES_REQUIRED,
    MAX_SPIN_STEPS,
    LocalizationMonitor,
    Relocalization,
    RelocalizationStep,
)
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import FollowPath_Feedback, Spin_Result
from chefbot.msgs.std_msgs import Header

SPIN, YIELD = RelocalizationStep.SPIN, RelocalizationStep.YIELD
STUCK = 105


def update(monitor: LocalizationMonitor, localized: bool) -> None:
    monitor.process(LocalizationStatus(Header(), localized))


@given(st.lists(st.booleans(), max_size=20))
def test_localization_has_settled_after_consecutive_updates(updates: list[bool]) -> None:
    monitor = LocalizationMonitor()
    assert not monitor.is_lost and not monitor.has_settled
    for localized in updates:
        update(monitor, localized)
    required = LOCALIZED_UPDATES_REQUIRED
    assert monitor.has_settled == (updates[-required:] == [True] * required)
    assert monitor.is_lost == (bool(updates) and not updates[-1])


@given(st.lists(st.booleans(), min_size=MAX_SPIN_STEPS, max_size=MAX_SPIN_STEPS))
def test_a_lost_robot_gives_up_after_all_steps(preempted: list[bool]) -> None:
    relocalization, step = Relocalization(LocalizationMonitor()), SPIN
    for yields in preempted:
        assert step is SPIN and not relocalization.failure_reason
        step = relocalization.after_spin(None if yields else Spin_Result())
        if yields:
            assert step is YIELD
            step = relocalization.after_yield()
    assert step is RelocalizationStep.FAILED and "3 turns" in relocalization.failure_reason


def test_a_failed_rotation_fails_unless_the_robot_is_localized() -> None:
    failed = Spin_Result(Duration(), 701, "It took too long.")
    monitor = LocalizationMonitor()
    relocalization = Relocalization(monitor)
    assert relocalization.after_spin(failed) is RelocalizationStep.FAILED
    assert relocalization.failure_reason == "It took too long."
    for _ in range(LOCALIZED_UPDATES_REQUIRED):
        update(monitor, True)
    for result in (failed, None, Spin_Result()):
        relocalization = Relocalization(monitor)
        assert (
            relocalization.after_spin(result) is RelocalizationStep.LOCALIZED
            and not relocalization.failure_reason
        )


def test_a_blocked_rotation_goes_the_other_way_then_waits() -> None:
    blocked, relocalization = (
        Spin_Result(Duration(), 703, "Something is in the way."),
        Relocalization(LocalizationMonitor()),
    )
    assert relocalization.goal.target_yaw > 0.0
    assert relocalization.after_spin(blocked) is SPIN and relocalization.goal.target_yaw < 0.0
    assert relocalization.after_spin(blocked) is YIELD and not relocalization.failure_reason
    assert relocalization.after_yield() is SPIN
    assert relocalization.after_spin(Spin_Result()) is SPIN and relocalization.goal.target_yaw > 0.0


@given(st.lists(st.integers(1, FEEDBACK_PERIOD_NS), min_size=1, max_size=30))
def test_feedback_is_never_closer_than_its_period(pauses: list[int]) -> None:
    progress, now_ns, published = NavigationProgress(), 10 * FEEDBACK_PERIOD_NS, []
    progress.restart(now_ns)
    for pause in pauses:
        now_ns += pause
        if progress.process(FollowPath_Feedback(3.0, 0.0), now_ns):
            published.append(now_ns)
            progress.feedback(now_ns, PoseStamped(), 0)
    assert all(after - before >= FEEDBACK_PERIOD_NS for before, after in pairwise(published))


@pytest.mark.parametrize(("speed", "remaining"), [(0.5, 4.0), (0.0, 0.0)])
def test_feedback_estimates_the_rest_of_the_path(speed: float, remaining: float) -> None:
    progress = NavigationProgress()
    progress.restart(1_000_000_000)
    progress.process(FollowPath_Feedback(2.0, speed), 3_000_000_000)
    feedback = progress.feedback(3_000_000_000, PoseStamped(), 2)
    assert (feedback.distance_remaining, feedback.number_of_recoveries) == (2.0, 2)
    assert (feedback.estimated_time_remaining.seconds, feedback.navigation_time.seconds) == (remaining, 2.0)


@pytest.mark.parametrize(
    ("state", "published"), [("driving", "waiting"), ("recovering", "waiting"), ("idle", "idle")]
)
def test_a_waiting_controller_is_shown_during_navigation(state: str, published: str) -> None:
    navigation = NavigationState()
    navigation.state, navigation.reason = state, "Reason."
    message = navigation.message(5, 1, "No scan.", "Stopped: a box.")
    assert message.state == published and (message.reason == "No scan.") == (published == "waiting")
    assert navigation.message(5, 1, "", "").state == state
    navigation.reason = ""
    assert navigation.message(5, 1, "", "Stopped: a box.").reason == (
        "" if state == "idle" else "Stopped: a box."
    )
