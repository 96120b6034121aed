"""The scans of a drive, as the mapper publishes them for the map recorder."""

from __future__ import annotations

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import MappedScan, MapTrajectory
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.slam.graph import GraphSlam
from chefbot.slam.offline import Slam
from chefbot.slam.session import NO_SCAN
from chefbot.storage.mapped_drives import MapperParams, encode_mapper


class DriveMessages:
    """Counts the scans of one drive; its first is number 0."""

    def __init__(self, params: MapperParams, laser: SE2, start: SE2, *, continued: bool) -> None:
        """laser: in base_link. start: pose of the robot in the map at the first scan. continued: there was a map."""
        self._mapper = encode_mapper(params).decode()
        self._laser, self._start, self._continued = laser, start, continued
        self._number = 0

    def next(self, scan: LaserScan, odom: SE2, used: bool) -> MappedScan:
        """Return the message of the next scan; without its beams if it is not part of the map."""
        message = MappedScan(
            scan.header,
            self._number,
            self._continued,
            used,
            odom.array(),
            self._start.array(),
            self._laser.array(),
            scan.range_max,
            scan.angles if used else NO_SCAN,
            scan.ranges if used else NO_SCAN,
            self._mapper,
        )
        self._number += 1
        return message


def trajectory_of(header: Header, slam: Slam) -> MapTrajectory:
    """Return the message of all poses of a mapper's trajectory."""
    poses = np.array([pose.array() for pose in slam.trajectory()]).reshape(-1)
    return MapTrajectory(header, poses, slam.range_offset if isinstance(slam, GraphSlam) else 0.0)
