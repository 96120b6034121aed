"""Whether a robot that makes no progress touches something that its sensors do not see."""

from __future__ import annotations

MIN_DRIVEN_NS = 1_000_000_000
"""Time for which the wheels must have been driven without a pause, ns.

The odometry stands as well if an encoder is silent: the motor board then switches the motors off after 0.2 s with a
noticeable duty, and its report arrives within this time.
"""


class ContactDetector:
    """Watches the twists that the base commands. Times are in ns of the loop's clock."""

    def __init__(self) -> None:
        self._v = 0.0
        self._driven_since: int | None = None

    def process(self, v: float, w: float, now_ns: int) -> None:
        """Take a twist (m/s, rad/s) that the base commands from now on."""
        if v == 0.0 and w == 0.0:
            self._driven_since = None
        elif self._driven_since is None:
            self._driven_since = now_ns
        self._v = v

    def explains(self, stop_reason: str, now_ns: int) -> bool:
        """Return whether a contact explains that there is no progress: the base drives, but the robot does not move.

        stop_reason: the fault for which the base stops, such as motors that the board switched off; empty for none.
        """
        if stop_reason or self._v == 0.0 or self._driven_since is None:
            return False
        return now_ns - self._driven_since >= MIN_DRIVEN_NS
