"""What STOP means for those who drive by themselves: what it ended does not begin again by itself."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import StopStatus
from chefbot.msgs.std_msgs import Bool

REFUSED = "STOP is pressed. Press Resume, then give the goal again."


def is_pressed(stop: Bool | None) -> bool:
    """By the base's last word; not before it has said one: then nothing drives."""
    return stop is not None and stop.data


def pressed_since(stop: StopStatus | None, time_ns: int) -> bool:
    """Whether STOP was pressed after that, even if it was released again while nobody listened."""
    return stop is not None and (stop.stopped or stop.pressed_at.ns > time_ns)
