"""Clocks for wall time, simulated time and log time, in integer nanoseconds; only the loop reads them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from threading import Condition
from typing import Protocol


def wall_ns() -> int:
    """Return the monotonic clock in nanoseconds, for measuring durations and for pacing."""
    return time.monotonic_ns()


class LoopClock(Protocol):
    """Decides when the loop may run its next event."""

    def start(self, now_ns: int) -> None:
        """Prepare the clock for a loop that is about to run from `now_ns`."""

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Wait for `time_ns` on the held condition `wake`; return False if woken earlier."""

    def read(self, reached_ns: int) -> int:
        """Return the arrival time of an external event; `reached_ns` is the time of the last event."""


class StepClock:
    """Simulated or logged time that jumps from event to event as fast as possible."""

    def start(self, now_ns: int) -> None:
        """Do nothing, since this clock needs no preparation."""

    def wait_until(self, time_ns: int, wake: Condition) -> bool:  # noqa: ARG002
        """Return True at once: the next event is always due."""
        return True

    def read(self, reached_ns: int) -> int:
        """Return the time of the last event."""
        return reached_ns


class PacedClock:
    """Simulated time that runs at a real-time factor of `speed`."""

    def __init__(self, speed: float) -> None:
        self.real_time_factor = speed
        self._wall_0 = 0
        self._time_0 = 0

    def set_real_time_factor(self, speed: float, now_ns: int) -> None:
        """Change the real-time factor of the running loop from `now_ns` on."""
        if speed != self.real_time_factor:
            self.real_time_factor = speed
            self.start(now_ns)

    def start(self, now_ns: int) -> None:
        """Map `now_ns` to the current wall time."""
        self._wall_0, self._time_0 = wall_ns(), now_ns

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Sleep until wall time has caught up with `time_ns`."""
        due = self._wall_0 + (time_ns - self._time_0) / self.real_time_factor
        remaining = (due - wall_ns()) / 1e9
        if remaining < -1.0:  # the machine is too slow: do not run faster later to catch up
            self.start(time_ns)
        return remaining <= 0 or not wake.wait(remaining)

    def read(self, reached_ns: int) -> int:
        """Return the time of the last event."""
        return reached_ns


class LeaderClock(PacedClock):
    """Simulated time that other processes follow: paced, but slower if one of them cannot keep up.

    A machine too slow for all of a launch's processes thus runs them at a lower real-time factor, instead of
    driving the robot with late commands.
    """

    MAX_LEAD_NS = 100_000_000
    """Maximum lead over the slowest follower, ns."""
    FOLLOWER_TIMEOUT = 1.0
    """Wall time after which the clock no longer waits for a follower that reports nothing, s."""

    def __init__(self, speed: float) -> None:
        super().__init__(speed)
        self._reached: dict[str, tuple[int, int]] = {}
        self.total_wait_ns = 0
        """Wall time spent waiting for followers, ns."""

    def set_followers(self, names: Iterable[str]) -> None:
        """Keep only these followers; the clock waits for each one from its first report on."""
        self._reached = {name: report for name, report in self._reached.items() if name in set(names)}

    def report_time(self, name: str, reached_ns: int) -> None:
        """Record the time that a follower has reached; safe from any thread, wake the loop afterwards."""
        self._reached[name] = (reached_ns, wall_ns())

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Wait for the slowest follower, then as paced."""
        if self._is_ahead(time_ns):
            start = wall_ns()
            wake.wait(0.1)
            self.total_wait_ns += wall_ns() - start
            return False
        return super().wait_until(time_ns, wake)

    def _is_ahead(self, time_ns: int) -> bool:
        now = wall_ns()
        return any(
            time_ns - reached > self.MAX_LEAD_NS and now - reported < self.FOLLOWER_TIMEOUT * 1e9
            for reached, reported in list(self._reached.values())
        )


class WallClock:
    """The time of the real robot: calendar time at the start, monotonic from there."""

    def __init__(self) -> None:
        self._offset = 0

    def start(self, now_ns: int) -> None:
        """Map `now_ns` to the monotonic clock, so that steps of the system clock have no effect."""
        self._offset = now_ns - wall_ns()

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Sleep until the clock reaches `time_ns`."""
        remaining = (time_ns - self._offset - wall_ns()) / 1e9
        return remaining <= 0 or not wake.wait(remaining)

    def read(self, reached_ns: int) -> int:
        """Return the current time, but never less than the last event's."""
        return max(reached_ns, wall_ns() + self._offset)


class FollowerClock:
    """Time that another process publishes, such as a simulator's /clock; it jumps from update to update.

    Before it sleeps it calls `reached` with the time up to which all due events are done.
    """

    def __init__(self, now_ns: int, reached: Callable[[int], None] = lambda _: None) -> None:
        self._now_ns = now_ns
        self._reached = reached

    def set_time(self, now_ns: int) -> None:
        """Set the current time; safe from any thread, wake the loop (`loop.post`) afterwards."""
        self._now_ns = max(self._now_ns, now_ns)

    def start(self, now_ns: int) -> None:
        """Start at `now_ns` or the received time, whichever is later."""
        self.set_time(now_ns)

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Sleep until woken, unless the received time has already reached `time_ns`."""
        received = self._now_ns
        if time_ns > received:
            self._reached(received)
            wake.wait()
        return time_ns <= self._now_ns

    def read(self, reached_ns: int) -> int:
        """Return the time received last, but never less than the last event's."""
        return max(reached_ns, self._now_ns)
