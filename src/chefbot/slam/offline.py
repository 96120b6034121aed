"""Offline SLAM: map a complete recording."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from chefbot.errors import ScanError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.carmen import CarmenLogError
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.graph import ClosureResidual, GraphSlam, GraphSlamParams
from chefbot.slam.no_return import NoReturn, detect_no_return
from chefbot.slam.params import GmappingParams
from chefbot.slam.recorded_scan import RecordedOdometry, RecordedScan
from chefbot.slam.session import START_STD_XY, START_STD_YAW, Session
from chefbot.slam.trajectory_adjustment import AdjustedMap, adjusted_map

Slam = Gmapping | GraphSlam
"""Both mappers have the same methods."""
MAX_MOUNT_OFFSET = 0.01
"""Distance, m, or angle, rad, by which the laser of another drive may be mounted differently."""


@dataclass(frozen=True, eq=False)
class SlamResult:
    """The result of a recording: stamps (s) and poses of the processed scans in the map frame, and the map."""

    stamps: list[float]
    poses: list[SE2]
    grid: Grid
    scans: int
    """Number of scans in the recording, processed or not."""
    no_return: NoReturn | None
    """Ranges that the recording's laser reports for no return; None if no value stands out."""
    odometry: list[SE2]
    """Poses of the processed scans by odometry alone, from the identity on."""
    closures: list[ClosureResidual] = field(default_factory=list)
    """Loop closures between processed scans; the particle filter has none of its own."""
    range_offset: float = 0.0
    """Correction that all ranges have got, m."""
    sessions: list[Session] = field(default_factory=list)
    """The drives that the map was built from."""


class OfflineMapper:
    """Maps one recorded drive after the other into one map, with the algorithm whose parameters are given."""

    def __init__(
        self, params: GmappingParams | GraphSlamParams, sensor: SE2, initial: SE2 | None = None
    ) -> None:
        """sensor: pose of the laser in base_link; it is the same in all drives.

        initial: pose of the robot in the map at the first scan, by default the map's origin.
        """
        self.sensor = sensor
        self._params = params
        self._initial, first = initial, IDENTITY if initial is None else initial
        self.slam: Slam = (
            Gmapping(params, sensor, first)
            if isinstance(params, GmappingParams)
            else GraphSlam(params, sensor, first)
        )
        self.sessions: list[Session] = []

    @classmethod
    def beginning_with(cls, params: GmappingParams | GraphSlamParams, first: Session) -> OfflineMapper:
        """Return a mapper for the map that began with this drive, which is still to be repeated."""
        return cls(params, SE2.of(first.laser), first.start_pose)

    def check_mount(self, laser: SE2) -> None:
        """Raise ScanError if the laser of another drive, here in base_link, is mounted differently."""
        turn = abs(self.sensor.between(laser).yaw)
        if self.sensor.distance(laser) > MAX_MOUNT_OFFSET or turn > MAX_MOUNT_OFFSET:
            raise ScanError(
                f"the laser is mounted at {laser.text}, in the map's first drive at {self.sensor.text};"
                " take the robot of that drive, or begin a new map"
            )

    def map_drive(
        self,
        scans: Sequence[RecordedScan],
        range_max: float,
        start: SE2 | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        """Add a drive; start: pose in the map at its first scan, None for the first drive.

        Call `progress` after each scan with the numbers of scans done and in total.
        """
        if start is not None:
            self.slam.relocate(start, START_STD_XY, START_STD_YAW)
        used = []
        for done, scan in enumerate(scans, 1):
            used.append(self.slam.update(scan.angles, scan.ranges, scan.odom, range_max=range_max))
            if progress is not None:
                progress(done, len(scans))
        begin = start if self.sessions else self._initial
        self.sessions.append(Session.of(scans, used, range_max, begin))

    def repeat(self, session: Session, progress: Callable[[int, int], None] | None = None) -> None:
        """Add a drive that was mapped before, as it was then."""
        start = session.start_pose if self.sessions else None
        self.map_drive(list(session.scans()), session.range_max, start, progress)

    def result(self, no_return: NoReturn | None, *, adjusts: bool = True) -> SlamResult:
        """Finish the map, and return it with the poses of all drives; adjusts: whether those of particles are too."""
        adjusted, closures = self._finished(adjusts)
        used = [scan for session in self.sessions for scan in session.scans() if len(scan.ranges)]
        return SlamResult(
            [scan.stamp for scan in used],
            adjusted.poses,
            adjusted.grid,
            sum(len(session.stamps) for session in self.sessions),
            no_return,
            [used[0].odom.between(scan.odom) for scan in used],
            closures,
            adjusted.range_offset,
            self.sessions,
        )

    def _finished(self, adjusts: bool) -> tuple[AdjustedMap, list[ClosureResidual]]:
        """Return the map, after the joint adjustment of all poses if it is wanted, and its loop closures."""
        slam = self.slam
        if isinstance(slam, GraphSlam):
            slam.finish()
            return AdjustedMap(slam.trajectory(), slam.map(), slam.range_offset), slam.closures()
        if not adjusts:
            return AdjustedMap(slam.trajectory(), slam.map(), 0.0), []
        return adjusted_map(self.sessions, slam.trajectory(), self._params), []


def laser_scans(records: Iterable[RecordedOdometry | RecordedScan]) -> list[RecordedScan]:
    """Return the scans of a recording. Raise CarmenLogError if it has none."""
    scans = [record for record in records if isinstance(record, RecordedScan)]
    if not scans:
        raise CarmenLogError("the log holds no FLASER line: give a CARMEN log with laser scans")
    return scans


def maximum_range(scans: Sequence[RecordedScan], max_range: float) -> tuple[float, NoReturn | None]:
    """Return the shortest range that means no return, m, and what the scans themselves show about it.

    Ranges from `max_range` on are no returns, and so are those that the log itself shows to be: each laser has its
    own number for them.
    """
    no_return = detect_no_return(scans)
    return min(max_range, no_return.min_range if no_return else math.inf), no_return


def run_log(
    records: Iterable[RecordedOdometry | RecordedScan],
    params: GmappingParams | GraphSlamParams,
    progress: Callable[[int, int], None] | None = None,
    *,
    adjusts: bool = True,
) -> SlamResult:
    """Map a recording with the algorithm whose parameters are given.

    adjusts: whether the poses of the particle filter are adjusted jointly at the end; those of the graph always are.
    The pose of the laser on the robot is that of the first scan, the map frame the robot's pose at that scan. Beams
    without return mark no wall and clear the map up to `clear_range`. Raise CarmenLogError if the recording has no
    scan.
    """
    scans = laser_scans(records)
    range_max, no_return = maximum_range(scans, params.max_range)
    mapper = OfflineMapper(params, scans[0].odom.between(scans[0].laser))
    mapper.map_drive(scans, range_max, progress=progress)
    return mapper.result(no_return, adjusts=adjusts)


def trajectory_tum(result: SlamResult) -> str:
    """Return one line `t x y z qx qy qz qw` for each processed scan, in the format of the TUM tools."""
    return "".join(
        f"{t:.6f} {p.x:.6f} {p.y:.6f} 0 0 0 {math.sin(p.yaw / 2):.9f} {math.cos(p.yaw / 2):.9f}\n"
        for t, p in zip(result.stamps, result.poses, strict=True)
    )
