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
from chefbot.slam.no_return import NoReturn, find_no_return
from chefbot.slam.params import GmappingParams


@dataclass(frozen=True, eq=False)
class SlamResult:
    """What a recording gave: stamps (s) and poses of the processed scans in the map frame, and the map."""

    stamps: list[float]
    poses: list[SE2]
    grid: Grid
    scans: int
    """All scans of the recording, processed or not."""
    no_return: NoReturn | None
    """Ranges that the recording's laser writes when nothing is in reach; None: none stand out."""


def run_log(
    records: Iterable[CarmenOdom | CarmenScan],
    params: GmappingParams,
    progress: Callable[[int, int], None] | None = None,
) -> SlamResult:
    """Map a recording; `progress` is told the scans done and in all after each. UserError if it has no scan.

    The laser's place on the robot is that of the first scan, the map frame the robot's pose at that scan.
    Ranges of `max_range` and more are no returns, and so are those that the log itself shows to be: each laser writes
    a number of its own where nothing was in reach. Such beams mark no wall and clear the map up to `clear_range`.
    """
    scans = [r for r in records if isinstance(r, CarmenScan)]
    if not scans:
        raise UserError("the log holds no FLASER line: give a CARMEN log with laser scans")
    slam = Gmapping(params, sensor=scans[0].odom.between(scans[0].laser))
    no_return = find_no_return(scans)
    range_max = min(params.max_range, no_return.least if no_return else math.inf)
    stamps = []
    for done, scan in enumerate(scans, 1):
        if slam.update(scan.angles, scan.ranges, scan.odom, range_max=range_max):
            stamps.append(scan.stamp)
        if progress is not None:
            progress(done, len(scans))
    return SlamResult(stamps, slam.trajectory(), slam.map(), len(scans), no_return)


def trajectory_tum(result: SlamResult) -> str:
    """One line `t x y z qx qy qz qw` for each processed scan, as the TUM tools read it."""
    return "".join(
        f"{t:.6f} {p.x:.6f} {p.y:.6f} 0 0 0 {math.sin(p.yaw / 2):.9f} {math.cos(p.yaw / 2):.9f}\n"
        for t, p in zip(result.stamps, result.poses, strict=True)
    )
