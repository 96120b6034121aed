"""Stop at a cliff: no motion in the direction of a cliff sensor that sees no floor."""

from __future__ import annotations

from chefbot.msgs.sensor_msgs import Range
from chefbot.robot.spec import Robot
from chefbot.safety.sensor_freshness import CLOCK_TOLERANCE_NS

READING_TIMEOUT_NS = 200_000_000
"""Maximum age of the reading of a cliff sensor, ns: ten periods; an older one counts as a cliff."""


class CliffStop:
    """Limits the forward speed by the readings of the cliff sensors; turning in place remains possible.

    A sensor before the axle forbids driving forward, one behind it driving backward. Without cliff sensors nothing
    is limited. A sensor that sends nothing counts as one that sees no floor.
    """

    def __init__(self, robot: Robot) -> None:
        self._ahead = {frame: s.mount.x >= 0.0 for frame, s in robot.sensors.cliff_sensors.items()}
        self._stamps_ns: dict[str, int] = {}
        self._sees_floor: dict[str, bool] = {}
        self._reported = ""

    def process(self, reading: Range) -> None:
        """Process a reading: -inf is floor within the range (sensor_msgs/Range, fixed distance)."""
        frame = reading.header.frame_id
        if frame in self._ahead:
            self._sees_floor[frame] = reading.range < reading.max_range
            self._stamps_ns[frame] = reading.header.stamp.ns

    def limit(self, v: float, now_ns: int) -> float:
        """Return the forward speed v, m/s, or 0 if it leads over a cliff."""
        return 0.0 if v and self.reason(v, now_ns) else v

    def reason(self, v: float, now_ns: int) -> str:
        """Return why the robot must not drive at v, m/s, a sentence that names the sensor, or an empty string."""
        for frame, ahead in self._ahead.items():
            if ahead != (v > 0.0):
                continue
            name, way = frame.removesuffix("_link"), "forward" if ahead else "backward"
            stamp_ns = self._stamps_ns.get(frame)
            if stamp_ns is None or now_ns - stamp_ns > READING_TIMEOUT_NS:
                return f"Cliff sensor {name} sends nothing: the robot does not drive {way}."
            if stamp_ns - now_ns > CLOCK_TOLERANCE_NS:
                return f"Cliff sensor {name} sends readings from the future: the robot does not drive {way}."
            if not self._sees_floor[frame]:
                return f"Cliff sensor {name} sees no floor: the robot does not drive {way}."
        return ""

    def new_notice(self, v: float, now_ns: int) -> str:
        """Return the reason once when it has changed since the last call, else an empty string."""
        reason = self.reason(v, now_ns) if v else self._reported
        changed, self._reported = reason != self._reported, reason
        return reason if changed else ""
