"""The three clocks: wall, simulation, log. Only the loop reads them; all count integer nanoseconds."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from threading import Condition
from typing import Protocol


def wall_ns() -> int:
    """Nanoseconds of the monotonic clock: for measuring, and for pacing; never goes back."""
    return time.monotonic_ns()


class Clock(Protocol):
    """Says when the next event may happen."""

    def start(self, now_ns: int) -> None:
        """The loop is about to run from `now_ns` on."""

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Wait for `time_ns`, holding `wake`; False if woken earlier."""

    def read(self, reached_ns: int) -> int:
        """The time at which something that came from outside arrives; `reached_ns` is the last event's."""


class StepClock:
    """Simulated or logged time that jumps from event to event as fast as they are done."""

    def start(self, now_ns: int) -> None:
        """Nothing to prepare."""

    def wait_until(self, time_ns: int, wake: Condition) -> bool:  # noqa: ARG002
        """The next event is always due."""
        return True

    def read(self, reached_ns: int) -> int:
        """Time stands at the last event."""
        return reached_ns


class PacedClock:
    """Simulated time that runs at `speed` times the wall's."""

    def __init__(self, speed: float) -> None:
        self.speed = speed
        self._wall_0 = 0
        self._time_0 = 0

    def change_pace(self, speed: float, now_ns: int) -> None:
        """Of the loop that runs on it, from `now_ns` on."""
        if speed != self.speed:
            self.speed = speed
            self.start(now_ns)

    def start(self, now_ns: int) -> None:
        """Tie `now_ns` to the wall's present."""
        self._wall_0, self._time_0 = wall_ns(), now_ns

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Sleep until the wall has caught up."""
        due = self._wall_0 + (time_ns - self._time_0) / self.speed
        rest = (due - wall_ns()) / 1e9
        if rest < -1.0:  # too slow a machine: do not race to catch up later
            self.start(time_ns)
        return rest <= 0 or not wake.wait(rest)

    def read(self, reached_ns: int) -> int:
        """Simulated time stands at the last event."""
        return reached_ns


class LeadingClock(PacedClock):
    """Simulated time that others follow: at `speed`, and slower whenever one of them cannot keep up.

    So a machine that is too slow for all of a launch's processes runs them at its own pace, instead of driving
    a robot whose thought comes late.
    """

    SLACK_NS = 100_000_000
    """No follower is left further behind than this."""
    PATIENCE = 1.0
    """Seconds of the wall's time after which a follower that says nothing is not waited for any more."""

    def __init__(self, speed: float) -> None:
        super().__init__(speed)
        self._reached: dict[str, tuple[int, int]] = {}
        self.waited_ns = 0
        """Wall time spent waiting for followers."""

    def follow(self, names: Iterable[str]) -> None:
        """Only these follow from now on; each is waited for from its first word on."""
        self._reached = {name: told for name, told in self._reached.items() if name in set(names)}

    def tell(self, name: str, reached_ns: int) -> None:
        """So far a follower has come; any thread, then wake the loop."""
        self._reached[name] = (reached_ns, wall_ns())

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """For the slowest follower, then as paced."""
        if self._is_ahead(time_ns):
            began = wall_ns()
            wake.wait(0.1)
            self.waited_ns += wall_ns() - began
            return False
        return super().wait_until(time_ns, wake)

    def _is_ahead(self, time_ns: int) -> bool:
        now = wall_ns()
        return any(
            time_ns - reached > self.SLACK_NS and now - told < self.PATIENCE * 1e9
            for reached, told in list(self._reached.values())
        )


class WallClock:
    """The time of the real robot; starts at `start_ns` so that stamps are those of the calendar."""

    def __init__(self) -> None:
        self._offset = 0

    def start(self, now_ns: int) -> None:
        """Tie `now_ns` to the monotonic clock; a step of the calendar's clock cannot disturb it."""
        self._offset = now_ns - wall_ns()

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Sleep until then."""
        rest = (time_ns - self._offset - wall_ns()) / 1e9
        return rest <= 0 or not wake.wait(rest)

    def read(self, reached_ns: int) -> int:
        """The present, and never before the last event."""
        return max(reached_ns, wall_ns() + self._offset)


class FollowedClock:
    """Time that another process tells, such as a simulator's /clock; it jumps from one telling to the next.

    `reached` is told, before it sleeps, how far all that was due has been done.
    """

    def __init__(self, now_ns: int, reached: Callable[[int], None] = lambda _: None) -> None:
        self._now_ns = now_ns
        self._reached = reached

    def tell(self, now_ns: int) -> None:
        """From any thread; then wake the loop (`loop.post`)."""
        self._now_ns = max(self._now_ns, now_ns)

    def start(self, now_ns: int) -> None:
        """Never before what has been told."""
        self.tell(now_ns)

    def wait_until(self, time_ns: int, wake: Condition) -> bool:
        """Sleep until something comes, unless the time has been told already."""
        told = self._now_ns
        if time_ns > told:
            self._reached(told)
            wake.wait()
        return time_ns <= self._now_ns

    def read(self, reached_ns: int) -> int:
        """The time last told."""
        return max(reached_ns, self._now_ns)
