"""A map of earlier drives that a mapper continues, and the search for the robot on it."""

from __future__ import annotations

from pathlib import Path

from chefbot.errors import ScanError, UserError
from chefbot.localization.start_search import StartSearch
from chefbot.maths.grid import UNKNOWN
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.slam.agreement import drive_fit
from chefbot.slam.offline import OfflineMapper
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import START_STD_XY, START_STD_YAW
from chefbot.storage.mapped_drives import MapperParams, algorithm_of, load_drives

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
        self.params = drives.params
        self._mapper = OfflineMapper.beginning_with(drives.params, drives.sessions[0])
        for session in drives.sessions:
            self._mapper.repeat(session)
        self.slam = self._mapper.slam
        self._map = self.slam.map()
        self._search: StartSearch | None = None
        self._scans: list[RecordedScan] = []

    def searching(self, settings: MapperParams) -> str:
        """Return what to do until the robot is found, and which mapper continues the map if it is not this one."""
        algorithm = algorithm_of(self.params)
        same = algorithm == algorithm_of(settings)
        return LOOKING if same else f"{LOOKING} The mapper that has built it, {algorithm}, continues it."

    def find(self, laser: SE2, scan: LaserScan, odom: SE2) -> SE2 | None:
        """Return where the robot is at a scan once its scans have shown it, and the map is continued from there.

        Raises UserError if the laser is mounted differently than in the earlier drives, or if the scans do not fit
        the map where they seem to belong; the search begins again then.
        """
        self._check_mount(laser)
        if self._search is None:
            self._search, self._scans = StartSearch(self._map, laser, self.params.odometry_noise), []
        recorded = RecordedScan(scan.header.stamp.ns * 1e-9, scan.angles, scan.ranges, odom @ laser, odom)
        before = self._search.updates
        pose = self._search.update(scan.angles, scan.ranges, scan.range_max, odom)
        if self._search.updates > before:
            self._scans.append(recorded)
        if pose is None:
            return None
        self._search = None
        poses = [pose @ odom.between(earlier.odom) for earlier in self._scans]
        fit = drive_fit(self._map, self._scans, poses, laser, scan.range_max)
        if not fit.is_good:
            raise UserError(
                f"The scans do not fit the map that is continued: {fit.share:.0%} of the beams agree with it. Is it"
                " another building? Set the robot's pose on the map, or drive on."
            )
        self._relocate(pose)
        return pose

    def place(self, laser: SE2, pose: SE2) -> None:
        """Continue the map from a pose that is given. Raises UserError if it is not on the map."""
        self._check_mount(laser)
        row, column = self._map.cell(pose.x, pose.y)
        height, width = self._map.cells.shape
        if not (0 <= row < height and 0 <= column < width) or self._map.cells[row, column] == UNKNOWN:
            raise UserError(
                f"x {pose.x:.2f} m, y {pose.y:.2f} m is not on the known part of the map that is continued;"
                " the pose is ignored."
            )
        self._relocate(pose)

    def _relocate(self, pose: SE2) -> None:
        self.slam.relocate(pose, START_STD_XY, START_STD_YAW)

    def _check_mount(self, laser: SE2) -> None:
        try:
            self._mapper.check_mount(laser)
        except ScanError as error:
            raise UserError(f"No map is made: {error}") from None
