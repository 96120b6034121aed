"""That the controller stands and waits for something: for how long, and that everybody knows why."""

from __future__ import annotations

from chefbot.msgs.std_msgs import String
from chefbot.runtime.node import Out

PATIENCE = 60.0
"""Seconds that the robot stands and waits for a sensor or for localization before the order ends."""

LOST = "I am not sure where I am."


class WaitedTooLong(Exception):  # noqa: N818 (it ends a motion)
    """The robot stood for PATIENCE seconds."""


class Standing:
    """Publishes each reason once, an empty one when the robot goes on; `remark` is for the terminal."""

    def __init__(self, standing: Out[String], remark: Out[String]) -> None:
        self._standing, self._remark = standing, remark
        self._why, self._seconds = "", 0.0

    def wait(self, why: str, dt: float) -> str:
        """Stand for `dt` seconds more; a sentence when that has lasted too long."""
        self._publish(why)
        self._seconds += dt
        return f"{why} I waited {PATIENCE:.0f} s." if self._seconds >= PATIENCE else ""

    def go_on(self) -> None:
        """Nothing is waited for any more."""
        self._seconds = 0.0
        self._publish("")

    def _publish(self, why: str) -> None:
        if why != self._why:
            self._why = why
            self._standing.publish(String(why))
            self._remark.publish(String(f"Standing: {why}" if why else "It stands no longer."))
