"""Readings of a recorded drive: laser scans with the odometry's pose, and odometry alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2

NO_RETURN = 1e4
"""Range of a beam that is known to have no return, m: more than any laser measures."""


@dataclass(frozen=True)
class RecordedOdometry:
    """The pose of the robot from raw odometry at a time, s."""

    stamp: float
    odom: SE2


@dataclass(frozen=True, eq=False)
class RecordedScan:
    """A laser scan: time in s, angles in rad and ranges in m (n,) float32, poses of laser and robot by raw odometry.

    Angles are counter-clockwise in the frame of the laser. Ranges of 0 or less are invalid.
    """

    stamp: float
    angles: NDArray[np.float32]
    ranges: NDArray[np.float32]
    laser: SE2
    odom: SE2
