"""When a robot that waits for people requests to pass."""

from __future__ import annotations

from chefbot.behavior.recovery import WaitingParams

PAUSE_NS = 10_000_000_000
"""Time between two waits up to which they count as one, ns: a recovery behavior or a short drive is between them."""


class PassRequests:
    """Times the requests to pass; waits that follow each other within PAUSE_NS count as one."""

    def __init__(self) -> None:
        self._since_ns = self._waited_ns = -PAUSE_NS - 1
        self._requested_ns: int | None = None

    def waited(self, now_ns: int) -> float:
        """Return the time since the present wait began, s; 0 if the last wait is longer ago than PAUSE_NS."""
        paused = now_ns - self._waited_ns > PAUSE_NS
        return 0.0 if paused else (now_ns - self._since_ns) / 1e9

    def begin(self, now_ns: int) -> None:
        """Begin a wait, or continue the last one if it ended within PAUSE_NS."""
        if now_ns - self._waited_ns > PAUSE_NS:
            self._since_ns = now_ns

    def wait(self, now_ns: int) -> None:
        """Note that the robot waits at this time."""
        self._waited_ns = now_ns

    def are_due(self, now_ns: int, params: WaitingParams) -> bool:
        """Return whether the robot has waited long enough to request to pass."""
        return bool(params.request) and self.waited(now_ns) >= params.request_after

    def take(self, now_ns: int, params: WaitingParams) -> bool:
        """Return whether to make a due request now; if so, the next one is `request_period` later."""
        requested_ns = self._requested_ns
        if requested_ns is not None and now_ns - requested_ns < params.request_period * 1e9:
            return False
        self._requested_ns = now_ns
        return True
