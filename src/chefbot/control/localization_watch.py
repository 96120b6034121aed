"""Whether localization, if there is one, still holds for the distance that the robot drives."""

from __future__ import annotations

from chefbot.control.waiting_state import lost_reason
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus

MAX_UNCONFIRMED_DISTANCE = 0.5
"""Distance without a status of localization after which the robot stands, m; a running one updates every 0.1 m."""
SILENT = "Localization has not updated its pose over {:.1f} m."


class LocalizationWatch:
    """Watches the statuses of localization and the distance driven since the last one; without any there is none."""

    def __init__(self) -> None:
        self._status: LocalizationStatus | None = None
        self._pose: SE2 | None = None
        self._distance = 0.0

    def reason(self, status: LocalizationStatus | None, odom: SE2, pose_ns: int | None, now_ns: int) -> str:
        """Return why the robot must not follow a path, or an empty string.

        status: the latest one; the distance is counted from where it was new. odom: the pose in the odom frame.
        pose_ns: stamp of the newest transform map -> odom, None if it is fixed or not published.
        """
        lost = lost_reason(status, pose_ns, now_ns)
        if status is None:
            return lost
        if status is not self._status:
            self._status, self._pose, self._distance = status, None, 0.0
        if self._pose is not None:
            self._distance += self._pose.distance(odom)
        self._pose = odom
        silent = SILENT.format(MAX_UNCONFIRMED_DISTANCE) if self._distance > MAX_UNCONFIRMED_DISTANCE else ""
        return lost or silent
