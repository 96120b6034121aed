"""Emergency stop checks for autonomous motions, which do not resume by themselves after a release."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import EmergencyStopStatus
from chefbot.msgs.std_msgs import Bool

REFUSED = "The emergency stop is active. Release STOP, then send the goal again."


def is_pressed(stop: Bool | None) -> bool:
    """Return whether the last emergency stop message is active; False before the first one, when nothing drives."""
    return stop is not None and stop.data


def pressed_since(stop: EmergencyStopStatus | None, time_ns: int) -> bool:
    """Return whether the emergency stop was pressed after `time_ns`, even if it was released again meanwhile."""
    return stop is not None and (stop.active or stop.pressed_at.ns > time_ns)
