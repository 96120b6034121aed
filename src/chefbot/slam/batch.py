"""A whole recording at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.carmen import CarmenOdom, CarmenScan
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams


@dataclass(frozen=True, eq=False)
class SlamResult:
    """What a recording gave: stamps (s) and poses of the processed scans in the map frame, and the map."""

    stamps: list[float]
    poses: list[SE2]
    grid: Grid
    scans: int
    """All scans of the recording, processed or not."""


def run_log(
    records: Iterable[CarmenOdom | CarmenScan],
    params: GmappingParams,
    progress: Callable[[int, int], None] | None = None,
) -> SlamResult:
    """Map a recording; `progress` is told the scans done and in all after each. UserError if it has no scan.

    The laser's place on the robot is that of the first scan, the map frame the robot's pose at that scan.
    Ranges of `max_range` and more are no returns: CARMEN logs write 81.83 and the like for those.
    """
    scans = [r for r in records if isinstance(r, CarmenScan)]
    if not scans:
        raise UserError("the log holds no FLASER line: give a CARMEN log with laser scans")
    slam = Gmapping(params, sensor=scans[0].odom.between(scans[0].laser))
    stamps = []
    for done, scan in enumerate(scans, 1):
        if slam.update(scan.angles, scan.ranges, scan.odom, range_max=params.max_range):
            stamps.append(scan.stamp)
        if progress is not None:
            progress(done, len(scans))
    return SlamResult(stamps, slam.trajectory(), slam.map(), len(scans))


def trajectory_tum(result: SlamResult) -> str:
    """One line `t x y z qx qy qz qw` for each processed scan, as the TUM tools read it."""
    return "".join(
        f"{t:.6f} {p.x:.6f} {p.y:.6f} 0 0 0 {math.sin(p.yaw / 2):.9f} {math.cos(p.yaw / 2):.9f}\n"
        for t, p in zip(result.stamps, result.poses, strict=True)
    )
