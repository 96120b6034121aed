"""Waiting state of the controller: reason, duration and timeout."""

from __future__ import annotations

from chefbot.errors import ChefbotError
from chefbot.msgs.chefbot_msgs import LocalizationStatus

WAIT_TIMEOUT = 60.0
"""Maximum time that the robot waits for a sensor or for localization before its goal fails, s."""

LOST = "Localization lost."
MAX_POSE_AGE_NS = 2_000_000_000
"""Maximum age of the transform map -> odom while a path is followed, ns: the longest step of a process that does not
count as a hang. Localization publishes it for each scan."""
SILENT = f"Localization has sent nothing for {MAX_POSE_AGE_NS / 1e9:.0f} s."


class WaitTimeoutError(ChefbotError):
    """Raised when the robot has waited for WAIT_TIMEOUT seconds."""


def lost_reason(status: LocalizationStatus | None, pose_ns: int | None, now_ns: int) -> str:
    """Return why the pose on the map is not known, or an empty string.

    pose_ns: stamp of the newest transform map -> odom, None if it is fixed or not published.
    """
    if status is not None and not status.localized:
        return LOST
    return SILENT if pose_ns is not None and now_ns - pose_ns > MAX_POSE_AGE_NS else ""


class WaitingState:
    """Stores why and for how long the robot waits; `reason` is empty while it does not wait."""

    def __init__(self) -> None:
        self.reason = ""
        self._reported_reason = ""
        self._waited = 0.0

    def wait(self, reason: str, dt: float) -> str:
        """Wait for another `dt` seconds; return a message once the timeout has passed, else an empty string."""
        self.reason = reason
        self._waited += dt
        return f"{reason} Waited {WAIT_TIMEOUT:.0f} s." if self._waited >= WAIT_TIMEOUT else ""

    def resume(self) -> None:
        """End the waiting and reset the timeout."""
        self.reason, self._waited = "", 0.0

    def new_notice(self) -> str:
        """Return a notice for the terminal if the reason has changed since the last call, else an empty string."""
        if self.reason == self._reported_reason:
            return ""
        self._reported_reason = self.reason
        return f"Waiting: {self.reason}" if self.reason else "No longer waiting."
