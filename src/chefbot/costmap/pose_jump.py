"""Detection of jumps of the estimated pose, after which marked obstacles are in the wrong place."""

from __future__ import annotations

import math

from chefbot.maths.se2 import SE2

JUMP_DISTANCE, JUMP_ANGLE = 0.5, 0.26
"""Jump of the estimated pose, m and rad (15 degrees), after which the obstacle layers are cleared."""

SLIP_NS = 10_000_000_000
"""Time after slip of the wheels in which localization corrects what the odometry has lost, ns."""


class PoseJumpDetector:
    """Compares the transform map -> odom with the one at the last jump: slow corrections add up to a jump, too.

    After a contact they do not: the wheels slipped, so the odometry was wrong and the pose on the map was not.
    """

    def __init__(self) -> None:
        self._map_T_odom: SE2 | None = None
        self._slip_until_ns = 0

    def note_contact(self, time_ns: int) -> None:
        """Note that the wheels slipped at an obstacle up to now."""
        self._slip_until_ns = time_ns + SLIP_NS

    def process(self, map_T_odom: SE2, odom_T_sensor: SE2, time_ns: int) -> bool:
        """Return whether the pose has jumped at the sensor: relocalization, a moved robot or a loop closure."""
        reference = self._map_T_odom
        if reference is None:
            self._map_T_odom = map_T_odom
            return False
        jump = (reference @ odom_T_sensor).between(map_T_odom @ odom_T_sensor)
        if math.hypot(jump.x, jump.y) < JUMP_DISTANCE and abs(jump.yaw) < JUMP_ANGLE:
            if time_ns < self._slip_until_ns:
                self._map_T_odom = map_T_odom
            return False
        self._map_T_odom = map_T_odom
        return True
