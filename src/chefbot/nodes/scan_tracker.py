"""Where a sensor is by its own scans, as they come: good enough to find back to a place."""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.slam.gmapping import Gmapping
from chefbot.slam.params import GmappingParams

FINE = GmappingParams(
    particles=1, linear_update=0.0, angular_update=0.0, sigma=0.03, iterations=8, independent_beams=100.0,
    srr=0.02, str=0.003, srt=0.01, stt=0.02, least_shift=0.002, least_turn=0.001,
)  # fmt: skip
"""One map, every scan, small steps: the room is small and the odometry hardly wrong from scan to scan."""


class ScanTracker:
    """The frame of its poses is the sensor's own at the first scan; where it sits on the robot does not matter."""

    def __init__(self, max_range: float) -> None:
        self._slam = Gmapping(msgspec.structs.replace(FINE, max_range=max_range))

    def add(self, angles: NDArray[np.float32], ranges: NDArray[np.float32], moved: SE2, limit: float) -> SE2:
        """The sensor's place at a scan; `moved`: the same by odometry; `limit`: ranges from here on are none."""
        self._slam.update(angles, ranges, moved, limit)
        return self._slam.pose
