"""Where on a map a recording begins: global localization with its first scans."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from chefbot.errors import UserError
from chefbot.localization.start_search import StartSearch
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.params import GmappingParams
from chefbot.slam.recorded_scan import RecordedScan

MAX_UPDATES = 300
"""Updates of the filter after which the search is given up."""


class FoundStart(NamedTuple):
    """The number of the scan at which the place was found, and the pose of the robot in the map then."""

    scan: int
    pose: SE2


def find_start(
    grid: Grid,
    scans: Sequence[RecordedScan],
    sensor: SE2,
    range_max: float,
    progress: Callable[[int, int], None] | None = None,
    advice: str = "",
) -> FoundStart:
    """Return where a recording begins on a map.

    advice: end of the sentence of the UserError that is raised if its scans do not show it.
    """
    search = StartSearch(grid, sensor, GmappingParams().odometry_noise)
    for i, scan in enumerate(scans):
        if progress is not None:
            progress(i, len(scans))
        pose = search.update(scan.angles, scan.ranges, range_max, scan.odom)
        if pose is not None:
            return FoundStart(i, pose)
        if search.updates == MAX_UPDATES:
            break
    raise UserError(
        f"the first {search.updates} scans of the new drive do not show where on the map it begins{advice}"
    )
