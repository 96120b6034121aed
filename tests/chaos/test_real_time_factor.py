"""Tests that simulated time does not catch up after the real-time factor was lowered, as it is during a restart."""

from __future__ import annotations

from threading import Condition

import pytest

from chefbot.runtime import clock as module
from chefbot.runtime.clock import LeaderClock

SECOND = 1_000_000_000


class RecordingCondition(Condition):
    """Records the timeouts of `wait` and returns at once."""

    def __init__(self) -> None:
        super().__init__()
        self.timeouts: list[float] = []

    def wait(self, timeout: float | None = None) -> bool:
        assert timeout is not None
        self.timeouts.append(timeout)
        return False


def test_a_changed_real_time_factor_applies_from_now_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "wall_ns", lambda: 5 * SECOND)
    clock, wake = LeaderClock(4.0), RecordingCondition()
    clock.start(0)
    clock.wait_until(8 * SECOND, wake)
    clock.set_real_time_factor(1.0, 6 * SECOND)
    clock.wait_until(8 * SECOND, wake)
    clock.set_real_time_factor(1.0, 7 * SECOND)
    clock.wait_until(8 * SECOND, wake)
    clock.set_real_time_factor(4.0, 7 * SECOND)
    clock.wait_until(8 * SECOND, wake)
    assert wake.timeouts == [2.0, 2.0, 2.0, 0.25]
