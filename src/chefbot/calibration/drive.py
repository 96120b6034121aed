"""Measurements of a calibration drive: legs between stations at which the sensor scanned the walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2


@dataclass(frozen=True, eq=False)
class DriveSegment:
    """A drive from one station to the next.

    ticks: (n, 2) counts of left and right encoder in order of time.
    gyro: integral of its rate, rad. seconds: duration of that integral, s.
    begin, end: the sensor's pose at both stations, in the frame of its scans. stations: indices of
    both.
    """

    ticks: NDArray[np.float64]
    gyro: float
    seconds: float
    begin: SE2
    end: SE2
    stations: tuple[int, int] = (0, 0)

    def between(self, poses: Sequence[SE2]) -> DriveSegment:
        """Return the leg with updated poses of all stations."""
        first, last = self.stations
        return replace(self, begin=poses[first], end=poses[last])

    @property
    def seen(self) -> SE2:
        """Motion of the sensor from the first scan to the second."""
        return self.begin.between(self.end)


class Square(NamedTuple):
    """A run around a square: four sides and four corners, back to the start pose.

    turn: +1 counter-clockwise, -1 clockwise. side: length of a side, m.
    """

    turn: int
    side: float
    legs: tuple[DriveSegment, ...]

    def between(self, poses: Sequence[SE2]) -> Square:
        """Return the square with updated poses of all stations."""
        return self._replace(legs=tuple(leg.between(poses) for leg in self.legs))

    @property
    def ticks(self) -> NDArray[np.float64]:
        """Encoder counts (n, 2) of the complete square."""
        return np.concatenate([leg.ticks for leg in self.legs])

    @property
    def seen(self) -> SE2:
        """Motion of the sensor from the first station to the last."""
        return self.legs[0].begin.between(self.legs[-1].end)


class Station(NamedTuple):
    """A station at which the robot stood still and scanned.

    pose: of the sensor, as estimated during the drive. walls: (n, 2) m, scanned points in the sensor frame.
    """

    pose: SE2
    walls: NDArray[np.float64]
