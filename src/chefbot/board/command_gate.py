"""Which wheel speeds are passed on to motors whose controller has no session of its own."""

from __future__ import annotations

import math

Speeds = tuple[float, float]
STANDSTILL: Speeds = (0.0, 0.0)
NEVER_NS = -(1 << 62)
COMMAND_TIMEOUT_NS = 100_000_000
"""Maximum age of a command, ns; an older one counts as a stop."""


class CommandGate:
    """Passes on a commanded speed while it is fresh, after a stop was commanded once, and unless it is stopped.

    After a connection or a release of the emergency stop an old command must not start the robot.
    """

    def __init__(self, max_speed: float) -> None:
        """max_speed: of a wheel, rad/s; a faster command is scaled down."""
        self.max_speed = max_speed
        self.stopped = False
        self.reset()

    def reset(self) -> None:
        """Forget the command, and wait for a stop; an emergency stop stays latched."""
        self._target, self._commanded_ns, self._neutral_first = STANDSTILL, NEVER_NS, True

    def command(self, left: float, right: float, now_ns: int) -> None:
        """Set the angular velocities of the wheels, rad/s; values that are not finite are ignored."""
        if not (math.isfinite(left) and math.isfinite(right)):
            return
        # One common factor for both wheels preserves the curvature.
        scale = min(1.0, self.max_speed / max(abs(left), abs(right), self.max_speed))
        self._neutral_first = self._neutral_first and (left, right) != STANDSTILL
        self._target, self._commanded_ns = (left * scale, right * scale), now_ns

    def stop(self) -> None:
        """Latch the emergency stop until `clear`."""
        self.stopped = True

    def clear(self) -> None:
        """Release the emergency stop; the robot drives after a stop was commanded once."""
        self.stopped, self._neutral_first = False, True

    def may_drive(self, now_ns: int) -> bool:
        """Return whether the last command still counts."""
        fresh = now_ns - self._commanded_ns < COMMAND_TIMEOUT_NS
        return fresh and not self.stopped and not self._neutral_first

    def speeds(self, now_ns: int) -> Speeds:
        """Return the angular velocities to drive with, rad/s."""
        return self._target if self.may_drive(now_ns) else STANDSTILL
