"""Offline SLAM: map a complete recording."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.carmen import CarmenLogError, CarmenOdom, CarmenScan
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.graph import ClosureResidual, GraphSlam, GraphSlamParams
from chefbot.slam.no_return import NoReturn, detect_no_return
from chefbot.slam.params import GmappingParams


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
    """Correction that all ranges have got, m; the particle filter takes ranges as they are."""


def run_log(
    records: Iterable[CarmenOdom | CarmenScan],
    params: GmappingParams | GraphSlamParams,
    progress: Callable[[int, int], None] | None = None,
) -> SlamResult:
    """Map a recording with the algorithm whose parameters are given.

    Call `progress` after each scan with the numbers of scans done and in total.
    The pose of the laser on the robot is that of the first scan, the map frame the robot's pose at that scan.
    Ranges from `max_range` on are no returns, and so are those that the log itself shows to be: each
    laser has its own number for them. Such beams mark no wall and clear the map up to `clear_range`. Raise
    CarmenLogError if the recording has no scan.
    """
    scans = [record for record in records if isinstance(record, CarmenScan)]
    if not scans:
        raise CarmenLogError("the log holds no FLASER line: give a CARMEN log with laser scans")
    sensor = scans[0].odom.between(scans[0].laser)
    slam = Gmapping(params, sensor) if isinstance(params, GmappingParams) else GraphSlam(params, sensor)
    no_return = detect_no_return(scans)
    range_max = min(params.max_range, no_return.min_range if no_return else math.inf)
    used = []
    for done, scan in enumerate(scans, 1):
        if slam.update(scan.angles, scan.ranges, scan.odom, range_max=range_max):
            used.append(scan)
        if progress is not None:
            progress(done, len(scans))
    if isinstance(slam, GraphSlam):
        slam.finish()
    return SlamResult(
        [scan.stamp for scan in used],
        slam.trajectory(),
        slam.map(),
        len(scans),
        no_return,
        [scans[0].odom.between(scan.odom) for scan in used],
        *((slam.closures(), slam.range_offset) if isinstance(slam, GraphSlam) else ()),
    )


def trajectory_tum(result: SlamResult) -> str:
    """Return one line `t x y z qx qy qz qw` for each processed scan, in the format of the TUM tools."""
    return "".join(
        f"{t:.6f} {p.x:.6f} {p.y:.6f} 0 0 0 {math.sin(p.yaw / 2):.9f} {math.cos(p.yaw / 2):.9f}\n"
        for t, p in zip(result.stamps, result.poses, strict=True)
    )
