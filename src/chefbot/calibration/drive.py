"""What is measured: drives from one stand to the next, at both of which the sensor looked at the walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2


@dataclass(frozen=True, eq=False)
class Leg:
    """One drive from a stand to the next.

    ticks: (n, 2) counts of left and right encoder, one after the other from stand to stand.
    gyro: the sum of its readings times their periods, rad, and over how many seconds that is.
    begin, end: the sensor's pose at both stands, in a frame that its own scans made. stands: their numbers.
    """

    ticks: NDArray[np.float64]
    gyro: float
    seconds: float
    begin: SE2
    end: SE2
    stands: tuple[int, int] = (0, 0)

    def between(self, poses: Sequence[SE2]) -> Leg:
        """The same leg with better poses of all stands."""
        first, last = self.stands
        return replace(self, begin=poses[first], end=poses[last])

    @property
    def seen(self) -> SE2:
        """The sensor's motion by the scans."""
        return self.begin.between(self.end)


class Square(NamedTuple):
    """A run about a square: four sides and four corners, back to where it began and looking as it did.

    turn: +1 if it went round to the left (counter-clockwise), -1 to the right. side: metres.
    """

    turn: int
    side: float
    legs: tuple[Leg, ...]

    def between(self, poses: Sequence[SE2]) -> Square:
        """The same run with better poses of all stands."""
        return self._replace(legs=tuple(leg.between(poses) for leg in self.legs))

    @property
    def ticks(self) -> NDArray[np.float64]:
        """Of the whole run, (n, 2)."""
        return np.concatenate([leg.ticks for leg in self.legs])

    @property
    def seen(self) -> SE2:
        """The sensor's motion from the first stand to the last."""
        return self.legs[0].begin.between(self.legs[-1].end)


class Stand(NamedTuple):
    """Where the robot stood and looked.

    pose: of the sensor, as it was thought on the way. walls: (n, 2) m, what it saw, in the sensor's frame.
    """

    pose: SE2
    walls: NDArray[np.float64]
