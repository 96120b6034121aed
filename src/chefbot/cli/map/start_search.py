"""Where on a map a recording begins: global localization with its first scans."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from chefbot.errors import UserError
from chefbot.localization.amcl import Amcl
from chefbot.localization.params import AmclParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.params import GmappingParams
from chefbot.slam.recorded_scan import RecordedScan

SETTLED_UPDATES = 5
"""Localized updates in a row after which the place counts as found."""
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
) -> FoundStart:
    """Return where a recording begins on a map. Raises UserError if its scans do not show it."""
    amcl = Amcl(AmclParams(odometry_noise=GmappingParams().odometry_noise), grid, sensor)
    settled = updates = 0
    for i, scan in enumerate(scans):
        if progress is not None:
            progress(i, len(scans))
        if not len(scan.ranges) or not amcl.update(scan.angles, scan.ranges, range_max, scan.odom):
            continue
        updates += 1
        settled = settled + 1 if amcl.converged else 0
        if settled == SETTLED_UPDATES:
            return FoundStart(i, amcl.pose)
        if updates == MAX_UPDATES:
            break
    raise UserError(
        f"the first {updates} scans of the new drive do not show where on the map it begins; give --start X Y YAW"
    )
