"""Waiting state of the controller: reason, duration and timeout."""

from __future__ import annotations

from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import Out

WAIT_TIMEOUT = 60.0
"""Maximum time that the robot waits for a sensor or for localization before its goal fails, s."""

LOST = "Localization lost."


class WaitTimeoutError(Exception):
    """Raised when the robot has waited for WAIT_TIMEOUT seconds."""


class WaitingState:
    """Publishes each reason to wait once, and an empty one when the robot resumes; `remark` is for the terminal."""

    def __init__(self, standing: Out[String], remark: Out[String]) -> None:
        self._standing, self._remark = standing, remark
        self._reason, self._waited = "", 0.0

    def wait(self, reason: str, dt: float) -> str:
        """Wait for another `dt` seconds; return a message once the timeout has passed, else an empty string."""
        self._publish(reason)
        self._waited += dt
        return f"{reason} I waited {WAIT_TIMEOUT:.0f} s." if self._waited >= WAIT_TIMEOUT else ""

    def resume(self) -> None:
        """End the waiting and reset the timeout."""
        self._waited = 0.0
        self._publish("")

    def _publish(self, reason: str) -> None:
        if reason != self._reason:
            self._reason = reason
            self._standing.publish(String(reason))
            self._remark.publish(String(f"Standing: {reason}" if reason else "No longer waiting."))
