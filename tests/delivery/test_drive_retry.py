"""Retries of a drive: how long for which error, and which results are final."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.delivery.drive_retry import (
    BLOCKED_PATH_TIMEOUT,
    BLOCKED_RETRY_PERIOD,
    LOST_RETRY_PERIOD,
    LOST_TIMEOUT,
    NAVIGATOR_TIMEOUT,
    NO_NAVIGATOR,
    NO_VALID_PATH,
    RETRY_PERIOD,
    DriveRetry,
)

SECOND = 1_000_000_000


def attempts(code: int, duration: float, *, required: bool) -> tuple[int, float]:
    """Return the number of attempts of one drive that always fails after `duration`, and the time of all, s."""
    retry, now_ns, count = DriveRetry(), 0, 0
    while True:
        count += 1
        start_ns, now_ns = now_ns, now_ns + round(duration * SECOND)
        pause = retry.pause(code, start_ns, now_ns, required=required)
        if pause is None:
            return count, now_ns / SECOND
        now_ns += round(pause * SECOND)


@given(st.sampled_from([0, 105, 204, 206]), st.booleans(), st.floats(0.0, 100.0))
def test_success_and_other_errors_are_final(code: int, required: bool, duration: float) -> None:
    assert attempts(code, duration, required=required) == (1, pytest.approx(duration, abs=1e-6))


def test_a_blocked_table_is_skipped_a_blocked_kitchen_retried() -> None:
    assert attempts(NO_VALID_PATH, 1.0, required=False)[0] == 1
    count, seconds = attempts(NO_VALID_PATH, 1.0, required=True)
    assert count == pytest.approx(BLOCKED_PATH_TIMEOUT / (BLOCKED_RETRY_PERIOD + 1.0), abs=2)
    assert BLOCKED_PATH_TIMEOUT <= seconds <= BLOCKED_PATH_TIMEOUT + BLOCKED_RETRY_PERIOD + 2.0


@given(st.booleans(), st.floats(0.0, 5.0))
def test_a_missing_navigator_is_awaited_for_its_timeout(required: bool, duration: float) -> None:
    _, seconds = attempts(NO_NAVIGATOR, duration, required=required)
    assert NAVIGATOR_TIMEOUT <= seconds <= NAVIGATOR_TIMEOUT + RETRY_PERIOD + 2.0 * duration + 1e-6


def test_a_lost_robot_keeps_its_place_until_it_is_localized() -> None:
    retry = DriveRetry()
    assert retry.pause(104, 0, SECOND, required=False, lost=True) == LOST_RETRY_PERIOD
    assert retry.pause(0, SECOND, 9 * SECOND, required=False, lost=True) is None, "the place was reached"
    assert retry.pause(104, 0, round((LOST_TIMEOUT + 2.0) * SECOND), required=False, lost=True) is None
    assert DriveRetry().pause(104, 0, SECOND, required=False) is None


def test_a_navigator_failure_after_a_long_drive_restarts_timeout() -> None:
    retry = DriveRetry()
    assert retry.pause(NO_NAVIGATOR, 0, SECOND, required=False) == RETRY_PERIOD
    end_ns = round((NAVIGATOR_TIMEOUT + 10.0) * SECOND)
    assert retry.pause(NO_NAVIGATOR, 2 * SECOND, end_ns, required=False) == RETRY_PERIOD
    assert retry.pause(NO_NAVIGATOR, end_ns, end_ns + SECOND, required=False) == RETRY_PERIOD
