"""What the map recorder writes, and the estimated error of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import MappedScan, MapTrajectory
from chefbot.slam.map_error import MapErrorEstimate, estimate_map_error
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import Session
from chefbot.slam.trajectory_adjustment import adjusted_map
from chefbot.storage.atomic_files import make_folder
from chefbot.storage.mapped_drives import MapperParams, files_beside_map
from chefbot.storage.new_map import save_new_map


class MappedDrive:
    """One drive of a map, as far as it has been driven."""

    def __init__(self, first: MappedScan) -> None:
        self._first, self._scans = first, list[tuple[RecordedScan, bool]]()

    def add(self, message: MappedScan) -> None:
        """Add the next scan of the drive."""
        odom = SE2.of(message.odometry)
        stamp, laser = message.header.stamp.ns * 1e-9, odom @ SE2.of(message.laser)
        scan = RecordedScan(stamp, message.angles, message.ranges, laser, odom)
        self._scans.append((scan, message.used))

    def session(self) -> Session:
        """Return the drive up to now; scans may be added meanwhile. Raises ScanError if odometry is not finite."""
        scans, used = zip(*self._scans.copy(), strict=True)
        return Session.of(scans, used, self._first.range_max, SE2.of(self._first.start))


class KeptMap(NamedTuple):
    """What is written: the map, its mapper, the drives that it is made of, and the newest trajectory."""

    grid: Grid
    mapper: MapperParams
    earlier: list[Session]
    drives: list[MappedDrive]
    trajectory: MapTrajectory

    def sessions(self) -> list[Session]:
        """Return all drives. Raises ScanError if odometry is not finite."""
        return [*self.earlier, *(drive.session() for drive in self.drives)]

    def write(self, folder: Path, sessions: Sequence[Session]) -> None:
        """Write map, picture and bundle, whole or not at all."""
        make_folder(folder)
        companions = files_beside_map(self.mapper, sessions, self.grid)
        save_new_map(folder / "map", self.grid, [(folder / name, data) for name, data in companions.items()])

    def adjusted(self, sessions: Sequence[Session]) -> KeptMap:
        """Return the map after a joint adjustment of its poses, or as it is if the mapper has lost some of them.

        Raises ScanError if poses and scans do not fit together.
        """
        poses = [SE2.of(pose) for pose in self.trajectory.poses.reshape(-1, 3)]
        if not poses or len(drives_of(sessions, len(poses))) < len(sessions):
            return self
        result = adjusted_map(up_to_pose(sessions, len(poses)), poses, self.mapper)
        flat = np.array([pose.array() for pose in result.poses]).reshape(-1)
        trajectory = MapTrajectory(self.trajectory.header, flat, result.range_offset)
        return self._replace(grid=result.grid, trajectory=trajectory)

    def error(self, sessions: Sequence[Session]) -> MapErrorEstimate:
        """Return the estimated error of the map. Raises ScanError if the drives do not show it."""
        poses = [SE2.of(pose) for pose in self.trajectory.poses.reshape(-1, 3)]
        return estimate_map_error(drives_of(sessions, len(poses)), poses, self.trajectory.range_offset)


def up_to_pose(sessions: Sequence[Session], poses: int) -> list[Session]:
    """Return the drives with as many used scans as there are poses: scans that came later have none yet."""
    drives, left = list[Session](), poses
    for session in sessions:
        if left > 0:
            drives.append(session.with_used(left))
            left -= int(drives[-1].used.sum())
    return drives


def drives_of(sessions: Sequence[Session], poses: int) -> list[Session]:
    """Return the latest drives with so many used scans: a mapper that has restarted has lost the poses before."""
    drives, used = list[Session](), 0
    for session in reversed(sessions):
        if used >= poses:
            break
        drives.insert(0, session)
        used += int(session.used.sum())
    return drives
