"""A map of earlier drives that a mapper continues, and the search for the robot on it."""

from __future__ import annotations

from pathlib import Path

from chefbot.errors import UserError
from chefbot.localization.start_search import StartSearch
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.slam.offline import START_STD_XY, START_STD_YAW, OfflineMapper
from chefbot.storage.mapped_drives import load_drives

MAX_MOUNT_OFFSET = 0.01
"""Distance, m, or angle, rad, by which the laser may be mounted differently than in the earlier drives."""
LOOKING = (
    "The mapper looks for the robot on the map that it continues: drive a few metres, or set the robot's pose"
    " on the map."
)


class ContinuedMap:
    """The map of a bundle, built again from its drives."""

    def __init__(self, path: Path) -> None:
        """Build the map with the mapper that has built it before, a second for about ten minutes of driving.

        Raises UserError if the bundle cannot be read.
        """
        drives = load_drives(path)
        self.params, self._laser = drives.params, SE2.of(drives.sessions[0].laser)
        mapper = OfflineMapper(self.params, self._laser, drives.sessions[0].start_pose)
        for session in drives.sessions:
            mapper.repeat(session)
        self.slam = mapper.slam
        self.given: SE2 | None = None
        """Pose of the robot in the map as an operator has set it, for the next scan."""
        self._search: StartSearch | None = None

    def find(self, laser: SE2, scan: LaserScan, odom: SE2) -> SE2 | None:
        """Return where the robot is at a scan, once that is known; the map is continued from there.

        Raises UserError if the laser is mounted differently than in the earlier drives.
        """
        turn = abs(self._laser.between(laser).yaw)
        if self._laser.distance(laser) > MAX_MOUNT_OFFSET or turn > MAX_MOUNT_OFFSET:
            raise UserError(
                f"The laser is mounted at {laser}, in the drives of the continued map at {self._laser}."
            )
        if self._search is None:
            self._search = StartSearch(self.slam.map(), laser, self.params.odometry_noise)
        found = self._search.update(scan.angles, scan.ranges, scan.range_max, odom)
        pose = found if self.given is None else self.given
        if pose is not None:
            self.slam.relocate(pose, START_STD_XY, START_STD_YAW)
        return pose
